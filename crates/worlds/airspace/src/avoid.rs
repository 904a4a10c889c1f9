//! Paths that keep clear of non-cooperative aircraft, as far as there are any.
//!
//! No airplane knows where a non-cooperative one is bound for, so no orbit is safe from it forever, and the
//! invariant of the shield is about all others. The guarantee beside it: **an airplane that
//! loses separation from a non-cooperative one is reported with it before.** Within `dt` that one stays in a
//! circle that grows at its greatest speed `s`. A path is *clear* if at each moment `t` of `dt` the
//! airplane is farther than `R + s t` from where the other is at its start, and farther by the
//! bounds on errors. On a clear path there is no loss in this `dt`, however the other flies. If
//! the path that is flown in the end is not clear, the pair is exempt until it is again.
//!
//! It is exempt only if no joint choice of plans of its group would have kept the path clear (`shield/search/joint_plans.rs`).
//!
//! To avoid that as far as possible, an airplane prefers paths that would stay clear for as long as it takes to turn
//! back, if it flew straight on after `dt`, and the other all the time.

use crate::flight::{Point, Pose2, TimeDiscretization, distance_m};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::shield::{CandidateThreats, ShieldedAircraft, TurnProfile, stays_apart_for};
use sidestep_kernel::EntityId;
use sidestep_kernel::geometry::{add_scaled, norm};
use std::f64::consts::PI;

/// The clearance of a path from all others. The derived order prefers clear paths, and then wide margins.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
struct PathClearance {
    /// Whether no other can come too near within `dt`.
    is_clear: bool,
    /// Meters beyond the desired distance, at the closest; at most 0.
    margin_m: f64,
}

/// An airplane among non-cooperative ones.
pub(crate) struct NonCooperativeAvoidance<'a> {
    aircraft: &'a ShieldedAircraft,
    /// Those on its levels, each with what it is in the frame of the airplane.
    others: Vec<(&'a NonCooperativeAircraft, NonCooperativeAircraft)>,
    dtau_s: f64,
}

impl<'a> NonCooperativeAvoidance<'a> {
    pub(crate) fn new(
        aircraft: &'a ShieldedAircraft,
        non_cooperative: impl IntoIterator<Item = &'a NonCooperativeAircraft>,
        dtau_s: f64,
    ) -> Self {
        let others = non_cooperative
            .into_iter()
            .filter(|one| one.levels.overlaps(&aircraft.levels, aircraft.vertical_m))
            .map(|one| (one, one.in_frame(aircraft.frame)))
            .collect();
        Self { aircraft, others, dtau_s }
    }

    /// Returns whether there is nobody on its levels.
    pub(crate) fn is_alone(&self) -> bool {
        self.others.is_empty()
    }

    /// Returns the profiles that an airplane may fly, by their places in `candidates`: those that are better
    /// than its fallback. Clear ones with a full margin keep their order, the others follow by clearance.
    pub(crate) fn allowed_profiles(
        &self,
        candidates: &[TurnProfile],
        fallback: impl FnOnce() -> TurnProfile,
    ) -> Vec<usize> {
        match self.candidate_threats(candidates, fallback) {
            Some(threats) => threats.preferred,
            None => (0..candidates.len()).collect(),
        }
    }

    /// Returns which profiles an airplane prefers to its fallback, likewise, and of whom each is not clear; `None` if there
    /// is nobody on its levels.
    pub(crate) fn candidate_threats(
        &self,
        candidates: &[TurnProfile],
        fallback: impl FnOnce() -> TurnProfile,
    ) -> Option<CandidateThreats> {
        if self.others.is_empty() {
            return None;
        }
        let fallback_result = self.clearance(&fallback());
        let required = fallback_result.0;
        let of_fallback = fallback_result.1;
        let full = PathClearance { is_clear: true, margin_m: 0.0 };
        let mut of_candidates = Vec::with_capacity(candidates.len());
        let mut better: Vec<(usize, PathClearance)> = Vec::new();
        for (k, profile) in candidates.iter().enumerate() {
            let result = self.clearance(profile);
            let clearance = result.0;
            of_candidates.push(result.1);
            if clearance == full || clearance > required {
                better.push((k, clearance));
            }
        }
        // A stable sort by falling clearance.
        better.sort_by(|(_, a), (_, b)| b.partial_cmp(a).unwrap_or(std::cmp::Ordering::Equal));
        let preferred = better.into_iter().map(|(k, _)| k).collect();
        Some(CandidateThreats { preferred, of_candidates, of_fallback })
    }

    /// Returns the others that could come too near on a path within `dt`.
    pub(crate) fn threats<'b>(
        &'b self,
        profile: &'b TurnProfile,
    ) -> impl Iterator<Item = &'a NonCooperativeAircraft> + 'b {
        let poses = self.poses_along(profile);
        let threats =
            self.others.iter().filter(move |(_, one)| !self.is_clear(&poses, profile, one));
        threats.map(|(one, _)| *one)
    }

    /// Returns the clearance of a path, and of whom it is not clear, except for those with which the airplane is an exempt
    /// pair already.
    fn clearance(&self, profile: &TurnProfile) -> (PathClearance, Vec<EntityId>) {
        let poses = self.poses_along(profile);
        let mut is_clear = true;
        let mut margin_m: f64 = 0.0;
        let mut threats = Vec::new();
        for (_, one) in &self.others {
            margin_m = margin_m.min(self.clearance_margin_m(&poses, one));
            if !self.is_clear(&poses, profile, one) {
                is_clear = false;
                if self.aircraft.exempt.binary_search(&one.slot).is_err() {
                    threats.push(one.slot);
                }
            }
        }
        (PathClearance { is_clear, margin_m }, threats)
    }

    /// Returns its poses at the start of each step of a profile, and at the end, in the common air.
    fn poses_along(&self, profile: &TurnProfile) -> Vec<Pose2> {
        let mut poses = vec![self.aircraft.local_pose()];
        let drift_m_s = self.aircraft.drift.now_m_s;
        for &omega in &profile.omegas_rad_s {
            let pose = poses[poses.len() - 1].step(self.aircraft.v_m_s, omega, self.dtau_s);
            poses.push(Pose2 { at: add_scaled(pose.at, drift_m_s, self.dtau_s), ..pose });
        }
        poses
    }

    /// Returns the distance in meters that it has to keep from another one, as both are seen.
    fn required_gap_m(&self, one: &NonCooperativeAircraft) -> f64 {
        self.aircraft.separation_m.max(one.separation_m) + self.aircraft.error_m + one.error_m
    }

    fn is_clear(
        &self,
        poses: &[Pose2],
        profile: &TurnProfile,
        one: &NonCooperativeAircraft,
    ) -> bool {
        let v_m_s = self.aircraft.v_m_s;
        let drift_m_s = self.aircraft.drift.now_m_s;
        profile.omegas_rad_s.iter().zip(poses).enumerate().all(|(k, (&omega, pose))| {
            let step_s = k as f64 * self.dtau_s;
            // The distance from the circle in which the other may be at that time.
            let distance_left_m = |t_s: f64| {
                let at = add_scaled(pose.step(v_m_s, omega, t_s).at, drift_m_s, t_s);
                distance_m(at, one.at) - one.top_m_s * (step_s + t_s)
            };
            stays_apart_for(
                &distance_left_m,
                self.dtau_s,
                v_m_s + norm(drift_m_s) + one.top_m_s,
                self.required_gap_m(one),
            )
        })
    }

    /// Returns the meters beyond the desired distance if it flew straight on after a path, and the other all the
    /// time; at most 0.
    fn clearance_margin_m(&self, poses: &[Pose2], one: &NonCooperativeAircraft) -> f64 {
        let steps = poses.len() - 1;
        let desired_m = self.required_gap_m(one) + one.top_m_s * one.dt_s;
        let during_m = (1..steps)
            .map(|k| distance_m(poses[k].at, one.position_after(k as f64 * self.dtau_s)))
            .fold(f64::INFINITY, f64::min);
        let end = poses[steps];
        let straight = end.step(self.aircraft.v_m_s, 0.0, 1.0).at;
        let after_a_second = add_scaled(straight, self.aircraft.drift.now_m_s, 1.0);
        let [vx, vy] = one.velocity_m_s;
        let relative_velocity =
            [vx - (after_a_second[0] - end.at[0]), vy - (after_a_second[1] - end.at[1])];
        let place = one.position_after(steps as f64 * self.dtau_s);
        let from = [place[0] - end.at[0], place[1] - end.at[1]];
        let half_turn_s = PI / self.aircraft.orbit_rad_s;
        let after_m = closest_approach_to_origin_m(from, relative_velocity, half_turn_s);
        (during_m.min(after_m) - desired_m).min(0.0)
    }
}

/// Returns what non-cooperative aircraft make of the candidates of each airplane of a group; nothing without any.
pub(crate) fn group_threats(
    timing: TimeDiscretization,
    group: &[ShieldedAircraft],
    candidates: &[Vec<TurnProfile>],
    non_cooperative: &[NonCooperativeAircraft],
) -> Vec<Option<CandidateThreats>> {
    if non_cooperative.is_empty() {
        return Vec::new();
    }
    let threats = |(aircraft, candidates): (&ShieldedAircraft, &Vec<TurnProfile>)| {
        let avoidance = NonCooperativeAvoidance::new(aircraft, non_cooperative, timing.dtau_s);
        let fallback = || TurnProfile::on_fallback(aircraft, timing.points_per_dt());
        avoidance.candidate_threats(candidates, fallback)
    };
    group.iter().zip(candidates).map(threats).collect()
}

/// Returns the smallest distance from the origin to a point that moves straight on for some time.
fn closest_approach_to_origin_m(from: Point, velocity: Point, for_s: f64) -> f64 {
    let speed2 = velocity[0] * velocity[0] + velocity[1] * velocity[1];
    let toward = -(from[0] * velocity[0] + from[1] * velocity[1]);
    let at_s = if speed2 > 0.0 { (toward / speed2).clamp(0.0, for_s) } else { 0.0 };
    distance_m([from[0] + velocity[0] * at_s, from[1] + velocity[1] * at_s], [0.0; 2])
}
