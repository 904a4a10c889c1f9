//! Fleets: agents that run in processes of their own, as a page shows them.

use super::BodyId;
use serde::Serialize;

/// A fleet at one moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Fleet {
    /// Whether all nodes have joined.
    pub has_begun: bool,
    /// Seconds since its server was last heard.
    pub silent_s: f64,
    /// Number of cycles that began late, in real time.
    pub late_cycles: u64,
    /// Median time in milliseconds from the percepts of a cycle to its last control.
    pub talk_p50_ms: Option<f64>,
    /// The time in milliseconds below which 99 of 100 of them are.
    pub talk_p99_ms: Option<f64>,
    /// The nodes, by rising number of the agent.
    pub nodes: Vec<FleetNode>,
}

/// The node of an agent.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct FleetNode {
    /// The agent's number on the network.
    pub agent: u32,
    /// The body that shows the agent.
    pub body: BodyId,
    /// A word for its state: `awaited`, `joined`, `gone`, or its part in the cycle.
    pub state: String,
    /// Epoch of the coordinator that it follows.
    pub epoch: u64,
    /// Numbers on the network of the agents that it has heard in the last cycle.
    pub heard: Vec<u32>,
    /// The round of its talk.
    pub round: u32,
    /// Number of its controls that were flown.
    pub flown: u64,
    /// Number of its controls that came late, or not at all.
    pub late: u64,
    /// Number of times that it has joined.
    pub lives: u64,
    /// Packets that it sends in a second.
    pub packets_per_s: f64,
    /// Bytes that it sends in a second.
    pub bytes_per_s: f64,
    /// Seconds since the server last heard it; none if it never has.
    pub silent_s: Option<f64>,
}
