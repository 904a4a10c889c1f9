//! The units of traffic: those of aviation where a scene is on earth, else those of the scenario.

use crate::ticks::{decimals, label, nice_step};
use sidestep_kernel::view::{Scenery, Vec3};

const NAUTICAL_MILE_M: f64 = 1852.0;
const FOOT_M: f64 = 0.3048;
const KNOT_M_S: f64 = NAUTICAL_MILE_M / 3600.0;
/// Altitude in feet from which levels are told as flight levels: below it, altitudes are above the sea.
const TRANSITION_FT: f64 = 5000.0;
/// Extent in meters from which distances in SI units are in kilometers.
const MIN_KM_EXTENT_M: f64 = 5000.0;
/// Least vertical speed in m/s of a climb or a descent: that of 100 ft/min.
const MIN_CLIMB_M_S: f64 = 100.0 * FOOT_M / 60.0;
/// Symbols of climb and descent after a level.
pub(super) const CLIMB: &str = "\u{2191}";
pub(super) const DESCENT: &str = "\u{2193}";

/// The units of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Units {
    /// Nautical miles, flight levels, feet, knots.
    Aviation,
    /// Meters or kilometers, meters per second.
    Si,
}

impl Units {
    pub(super) fn of_scenery(scenery: &Scenery) -> Self {
        if scenery.earth.chart.is_some() { Self::Aviation } else { Self::Si }
    }

    /// Returns the unit of distances in something of this extent, and its length in meters.
    pub(super) fn distance(self, extent_m: f64) -> (&'static str, f64) {
        match self {
            Self::Aviation => ("NM", NAUTICAL_MILE_M),
            Self::Si if extent_m < MIN_KM_EXTENT_M => ("m", 1.0),
            Self::Si => ("km", 1000.0),
        }
    }

    /// Returns the unit of altitudes at an axis, and its length in meters.
    pub(super) fn altitude(self) -> (&'static str, f64) {
        match self {
            Self::Aviation => ("FL", 100.0 * FOOT_M),
            Self::Si => ("m", 1.0),
        }
    }

    /// Returns an altitude in words.
    pub(super) fn level(self, altitude_m: f64) -> String {
        match self {
            Self::Aviation => {
                let feet = altitude_m / FOOT_M;
                // Rounded first: 4999.7 ft is told as FL050.
                let hundreds = (feet / 100.0).round();
                if hundreds >= TRANSITION_FT / 100.0 {
                    format!("FL{hundreds:03}")
                } else {
                    format!("{} ft", label((feet / 10.0).round() * 10.0, 0))
                }
            }
            Self::Si => format!("{} m", label(altitude_m.round(), 0)),
        }
    }

    /// Returns a speed in words.
    pub(super) fn speed(self, speed_m_s: f64) -> String {
        match self {
            Self::Aviation => format!("{} kt", label((speed_m_s / KNOT_M_S).round(), 0)),
            Self::Si => {
                let digits = decimals(nice_step(speed_m_s.abs().max(1.0), 100)).min(1);
                format!("{} m/s", label(speed_m_s, if speed_m_s >= 20.0 { 0 } else { digits }))
            }
        }
    }

    /// Returns the range of altitudes of an area in words.
    pub(super) fn level_range(self, low_m: Option<f64>, high_m: Option<f64>) -> String {
        let low = low_m.map_or_else(|| "GND".to_string(), |low_m| self.level(low_m));
        let high = high_m.map_or_else(|| "UNL".to_string(), |high_m| self.level(high_m));
        format!("{low}\u{2013}{high}")
    }

    /// Returns what the lines of a data block mean.
    pub(super) fn block_meaning(self) -> &'static str {
        match self {
            Self::Aviation => {
                "data block: call sign; level (FL in 100 ft), \u{2191} climbs, \u{2193} descends; ground speed"
            }
            Self::Si => {
                "data block: name; altitude, \u{2191} climbs, \u{2193} descends; ground speed"
            }
        }
    }
}

/// Returns the symbol of a vertical speed; none in level flight.
pub(super) fn vertical_symbol(climb_m_s: f64) -> &'static str {
    if climb_m_s >= MIN_CLIMB_M_S {
        CLIMB
    } else if climb_m_s <= -MIN_CLIMB_M_S {
        DESCENT
    } else {
        ""
    }
}

/// Returns the speed over the ground of a velocity.
pub(super) fn ground_speed_m_s([east, north, _]: Vec3) -> f64 {
    sidestep_kernel::math::hypot(east, north)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_flight_levels_high_up_and_feet_near_the_ground() {
        let feet = |feet: f64| Units::Aviation.level(feet * FOOT_M);
        assert_eq!([feet(23_040.0), feet(4_999.7), feet(1_236.0)], ["FL230", "FL050", "1240 ft"]);
        assert_eq!(Units::Si.level(3050.2), "3050 m");
        assert_eq!(Units::Aviation.level_range(None, Some(10_000.0 * FOOT_M)), "GND\u{2013}FL100");
        assert_eq!(Units::Si.level_range(Some(900.0), None), "900 m\u{2013}UNL");
    }

    #[test]
    fn speeds_have_the_digits_that_matter() {
        assert_eq!(Units::Aviation.speed(231.5), "450 kt");
        assert_eq!([Units::Si.speed(135.4), Units::Si.speed(12.34)], ["135 m/s", "12.3 m/s"]);
    }

    #[test]
    fn only_what_climbs_or_descends_has_an_arrow() {
        assert_eq!([10.0, 0.1, -0.1, -10.0].map(vertical_symbol), [CLIMB, "", "", DESCENT]);
    }
}
