//! Plans: turn rates for one `dt`, and then an orbit forever.

use super::orbit::{Orbit, OrbitSide, stays_apart_for};
use super::shielded_aircraft::ShieldedAircraft;
use crate::flight::{Frame, PairPlane, Point, Pose2, distance_m};
use serde::{Deserialize, Serialize};
use sidestep_kernel::interrupt;

/// Motion for one `dt`: a turn rate per step of `dtau`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TurnProfile {
    /// Turn rate in each step, in radians per second.
    pub omegas_rad_s: Vec<f64>,
}

/// The motion of one `dt`, and an orbit on which the airplane waits after that.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SafeManeuver {
    aircraft: ShieldedAircraft,
    /// Poses at the start of each step, and at the end, in the frame of the airplane.
    poses: Vec<Pose2>,
    omegas_rad_s: Vec<f64>,
    dtau_s: f64,
    orbit: Orbit,
    /// Number of the candidate, `None` for the fallback.
    pub(super) candidate: Option<usize>,
    pub(super) side: OrbitSide,
}

impl SafeManeuver {
    /// Returns a plan: a turn profile, and then an orbit to a side.
    pub(crate) fn new(
        aircraft: ShieldedAircraft,
        profile: &TurnProfile,
        dtau_s: f64,
        side: OrbitSide,
    ) -> Self {
        Self::from_candidate(aircraft, profile, dtau_s, None, side)
    }

    /// Returns the same for a candidate, by its number.
    pub(super) fn from_candidate(
        aircraft: ShieldedAircraft,
        profile: &TurnProfile,
        dtau_s: f64,
        candidate: Option<usize>,
        side: OrbitSide,
    ) -> Self {
        let flown = Self::from_turn_rates(
            aircraft.local_pose(),
            aircraft,
            profile.omegas_rad_s.clone(),
            dtau_s,
            side,
        );
        Self { candidate, ..flown }
    }

    /// Returns the same plan with an orbit to a side.
    pub(super) fn with_side(&self, side: OrbitSide) -> Self {
        let omega_rad_s = side.sign() * self.aircraft.orbit_rad_s;
        let orbit = Orbit::from_pose(self.end_pose(), self.aircraft.v_m_s, omega_rad_s);
        Self { orbit, side, ..self.clone() }
    }

    fn from_turn_rates(
        start: Pose2,
        aircraft: ShieldedAircraft,
        omegas_rad_s: Vec<f64>,
        dtau_s: f64,
        side: OrbitSide,
    ) -> Self {
        let mut poses = vec![start];
        for &omega in &omegas_rad_s {
            let last = poses[poses.len() - 1];
            poses.push(last.step(aircraft.v_m_s, omega, dtau_s));
        }
        let end = poses[poses.len() - 1];
        let orbit = Orbit::from_pose(end, aircraft.v_m_s, side.sign() * aircraft.orbit_rad_s);
        Self { aircraft, poses, omegas_rad_s, dtau_s, orbit, candidate: None, side }
    }

    /// Returns the stored fallback as a plan, for some steps and forever after them.
    pub(crate) fn fallback(aircraft: ShieldedAircraft, steps: usize, dtau_s: f64) -> Self {
        let omega = aircraft.fallback.sign() * aircraft.orbit_rad_s;
        let side = aircraft.fallback;
        let start = aircraft.frame.pose_to_local(aircraft.orbit_pose);
        Self::from_turn_rates(start, aircraft, vec![omega; steps], dtau_s, side)
    }

    /// Returns the frame in which it is flown.
    pub(crate) fn frame(&self) -> Frame {
        self.aircraft.frame
    }

    /// Returns the pose at the end of `dt`, where the orbit begins, in the frame of the airplane.
    pub(crate) fn end_pose(&self) -> Pose2 {
        self.poses[self.poses.len() - 1]
    }

    pub(crate) fn side(&self) -> OrbitSide {
        self.side
    }

    /// Returns whether two plans stay apart during `dt` and on the orbits forever after it.
    pub(crate) fn is_compatible(&self, other: &Self) -> bool {
        let dt_s = self.dtau_s * self.omegas_rad_s.len() as f64;
        if !self.aircraft.is_protected_from(&other.aircraft)
            || !self.aircraft.can_come_too_near(&other.aircraft, dt_s)
        {
            return true;
        }
        let gap_m = self.aircraft.required_gap_m(&other.aircraft);
        interrupt::check();
        let plane = self.aircraft.pair_plane(&other.aircraft);
        let [own, others] = Orbit::both_in_plane(&plane, [self.orbit, other.orbit]);
        own.stays_apart(&others, gap_m) && self.profiles_stay_apart(other, &plane, gap_m)
    }

    fn profiles_stay_apart(&self, other: &Self, plane: &PairPlane, gap_m: f64) -> bool {
        let closing_m_s = self.aircraft.v_m_s + other.aircraft.v_m_s;
        (0..self.omegas_rad_s.len()).all(|k| {
            let apart_m = |t_s: f64| {
                plane.distance_m(self.position_in_step(k, t_s), other.position_in_step(k, t_s))
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

    /// Returns whether it keeps apart from another airplane however that one flies, for one `dt`
    /// and on orbits forever after it.
    pub(crate) fn is_clear_of(&self, other: &ShieldedAircraft) -> bool {
        let dt_s = self.dtau_s * self.omegas_rad_s.len() as f64;
        let (centers, radius_m) = other.reach_discs(dt_s);
        let plane = self.aircraft.pair_plane(other);
        let gap_m = radius_m + self.aircraft.required_gap_m(other);
        // Between two poses it is within half a step of one of them.
        let half_step_m = 0.5 * self.aircraft.v_m_s * self.dtau_s;
        centers.iter().all(|&center| {
            let are_poses_clear = self
                .poses
                .iter()
                .all(|pose| plane.distance_m(pose.at, center) >= gap_m + half_step_m);
            let [orbit_center, center] = plane.points(self.orbit.center(), center);
            are_poses_clear && distance_m(orbit_center, center) >= self.orbit.radius_m + gap_m
        })
    }

    /// Returns whether this is the stored fallback.
    pub(super) fn is_fallback(&self) -> bool {
        self.candidate.is_none()
    }
}
