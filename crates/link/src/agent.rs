//! Percepts, controls and packets of agents, and interfaces of their programs: as bytes, so that this crate needs to know
//! no world's types.

use crate::protocol::CycleStart;
pub use sidestep::kernel::network::OutgoingPacket;
use sidestep::kernel::{Cycle, EntityId};
use std::time::Duration;

/// Controls of agents in the form that their world reads, at most one of each.
pub type SerializedControls = Vec<(EntityId, Vec<u8>)>;

/// Everything that an agent perceives at the start of a cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct AgentPercept {
    /// The agent that perceives it.
    pub agent: EntityId,
    /// The agents that decide together in this cycle, including this one, in ascending order.
    pub group: Vec<EntityId>,
    /// The message that carries the percept.
    pub start: CycleStart,
}

/// A control that cannot be read or carried out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InvalidControl {
    /// The agent that sent it.
    pub agent: EntityId,
    /// Why it is invalid, for the server's log.
    pub reason: String,
}

/// The present activity of an agent, for logs and tables.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct AgentActivity {
    /// Its name, e.g. `optimize`.
    pub name: &'static str,
    /// Number of rounds of the conversation so far.
    pub round: u32,
    /// Epoch of the coordinator that the agent follows.
    pub epoch: u64,
}

/// The program of an agent: a state machine without a clock, a socket or a thread, so that the same program runs in the
/// simulator and at a node. One that decides alone has no packets and no timers.
pub trait AgentProgram: Send {
    /// Starts a cycle with the agent's percept, and abandons the cycle before. Returns the tick in which the cycle
    /// starts.
    ///
    /// # Errors
    /// When the percept cannot be read, with the reason.
    fn start_cycle(&mut self, cycle: Cycle, percept: &[u8]) -> Result<u64, String>;

    /// Receives a packet of another agent.
    fn on_packet(&mut self, _from: EntityId, _payload: &[u8], _tick: u64) {}

    /// Does everything that is due by a tick.
    fn on_timer(&mut self, _tick: u64) {}

    /// Returns the tick of the next timer; `None` where only a packet can make it go on.
    fn next_timer(&self) -> Option<u64> {
        None
    }

    /// Takes out the packets to be sent, each once.
    fn take_packets(&mut self) -> Vec<OutgoingPacket> {
        Vec::new()
    }

    /// Returns whether its control is ready.
    fn is_done(&self) -> bool;

    /// Returns its control, once it is ready.
    fn control(&self) -> Option<Vec<u8>>;

    /// Returns its present activity; nothing depends on it.
    fn activity(&self) -> AgentActivity;

    /// Returns the other agents that it has heard in this cycle, or in the one before if it has heard none yet.
    fn heard_agents(&self) -> Vec<EntityId> {
        Vec::new()
    }

    /// Returns counts of packets that it has dropped, by reason.
    fn drop_counts(&self) -> Vec<(String, u64)> {
        Vec::new()
    }

    /// Returns the time after which it wants to be polled; none where only what the node receives makes it go on.
    fn poll_interval(&self) -> Option<Duration> {
        None
    }

    /// Receives what has come from elsewhere than the node, without waiting.
    fn poll(&mut self) {}
}

/// A packet in transit to one receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PacketInTransit {
    /// The receiver.
    pub to: EntityId,
    /// The tick in which it is sent. In real time it is that in which the cycle began, so that the same packets
    /// meet the same faults although they are not sent at the same times.
    pub tick: u64,
    /// Its number among the sender's in that tick.
    pub sequence: u32,
    /// Its size in bytes.
    pub bytes: usize,
}

/// An arrival of a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PacketTiming {
    /// The tick in which its last byte leaves the sender: a large packet occupies the link for some time.
    pub departs: u64,
    /// The tick in which it arrives.
    pub arrives: u64,
}

/// The faults of packets from one agent to others, drawn from the scenario's seed.
pub trait ChannelModel: Send {
    /// Returns the arrivals of a packet: none if it is lost, two if it is duplicated.
    fn arrivals(&mut self, packet: &PacketInTransit) -> Vec<PacketTiming>;

    /// Duration of a tick, in seconds of the scenario.
    fn tick_s(&self) -> f64;

    /// Starts a cycle: links are idle again.
    fn start_cycle(&mut self, cycle: Cycle);
}
