//! Agents that first send each other all their predictions, and then only the results of using
//! them: numbers of samples, or distributions.

mod check;
mod search;

use super::optimizer::{Optimizer, OptimizerStep};
use super::ownship::Ownship;
use super::participant::InvalidMessage;
use super::traffic_state::StateBeacon;
use super::{ActionChoice, MessageLimits, RouteProgress};
use crate::flight::{KnownAircraft, Point, Prediction};
use crate::objective::{ActionPredictions, add_pair_costs, own_costs};
use search::{LocalSearchAgent, SearchMember, SearchPeer, SearchStep};
pub use search::{SearchBound, SearchMessage, SearchStart};
use serde::{Deserialize, Serialize};
use sidestep_collectives::{
    Estimator, Game, LocalSearch, PairwiseGame, Player, UpdateOrder, start_strategies,
};
use std::collections::BTreeMap;

/// Messages between agents.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum PredictionSharingMessage {
    /// The predictions of all the sender's actions.
    Predictions {
        /// Beacon of the sender.
        beacon: StateBeacon,
        /// The predictions, by action.
        predictions: Vec<Prediction>,
    },
    /// A model, from which the others compute the predictions themselves.
    Model {
        /// Beacon of the sender.
        beacon: StateBeacon,
        /// Number of way-points done with.
        next: u32,
        /// Way-points that it is to reach.
        mission: Vec<Point>,
        /// Id of the airplane, which must be the sender's.
        airplane: u32,
        /// Number of its orders that are carried out.
        orders: u32,
        /// Altitude in meters.
        altitude_m: f64,
    },
    /// The numbers of the round's samples, and how far the sender has moved in the round before.
    Samples {
        /// The round, from 0.
        round: u32,
        /// Largest move of the probabilities.
        change: f64,
        /// Numbers of the drawn actions, one for each sample.
        samples: Vec<u16>,
    },
    /// The sender's distribution after a round, and how far it has moved in it.
    Distribution {
        /// The round, from 1.
        round: u32,
        /// Largest move of the probabilities.
        change: f64,
        /// Probabilities of the actions.
        q: Vec<f64>,
    },
    /// What the local search after the rounds needs.
    Search(SearchMessage),
    /// The predictions of all the sender's actions, where these change levels or speeds.
    ChangePredictions {
        /// Beacon of the sender.
        beacon: StateBeacon,
        /// Number of its orders that are carried out.
        orders: u32,
        /// The predictions, by action.
        predictions: Vec<Prediction>,
    },
}

/// A member of the group, as an agent knows it.
#[derive(Debug, Default)]
struct PredictionSharingMember {
    beacon: Option<StateBeacon>,
    options: Option<ActionPredictions>,
    /// Distributions after each round; round 0 is the start.
    q: BTreeMap<u32, Vec<f64>>,
    samples: BTreeMap<u32, Vec<usize>>,
    changes: BTreeMap<u32, f64>,
    search: SearchMember,
    /// Whether nothing more is heard from it: its last message holds for all later rounds.
    gone: bool,
    /// Whether its options are presumed, because it was never heard.
    is_presumed: bool,
}

impl PredictionSharingMember {
    /// Returns its message that holds in a round, if that is known.
    fn message_in_round<'a, T>(
        &self,
        of_rounds: &'a BTreeMap<u32, T>,
        round: u32,
    ) -> Option<&'a T> {
        match of_rounds.get(&round) {
            None if self.gone => of_rounds.range(..round).next_back().map(|(_, value)| value),
            known => known,
        }
    }

    fn action_distribution(&self, round: u32) -> Option<&Vec<f64>> {
        self.message_in_round(&self.q, round)
    }

    fn samples(&self, round: u32) -> Option<&Vec<usize>> {
        self.message_in_round(&self.samples, round)
    }

    /// Returns its `k`-th sample of a round. A presumed member has nothing to choose from.
    fn sampled_action(&self, round: u32, k: usize) -> usize {
        self.samples(round).and_then(|samples| samples.get(k)).copied().unwrap_or(0)
    }

    /// Returns how far it has moved in a round.
    fn distribution_change(&self, round: u32) -> f64 {
        self.changes.get(&round).copied().unwrap_or(0.0)
    }

    fn forget_before(&mut self, round: u32) {
        if !self.gone {
            self.q.retain(|r, _| *r >= round);
            self.samples.retain(|r, _| *r >= round);
            self.changes.retain(|r, _| *r >= round);
        }
    }
}

/// An agent that keeps the options of all members, and so knows what any joint choice costs.
#[derive(Debug)]
pub struct PredictionSharingAgent {
    own: Ownship,
    by_model: bool,
    members: Vec<PredictionSharingMember>,
    game: Option<PairwiseGame>,
    player: Player,
    /// Number of rounds made.
    round: u32,
    calm: u32,
    /// The local search, once the rounds are over.
    search: Option<LocalSearchAgent>,
}

impl PredictionSharingAgent {
    /// Returns one that has not sent anything yet.
    pub(crate) fn new(own: Ownship, by_model: bool) -> Self {
        let mut members: Vec<PredictionSharingMember> =
            (0..own.common.ids.len()).map(|_| PredictionSharingMember::default()).collect();
        members[own.me].options = Some(own.options.clone());
        let player = Player::new(own.options.predictions.len());
        Self { own, by_model, members, game: None, player, round: 0, calm: 0, search: None }
    }

    fn model_message(&self) -> PredictionSharingMessage {
        let beacon = self.own.beacon.clone();
        if !self.by_model {
            let predictions = self.own.options.predictions.clone();
            if !self.own.options.has_changes() {
                return PredictionSharingMessage::Predictions { beacon, predictions };
            }
            let orders = self.own.known.orders;
            return PredictionSharingMessage::ChangePredictions { beacon, orders, predictions };
        }
        let KnownAircraft { slot, next, orders, altitude_m, .. } = self.own.known;
        let mission = self.own.mission.clone();
        PredictionSharingMessage::Model {
            beacon,
            next: next as u32,
            mission,
            airplane: slot,
            orders,
            altitude_m,
        }
    }

    /// Returns the number of starts of the local search.
    fn starts(&self) -> usize {
        // The choice after the rounds, and the action that is cheapest for each alone.
        2 + self.own.settings().random_starts as usize
    }

    fn has_exact_estimator(&self) -> bool {
        self.own.settings().estimator == Estimator::Exact
    }

    /// Sets up the game and the first distributions, once all options are known.
    fn start_game(&mut self) {
        let objective = &self.own.common.objective;
        let all: Vec<&ActionPredictions> =
            self.members.iter().filter_map(|m| m.options.as_ref()).collect();
        let mut game = PairwiseGame::new(all.iter().map(|o| own_costs(objective, o)).collect());
        for i in 0..all.len() {
            for j in i + 1..all.len() {
                // An exact player needs only the pairs that it is part of.
                if !self.has_exact_estimator() || i == self.own.me || j == self.own.me {
                    add_pair_costs(&mut game, objective, [i, j], [all[i], all[j]]);
                }
            }
        }
        for member in &mut self.members {
            let n = member.options.as_ref().map_or(1, |options| options.predictions.len());
            member.q.insert(0, vec![1.0 / n as f64; n]);
            if member.gone {
                member.samples.insert(0, Vec::new());
            }
        }
        self.game = Some(game);
    }

    /// Returns the agents that owe a message for the next step. With exact expectations round `r`
    /// leads to the distributions `q_r`, and a step is the agent's own update or that of all;
    /// samples are those of the round after `round` rounds.
    fn awaited_in_round(&self) -> Vec<usize> {
        let mut awaited = Vec::new();
        for (j, member) in self.members.iter().enumerate() {
            let is_missing = if let Some(search) = &self.search {
                !member.gone && !search.has_heard(&member.search)
            } else if !self.has_exact_estimator() {
                let has_drawn = self.members[self.own.me].samples.contains_key(&self.round);
                has_drawn && member.samples(self.round).is_none()
            } else if self.has_updated_distribution() {
                member.action_distribution(self.round + 1).is_none()
            } else {
                member.action_distribution(self.required_distribution_round(j)).is_none()
            };
            if is_missing {
                awaited.push(j);
            }
        }
        awaited
    }

    /// Returns the round of which an agent's distribution enters the own update after `round` rounds: in sequence,
    /// those before it have already moved.
    fn required_distribution_round(&self, j: usize) -> u32 {
        let is_sequence = self.own.settings().order == UpdateOrder::Sequence;
        if is_sequence && j < self.own.me { self.round + 1 } else { self.round }
    }

    /// Returns whether its own update of this round is made.
    fn has_updated_distribution(&self) -> bool {
        self.members[self.own.me].q.contains_key(&(self.round + 1))
    }

    fn exact_optimizer_step(&mut self) -> OptimizerStep<PredictionSharingMessage> {
        let round = self.round + 1;
        if !self.has_updated_distribution() {
            return OptimizerStep::Send(self.update_exact_distribution(round));
        }
        self.count_calm_rounds(round);
        self.round = round;
        for member in &mut self.members {
            member.forget_before(round);
        }
        let stop = self.own.settings().stop;
        let is_over = self.calm >= stop.calm_rounds || round >= stop.max_rounds;
        match self.own.settings().local_search {
            _ if !is_over => OptimizerStep::Done,
            LocalSearch::None => OptimizerStep::Conclude,
            // No scenario asks agents for branch and bound, because none knows all costs.
            LocalSearch::Pairs | LocalSearch::BranchAndBound => self.start_search(),
        }
    }

    /// Begins the local search with its own starts.
    fn start_search(&mut self) -> OptimizerStep<PredictionSharingMessage> {
        let Some(game) = &self.game else { return OptimizerStep::Conclude };
        let me = self.own.me;
        let config = self.own.settings();
        let chosen = self.player.choose(config.choice, self.own.uniform(0));
        let draws = config.start_draws(0).map(|k| self.own.uniform(k));
        let actions = start_strategies(game, me, chosen, draws);
        let (search, message) = LocalSearchAgent::new(game, me, &actions);
        self.search = Some(search);
        self.members[me].search.receive(message.clone());
        OptimizerStep::Send(PredictionSharingMessage::Search(message))
    }

    fn search_step(&mut self) -> OptimizerStep<PredictionSharingMessage> {
        let (Some(game), Some(search)) = (&self.game, &mut self.search) else {
            return OptimizerStep::Conclude;
        };
        let group = self.members.iter().map(|member| SearchPeer {
            said: &member.search,
            is_gone: member.gone,
            is_presumed: member.is_presumed,
        });
        let group: Vec<SearchPeer<'_>> = group.collect();
        let next = search.step(game, &group);
        let step = search.steps();
        for member in &mut self.members {
            member.search.forget_before(step);
        }
        match next {
            SearchStep::Over => OptimizerStep::Conclude,
            SearchStep::Send(message) => {
                self.members[self.own.me].search.receive(message.clone());
                OptimizerStep::Send(PredictionSharingMessage::Search(message))
            }
        }
    }

    fn update_exact_distribution(&mut self, round: u32) -> PredictionSharingMessage {
        let me = self.own.me;
        let settings = *self.own.settings();
        let mut q: Vec<Vec<f64>> = Vec::with_capacity(self.members.len());
        for (j, member) in self.members.iter().enumerate() {
            q.extend(member.action_distribution(self.required_distribution_round(j)).cloned());
        }
        if let Some(game) = &self.game {
            self.player.set_expected(|expected| game.expected_costs(me, &q, expected));
        }
        let change = self.player.update(settings.update, settings.cooling);
        let q = self.player.q.clone();
        self.members[me].q.insert(round, q.clone());
        self.members[me].changes.insert(round, change);
        PredictionSharingMessage::Distribution { round, change, q }
    }

    /// Counts the rounds up to this one in which no distribution moved.
    fn count_calm_rounds(&mut self, round: u32) {
        let max_change =
            self.members.iter().map(|m| m.distribution_change(round)).fold(0.0, f64::max);
        self.calm = self.own.settings().stop.count_calm_rounds(self.calm, max_change);
    }

    /// Draws samples, unless it has; else learns from the samples of all.
    fn sampled_optimizer_step(
        &mut self,
        block: usize,
        ageing: f64,
    ) -> OptimizerStep<PredictionSharingMessage> {
        let me = self.own.me;
        let round = self.round;
        if !self.members[me].samples.contains_key(&round) {
            return OptimizerStep::Send(self.draw_samples(block));
        }
        if round > 0 {
            self.count_calm_rounds(round);
            let stop = self.own.settings().stop;
            if self.calm >= stop.calm_rounds || round >= stop.max_rounds {
                return OptimizerStep::Conclude;
            }
        }
        let change = self.learn_from_samples(block, ageing);
        self.round += 1;
        self.members[me].changes.insert(self.round, change);
        for member in &mut self.members {
            member.forget_before(round);
        }
        OptimizerStep::Send(self.draw_samples(block))
    }

    fn draw_samples(&mut self, block: usize) -> PredictionSharingMessage {
        let me = self.own.me;
        let round = self.round;
        let samples = self.own.samples(&self.player, u64::from(round) * block as u64, block);
        // Before the first round nothing can have settled.
        let change = *self.members[me].changes.entry(round).or_insert(f64::INFINITY);
        self.members[me].samples.insert(round, samples.clone());
        PredictionSharingMessage::Samples {
            round,
            change,
            samples: samples.iter().map(|&x| x as u16).collect(),
        }
    }

    fn learn_from_samples(&mut self, block: usize, ageing: f64) -> f64 {
        let Some(game) = &self.game else { return 0.0 };
        let mut costs = Vec::with_capacity(block);
        let mut own = Vec::with_capacity(block);
        for k in 0..block {
            let joint: Vec<usize> =
                self.members.iter().map(|member| member.sampled_action(self.round, k)).collect();
            costs.push(game.cost(&joint));
            own.push(joint[self.own.me]);
        }
        self.player.learn(&own, &costs, ageing);
        let settings = *self.own.settings();
        self.player.update(settings.update, settings.cooling)
    }
}

impl Optimizer for PredictionSharingAgent {
    type Message = PredictionSharingMessage;

    fn ownship(&self) -> &Ownship {
        &self.own
    }

    fn round(&self) -> u32 {
        self.round
    }

    fn first_message(&mut self) -> PredictionSharingMessage {
        self.model_message()
    }

    fn check_message(
        &self,
        from: usize,
        message: &PredictionSharingMessage,
    ) -> Result<(), InvalidMessage> {
        self.validate_message(from, message)
    }

    fn message_limits(&self) -> MessageLimits {
        let common = &*self.own.common;
        let actions = common.max_actions();
        let rounds = self.own.settings().stop.max_rounds;
        let block = match self.own.settings().estimator {
            Estimator::Exact => 0,
            Estimator::Sampled { block, .. } => block,
        };
        let predictions = if self.by_model { 0 } else { actions };
        // A probability takes 8 bytes, and the number of an action at most 3.
        let bytes = common.max_message_bytes(predictions) + 8 * actions + 3 * block;
        let (search_messages, search_bytes) =
            SearchMessage::limits(self.starts(), actions, self.members.len());
        // Its predictions or its model, a message for each round, and those of the local search.
        let messages = rounds.saturating_add(2).saturating_add(search_messages);
        MessageLimits { bytes: bytes.max(512 + search_bytes), messages }
    }

    fn receive(&mut self, from: usize, message: PredictionSharingMessage) {
        let member = &mut self.members[from];
        match message {
            PredictionSharingMessage::Predictions { beacon, predictions } => {
                let options = self.own.common.heard_options(from, &beacon, predictions, None);
                member.options.get_or_insert(options);
                member.beacon = Some(beacon);
            }
            PredictionSharingMessage::ChangePredictions { beacon, orders, predictions } => {
                let common = &self.own.common;
                let changes = common.action_changes(from, orders, &beacon);
                let options = common.heard_options(from, &beacon, predictions, changes);
                member.options.get_or_insert(options);
                member.beacon = Some(beacon);
            }
            PredictionSharingMessage::Model { beacon, next, mission, orders, .. } => {
                let progress = RouteProgress { mission: &mission, next: next as usize, orders };
                let options = self.own.common.action_predictions(from, &beacon, progress);
                member.options.get_or_insert(options);
                member.beacon = Some(beacon);
            }
            // Messages of one that was given up no longer matter.
            _ if member.gone => {}
            PredictionSharingMessage::Samples { round, change, samples } => {
                let samples = samples.iter().map(|&x| usize::from(x)).collect();
                member.samples.insert(round, samples);
                member.changes.insert(round, change);
            }
            PredictionSharingMessage::Distribution { round, change, q } => {
                member.q.insert(round, q);
                member.changes.insert(round, change);
            }
            PredictionSharingMessage::Search(message) => member.search.receive(message),
        }
    }

    fn missing_members(&self) -> Vec<usize> {
        if self.game.is_some() {
            return self.awaited_in_round();
        }
        (0..self.members.len()).filter(|&j| self.members[j].options.is_none()).collect()
    }

    fn step(&mut self) -> OptimizerStep<PredictionSharingMessage> {
        if self.game.is_none() {
            self.start_game();
            return OptimizerStep::Done;
        }
        if self.search.is_some() {
            return self.search_step();
        }
        match self.own.settings().estimator {
            Estimator::Exact => self.exact_optimizer_step(),
            Estimator::Sampled { block, ageing } => self.sampled_optimizer_step(block, ageing),
        }
    }

    fn on_peer_gone(&mut self, other: usize, _: bool) {
        let member = &mut self.members[other];
        member.gone = true;
        if member.options.is_none() {
            // Samples are numbers of options, which are unknown here, so they mean nothing.
            *member = PredictionSharingMember {
                gone: true,
                is_presumed: true,
                beacon: member.beacon.take(),
                ..PredictionSharingMember::default()
            };
            member.options = Some(self.own.presumed_predictions(other));
        }
        // One that was heard, but has not sent any samples yet.
        if self.game.is_some() && member.samples.is_empty() {
            member.samples.insert(0, Vec::new());
        }
    }

    fn action_choice(&self) -> Option<ActionChoice> {
        let mut choice = self.own.action_choice(&self.player, self.round, self.calm)?;
        if let Some(search) = &self.search {
            choice.reached = search.reached();
            if let Some((chosen, costs)) = search.end() {
                choice.chosen = chosen;
                choice.expected = costs.to_vec();
            }
        }
        Some(choice)
    }

    fn take_beacons(&mut self) -> Vec<Option<StateBeacon>> {
        self.members.iter_mut().map(|m| m.beacon.take()).collect()
    }
}
