//! Ways that keep clear of intruders, as far as there are any.
//!
//! No airplane knows where an intruder wants to go, so no orbit is safe from it forever, and the
//! invariant of the shield is about all others. The promise about intruders: **an airplane that
//! loses separation from an intruder is named with it before.** Within `dt` the intruder stays in a
//! circle that grows at its greatest speed `s`. A way is *clear* if at each moment `t` of `dt` the
//! airplane is farther than `R + s t` from where the intruder is at its start, and farther by the
//! bounds on errors. On a clear way there is no loss in this `dt`, however the intruder flies. If
//! the way that is flown in the end is not clear, the pair is named until it is again.
//!
//! To avoid that as far as possible, an airplane prefers ways that would stay clear for as long as it takes to turn
//! back, if it flew straight on after `dt`, and the intruder all the time.

use crate::flight::{Point, Pose2, distance_m};
use crate::non_cooperative::NonCooperative;
use crate::shield::{ShieldedAircraft, TurnProfile, stays_apart_for};
use std::f64::consts::PI;

/// The clearance of a way from all intruders.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
struct Clearance {
    /// Whether no intruder can come too near within `dt`.
    is_clear: bool,
    /// Meters beyond the distance wanted, at the closest; at most 0.
    spare_m: f64,
}

/// An airplane among intruders.
pub(crate) struct NonCooperativeAvoidance<'a> {
    flyer: &'a ShieldedAircraft,
    /// Intruders on its levels.
    intruders: Vec<&'a NonCooperative>,
    dtau_s: f64,
}

impl<'a> NonCooperativeAvoidance<'a> {
    pub(crate) fn new(flyer: &'a ShieldedAircraft, all: &'a [NonCooperative], dtau_s: f64) -> Self {
        let minds = |one: &&NonCooperative| one.levels.overlaps(&flyer.levels, flyer.vertical_m);
        Self { flyer, intruders: all.iter().filter(minds).collect(), dtau_s }
    }

    /// Returns the ways that an airplane may fly, by their places in `wishes`: those that are better
    /// than its fallback. Ways without fault keep their order, the others follow by merit.
    pub(crate) fn allowed_profiles(
        &self,
        wishes: &[TurnProfile],
        fallback: impl FnOnce() -> TurnProfile,
    ) -> Vec<usize> {
        if self.intruders.is_empty() {
            return (0..wishes.len()).collect();
        }
        let least = self.clearance(&fallback());
        let faultless = Clearance { is_clear: true, spare_m: 0.0 };
        let merits = wishes.iter().map(|way| self.clearance(way)).enumerate();
        let mut better: Vec<(usize, Clearance)> =
            merits.filter(|(_, merit)| *merit == faultless || *merit > least).collect();
        // A stable sort by falling merit.
        better.sort_by(|(_, a), (_, b)| b.partial_cmp(a).unwrap_or(std::cmp::Ordering::Equal));
        better.into_iter().map(|(k, _)| k).collect()
    }

    /// Returns the intruders that could come too near on a way within `dt`.
    pub(crate) fn threats<'b>(
        &'b self,
        way: &'b TurnProfile,
    ) -> impl Iterator<Item = &'a NonCooperative> + 'b {
        let poses = self.poses(way);
        self.intruders.iter().copied().filter(move |one| !self.is_clear(&poses, way, one))
    }

    fn clearance(&self, way: &TurnProfile) -> Clearance {
        let poses = self.poses(way);
        let spare_m = self.intruders.iter().map(|one| self.margin_m(&poses, one));
        Clearance {
            is_clear: self.intruders.iter().all(|one| self.is_clear(&poses, way, one)),
            spare_m: spare_m.fold(0.0, f64::min),
        }
    }

    /// Returns its poses at the start of each step of a way, and at the end.
    fn poses(&self, way: &TurnProfile) -> Vec<Pose2> {
        let mut poses = vec![self.flyer.pose];
        for &omega in &way.omegas_rad_s {
            poses.push(poses[poses.len() - 1].step(self.flyer.v_m_s, omega, self.dtau_s));
        }
        poses
    }

    /// Returns the distance in meters that it has to keep from an intruder, as both are seen.
    fn gap_m(&self, one: &NonCooperative) -> f64 {
        self.flyer.separation_m.max(one.separation_m) + self.flyer.error_m + one.error_m
    }

    fn is_clear(&self, poses: &[Pose2], way: &TurnProfile, one: &NonCooperative) -> bool {
        let ShieldedAircraft { v_m_s, .. } = *self.flyer;
        way.omegas_rad_s.iter().zip(poses).enumerate().all(|(k, (&omega, pose))| {
            let from_s = k as f64 * self.dtau_s;
            let left_m = |t_s: f64| {
                distance_m(pose.step(v_m_s, omega, t_s).at, one.at) - one.top_m_s * (from_s + t_s)
            };
            stays_apart_for(&left_m, self.dtau_s, v_m_s + one.top_m_s, self.gap_m(one))
        })
    }

    /// Returns the meters to spare if it flew straight on after the way, and the intruder all the
    /// time; at most 0.
    fn margin_m(&self, poses: &[Pose2], one: &NonCooperative) -> f64 {
        let steps = poses.len() - 1;
        let wanted_m = self.gap_m(one) + one.top_m_s * one.dt_s;
        let nearest_m =
            |k: usize| distance_m(poses[k].at, one.position_after(k as f64 * self.dtau_s));
        let during_m = (1..steps).map(nearest_m).fold(f64::INFINITY, f64::min);
        let end = poses[steps];
        let ahead = end.step(self.flyer.v_m_s, 0.0, 1.0).at;
        let [vx, vy] = one.velocity_m_s;
        let relative = [vx - (ahead[0] - end.at[0]), vy - (ahead[1] - end.at[1])];
        let place = one.position_after(steps as f64 * self.dtau_s);
        let from = [place[0] - end.at[0], place[1] - end.at[1]];
        let after_m = min_distance_m(from, relative, PI / self.flyer.orbit_rad_s);
        (during_m.min(after_m) - wanted_m).min(0.0)
    }
}

/// Returns the smallest distance from the origin to a point that moves straight on for some time.
fn min_distance_m(from: Point, velocity: Point, for_s: f64) -> f64 {
    let speed2 = velocity[0] * velocity[0] + velocity[1] * velocity[1];
    let toward = -(from[0] * velocity[0] + from[1] * velocity[1]);
    let at_s = if speed2 > 0.0 { (toward / speed2).clamp(0.0, for_s) } else { 0.0 };
    distance_m([from[0] + velocity[0] * at_s, from[1] + velocity[1] * at_s], [0.0; 2])
}
