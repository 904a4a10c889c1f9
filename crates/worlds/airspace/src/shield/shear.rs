//! Pairs that fly in different winds.
//!
//! In one wind all orbits drift alike, and two of them that are apart stay apart. In different winds, which airplanes on
//! different levels may be in, or in different places, orbits drift apart or together without end. The invariant of the
//! shield then has this form:
//!
//! 1. *One wind.* Two airplanes that will be in one wind after this `dt`, and stay there, are kept apart for all time, as
//!    always.
//! 2. *Different winds.* A new plan of one of them, with what the other one stores or plans, is apart for as long as the
//!    shield looks ahead ([`ShieldedAircraft::look_ahead_s`]); or else it comes too near no sooner than the two stored
//!    fallbacks would, so that two who drift together can get out of each other's way. Levels, speeds and fallbacks of
//!    airplanes that come in are changed only to what is apart for as long as the shield looks ahead.
//! 3. *Renewal.* At the start of each `dt`, stored fallbacks that would come too near each other within it are replaced
//!    ([`renewed_fallbacks`]), with the winds that are there by now. Where there are none that are apart the pair is
//!    exempt, and reported, before it flies.
//!
//! So at the start of each `dt` all pairs that are not exempt have fallbacks that stay apart during it, whatever the winds
//! have been before; all plans that are flown come too near no sooner than they; and no pair that has not been reported
//! loses separation. That asks nothing of how winds change from place to place. What is not proved is that there always
//! is a plan: airplanes of constant speed cannot hold their places on orbits that a wind drives together.
//!
//! *Errors.* A renewal compares fallbacks as they are seen, and reports pairs that may be too near by the bounds on errors.
//!
//! Paths are flown in the air of each airplane, and compared in a common air through which each of the two drifts.

use super::drift::PathDrift;
use super::fallback::{Fallback, FallbackPath};
use super::neighbors::neighbors;
use super::orbit::{Orbit, stays_apart_for};
use super::shielded_aircraft::{MARGIN_M, ShieldedAircraft};
use crate::flight::Point;
use sidestep_kernel::geometry::{add_scaled, norm, sub};
use sidestep_kernel::interrupt;

/// Time in seconds below which the search for an approach no longer advances: what is nearer than two airplanes fly in it
/// counts as too near.
const MIN_STEP_S: f64 = 0.01;
/// Meters that new plans of airplanes in different winds keep beside what others keep, so that the renewal, which computes
/// the same path from other poses, never finds it nearer than it has to be.
const SHEAR_MARGIN_M: f64 = 0.1;

/// The path of a fallback through an air that drifts.
#[derive(Debug, Clone, Copy)]
struct DriftingPath {
    path: FallbackPath,
    drift: PathDrift,
    look_ahead_s: f64,
}

impl DriftingPath {
    fn at(&self, t_s: f64) -> Point {
        add_scaled(self.path.at(t_s), self.drift.at_m(t_s), 1.0)
    }

    /// Returns the orbit at its end as it is after some seconds of the path, in the air that it is in by then.
    fn orbit_after(&self, t_s: f64) -> Orbit {
        self.path.orbit().after(t_s - self.path.lead_s()).displaced(self.drift.at_m(t_s))
    }

    fn max_speed_m_s(&self) -> f64 {
        self.path.v_m_s() + self.drift.max_speed_m_s()
    }
}

/// Two paths that begin at one time.
struct DriftingPair {
    paths: [DriftingPath; 2],
    gap_m: f64,
}

impl DriftingPair {
    fn apart_m(&self, t_s: f64) -> f64 {
        let [a, b] = self.paths;
        norm(sub(a.at(t_s), b.at(t_s)))
    }

    fn closing_m_s(&self) -> f64 {
        self.paths.iter().map(DriftingPath::max_speed_m_s).sum()
    }

    /// Returns a time in seconds before which the two are not nearer than the gap; infinite if they never are for as long as
    /// the shield looks ahead, and for all time if they come to be in one wind.
    fn conflict_s(&self) -> f64 {
        let [a, b] = &self.paths;
        let look_ahead_s = a.look_ahead_s.max(b.look_ahead_s);
        let come_to_one_wind = a.drift.next_m_s == b.drift.next_m_s;
        if !come_to_one_wind {
            return self.approach_s([0.0, look_ahead_s]).unwrap_or(f64::INFINITY);
        }
        let steady_s = self
            .paths
            .iter()
            .map(|one| one.path.lead_s().max(one.drift.now_until_s))
            .fold(0.0, f64::max);
        if let Some(conflict_s) = self.approach_s([0.0, steady_s]) {
            return conflict_s;
        }
        if a.orbit_after(steady_s).stays_apart(&b.orbit_after(steady_s), self.gap_m) {
            return f64::INFINITY;
        }
        // Some time they come too near.
        self.approach_s([steady_s, look_ahead_s]).unwrap_or(look_ahead_s.max(steady_s))
    }

    /// Returns a time between two others from which on the two may be nearer than the gap.
    ///
    /// Advances by as long as it takes at least until they are. Never wrongly none.
    fn approach_s(&self, [from_s, until_s]: [f64; 2]) -> Option<f64> {
        let closing_m_s = self.closing_m_s();
        let mut t_s = from_s;
        loop {
            interrupt::check();
            let step_s = (self.apart_m(t_s) - self.gap_m) / closing_m_s;
            if step_s < MIN_STEP_S {
                return Some(t_s);
            }
            t_s += step_s;
            if t_s > until_s {
                return None;
            }
        }
    }
}

impl ShieldedAircraft {
    /// Returns for how long it looks ahead at those in another wind, in seconds: a `dt`, its longest way to an orbit, and one
    /// turn.
    fn look_ahead_s(&self) -> f64 {
        self.dt_s + self.max_lead_s() + std::f64::consts::TAU / self.orbit_rad_s
    }

    /// Returns whether two airplanes are in different winds, or may come to be.
    pub(super) fn is_in_shear_with(&self, other: &Self) -> bool {
        self.drift != other.drift || self.drift.varies_by_place
    }

    /// Returns how far the air may carry it relative to others while it looks ahead, in meters.
    pub(super) fn drift_reach_m(&self) -> f64 {
        match self.drift.max_speed_m_s() {
            // Most scenarios have one wind.
            0.0 => 0.0,
            speed_m_s => speed_m_s * self.look_ahead_s(),
        }
    }

    /// Returns how far apart the air may bring this airplane and another one while they look ahead, in meters.
    pub(super) fn shear_reach_m(&self, other: &Self) -> f64 {
        if self.is_in_shear_with(other) {
            self.drift_reach_m() + other.drift_reach_m()
        } else {
            0.0
        }
    }

    fn drifting_path(&self, path: FallbackPath, drift: PathDrift) -> DriftingPath {
        DriftingPath { path, drift, look_ahead_s: self.look_ahead_s() }
    }

    fn drifting_fallback(&self, fallback: Fallback) -> DriftingPath {
        self.drifting_path(self.fallback_path(fallback), self.drift.drift_from_now(self.dt_s))
    }

    /// Returns when fallbacks of two airplanes in different winds come too near each other, in seconds from now; infinite if
    /// they do not for as long as the shield looks ahead.
    pub(super) fn fallback_conflict_with_s(
        &self,
        fallback: Fallback,
        other: &Self,
        other_fallback: Fallback,
    ) -> f64 {
        let paths = [self.drifting_fallback(fallback), other.drifting_fallback(other_fallback)];
        DriftingPair { paths, gap_m: self.required_gap_m(other) + SHEAR_MARGIN_M }.conflict_s()
    }

    /// Returns the same for paths that begin after this `dt`.
    pub(super) fn path_conflict_with_s(
        &self,
        path: FallbackPath,
        other: &Self,
        other_path: FallbackPath,
    ) -> f64 {
        let paths = [
            self.drifting_path(path, self.drift.drift_after_cycle(self.dt_s)),
            other.drifting_path(other_path, other.drift.drift_after_cycle(other.dt_s)),
        ];
        let gap_m = self.required_gap_m(other) + SHEAR_MARGIN_M;
        self.dt_s + DriftingPair { paths, gap_m }.conflict_s()
    }

    /// Returns whether the fallbacks of two airplanes in different winds stay apart during this `dt`.
    fn do_fallbacks_stay_apart_for_dt(
        &self,
        fallback: Fallback,
        other: &Self,
        other_fallback: Fallback,
    ) -> bool {
        let paths = [self.drifting_fallback(fallback), other.drifting_fallback(other_fallback)];
        // New plans have kept more than that.
        let gap_m = self.required_gap_m(other) - MARGIN_M;
        let pair = DriftingPair { paths, gap_m };
        stays_apart_for(&|t_s| pair.apart_m(t_s), self.dt_s, pair.closing_m_s(), gap_m)
    }
}

/// The fallbacks of a group after a renewal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RenewedFallbacks {
    /// One for each airplane, most of them the stored ones.
    pub(crate) fallbacks: Vec<Fallback>,
    /// Pairs whose fallbacks come too near each other in this `dt` all the same, by their places in the group.
    pub(crate) too_close: Vec<(usize, usize)>,
}

/// Replaces stored fallbacks that come too near each other within this `dt` because winds drive them together, as far as
/// there are others. Returns nothing where none does.
pub(crate) fn renewed_fallbacks(group: &[ShieldedAircraft]) -> Option<RenewedFallbacks> {
    let near = neighbors(group, ShieldedAircraft::fallback_reach_m);
    let mut fallbacks: Vec<Fallback> = group.iter().map(|one| one.fallback).collect();
    let due_pairs = |fallbacks: &[Fallback]| {
        let mut due = Vec::new();
        for (i, others) in near.iter().enumerate() {
            for &j in others.iter().filter(|&&j| i < j && group[i].is_in_shear_with(&group[j])) {
                let [own, other] = [fallbacks[i], fallbacks[j]];
                if !group[i].do_fallbacks_stay_apart_for_dt(own, &group[j], other) {
                    due.push((i, j));
                }
            }
        }
        due
    };
    let due = due_pairs(&fallbacks);
    if due.is_empty() {
        return None;
    }
    let mut changing: Vec<usize> = due.iter().flat_map(|&(i, j)| [i, j]).collect();
    // Those of lower rank give way first.
    changing.sort_unstable_by_key(|&i| group[i].rank);
    changing.dedup();
    for i in changing {
        // When the first other one comes too near: at once, if one in the same wind ever does.
        let conflict_s = |fallback: Fallback| {
            let conflicts_s = near[i].iter().map(|&j| {
                let [own, other] = [&group[i], &group[j]];
                if own.is_in_shear_with(other) {
                    own.fallback_conflict_with_s(fallback, other, fallbacks[j])
                } else if fallback == own.fallback
                    || own.do_fallbacks_stay_apart(fallback, other, fallbacks[j])
                {
                    // The stored one is apart by the invariant.
                    f64::INFINITY
                } else {
                    0.0
                }
            });
            conflicts_s.fold(f64::INFINITY, f64::min)
        };
        let mut best = (conflict_s(fallbacks[i]), fallbacks[i]);
        for &fallback in &*group[i].choices {
            if !group[i].is_as_clear_as(fallback, &group[i]) {
                continue;
            }
            let found_s = conflict_s(fallback);
            if found_s > best.0 {
                best = (found_s, fallback);
            }
        }
        fallbacks[i] = best.1;
    }
    let too_close = due_pairs(&fallbacks);
    Some(RenewedFallbacks { fallbacks, too_close })
}

#[cfg(test)]
mod tests {
    use super::super::drift::AirDrift;
    use super::super::orbit::OrbitSide;
    use super::super::shielded_aircraft::ExemptIds;
    use super::*;
    use crate::flight::{AircraftModel, FlightLevelRange, Frame, Pose2};
    use proptest::prelude::*;

    const DT_S: f64 = 5.0;

    fn aircraft(id: u32, pose: Pose2, v_m_s: f64, drift: AirDrift) -> ShieldedAircraft {
        let orbit_rad_s = 4f64.to_radians();
        let model =
            AircraftModel { v_m_s, omega_max_rad_s: orbit_rad_s, separation_m: 500.0, turns: 5 };
        ShieldedAircraft {
            id,
            frame: Frame::PLANE,
            pose,
            orbit_pose: pose,
            v_m_s,
            omega_max_rad_s: orbit_rad_s,
            orbit_rad_s,
            separation_m: 500.0,
            error_m: 0.0,
            levels: FlightLevelRange::from_level(0.0),
            drift,
            vertical_m: 300.0,
            fallback: Fallback::default(),
            choices: Fallback::choices(&model, orbit_rad_s, DT_S, 60.0),
            dt_s: DT_S,
            exempt: ExemptIds::default(),
            rank: u64::from(id),
            areas: None,
        }
    }

    fn some_aircraft(id: u32) -> impl Strategy<Value = ShieldedAircraft> {
        let place = || -3000.0f64..3000.0;
        let wind = || prop::array::uniform2(-15.0f64..15.0);
        (place(), place(), -3.1f64..3.1, 25.0f64..50.0, wind(), wind(), any::<bool>(), 0usize..14)
            .prop_map(move |(x, y, heading_rad, v_m_s, now, next, is_level, choice)| {
                let next_m_s = if is_level { now } else { next };
                let drift = AirDrift { now_m_s: now, next_m_s, varies_by_place: false };
                let pose = Pose2 { at: [x, y], heading_rad };
                let one = aircraft(id, pose, v_m_s, drift);
                let fallback = one.choices[choice % one.choices.len()];
                ShieldedAircraft { fallback, ..one }
            })
    }

    /// Returns where an airplane on its stored fallback is after some seconds, flown in steps of 0.25 s.
    fn flown(one: &ShieldedAircraft, seconds: f64) -> Vec<Point> {
        let step_s = 0.25;
        let mut pose = one.pose;
        let mut fallback = one.fallback;
        let mut points = vec![pose.at];
        let per_cycle = (DT_S / step_s) as usize;
        for k in 0..(seconds / step_s) as usize {
            if k > 0 && k.is_multiple_of(per_cycle) {
                fallback = fallback.after_cycle();
            }
            let omega_rad_s = fallback.omega_rad_s(one.orbit_rad_s);
            let wind_m_s = if k < per_cycle { one.drift.now_m_s } else { one.drift.next_m_s };
            pose = pose.step(one.v_m_s, omega_rad_s, step_s);
            pose.at = add_scaled(pose.at, wind_m_s, step_s);
            points.push(pose.at);
        }
        points
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        /// Never wrongly later than they come too near: they are flown, each in its winds.
        #[test]
        fn until_a_conflict_that_is_found_two_are_apart(
            a in some_aircraft(0), b in some_aircraft(1), in_one_wind in any::<bool>(),
        ) {
            let mut b = b;
            if in_one_wind {
                b.drift.next_m_s = a.drift.next_m_s;
            }
            let conflict_s = a.fallback_conflict_with_s(a.fallback, &b, b.fallback);
            let paths = [&a, &b].map(|one| flown(one, 300.0));
            let until_s = conflict_s.min(if in_one_wind { 300.0 } else { a.look_ahead_s() });
            for (k, (p, q)) in paths[0].iter().zip(&paths[1]).enumerate() {
                let t_s = 0.25 * k as f64;
                let apart_m = norm(sub(*p, *q));
                prop_assert!(t_s >= until_s || apart_m >= 500.0, "{apart_m} m at {t_s} s, conflict at {conflict_s} s");
            }
            prop_assert_eq!(conflict_s, b.fallback_conflict_with_s(b.fallback, &a, a.fallback));
        }

        /// Whatever a renewal leaves as it is, or names, no other pair comes too near in the cycle.
        #[test]
        fn after_a_renewal_only_pairs_that_are_named_come_too_near_in_the_cycle(
            a in some_aircraft(0), b in some_aircraft(1), c in some_aircraft(2),
        ) {
            let group = [a, b, c];
            let Some(renewed) = renewed_fallbacks(&group) else { return Ok(()) };
            let paths: Vec<Vec<Point>> = group
                .iter()
                .zip(&renewed.fallbacks)
                .map(|(one, &fallback)| flown(&ShieldedAircraft { fallback, ..one.clone() }, DT_S))
                .collect();
            for (i, j) in [(0, 1), (0, 2), (1, 2)] {
                let nearest_m = paths[i].iter().zip(&paths[j]).map(|(p, q)| norm(sub(*p, *q))).fold(f64::INFINITY, f64::min);
                let is_named = renewed.too_close.contains(&(i, j));
                prop_assert!(is_named || nearest_m >= 500.0, "{i} {j}: {nearest_m}");
            }
        }
    }

    /// Two on orbits that a wind drives together: one of them leaves its orbit before they are too near.
    #[test]
    fn a_fallback_that_a_wind_drives_toward_another_one_is_replaced() {
        let drift = |east: f64| AirDrift {
            now_m_s: [east, 0.0],
            next_m_s: [east, 0.0],
            varies_by_place: false,
        };
        let at = |x: f64| Pose2 { at: [x, 0.0], heading_rad: std::f64::consts::PI };
        let left = Fallback::from_side(OrbitSide::Left);
        let west = ShieldedAircraft { fallback: left, ..aircraft(0, at(0.0), 35.0, drift(15.0)) };
        let far = ShieldedAircraft { fallback: left, ..aircraft(1, at(3000.0), 35.0, drift(0.0)) };
        assert_eq!(renewed_fallbacks(&[west.clone(), far]), None);
        // Next it flies toward the other one's side, at 15 m/s more.
        let near = ShieldedAircraft {
            fallback: Fallback::after_straight(6, OrbitSide::Left),
            ..aircraft(1, at(560.0), 35.0, drift(-15.0))
        };
        let renewed = renewed_fallbacks(&[west.clone(), near.clone()]).expect("they come too near");
        assert_ne!(renewed.fallbacks, [west.fallback, near.fallback]);
        assert!(!west.is_in_shear_with(&west));
    }
}
