//! The shield between airplanes that talk over a network.
//!
//! On a network that loses nothing, all airplanes send all others their place, their stored
//! fallback and the ways they would fly; all know the same, filter the same, and compute the same
//! plans.
//!
//! On one that loses messages no airplane can be sure what others know. So plans must stay safe
//! whichever of them are flown, and no airplane flies one that others may not know:
//!
//! 1. Each airplane sends its *proposal* as above.
//! 2. From the proposals it has heard each computes plans by [`filter`] that are *mixable*: each
//!    plan keeps apart from every other one's plan and from its fallback too. An airplane that
//!    was not heard is taken to be on any orbit it may be on. Each sends its own *plan*.
//! 3. Each *accepts* the plans of others that keep apart from its own plan and its own fallback,
//!    and sends the list of those it accepts.
//! 4. An airplane flies its plan if all others near it have accepted it, else its fallback.
//!
//! Airplanes nearby can be seen, heard or not: their place, and the side to which they turn if they
//! are on an orbit. What cannot be seen is what an airplane wants, and the fallback of one that
//! flies a way. So the orbits that an unheard airplane may be on are: those that follow from what
//! was heard in the exchange before; or the one on which it is seen; or else both from where it is
//! seen.
//!
//! **Invariant.** For any two airplanes, the orbits that the one may be on, as far as the other
//! knows, include the one it is on; and the orbits that the two are on keep apart.
//!
//! *Why it is kept.* Take `i` and `j`. If `i` has accepted `j`'s plan, it knows that `j` is on
//! that plan's orbit or on its fallback; both keep apart from `i`'s plan and from its fallback,
//! as it has checked both. If it has not, `j` flies its fallback, which `i` knows of: from the
//! proposal, or, if it has not heard it, as one of the orbits possible, from all of which `i`'s
//! plan keeps apart. The same holds the other way round. So both are on orbits that the other
//! knows of, and those that they are on keep apart.
//!
//! An airplane whose radio is dead knows it, and stays on its fallback. Others wait in vain for it
//! to accept anything. After some exchanges in a row without hearing from it they take its radio to
//! be dead, and fly without its consent any plan that keeps apart from every orbit it may be on.
//! The one risk taken here is that its radio works all the same, and everything was lost: below
//! 1e-12 each time (`Network::silent_after`).

mod scene;

use super::contact::{Beacon, Contact, Contacts, Orbiting, note};
use super::link;
use crate::shield::{Certainty, Decision, Flyer, Plan, Side, Way, filter};
pub use scene::{Scene, Seen};
use serde::{Deserialize, Serialize};
use sidestep_kernel::EntityId;
use std::sync::Arc;

/// Messages between airplanes.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum Message {
    /// Place of the sender, and the ways it would fly.
    Proposal(Proposal),
    /// The way it will fly if all agree, and the side to which it turns then; `None` for its
    /// fallback.
    Plan(Option<(Way, Side)>),
    /// Places of the airplanes whose plans it accepts.
    Accepts(Vec<u16>),
}

/// Place of an airplane, and the ways it would fly.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Proposal {
    beacon: Beacon,
    fallback: Side,
    named: Vec<EntityId>,
    rank: u64,
    ways: Vec<Way>,
}

impl Proposal {
    /// Returns the proposal of an airplane: the ways that it may fly, the wanted one first.
    pub fn new(flyer: &Flyer, ways: &[Way]) -> Self {
        Self {
            beacon: Beacon::of(flyer),
            fallback: flyer.fallback,
            named: flyer.named.to_vec(),
            rank: flyer.rank,
            ways: ways.to_vec(),
        }
    }
}

/// Another member of the group.
#[derive(Debug, Default)]
struct Member {
    proposal: Option<Proposal>,
    /// Its plan, when it is known; `Some(None)` stands for its fallback.
    plan: Option<Option<(Way, Side)>>,
    accepts: Option<Vec<u16>>,
    gone: bool,
    /// Whether this airplane has accepted its plan.
    accepted: bool,
}

/// Outcome of the exchange for one airplane.
#[derive(Debug, Clone, PartialEq)]
pub struct Agreed {
    /// Decision of the shield for the airplane.
    pub decision: Decision,
    /// Whether it would have flown another way if all had agreed.
    pub held_back: bool,
    /// Its knowledge of others after the exchange.
    pub contacts: Contacts,
}

/// The shield's agent of one airplane.
#[derive(Debug)]
pub struct Agent {
    scene: Arc<Scene>,
    me: usize,
    flyer: Flyer,
    own: Proposal,
    contacts: Contacts,
    members: Vec<Member>,
    decision: Option<Decision>,
    agreed: Option<Agreed>,
}

impl Agent {
    /// Returns an agent that has not sent anything yet, for the airplane at place `me`, which may
    /// fly `ways`.
    pub fn new(scene: Arc<Scene>, me: usize, ways: &[Way], contacts: Contacts) -> Self {
        let flyer = scene.seen[me].flyer.clone();
        Self {
            me,
            own: Proposal::new(&flyer, ways),
            flyer,
            contacts,
            members: scene.seen.iter().map(|_| Member::default()).collect(),
            scene,
            decision: None,
            agreed: None,
        }
    }

    fn dtau_s(&self) -> f64 {
        self.scene.air.timing.dtau_s
    }

    fn steps(&self) -> usize {
        self.scene.air.timing.points_per_dt()
    }

    fn size(&self) -> usize {
        self.scene.seen.len()
    }

    fn id(&self, place: usize) -> EntityId {
        self.scene.seen[place].flyer.id
    }

    fn fallback(&self, flyer: Flyer) -> Plan {
        Plan::fallback(flyer, self.steps(), self.dtau_s())
    }

    fn flyer_of(&self, place: usize, proposal: &Proposal) -> Flyer {
        let Proposal { beacon, fallback, named, rank, .. } = proposal;
        Flyer {
            id: self.id(place),
            pose: beacon.pose,
            held: beacon.pose,
            v_m_s: beacon.v_m_s,
            orbit_rad_s: beacon.orbit_rad_s,
            separation_m: beacon.separation_m,
            error_m: self.scene.seen[place].flyer.error_m,
            levels: beacon.levels,
            vertical_m: self.scene.vertical_m,
            fallback: *fallback,
            named: named.as_slice().into(),
            rank: *rank,
        }
    }

    /// Returns all orbits that an unheard airplane may be on.
    fn possible(&self, place: usize) -> Vec<Flyer> {
        let Seen { flyer, orbits } = &self.scene.seen[place];
        let told = self.contacts.get(&flyer.id).map_or(&[][..], |contact| &contact.possible);
        let fresh = told.iter().filter(|orbiting| orbiting.as_of == self.scene.now);
        let at = |&Orbiting { pose, side, .. }: &Orbiting| Flyer {
            pose,
            held: pose,
            fallback: side,
            ..flyer.clone()
        };
        let heard: Vec<Flyer> = fresh.map(at).collect();
        match heard.is_empty() {
            false => heard,
            true if *orbits => vec![flyer.clone()],
            true => Side::BOTH.map(|fallback| Flyer { fallback, ..flyer.clone() }).into(),
        }
    }

    /// Continues as far as the messages heard allow.
    fn go_on(&mut self) -> Vec<Message> {
        let mut said = Vec::new();
        while self.agreed.is_none() && link::Agent::awaits(self).is_empty() {
            if self.decision.is_none() {
                said.push(self.plan());
            } else if self.members[self.me].accepts.is_none() {
                said.push(self.accept());
            } else {
                self.agree();
            }
        }
        said
    }

    /// Computes plans for all, and sends its own.
    fn plan(&mut self) -> Message {
        let mut flyers = Vec::new();
        let mut candidates = Vec::new();
        let mut mine = 0;
        for place in 0..self.size() {
            if place == self.me {
                mine = flyers.len();
                flyers.push(self.flyer.clone());
                candidates.push(self.own.ways.clone());
            } else if let Some(proposal) = &self.members[place].proposal {
                flyers.push(self.flyer_of(place, proposal));
                candidates.push(proposal.ways.clone());
            } else {
                // An unheard airplane takes part on every orbit it may be on, without a choice.
                let possible = self.possible(place);
                candidates.extend(possible.iter().map(|_| Vec::new()));
                flyers.extend(possible);
            }
        }
        let frame = (self.steps(), self.dtau_s());
        let decision = filter(&flyers, &candidates, frame, Certainty::Mixable)[mine];
        self.decision = Some(decision);
        let way = decision.candidate.map(|k| (self.own.ways[k].clone(), decision.fallback));
        self.members[self.me].plan = Some(way.clone());
        Message::Plan(way)
    }

    /// Returns the plan of a member, from its message.
    fn plan_of(&self, flyer: Flyer, way: &Option<(Way, Side)>) -> Plan {
        match way {
            Some((way, side)) => Plan::new(flyer, way, self.dtau_s(), *side),
            None => self.fallback(flyer),
        }
    }

    /// Accepts the plans that keep apart from both its own plan and its own fallback.
    fn accept(&mut self) -> Message {
        let own = self.members[self.me].plan.clone().flatten();
        let mine = [self.plan_of(self.flyer.clone(), &own), self.fallback(self.flyer.clone())];
        let mut accepted = Vec::new();
        for place in (0..self.size()).filter(|&place| place != self.me) {
            let Member { proposal: Some(proposal), plan: Some(plan), .. } = &self.members[place]
            else {
                continue;
            };
            let theirs = self.plan_of(self.flyer_of(place, proposal), plan);
            if mine.iter().all(|plan| plan.is_compatible(&theirs)) {
                accepted.push(place);
            }
        }
        accepted.iter().for_each(|&place| self.members[place].accepted = true);
        let accepts: Vec<u16> = accepted.iter().map(|&place| place as u16).collect();
        self.members[self.me].accepts = Some(accepts.clone());
        Message::Accepts(accepts)
    }

    /// Returns whether a member has agreed to this airplane's plan, or need not be asked.
    fn agrees(&self, place: usize) -> bool {
        let member = &self.members[place];
        let me = self.me as u16;
        if member.accepts.as_ref().is_some_and(|accepted| accepted.contains(&me)) {
            return true;
        }
        // The shield need not keep them apart, or the radio is taken to be dead.
        !self.flyer.minds(&self.scene.seen[place].flyer)
            || (member.proposal.is_none() && self.unheard_before(place) >= self.scene.silent_after)
    }

    /// Returns the number of exchanges in a row, up to the one before, in which a member was
    /// present and not heard.
    fn unheard_before(&self, place: usize) -> u32 {
        let contact = self.contacts.get(&self.id(place));
        contact.filter(|c| c.met_in + 1 == self.scene.now).map_or(0, |contact| contact.unheard)
    }

    /// Ends the exchange: the airplane flies its plan, or its fallback.
    fn agree(&mut self) {
        let fallback = Decision { candidate: None, fallback: self.flyer.fallback };
        let wanted = self.decision.unwrap_or(fallback);
        let mut others = (0..self.size()).filter(|&place| place != self.me);
        // The fallback needs no consent, because all others keep apart from it anyway.
        let all_agree = wanted.candidate.is_none() || others.all(|place| self.agrees(place));
        self.agreed = Some(Agreed {
            decision: if all_agree { wanted } else { fallback },
            held_back: !all_agree,
            contacts: self.known_now(),
        });
    }

    /// Returns its knowledge of others after this `dt`.
    fn known_now(&self) -> Contacts {
        let mut contacts = self.contacts.clone();
        for (place, member) in self.members.iter().enumerate().filter(|(k, _)| *k != self.me) {
            let id = self.id(place);
            let Some(proposal) = &member.proposal else {
                let unheard = self.unheard_before(place) + 1;
                // Use the sighting, if it was never heard.
                let sighted =
                    || Contact::heard(Beacon::of(&self.scene.seen[place].flyer), self.scene.now);
                let contact = contacts.entry(id).or_insert_with(sighted);
                (contact.unheard, contact.met_in) = (unheard, self.scene.now);
                continue;
            };
            let flyer = self.flyer_of(place, proposal);
            let mut plans = vec![self.fallback(flyer.clone())];
            if let Some(plan) = member.plan.as_ref().filter(|_| member.accepted) {
                plans.push(self.plan_of(flyer, plan));
            }
            note(&mut contacts, id, proposal.beacon.clone(), self.scene.now);
            if let Some(contact) = contacts.get_mut(&id) {
                (contact.unheard, contact.met_in) = (0, self.scene.now);
                contact.possible = plans.iter().map(|plan| self.orbiting(plan)).collect();
            }
        }
        contacts
    }

    /// Returns the orbit at the end of a plan.
    fn orbiting(&self, plan: &Plan) -> Orbiting {
        let [wx, wy] = self.scene.air.wind_m_s.map(|w| w * self.scene.air.timing.dt_s);
        let mut pose = plan.end();
        pose.at = [pose.at[0] + wx, pose.at[1] + wy];
        Orbiting { pose, as_of: self.scene.now + 1, side: plan.side() }
    }
}

impl link::Agent for Agent {
    type Message = Message;
    type Outcome = Agreed;

    fn start(&mut self) -> Vec<Message> {
        let mut said = vec![Message::Proposal(self.own.clone())];
        said.extend(self.go_on());
        said
    }

    fn on_message(&mut self, from: usize, message: Message) -> Vec<Message> {
        let has_planned = self.decision.is_some();
        let has_accepted = self.members[self.me].accepts.is_some();
        let member = &mut self.members[from];
        match message {
            // The proposal of one that was given up is too late once plans are made.
            Message::Proposal(proposal) if !has_planned => member.proposal = Some(proposal),
            Message::Plan(plan) if !has_accepted => member.plan = Some(plan),
            Message::Accepts(accepted) => member.accepts = Some(accepted),
            _ => {}
        }
        self.go_on()
    }

    fn expects(&self, other: usize) -> bool {
        self.unheard_before(other) == 0
    }

    fn awaits(&self) -> Vec<usize> {
        if self.agreed.is_some() {
            return Vec::new();
        }
        let has_accepted = self.members[self.me].accepts.is_some();
        let missing = |member: &Member| match self.decision {
            None => member.proposal.is_none(),
            Some(_) if has_accepted => member.accepts.is_none(),
            Some(_) => member.plan.is_none(),
        };
        let others = (0..self.size()).filter(|&place| place != self.me);
        others.filter(|&j| !self.members[j].gone && missing(&self.members[j])).collect()
    }

    fn without(&mut self, other: usize, _: bool) -> Vec<Message> {
        self.members[other].gone = true;
        self.go_on()
    }

    /// Ends the exchange because time is up. Without a decision, or without the consent of others,
    /// the airplane stays on its fallback.
    fn at_deadline(&mut self) {
        if self.agreed.is_none() {
            self.agree();
        }
    }

    fn outcome(&self) -> Option<Agreed> {
        self.agreed.clone()
    }
}
