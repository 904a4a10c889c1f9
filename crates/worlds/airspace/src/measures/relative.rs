//! One airplane as seen from another, and what is predicted of the two if both fly straight on.

use crate::flight::{Point, ROUNDING_M, SeparationMinima};
use sidestep_kernel::geometry::{dot, norm_squared};

/// Place and velocity of an airplane, as seen from another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelativeState {
    /// Place in meters.
    pub at: Point,
    /// Velocity in meters per second.
    pub velocity: Point,
    /// Meters that it is above the other one.
    pub above_m: f64,
    /// Rate at which that grows, in meters per second.
    pub climb_m_s: f64,
}

/// The volume of well clear of a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WellClearMinima {
    /// Largest modified tau in seconds (TTHR).
    pub tau_s: f64,
    /// DMOD and HMD in meters.
    pub horizontal_m: f64,
    /// Vertical threshold in meters (ZTHR).
    pub vertical_m: f64,
}

/// A stretch of time from now on, in seconds; without end where nothing ends it.
#[derive(Debug, Clone, Copy)]
struct Interval {
    from_s: f64,
    until_s: f64,
}

impl Interval {
    const ALWAYS: Self = Self { from_s: f64::NEG_INFINITY, until_s: f64::INFINITY };
}

impl RelativeState {
    /// Returns the time of the closest horizontal approach in seconds, in the past if the two fly apart; 0 if their
    /// distance never changes.
    pub fn closest_approach_s(&self) -> f64 {
        let speed_m2_s2 = norm_squared(self.velocity);
        if speed_m2_s2 == 0.0 { 0.0 } else { -dot(self.at, self.velocity) / speed_m2_s2 }
    }

    /// Returns the horizontal miss distance, in meters: that at the closest approach ahead, or the present distance if
    /// the two fly apart.
    pub fn miss_distance_m(&self) -> f64 {
        self.squared_distance_m2(self.closest_approach_s().max(0.0)).sqrt()
    }

    fn squared_distance_m2(&self, t_s: f64) -> f64 {
        let [x, y] = self.at;
        let [vx, vy] = self.velocity;
        norm_squared([x + vx * t_s, y + vy * t_s])
    }

    /// Returns modified tau in seconds: the time in which the distance would shrink to DMOD, with a floor of 0 within
    /// it. `None` if the two do not approach.
    ///
    /// RTCA DO-185B; Muñoz, Narkawicz, Chamberlain, Consiglio and Upchurch, "A Family of Well-Clear Boundary Models for
    /// the Integration of UAS in the NAS" (2014): `(DMOD² - s·s) / (s·v)`.
    pub fn tau_mod_s(&self, dmod_m: f64) -> Option<f64> {
        let squared_m2 = norm_squared(self.at);
        if squared_m2 <= dmod_m * dmod_m {
            return Some(0.0);
        }
        let closure_m2_s = dot(self.at, self.velocity);
        (closure_m2_s < 0.0).then(|| (dmod_m * dmod_m - squared_m2) / closure_m2_s)
    }

    /// Returns whether the two are not well clear of each other: on levels that are too near, and either nearer than
    /// DMOD, or with a modified tau up to TTHR and a miss distance up to HMD (RTCA DO-365).
    pub fn violates_well_clear(&self, volume: &WellClearMinima) -> bool {
        let WellClearMinima { tau_s, horizontal_m, vertical_m } = *volume;
        if self.above_m.abs() > vertical_m {
            return false;
        }
        let is_inside = norm_squared(self.at) <= horizontal_m * horizontal_m;
        let is_near_in_time = || self.tau_mod_s(horizontal_m).is_some_and(|tau| tau <= tau_s);
        is_inside || (is_near_in_time() && self.miss_distance_m() <= horizontal_m)
    }

    /// Returns whether the two lose separation within some seconds if both fly straight on: state-based conflict
    /// detection as of Hoekstra, van Gent and Ruigrok, "Designing for safety: the 'free flight' air traffic management
    /// concept" (2002), and of BlueSky.
    pub fn is_conflict(&self, minima: SeparationMinima, look_ahead_s: f64) -> bool {
        let Some(beside) = self.horizontal_loss(minima.gap_m - ROUNDING_M) else { return false };
        let Some(level) = self.vertical_loss(minima.vertical_m) else { return false };
        let from_s = beside.from_s.max(level.from_s);
        let until_s = beside.until_s.min(level.until_s);
        from_s < until_s && until_s > 0.0 && from_s < look_ahead_s
    }

    /// Returns when the horizontal distance is below a minimum.
    fn horizontal_loss(&self, gap_m: f64) -> Option<Interval> {
        let speed_m2_s2 = norm_squared(self.velocity);
        let middle_s = self.closest_approach_s();
        let spare_m2 = gap_m * gap_m - self.squared_distance_m2(middle_s);
        if spare_m2 <= 0.0 {
            return None;
        }
        if speed_m2_s2 == 0.0 {
            return Some(Interval::ALWAYS);
        }
        let half_s = (spare_m2 / speed_m2_s2).sqrt();
        Some(Interval { from_s: middle_s - half_s, until_s: middle_s + half_s })
    }

    /// Returns when the difference of altitude is below a minimum.
    fn vertical_loss(&self, vertical_m: f64) -> Option<Interval> {
        if self.climb_m_s == 0.0 {
            return (self.above_m.abs() < vertical_m).then_some(Interval::ALWAYS);
        }
        let [one_s, other_s] =
            [-vertical_m, vertical_m].map(|edge_m| (edge_m - self.above_m) / self.climb_m_s);
        Some(Interval { from_s: one_s.min(other_s), until_s: one_s.max(other_s) })
    }
}

#[cfg(test)]
mod tests {
    use super::super::WellClearVolume;
    use super::*;

    const MINIMA: SeparationMinima = SeparationMinima { gap_m: 500.0, vertical_m: 300.0 };

    fn level(at: Point, velocity: Point) -> RelativeState {
        RelativeState { at, velocity, above_m: 0.0, climb_m_s: 0.0 }
    }

    #[test]
    fn a_head_on_pair_is_in_conflict_from_the_look_ahead_on() {
        // 70 m/s of closure: the gap of 500 m is passed after (at - 500) / 70 seconds.
        for (at_m, is_conflict) in [(500.0 + 70.0 * 59.9, true), (500.0 + 70.0 * 60.1, false)] {
            let pair = level([at_m, 0.0], [-70.0, 0.0]);
            assert_eq!(pair.is_conflict(MINIMA, 60.0), is_conflict, "{at_m}");
            assert!(!level([at_m, 0.0], [70.0, 0.0]).is_conflict(MINIMA, 60.0), "they fly apart");
        }
    }

    #[test]
    fn an_overtaking_pair_is_in_conflict_if_it_passes_nearer_than_the_separation() {
        // 5 m/s faster, 600 m behind and to the side: it is below 500 m after 600/5 - sqrt(500² - side²)/5 seconds.
        assert!(level([600.0, 400.0], [-5.0, 0.0]).is_conflict(MINIMA, 60.1));
        assert!(!level([600.0, 400.0], [-5.0, 0.0]).is_conflict(MINIMA, 59.9));
        assert!(!level([600.0, 500.0], [-5.0, 0.0]).is_conflict(MINIMA, 600.0), "it keeps it");
    }

    #[test]
    fn a_crossing_pair_is_in_conflict_by_its_miss_distance() {
        // Both fly 35 m/s, north and west; the second one is 3000 m east and `ahead` m further north.
        for (ahead_m, is_conflict) in [(2300.0, true), (2292.0, false)] {
            let pair = level([3000.0, ahead_m], [-35.0, -35.0]);
            // Its path passes at |3000 - ahead| / sqrt(2).
            let miss_m = (3000.0 - ahead_m) / 2f64.sqrt();
            assert!((pair.miss_distance_m() - miss_m).abs() < 1e-9);
            assert_eq!(pair.is_conflict(MINIMA, 90.0), is_conflict, "{miss_m}");
        }
    }

    #[test]
    fn a_parallel_pair_is_in_conflict_only_where_it_has_lost_separation() {
        assert!(!level([0.0, 500.0], [0.0, 0.0]).is_conflict(MINIMA, 60.0));
        assert!(level([0.0, 499.0], [0.0, 0.0]).is_conflict(MINIMA, 60.0));
    }

    #[test]
    fn a_pair_on_different_levels_is_in_conflict_while_both_are_lost_at_the_same_time() {
        // Head-on, below 500 m from 10 s to 24.3 s.
        let pair = |above_m, climb_m_s| RelativeState {
            above_m,
            climb_m_s,
            ..level([1200.0, 0.0], [-70.0, 0.0])
        };
        assert!(!pair(300.0, 0.0).is_conflict(MINIMA, 60.0));
        assert!(pair(299.0, 0.0).is_conflict(MINIMA, 60.0));
        // From 600 m above at 10 m/s it is within 300 m after 30 s, at 20 m/s after 15 s.
        assert!(!pair(600.0, -10.0).is_conflict(MINIMA, 60.0));
        assert!(pair(600.0, -20.0).is_conflict(MINIMA, 60.0));
        assert!(!pair(600.0, -20.0).is_conflict(MINIMA, 14.9));
        // One that has left the level of the other before they meet.
        assert!(!pair(0.0, 31.0).is_conflict(MINIMA, 60.0));
    }

    #[test]
    fn modified_tau_is_that_of_the_published_formula() {
        // s = 10,000 m, DMOD = 1219.2 m, closure 200 m/s: (1e8 - 1486448.64) / (10,000 * 200) = 49.25678 s.
        let tau_s = level([10_000.0, 0.0], [-200.0, 0.0]).tau_mod_s(1219.2);
        assert!(tau_s.is_some_and(|tau| (tau - 49.256_775_68).abs() < 1e-6), "{tau_s:?}");
        // s = (3000, 4000), v = (-30, -10): s·s = 25e6, s·v = -130,000; (25e6 - 1486448.64) / 130,000 = 180.87347 s.
        let tau_s = level([3000.0, 4000.0], [-30.0, -10.0]).tau_mod_s(1219.2);
        assert!(tau_s.is_some_and(|tau| (tau - 180.873_472).abs() < 1e-5), "{tau_s:?}");
        assert_eq!(level([1000.0, 0.0], [90.0, 0.0]).tau_mod_s(1219.2), Some(0.0));
        assert_eq!(level([2000.0, 0.0], [90.0, 0.0]).tau_mod_s(1219.2), None);
    }

    #[test]
    fn well_clear_is_lost_by_time_by_distance_and_on_one_level_alone() {
        let volume = WellClearVolume::DO_365.of_pair(MINIMA);
        // Head-on at 200 m/s, tau is 35 s where s² - 7000 s - 1486448.64 = 0: at 7206.2 m.
        let root_m = 3500.0 + (3500.0f64 * 3500.0 + 1_486_448.64).sqrt();
        assert!((root_m - 7206.2).abs() < 0.1, "{root_m}");
        let head_on = |at_m: f64, aside_m: f64| level([at_m, aside_m], [-200.0, 0.0]);
        assert!(head_on(root_m - 0.1, 0.0).violates_well_clear(&volume));
        assert!(!head_on(root_m + 0.1, 0.0).violates_well_clear(&volume));
        // It passes at HMD, and just outside.
        assert!(head_on(6000.0, 1219.2).violates_well_clear(&volume));
        assert!(!head_on(6000.0, 1219.3).violates_well_clear(&volume));
        // Within DMOD they are not well clear even if they fly apart, but not beyond 450 ft.
        let apart = level([1219.0, 0.0], [200.0, 0.0]);
        assert!(apart.violates_well_clear(&volume));
        assert!(RelativeState { above_m: 137.1, ..apart }.violates_well_clear(&volume));
        assert!(!RelativeState { above_m: 137.2, ..apart }.violates_well_clear(&volume));
    }

    #[test]
    fn the_volume_of_small_unmanned_aircraft_has_no_time() {
        let volume = WellClearVolume::F3442.of_pair(MINIMA);
        let at = |at_m: f64| level([at_m, 0.0], [-200.0, 0.0]).violates_well_clear(&volume);
        assert!(at(609.6) && !at(609.7));
        let volume = WellClearVolume::SEPARATION.of_pair(MINIMA);
        assert!(!level([900.0, 500.0], [-70.0, 0.0]).violates_well_clear(&volume));
        assert!(level([900.0, 499.0], [-70.0, 0.0]).violates_well_clear(&volume));
    }
}
