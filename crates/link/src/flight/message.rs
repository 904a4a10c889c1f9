//! What the nodes of a flight without a server, and its recorder, send to each other.

use crate::protocol::{AgentPacket, NodeStatusReport};
use serde::{Deserialize, Serialize};
use sidestep::kernel::digest::Digest;
use sidestep::kernel::{Cycle, EntityId};
use sidestep::worlds::airspace::replica::AirplaneReport;

/// A message, with what tells whether it belongs to the flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlightMessage {
    /// The flight: its scenario, and the build of the program.
    pub flight: u64,
    /// When cycle 0 begins, as far as the sender knows, in seconds since 1970.
    pub start_s: Option<f64>,
    /// When it was sent, by the sender's clock.
    pub sent_s: f64,
    /// What it says.
    pub content: FlightContent,
}

/// What a message says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum FlightContent {
    /// Node to all, before the start.
    Presence(Presence),
    /// Recorder to the nodes: cycle 0 begins at the time of the message's head.
    Start,
    /// Node to all: its airplane at the start of the next cycle.
    Report(Box<FlightReport>),
    /// Node to nodes: packets of a conversation.
    Packets(Vec<AgentPacket>),
    /// Node to nodes, after it was started again: what did I report last?
    Recall,
    /// Node to node: what the sender remembers of the receiver.
    Recalled(Box<RecallAnswer>),
    /// Node to recorder: its state.
    Status(NodeStatusReport),
    /// Recorder to node: it has the report for this cycle.
    Received(Cycle),
}

/// The state of a node before the start.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Presence {
    /// Whether its vehicle is at the start, and the node hears all others.
    pub is_ready: bool,
    /// Its process id on its machine.
    pub process: u32,
}

/// The report of an airplane, with what the recorder needs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlightReport {
    /// Its part of the state at the start of a cycle.
    pub report: AirplaneReport,
    /// The control that it flies until then, serialized; none if it flies its stored fallback without one.
    pub control: Option<Vec<u8>>,
    /// Whether its vehicle flies its reference.
    pub standing: Standing,
}

/// What a node remembers for another one that was started again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecallAnswer {
    /// The last report of the receiver that the sender has.
    pub report: FlightReport,
    /// The airplanes whose flights have ended, as far as the sender knows: they need not answer anymore.
    pub ended: Vec<EntityId>,
}

/// Whether a vehicle flies its reference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Standing {
    /// It does.
    Leads,
    /// It was handed over to its own autopilot, and is there, if that is known.
    Held(Option<[f64; 2]>),
}

/// Returns the number of a flight: parties of other scenarios or builds are of another one.
pub fn flight_number(scenario: &str, build: &str, speed: f64) -> u64 {
    let text = format!("{scenario}\n{build}\n{speed}");
    let digest = Digest::hash_bytes(text.as_bytes());
    let (first, _) = digest.as_bytes().split_first_chunk().expect("it is longer");
    u64::from_le_bytes(*first)
}
