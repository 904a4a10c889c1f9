//! The conclusions that a pilot draws: from its perception, and from the talks that it has ended.

use super::Pilot;
use super::cycle_state::CyclePhase;
use crate::agents::exchange::ExchangeResult;
use crate::agents::intent::Intent;
use crate::agents::packet::Protocol;
use crate::agents::traffic_state::{TrafficPicture, record_beacon};
use crate::agents::{ConversationEnd, OptimizationResult};
use crate::decide::{
    DecisionStrategy, ManeuverCandidates, candidates_alone, candidates_by_choice,
    candidates_by_velocity,
};
use crate::events::{Event, EventKind};
use crate::flight::KnownAircraft;
use crate::pilot::common_knowledge::unheard_aircraft;
use crate::pilot::control::{Maneuver, OptimizerStats};
use crate::pilot::conversations::ConversationOutcome;
use crate::pilot::percept::SurveillanceReport;

impl Pilot {
    /// Notes the group that it has found; without an outcome it is alone.
    fn on_group(&mut self, came: Option<ConversationOutcome>, tick: u64) {
        let Some(turn) = &mut self.turn else { return };
        let sight = &mut turn.percept;
        let near = std::mem::take(&mut sight.group);
        match came {
            Some(ConversationOutcome::Grouping(found)) => {
                (sight.group, sight.intruders) = (found.members, found.intruders);
            }
            _ => sight.group = near.iter().filter(|one| one.id == self.id).copied().collect(),
        }
        turn.members = sight.members().into();
        let is_member = |one: &SurveillanceReport| turn.members.binary_search(&one.id).is_ok();
        turn.unheard = near.into_iter().filter(|one| !is_member(one)).collect();
        let unheard = turn.unheard.iter().map(|one| one.id).collect();
        turn.record_unheard(&self.world, unheard, &self.memory.contacts);
        self.decide(tick);
    }

    /// Starts to choose its wishes.
    pub(super) fn decide(&mut self, tick: u64) {
        let Some(turn) = &self.turn else { return };
        let group: Vec<KnownAircraft> =
            turn.percept.group.iter().map(|one| one.known_aircraft()).collect();
        let others = turn.percept.intruders.len() + turn.unheard.len();
        let manner = DecisionStrategy::for_group(&self.world, &group, others);
        match manner {
            DecisionStrategy::Joint | DecisionStrategy::Reactive => {
                self.start_conversation(Protocol::Decision, tick)
            }
            DecisionStrategy::Independent | DecisionStrategy::GroupTooLarge => {
                self.decide_alone(manner, group.len())
            }
        }
    }

    /// Decides without a talk.
    pub(super) fn decide_alone(&mut self, manner: DecisionStrategy, members: usize) {
        let Some(turn) = &mut self.turn else { return };
        let own = &turn.percept.own;
        if manner == DecisionStrategy::GroupTooLarge && turn.members.first() == Some(&self.id) {
            let event = Event::new(turn.percept.cycle, EventKind::GroupTooLarge, self.id);
            turn.control.events.push(event.with_value(members as f64));
        }
        let considered = candidates_alone(&self.world, own.known_aircraft(), own.wish.as_ref());
        self.set_candidates(considered);
    }

    /// Notes its wishes; without the shield it flies the first of them.
    fn set_candidates(&mut self, considered: ManeuverCandidates) {
        let Some(turn) = &mut self.turn else { return };
        turn.candidates = considered;
        turn.phase = CyclePhase::Decided;
        if !self.world.shield {
            let way = turn.candidates.ways.first().cloned().unwrap_or_default();
            let side = turn.percept.own.fallback;
            turn.control.course = Maneuver::Way { wish: 0, way, side };
            self.finish_cycle();
        }
    }

    fn finish_cycle(&mut self) {
        if let Some(turn) = &mut self.turn {
            turn.phase = CyclePhase::Over;
            turn.control.memory = self.memory.clone();
        }
    }

    /// Ends the talk that it is in, and draws the conclusion from it.
    pub(super) fn on_conversation_end(
        &mut self,
        ended: ConversationEnd<ConversationOutcome>,
        tick: u64,
    ) {
        let Some(turn) = &mut self.turn else { return };
        if self.world.network.is_some() {
            turn.record_end(&self.world, &ended, &self.memory.contacts);
        }
        match std::mem::replace(&mut turn.phase, CyclePhase::Decided) {
            CyclePhase::Grouping(talk) => {
                self.push_past(talk);
                self.on_group(ended.outcome, tick);
            }
            CyclePhase::Deciding(talk) => {
                self.push_past(talk);
                match ended.outcome {
                    Some(ConversationOutcome::Intents(told)) => self.on_intents(&told),
                    Some(ConversationOutcome::Optimization(conclusion)) => {
                        self.on_optimization(Some(conclusion))
                    }
                    _ => self.on_optimization(None),
                }
            }
            CyclePhase::Shielding(talk, allowed) => {
                self.push_past(talk);
                self.on_exchange(ended.outcome, &allowed);
            }
            CyclePhase::Decided | CyclePhase::Over => {}
        }
    }

    /// Notes the outcome of the shield's exchange, in which it has proposed the ways that were `allowed`.
    fn on_exchange(&mut self, came: Option<ConversationOutcome>, allowed: &[usize]) {
        let Some(turn) = &mut self.turn else { return };
        self.memory.contacts = match came {
            Some(ConversationOutcome::Exchange(ExchangeResult {
                decision,
                held_back,
                contacts,
            })) => {
                if held_back {
                    let event = Event::new(turn.percept.cycle, EventKind::HeldBack, self.id);
                    turn.control.events.push(event);
                }
                turn.control.course = Maneuver::from_decision(decision, allowed, &turn.candidates);
                contacts
            }
            // Without an agreement it no longer knows where any other airplane is.
            _ => TrafficPicture::new(),
        };
        self.finish_cycle();
    }

    /// Notes the outcome of an optimization; none if time was up before there was any.
    fn on_optimization(&mut self, conclusion: Option<OptimizationResult>) {
        let Some(turn) = &mut self.turn else { return };
        let (decided, beacons) =
            conclusion.map_or_else(Default::default, |came| (came.decided, came.beacons));
        turn.control.optimized = Some(OptimizerStats::from_choice(decided.as_ref()));
        if self.world.network.is_some() {
            for (beacon, &id) in beacons.into_iter().zip(&*turn.members) {
                if let Some(beacon) = beacon {
                    record_beacon(&mut self.memory.contacts, id, beacon, turn.percept.cycle);
                }
            }
        }
        let considered =
            candidates_by_choice(&self.world, turn.percept.own.known_aircraft(), decided);
        self.set_candidates(considered);
    }

    /// Finds the headings of all from their messages; one without a message is taken to fly straight on.
    fn on_intents(&mut self, told: &[Option<Intent>]) {
        let Some(turn) = &self.turn else { return };
        let (mut group, mut memory, mut me) = (Vec::new(), Vec::new(), 0);
        let beside = turn.unheard.iter().map(|one| unheard_aircraft(&self.world, one));
        let mut intruders: Vec<_> = turn.percept.intruders.iter().cloned().chain(beside).collect();
        for (one, intent) in turn.percept.group.iter().zip(told) {
            let Some(intent) = intent else {
                intruders.push(unheard_aircraft(&self.world, one));
                continue;
            };
            if one.id == self.id {
                me = group.len();
            }
            let &Intent { next, orders, altitude_m, .. } = intent;
            let next = next as usize;
            group.push(KnownAircraft { slot: one.id, pose: one.pose, next, orders, altitude_m });
            memory.push(intent.resolving.clone());
        }
        let mut all = candidates_by_velocity(&self.world, &group, &intruders, &mut memory);
        if self.world.has_resolutions() {
            self.memory.resolving = memory.swap_remove(me);
        }
        self.set_candidates(all.swap_remove(me));
    }
}
