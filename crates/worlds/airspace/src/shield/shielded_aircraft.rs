//! An airplane as the shield knows it.

use super::drift::AirDrift;
use super::fallback::{Fallback, FallbackPath};
use super::orbit::{Orbit, OrbitSide};
use crate::areas::LocalAreas;
use crate::flight::{FlightLevelRange, Frame, PairPlane, Point, Pose2, Surface, distance_m};
use sidestep_kernel::EntityId;
use std::sync::Arc;

/// Meters that new plans keep in addition to the separation, so that rounding never adds up to a loss.
pub(super) const MARGIN_M: f64 = 0.01;

/// Aircraft, by ascending id, with which the shield does not guarantee separation.
pub(crate) type ExemptIds = Arc<[EntityId]>;

/// An airplane as the shield knows it.
#[derive(Debug, Clone, PartialEq)]
pub struct ShieldedAircraft {
    /// The airplane whose orbit this is. One that may be on several orbits takes part once with
    /// each.
    pub id: EntityId,
    /// The frame in which its motion is computed: that where all see it.
    pub frame: Frame,
    /// Its pose, as all see it, in coordinates of the scenario.
    pub pose: Pose2,
    /// The pose that it would have on its stored fallback without errors of heading, as all see it.
    pub orbit_pose: Pose2,
    /// Airspeed in meters per second.
    pub v_m_s: f64,
    /// Largest turn rate of its plans in radians per second.
    pub omega_max_rad_s: f64,
    /// Turn rate of its orbits in radians per second, at most the largest one.
    pub orbit_rad_s: f64,
    /// Its separation in meters; of two airplanes the larger one counts.
    pub separation_m: f64,
    /// Bound in meters on how far it may be from where all see it, and from its orbit.
    pub error_m: f64,
    /// The levels it keeps or passes in the next `dt`.
    pub levels: FlightLevelRange,
    /// How its air moves relative to that of others.
    pub drift: AirDrift,
    /// Difference of altitude in meters from which on airplanes need not avoid each other.
    pub vertical_m: f64,
    /// Its stored fallback.
    pub fallback: Fallback,
    /// The fallbacks that its plans may end with, in the order in which they are tried.
    pub choices: Arc<[Fallback]>,
    /// Length of a `dt` in seconds.
    pub dt_s: f64,
    /// The others with which it entered too close: with each of them it is left to the method until their fallbacks
    /// are apart.
    pub exempt: Arc<[EntityId]>,
    /// Rank, unique; airplanes of higher rank keep their preferred plans.
    pub rank: u64,
    /// The areas that it may come to, on whatever levels, in its frame.
    pub(crate) areas: LocalAreas,
}

impl ShieldedAircraft {
    /// Returns whether two airplanes are an exempt pair. They are left to the method, because
    /// falling back would bring these two together. For all other pairs the invariant holds, also
    /// for those that one of the two forms with others.
    pub(super) fn is_exempt_with(&self, other: &Self) -> bool {
        self.exempt.binary_search(&other.id).is_ok()
    }

    /// Returns whether two airplanes are on levels that do not meet, or have fallbacks that stay
    /// apart: the pair need no longer be exempt.
    pub(crate) fn is_safe_with(&self, other: &Self) -> bool {
        !self.is_on_same_level(other)
            || self.do_fallbacks_stay_apart(self.fallback, other, other.fallback)
    }

    /// Returns its pose in its frame.
    pub(crate) fn local_pose(&self) -> Pose2 {
        self.frame.pose_to_local(self.pose)
    }

    /// Returns the plane in which it is compared with another airplane.
    pub(super) fn pair_plane(&self, other: &Self) -> PairPlane {
        PairPlane::between(self.frame, other.frame)
    }

    /// Returns the fallback with which it enters: the stored one, unless that takes longer until it orbits than all that
    /// it may choose, because other rules held when it was stored.
    pub(super) fn entry_fallback(&self) -> Fallback {
        if self.may_store(self.fallback) {
            self.fallback
        } else {
            Fallback::from_side(self.fallback.orbit_side)
        }
    }

    /// Returns whether a fallback takes no longer until it orbits than those that it may choose: others are sure to be
    /// out of its reach only then.
    pub(crate) fn may_store(&self, fallback: Fallback) -> bool {
        let cycles = fallback.cycles_until_orbit();
        self.choices.iter().any(|choice| cycles <= choice.cycles_until_orbit())
    }

    /// Returns the path of a fallback that it holds, or that it enters where it is, in its frame.
    pub(crate) fn fallback_path(&self, fallback: Fallback) -> FallbackPath {
        self.fallback_path_from(self.frame.pose_to_local(self.orbit_pose), fallback)
    }

    /// Returns the path of a fallback that it enters at a pose in its frame.
    pub(super) fn fallback_path_from(&self, pose: Pose2, fallback: Fallback) -> FallbackPath {
        FallbackPath::new(pose, self.v_m_s, self.orbit_rad_s, fallback, self.dt_s)
    }

    /// Returns whether a fallback of it and one of another airplane stay apart forever, or, where they are in different
    /// winds, for as long as the shield looks ahead.
    pub(super) fn do_fallbacks_stay_apart(
        &self,
        fallback: Fallback,
        other: &Self,
        other_fallback: Fallback,
    ) -> bool {
        if self.is_in_shear_with(other) {
            let conflict_s = self.fallback_conflict_with_s(fallback, other, other_fallback);
            return conflict_s == f64::INFINITY;
        }
        let paths = [self.fallback_path(fallback), other.fallback_path(other_fallback)];
        let [own, others] = FallbackPath::both_in_plane(&self.pair_plane(other), paths);
        own.stays_apart(&others, self.required_gap_m(other))
    }

    /// Returns the distance in meters that two airplanes have to keep on new plans, as they are
    /// seen.
    pub(super) fn required_gap_m(&self, other: &Self) -> f64 {
        self.separation_m.max(other.separation_m) + self.error_m + other.error_m + MARGIN_M
    }

    /// Returns whether some plans of one `dt`, and fallbacks that orbit after this time, could bring two airplanes too near
    /// each other.
    pub(super) fn can_come_too_near(&self, other: &Self, lead_s: [f64; 2]) -> bool {
        let limit_m = self.required_gap_m(other)
            + self.reach_m(self.dt_s + lead_s[0])
            + other.reach_m(other.dt_s + lead_s[1])
            + self.shear_reach_m(other);
        self.is_within(other, limit_m)
    }

    /// Returns whether all see two airplanes nearer to each other than that.
    pub(super) fn is_within(&self, other: &Self, limit_m: f64) -> bool {
        !self.frame.is_surely_beyond(&other.frame, limit_m) && self.apart_m(other) < limit_m
    }

    /// Returns the longest time until it orbits, on its stored fallback or on one that it may choose, in seconds.
    pub(super) fn max_lead_s(&self) -> f64 {
        let choices = self.choices.iter().map(|choice| choice.cycles_until_orbit());
        let cycles = choices.fold(self.fallback.cycles_until_orbit(), u32::max);
        f64::from(cycles) * self.dt_s
    }

    /// Returns the distance from where it is seen within which its fallbacks, and the gap around them, lie, in meters.
    pub(super) fn fallback_reach_m(&self) -> f64 {
        // The error twice: within one its stored fallback begins, and the other is a part of the gap.
        self.reach_m(self.max_lead_s())
            + self.separation_m
            + 2.0 * self.error_m
            + MARGIN_M
            + self.drift_reach_m()
    }

    /// Returns the same for its plans.
    pub(super) fn plan_reach_m(&self) -> f64 {
        self.fallback_reach_m() + self.v_m_s * self.dt_s
    }

    /// Returns how far from each other all see the two, in meters.
    fn apart_m(&self, other: &Self) -> f64 {
        match self.frame.surface() {
            Surface::Plane => distance_m(self.pose.at, other.pose.at),
            Surface::Earth => distance_m([0.0; 2], self.frame.origin_of(&other.frame).at),
        }
    }

    /// Returns how far it can get from where it is in some seconds and on an orbit after them, in meters.
    fn reach_m(&self, seconds: f64) -> f64 {
        self.v_m_s * seconds + 2.0 * (self.v_m_s / self.orbit_rad_s)
    }

    /// Returns two discs that it cannot leave, however it flies for `dt_s` seconds and to
    /// whichever side it turns forever after that: their centers in its frame, and their radius in meters.
    ///
    /// At any time it is on the circle to its left that it would fly from there, whose center is at
    /// right angles to its heading. Flown straight on, that center ends `v dt` ahead, which is the
    /// center of the disc. A turn shifts the airplane by at most `v omega dt^2 / 2`, and the center
    /// about it by at most `r omega dt`. Earlier it is nearer, because `r omega` is not less than
    /// `v`. The same holds to the right.
    pub(super) fn reach_discs(&self, dt_s: f64) -> ([Point; 2], f64) {
        let ahead = self.local_pose().step(self.v_m_s, 0.0, dt_s);
        let orbit =
            |side: OrbitSide| Orbit::from_pose(ahead, self.v_m_s, side.sign() * self.orbit_rad_s);
        let centers = OrbitSide::BOTH.map(|side| orbit(side).center());
        let turn_rad = self.omega_max_rad_s * dt_s;
        let radius_m = orbit(OrbitSide::Left).radius_m;
        let shift_m = 0.5 * self.v_m_s * dt_s * turn_rad;
        (centers, radius_m * (1.0 + turn_rad) + shift_m)
    }

    /// Returns whether two different airplanes are on levels that meet.
    pub(super) fn is_on_same_level(&self, other: &Self) -> bool {
        let vertical_m = self.vertical_m.max(other.vertical_m);
        self.id != other.id && self.levels.overlaps(&other.levels, vertical_m)
    }

    /// Returns whether the shield keeps two airplanes apart.
    pub(crate) fn is_protected_from(&self, other: &Self) -> bool {
        self.is_on_same_level(other) && !self.is_exempt_with(other)
    }
}
