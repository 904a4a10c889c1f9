//! The paper's Algorithm 1: an agent per airplane that samples, predicts, and shares both.

use super::optimizer::{Optimizer, OptimizerStep};
use super::ownship::Ownship;
use super::participant::InvalidMessage;
use super::traffic_state::StateBeacon;
use super::{ActionChoice, MessageLimits};
use crate::flight::{FlightLevelRange, PairPlane, Prediction};
use crate::objective::{ActionChanges, ActionPredictions, own_costs};
use serde::{Deserialize, Serialize};
use sidestep_collectives::Player;
use std::collections::BTreeMap;

/// The messages between agents.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum SamplingMessage {
    /// Lines 6 to 9: the predictions of the round's samples, and how far the sender's
    /// probabilities have moved in the round before.
    Predictions(DrawnPredictions),
    /// Line 17: the sender's part of the cost of each joint sample (eq. 11).
    Costs {
        /// Number of the round, from 0.
        round: u32,
        /// The costs, by sample.
        costs: Vec<f64>,
    },
    /// Predictions, where actions change levels or speeds.
    ChangePredictions {
        /// The same as of all others.
        drawn: DrawnPredictions,
        /// Number of the sender's orders that are carried out.
        orders: u32,
        /// The drawn actions, by sample.
        actions: Vec<u16>,
    },
}

/// The predictions of the samples of a round.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct DrawnPredictions {
    /// Number of the round, from 0.
    pub round: u32,
    /// Largest change of the probabilities.
    pub change: f64,
    /// Beacon of the sender.
    pub beacon: StateBeacon,
    /// The predictions, by sample.
    pub predictions: Vec<Prediction>,
}

/// A member of the group, as an agent knows it.
#[derive(Debug, Default)]
struct SamplingMember {
    beacon: Option<StateBeacon>,
    /// The predictions of its samples, by round.
    predictions: BTreeMap<u32, Vec<Prediction>>,
    /// The altitudes and the speeds that its actions lead to, if they change them.
    action_changes: Option<ActionChanges>,
    /// Its drawn actions, by round, if they change levels or speeds.
    actions: BTreeMap<u32, Vec<u16>>,
    /// Its changes of probabilities in the round before, by round.
    changes: BTreeMap<u32, f64>,
    /// Its part of the costs, by round.
    costs: BTreeMap<u32, Vec<f64>>,
    /// Predictions for it, once its messages have stopped.
    presumed: Option<ActionPredictions>,
}

impl SamplingMember {
    fn receive(&mut self, drawn: DrawnPredictions) {
        let DrawnPredictions { round, change, beacon, predictions } = drawn;
        self.beacon = Some(beacon);
        self.changes.insert(round, change);
        self.predictions.insert(round, predictions);
    }

    fn is_gone(&self) -> bool {
        self.presumed.is_some()
    }

    fn prediction(&self, round: u32, k: usize) -> Option<&Prediction> {
        let heard = self.predictions.get(&round).and_then(|predictions| predictions.get(k));
        heard.or_else(|| self.presumed.as_ref()?.predictions.first())
    }

    fn levels(&self) -> Option<FlightLevelRange> {
        let heard = self.beacon.as_ref().map(|beacon| beacon.levels);
        heard.or_else(|| Some(self.presumed.as_ref()?.levels))
    }

    /// Returns the levels of its sample in one step of a round.
    fn step_levels(&self, round: u32, k: usize, step: usize) -> Option<FlightLevelRange> {
        let actions = self.actions.get(&round).zip(self.action_changes.as_ref());
        match actions {
            Some((actions, changes)) => Some(changes.step_levels(actions[k].into(), step)),
            None => self.levels(),
        }
    }

    /// Drops old rounds. The predictions of the round before are kept, because they may be the last ones
    /// heard.
    fn forget_before(&mut self, round: u32) {
        self.predictions.retain(|r, _| *r + 1 >= round);
        self.changes.retain(|r, _| *r >= round);
        self.actions.retain(|r, _| *r >= round);
        self.costs.retain(|r, _| *r >= round);
    }
}

/// An agent that knows of others only what they send in each round.
#[derive(Debug)]
pub struct SamplingAgent {
    own: Ownship,
    own_costs: Vec<f64>,
    player: Player,
    block: usize,
    ageing: f64,
    round: u32,
    calm: u32,
    change: f64,
    samples: Vec<usize>,
    members: Vec<SamplingMember>,
}

impl SamplingAgent {
    /// Returns one that has not sent anything yet.
    pub(crate) fn new(own: Ownship, block: usize, ageing: f64) -> Self {
        Self {
            own_costs: own_costs(&own.common.objective, &own.options),
            player: Player::new(own.options.predictions.len()),
            members: own.common.ids.iter().map(|_| SamplingMember::default()).collect(),
            own,
            block,
            ageing,
            round: 0,
            calm: 0,
            change: f64::INFINITY,
            samples: Vec::new(),
        }
    }

    fn total_sample_count(&self) -> u64 {
        u64::from(self.round) * self.block as u64
    }

    fn build_predictions_message(&mut self) -> SamplingMessage {
        self.samples = self.own.samples(&self.player, self.total_sample_count(), self.block);
        let predictions = self.samples.iter().map(|&x| self.own.options.predictions[x].clone());
        let drawn = DrawnPredictions {
            round: self.round,
            change: self.change,
            beacon: self.own.beacon.clone(),
            predictions: predictions.collect(),
        };
        if !self.own.options.has_changes() {
            return SamplingMessage::Predictions(drawn);
        }
        let actions = self.samples.iter().map(|&x| x as u16).collect();
        SamplingMessage::ChangePredictions { drawn, orders: self.own.known.orders, actions }
    }

    fn others(&self) -> impl Iterator<Item = (usize, &SamplingMember)> {
        self.members.iter().enumerate().filter(|(j, _)| *j != self.own.me)
    }

    /// Checks the predictions that the agent at a place has drawn.
    fn check_drawn(&self, from: usize, drawn: &DrawnPredictions) -> Result<(), InvalidMessage> {
        let common = &*self.own.common;
        common.check_round(drawn.round, drawn.change)?;
        common.check_beacon(from, &drawn.beacon)?;
        common.check_predictions(&drawn.predictions, self.block)
    }

    /// Returns whether its own costs of this round are sent.
    fn has_sent_costs(&self) -> bool {
        self.members[self.own.me].costs.contains_key(&self.round)
    }

    /// Returns whether the distributions have settled (line 25). All agents know how far each has
    /// moved, so all stop in the same round.
    fn has_converged(&mut self) -> bool {
        let stop = self.own.settings().stop;
        if self.round > 0 {
            let heard = self.others().filter_map(|(_, m)| m.changes.get(&self.round).copied());
            let max_change = heard.fold(self.change, f64::max);
            self.calm = stop.count_calm_rounds(self.calm, max_change);
        }
        self.calm >= stop.calm_rounds || self.round >= stop.max_rounds
    }

    /// Computes its part of the costs (lines 10 to 15).
    fn build_costs_message(&mut self) -> SamplingMessage {
        let costs: Vec<f64> = (0..self.block).map(|k| self.sample_cost(k)).collect();
        self.members[self.own.me].costs.insert(self.round, costs.clone());
        SamplingMessage::Costs { round: self.round, costs }
    }

    /// Returns its part of the cost of joint sample `k`.
    fn sample_cost(&self, k: usize) -> f64 {
        let objective = &self.own.common.objective;
        let options = &self.own.options;
        let x = self.samples[k];
        let prediction = &options.predictions[x];
        let has_changes = self.own.common.has_changes();
        let mut cost = self.own_costs[x];
        for (place, member) in self.others() {
            let is_on_level = member
                .levels()
                .is_none_or(|levels| levels.overlaps(&options.levels, objective.vertical_m));
            if is_on_level && let Some(other) = member.prediction(self.round, k) {
                let presumed = member.presumed.as_ref();
                let other_separation_m = presumed.map_or(0.0, |options| options.separation_m);
                let r = options.separation_m.max(other_separation_m);
                let plane = PairPlane::between(options.frame, self.own.common.frame(place));
                let meets = |step: usize| {
                    !has_changes
                        || member.step_levels(self.round, k, step).is_none_or(|levels| {
                            options.step_levels(x, step).overlaps(&levels, objective.vertical_m)
                        })
                };
                let pair = [prediction, other];
                cost += objective.collision_costs_where(&plane, pair, [r, r], meets)[0];
            }
        }
        cost
    }

    /// Learns (lines 18 to 24). Costs are summed in the order of the airplanes, because then all
    /// agents compute the same bits.
    fn learn_from_samples(&mut self) {
        let mut total = vec![0.0; self.block];
        for costs in self.members.iter().filter_map(|m| m.costs.get(&self.round)) {
            for (sum, cost) in total.iter_mut().zip(costs) {
                *sum += cost;
            }
        }
        self.player.learn(&self.samples, &total, self.ageing);
        let settings = self.own.settings();
        self.change = self.player.update(settings.update, settings.cooling);
        self.round += 1;
        for member in &mut self.members {
            member.forget_before(self.round);
        }
    }
}

impl Optimizer for SamplingAgent {
    type Message = SamplingMessage;

    fn first_message(&mut self) -> SamplingMessage {
        self.build_predictions_message()
    }

    fn round(&self) -> u32 {
        self.round
    }

    fn check_message(&self, from: usize, message: &SamplingMessage) -> Result<(), InvalidMessage> {
        let common = &*self.own.common;
        match message {
            SamplingMessage::Predictions(drawn) => {
                InvalidMessage::Kind.ensure(common.filed[from].changes.is_none())?;
                self.check_drawn(from, drawn)
            }
            SamplingMessage::ChangePredictions { drawn, orders, actions } => {
                let filed = &common.filed[from];
                InvalidMessage::Kind.ensure(filed.changes.is_some())?;
                common.check_orders(from, *orders)?;
                InvalidMessage::Length.ensure(actions.len() == self.block)?;
                let is_action = |x: &u16| usize::from(*x) < filed.actions.len();
                InvalidMessage::Number.ensure(actions.iter().all(is_action))?;
                self.check_drawn(from, drawn)
            }
            SamplingMessage::Costs { round, costs } => {
                common.check_round(*round, 0.0)?;
                InvalidMessage::Length.ensure(costs.len() == self.block)?;
                // Large ones are accepted, unless their sum would not be a number.
                InvalidMessage::Number.ensure(costs.iter().all(|cost| (0.0..1e60).contains(cost)))
            }
        }
    }

    fn message_limits(&self) -> MessageLimits {
        // The number of an action takes at most 3.
        let bytes = self.own.common.max_message_bytes(self.block) + (8 + 3) * self.block;
        // The predictions of its samples and their costs in each round.
        let rounds = self.own.settings().stop.max_rounds;
        MessageLimits { bytes, messages: rounds.saturating_add(1).saturating_mul(2) }
    }

    fn receive(&mut self, from: usize, message: SamplingMessage) {
        let member = &mut self.members[from];
        match message {
            SamplingMessage::Predictions(drawn) => member.receive(drawn),
            SamplingMessage::ChangePredictions { drawn, orders, actions } => {
                let common = &self.own.common;
                member.action_changes = common.action_changes(from, orders, &drawn.beacon);
                member.actions.insert(drawn.round, actions);
                member.receive(drawn);
            }
            SamplingMessage::Costs { round, costs } => {
                member.costs.insert(round, costs);
            }
        }
    }

    fn missing_members(&self) -> Vec<usize> {
        let has_sent_costs = self.has_sent_costs();
        self.others()
            .filter(|(_, member)| {
                let has_come = if has_sent_costs {
                    member.costs.contains_key(&self.round)
                } else {
                    member.predictions.contains_key(&self.round)
                };
                !member.is_gone() && !has_come
            })
            .map(|(place, _)| place)
            .collect()
    }

    fn step(&mut self) -> OptimizerStep<SamplingMessage> {
        if self.has_sent_costs() {
            self.learn_from_samples();
            OptimizerStep::Send(self.build_predictions_message())
        } else if self.has_converged() {
            OptimizerStep::Conclude
        } else {
            OptimizerStep::Send(self.build_costs_message())
        }
    }

    /// Leaves out the other's part of the costs from now on. A settled agent keeps its last
    /// message; a silent one is presumed where it was.
    fn on_peer_gone(&mut self, other: usize, is_settled: bool) {
        let member = &mut self.members[other];
        let last =
            member.predictions.values().next_back().and_then(|predictions| predictions.first());
        member.presumed = Some(match (&member.beacon, last) {
            (Some(beacon), Some(prediction)) if is_settled => {
                let StateBeacon { separation_m, levels, .. } = *beacon;
                let frame = self.own.common.frame(other);
                ActionPredictions::new(vec![prediction.clone()], frame, separation_m, levels)
            }
            (Some(beacon), _) => self.own.predictions_from_beacon(other, beacon),
            _ => self.own.presumed_predictions(other),
        });
    }

    fn ownship(&self) -> &Ownship {
        &self.own
    }

    fn take_beacons(&mut self) -> Vec<Option<StateBeacon>> {
        self.members.iter_mut().map(|m| m.beacon.take()).collect()
    }

    fn action_choice(&self) -> Option<ActionChoice> {
        self.own.action_choice(&self.player, self.round, self.calm)
    }
}
