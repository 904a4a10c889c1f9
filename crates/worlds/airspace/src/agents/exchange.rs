//! The shield between airplanes that exchange messages over a network.
//!
//! On a network that loses nothing, all airplanes send all others their position, their stored
//! fallback and the profiles they would fly; all know the same, filter the same, and compute the same
//! plans, to the bit ([`PlanCertainty::Sure`]). No other messages are sent.
//!
//! On one that loses messages no airplane can be sure of the others' knowledge. So plans must stay
//! safe whichever of them are flown, and no airplane flies one that others may not know:
//!
//! 1. Each airplane sends its *proposal* as above.
//! 2. From the proposals it has heard each computes plans by `filter_maneuvers_beside` that are *mixable*: each
//!    plan keeps apart from every other one's plan, from its fallback, and from its common plan. An airplane that
//!    was not heard counts as being on any orbit it may be on. Each sends its own *plan*, which ends with an orbit.
//! 3. Each *accepts* the plans of others that keep apart from its own plan, its own fallback and its own common plan,
//!    and sends the list of those it accepts.
//! 4. Of two airplanes one *goes first* (`ShieldExchangeSetup::has_priority`). An airplane flies its plan if all
//!    those that go before it have accepted it, else its common plan, or its fallback if it has none. It does not ask
//!    those that it goes before, nor those from which its plan keeps apart in any case.
//!
//! *Common plans* need no message (`pilot/common_plans.rs`): all compute them for all airplanes of an announced group from
//! what all see, and so they are known whether or not anybody is heard. They keep apart from each other, and from the
//! fallbacks of all. An airplane that has one flies it rather than a plan of its own, and so stays predictable in
//! the cycles to come.
//!
//! The order of going first follows from ids, time and visible state, and so both know it without a message. It
//! cannot follow from anything that was heard: the other may not know that the one has heard it, and both might
//! believe that they go first.
//!
//! Airplanes nearby can be seen, heard or not: their position, the level and the speed that their methods command and that
//! are in force, whether they are on their fallback, and the side to which they then turn. Not visible are the candidates of an airplane, and the fallback of one
//! that flies a profile, unless that is its common plan. So what an unheard airplane may fly is: the fallback on which it is
//! seen, or with which its common plan has ended; or, if it flew another plan, the orbit at the end of the one that was
//! heard of it in the exchange before; or else both orbits from where it is seen. One whose fallback is not known to all
//! has no common plan.
//!
//! **Invariant.** For any two airplanes, the fallbacks that the one may be on, as far as the other
//! knows, include the one it is on; and the fallbacks that the two are on keep apart.
//!
//! *Why it is kept.* Take two airplanes, of which `i` goes first. Each flies its plan, its common plan, or its
//! fallback: the last also when its process has failed. Whether `j` was heard or not, `i`'s plan keeps apart from `j`'s
//! fallback: `j` has sent it, all know it, or it is among the orbits possible, from all of which `i`'s plan keeps apart.
//! It keeps apart from `j`'s common plan, which `i` has computed, too. The fallbacks and common plans
//! keep apart from each other. So only `j`'s plan is left. `j` flies it only if it keeps apart from
//! everything that `i` may do (from its fallback and its common plan by the search, and from all else because it is out
//! of `i`'s reach), or if it has heard that `i` accepts it; and `i` has compared it with
//! all that it may fly itself. So the two keep apart in every case, during `dt` and on
//! the fallbacks after it. Each knows the fallback on which the other is after that, or has heard it as
//! the end of the other's only plan; where it has not, both orbits count as possible.
//!
//! *Commands of methods* change speeds and levels at the start of a cycle, before all see each other. One is cleared only if
//! the airplane's stored fallback, flown at the new speed and on all levels that it passes in the cycle, keeps apart from the
//! stored ones of all others (`act/commands.rs`, `act/levels.rs`); no other fallback is stored for it. So the fallbacks
//! that the two are on keep apart, and what each knows of the other's side stays true. An airplane that is not heard counts
//! on all levels from its own to the one that it changes to, which are more than it passes.
//!
//! Nothing in this depends on why an airplane is not heard, or for how long: a radio that is off, a
//! partition, a unidirectional link, a burst of losses, or an airplane that has
//! just entered. No airplane has to distinguish them, and none waits for an answer forever,
//! because two airplanes go first in turn.

mod setup;
mod turn_runs;

use super::link::{self, MessageLimits, to_bytes};
use super::participant::InvalidMessage;
use super::traffic_state::{
    LastKnownState, OrbitState, PlanEnd, StateBeacon, TrafficPicture, record_beacon,
};
use crate::avoid::group_threats;
use crate::flight::{FlightLevelRange, Pose2};
use crate::shield::{
    AirDrift, CommonPlan, ExemptIds, Fallback, OrbitSide, PlanCertainty, PlanEnding, PlanRules,
    SafeManeuver, ShieldDecision, ShieldedAircraft, Surroundings, TurnProfile,
    filter_maneuvers_beside,
};
use serde::{Deserialize, Serialize};
pub use setup::{ObservedAircraft, ShieldExchangeSetup};
use sidestep_kernel::EntityId;
use sidestep_kernel::geometry::sub;
use std::sync::Arc;

/// Messages between airplanes.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum ShieldExchangeMessage {
    /// Position of the sender, and the profiles it would fly.
    Proposal(Proposal),
    /// The plan that it will fly if all agree; `None` for what it flies without their consent.
    Plan(Option<Plan>),
    /// Ids of the airplanes whose plans it accepts, rising.
    Accepts(Vec<EntityId>),
}

/// A profile that an airplane has proposed, and its fallback after that.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plan {
    /// The place of the profile in its proposal.
    profile: u32,
    fallback: Fallback,
}

/// What an airplane says of itself, and the profiles it would fly. What all see of it, or have on file, is left out.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Proposal {
    /// Airspeed in meters per second, if it is not as filed.
    v_m_s: Option<f64>,
    /// The levels that it keeps or passes in the next `dt`, if they are not as seen and filed.
    levels: Option<FlightLevelRange>,
    /// Its pose on the stored fallback, if that is not where all see it.
    orbit_pose: Option<Pose2>,
    fallback: Fallback,
    exempt: Vec<EntityId>,
    rank: u64,
    #[serde(with = "turn_runs")]
    profiles: Vec<TurnProfile>,
}

impl Proposal {
    /// Returns the proposal of an airplane: the profiles that it may fly, the preferred one first.
    pub fn new(own: &ObservedAircraft, profiles: &[TurnProfile]) -> Self {
        let ObservedAircraft { aircraft, filed_v_m_s, filed_levels, .. } = own;
        Self {
            v_m_s: unless_known(aircraft.v_m_s, *filed_v_m_s),
            levels: unless_known(aircraft.levels, *filed_levels),
            orbit_pose: unless_known(aircraft.orbit_pose, aircraft.pose),
            fallback: aircraft.fallback,
            exempt: aircraft.exempt.to_vec(),
            rank: aircraft.rank,
            profiles: profiles.to_vec(),
        }
    }

    /// Leaves out the profiles that it prefers least until the message takes so many bytes at most; one stays.
    fn truncate_to_bytes(&mut self, max_bytes: usize) {
        while self.profiles.len() > 1 && to_bytes(&self).len() > max_bytes {
            self.profiles.pop();
        }
    }

    /// Returns the airspeed of its airplane in meters per second.
    fn v_m_s(&self, observed: &ObservedAircraft) -> f64 {
        self.v_m_s.unwrap_or(observed.filed_v_m_s)
    }

    /// Returns how its airplane describes itself, with all that others see of it or have on file.
    fn beacon(&self, observed: &ObservedAircraft) -> StateBeacon {
        StateBeacon {
            v_m_s: self.v_m_s(observed),
            omega_max_rad_s: observed.turn.omega_rad_s(self.v_m_s(observed)),
            levels: self.levels.unwrap_or(observed.filed_levels),
            ..StateBeacon::from_aircraft(&observed.aircraft)
        }
    }
}

/// Returns what must be said of a value: nothing if it is the one that others know.
fn unless_known<T: PartialEq>(value: T, known: T) -> Option<T> {
    (value != known).then_some(value)
}

/// Another member of the group.
#[derive(Debug, Default)]
struct ShieldExchangeMember {
    proposal: Option<Proposal>,
    /// Its plan, when it is known; `Some(None)` stands for what it flies without anybody's consent.
    plan: Option<Option<Plan>>,
    accepts: Option<Vec<EntityId>>,
    gone: bool,
}

impl ShieldExchangeMember {
    fn new(observed: &ObservedAircraft) -> Self {
        Self { gone: !observed.takes_part, ..Self::default() }
    }
}

/// Outcome of the exchange for one airplane.
#[derive(Debug, Clone, PartialEq)]
pub struct ShieldExchangeResult {
    /// What it flies: its plan if all that were asked have agreed, or else its fallback.
    pub decision: ShieldDecision,
    /// The plan that all compute for it, if it flies that one instead.
    pub common: Option<CommonPlan>,
    /// Whether it would have flown another plan if all had agreed.
    pub held_back: bool,
    /// Its knowledge of others after the exchange.
    pub contacts: TrafficPicture,
}

/// The messages that an agent waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ShieldExchangePhase {
    Proposals,
    Plans,
    Consent,
    Over,
}

/// The shield's agent of one airplane.
#[derive(Debug)]
pub struct ShieldExchangeAgent {
    setup: Arc<ShieldExchangeSetup>,
    me: usize,
    aircraft: ShieldedAircraft,
    own: Proposal,
    contacts: TrafficPicture,
    members: Vec<ShieldExchangeMember>,
    decision: Option<ShieldDecision>,
    /// Places of the members whose consent it needs to fly its plan.
    asked: Vec<usize>,
    result: Option<ShieldExchangeResult>,
}

impl ShieldExchangeAgent {
    /// Returns an agent that has not sent anything yet, for the airplane at place `me`, which may
    /// fly `profiles`.
    pub fn new(
        setup: Arc<ShieldExchangeSetup>,
        me: usize,
        profiles: &[TurnProfile],
        contacts: TrafficPicture,
    ) -> Self {
        let mut own = Proposal::new(&setup.aircraft[me], profiles);
        if let Some(max_bytes) = setup.max_proposal_bytes {
            own.truncate_to_bytes(max_bytes);
        }
        Self {
            me,
            own,
            aircraft: setup.aircraft[me].aircraft.clone(),
            contacts,
            members: setup.aircraft.iter().map(ShieldExchangeMember::new).collect(),
            setup,
            decision: None,
            asked: Vec::new(),
            result: None,
        }
    }

    fn dtau_s(&self) -> f64 {
        self.setup.air.timing.dtau_s
    }

    fn steps_per_dt(&self) -> usize {
        self.setup.air.timing.points_per_dt()
    }

    fn group_size(&self) -> usize {
        self.setup.aircraft.len()
    }

    fn id(&self, place: usize) -> EntityId {
        self.setup.aircraft[place].aircraft.id
    }

    fn fallback(&self, aircraft: ShieldedAircraft) -> SafeManeuver {
        SafeManeuver::on_fallback(aircraft, self.steps_per_dt(), self.dtau_s())
    }

    fn aircraft_from_proposal(&self, place: usize, proposal: &Proposal) -> ShieldedAircraft {
        let observed = &self.setup.aircraft[place];
        let Proposal { levels, orbit_pose, fallback, exempt, rank, .. } = proposal;
        let seen = &observed.aircraft;
        let v_m_s = proposal.v_m_s(observed);
        let levels = levels.unwrap_or(observed.filed_levels);
        ShieldedAircraft {
            id: self.id(place),
            frame: self.setup.air.surface.frame_at(seen.pose.at),
            pose: seen.pose,
            orbit_pose: orbit_pose.unwrap_or(seen.pose),
            v_m_s,
            omega_max_rad_s: observed.turn.omega_rad_s(v_m_s),
            orbit_rad_s: seen.orbit_rad_s,
            separation_m: seen.separation_m,
            error_m: seen.error_m,
            levels,
            drift: self.drift_after(place, levels),
            vertical_m: self.setup.vertical_m,
            fallback: *fallback,
            choices: Arc::clone(&seen.choices),
            dt_s: seen.dt_s,
            exempt: exempt.as_slice().into(),
            rank: *rank,
            areas: seen.areas.clone(),
        }
    }

    /// Returns how the air around the airplane at a place moves, if it keeps or passes some levels in this `dt`.
    fn drift_after(&self, place: usize, levels: FlightLevelRange) -> AirDrift {
        let ObservedAircraft { aircraft, altitude_m, .. } = &self.setup.aircraft[place];
        let Some(field) = &self.setup.wind_field else { return aircraft.drift };
        let next_altitude_m = levels.end_of_change_m(*altitude_m);
        let next_wind_m_s = field.velocity_m_s(aircraft.pose.at, next_altitude_m);
        let next_m_s = sub(next_wind_m_s, self.setup.air.common_wind_m_s);
        AirDrift { next_m_s, ..aircraft.drift }
    }

    /// Returns all orbits that an unheard airplane may be on.
    fn possible_orbits(&self, place: usize) -> Vec<ShieldedAircraft> {
        let ObservedAircraft { aircraft, is_fallback_known, .. } = &self.setup.aircraft[place];
        if *is_fallback_known {
            return vec![aircraft.clone()];
        }
        let heard_plan = self.contacts.get(&aircraft.id).and_then(|contact| contact.planned);
        let sides = match heard_plan.filter(|planned| planned.as_of == self.setup.now) {
            Some(PlanEnd { side, .. }) => vec![side],
            None => OrbitSide::BOTH.to_vec(),
        };
        sides
            .into_iter()
            .map(Fallback::from_side)
            .map(|fallback| ShieldedAircraft { fallback, ..aircraft.clone() })
            .collect()
    }

    fn phase(&self) -> ShieldExchangePhase {
        match (&self.decision, &self.members[self.me].accepts, &self.result) {
            (_, _, Some(_)) => ShieldExchangePhase::Over,
            (None, ..) => ShieldExchangePhase::Proposals,
            (Some(_), None, _) => ShieldExchangePhase::Plans,
            (Some(_), Some(_), None) => ShieldExchangePhase::Consent,
        }
    }

    /// Continues as far as the messages heard allow.
    fn advance(&mut self) -> Vec<ShieldExchangeMessage> {
        let mut outgoing = Vec::new();
        while link::ProtocolAgent::awaited_members(self).is_empty() {
            match self.phase() {
                ShieldExchangePhase::Proposals if self.setup.certainty == PlanCertainty::Sure => {
                    self.decide_own_plan()
                }
                ShieldExchangePhase::Proposals => outgoing.push(self.send_plan()),
                ShieldExchangePhase::Plans => outgoing.push(self.accept_plans()),
                ShieldExchangePhase::Consent => self.conclude(),
                ShieldExchangePhase::Over => break,
            }
        }
        outgoing
    }

    /// Computes plans for all, as all others do from the same proposals, and will fly its own.
    fn decide_own_plan(&mut self) {
        let decision = self.compute_own_decision();
        self.decision = Some(decision);
        let contacts = self.contacts.clone();
        self.result =
            Some(ShieldExchangeResult { decision, common: None, held_back: false, contacts });
    }

    /// Computes plans for all, and returns its own.
    fn compute_own_decision(&self) -> ShieldDecision {
        let mut group = Vec::new();
        let mut candidates = Vec::new();
        let mut common = Vec::new();
        let mut mine = 0;
        for place in 0..self.group_size() {
            if place == self.me {
                mine = group.len();
                group.push(self.aircraft.clone());
                candidates.push(self.own.profiles.clone());
                common.push(self.common_plan(place).cloned());
            } else if let Some(proposal) = &self.members[place].proposal {
                group.push(self.aircraft_from_proposal(place, proposal));
                candidates.push(proposal.profiles.clone());
                common.push(self.common_plan(place).cloned());
            } else {
                // An unheard airplane takes part on every orbit it may be on, without a choice.
                let mut possible = self.possible_orbits(place);
                let exempt = self.exempt_members(place);
                for aircraft in &mut possible {
                    aircraft.exempt = exempt.clone();
                }
                candidates.extend(possible.iter().map(|_| Vec::new()));
                common.extend(possible.iter().map(|_| self.common_plan(place).cloned()));
                group.extend(possible);
            }
        }
        let rules = PlanRules {
            steps: self.steps_per_dt(),
            dtau_s: self.dtau_s(),
            certainty: self.setup.certainty,
            ending: match self.setup.certainty {
                PlanCertainty::Sure => PlanEnding::AnyFallback,
                // Those who do not hear of the plan have to guess its end.
                PlanCertainty::Mixable => PlanEnding::Orbit,
            },
        };
        let intruders = &self.setup.non_cooperative;
        let threats = group_threats(self.setup.air.timing, &group, &candidates, intruders);
        let beside = Surroundings { common, threats };
        filter_maneuvers_beside(&group, &candidates, &beside, rules)[mine]
    }

    /// Returns the members with which an unheard airplane is an exempt pair, as far as they say so themselves.
    fn exempt_members(&self, place: usize) -> ExemptIds {
        let id = self.id(place);
        (0..self.group_size())
            .filter(|&other| {
                if other == self.me {
                    return self.aircraft.exempt.contains(&id);
                }
                let proposal = self.members[other].proposal.as_ref();
                proposal.is_some_and(|proposal| proposal.exempt.contains(&id))
            })
            .map(|other| self.id(other))
            .collect()
    }

    /// Computes its plan, finds the members whose consent that needs, and returns it as a message.
    fn send_plan(&mut self) -> ShieldExchangeMessage {
        let decision = match self.common_plan(self.me) {
            // A common plan leaves it predictable for all that do not hear it, in the cycles to come, too. That is worth
            // more than a better path now.
            Some(common) => ShieldDecision::from_fallback(common.fallback),
            None => self.compute_own_decision(),
        };
        self.decision = Some(decision);
        let fallback = decision.fallback;
        let plan = decision.candidate.map(|k| Plan { profile: k as u32, fallback });
        // Its fallback and its common plan need no consent, because all others keep apart from them anyway.
        self.asked =
            if plan.is_some() { self.consent_members(&self.own_plan(plan)) } else { Vec::new() };
        self.members[self.me].plan = Some(plan);
        ShieldExchangeMessage::Plan(plan)
    }

    /// Returns the plan that all compute for the airplane at a place, if it has one.
    fn common_plan(&self, place: usize) -> Option<&CommonPlan> {
        self.setup.aircraft[place].common.as_ref()
    }

    /// Returns what an airplane may fly without anybody's consent.
    fn settled_plans(&self, place: usize, aircraft: &ShieldedAircraft) -> Vec<SafeManeuver> {
        let common = self.common_plan(place);
        let common = common.map(|plan| plan.to_maneuver(aircraft.clone(), self.dtau_s()));
        common.into_iter().chain([self.fallback(aircraft.clone())]).collect()
    }

    fn own_plan(&self, plan: Option<Plan>) -> SafeManeuver {
        self.plan_of(self.me, self.aircraft.clone(), &self.own, plan).expect("it has proposed it")
    }

    /// Returns the plan of a member, from its messages; `None` if it has not proposed that.
    fn plan_of(
        &self,
        place: usize,
        aircraft: ShieldedAircraft,
        proposal: &Proposal,
        plan: Option<Plan>,
    ) -> Option<SafeManeuver> {
        let Some(Plan { profile, fallback }) = plan else {
            return Some(self.settled_plans(place, &aircraft).swap_remove(0));
        };
        let profile = proposal.profiles.get(profile as usize)?;
        Some(SafeManeuver::new(aircraft, profile, self.dtau_s(), fallback))
    }

    /// Accepts the plans that keep apart from everything that it may fly itself.
    fn accept_plans(&mut self) -> ShieldExchangeMessage {
        let own = self.members[self.me].plan.flatten();
        let mut mine = self.settled_plans(self.me, &self.aircraft);
        mine.push(self.own_plan(own));
        let mut accepts = Vec::new();
        for place in (0..self.group_size()).filter(|&place| place != self.me) {
            let ShieldExchangeMember { proposal: Some(proposal), plan: Some(plan), .. } =
                &self.members[place]
            else {
                continue;
            };
            let aircraft = self.aircraft_from_proposal(place, proposal);
            // A plan that was not proposed is nothing that could be flown.
            let Some(theirs) = self.plan_of(place, aircraft, proposal, *plan) else { continue };
            if mine.iter().all(|plan| plan.is_compatible(&theirs)) {
                accepts.push(self.id(place));
            }
        }
        self.members[self.me].accepts = Some(accepts.clone());
        ShieldExchangeMessage::Accepts(accepts)
    }

    /// Returns the members whose consent a plan of this airplane needs.
    fn consent_members(&self, plan: &SafeManeuver) -> Vec<usize> {
        (0..self.group_size())
            .filter(|&place| {
                let other = &self.setup.aircraft[place].aircraft;
                place != self.me
                    && self.aircraft.is_protected_from(other)
                    && self.setup.has_priority(place, self.me)
                    && !plan.is_clear_of(other)
            })
            .collect()
    }

    /// Returns whether a member has agreed to this airplane's plan.
    fn has_accepted_own_plan(&self, place: usize) -> bool {
        let accepts = self.members[place].accepts.as_ref();
        accepts.is_some_and(|accepted| accepted.contains(&self.id(self.me)))
    }

    /// Returns whether a member was present and not heard in the exchange before.
    fn was_unheard(&self, place: usize) -> bool {
        let contact = self.contacts.get(&self.id(place));
        let unheard_in = contact.and_then(|contact| contact.unheard_in);
        unheard_in.is_some_and(|cycle| cycle + 1 == self.setup.now)
    }

    /// Ends the exchange: the airplane flies its plan, or its fallback.
    fn conclude(&mut self) {
        let fallback = ShieldDecision::from_fallback(self.aircraft.fallback);
        let preferred = self.decision.unwrap_or(fallback);
        let all_agree = self.asked.iter().all(|&place| self.has_accepted_own_plan(place));
        let has_plan = matches!(self.members[self.me].plan, Some(Some(_)));
        let is_settled = !(has_plan && all_agree);
        self.result = Some(ShieldExchangeResult {
            decision: if is_settled { fallback } else { preferred },
            common: self.common_plan(self.me).filter(|_| is_settled).cloned(),
            held_back: !all_agree,
            contacts: self.traffic_picture(),
        });
    }

    /// Returns its knowledge of others after this `dt`.
    fn traffic_picture(&self) -> TrafficPicture {
        let now = self.setup.now;
        let mut contacts = self.contacts.clone();
        for (place, member) in self.members.iter().enumerate().filter(|(k, _)| *k != self.me) {
            let id = self.id(place);
            let aircraft = match &member.proposal {
                Some(proposal) => {
                    let beacon = proposal.beacon(&self.setup.aircraft[place]);
                    record_beacon(&mut contacts, id, beacon, now);
                    self.aircraft_from_proposal(place, proposal)
                }
                None => self.possible_orbits(place).swap_remove(0),
            };
            let contact = contacts.entry(id).or_insert_with(|| {
                // It was never heard, but it is seen.
                let observed = &self.setup.aircraft[place].aircraft;
                LastKnownState::from_beacon(StateBeacon::from_aircraft(observed), now)
            });
            let is_heard = member.proposal.is_some();
            // If it is seen to fly a profile, it has flown the plan that it has sent.
            let planned = member.plan.as_ref().and_then(Option::as_ref);
            contact.planned =
                planned.map(|plan| PlanEnd { as_of: now + 1, side: plan.fallback.orbit_side });
            let settled = self.settled_plans(place, &aircraft).swap_remove(0);
            contact.presumed = Some(self.orbit_after_plan(&settled));
            contact.unheard_in = (!is_heard).then_some(now);
        }
        contacts
    }

    /// Returns the orbit at the end of a plan, where the wind has carried it: plans are made in still air. A wind that differs
    /// is not permitted where messages get lost, and nowhere else is this orbit looked at.
    fn orbit_after_plan(&self, plan: &SafeManeuver) -> OrbitState {
        let [wx, wy] = self.setup.air.wind_m_s.map(|w| w * self.setup.air.timing.dt_s);
        let mut pose = plan.end_pose();
        pose.at = [pose.at[0] + wx, pose.at[1] + wy];
        let pose = plan.frame().pose_to_world(pose);
        OrbitState { pose, as_of: self.setup.now + 1, side: plan.fallback().orbit_side }
    }
}

impl link::ProtocolAgent for ShieldExchangeAgent {
    type Message = ShieldExchangeMessage;
    type Outcome = ShieldExchangeResult;

    fn start(&mut self) -> Vec<ShieldExchangeMessage> {
        let mut outgoing = vec![ShieldExchangeMessage::Proposal(self.own.clone())];
        outgoing.extend(self.advance());
        outgoing
    }

    fn check_message(
        &self,
        from: usize,
        message: &ShieldExchangeMessage,
    ) -> Result<(), InvalidMessage> {
        match message {
            ShieldExchangeMessage::Proposal(proposal) => self.setup.check_proposal(from, proposal),
            ShieldExchangeMessage::Plan(plan) => {
                let Some(Plan { profile, fallback }) = plan else { return Ok(()) };
                let observed = &self.setup.aircraft[from];
                InvalidMessage::Plan.ensure(fallback.is_orbiting())?;
                InvalidMessage::Length.ensure((*profile as usize) < observed.max_profiles)
            }
            ShieldExchangeMessage::Accepts(accepted) => self.setup.check_members(accepted),
        }
    }

    fn message_limits(&self) -> MessageLimits {
        // A proposal, a plan, and a list of those accepted.
        MessageLimits { bytes: self.setup.max_message_bytes(), messages: 3 }
    }

    fn on_message(
        &mut self,
        from: usize,
        message: ShieldExchangeMessage,
    ) -> Vec<ShieldExchangeMessage> {
        let has_planned = self.decision.is_some();
        let has_accepted = self.members[self.me].accepts.is_some();
        let member = &mut self.members[from];
        match message {
            // The proposal of a member that was given up is too late once plans are made.
            ShieldExchangeMessage::Proposal(proposal) if !has_planned => {
                member.proposal = Some(proposal)
            }
            ShieldExchangeMessage::Plan(plan) if !has_accepted => member.plan = Some(plan),
            ShieldExchangeMessage::Accepts(accepted) => member.accepts = Some(accepted),
            _ => {}
        }
        self.advance()
    }

    fn is_expected(&self, other: usize) -> bool {
        !self.was_unheard(other)
    }

    fn awaited_members(&self) -> Vec<usize> {
        let phase = self.phase();
        (0..self.group_size())
            .filter(|&place| place != self.me && !self.members[place].gone)
            .filter(|&place| {
                let member = &self.members[place];
                match phase {
                    ShieldExchangePhase::Proposals => member.proposal.is_none(),
                    ShieldExchangePhase::Plans => member.plan.is_none(),
                    ShieldExchangePhase::Consent => {
                        member.accepts.is_none() && self.asked.contains(&place)
                    }
                    ShieldExchangePhase::Over => false,
                }
            })
            .collect()
    }

    fn wait_fraction(&self) -> f64 {
        match self.phase() {
            // Each phase leaves time for those after it. Proposals are the largest messages and get the largest part.
            ShieldExchangePhase::Proposals => 0.5,
            ShieldExchangePhase::Plans => 0.75,
            // Some time is left for an orderly end.
            ShieldExchangePhase::Consent | ShieldExchangePhase::Over => 0.95,
        }
    }

    fn on_peer_gone(&mut self, other: usize, _: bool) -> Vec<ShieldExchangeMessage> {
        self.members[other].gone = true;
        self.advance()
    }

    /// Ends the exchange because time is up. Without a decision, or without the consent of others,
    /// the airplane stays on its fallback.
    fn on_deadline(&mut self) {
        if self.result.is_none() {
            self.conclude();
        }
    }

    fn is_done(&self) -> bool {
        self.result.is_some()
    }

    fn outcome(&self) -> Option<ShieldExchangeResult> {
        self.result.clone()
    }
}
