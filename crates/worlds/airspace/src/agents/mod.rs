//! Agents: what runs aboard an airplane, each with its own data.
//!
//! An agent owns what it knows of its airplane and has learned of others ([`OwnShip`]), what all
//! have agreed on ([`Briefing`]), and its part of the optimization. It is a state machine: messages
//! in, messages out. An [`Endpoint`] is an agent with all that makes its messages arrive; it is
//! stepped with any [`Transport`](sidestep_kernel::ports::Transport), in memory or between
//! processes.
//!
//! | Module | What it does |
//! |---|---|
//! | [`sampling`] | the paper's Algorithm 1: samples, predicts, and shares both |
//! | [`informed`] | tells all it may do once, and then only what it makes of it |
//! | [`coordinator`] | migrates from airplane to airplane, and decides for all |
//! | [`exchange`] | the shield: whether plans go together |
//!
//! Nobody waits for ever: who is not heard is presumed where it was last heard of ([`contact`]).

pub mod contact;
pub mod coordinator;
pub mod exchange;
pub mod informed;
mod link;
pub mod network;
mod own_ship;
pub mod sampling;

use contact::Beacon;
pub(crate) use link::bytes_of;
pub use link::{Agent, Ended, Endpoint, Radio};
pub use own_ship::{Briefing, Filed, OwnShip};
use serde::{Deserialize, Serialize};

/// Outcome of the optimization for an airplane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Decided {
    /// Number of the chosen action.
    pub chosen: usize,
    /// The estimate of every action in the end.
    pub expected: Vec<f64>,
    /// Rounds made.
    pub rounds: u32,
    /// Whether the distributions had settled.
    pub converged: bool,
}

/// Outcome of an agent.
#[derive(Debug, Clone, PartialEq)]
pub struct Conclusion {
    /// Nothing, if time was up before it had learned anything.
    pub decided: Option<Decided>,
    /// Beacons of the others that it has heard, by place.
    pub beacons: Vec<Option<Beacon>>,
}
