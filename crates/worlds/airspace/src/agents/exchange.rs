//! The shield between airplanes that talk over a network.
//!
//! On a network that loses nothing, all airplanes send all others their place, their stored
//! fallback and the ways they would fly; all know the same, filter the same, and compute the same
//! plans, to the bit ([`PlanCertainty::Sure`]). No other messages are sent.
//!
//! On one that loses messages no airplane can be sure of the others' knowledge. So plans must stay
//! safe whichever of them are flown, and no airplane flies one that others may not know:
//!
//! 1. Each airplane sends its *proposal* as above.
//! 2. From the proposals it has heard each computes plans by [`filter`] that are *mixable*: each
//!    plan keeps apart from every other one's plan and from its fallback too. An airplane that
//!    was not heard is taken to be on any orbit it may be on. Each sends its own *plan*.
//! 3. Each *accepts* the plans of others that keep apart from its own plan and its own fallback,
//!    and sends the list of those it accepts.
//! 4. Of two airplanes one *goes first* (`ExchangeSetup::has_priority`). An airplane flies its plan if all
//!    those that go before it have accepted it, else its fallback. It does not ask those that it
//!    goes before, nor those from which its plan keeps apart in any case.
//!
//! The order of going first follows from ids, time and visible state, and so both know it without a message. It
//! cannot follow from anything that was heard: the other may not know that the one has heard it, and both might
//! believe that they go first.
//!
//! Airplanes nearby can be seen, heard or not: their place, whether they are on an orbit, and the
//! side to which they then turn. Not visible are the wishes of an airplane, and the fallback of one
//! that flies a way. So the orbits that an unheard airplane may be on are: the one on which it is
//! seen; or, if it flew a way, that at the end of the plan that was heard of it in the exchange
//! before; or else both from where it is seen.
//!
//! **Invariant.** For any two airplanes, the orbits that the one may be on, as far as the other
//! knows, include the one it is on; and the orbits that the two are on keep apart.
//!
//! *Why it is kept.* Take two airplanes, of which `i` goes first. Each flies its plan or its
//! fallback. Whether `j` was heard or not, `i`'s plan keeps apart from `j`'s fallback: `j` has told
//! it, or it is among the orbits possible, from all of which `i`'s plan keeps apart. The fallbacks
//! keep apart from each other. So only `j`'s plan is left. `j` flies it only if it keeps apart from
//! everything that `i` may do, or if it has heard that `i` accepts it; and `i` has compared it with
//! both its own plan and its own fallback. So the two keep apart in every case, during `dt` and on
//! the orbits after it. Each sees the orbit on which the other is after that, or has heard it as
//! the end of the other's only plan; where it has not, it takes both sides to be possible.
//!
//! Nothing in this depends on why an airplane is not heard, or for how long: a dead radio, a
//! network in two parts, a link that works one way only, a burst of losses, or an airplane that has
//! just come in. No airplane has to tell one from the other, and none waits for an answer forever,
//! because two airplanes go first in turn.

mod setup;

use super::link::{self, MessageLimits};
use super::participant::InvalidMessage;
use super::traffic_state::{
    OrbitState, PlanEnd, StateBeacon, TrafficPicture, TrafficState, record_beacon,
};
use crate::flight::Pose2;
use crate::shield::{
    ExemptIds, PlanCertainty, SafeManeuver, ShieldDecision, ShieldedAircraft, Side, TurnProfile,
    filter,
};
use serde::{Deserialize, Serialize};
pub use setup::{ExchangeSetup, ObservedAircraft};
use sidestep_kernel::EntityId;
use std::sync::Arc;

/// Messages between airplanes.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum ExchangeMessage {
    /// Place of the sender, and the ways it would fly.
    Proposal(Proposal),
    /// The way it will fly if all agree, and the side to which it turns then; `None` for its
    /// fallback.
    Plan(Option<(TurnProfile, Side)>),
    /// Ids of the airplanes whose plans it accepts, rising.
    Accepts(Vec<EntityId>),
}

/// Place of an airplane, and the ways it would fly.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Proposal {
    beacon: StateBeacon,
    /// Its pose on the stored orbit, as all see it.
    held: Pose2,
    fallback: Side,
    named: Vec<EntityId>,
    rank: u64,
    ways: Vec<TurnProfile>,
}

impl Proposal {
    /// Returns the proposal of an airplane: the ways that it may fly, the wanted one first.
    pub fn new(flyer: &ShieldedAircraft, ways: &[TurnProfile]) -> Self {
        Self {
            beacon: StateBeacon::from_aircraft(flyer),
            held: flyer.orbit_pose,
            fallback: flyer.fallback,
            named: flyer.exempt.to_vec(),
            rank: flyer.rank,
            ways: ways.to_vec(),
        }
    }
}

/// Another member of the group.
#[derive(Debug, Default)]
struct ExchangeMember {
    proposal: Option<Proposal>,
    /// Its plan, when it is known; `Some(None)` stands for its fallback.
    plan: Option<Option<(TurnProfile, Side)>>,
    accepts: Option<Vec<EntityId>>,
    gone: bool,
}

impl ExchangeMember {
    fn new(seen: &ObservedAircraft) -> Self {
        Self { gone: !seen.takes_part, ..Self::default() }
    }
}

/// Outcome of the exchange for one airplane.
#[derive(Debug, Clone, PartialEq)]
pub struct ExchangeResult {
    /// Decision of the shield for the airplane.
    pub decision: ShieldDecision,
    /// Whether it would have flown another way if all had agreed.
    pub held_back: bool,
    /// Its knowledge of others after the exchange.
    pub contacts: TrafficPicture,
}

/// The messages that an agent waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ExchangePhase {
    Proposals,
    Plans,
    Consent,
    Over,
}

/// The shield's agent of one airplane.
#[derive(Debug)]
pub struct ExchangeAgent {
    scene: Arc<ExchangeSetup>,
    me: usize,
    flyer: ShieldedAircraft,
    own: Proposal,
    contacts: TrafficPicture,
    members: Vec<ExchangeMember>,
    decision: Option<ShieldDecision>,
    /// Places of the members whose consent it needs to fly its plan.
    asked: Vec<usize>,
    result: Option<ExchangeResult>,
}

impl ExchangeAgent {
    /// Returns an agent that has not sent anything yet, for the airplane at place `me`, which may
    /// fly `ways`.
    pub fn new(
        scene: Arc<ExchangeSetup>,
        me: usize,
        ways: &[TurnProfile],
        contacts: TrafficPicture,
    ) -> Self {
        let flyer = scene.aircraft[me].aircraft.clone();
        Self {
            me,
            own: Proposal::new(&flyer, ways),
            flyer,
            contacts,
            members: scene.aircraft.iter().map(ExchangeMember::new).collect(),
            scene,
            decision: None,
            asked: Vec::new(),
            result: None,
        }
    }

    fn dtau_s(&self) -> f64 {
        self.scene.air.timing.dtau_s
    }

    fn steps(&self) -> usize {
        self.scene.air.timing.points_per_dt()
    }

    fn size(&self) -> usize {
        self.scene.aircraft.len()
    }

    fn id(&self, place: usize) -> EntityId {
        self.scene.aircraft[place].aircraft.id
    }

    fn fallback(&self, flyer: ShieldedAircraft) -> SafeManeuver {
        SafeManeuver::fallback(flyer, self.steps(), self.dtau_s())
    }

    fn aircraft_from_proposal(&self, place: usize, proposal: &Proposal) -> ShieldedAircraft {
        let Proposal { beacon, held, fallback, named, rank, .. } = proposal;
        ShieldedAircraft {
            id: self.id(place),
            pose: beacon.pose,
            orbit_pose: *held,
            v_m_s: beacon.v_m_s,
            omega_max_rad_s: beacon.omega_max_rad_s,
            orbit_rad_s: beacon.orbit_rad_s,
            separation_m: beacon.separation_m,
            error_m: self.scene.aircraft[place].aircraft.error_m,
            levels: beacon.levels,
            vertical_m: self.scene.vertical_m,
            fallback: *fallback,
            exempt: named.as_slice().into(),
            rank: *rank,
        }
    }

    /// Returns all orbits that an unheard airplane may be on.
    fn possible_orbits(&self, place: usize) -> Vec<ShieldedAircraft> {
        let ObservedAircraft { aircraft: flyer, is_on_orbit: orbits, .. } =
            &self.scene.aircraft[place];
        if *orbits {
            return vec![flyer.clone()];
        }
        let told = self.contacts.get(&flyer.id).and_then(|contact| contact.planned);
        let sides = match told.filter(|planned| planned.as_of == self.scene.now) {
            Some(PlanEnd { side, .. }) => vec![side],
            None => Side::BOTH.to_vec(),
        };
        sides.into_iter().map(|fallback| ShieldedAircraft { fallback, ..flyer.clone() }).collect()
    }

    fn phase(&self) -> ExchangePhase {
        match (&self.decision, &self.members[self.me].accepts, &self.result) {
            (_, _, Some(_)) => ExchangePhase::Over,
            (None, ..) => ExchangePhase::Proposals,
            (Some(_), None, _) => ExchangePhase::Plans,
            (Some(_), Some(_), None) => ExchangePhase::Consent,
        }
    }

    /// Continues as far as the messages heard allow.
    fn advance(&mut self) -> Vec<ExchangeMessage> {
        let mut said = Vec::new();
        while link::Agent::awaited_members(self).is_empty() {
            match self.phase() {
                ExchangePhase::Proposals if self.scene.certainty == PlanCertainty::Sure => {
                    self.commit_plan()
                }
                ExchangePhase::Proposals => said.push(self.send_plan()),
                ExchangePhase::Plans => said.push(self.accept()),
                ExchangePhase::Consent => self.conclude(),
                ExchangePhase::Over => break,
            }
        }
        said
    }

    /// Computes plans for all, as all others do from the same proposals, and will fly its own.
    fn commit_plan(&mut self) {
        let decision = self.filter_plans();
        self.decision = Some(decision);
        let contacts = self.contacts.clone();
        self.result = Some(ExchangeResult { decision, held_back: false, contacts });
    }

    /// Computes plans for all, and returns its own.
    fn filter_plans(&self) -> ShieldDecision {
        let mut flyers = Vec::new();
        let mut candidates = Vec::new();
        let mut mine = 0;
        for place in 0..self.size() {
            if place == self.me {
                mine = flyers.len();
                flyers.push(self.flyer.clone());
                candidates.push(self.own.ways.clone());
            } else if let Some(proposal) = &self.members[place].proposal {
                flyers.push(self.aircraft_from_proposal(place, proposal));
                candidates.push(proposal.ways.clone());
            } else {
                // An unheard airplane takes part on every orbit it may be on, without a choice.
                let mut possible = self.possible_orbits(place);
                let named = self.exempt_with(place);
                possible.iter_mut().for_each(|flyer| flyer.exempt = named.clone());
                candidates.extend(possible.iter().map(|_| Vec::new()));
                flyers.extend(possible);
            }
        }
        let (steps, dtau_s) = (self.steps(), self.dtau_s());
        filter(&flyers, &candidates, steps, dtau_s, self.scene.certainty)[mine]
    }

    /// Returns the members with which an unheard airplane is named, as far as they say so themselves.
    fn exempt_with(&self, place: usize) -> ExemptIds {
        let id = self.id(place);
        let names = |other: &usize| match &self.members[*other].proposal {
            _ if *other == self.me => self.flyer.exempt.contains(&id),
            Some(proposal) => proposal.named.contains(&id),
            None => false,
        };
        (0..self.size()).filter(names).map(|other| self.id(other)).collect()
    }

    /// Computes its plan, and sends it.
    fn send_plan(&mut self) -> ExchangeMessage {
        let decision = self.filter_plans();
        self.decision = Some(decision);
        let way = decision.candidate.map(|k| (self.own.ways[k].clone(), decision.fallback));
        // Its fallback needs no consent, because all others keep apart from it anyway.
        self.asked = match way.is_some() {
            true => self.consent_members(&self.plan_of(self.flyer.clone(), &way)),
            false => Vec::new(),
        };
        self.members[self.me].plan = Some(way.clone());
        ExchangeMessage::Plan(way)
    }

    /// Returns the plan of a member, from its message.
    fn plan_of(&self, flyer: ShieldedAircraft, way: &Option<(TurnProfile, Side)>) -> SafeManeuver {
        match way {
            Some((way, side)) => SafeManeuver::new(flyer, way, self.dtau_s(), *side),
            None => self.fallback(flyer),
        }
    }

    /// Accepts the plans that keep apart from both its own plan and its own fallback.
    fn accept(&mut self) -> ExchangeMessage {
        let own = self.members[self.me].plan.clone().flatten();
        let mine = [self.plan_of(self.flyer.clone(), &own), self.fallback(self.flyer.clone())];
        let mut accepts = Vec::new();
        for place in (0..self.size()).filter(|&place| place != self.me) {
            let ExchangeMember { proposal: Some(proposal), plan: Some(plan), .. } =
                &self.members[place]
            else {
                continue;
            };
            // A member whose plan was not among its proposals is not to be believed.
            let is_proposed = plan.as_ref().is_none_or(|(way, _)| proposal.ways.contains(way));
            let theirs = self.plan_of(self.aircraft_from_proposal(place, proposal), plan);
            if is_proposed && mine.iter().all(|plan| plan.is_compatible(&theirs)) {
                accepts.push(self.id(place));
            }
        }
        self.members[self.me].accepts = Some(accepts.clone());
        ExchangeMessage::Accepts(accepts)
    }

    /// Returns the members whose consent a plan of this airplane needs.
    fn consent_members(&self, plan: &SafeManeuver) -> Vec<usize> {
        let needs = |&place: &usize| {
            let other = &self.scene.aircraft[place].aircraft;
            self.flyer.is_protected_from(other)
                && self.scene.has_priority(place, self.me)
                && !plan.is_clear_of(other)
        };
        (0..self.size()).filter(|&place| place != self.me).filter(needs).collect()
    }

    /// Returns whether a member has agreed to this airplane's plan.
    fn has_agreed(&self, place: usize) -> bool {
        let accepts = self.members[place].accepts.as_ref();
        accepts.is_some_and(|accepted| accepted.contains(&self.id(self.me)))
    }

    /// Returns whether a member was present and not heard in the exchange before.
    fn was_unheard(&self, place: usize) -> bool {
        let contact = self.contacts.get(&self.id(place));
        let unheard_in = contact.and_then(|contact| contact.unheard_in);
        unheard_in.is_some_and(|cycle| cycle + 1 == self.scene.now)
    }

    /// Ends the exchange: the airplane flies its plan, or its fallback.
    fn conclude(&mut self) {
        let fallback = ShieldDecision { candidate: None, fallback: self.flyer.fallback };
        let wanted = self.decision.unwrap_or(fallback);
        let all_agree = self.asked.iter().all(|&place| self.has_agreed(place));
        self.result = Some(ExchangeResult {
            decision: if all_agree { wanted } else { fallback },
            held_back: !all_agree,
            contacts: self.traffic_picture(),
        });
    }

    /// Returns its knowledge of others after this `dt`.
    fn traffic_picture(&self) -> TrafficPicture {
        let now = self.scene.now;
        let mut contacts = self.contacts.clone();
        for (place, member) in self.members.iter().enumerate().filter(|(k, _)| *k != self.me) {
            let id = self.id(place);
            let flyer = match &member.proposal {
                Some(proposal) => {
                    record_beacon(&mut contacts, id, proposal.beacon.clone(), now);
                    self.aircraft_from_proposal(place, proposal)
                }
                None => self.possible_orbits(place).swap_remove(0),
            };
            // Use the sighting, if it was never heard.
            let sighted = || {
                TrafficState::from_beacon(
                    StateBeacon::from_aircraft(&self.scene.aircraft[place].aircraft),
                    now,
                )
            };
            let contact = contacts.entry(id).or_insert_with(sighted);
            let is_heard = member.proposal.is_some();
            // Where it is seen to fly a way, it has flown the plan that it has told.
            let planned = member.plan.as_ref().and_then(Option::as_ref);
            contact.planned = planned.map(|(_, side)| PlanEnd { as_of: now + 1, side: *side });
            contact.presumed = Some(self.orbit_state(&self.fallback(flyer)));
            contact.unheard_in = (!is_heard).then_some(now);
        }
        contacts
    }

    /// Returns the orbit at the end of a plan.
    fn orbit_state(&self, plan: &SafeManeuver) -> OrbitState {
        let [wx, wy] = self.scene.air.wind_m_s.map(|w| w * self.scene.air.timing.dt_s);
        let mut pose = plan.end();
        pose.at = [pose.at[0] + wx, pose.at[1] + wy];
        OrbitState { pose, as_of: self.scene.now + 1, side: plan.side() }
    }
}

impl link::Agent for ExchangeAgent {
    type Message = ExchangeMessage;
    type Outcome = ExchangeResult;

    fn start(&mut self) -> Vec<ExchangeMessage> {
        let mut said = vec![ExchangeMessage::Proposal(self.own.clone())];
        said.extend(self.advance());
        said
    }

    fn check(&self, from: usize, message: &ExchangeMessage) -> Result<(), InvalidMessage> {
        match message {
            ExchangeMessage::Proposal(proposal) => self.scene.check_proposal(from, proposal),
            ExchangeMessage::Plan(plan) => {
                plan.iter().try_for_each(|(way, _)| self.scene.check_profile(from, way))
            }
            ExchangeMessage::Accepts(accepted) => self.scene.check_members(accepted),
        }
    }

    fn limits(&self) -> MessageLimits {
        MessageLimits { bytes: self.scene.max_message_bytes(), messages: 3 }
    }

    fn on_message(&mut self, from: usize, message: ExchangeMessage) -> Vec<ExchangeMessage> {
        let has_planned = self.decision.is_some();
        let has_accepted = self.members[self.me].accepts.is_some();
        let member = &mut self.members[from];
        match message {
            // The proposal of a member that was given up is too late once plans are made.
            ExchangeMessage::Proposal(proposal) if !has_planned => member.proposal = Some(proposal),
            ExchangeMessage::Plan(plan) if !has_accepted => member.plan = Some(plan),
            ExchangeMessage::Accepts(accepted) => member.accepts = Some(accepted),
            _ => {}
        }
        self.advance()
    }

    fn is_expected(&self, other: usize) -> bool {
        !self.was_unheard(other)
    }

    fn awaited_members(&self) -> Vec<usize> {
        let stage = self.phase();
        let is_missing = |place: usize| {
            let member = &self.members[place];
            match stage {
                ExchangePhase::Proposals => member.proposal.is_none(),
                ExchangePhase::Plans => member.plan.is_none(),
                ExchangePhase::Consent => member.accepts.is_none() && self.asked.contains(&place),
                ExchangePhase::Over => false,
            }
        };
        let others = (0..self.size()).filter(|&place| place != self.me);
        others.filter(|&place| !self.members[place].gone && is_missing(place)).collect()
    }

    fn wait_fraction(&self) -> f64 {
        match self.phase() {
            ExchangePhase::Proposals => 0.5,
            ExchangePhase::Plans => 0.75,
            // Some time is left for an orderly end.
            ExchangePhase::Consent | ExchangePhase::Over => 0.95,
        }
    }

    fn on_peer_gone(&mut self, other: usize, _: bool) -> Vec<ExchangeMessage> {
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

    fn outcome(&self) -> Option<ExchangeResult> {
        self.result.clone()
    }
}
