//! Phases of recorded flights: whether one climbed, descended, or kept its level.

use super::track::Track;
use serde::{Deserialize, Serialize};

/// Rate of climb or descent in meters per second, 300 feet a minute, below which a flight keeps its level.
const LEVEL_M_S: f64 = 300.0 * 0.3048 / 60.0;
/// Half of the time in seconds over which the rate is taken: recorded altitudes are rounded to 25 feet, which within a
/// second would look like a climb.
const HALF_WINDOW_S: f64 = 30.0;

/// The phase of a flight in the air. Rows on the ground are no traffic, and so there is none for them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum FlightPhase {
    /// It climbs.
    Climb,
    /// It descends.
    Descent,
    /// It keeps its level.
    Cruise,
}

impl FlightPhase {
    /// Returns the phase of two flights together: that of the one that changes its level, a climb before a descent.
    pub(crate) fn both(self, other: Self) -> Self {
        self.min(other)
    }
}

impl Track {
    /// Returns the phase of the flight at a time; before the first point and after the last one, the phase there.
    pub(crate) fn phase_at(&self, t_s: f64) -> FlightPhase {
        let t_s = t_s.clamp(self.start_s(), self.end_s());
        let from_s = (t_s - HALF_WINDOW_S).max(self.start_s());
        let until_s = (t_s + HALF_WINDOW_S).min(self.end_s());
        let climb_m = self.altitude_at_m(until_s) - self.altitude_at_m(from_s);
        let climb_m_s = climb_m / (until_s - from_s);
        match climb_m_s {
            rate if rate > LEVEL_M_S => FlightPhase::Climb,
            rate if rate < -LEVEL_M_S => FlightPhase::Descent,
            _ => FlightPhase::Cruise,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Surface, TrackPoint};
    use super::*;

    /// A flight with a row each second, in steps of 25 feet as transponders report.
    #[test]
    fn the_phase_is_that_of_a_minute_and_not_of_two_rows() {
        let altitude_m = |t_s: f64| {
            let feet = 25.0 * ((t_s - 200.0).clamp(0.0, 200.0) * 25.0 / 25.0).round()
                - 25.0 * ((t_s - 600.0).clamp(0.0, 200.0) * 10.0 / 25.0).round();
            // One that keeps its level between two values is reported now on one and now on the other.
            (feet + 25.0 * (t_s % 2.0)) * 0.3048
        };
        let point = |k: u32| {
            let t_s = f64::from(k);
            TrackPoint { t_s, at: [200.0 * t_s, 0.0], altitude_m: altitude_m(t_s) }
        };
        let track = Track::new(Surface::Plane, (0..1000).map(point).collect()).expect("a track");
        let phases = [-5.0, 100.0, 300.0, 500.0, 700.0, 950.0, 2000.0].map(|t| track.phase_at(t));
        let [climb, descent, level] =
            [FlightPhase::Climb, FlightPhase::Descent, FlightPhase::Cruise];
        assert_eq!(phases, [level, level, climb, level, descent, level, level]);
    }
}
