//! The shield between airplanes that talk over a network.
//!
//! On a network that loses nothing, everybody tells everybody its place, its stored fallback and
//! the ways it would fly; all know the same, filter the same, and come to the same plans.
//!
//! On one that loses messages nobody can be sure what others know. So plans must stay safe
//! whichever of them are flown, and nobody flies one of which others may not know:
//!
//! 1. Everybody tells its *proposal* as above, and what it knows of those it does not hear.
//! 2. From the proposals it has heard each works out plans by [`filter`] that are *mixable*: each
//!    plan keeps apart from every other one's plan and from its fallback too. Whoever was not
//!    heard is taken to be on any orbit it may be on. Each tells its own *plan*.
//! 3. Each *accepts* the plans of others that keep apart from its own plan and its own fallback,
//!    and tells whom it accepts.
//! 4. An airplane flies its plan if all those near it have accepted it, else its fallback.
//!
//! **Invariant.** For any two airplanes, every orbit that the one may be on as far as the other
//! knows keeps apart from every orbit that the other may be on as far as the one knows; and each
//! is on one of those that the other knows.
//!
//! *Why it is kept.* Take `i` and `j`. If `i` has accepted `j`'s plan, it knows that `j` is on
//! that plan's orbit or on its fallback; both keep apart from `i`'s plan and from its fallback,
//! as it has checked both. If it has not, `j` flies its fallback, which `i` knows of: from the
//! proposal, or, if it has not heard it, as one of the orbits possible so far, from all of which
//! `i`'s plan keeps apart. The same holds the other way round. So both are on orbits that the
//! other knows of, and all these keep apart.
//!
//! An airplane whose radio is dead knows it, and stays on its fallback. Others wait in vain for
//! it to accept anything. After [`SILENT_AFTER`] exchanges in a row without hearing from it they
//! take its radio to be dead, and fly without its consent what keeps apart from every orbit it
//! may be on: the one it was on when it was last heard, or the start of its flight as filed. Were
//! its radio alive, dozens of questions in a row, or the answers to them, would have been lost;
//! that is the one chance which is taken here.

use super::super::events::{Event, EventKind};
use super::super::shield::{Certainty, Decision, Flyer, Plan, Side, Way, filter};
use super::super::world::AirspaceWorld;
use super::contact::{Beacon, Contact, Contacts, Orbiting, note};
use super::network::{Ended, Topic, Traffic, run};
use super::{Deployment, link};
use serde::{Deserialize, Serialize};
use sidestep_kernel::{Cycle, EntityId};

/// So many exchanges in a row without a word from another one: its radio is dead.
pub(super) const SILENT_AFTER: u32 = 3;

/// What airplanes tell each other.
#[derive(Debug, Clone, Serialize, Deserialize)]
enum Message {
    /// Where the sender is, what it would do, and whom it has not heard of late.
    Proposal(Proposal),
    /// The way it will fly if all agree, and the side it turns to then; `None`: its fallback.
    Plan(Option<(Way, Side)>),
    /// Places of those whose plans it accepts.
    Accepts(Vec<u16>),
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct Proposal {
    beacon: Beacon,
    fallback: Side,
    came_too_close: bool,
    rank: u64,
    ways: Vec<Way>,
    unheard: Vec<(EntityId, Contact)>,
}

/// Another member of the group.
#[derive(Debug, Default)]
struct Member {
    proposal: Option<Proposal>,
    /// Its plan, when it is known; `Some(None)` is its fallback.
    plan: Option<Option<(Way, Side)>>,
    accepts: Option<Vec<u16>>,
    gone: bool,
    /// Whether this airplane has accepted its plan.
    accepted: bool,
}

/// What an airplane does after the exchange.
#[derive(Debug, Clone, PartialEq)]
struct Agreed {
    decision: Decision,
    /// It would have flown another way, had all agreed.
    held_back: bool,
    /// What it knows of others now.
    contacts: Contacts,
}

/// The shield's agent of one airplane.
struct Agent<'a> {
    world: &'a AirspaceWorld,
    now: Cycle,
    me: usize,
    ids: &'a [EntityId],
    flyer: Flyer,
    own: Proposal,
    contacts: Contacts,
    members: Vec<Member>,
    decision: Option<Decision>,
    agreed: Option<Agreed>,
}

impl Agent<'_> {
    fn dtau_s(&self) -> f64 {
        self.world.timing.dtau_s
    }

    fn steps(&self) -> usize {
        self.world.timing.points_per_dt()
    }

    fn fallback(&self, flyer: Flyer) -> Plan {
        Plan::fallback(flyer, self.steps(), self.dtau_s())
    }

    fn flyer_of(&self, place: usize, proposal: &Proposal) -> Flyer {
        let Proposal { beacon, fallback, came_too_close, rank, .. } = proposal;
        Flyer {
            id: self.ids[place],
            pose: beacon.pose,
            v_m_s: beacon.v_m_s,
            omega_max_rad_s: beacon.omega_max_rad_s,
            separation_m: beacon.separation_m,
            levels: beacon.levels,
            vertical_m: self.world.vertical_m,
            fallback: *fallback,
            came_too_close: *came_too_close,
            rank: *rank,
        }
    }

    /// What it knows of a member: what it has heard, or the flight as it was filed.
    fn contact(&self, place: usize) -> Contact {
        let id = self.ids[place];
        self.contacts.get(&id).cloned().unwrap_or_else(|| self.world.filed(id))
    }

    /// All orbits that an unheard airplane may be on.
    fn possible(&self, place: usize) -> Vec<Flyer> {
        let (id, contact) = (self.ids[place], self.contact(place));
        let flyer = |o: &Orbiting| o.flyer(self.world, (id, &contact.beacon), self.now);
        contact.possible.iter().map(flyer).collect()
    }

    /// Goes on as far as what has been heard allows.
    fn go_on(&mut self) -> Vec<Message> {
        let mut said = Vec::new();
        while self.agreed.is_none() && link::Agent::awaits(self).is_empty() {
            if self.decision.is_none() {
                self.learn_of_unheard();
                said.push(self.plan());
            } else if self.members[self.me].accepts.is_none() {
                said.push(self.accept());
            } else {
                self.agree();
            }
        }
        said
    }

    /// Takes over what others know of those that it has not heard.
    fn learn_of_unheard(&mut self) {
        let told = self.members.iter().flat_map(|m| m.proposal.iter().flat_map(|p| &p.unheard));
        let told: Vec<(EntityId, Contact)> = told.cloned().collect();
        for (id, contact) in told.into_iter().filter(|(id, _)| *id != self.ids[self.me]) {
            match self.contacts.get_mut(&id) {
                Some(own) if own.heard_in >= contact.heard_in => {}
                _ => {
                    self.contacts.insert(id, contact);
                }
            }
        }
    }

    /// Works out plans for all, and tells its own.
    fn plan(&mut self) -> Message {
        let mut flyers = Vec::new();
        let mut candidates = Vec::new();
        let mut mine = 0;
        for place in 0..self.ids.len() {
            if place == self.me {
                mine = flyers.len();
                flyers.push(self.flyer);
                candidates.push(self.own.ways.clone());
            } else if let Some(proposal) = &self.members[place].proposal {
                flyers.push(self.flyer_of(place, proposal));
                candidates.push(proposal.ways.clone());
            } else {
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

    /// The plan of a member, as told.
    fn plan_of(&self, flyer: Flyer, way: &Option<(Way, Side)>) -> Plan {
        match way {
            Some((way, side)) => Plan::new(flyer, way, self.dtau_s(), *side),
            None => self.fallback(flyer),
        }
    }

    /// Accepts what keeps apart from both what it would fly and what it will fly else.
    fn accept(&mut self) -> Message {
        let own = self.members[self.me].plan.clone().flatten();
        let mine = [self.plan_of(self.flyer, &own), self.fallback(self.flyer)];
        let mut accepted = Vec::new();
        for place in (0..self.ids.len()).filter(|&place| place != self.me) {
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

    /// Whether a member has agreed to this airplane's plan, or need not be asked.
    fn agrees(&self, place: usize) -> bool {
        let member = &self.members[place];
        let me = self.me as u16;
        if member.accepts.as_ref().is_some_and(|accepted| accepted.contains(&me)) {
            return true;
        }
        let contact = self.contact(place);
        let beacon = member.proposal.as_ref().map_or(&contact.beacon, |proposal| &proposal.beacon);
        let minds = self.flyer.levels.meets(&beacon.levels, self.flyer.vertical_m);
        !minds || (member.proposal.is_none() && contact.unheard >= SILENT_AFTER)
    }

    /// The end: flies its plan, or its fallback.
    fn agree(&mut self) {
        let fallback = Decision { candidate: None, fallback: self.flyer.fallback };
        let wanted = self.decision.unwrap_or(fallback);
        let mut others = (0..self.ids.len()).filter(|&place| place != self.me);
        let all_agree = wanted.candidate.is_none() || others.all(|place| self.agrees(place));
        self.agreed = Some(Agreed {
            decision: if all_agree { wanted } else { fallback },
            held_back: !all_agree,
            contacts: self.known_now(),
        });
    }

    /// What it knows of others after this `dt`.
    fn known_now(&self) -> Contacts {
        let mut contacts = self.contacts.clone();
        for (place, member) in self.members.iter().enumerate().filter(|(k, _)| *k != self.me) {
            let id = self.ids[place];
            let Some(proposal) = &member.proposal else {
                let mut contact = self.contact(place);
                contact.unheard += 1;
                contacts.insert(id, contact);
                continue;
            };
            let flyer = self.flyer_of(place, proposal);
            let mut plans = vec![self.fallback(flyer)];
            if let Some(plan) = member.plan.as_ref().filter(|_| member.accepted) {
                plans.push(self.plan_of(flyer, plan));
            }
            note(&mut contacts, id, proposal.beacon.clone(), self.now);
            if let Some(contact) = contacts.get_mut(&id) {
                contact.unheard = 0;
                contact.possible = plans.iter().map(|plan| self.orbiting(plan)).collect();
            }
        }
        contacts
    }

    /// The orbit at the end of a plan.
    fn orbiting(&self, plan: &Plan) -> Orbiting {
        let [wx, wy] = self.world.wind_m_s.map(|w| w * self.world.timing.dt_s);
        let mut pose = plan.end();
        pose.at = [pose.at[0] + wx, pose.at[1] + wy];
        Orbiting { pose, as_of: self.now + 1, side: plan.side() }
    }
}

impl link::Agent for Agent<'_> {
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
            // From one that was given up, what it would do comes too late.
            Message::Proposal(proposal) if !has_planned => member.proposal = Some(proposal),
            Message::Plan(plan) if !has_accepted => member.plan = Some(plan),
            Message::Accepts(accepted) => member.accepts = Some(accepted),
            _ => {}
        }
        self.go_on()
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
        let others = (0..self.ids.len()).filter(|&place| place != self.me);
        others.filter(|&j| !self.members[j].gone && missing(&self.members[j])).collect()
    }

    fn without(&mut self, other: usize) -> Vec<Message> {
        self.members[other].gone = true;
        self.go_on()
    }

    /// Whatever is still undecided stays on its fallback.
    fn at_deadline(&mut self) {
        if self.agreed.is_none() {
            self.agree();
        }
    }

    fn outcome(&self) -> Option<Agreed> {
        self.agreed.clone()
    }
}

/// What the shield decides for each of a group, and what went over the network.
pub(in super::super) type Shielded = (Vec<Decision>, Traffic);

impl AirspaceWorld {
    /// Filters wishes over the network of the deployment.
    pub(in super::super) fn exchanged(
        &self,
        flyers: &[Flyer],
        candidates: &[Vec<Way>],
        now: Cycle,
        contacts: &mut [Contacts],
        events: &mut Vec<Event>,
    ) -> Shielded {
        let frame = (self.timing.points_per_dt(), self.timing.dtau_s);
        if self.network.is_none() {
            let decisions = filter(flyers, candidates, frame, Certainty::Sure);
            return (decisions, self.proposals(flyers, candidates));
        }
        let ids: Vec<EntityId> = flyers.iter().map(|flyer| flyer.id).collect();
        let agent = |(me, (flyer, ways)): (usize, (&Flyer, &Vec<Way>))| Agent {
            world: self,
            now,
            me,
            ids: &ids,
            flyer: *flyer,
            own: proposal(flyer, ways, &contacts[me]),
            contacts: contacts[me].clone(),
            members: ids.iter().map(|_| Member::default()).collect(),
            decision: None,
            agreed: None,
        };
        let agents = flyers.iter().zip(candidates).enumerate().map(agent).collect();
        let (ended, traffic) = run(&self.talk(Topic::Shield, now), &ids, agents);
        let mut decisions = Vec::with_capacity(ids.len());
        for (me, end) in ended.into_iter().enumerate() {
            self.tell(&end, (ids[me], &ids), now, &contacts[me], events);
            let fallback = Decision { candidate: None, fallback: flyers[me].fallback };
            // An airplane whose radio is dead stays on its fallback, whatever it would like.
            let is_silent = self.is_silent(ids[me], now);
            decisions.push(match end {
                Ended { outcome: Some(agreed), .. } if !is_silent => {
                    if agreed.held_back {
                        events.push(Event::of(now, EventKind::HeldBack, ids[me]));
                    }
                    contacts[me] = agreed.contacts;
                    agreed.decision
                }
                _ => {
                    // It knows of nobody any more where they are.
                    contacts[me].clear();
                    fallback
                }
            });
        }
        (decisions, traffic)
    }

    /// What the proposals alone take on a network that loses nothing.
    fn proposals(&self, flyers: &[Flyer], candidates: &[Vec<Way>]) -> Traffic {
        let mut traffic = Traffic::default();
        if self.deployment == Deployment::Direct || flyers.len() < 2 {
            return traffic;
        }
        for (flyer, ways) in flyers.iter().zip(candidates) {
            let message = Message::Proposal(proposal(flyer, ways, &Contacts::new()));
            traffic.count(flyers.len() - 1, link::bytes_of(&message).len());
        }
        traffic
    }
}

fn proposal(flyer: &Flyer, ways: &[Way], contacts: &Contacts) -> Proposal {
    let beacon = Beacon {
        pose: flyer.pose,
        goal: None,
        v_m_s: flyer.v_m_s,
        omega_max_rad_s: flyer.omega_max_rad_s,
        separation_m: flyer.separation_m,
        levels: flyer.levels,
    };
    let unheard = contacts.iter().filter(|(_, contact)| contact.unheard > 0);
    Proposal {
        beacon,
        fallback: flyer.fallback,
        came_too_close: flyer.came_too_close,
        rank: flyer.rank,
        ways: ways.to_vec(),
        unheard: unheard.map(|(&id, contact)| (id, contact.clone())).collect(),
    }
}
