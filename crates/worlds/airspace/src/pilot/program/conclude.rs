//! The conclusions that a pilot draws: from its perception, and from the conversations that it has ended.

use super::Pilot;
use super::cycle_state::PilotCyclePhase;
use crate::agents::exchange::ShieldExchangeResult;
use crate::agents::intent::Intent;
use crate::agents::packet::Protocol;
use crate::agents::traffic_state::{TrafficPicture, record_beacon};
use crate::agents::{ConversationEnd, OptimizationResult};
use crate::baseline::ReactiveMemory;
use crate::decide::{
    DecisionStrategy, ManeuverCandidates, candidates_alone, candidates_by_velocity,
    candidates_from_choice, decide_by_predictions,
};
use crate::events::{Event, EventKind, search_limit};
use crate::flight::{KnownAircraft, MethodCommand};
use crate::pilot::common_knowledge::{beacon, ownship, unheard_as_non_cooperative};
use crate::pilot::control::{Maneuver, OptimizationStatus};
use crate::pilot::conversations::ConversationOutcome;
use crate::shield::ShieldDecision;

impl Pilot {
    /// Stores the group that it has found; without an outcome it is alone.
    fn on_group(&mut self, outcome: Option<ConversationOutcome>, tick: u64) {
        let Some(state) = &mut self.state else { return };
        let percept = &mut state.percept;
        let near = std::mem::take(&mut percept.group);
        match outcome {
            Some(ConversationOutcome::Grouping(found)) => {
                percept.group = found.members;
                percept.non_cooperative = found.non_cooperative;
            }
            _ => percept.group = near.iter().filter(|one| one.id == self.id).copied().collect(),
        }
        state.members = percept.members().into();
        state.unheard =
            near.into_iter().filter(|one| state.members.binary_search(&one.id).is_err()).collect();
        let unheard = state.unheard.iter().map(|one| one.id).collect();
        state.record_unheard(&self.world, unheard, &self.memory.contacts);
        self.decide(tick);
    }

    /// Starts to choose its candidates.
    pub(super) fn decide(&mut self, tick: u64) {
        let Some(state) = &self.state else { return };
        let group: Vec<KnownAircraft> =
            state.percept.group.iter().map(|one| one.as_known_aircraft()).collect();
        let others = state.percept.non_cooperative.len() + state.unheard.len();
        let strategy = DecisionStrategy::for_group(&self.world, &group, others);
        match strategy {
            DecisionStrategy::Joint | DecisionStrategy::Reactive => {
                self.start_conversation(Protocol::Decision, tick)
            }
            DecisionStrategy::Independent | DecisionStrategy::GroupTooLarge => {
                self.decide_alone(strategy, group.len())
            }
        }
    }

    /// Decides without a conversation.
    pub(super) fn decide_alone(&mut self, strategy: DecisionStrategy, members: usize) {
        let Some(state) = &mut self.state else { return };
        let own = &state.percept.own;
        if strategy == DecisionStrategy::GroupTooLarge && state.members.first() == Some(&self.id) {
            let event = Event::new(state.percept.cycle, EventKind::GroupTooLarge, self.id);
            state.control.events.push(event.with_value(members as f64));
        }
        let considered = candidates_alone(
            &self.world,
            own.as_known_aircraft(),
            own.external_action.as_ref(),
            state.percept.cycle,
        );
        self.set_candidates(considered);
    }

    /// Stores its candidates; without the shield it flies the first of them.
    fn set_candidates(&mut self, candidates: ManeuverCandidates) {
        let Some(state) = &mut self.state else { return };
        self.memory.command = candidates.command;
        state.candidates = candidates;
        state.phase = PilotCyclePhase::Decided;
        if !self.world.shield {
            let profile = state.candidates.profiles.first().cloned().unwrap_or_default();
            let fallback = state.percept.own.fallback;
            state.control.maneuver =
                Maneuver::Profile { candidate: 0, profile, fallback, is_common: false };
            self.finish_cycle();
        }
    }

    fn finish_cycle(&mut self) {
        if let Some(state) = &mut self.state {
            state.phase = PilotCyclePhase::Over;
            if self.world.has_resolution_memory() {
                self.memory.record_maneuver(&state.control.maneuver);
            }
            state.control.memory = self.memory.clone();
        }
    }

    /// Ends the conversation that it is in, and draws the conclusion from it.
    pub(super) fn on_conversation_end(
        &mut self,
        ended: ConversationEnd<ConversationOutcome>,
        tick: u64,
    ) {
        let Some(state) = &mut self.state else { return };
        if self.world.network.is_some() {
            state.record_conversation_end(&self.world, &ended, &self.memory.contacts);
        }
        match std::mem::replace(&mut state.phase, PilotCyclePhase::Decided) {
            PilotCyclePhase::Grouping(conversation) => {
                self.keep_ended(conversation);
                self.on_group(ended.outcome, tick);
            }
            PilotCyclePhase::Deciding(conversation) => {
                self.keep_ended(conversation);
                match ended.outcome {
                    Some(ConversationOutcome::Intents(intents))
                        if DecisionStrategy::is_reactive(&self.world) =>
                    {
                        self.on_intents(&intents)
                    }
                    Some(ConversationOutcome::Intents(intents)) => self.decide_for_all(&intents),
                    Some(ConversationOutcome::Optimization(conclusion)) => {
                        self.on_optimization(Some(conclusion))
                    }
                    _ => self.on_optimization(None),
                }
            }
            PilotCyclePhase::Shielding(conversation, allowed) => {
                self.keep_ended(conversation);
                self.on_shield_exchange_end(ended.outcome, &allowed);
            }
            PilotCyclePhase::Decided | PilotCyclePhase::Over => {}
        }
    }

    /// Stores the outcome of the shield's exchange, in which it has proposed the candidates that were `allowed`.
    fn on_shield_exchange_end(&mut self, outcome: Option<ConversationOutcome>, allowed: &[usize]) {
        let Some(state) = &mut self.state else { return };
        self.memory.contacts = match outcome {
            Some(ConversationOutcome::Exchange(ShieldExchangeResult {
                decision,
                common,
                held_back,
                contacts,
            })) => {
                if held_back {
                    let event = Event::new(state.percept.cycle, EventKind::HeldBack, self.id);
                    state.control.events.push(event);
                }
                state.control.events.extend(search_limit(&decision, self.id, state.percept.cycle));
                let candidate = decision.candidate.map(|k| allowed[k]);
                let decision = ShieldDecision { candidate, ..decision };
                state.control.maneuver = match common {
                    Some(plan) => Maneuver::from_common_plan(plan),
                    None => Maneuver::from_decision(decision, &state.candidates),
                };
                contacts
            }
            // Without an agreement it no longer knows where any other airplane is.
            _ => TrafficPicture::new(),
        };
        self.finish_cycle();
    }

    /// Stores the outcome of an optimization; none if time was up before there was any.
    fn on_optimization(&mut self, result: Option<OptimizationResult>) {
        let Some(state) = &mut self.state else { return };
        let (decided, beacons) =
            result.map_or_else(Default::default, |result| (result.decided, result.beacons));
        state.control.optimized = Some(OptimizationStatus::from_choice(decided.as_ref()));
        if self.world.network.is_some() {
            for (beacon, &id) in beacons.into_iter().zip(&*state.members) {
                if let Some(beacon) = beacon {
                    record_beacon(&mut self.memory.contacts, id, beacon, state.percept.cycle);
                }
            }
        }
        let considered =
            candidates_from_choice(&self.world, state.percept.own.as_known_aircraft(), decided);
        self.set_candidates(considered);
    }

    /// Optimizes for the whole group by the messages of all, as every member does, and keeps the own part of the decision.
    fn decide_for_all(&mut self, intents: &[Option<Intent>]) {
        let Some(state) = &self.state else { return };
        let world = &*self.world;
        let now = state.percept.cycle;
        let own = ownship(world, &state.percept, &state.unheard, &self.memory.contacts);
        let mut options = Vec::new();
        for (place, (one, intent)) in state.percept.group.iter().zip(intents).enumerate() {
            let Some(intent) = intent else {
                options.push(own.presumed_predictions(place));
                continue;
            };
            let known = one.with_intent(intent);
            let predictions = world.action_predictions(known, &own.common.non_cooperative, now);
            options.push(predictions.with_deviation_weight(own.common.deviation_weights[place]));
            if world.network.is_some() && one.id != self.id {
                record_beacon(&mut self.memory.contacts, one.id, beacon(world, known), now);
            }
        }
        let mut decided = decide_by_predictions(world, &own.common.ids, &options, now);
        let beacons = Vec::new();
        let decided = Some(decided.swap_remove(own.me));
        self.on_optimization(Some(OptimizationResult { decided, beacons }));
    }

    /// Finds the headings of all from their messages; one without a message is assumed to fly straight on.
    fn on_intents(&mut self, intents: &[Option<Intent>]) {
        let Some(state) = &self.state else { return };
        let mut group = Vec::new();
        let mut memory = Vec::new();
        let mut me = 0;
        let unheard = state.unheard.iter().map(|one| unheard_as_non_cooperative(&self.world, one));
        let mut non_cooperative: Vec<_> =
            state.percept.non_cooperative.iter().cloned().chain(unheard).collect();
        for (one, intent) in state.percept.group.iter().zip(intents) {
            let Some(intent) = intent else {
                non_cooperative.push(unheard_as_non_cooperative(&self.world, one));
                continue;
            };
            if one.id == self.id {
                me = group.len();
            }
            group.push(one.with_intent(intent));
            let resolving = intent.resolving.clone();
            // What others have wished changes nothing: all see what of it is in force.
            let command = if one.id == self.id { self.memory.command } else { MethodCommand::NONE };
            memory.push(ReactiveMemory { resolving, command });
        }
        let now = state.percept.cycle;
        let mut all =
            candidates_by_velocity(&self.world, &group, &non_cooperative, &mut memory, now);
        if self.world.has_resolution_memory() {
            self.memory.resolving = memory.swap_remove(me).resolving;
        }
        self.set_candidates(all.swap_remove(me));
    }
}
