//! What agents that optimize together have in common: whatever they send each other, they proceed step by
//! step as far as the messages heard allow, until they conclude.

use super::link::{self, MessageLimits};
use super::ownship::Ownship;
use super::participant::InvalidMessage;
use super::{ActionChoice, OptimizationResult, StateBeacon};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The result of a step.
pub(crate) enum OptimizerStep<M> {
    /// It has only changed itself.
    Done,
    /// It has a message to send.
    Send(M),
    /// It is over.
    Conclude,
}

/// An algorithm of one airplane in a group. Others are known by their place.
pub(crate) trait Optimizer {
    type Message: Serialize + DeserializeOwned;

    fn ownship(&self) -> &Ownship;

    /// Returns the number of rounds made.
    fn round(&self) -> u32;

    /// Returns the message with which it starts, before it has heard anything.
    fn first_message(&mut self) -> Self::Message;

    /// Checks a message of the airplane at a place, see [`link::ProtocolAgent::check_message`].
    ///
    /// # Errors
    /// When its content is impossible.
    fn check_message(&self, from: usize, message: &Self::Message) -> Result<(), InvalidMessage>;

    /// Returns the bounds on the messages that it may be sent.
    fn message_limits(&self) -> MessageLimits;

    /// Receives a message of the airplane at a place. Messages come in any order, each once.
    fn receive(&mut self, from: usize, message: Self::Message);

    /// Returns the places of those whose messages it needs for its next step.
    fn missing_members(&self) -> Vec<usize>;

    /// Takes a step, for which no message is missing.
    fn step(&mut self) -> OptimizerStep<Self::Message>;

    /// Continues without another one, see [`link::ProtocolAgent::on_peer_gone`].
    fn on_peer_gone(&mut self, other: usize, is_settled: bool);

    /// Returns its decision; none if it has learned nothing.
    fn action_choice(&self) -> Option<ActionChoice>;

    /// Hands over the beacons that it has heard, by place.
    fn take_beacons(&mut self) -> Vec<Option<StateBeacon>>;
}

/// An agent around an optimizer, which takes a step whenever no message is missing.
#[derive(Debug)]
pub(crate) struct OptimizingAgent<O> {
    optimizer: O,
    conclusion: Option<OptimizationResult>,
}

impl<O: Optimizer> OptimizingAgent<O> {
    /// Returns an agent that has not sent anything yet.
    pub(crate) fn new(optimizer: O) -> Self {
        Self { optimizer, conclusion: None }
    }

    /// Continues as far as the messages heard allow.
    fn advance(&mut self) -> Vec<O::Message> {
        let mut outgoing = Vec::new();
        while self.conclusion.is_none() && self.optimizer.missing_members().is_empty() {
            match self.optimizer.step() {
                OptimizerStep::Done => {}
                OptimizerStep::Send(message) => outgoing.push(message),
                OptimizerStep::Conclude => self.conclude(),
            }
        }
        outgoing
    }

    fn conclude(&mut self) {
        self.conclusion = Some(OptimizationResult {
            decided: self.optimizer.action_choice(),
            beacons: self.optimizer.take_beacons(),
        });
    }
}

impl<O: Optimizer> link::ProtocolAgent for OptimizingAgent<O> {
    type Message = O::Message;
    type Outcome = OptimizationResult;

    fn start(&mut self) -> Vec<O::Message> {
        let mut outgoing = vec![self.optimizer.first_message()];
        outgoing.extend(self.advance());
        outgoing
    }

    fn check_message(&self, from: usize, message: &O::Message) -> Result<(), InvalidMessage> {
        self.optimizer.check_message(from, message)
    }

    fn message_limits(&self) -> MessageLimits {
        self.optimizer.message_limits()
    }

    fn on_message(&mut self, from: usize, message: O::Message) -> Vec<O::Message> {
        if self.conclusion.is_none() {
            self.optimizer.receive(from, message);
        }
        self.advance()
    }

    fn round(&self) -> u32 {
        self.optimizer.round()
    }

    fn awaited_members(&self) -> Vec<usize> {
        if self.conclusion.is_some() {
            return Vec::new();
        }
        self.optimizer.missing_members()
    }

    fn is_expected(&self, other: usize) -> bool {
        self.optimizer.ownship().is_expected(other)
    }

    fn on_peer_gone(&mut self, other: usize, is_settled: bool) -> Vec<O::Message> {
        self.optimizer.on_peer_gone(other, is_settled);
        self.advance()
    }

    fn on_deadline(&mut self) {
        self.conclude();
    }

    fn is_done(&self) -> bool {
        self.conclusion.is_some()
    }

    fn outcome(&self) -> Option<OptimizationResult> {
        self.conclusion.clone()
    }
}
