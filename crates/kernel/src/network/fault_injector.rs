//! The faults of the packets of one agent, where each agent is a process of its own.
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
    draws: FaultStreams,
    talks: Vec<(u64, f64)>,
    /// Tick from which on each way of a link is free.
    free_at: BTreeMap<[EntityId; 2], f64>,
}

impl FaultInjector {
    /// Returns a network with these faults.
    pub fn new(network: Network, draws: FaultStreams) -> Self {
        Self { network, draws, talks: vec![(0, 0.0)], free_at: BTreeMap::new() }
    }

    /// Begins a cycle: all links are free. Its talks, at least one, are given by their first ticks and the times of
    /// those in seconds after the start of the run, rising.
    pub fn start_cycle(&mut self, talks: Vec<(u64, f64)>) {
        (self.talks, self.free_at) = (talks, BTreeMap::new());
    }

    /// Returns the arrivals of a packet at its receiver: none if it is lost, two if it is doubled. An arrival is the
    /// tick in which all of the packet is on its way, and the tick in which it arrives. Its `cycle` is the tick in
    /// which it is sent. Distances do not matter here.
    pub fn arrivals(&mut self, packet: Envelope) -> Vec<(u64, u64)> {
        let network = Some(&self.network);
        let mut carrier = FaultyTransport::in_memory(network, self.draws, None, &self.talks);
        carrier.free_at = std::mem::take(&mut self.free_at);
        let receiver = packet.receiver;
        carrier.send(packet);
        let mut arrivals = Vec::new();
        while let Some(at) = carrier.next_arrival() {
            arrivals.extend(carrier.receive(receiver, at).iter().map(|copy| (copy.cycle, at)));
        }
        self.free_at = std::mem::take(&mut carrier.free_at);
        arrivals
    }

    /// Duration of a tick in seconds.
    pub fn tick_s(&self) -> f64 {
        self.network.latency_s
    }
}
