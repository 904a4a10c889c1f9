//! How near two airplanes come on their legs, and how deep into each other's zone: horizontally and vertically at once.
//!
//! The severity of a loss of separation is the largest value over time of `min(1 - d/R, 1 - h/H)`, of the horizontal
//! distance `d` and the difference of altitude `h` with the minima `R` and `H` (Sunil et al., "Analysis of Airspace
//! Structure and Capacity for Decentralized Separation Using Fast-Time Simulations", 2017). Between the moments at which
//! `d` turns, which `leg.rs` finds, and that at which both are on one level, each of the two parts only rises or only
//! falls: so the largest value is at an end, or where the two parts are equal.

use super::leg::{ConstantRateLeg, LegPair, ROUNDING_M, SeparationMinima, TimeSpan};

/// Bisections of a moment at which both parts of a severity are equal: a step of an hour is then known to a nanosecond.
const BISECTIONS: usize = 42;

/// The zones of a pair.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PairZones {
    /// The minima of separation.
    pub(crate) separation: SeparationMinima,
    /// The minima below which the two have had a near mid-air collision.
    pub(crate) nmac: SeparationMinima,
}

/// How near two airplanes have come in some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Proximity {
    /// Closest horizontal approach in meters, on whatever levels; infinite without a leg.
    pub(crate) nearest_m: f64,
    /// Difference of altitude at that time, in meters.
    pub(crate) vertical_m: f64,
    /// Severity of the loss of separation, 0 to 1; 0 if there was none.
    pub(crate) severity: f64,
    /// Whether it was a near mid-air collision.
    pub(crate) is_nmac: bool,
}

impl Proximity {
    /// No leg yet.
    pub(crate) const NONE: Self =
        Self { nearest_m: f64::INFINITY, vertical_m: 0.0, severity: 0.0, is_nmac: false };

    /// Adds the part of an interval that two legs have in common.
    pub(crate) fn add_legs(
        &mut self,
        a: &ConstantRateLeg,
        b: &ConstantRateLeg,
        [from_s, until_s]: [f64; 2],
        zones: &PairZones,
    ) {
        let within = TimeSpan {
            from_s: from_s.max(a.from_s).max(b.from_s),
            until_s: until_s.min(a.until_s).min(b.until_s),
        };
        if within.from_s > within.until_s {
            return;
        }
        let pair = LegPair { a, b };
        let mut moments = vec![within.from_s];
        pair.find_extrema(within, &mut moments);
        moments.extend(level_moment_s(a, b, within));
        moments.push(within.until_s);
        moments.sort_unstable_by(f64::total_cmp);
        let samples: Vec<Sample> = moments.iter().map(|&t_s| Sample::new(pair, t_s)).collect();
        for sample in &samples {
            if sample.horizontal_m < self.nearest_m {
                self.nearest_m = sample.horizontal_m;
                self.vertical_m = sample.vertical_m;
            }
        }
        for ends in samples.windows(2) {
            let severity = max_penetration(pair, [&ends[0], &ends[1]], zones.separation);
            self.severity = self.severity.max(severity);
            self.is_nmac |= max_penetration(pair, [&ends[0], &ends[1]], zones.nmac) > 0.0;
        }
    }
}

/// The distances of a pair at one moment.
#[derive(Debug, Clone, Copy)]
struct Sample {
    t_s: f64,
    horizontal_m: f64,
    vertical_m: f64,
}

impl Sample {
    fn new(pair: LegPair<'_>, t_s: f64) -> Self {
        let vertical_m = (pair.a.altitude_at_m(t_s) - pair.b.altitude_at_m(t_s)).abs();
        Self { t_s, horizontal_m: pair.distance_m(t_s), vertical_m }
    }

    /// Returns which fraction of the horizontal minimum is lost, and which of the vertical one; negative outside.
    fn parts(&self, zone: SeparationMinima) -> [f64; 2] {
        // The shield keeps pairs apart by exactly their separation.
        let gap_m = zone.gap_m - ROUNDING_M;
        [1.0 - self.horizontal_m / gap_m, 1.0 - self.vertical_m / zone.vertical_m]
    }

    fn penetration(&self, zone: SeparationMinima) -> f64 {
        let [horizontal, vertical] = self.parts(zone);
        horizontal.min(vertical)
    }
}

/// Returns the moment within an interval at which both are on one level, if there is one.
fn level_moment_s(a: &ConstantRateLeg, b: &ConstantRateLeg, within: TimeSpan) -> Option<f64> {
    let climb_m_s = a.climb_m_s - b.climb_m_s;
    if climb_m_s == 0.0 {
        return None;
    }
    let above_m = a.altitude_at_m(within.from_s) - b.altitude_at_m(within.from_s);
    let t_s = within.from_s - above_m / climb_m_s;
    (within.from_s < t_s && t_s < within.until_s).then_some(t_s)
}

/// Returns the largest penetration of a zone in an interval in which both distances only rise or only fall; 0 if there
/// is none.
fn max_penetration(pair: LegPair<'_>, [first, last]: [&Sample; 2], zone: SeparationMinima) -> f64 {
    let [first_parts, last_parts] = [first, last].map(|sample| sample.parts(zone));
    let is_outside = |part: usize| first_parts[part].max(last_parts[part]) <= 0.0;
    if is_outside(0) || is_outside(1) {
        return 0.0;
    }
    let at_ends = first.penetration(zone).max(last.penetration(zone));
    let rises = [0, 1].map(|part| last_parts[part] > first_parts[part]);
    let is_horizontal_less = |parts: [f64; 2]| parts[0] < parts[1];
    let crosses = is_horizontal_less(first_parts) != is_horizontal_less(last_parts);
    // Where both rise or both fall, no moment between the ends is deeper than both of them.
    if rises[0] == rises[1] || !crosses {
        return at_ends.max(0.0);
    }
    let mut from_s = first.t_s;
    let mut until_s = last.t_s;
    for _ in 0..BISECTIONS {
        let middle_s = 0.5 * (from_s + until_s);
        let parts = Sample::new(pair, middle_s).parts(zone);
        if is_horizontal_less(parts) == is_horizontal_less(first_parts) {
            from_s = middle_s;
        } else {
            until_s = middle_s;
        }
    }
    Sample::new(pair, from_s).penetration(zone).max(at_ends).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::motion::{Point, Pose2};
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    const ZONES: PairZones = PairZones {
        separation: SeparationMinima { gap_m: 500.0, vertical_m: 300.0 },
        nmac: SeparationMinima { gap_m: 152.4, vertical_m: 30.48 },
    };

    fn leg(at: Point, heading_rad: f64, v_m_s: f64, omega_rad_s: f64) -> ConstantRateLeg {
        ConstantRateLeg::new(0.0, 60.0, Pose2 { at, heading_rad }, v_m_s, omega_rad_s)
    }

    fn proximity(a: &ConstantRateLeg, b: &ConstantRateLeg) -> Proximity {
        let mut found = Proximity::NONE;
        found.add_legs(a, b, [0.0, 60.0], &ZONES);
        found
    }

    #[test]
    fn on_one_level_the_severity_is_the_lost_share_of_the_separation() {
        let a = leg([0.0, 0.0], 0.0, 35.0, 0.0);
        let b = leg([2000.0, 200.0], PI, 35.0, 0.0);
        let found = proximity(&a, &b);
        assert!((found.nearest_m - 200.0).abs() < 1e-6 && found.vertical_m == 0.0, "{found:?}");
        // 300 of 500 m are lost, and all of the height.
        assert!((found.severity - 0.6).abs() < 1e-6 && !found.is_nmac, "{found:?}");
    }

    #[test]
    fn the_severity_is_bounded_by_the_height_that_is_left() {
        let a = leg([0.0, 0.0], 0.0, 35.0, 0.0);
        let b = leg([2000.0, 0.0], PI, 35.0, 0.0).with_climb(270.0, 0.0);
        let found = proximity(&a, &b);
        // They meet in a point, 270 m above each other: 30 of 300 m are lost.
        assert!((found.severity - 0.1).abs() < 1e-9 && !found.is_nmac, "{found:?}");
        assert!(found.nearest_m < 1e-6 && found.vertical_m == 270.0, "{found:?}");
        let above = proximity(&a, &b.with_climb(300.0, 0.0));
        assert_eq!((above.severity, above.is_nmac), (0.0, false));
    }

    #[test]
    fn one_that_passes_a_level_has_its_severity_where_both_parts_are_equal() {
        // Side by side at 100 m the second one climbs through the level of the first.
        let a = leg([0.0, 0.0], 0.0, 35.0, 0.0);
        let b = leg([0.0, 100.0], 0.0, 35.0, 0.0).with_climb(-400.0, 20.0);
        let found = proximity(&a, &b);
        // At 20 s they are on one level, and 400 of 500 m are lost; it is a near mid-air collision.
        assert!((found.severity - 0.8).abs() < 1e-6 && found.is_nmac, "{found:?}");
        // Head-on with 70 m/s from 1400 m, they meet after 20 s; it is on their level at 10 s, 700 m before.
        let climbing = leg([1400.0, 0.0], PI, 35.0, 0.0).with_climb(-200.0, 20.0);
        // (1400 - 70 t) / 500 = (20 t - 200) / 300 at t = 5200 / 310.
        let t_s = 520.0 / 31.0;
        let expected = 1.0 - (20.0 * t_s - 200.0) / 300.0;
        let found = proximity(&a, &climbing);
        assert!((found.severity - expected).abs() < 1e-6, "{found:?}, {expected}");
    }

    proptest! {
        /// However two airplanes turn and climb, dense sampling finds nothing nearer and nothing deeper.
        #[test]
        fn no_penetration_of_turning_and_climbing_airplanes_is_missed(
            x in -1500.0f64..1500.0, y in -1500.0f64..1500.0, heading_rad in -3.2f64..3.2,
            v in prop::array::uniform2(5.0f64..120.0), omega in prop::array::uniform2(-0.2f64..0.2),
            wind in prop::array::uniform2(-9.0f64..9.0), above_m in -500.0f64..500.0,
            climb_m_s in -20.0f64..20.0,
        ) {
            let a = leg([0.0, 0.0], 0.0, v[0], omega[0]);
            let b = leg([x, y], heading_rad, v[1], omega[1]).in_wind(wind).with_climb(above_m, climb_m_s);
            let found = proximity(&a, &b);
            let pair = LegPair { a: &a, b: &b };
            let mut sampled = Proximity::NONE;
            for k in 0..=6000 {
                let sample = Sample::new(pair, f64::from(k) * 0.01);
                sampled.nearest_m = sampled.nearest_m.min(sample.horizontal_m);
                sampled.severity = sampled.severity.max(sample.penetration(ZONES.separation));
                sampled.is_nmac |= sample.penetration(ZONES.nmac) > 0.0;
            }
            prop_assert!(found.nearest_m <= sampled.nearest_m + 1e-6, "{found:?}, {sampled:?}");
            prop_assert!(found.severity >= sampled.severity - 1e-6, "{found:?}, {sampled:?}");
            // Within a hundredth of a second they fly at most 2.5 m.
            prop_assert!(found.nearest_m >= sampled.nearest_m - 2.5, "{found:?}, {sampled:?}");
            prop_assert!(found.severity <= sampled.severity + 0.01, "{found:?}, {sampled:?}");
            prop_assert!(found.is_nmac || !sampled.is_nmac, "{found:?}, {sampled:?}");
        }
    }
}
