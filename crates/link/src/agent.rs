//! Percepts, controls and packets of agents, and ports to their programs: as bytes, so that any world can be flown.

use crate::protocol::CycleStart;
pub use sidestep::kernel::network::OutgoingPacket;
use sidestep::kernel::{Cycle, EntityId};

/// Controls of agents, serialized.
pub type Controls = Vec<(EntityId, Vec<u8>)>;

/// Everything that an agent perceives at the start of a cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct AgentPercept {
    /// The agent.
    pub agent: EntityId,
    /// The agents that decide together in this cycle, this one among them, rising.
    pub group: Vec<EntityId>,
    /// The percept, as sent.
    pub begin: CycleStart,
}

/// A control that makes no sense.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InvalidControl {
    /// The agent that sent it.
    pub agent: EntityId,
    /// The reason.
    pub reason: String,
}

/// The part of a cycle in which an agent is, for people.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Activity {
    /// A word for it, e.g. `optimize`.
    pub word: &'static str,
    /// Number of rounds so far.
    pub round: u32,
    /// Epoch of the coordinator that it follows.
    pub epoch: u64,
}

/// The program of an agent: a state machine without a clock, a socket or a thread.
pub trait AgentProgram: Send {
    /// Begins a cycle with the agent's percept; anything begun in the cycle before is over. Returns the tick in
    /// which the cycle begins.
    ///
    /// # Errors
    /// When the percept cannot be read, with the reason.
    fn start_cycle(&mut self, cycle: Cycle, sight: &[u8]) -> Result<u64, String>;

    /// Takes a packet of another agent.
    fn on_packet(&mut self, from: EntityId, payload: &[u8], tick: u64);

    /// Does everything that is due by a tick.
    fn on_timer(&mut self, tick: u64);

    /// Returns the tick of the next timer.
    fn next_timer(&self) -> Option<u64>;

    /// Takes the packets that it wants to send.
    fn take_packets(&mut self) -> Vec<OutgoingPacket>;

    /// Returns whether its control is ready.
    fn is_done(&self) -> bool;

    /// Returns its control, once it is ready.
    fn control(&self) -> Option<Vec<u8>>;

    /// Returns its present activity.
    fn activity(&self) -> Activity;

    /// Returns the others that it has heard in this cycle, or in the one before if it has just begun.
    fn heard_agents(&self) -> Vec<EntityId>;

    /// Returns counts of packets that it has dropped, by reason.
    fn drop_counts(&self) -> Vec<(String, u64)>;
}

/// A packet on its way to one receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Transmission {
    /// The receiver.
    pub to: EntityId,
    /// The tick in which it is sent. In real time it is that in which the cycle began, so that the same packets
    /// meet the same faults although they are not sent at the same times.
    pub tick: u64,
    /// Its number among the sender's in that tick.
    pub sequence: u32,
    /// Its size.
    pub bytes: usize,
}

/// An arrival of a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Arrival {
    /// The tick in which all of it is on its way: a large packet occupies the link for some time.
    pub leaves: u64,
    /// The tick in which it arrives.
    pub arrives: u64,
}

/// The faults of packets from one agent to others, drawn from the scenario's seed.
pub trait Channel: Send {
    /// Returns the arrivals of a packet: none if it is lost, two if it is doubled.
    fn arrivals(&mut self, sent: &Transmission) -> Vec<Arrival>;

    /// Duration of a tick, in seconds of the scenario.
    fn tick_s(&self) -> f64;

    /// Begins a cycle: links are free again.
    fn start_cycle(&mut self, cycle: Cycle);
}
