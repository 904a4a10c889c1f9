//! The paper's Algorithm 1: an agent per airplane that samples, predicts, and shares both.

use super::super::airplane::Prediction;
use super::super::objective::own_costs;
use super::{Decided, Own, network};
use crate::collectives::Player;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What agents tell each other.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) enum Message {
    /// Lines 6 to 9: the predicted ways of the round's samples, and how far the sender's
    /// probabilities have moved in the round before.
    Predictions { round: u32, change: f64, altitude_m: f64, ways: Vec<Prediction> },
    /// Line 17: the sender's part of the cost of each joint sample (eq. 11).
    Costs { round: u32, costs: Vec<f64> },
}

/// One agent.
#[derive(Debug)]
pub(super) struct Agent<'a> {
    own: Own<'a>,
    own_costs: Vec<f64>,
    player: Player,
    block: usize,
    ageing: f64,
    round: u32,
    calm: u32,
    change: f64,
    samples: Vec<usize>,
    /// Whether this round's own costs are out.
    costed: bool,
    /// Ways heard of, by round and sender.
    heard: BTreeMap<(u32, usize), Vec<Prediction>>,
    changes: BTreeMap<(u32, usize), f64>,
    costs: BTreeMap<(u32, usize), Vec<f64>>,
    altitudes_m: BTreeMap<usize, f64>,
    decided: Option<Decided>,
}

impl<'a> Agent<'a> {
    pub(super) fn new(own: Own<'a>, block: usize, ageing: f64) -> Self {
        Self {
            own_costs: own_costs(&own.world.objective, &own.options),
            player: Player::new(own.options.predictions.len()),
            own,
            block,
            ageing,
            round: 0,
            calm: 0,
            change: f64::INFINITY,
            samples: Vec::new(),
            costed: false,
            heard: BTreeMap::new(),
            changes: BTreeMap::new(),
            costs: BTreeMap::new(),
            altitudes_m: BTreeMap::new(),
            decided: None,
        }
    }

    fn drawn(&self) -> u64 {
        u64::from(self.round) * self.block as u64
    }

    fn predictions(&mut self) -> Message {
        self.samples = self.own.samples(&self.player, self.drawn(), self.block);
        self.costed = false;
        let ways = self.samples.iter().map(|&x| self.own.options.predictions[x].clone());
        Message::Predictions {
            round: self.round,
            change: self.change,
            altitude_m: self.own.options.altitude_m,
            ways: ways.collect(),
        }
    }

    fn others(&self) -> impl Iterator<Item = usize> + use<> {
        let me = self.own.me;
        (0..self.own.group).filter(move |&j| j != me)
    }

    /// Goes on as far as what has been heard allows.
    fn go_on(&mut self) -> Vec<Message> {
        let mut said = Vec::new();
        while self.decided.is_none() {
            let round = self.round;
            let heard_ways = self.others().all(|j| self.heard.contains_key(&(round, j)));
            if !self.costed && heard_ways {
                if self.is_settled() {
                    self.decide();
                    break;
                }
                said.push(self.cost());
            }
            let heard_costs = self.others().all(|j| self.costs.contains_key(&(round, j)));
            if !(self.costed && heard_costs) {
                break;
            }
            self.learn();
            said.push(self.predictions());
        }
        said
    }

    /// Line 25: all know how far anybody has moved, so all stop in the same round.
    fn is_settled(&mut self) -> bool {
        let stop = self.own.settings().stop;
        if self.round > 0 {
            let heard = self.others().map(|j| self.changes[&(self.round, j)]);
            let most = heard.fold(self.change, f64::max);
            self.calm = stop.calm(self.calm, most);
        }
        self.calm >= stop.calm_rounds || self.round >= stop.max_rounds
    }

    /// Lines 10 to 15.
    fn cost(&mut self) -> Message {
        let objective = &self.own.world.objective;
        let r = self.own.options.separation_m;
        let costs: Vec<f64> = (0..self.block)
            .map(|k| {
                let x = self.samples[k];
                let way = &self.own.options.predictions[x];
                let own_altitude_m = self.own.options.altitude_m;
                let near =
                    |j: &usize| (self.altitudes_m[j] - own_altitude_m).abs() < objective.vertical_m;
                self.others().filter(near).fold(self.own_costs[x], |sum, j| {
                    let [own, _] =
                        objective.collision(way, &self.heard[&(self.round, j)][k], [r, r]);
                    sum + own
                })
            })
            .collect();
        self.costs.insert((self.round, self.own.me), costs.clone());
        self.costed = true;
        Message::Costs { round: self.round, costs }
    }

    /// Lines 18 to 24: sums in the order of the airplanes, so that all come to the same bits.
    fn learn(&mut self) {
        let parts = (0..self.own.group).map(|j| &self.costs[&(self.round, j)]);
        let mut total = vec![0.0; self.block];
        for part in parts {
            total.iter_mut().zip(part).for_each(|(sum, cost)| *sum += cost);
        }
        self.player.learn(&self.samples, &total, self.ageing);
        let settings = self.own.settings();
        self.change = self.player.update(settings.update, settings.cooling);
        let old = self.round;
        self.heard.retain(|(round, _), _| *round > old);
        self.costs.retain(|(round, _), _| *round > old);
        self.changes.retain(|(round, _), _| *round > old);
        self.round += 1;
    }

    fn decide(&mut self) {
        let settings = self.own.settings();
        let chosen = self.player.choose(settings.choice, self.own.uniform(self.drawn()));
        self.decided = Some(Decided {
            chosen,
            expected: self.player.expected().to_vec(),
            rounds: self.round,
            converged: self.calm >= settings.stop.calm_rounds,
        });
    }
}

impl network::Agent for Agent<'_> {
    type Message = Message;

    fn start(&mut self) -> Vec<Message> {
        vec![self.predictions()]
    }

    fn on_message(&mut self, from: usize, message: Message) -> Vec<Message> {
        match message {
            Message::Predictions { round, change, altitude_m, ways } => {
                self.altitudes_m.insert(from, altitude_m);
                self.changes.insert((round, from), change);
                self.heard.insert((round, from), ways);
            }
            Message::Costs { round, costs } => {
                self.costs.insert((round, from), costs);
            }
        }
        self.go_on()
    }

    fn decided(&self) -> Option<Decided> {
        self.decided.clone()
    }
}
