//! Agents: the programs aboard the airplanes, each with its own data.
//!
//! An agent owns its knowledge of its airplane and of others ([`Ownship`]), the knowledge that all share
//! ([`CommonKnowledge`]), and its part of the optimization. It is a state machine: messages in, messages out. An
//! [`ReliableEndpoint`] is an agent together with the code that makes its messages arrive, a [`Participant`] of a conversation;
//! a [`Conversation`] wraps its messages in packets, and lets only sound messages through to it. None of them knows
//! which network carries the packets, in memory or between processes.
//!
//! | Module | Task |
//! |---|---|
//! | [`sampling`] | the paper's Algorithm 1: samples, predicts, and shares both |
//! | [`prediction_sharing`] | sends all its possible paths once, and then only samples or distributions |
//! | [`coordinator`] | migrates from airplane to airplane, and decides for all |
//! | [`intent`] | sends hidden intentions once, for methods that find headings |
//! | [`grouping`] | finds the airplanes that decide together, where groups are not announced |
//! | [`exchange`] | the shield: whether plans are safe together |
//! | [`packet`] | the subjects of conversations, and packets on their way out |
//!
//! No agent waits forever: one that is not heard is presumed where it was last heard ([`traffic_state`]).

mod conversation;
pub mod coordinator;
pub mod exchange;
pub mod grouping;
pub mod intent;
mod link;
pub mod network_traffic;
mod optimizer;
mod ownship;
pub mod packet;
mod participant;
pub mod prediction_sharing;
pub mod sampling;
pub mod traffic_state;

pub use conversation::{Conversation, ConversationSetup};
pub use link::{EndpointConfig, MessageLimits, ProtocolAgent, ReliableEndpoint};
pub(crate) use optimizer::OptimizingAgent;
pub use ownship::{
    CommandedFlight, CommonKnowledge, FiledChanges, FiledFlight, Ownship, RouteProgress,
};
pub use participant::{
    ConversationEnd, ConversationProgress, FinishableParticipant, InvalidMessage, OutgoingMessage,
    Participant,
};
use serde::{Deserialize, Serialize};
use sidestep_collectives::{OptimizeResult, is_at_bound};
use traffic_state::StateBeacon;

/// Outcome of the optimization for an airplane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ActionChoice {
    /// The chosen action, by its number among those of the airplane.
    pub chosen: usize,
    /// The estimate of every action at the end.
    pub expected: Vec<f64>,
    /// Number of rounds made.
    pub rounds: u32,
    /// Whether the distributions had settled.
    pub converged: bool,
    /// The cost of the joint action, where it is known: agents that sample never add it up.
    pub reached: Option<ReachedCost>,
    /// The probability of every action at the end, on request: no coordinator carries it from
    /// airplane to airplane, where it is empty.
    #[serde(skip)]
    pub chances: Vec<f64>,
}

/// The cost of a chosen joint action.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReachedCost {
    /// The objective `G`.
    pub cost: f64,
    /// A lower bound on `G` of every joint action.
    pub bound: f64,
}

impl ReachedCost {
    /// Returns the cost that an optimization has reached; none where it has no bound.
    pub(crate) fn from_result(result: &OptimizeResult) -> Option<Self> {
        result.bound.map(|bound| Self { cost: result.cost, bound })
    }

    /// Returns whether no joint action costs less, by the bound.
    pub(crate) fn is_proved_minimum(&self) -> bool {
        is_at_bound(self.cost, self.bound)
    }
}

/// Outcome of an agent that optimizes.
#[derive(Debug, Clone, PartialEq)]
pub struct OptimizationResult {
    /// The decision; none if time was up before the agent had learned anything.
    pub decided: Option<ActionChoice>,
    /// Beacons of the others that were heard, by place.
    pub beacons: Vec<Option<StateBeacon>>,
}
