//! A network with faults: it can lose and delay messages, cut links, and have a limited range.
//!
//! A message takes one tick, or more when it is large or delayed. Every draw depends on sender, receiver,
//! tick and sequence number, never on the order in which agents are visited.

use super::Network;
use super::links::FaultStreams;
use crate::distr::Bernoulli;
use crate::ports::{Envelope, MemoryTransport, Transport};
use crate::units::{Cycle, EntityId};
use std::collections::BTreeMap;

/// Distances between agents at the start of a cycle, for the range of radios.
pub trait DistanceLookup {
    /// Returns the distance between two agents in meters.
    fn distance_m(&self, link: [EntityId; 2]) -> f64;
}

/// A transport for the conversations of one cycle, on which some links may be cut. A cycle of the world has many ticks
/// of the network: a tick is the [`Envelope::cycle`] of the transport inside.
pub struct FaultyTransport<'a, T> {
    inner: T,
    network: Option<&'a Network>,
    streams: FaultStreams,
    /// Without them, every agent reaches every other.
    distances: Option<&'a dyn DistanceLookup>,
    /// First tick of each conversation, and its time in seconds after the start of the run, both rising.
    conversations: &'a [(u64, f64)],
    /// Tick from which on each direction of a link is free, where messages take time by their size.
    pub(super) free_at: BTreeMap<[EntityId; 2], f64>,
}

impl<'a> FaultyTransport<'a, MemoryTransport> {
    /// Returns a network in memory with some faults; without any it loses nothing. The conversations of the cycle, at least
    /// one, are given by their first ticks and the times of those in seconds after the start of the run.
    pub fn in_memory(
        network: Option<&'a Network>,
        streams: FaultStreams,
        distances: Option<&'a dyn DistanceLookup>,
        conversations: &'a [(u64, f64)],
    ) -> Self {
        let faults = network.map(Network::faults).unwrap_or_default();
        let inner = MemoryTransport::new(streams.streams, streams.network, faults);
        Self { inner, network, streams, distances, conversations, free_at: BTreeMap::new() }
    }
}

impl<T: Transport> FaultyTransport<'_, T> {
    /// Returns the time of a tick, in seconds after the start of the run.
    fn time_s(&self, network: &Network, tick: u64) -> f64 {
        let started = self.conversations.partition_point(|(first, _)| *first <= tick);
        let (first_tick, start_s) = self.conversations[started.saturating_sub(1)];
        start_s + network.ticks_to_s(tick.saturating_sub(first_tick))
    }

    /// Returns whether the link of a message lets it through: it is not cut, within range, and not
    /// in a burst that destroys the message.
    fn can_pass(&self, envelope: &Envelope) -> bool {
        let Some(network) = self.network else { return true };
        let &Envelope { cycle: tick, sender, receiver, sequence, .. } = envelope;
        let link = [sender, receiver];
        let at_s = self.time_s(network, tick);
        let distance_m = self.distances.map_or(0.0, |distances| distances.distance_m(link));
        if !network.can_carry(link, at_s) || distance_m > network.range_m {
            return false;
        }
        let Some(bursts) = &network.bursts else { return true };
        let FaultStreams { streams, burst_loss, .. } = self.streams;
        let words = streams.words_for_pair(sender, receiver, tick, burst_loss, sequence);
        // The message's own draw comes first: it is one block, and the state of the link may take several.
        let is_lost = Bernoulli::new(bursts.loss).sample(words[0])
            && bursts.is_in_burst(&self.streams, link, at_s);
        !is_lost
    }

    /// Returns the tick by which all of a message is sent: its link carries one message after the other.
    fn departure_tick(&mut self, envelope: &Envelope) -> u64 {
        let bits_per_tick = self.network.map_or(f64::INFINITY, Network::bits_per_tick);
        if bits_per_tick == f64::INFINITY {
            return envelope.cycle;
        }
        let free_at = self.free_at.entry([envelope.sender, envelope.receiver]).or_default();
        let bits = 8.0 * envelope.payload.len() as f64;
        *free_at = free_at.max(envelope.cycle as f64) + bits / bits_per_tick;
        // The tick in which the last bit is sent; the transport inside adds the latency of one tick.
        free_at.floor() as u64
    }
}

impl<T: Transport> Transport for FaultyTransport<'_, T> {
    fn send(&mut self, mut envelope: Envelope) {
        let is_carried = self.can_pass(&envelope);
        // A message that is lost occupies the link all the same.
        envelope.cycle = self.departure_tick(&envelope);
        if is_carried {
            self.inner.send(envelope);
        }
    }

    fn receive(&mut self, receiver: EntityId, now: Cycle) -> Vec<Envelope> {
        self.inner.receive(receiver, now)
    }

    fn next_arrival(&self) -> Option<Cycle> {
        self.inner.next_arrival()
    }
}
