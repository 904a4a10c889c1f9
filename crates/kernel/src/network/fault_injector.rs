//! Faults of the packets of one agent, where each agent is a process of its own.
//!
//! They are drawn like those of a network in memory, so that a packet of the same number in the same tick
//! of the same cycle meets the same faults, wherever its sender runs.

use super::{FaultStreams, FaultyTransport, Network};
use crate::ports::{Envelope, Transport};
use crate::units::EntityId;
use std::collections::BTreeMap;

/// The network between one agent and all others, with its faults.
#[derive(Debug, Clone)]
pub struct FaultInjector {
    network: Network,
    streams: FaultStreams,
    /// As in [`FaultInjector::start_cycle`].
    conversations: Vec<(u64, f64)>,
    /// Tick from which on each direction of a link is free.
    free_at: BTreeMap<[EntityId; 2], f64>,
}

impl FaultInjector {
    /// Returns the injector of an agent before its first cycle.
    pub fn new(network: Network, streams: FaultStreams) -> Self {
        Self { network, streams, conversations: vec![(0, 0.0)], free_at: BTreeMap::new() }
    }

    /// Starts a cycle, in which all links are free. Its conversations, at least one, are given by their first ticks
    /// and the times of those in seconds after the start of the run, rising.
    pub fn start_cycle(&mut self, conversations: Vec<(u64, f64)>) {
        self.conversations = conversations;
        self.free_at = BTreeMap::new();
    }

    /// Returns the arrivals of a packet at its receiver: none if it is lost, two if it is duplicated. An arrival is
    /// the tick by which all of the packet is sent, and the tick in which it arrives. The packet's `cycle` is the
    /// tick in which sending starts. The range is not checked, because no process has the places of all agents.
    pub fn arrivals(&mut self, packet: Envelope) -> Vec<(u64, u64)> {
        // A network in memory for this packet alone: the same code then draws the same faults as in a run in one
        // process.
        let network = Some(&self.network);
        let mut transport =
            FaultyTransport::in_memory(network, self.streams, None, &self.conversations);
        transport.free_at = std::mem::take(&mut self.free_at);
        let receiver = packet.receiver;
        transport.send(packet);
        let mut arrivals = Vec::new();
        while let Some(tick) = transport.next_arrival() {
            let copies = transport.receive(receiver, tick);
            arrivals.extend(copies.iter().map(|copy| (copy.cycle, tick)));
        }
        self.free_at = std::mem::take(&mut transport.free_at);
        arrivals
    }

    /// Duration of a tick in seconds.
    pub fn tick_s(&self) -> f64 {
        self.network.latency_s
    }
}
