//! Plans: turn rates for one `dt`, and then a fallback forever.

use super::fallback::{Fallback, FallbackPath};
use super::orbit::stays_apart_for;
use super::shielded_aircraft::ShieldedAircraft;
use crate::areas::{PathPiece, profile_pieces};
use crate::flight::{Frame, PairPlane, Point, Pose2, distance_m};
use serde::{Deserialize, Serialize};
use sidestep_kernel::geometry::{add_scaled, norm, sub};
use sidestep_kernel::interrupt;
use std::cell::OnceCell;
use std::sync::Arc;

/// Motion for one `dt`: a turn rate per step of `dtau`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TurnProfile {
    /// Turn rate in each step, in radians per second.
    pub omegas_rad_s: Vec<f64>,
}

impl TurnProfile {
    /// Returns the profile of an airplane's stored fallback for one `dt`, if no gust takes it off that.
    pub(crate) fn on_fallback(aircraft: &ShieldedAircraft, steps: usize) -> Self {
        let omega_rad_s = aircraft.fallback.omega_rad_s(aircraft.orbit_rad_s);
        Self { omegas_rad_s: vec![omega_rad_s; steps] }
    }
}

/// A plan that all airplanes compute for one of them from what all see, so that none has to hear of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CommonPlan {
    /// Number of its profile among those that the method would choose for the airplane: 0 for the preferred one.
    pub candidate: u32,
    /// The motion of one `dt`.
    pub profile: TurnProfile,
    /// The fallback after it.
    pub fallback: Fallback,
}

impl CommonPlan {
    pub(crate) fn to_maneuver(&self, aircraft: ShieldedAircraft, dtau_s: f64) -> SafeManeuver {
        let Self { profile, fallback, .. } = self;
        SafeManeuver::from_source(aircraft, profile, dtau_s, PlanSource::Common, *fallback)
    }
}

/// Where a plan comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum PlanSource {
    /// A candidate of the airplane, by its number.
    Candidate(usize),
    /// The plan that all compute for it from what all see.
    Common,
    /// Its stored fallback.
    Fallback,
}

impl PlanSource {
    /// Returns a number that no other source of the airplane has.
    pub(super) fn number(self) -> u32 {
        match self {
            Self::Common => 0,
            Self::Fallback => 1,
            Self::Candidate(k) => {
                u32::try_from(k + 2).expect("fewer candidates than fit into memory")
            }
        }
    }
}

/// The motion of one `dt`, and a fallback on which the airplane waits after that.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SafeManeuver {
    /// Shared by plans that differ in their fallbacks alone.
    motion: Arc<ProfileMotion>,
    /// What `path` is the path of.
    fallback: Fallback,
    /// The path after `dt`, computed when it is asked for: of many plans it is known already with which ones they are
    /// compatible.
    path: OnceCell<FallbackPath>,
    pub(super) source: PlanSource,
}

/// The motion of an airplane in one `dt`.
#[derive(Debug, PartialEq)]
struct ProfileMotion {
    aircraft: ShieldedAircraft,
    /// Poses at the start of each step, and at the end, in the frame of the airplane.
    poses: Vec<Pose2>,
    omegas_rad_s: Vec<f64>,
    dtau_s: f64,
}

impl ProfileMotion {
    fn new(start: Pose2, aircraft: ShieldedAircraft, omegas_rad_s: Vec<f64>, dtau_s: f64) -> Self {
        let mut poses = Vec::with_capacity(omegas_rad_s.len() + 1);
        let mut pose = start;
        poses.push(pose);
        for &omega in &omegas_rad_s {
            pose = pose.step(aircraft.v_m_s, omega, dtau_s);
            poses.push(pose);
        }
        Self { aircraft, poses, omegas_rad_s, dtau_s }
    }

    fn end_pose(&self) -> Pose2 {
        self.poses[self.poses.len() - 1]
    }

    fn stays_apart(&self, other: &Self, plane: &PairPlane, gap_m: f64) -> bool {
        let closing_m_s = self.aircraft.v_m_s + other.aircraft.v_m_s;
        let pose_distance_m = |k: usize| plane.distance_m(self.poses[k].at, other.poses[k].at);
        // Most pairs are too far apart to come too near within a `dt`, or within a step, however they fly.
        if pose_distance_m(0) - closing_m_s * self.aircraft.dt_s >= gap_m {
            return true;
        }
        (0..self.omegas_rad_s.len()).all(|k| {
            let sum_m = pose_distance_m(k) + pose_distance_m(k + 1);
            if 0.5 * (sum_m - closing_m_s * self.dtau_s) >= gap_m {
                return true;
            }
            let apart_m = |t_s: f64| {
                plane.distance_m(self.position_in_step(k, t_s), other.position_in_step(k, t_s))
            };
            stays_apart_for(&apart_m, self.dtau_s, closing_m_s, gap_m)
        })
    }

    /// Returns the same in different winds, in which the other one drifts as it is seen from this one's air.
    fn stays_apart_in_shear(&self, other: &Self, gap_m: f64) -> bool {
        let drift_m_s = sub(other.aircraft.drift.now_m_s, self.aircraft.drift.now_m_s);
        let closing_m_s = self.aircraft.v_m_s + other.aircraft.v_m_s + norm(drift_m_s);
        (0..self.omegas_rad_s.len()).all(|k| {
            let from_s = k as f64 * self.dtau_s;
            let apart_m = |t_s: f64| {
                let others = add_scaled(other.position_in_step(k, t_s), drift_m_s, from_s + t_s);
                norm(sub(others, self.position_in_step(k, t_s)))
            };
            stays_apart_for(&apart_m, self.dtau_s, closing_m_s, gap_m)
        })
    }

    /// Returns its position some seconds after the start of a step.
    // Inlined, because the search of an approach asks for it twice in each of its steps.
    #[inline]
    fn position_in_step(&self, step: usize, t_s: f64) -> Point {
        self.poses[step].step(self.aircraft.v_m_s, self.omegas_rad_s[step], t_s).at
    }
}

impl SafeManeuver {
    /// Returns a plan: a turn profile, and then a fallback.
    pub(crate) fn new(
        aircraft: ShieldedAircraft,
        profile: &TurnProfile,
        dtau_s: f64,
        fallback: Fallback,
    ) -> Self {
        Self::from_source(aircraft, profile, dtau_s, PlanSource::Fallback, fallback)
    }

    /// Returns the same with its source.
    pub(super) fn from_source(
        aircraft: ShieldedAircraft,
        profile: &TurnProfile,
        dtau_s: f64,
        source: PlanSource,
        fallback: Fallback,
    ) -> Self {
        let start = aircraft.local_pose();
        let motion = ProfileMotion::new(start, aircraft, profile.omegas_rad_s.clone(), dtau_s);
        Self { source, ..Self::from_motion(Arc::new(motion), fallback) }
    }

    fn from_motion(motion: Arc<ProfileMotion>, fallback: Fallback) -> Self {
        Self { motion, fallback, path: OnceCell::new(), source: PlanSource::Fallback }
    }

    fn path(&self) -> &FallbackPath {
        let motion = &self.motion;
        self.path
            .get_or_init(|| motion.aircraft.fallback_path_from(motion.end_pose(), self.fallback))
    }

    /// Returns the same plan with another fallback.
    pub(super) fn with_fallback(&self, fallback: Fallback) -> Self {
        let changed = Self::from_motion(Arc::clone(&self.motion), fallback);
        Self { source: self.source, ..changed }
    }

    /// Returns the stored fallback as a plan, for some steps and forever after them.
    pub(crate) fn on_fallback(aircraft: ShieldedAircraft, steps: usize, dtau_s: f64) -> Self {
        let omega = aircraft.fallback.omega_rad_s(aircraft.orbit_rad_s);
        let rest = aircraft.fallback.after_cycle();
        let start = aircraft.frame.pose_to_local(aircraft.orbit_pose);
        let motion = ProfileMotion::new(start, aircraft, vec![omega; steps], dtau_s);
        Self::from_motion(Arc::new(motion), rest)
    }

    fn aircraft(&self) -> &ShieldedAircraft {
        &self.motion.aircraft
    }

    /// Returns the frame in which it is flown.
    pub(crate) fn frame(&self) -> Frame {
        self.aircraft().frame
    }

    /// Returns the pose at the end of `dt`, where its fallback begins, in the frame of the airplane.
    pub(crate) fn end_pose(&self) -> Pose2 {
        self.motion.end_pose()
    }

    /// Returns the fallback that begins there.
    pub(crate) fn fallback(&self) -> Fallback {
        self.fallback
    }

    /// Returns whether two plans stay apart during `dt` and on the fallbacks forever after it.
    pub(crate) fn is_compatible(&self, other: &Self) -> bool {
        let lead_s = [self, other].map(|plan| plan.path().lead_s());
        let own = self.aircraft();
        let others = other.aircraft();
        if !own.is_protected_from(others) || !own.can_come_too_near(others, lead_s) {
            return true;
        }
        let gap_m = own.required_gap_m(others);
        interrupt::check();
        if own.is_in_shear_with(others) {
            return self.is_compatible_in_shear(other, gap_m);
        }
        let plane = own.pair_plane(others);
        let [path, other_path] = FallbackPath::both_in_plane(&plane, [*self.path(), *other.path()]);
        path.stays_apart(&other_path, gap_m)
            && self.motion.stays_apart(&other.motion, &plane, gap_m)
    }

    /// Returns whether two plans of airplanes in different winds stay apart during `dt`, and after it for as long as the
    /// shield looks ahead, or at least until their stored fallbacks would come too near each other; see `shear.rs`.
    fn is_compatible_in_shear(&self, other: &Self, gap_m: f64) -> bool {
        if !self.motion.stays_apart_in_shear(&other.motion, gap_m) {
            return false;
        }
        let own = self.aircraft();
        let others = other.aircraft();
        let conflict_s = own.path_conflict_with_s(*self.path(), others, *other.path());
        conflict_s == f64::INFINITY
            || conflict_s >= own.fallback_conflict_with_s(own.fallback, others, others.fallback)
    }

    /// Returns whether it keeps apart from another airplane however that one flies, for one `dt`
    /// and on orbits forever after it. Of plans that do not orbit at once after that it is not known.
    pub(crate) fn is_clear_of(&self, other: &ShieldedAircraft) -> bool {
        // Nor where their orbits drift apart or together.
        if !self.fallback.is_orbiting() || self.aircraft().is_in_shear_with(other) {
            return false;
        }
        let ProfileMotion { aircraft, poses, dtau_s, .. } = &*self.motion;
        let (centers, radius_m) = other.reach_discs(aircraft.dt_s);
        let plane = aircraft.pair_plane(other);
        let gap_m = radius_m + aircraft.required_gap_m(other);
        // Between two poses it is within half a step of one of them.
        let half_step_m = 0.5 * aircraft.v_m_s * dtau_s;
        let orbit = self.path().orbit();
        centers.iter().all(|&center| {
            let are_poses_clear =
                poses.iter().all(|pose| plane.distance_m(pose.at, center) >= gap_m + half_step_m);
            let [orbit_center, center] = plane.points(orbit.center(), center);
            are_poses_clear && distance_m(orbit_center, center) >= orbit.radius_m + gap_m
        })
    }

    /// Returns the pieces of its motion in `dt`.
    pub(super) fn motion_pieces(&self) -> Vec<PathPiece> {
        let ProfileMotion { aircraft, poses, omegas_rad_s, dtau_s } = &*self.motion;
        profile_pieces(poses[0], aircraft.v_m_s, omegas_rad_s, *dtau_s)
    }

    /// Returns the pieces of its path, the last of which goes on forever.
    pub(super) fn pieces(&self) -> impl Iterator<Item = PathPiece> {
        let ProfileMotion { omegas_rad_s, dtau_s, .. } = &*self.motion;
        let motion_s = omegas_rad_s.len() as f64 * dtau_s;
        self.motion_pieces().into_iter().chain(self.path().pieces(motion_s))
    }

    /// Returns the number of the candidate, if it is one.
    pub(super) fn candidate(&self) -> Option<usize> {
        match self.source {
            PlanSource::Candidate(k) => Some(k),
            PlanSource::Common | PlanSource::Fallback => None,
        }
    }

    /// Returns whether this is none of the candidates: the search leaves it as it is.
    pub(super) fn is_settled(&self) -> bool {
        !matches!(self.source, PlanSource::Candidate(_))
    }
}
