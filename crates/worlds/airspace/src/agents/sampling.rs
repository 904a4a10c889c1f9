//! The paper's Algorithm 1: an agent per airplane that samples, predicts, and shares both.

use super::optimizer::{Optimizer, OptimizerStep};
use super::ownship::Ownship;
use super::participant::InvalidMessage;
use super::traffic_state::StateBeacon;
use super::{ActionChoice, MessageLimits};
use crate::flight::{Levels, Prediction};
use crate::objective::{ActionPredictions, own_costs};
use serde::{Deserialize, Serialize};
use sidestep_collectives::Player;
use std::collections::BTreeMap;

/// The messages between agents.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum SamplingMessage {
    /// Lines 6 to 9: the predicted ways of the round's samples, and how far the sender's
    /// probabilities have moved in the round before.
    Predictions {
        /// Number of the round, from 0.
        round: u32,
        /// Largest change of the probabilities.
        change: f64,
        /// Beacon of the sender.
        beacon: StateBeacon,
        /// The ways, by sample.
        ways: Vec<Prediction>,
    },
    /// Line 17: the sender's part of the cost of each joint sample (eq. 11).
    Costs {
        /// Number of the round, from 0.
        round: u32,
        /// The costs, by sample.
        costs: Vec<f64>,
    },
}

/// A member of the group, as an agent knows it.
#[derive(Debug, Default)]
struct SamplingMember {
    beacon: Option<StateBeacon>,
    /// The ways of its samples, by round.
    ways: BTreeMap<u32, Vec<Prediction>>,
    /// Its changes of probabilities in the round before, by round.
    changes: BTreeMap<u32, f64>,
    /// Its part of the costs, by round.
    costs: BTreeMap<u32, Vec<f64>>,
    /// Predictions for it, once its messages have stopped.
    presumed: Option<ActionPredictions>,
}

impl SamplingMember {
    fn is_gone(&self) -> bool {
        self.presumed.is_some()
    }

    fn prediction(&self, round: u32, k: usize) -> Option<&Prediction> {
        let presumed = || self.presumed.as_ref().and_then(|options| options.predictions.first());
        self.ways.get(&round).and_then(|ways| ways.get(k)).or_else(presumed)
    }

    fn levels(&self) -> Option<Levels> {
        let presumed = || self.presumed.as_ref().map(|options| options.levels);
        self.beacon.as_ref().map(|beacon| beacon.levels).or_else(presumed)
    }

    /// Drops old rounds. The ways of the round before are kept, because they may be the last ones
    /// heard.
    fn forget_before(&mut self, round: u32) {
        self.ways.retain(|r, _| *r + 1 >= round);
        self.changes.retain(|r, _| *r >= round);
        self.costs.retain(|r, _| *r >= round);
    }
}

/// One agent.
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
            own_costs: own_costs(&own.briefing.objective, &own.options),
            player: Player::new(own.options.predictions.len()),
            members: own.briefing.ids.iter().map(|_| SamplingMember::default()).collect(),
            own,
            block,
            ageing,
            round: 0,
            calm: 0,
            change: f64::INFINITY,
            samples: Vec::new(),
        }
    }

    fn sample_count(&self) -> u64 {
        u64::from(self.round) * self.block as u64
    }

    fn predictions(&mut self) -> SamplingMessage {
        self.samples = self.own.samples(&self.player, self.sample_count(), self.block);
        let ways = self.samples.iter().map(|&x| self.own.options.predictions[x].clone());
        SamplingMessage::Predictions {
            round: self.round,
            change: self.change,
            beacon: self.own.beacon.clone(),
            ways: ways.collect(),
        }
    }

    fn others(&self) -> impl Iterator<Item = (usize, &SamplingMember)> {
        self.members.iter().enumerate().filter(|(j, _)| *j != self.own.me)
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
            let most = heard.fold(self.change, f64::max);
            self.calm = stop.count_calm_rounds(self.calm, most);
        }
        self.calm >= stop.calm_rounds || self.round >= stop.max_rounds
    }

    /// Computes its part of the costs (lines 10 to 15).
    fn cost(&mut self) -> SamplingMessage {
        let costs: Vec<f64> = (0..self.block).map(|k| self.cost_of(k)).collect();
        self.members[self.own.me].costs.insert(self.round, costs.clone());
        SamplingMessage::Costs { round: self.round, costs }
    }

    /// Returns its part of the cost of joint sample `k`.
    fn cost_of(&self, k: usize) -> f64 {
        let objective = &self.own.briefing.objective;
        let Ownship { options, .. } = &self.own;
        let x = self.samples[k];
        let way = &options.predictions[x];
        let on_level = |(_, member): &(usize, &SamplingMember)| {
            let theirs = member.levels();
            theirs.is_none_or(|levels| levels.overlaps(&options.levels, objective.vertical_m))
        };
        self.others().filter(on_level).fold(self.own_costs[x], |sum, (_, member)| {
            let Some(theirs) = member.prediction(self.round, k) else { return sum };
            let wanted_m = member.presumed.as_ref().map_or(0.0, |options| options.separation_m);
            let r = options.separation_m.max(wanted_m);
            sum + objective.collision(way, theirs, [r, r])[0]
        })
    }

    /// Learns (lines 18 to 24). Costs are summed in the order of the airplanes, because then all
    /// agents compute the same bits.
    fn learn(&mut self) {
        let mut total = vec![0.0; self.block];
        for costs in self.members.iter().filter_map(|m| m.costs.get(&self.round)) {
            total.iter_mut().zip(costs).for_each(|(sum, cost)| *sum += cost);
        }
        self.player.learn(&self.samples, &total, self.ageing);
        let settings = self.own.settings();
        self.change = self.player.update(settings.update, settings.cooling);
        self.round += 1;
        let round = self.round;
        self.members.iter_mut().for_each(|m| m.forget_before(round));
    }
}

impl Optimizer for SamplingAgent {
    type Message = SamplingMessage;

    fn first_message(&mut self) -> SamplingMessage {
        self.predictions()
    }

    fn round(&self) -> u32 {
        self.round
    }

    fn check_message(&self, from: usize, message: &SamplingMessage) -> Result<(), InvalidMessage> {
        let briefing = &*self.own.briefing;
        match message {
            SamplingMessage::Predictions { round, change, beacon, ways } => {
                briefing.check_round(*round, *change)?;
                briefing.check_beacon(from, beacon)?;
                briefing.check_predictions(ways, self.block)
            }
            SamplingMessage::Costs { round, costs } => {
                briefing.check_round(*round, 0.0)?;
                InvalidMessage::Length.unless(costs.len() == self.block)?;
                // Large ones are taken, unless their sum would not be a number.
                InvalidMessage::Number.unless(costs.iter().all(|cost| (0.0..1e60).contains(cost)))
            }
        }
    }

    fn limits(&self) -> MessageLimits {
        let bytes = self.own.briefing.max_message_bytes(self.block) + 8 * self.block;
        // The ways of its samples and their costs in each round.
        let rounds = self.own.settings().stop.max_rounds;
        MessageLimits { bytes, messages: rounds.saturating_add(1).saturating_mul(2) }
    }

    fn receive(&mut self, from: usize, message: SamplingMessage) {
        let member = &mut self.members[from];
        match message {
            SamplingMessage::Predictions { round, change, beacon, ways } => {
                member.beacon = Some(beacon);
                member.changes.insert(round, change);
                member.ways.insert(round, ways);
            }
            SamplingMessage::Costs { round, costs } => {
                member.costs.insert(round, costs);
            }
        }
    }

    fn missing_members(&self) -> Vec<usize> {
        let missing = |member: &SamplingMember| match self.has_sent_costs() {
            false => !member.ways.contains_key(&self.round),
            true => !member.costs.contains_key(&self.round),
        };
        self.others().filter(|(_, m)| !m.is_gone() && missing(m)).map(|(j, _)| j).collect()
    }

    fn step(&mut self) -> OptimizerStep<SamplingMessage> {
        if self.has_sent_costs() {
            self.learn();
            OptimizerStep::Send(self.predictions())
        } else if self.has_converged() {
            OptimizerStep::Conclude
        } else {
            OptimizerStep::Send(self.cost())
        }
    }

    /// Leaves out the other's part of the costs from now on. A settled agent keeps its last
    /// message; a silent one is presumed where it was.
    fn on_peer_gone(&mut self, other: usize, is_settled: bool) {
        let member = &mut self.members[other];
        let last = member.ways.values().next_back().and_then(|ways| ways.first());
        member.presumed = Some(match (&member.beacon, last) {
            (Some(beacon), Some(way)) if is_settled => {
                ActionPredictions::new(vec![way.clone()], beacon.separation_m, beacon.levels)
            }
            (Some(beacon), _) => self.own.predictions_from_beacon(beacon),
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
