//! A network with the faults of a scenario: it can lose and delay messages, cut links, and reach no farther
//! than some way.
//!
//! A message takes one tick, or more when it is large or delayed. Every draw depends on sender, receiver
//! and tick, never on the order in which stations are visited.

use crate::agents::network::Network;
use crate::pilot::Schedule;
use crate::purpose;
use crate::state::AirspaceState;
use crate::world::AirspaceWorld;
use sidestep_kernel::distr::Chance;
use sidestep_kernel::ports::{Envelope, Transport};
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{Cycle, EntityId};
use std::collections::BTreeMap;

/// A transport, some of whose links may be cut, for the talks of one cycle.
#[derive(Debug)]
pub(super) struct Faulty<'a, T> {
    inner: T,
    network: Option<&'a Network>,
    streams: Streams,
    /// Places of the airplanes; without them, all reach all.
    state: Option<&'a AirspaceState>,
    schedule: Schedule,
    /// Start of the cycle, in seconds after the start of the run.
    starts_s: f64,
    /// Tick from which on each way of a link is free, where messages of some size take time.
    pub(super) free_at: BTreeMap<[EntityId; 2], f64>,
}

impl<'a, T: Transport> Faulty<'a, T> {
    /// Returns a network for the talks of a cycle over another one, which adds its own faults.
    pub(super) fn new(
        inner: T,
        world: &'a AirspaceWorld,
        state: Option<&'a AirspaceState>,
        (now, schedule): (Cycle, Schedule),
    ) -> Self {
        let faults = (world.network.as_ref(), world.streams);
        Self::with(inner, faults, state, (world.starts_s(now), schedule))
    }

    /// Returns the same with some faults, in a cycle that starts `starts_s` seconds after the start of the run.
    pub(super) fn with(
        inner: T,
        (network, streams): (Option<&'a Network>, Streams),
        state: Option<&'a AirspaceState>,
        (starts_s, schedule): (f64, Schedule),
    ) -> Self {
        Self { inner, network, streams, state, schedule, starts_s, free_at: BTreeMap::new() }
    }

    /// Returns the time of a tick, in seconds after the start of the run: the first talk starts with the
    /// cycle, and the shield's exchange when that has to be over.
    fn time_s(&self, network: &Network, tick: u64) -> f64 {
        let Schedule { begins, shield_from, .. } = self.schedule;
        match tick.checked_sub(shield_from) {
            Some(ticks) => self.starts_s + network.deadline_s + network.seconds(ticks),
            None => self.starts_s + network.seconds(tick - begins),
        }
    }

    /// Returns whether the link of a message lets it through: it is not cut, within range, and not
    /// in a burst that takes the message.
    fn lets_through(&self, envelope: &Envelope) -> bool {
        let Some(network) = self.network else { return true };
        let &Envelope { cycle: tick, sender, receiver, sequence, .. } = envelope;
        let (link, at_s) = ([sender, receiver], self.time_s(network, tick));
        let apart_m = self.state.map_or(0.0, |state| state.apart_m(link));
        if !network.carries(link, at_s) || apart_m > network.range_m {
            return false;
        }
        let Some(bursts) = &network.bursts else { return true };
        let words = self.streams.pair(sender, receiver, tick, purpose::BURST_LOSS, sequence);
        !(Chance::new(bursts.loss).happens(words[0]) && bursts.is_on(&self.streams, link, at_s))
    }

    /// Returns the tick in which all of a message is on its way: its link carries one after the
    /// other.
    fn is_out_at(&mut self, envelope: &Envelope) -> u64 {
        let bits_per_tick = self.network.map_or(f64::INFINITY, Network::bits_per_tick);
        if bits_per_tick == f64::INFINITY {
            return envelope.cycle;
        }
        let free_at = self.free_at.entry([envelope.sender, envelope.receiver]).or_default();
        let bits = 8.0 * envelope.payload.len() as f64;
        *free_at = free_at.max(envelope.cycle as f64) + bits / bits_per_tick;
        free_at.floor() as u64
    }
}

impl<T: Transport> Transport for Faulty<'_, T> {
    fn send(&mut self, mut envelope: Envelope) {
        let is_carried = self.lets_through(&envelope);
        // What is lost on the way takes its time on the link all the same.
        envelope.cycle = self.is_out_at(&envelope);
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
