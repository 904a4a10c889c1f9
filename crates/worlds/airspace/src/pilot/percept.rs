//! Percepts: all that an airplane perceives at the start of a cycle.

use crate::agents::InvalidMessage;
pub use crate::agents::grouping::{SurveillanceReport, TrackedState};
use crate::external_action::ExternalAction;
use crate::flight::{FlightLevelRange, KnownAircraft, MethodCommand, Pose2};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::shield::{Fallback, OrbitTracker, ShieldedAircraft, TurnProfile};
use crate::world::AirspaceWorld;
use serde::{Deserialize, Serialize};
use sidestep_kernel::{Cycle, EntityId};
use std::sync::Arc;

/// Distance in meters beyond which all goals rank alike: about half of the range of 30 bits of a rank, of which
/// refusals have the other half.
const MAX_RANKED_DISTANCE_M: f64 = 5e8;
/// Largest number in those bits; the priority is above them.
const MAX_RANK_M: f64 = ((1u32 << 30) - 1) as f64;
/// Fraction of the distance flown in a `dt` by which a refusal brings an airplane forward in rank, so that it does
/// not wait forever. It is small, so that an airplane near its goal still goes first and is soon gone: to overtake one
/// that is a `dt` nearer takes eight refusals.
const REFUSAL_FRACTION: f64 = 0.125;

/// Everything that an airplane perceives at the start of a cycle: one message. All its other knowledge it has heard,
/// remembers, or finds in the filed flights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Percept {
    /// The cycle for which it decides.
    pub cycle: Cycle,
    /// Its own airplane.
    pub own: OwnshipState,
    /// The airplanes that decide together in this cycle, itself among them, by rising id, as all see them. Where
    /// groups are heard rather than announced, those near it.
    pub group: Vec<SurveillanceReport>,
    /// Non-cooperative airplanes near these, as all see them.
    pub non_cooperative: Vec<NonCooperativeAircraft>,
    /// The exempt pairs of the group, by rising ids; none where airplanes have no common plans.
    pub exempt_pairs: Vec<[EntityId; 2]>,
}

/// An airplane as those aboard know it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnshipState {
    /// Its id, by which the filed flights are found.
    pub id: EntityId,
    /// Its pose by its own instruments, by which it keeps to its fallback.
    pub pose: Pose2,
    /// The pose that it would have on its stored fallback without errors of heading.
    pub orbit_pose: Pose2,
    /// Its pose as all see it, from which it plans.
    pub seen: Pose2,
    /// Its pose on the stored fallback, as all see it.
    pub seen_orbit_pose: Pose2,
    /// Altitude in meters.
    pub altitude_m: f64,
    /// The levels that it keeps or passes in the next `dt`, as far as its change of level is cleared.
    pub levels: FlightLevelRange,
    /// Number of way-points done with.
    pub next: u32,
    /// Number of orders executed.
    pub orders: u32,
    /// The command of its method that is in force.
    pub command: MethodCommand,
    /// Whether its method has to forget the conflicts that it resolves, because the shield has not cleared a command of it.
    pub is_overridden: bool,
    /// Its stored fallback, which it may fly at any time.
    pub fallback: Fallback,
    /// Number of times that the shield has refused its preferred action.
    pub refusals: u32,
    /// The others with which it is an exempt pair, by rising id: the shield guarantees nothing for these pairs.
    pub exempt: Vec<EntityId>,
    /// The action that a caller has ordered for it.
    pub external_action: Option<ExternalAction>,
}

impl OwnshipState {
    /// Returns the state that its group knows once it has sent it.
    pub(crate) fn as_known_aircraft(&self) -> KnownAircraft {
        let &Self { id, seen, next, orders, altitude_m, command, .. } = self;
        KnownAircraft { slot: id, pose: seen, next: next as usize, orders, altitude_m, command }
    }

    /// Returns the airplane as the shield knows it in a cycle: where all see it.
    pub(crate) fn shielded_aircraft(&self, world: &AirspaceWorld, now: Cycle) -> ShieldedAircraft {
        let segment = world.flown_segment(self.id, self.orders, &self.command);
        ShieldedAircraft {
            id: self.id,
            frame: world.surface.frame_at(self.seen.at),
            pose: self.seen,
            orbit_pose: self.seen_orbit_pose,
            v_m_s: segment.model.v_m_s,
            omega_max_rad_s: segment.model.omega_max_rad_s,
            orbit_rad_s: world.orbit_rad_s[self.id as usize],
            separation_m: segment.model.separation_m,
            error_m: world.error_m(self.id as usize),
            levels: self.levels,
            drift: world.air_drift(
                self.seen.at,
                self.altitude_m,
                self.levels.end_of_change_m(self.altitude_m),
            ),
            vertical_m: world.vertical_m,
            fallback: self.fallback,
            choices: Arc::clone(&world.fallbacks[self.id as usize]),
            dt_s: world.timing.dt_s,
            exempt: self.exempt.as_slice().into(),
            rank: priority_rank(
                world,
                // Along the whole route, from where its own instruments see it: others are sent its rank, and do not
                // compute it.
                &KnownAircraft { pose: self.pose, ..self.as_known_aircraft() },
                self.refusals,
            ),
            areas: world.areas_around(self.id, (self.seen.at, self.altitude_m), now),
        }
    }

    /// Returns the turn profile by which it keeps to its stored fallback for one `dt`.
    pub(crate) fn fallback_profile(&self, world: &AirspaceWorld) -> TurnProfile {
        let omega_rad_s = self.fallback.omega_rad_s(world.orbit_rad_s[self.id as usize]);
        let steps = world.timing.points_per_dt();
        let gust_rad = world.bounds.heading_rad;
        if gust_rad == 0.0 {
            return TurnProfile { omegas_rad_s: vec![omega_rad_s; steps] };
        }
        let model = world.flown_segment(self.id, self.orders, &self.command).model;
        let frame = world.surface.fallback_frame(self.orbit_pose, model.v_m_s, omega_rad_s);
        let [pose, orbit_pose] = [self.pose, self.orbit_pose].map(|pose| frame.pose_to_local(pose));
        let tracker = OrbitTracker::new(pose, orbit_pose, &model, omega_rad_s);
        TurnProfile { omegas_rad_s: tracker.turn_rates_rad_s(steps, world.timing.dtau_s, gust_rad) }
    }
}

/// Returns the rank of an airplane. That of a higher priority is higher; else it is higher the nearer its goal is, so that it is soon gone, and the more often it
/// was refused its preferred maneuver, so that no airplane waits forever. Whole meters in the upper half; the id in the
/// lower half makes it unique.
pub(super) fn priority_rank(world: &AirspaceWorld, known: &KnownAircraft, refusals: u32) -> u64 {
    let segment = world.known_segment(*known);
    // A percept that came off a network may count more way-points than there are.
    let ahead = &segment.mission[known.next.min(segment.mission.len())..];
    let legs = ahead.iter().scan(known.pose.at, |from, &to| {
        Some(world.surface.distance_m(std::mem::replace(from, to), to))
    });
    let refused_m = f64::from(refusals) * segment.model.v_m_s * world.timing.dt_s;
    let nearness_m = MAX_RANKED_DISTANCE_M + REFUSAL_FRACTION * refused_m - legs.sum::<f64>();
    // The conversion saturates at 0.
    let first = u32::from(world.priority(known.slot)) << 30 | nearness_m.min(MAX_RANK_M) as u32;
    u64::from(first) << 32 | u64::from(!known.slot)
}

impl Percept {
    /// Checks a percept that came off a network: that it is about airplanes of the world, its own among them.
    ///
    /// # Errors
    /// When it is not.
    pub fn check(&self, world: &AirspaceWorld) -> Result<(), InvalidMessage> {
        let n = world.airplanes.len();
        let OwnshipState { id, orders, ref exempt, altitude_m, levels, command, .. } = self.own;
        let others = self.non_cooperative.iter().map(|one| one.slot).chain(exempt.iter().copied());
        let are_known = self.members().into_iter().chain(others).all(|id| (id as usize) < n);
        let is_ascending = self.group.windows(2).all(|pair| pair[0].id < pair[1].id);
        let is_member = self.group.iter().any(|one| one.id == id);
        InvalidMessage::Airplane.ensure(are_known && is_ascending && is_member)?;
        InvalidMessage::Plan
            .ensure(orders as usize <= world.airplanes[id as usize].orders.len())?;
        let are_flown = self.group.iter().all(|one| world.allows_command(one.id, &one.command));
        InvalidMessage::Plan.ensure(are_flown && world.allows_command(id, &command))?;
        let has_levels = levels.low_m <= altitude_m && altitude_m <= levels.high_m;
        InvalidMessage::Number
            .ensure(has_levels && levels.high_m - levels.low_m < f64::INFINITY)?;
        // From where the group is seen all its members compute together. The airplane's other numbers enter only what
        // it sends, and the others check that.
        let seen =
            self.group.iter().flat_map(|one| [one.pose.at[0], one.pose.at[1], one.altitude_m]);
        InvalidMessage::Number.ensure(seen.into_iter().all(f64::is_finite))
    }

    /// Returns the ids of the airplanes that decide together, rising.
    pub fn members(&self) -> Vec<EntityId> {
        self.group.iter().map(|one| one.id).collect()
    }

    /// Returns its place among the members.
    pub(crate) fn own_place(&self) -> usize {
        let place = self.group.binary_search_by_key(&self.own.id, |one| one.id);
        place.expect("an airplane is in its own group")
    }
}
