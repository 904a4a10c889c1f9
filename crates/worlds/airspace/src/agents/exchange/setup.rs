//! The situation as all airplanes of a group see it before they exchange their plans.

use super::Proposal;
use crate::agents::participant::{InvalidMessage, are_valid_coordinates};
use crate::flight::{FlightConditions, FlightLevelRange, TurnLimit, WindField};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::shield::{CommonPlan, PlanCertainty, ShieldedAircraft, TurnProfile};
use sidestep_kernel::stream::philox4x32;
use sidestep_kernel::{Cycle, EntityId};
use std::sync::Arc;

/// Number of cycles after which airplanes take turns: long enough to get out of the others' reach.
const PRIORITY_PERIOD_CYCLES: Cycle = 12;
/// Bound on headings in messages, in radians: those of airplanes are within half a turn.
const MAX_HEADING_RAD: f64 = 1e6;

/// An airplane as others see it, and as they know it from its filed plan.
#[derive(Debug, Clone)]
pub struct ObservedAircraft {
    /// Its position, and its model. Of others, the fallback is known only where they are seen to be on it, and
    /// neither rank nor exempt pairs are.
    pub aircraft: ShieldedAircraft,
    /// The altitude on which it is seen, in meters.
    pub altitude_m: f64,
    /// Whether it is seen to be on its fallback.
    pub is_on_orbit: bool,
    /// Whether its stored fallback is known to all that see it.
    pub is_fallback_known: bool,
    /// The plan that all compute for it, if it has one: it flies that rather than its fallback.
    pub common: Option<CommonPlan>,
    /// Whether it takes part in the exchange, so that it may be heard.
    pub takes_part: bool,
    /// Its airspeed by its filed flight, in meters per second.
    pub filed_v_m_s: f64,
    /// The levels from the one where it is seen to the one of its filed flight.
    pub filed_levels: FlightLevelRange,
    /// The limits on its turn rate.
    pub turn: TurnLimit,
    /// Its greatest speed in meters per second.
    pub max_speed_m_s: f64,
    /// Largest number of different profiles that it can propose.
    pub max_profiles: usize,
}

/// The situation as all of a group see it, and numbers on which they have agreed, before they exchange
/// their plans.
#[derive(Debug, Clone)]
pub struct ShieldExchangeSetup {
    /// The air that all fly through, or that in which they are compared.
    pub air: FlightConditions,
    /// The wind on each level and in each place, where it differs.
    pub wind_field: Option<Arc<WindField>>,
    /// Airplanes at least this many meters above each other need not avoid each other.
    pub vertical_m: f64,
    /// The present cycle.
    pub now: Cycle,
    /// Whether all hear all, and fly as planned.
    pub certainty: PlanCertainty,
    /// Number of all airplanes, also of those that are not in the group.
    pub airplanes: usize,
    /// Largest number of bytes that a proposal should take; none where the radio has no budget.
    pub max_proposal_bytes: Option<usize>,
    /// The non-cooperative aircraft beside the group; none where messages may get lost, and each airplane proposes what
    /// they leave to it.
    pub non_cooperative: Vec<NonCooperativeAircraft>,
    /// All airplanes of the group as they can be seen, by rising id.
    pub aircraft: Vec<ObservedAircraft>,
}

impl ShieldExchangeSetup {
    /// Returns whether the airplane at one place goes before another one: it flies on without the
    /// other's consent, but the other does not without its own.
    ///
    /// One that is seen to fly a profile goes before one on an orbit, so that it is soon out of the
    /// other's reach. Among equals all go first in turn.
    pub fn has_priority(&self, place: usize, other: usize) -> bool {
        self.priority_key(place) < self.priority_key(other)
    }

    /// Returns a key that is smaller for airplanes that go first.
    fn priority_key(&self, place: usize) -> (bool, u64, EntityId) {
        let ObservedAircraft { aircraft, is_on_orbit, .. } = &self.aircraft[place];
        (*is_on_orbit, turn_order(aircraft.id, self.now), aircraft.id)
    }

    /// Checks the proposal of the airplane at a place: what is neither seen nor filed must be possible.
    pub(super) fn check_proposal(
        &self,
        place: usize,
        proposal: &Proposal,
    ) -> Result<(), InvalidMessage> {
        let Proposal { orbit_pose, exempt, profiles, .. } = proposal;
        let observed = &self.aircraft[place];
        proposal.beacon(observed).check(observed.max_speed_m_s)?;
        let is_valid_pose = orbit_pose.is_none_or(|pose| {
            pose.heading_rad.abs() < MAX_HEADING_RAD && are_valid_coordinates(pose.at)
        });
        InvalidMessage::Number.ensure(is_valid_pose)?;
        let are_known = exempt.iter().all(|&id| (id as usize) < self.airplanes);
        InvalidMessage::Airplane.ensure(are_known && is_ascending(exempt))?;
        InvalidMessage::Plan.ensure(observed.aircraft.may_store(proposal.fallback))?;
        InvalidMessage::Length.ensure(profiles.len() <= self.aircraft[place].max_profiles)?;
        let max_rad_s = observed.turn.omega_rad_s(proposal.v_m_s(observed));
        profiles.iter().try_for_each(|profile| self.check_profile(profile, max_rad_s))
    }

    /// Checks a profile of an airplane that turns at no more than some radians per second.
    fn check_profile(&self, profile: &TurnProfile, max_rad_s: f64) -> Result<(), InvalidMessage> {
        InvalidMessage::Length
            .ensure(profile.omegas_rad_s.len() == self.air.timing.points_per_dt())?;
        // Comparisons with NaN are false.
        InvalidMessage::Number
            .ensure(profile.omegas_rad_s.iter().all(|omega| omega.abs() <= max_rad_s))
    }

    /// Checks a list of members of the group.
    pub(super) fn check_members(&self, ids: &[EntityId]) -> Result<(), InvalidMessage> {
        let are_members = ids
            .iter()
            .all(|id| self.aircraft.binary_search_by_key(id, |one| one.aircraft.id).is_ok());
        InvalidMessage::Airplane.ensure(is_ascending(ids) && are_members)
    }

    /// Returns the largest number of bytes of a message: a proposal with as many profiles as any airplane can have.
    pub(super) fn max_message_bytes(&self) -> usize {
        let profiles = self.aircraft.iter().map(|one| one.max_profiles).max().unwrap_or(0);
        // A number of a message takes 8 bytes, a length or an id at most 5, and a profile may have another rate in each
        // step; the rest is well below 256.
        let profile_bytes = 13 * self.air.timing.points_per_dt() + 5;
        256 + profiles * profile_bytes + 5 * self.airplanes
    }
}

/// Returns whether ids rise, so that none stands among them twice.
fn is_ascending(ids: &[EntityId]) -> bool {
    ids.windows(2).all(|pair| pair[0] < pair[1])
}

/// Returns a number by which airplanes take turns: drawn without a seed, because all have to know it,
/// and anew when one has had time to get out of the others' way.
fn turn_order(id: EntityId, now: Cycle) -> u64 {
    let round = now / PRIORITY_PERIOD_CYCLES;
    let [high, low, ..] = philox4x32([id, round as u32, (round >> 32) as u32, 0], [0; 2]);
    u64::from(high) << 32 | u64::from(low)
}
