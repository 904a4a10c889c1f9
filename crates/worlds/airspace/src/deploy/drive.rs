//! Stations on a network, driven until all are done.
//!
//! Time passes in ticks. A station does what is due when a packet comes or its time has come; all that happens
//! between is skipped.

use crate::agents::packet::Packet;
use crate::pilot::Pilot;
use sidestep_kernel::ports::{Envelope, Transport};
use sidestep_kernel::{EntityId, interrupt};

/// A program aboard an airplane, on a network that carries its packets.
pub(super) trait Station {
    /// Its airplane.
    fn id(&self) -> EntityId;

    /// Those that it talks with, itself among them.
    fn group(&self) -> &[EntityId];

    /// Takes a packet.
    fn on_packet(&mut self, from: EntityId, bytes: &[u8], tick: u64);

    /// Does what is due by a tick.
    fn on_timer(&mut self, tick: u64);

    /// Returns the tick in which something is due.
    fn next_timer(&self) -> Option<u64>;

    /// Takes out the packets that wait to be sent.
    fn take_packets(&mut self) -> Vec<Packet>;
}

impl Station for Pilot {
    fn id(&self) -> EntityId {
        Pilot::id(self)
    }

    fn group(&self) -> &[EntityId] {
        Pilot::group(self)
    }

    fn on_packet(&mut self, from: EntityId, bytes: &[u8], tick: u64) {
        Pilot::on_packet(self, from, bytes, tick);
    }

    fn on_timer(&mut self, tick: u64) {
        Pilot::on_timer(self, tick);
    }

    fn next_timer(&self) -> Option<u64> {
        Pilot::next_timer(self)
    }

    fn take_packets(&mut self) -> Vec<Packet> {
        Pilot::take_packets(self)
    }
}

/// Drives stations, which have started in tick `begin`, until all are done, or nothing can happen any more.
pub(super) fn drive<S: Station>(
    transport: &mut impl Transport,
    stations: &mut [S],
    begin: u64,
    is_done: impl Fn(&S) -> bool,
) {
    stations.iter_mut().for_each(|station| send(transport, station, begin));
    while !stations.iter().all(&is_done) {
        interrupt::look();
        let timers = stations.iter().filter_map(Station::next_timer);
        let next = timers.chain(transport.next_arrival()).min();
        // A time that never comes is none.
        let Some(now) = next.filter(|now| *now < u64::MAX) else { return };
        stations.iter_mut().for_each(|station| step(transport, station, now));
    }
}

/// Hands a station the packets that have reached it by a tick, and sends what it answers.
fn step<S: Station>(transport: &mut impl Transport, station: &mut S, now: u64) {
    for Envelope { sender, payload, .. } in transport.receive(station.id(), now) {
        station.on_packet(sender, &payload, now);
        send(transport, station, now);
    }
    station.on_timer(now);
    send(transport, station, now);
}

/// Sends what waits to be sent.
fn send<S: Station>(transport: &mut impl Transport, station: &mut S, now: u64) {
    let sender = station.id();
    for Packet { to, sequence, payload } in station.take_packets() {
        let mut to_one = |receiver: EntityId, payload: Vec<u8>| {
            transport.send(Envelope { cycle: now, sender, sequence, receiver, payload });
        };
        match to {
            Some(receiver) => to_one(receiver, payload),
            None => {
                let others = station.group().iter().filter(|&&id| id != sender);
                others.for_each(|&receiver| to_one(receiver, payload.clone()));
            }
        }
    }
}
