//! The faults that happen to what one airplane sends, where each is flown by a process of its own.
//!
//! They are drawn as those of a network in memory are, so that a packet of the same number in the same tick of
//! the same cycle meets the same faults, wherever its sender runs.

use super::faulty::Faulty;
use crate::pilot::Schedule;
use crate::purpose;
use crate::world::AirspaceWorld;
use sidestep_kernel::ports::{Envelope, MemoryTransport, Transport};
use sidestep_kernel::{Cycle, EntityId};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The network between one airplane and all others, with the scenario's faults.
#[derive(Debug)]
pub struct Ether {
    world: Arc<AirspaceWorld>,
    now: Cycle,
    /// Tick from which on each way of a link is free.
    free_at: BTreeMap<[EntityId; 2], f64>,
}

impl Ether {
    /// Returns the network of a world; `None` of one whose network is reliable.
    pub fn new(world: Arc<AirspaceWorld>) -> Option<Self> {
        world.network.as_ref()?;
        Some(Self { world, now: 0, free_at: BTreeMap::new() })
    }

    /// Begins a cycle: all links are free.
    pub fn begin(&mut self, now: Cycle) {
        (self.now, self.free_at) = (now, BTreeMap::new());
    }

    /// Returns the arrivals of a packet at its receiver: none if it is lost, two if it is doubled. Of each the tick in
    /// which all of it is on its way, and the tick in which it arrives. Its `cycle` is the tick in which it is sent.
    /// Distances do not matter here.
    pub fn arrivals(&mut self, packet: Envelope) -> Vec<(u64, u64)> {
        let world = &*self.world;
        let faults = world.network.as_ref().map(|network| network.faults()).unwrap_or_default();
        let memory = MemoryTransport::new(world.streams, purpose::NETWORK, faults);
        let schedule = Schedule::of_cycle(self.now, world.network.as_ref());
        let mut network = Faulty::new(memory, world, None, (self.now, schedule));
        network.free_at = std::mem::take(&mut self.free_at);
        let receiver = packet.receiver;
        network.send(packet);
        let mut arrivals = Vec::new();
        while let Some(at) = network.next_arrival() {
            arrivals.extend(network.receive(receiver, at).iter().map(|copy| (copy.cycle, at)));
        }
        self.free_at = std::mem::take(&mut network.free_at);
        arrivals
    }

    /// Duration of a tick in seconds.
    pub fn tick_s(&self) -> f64 {
        self.world.network.as_ref().map_or(0.0, |network| network.latency_s)
    }
}

impl AirspaceWorld {
    /// Returns the tick in which the talks of a cycle start, where all agree on it.
    pub fn first_tick(&self, cycle: Cycle) -> u64 {
        Schedule::of_cycle(cycle, self.network.as_ref()).begins
    }
}
