//! Agents that first tell each other all they may do, and then only what they make of it:
//! samples' numbers, or distributions.

use super::super::airplane::{Point, Pose, Prediction};
use super::super::decide::Known;
use super::super::objective::{Options, couple, own_costs};
use super::{Decided, Own, network};
use crate::collectives::{Estimator, Game, Order, PairwiseGame, Player};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What agents tell each other.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) enum Message {
    /// The ways of all the sender's actions, and its separation.
    Ways { ways: Vec<Prediction>, separation_m: f64, altitude_m: f64 },
    /// From which the others predict its ways themselves.
    Model {
        pose: Pose,
        next: u32,
        mission: Vec<Point>,
        airplane: u32,
        orders: u32,
        altitude_m: f64,
    },
    /// The numbers of the round's samples, and how far the sender has moved in the round before.
    Samples { round: u32, change: f64, samples: Vec<u16> },
    /// The sender's distribution after a round, and how far it has moved in it.
    Distribution { round: u32, change: f64, q: Vec<f64> },
}

/// One agent.
#[derive(Debug)]
pub(super) struct Agent<'a> {
    own: Own<'a>,
    by_model: bool,
    options: BTreeMap<usize, Options>,
    game: Option<PairwiseGame>,
    player: Player,
    round: u32,
    calm: u32,
    change: f64,
    /// Distributions after each round, by round and agent; round 0 is the beginning.
    q: BTreeMap<(u32, usize), Vec<f64>>,
    samples: BTreeMap<(u32, usize), Vec<usize>>,
    changes: BTreeMap<(u32, usize), f64>,
    decided: Option<Decided>,
}

impl<'a> Agent<'a> {
    pub(super) fn new(own: Own<'a>, by_model: bool) -> Self {
        let player = Player::new(own.options.predictions.len());
        let options = BTreeMap::from([(own.me, own.options.clone())]);
        Self {
            own,
            by_model,
            options,
            game: None,
            player,
            round: 0,
            calm: 0,
            change: f64::INFINITY,
            q: BTreeMap::new(),
            samples: BTreeMap::new(),
            changes: BTreeMap::new(),
            decided: None,
        }
    }

    fn announcement(&self) -> Message {
        if !self.by_model {
            let Options { predictions, separation_m, altitude_m, .. } = self.own.options.clone();
            return Message::Ways { ways: predictions, separation_m, altitude_m };
        }
        let Known { slot, pose, next, orders, altitude_m } = self.own.known;
        let mission = self.own.mission().to_vec();
        Message::Model { pose, next: next as u32, mission, airplane: slot, orders, altitude_m }
    }

    /// Goes on as far as what has been heard allows.
    fn go_on(&mut self) -> Vec<Message> {
        if self.game.is_none() {
            if self.options.len() < self.own.group {
                return Vec::new();
            }
            self.meet();
            if let Estimator::Sampled { block, .. } = self.own.settings().estimator {
                let mut said = vec![self.draw(block)];
                said.extend(self.sampled_rounds(block));
                return said;
            }
        }
        match self.own.settings().estimator {
            Estimator::Exact => self.exact_rounds(),
            Estimator::Sampled { block, .. } => self.sampled_rounds(block),
        }
    }

    /// Everybody's options are known: the game, and the distributions at the beginning.
    fn meet(&mut self) {
        let objective = &self.own.world.objective;
        let all: Vec<&Options> = self.options.values().collect();
        let mut game = PairwiseGame::new(all.iter().map(|o| own_costs(objective, o)).collect());
        let exact = self.own.settings().estimator == Estimator::Exact;
        for i in 0..all.len() {
            for j in i + 1..all.len() {
                // An exact player needs only its own pairs.
                if !exact || i == self.own.me || j == self.own.me {
                    couple(&mut game, objective, (i, all[i]), (j, all[j]));
                }
            }
        }
        for (j, options) in all.iter().enumerate() {
            let n = options.predictions.len();
            self.q.insert((0, j), vec![1.0 / n as f64; n]);
        }
        self.game = Some(game);
    }

    /// Rounds are numbered from 1 here: round `r` updates to the distributions `q_r`.
    fn exact_rounds(&mut self) -> Vec<Message> {
        let mut said = Vec::new();
        while self.decided.is_none() {
            let (me, round) = (self.own.me, self.round + 1);
            if !self.q.contains_key(&(round, me)) {
                let sequence = self.own.settings().order == Order::Sequence;
                let seen: Vec<_> = (0..self.own.group)
                    .map(|j| if sequence && j < me { (round, j) } else { (round - 1, j) })
                    .collect();
                if !seen.iter().all(|key| self.q.contains_key(key)) {
                    break;
                }
                said.push(self.exact_round(round, &seen));
            }
            if !(0..self.own.group).all(|j| self.q.contains_key(&(round, j))) {
                break;
            }
            let most = (0..self.own.group).map(|j| self.changes[&(round, j)]).fold(0.0, f64::max);
            self.end_round(most, round);
        }
        said
    }

    fn exact_round(&mut self, round: u32, seen: &[(u32, usize)]) -> Message {
        let (me, settings) = (self.own.me, *self.own.settings());
        let q: Vec<Vec<f64>> = seen.iter().map(|key| self.q[key].clone()).collect();
        if let Some(game) = &self.game {
            self.player.know(|expected| game.expect(me, &q, expected));
        }
        let change = self.player.update(settings.update, settings.cooling);
        let q = self.player.q.clone();
        self.q.insert((round, me), q.clone());
        self.changes.insert((round, me), change);
        Message::Distribution { round, change, q }
    }

    fn draw(&mut self, block: usize) -> Message {
        let drawn = u64::from(self.round) * block as u64;
        let samples = self.own.samples(&self.player, drawn, block);
        self.samples.insert((self.round, self.own.me), samples.clone());
        self.changes.insert((self.round, self.own.me), self.change);
        let samples = samples.iter().map(|&x| x as u16).collect();
        Message::Samples { round: self.round, change: self.change, samples }
    }

    fn sampled_rounds(&mut self, block: usize) -> Vec<Message> {
        let mut said = Vec::new();
        let everybody = 0..self.own.group;
        while self.decided.is_none() {
            let round = self.round;
            if !everybody.clone().all(|j| self.samples.contains_key(&(round, j))) {
                break;
            }
            if round > 0 {
                let moved = everybody.clone().map(|j| self.changes[&(round, j)]);
                let most = moved.fold(0.0, f64::max);
                let stop = self.own.settings().stop;
                self.calm = stop.calm(self.calm, most);
                if self.calm >= stop.calm_rounds || round >= stop.max_rounds {
                    self.decide(u64::from(round) * block as u64);
                    break;
                }
            }
            self.learn(block);
            self.round += 1;
            said.push(self.draw(block));
        }
        said
    }

    fn learn(&mut self, block: usize) {
        let Estimator::Sampled { ageing, .. } = self.own.settings().estimator else { return };
        let Some(game) = &self.game else { return };
        let of = |j: usize| &self.samples[&(self.round, j)];
        let cost = |k: usize| {
            let joint: Vec<usize> = (0..self.own.group).map(|j| of(j)[k]).collect();
            game.cost(&joint)
        };
        let costs: Vec<f64> = (0..block).map(cost).collect();
        let own = of(self.own.me).clone();
        self.player.learn(&own, &costs, ageing);
        let settings = *self.own.settings();
        self.change = self.player.update(settings.update, settings.cooling);
    }

    fn end_round(&mut self, most: f64, round: u32) {
        let stop = self.own.settings().stop;
        self.calm = stop.calm(self.calm, most);
        self.round = round;
        self.q.retain(|(r, _), _| *r >= round);
        if self.calm >= stop.calm_rounds || round >= stop.max_rounds {
            self.decide(0);
        }
    }

    fn decide(&mut self, drawn: u64) {
        let settings = self.own.settings();
        self.decided = Some(Decided {
            chosen: self.player.choose(settings.choice, self.own.uniform(drawn)),
            expected: self.player.expected().to_vec(),
            rounds: self.round,
            converged: self.calm >= settings.stop.calm_rounds,
        });
    }
}

impl network::Agent for Agent<'_> {
    type Message = Message;

    fn start(&mut self) -> Vec<Message> {
        let mut said = vec![self.announcement()];
        said.extend(self.go_on());
        said
    }

    fn on_message(&mut self, from: usize, message: Message) -> Vec<Message> {
        match message {
            Message::Ways { ways, separation_m, altitude_m } => {
                self.options.insert(from, Options::new(ways, separation_m, altitude_m));
            }
            Message::Model { pose, next, mission, airplane: slot, orders, altitude_m } => {
                let known = Known { slot, pose, next: next as usize, orders, altitude_m };
                let options = self.own.world.options_towards(known, &mission);
                self.options.insert(from, options);
            }
            Message::Samples { round, change, samples } => {
                let samples = samples.iter().map(|&x| usize::from(x)).collect();
                self.samples.insert((round, from), samples);
                self.changes.insert((round, from), change);
            }
            Message::Distribution { round, change, q } => {
                self.q.insert((round, from), q);
                self.changes.insert((round, from), change);
            }
        }
        self.go_on()
    }

    fn decided(&self) -> Option<Decided> {
        self.decided.clone()
    }
}
