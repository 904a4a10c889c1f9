//! The part that agents have in common who optimize together: whatever they send each other, they go on step by
//! step as far as the messages heard allow, until they conclude.

use super::link::{self, Most};
use super::own_ship::OwnShip;
use super::party::Unsound;
use super::{Beacon, Conclusion, Decided};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The result of a step.
pub(crate) enum Step<M> {
    /// It has only changed itself.
    Done,
    /// It has something to say.
    Say(M),
    /// It is over.
    Conclude,
}

/// An algorithm of one airplane in a group. Others are known by their place.
pub(crate) trait Optimizer {
    /// Type of the messages that it sends and receives.
    type Message: Serialize + DeserializeOwned;

    /// Returns the knowledge of its own airplane.
    fn own(&self) -> &OwnShip;

    /// Returns the number of rounds made.
    fn round(&self) -> u32;

    /// Returns its first message.
    fn opening(&mut self) -> Self::Message;

    /// Checks a message of the airplane at a place, see [`link::Agent::check`].
    ///
    /// # Errors
    /// When it says what cannot be.
    fn admits(&self, from: usize, message: &Self::Message) -> Result<(), Unsound>;

    /// Returns the bounds on what it may be sent.
    fn most(&self) -> Most;

    /// Takes a message of the airplane at a place. Messages come in any order, each once.
    fn hear(&mut self, from: usize, message: Self::Message);

    /// Returns the places of those whose messages it needs for its next step.
    fn missing(&self) -> Vec<usize>;

    /// Takes a step, for which no message is missing.
    fn step(&mut self) -> Step<Self::Message>;

    /// Goes on without another one, see [`link::Agent::without`].
    fn lose(&mut self, other: usize, is_settled: bool);

    /// Returns its decision from what it has learned; none, if that is nothing.
    fn decided(&self) -> Option<Decided>;

    /// Hands over the beacons that it has heard, by place.
    fn take_beacons(&mut self) -> Vec<Option<Beacon>>;
}

/// An agent that optimizes.
#[derive(Debug)]
pub(crate) struct Optimizing<O> {
    optimizer: O,
    conclusion: Option<Conclusion>,
}

impl<O: Optimizer> Optimizing<O> {
    /// Returns an agent that has not sent anything yet.
    pub(crate) fn new(optimizer: O) -> Self {
        Self { optimizer, conclusion: None }
    }

    /// Continues as far as the messages heard allow.
    fn go_on(&mut self) -> Vec<O::Message> {
        let mut said = Vec::new();
        while self.conclusion.is_none() && self.optimizer.missing().is_empty() {
            match self.optimizer.step() {
                Step::Done => {}
                Step::Say(message) => said.push(message),
                Step::Conclude => self.conclude(),
            }
        }
        said
    }

    fn conclude(&mut self) {
        let (decided, beacons) = (self.optimizer.decided(), self.optimizer.take_beacons());
        self.conclusion = Some(Conclusion { decided, beacons });
    }
}

impl<O: Optimizer> link::Agent for Optimizing<O> {
    type Message = O::Message;
    type Outcome = Conclusion;

    fn start(&mut self) -> Vec<O::Message> {
        let mut said = vec![self.optimizer.opening()];
        said.extend(self.go_on());
        said
    }

    fn check(&self, from: usize, message: &O::Message) -> Result<(), Unsound> {
        self.optimizer.admits(from, message)
    }

    fn most(&self) -> Most {
        self.optimizer.most()
    }

    fn on_message(&mut self, from: usize, message: O::Message) -> Vec<O::Message> {
        if self.conclusion.is_none() {
            self.optimizer.hear(from, message);
        }
        self.go_on()
    }

    fn round(&self) -> u32 {
        self.optimizer.round()
    }

    fn awaits(&self) -> Vec<usize> {
        if self.conclusion.is_some() {
            return Vec::new();
        }
        self.optimizer.missing()
    }

    fn expects(&self, other: usize) -> bool {
        self.optimizer.own().expects(other)
    }

    fn without(&mut self, other: usize, is_settled: bool) -> Vec<O::Message> {
        self.optimizer.lose(other, is_settled);
        self.go_on()
    }

    fn at_deadline(&mut self) {
        self.conclude();
    }

    fn is_done(&self) -> bool {
        self.conclusion.is_some()
    }

    fn outcome(&self) -> Option<Conclusion> {
        self.conclusion.clone()
    }
}
