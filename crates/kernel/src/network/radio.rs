//! The budget of a radio channel that all agents share, and the packets of an agent that wait for their turn on it.
//!
//! Each agent has an equal share of the channel, as with fixed time slots, so that no agent needs to know what the others
//! send. A packet to many is sent once. Packets leave in the order in which they were written, one after the other, each in
//! the time that its bytes take at the share's rate. One that could not be sent before its conversation ends is
//! not sent at all, and takes no time from those after it. So in any span of time all agents together send at most the
//! budget times the span.

use super::agent::OutgoingPacket;
use super::{HEADER_BYTES, Network};
use std::collections::VecDeque;

/// Size in bytes of the signature (Ed25519) of a packet on the air: what is broadcast names its sender, and must prove it.
pub const SIGNATURE_BYTES: usize = 64;

/// The bytes that a radio channel carries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadioBudget {
    /// Bytes per second of all agents together, headers and signatures included.
    pub bytes_s: f64,
    /// Number of agents that share the channel.
    pub senders: u32,
}

impl RadioBudget {
    /// Returns the bytes per second that each agent may send.
    pub fn share_bytes_s(&self) -> f64 {
        self.bytes_s / f64::from(self.senders.max(1))
    }

    /// Returns the smallest budget in bytes per second with which so many agents can each send a packet without content
    /// in `deadline_s` seconds.
    pub fn min_bytes_s(senders: u32, deadline_s: f64) -> f64 {
        f64::from(senders) * (HEADER_BYTES + SIGNATURE_BYTES) as f64 / deadline_s
    }
}

/// What becomes of a packet that an agent has written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PacketAdmission {
    /// Its sending starts at once.
    Sent,
    /// Its sending starts when all earlier packets of the agent are sent.
    Deferred,
    /// It is not sent: its conversation would be over before.
    Dropped,
}

/// One agent's share of a channel.
#[derive(Debug, Clone, Copy)]
struct RadioShare {
    bytes_per_tick: f64,
    /// Tick, with its fraction, from which on the agent may send the next packet.
    free_at: f64,
}

impl RadioShare {
    /// Returns what becomes of a packet of so many bytes, and the tick by which all of it is sent.
    fn admit(&mut self, bytes: usize, tick: u64, end_tick: u64) -> (PacketAdmission, u64) {
        let start = self.free_at.max(tick as f64);
        let end = start + (bytes + SIGNATURE_BYTES) as f64 / self.bytes_per_tick;
        // The conversion saturates: an end beyond all ticks is after any conversation.
        let sent_by = end.ceil() as u64;
        // A packet arrives one tick later at the earliest, and the receiver hears nothing from the last tick on.
        if sent_by.saturating_add(1) >= end_tick {
            return (PacketAdmission::Dropped, tick);
        }
        self.free_at = end;
        let admission =
            if start > tick as f64 { PacketAdmission::Deferred } else { PacketAdmission::Sent };
        (admission, sent_by)
    }
}

/// The packets that an agent has written: at once ready for the network, unless a radio's budget spaces them out.
#[derive(Debug, Default)]
pub struct PacketOutbox {
    ready: Vec<OutgoingPacket>,
    radio: Option<RadioShare>,
    /// Packets on their way to the air, each with the tick by which all of it is sent, rising.
    waiting: VecDeque<(u64, OutgoingPacket)>,
}

impl PacketOutbox {
    /// Returns the empty outbox of an agent on a network.
    pub fn for_network(network: Option<&Network>) -> Self {
        let radio = network.and_then(|network| {
            let bytes_per_tick = network.budget?.share_bytes_s() * network.latency_s;
            Some(RadioShare { bytes_per_tick, free_at: 0.0 })
        });
        Self { radio, ..Self::default() }
    }

    /// Adds a packet that is written in a tick, of a conversation that ends with `end_tick`.
    pub fn push(&mut self, packet: OutgoingPacket, tick: u64, end_tick: u64) -> PacketAdmission {
        let Some(radio) = &mut self.radio else {
            self.ready.push(packet);
            return PacketAdmission::Sent;
        };
        let (admission, sent_by) = radio.admit(packet.payload.len(), tick, end_tick);
        if admission != PacketAdmission::Dropped {
            self.waiting.push_back((sent_by, packet));
        }
        admission
    }

    /// Makes those packets ready that are sent by a tick.
    pub fn release(&mut self, tick: u64) {
        let due = self.waiting.partition_point(|(sent_by, _)| *sent_by <= tick);
        self.ready.extend(self.waiting.drain(..due).map(|(_, packet)| packet));
    }

    /// Returns the tick in which the next packet is sent, if one waits.
    pub fn next_due(&self) -> Option<u64> {
        self.waiting.front().map(|(sent_by, _)| *sent_by)
    }

    /// Takes out the packets that are ready.
    pub fn take_ready(&mut self) -> Vec<OutgoingPacket> {
        std::mem::take(&mut self.ready)
    }

    /// Forgets packets that wait: their conversations are over.
    pub fn clear_waiting(&mut self) {
        self.waiting.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::sync::Arc;

    fn packet(sequence: u32, bytes: usize) -> OutgoingPacket {
        OutgoingPacket { to: Arc::from([1, 2, 3]), sequence, payload: vec![0; bytes] }
    }

    fn outbox(bytes_per_tick: f64) -> PacketOutbox {
        let radio = Some(RadioShare { bytes_per_tick, free_at: 0.0 });
        PacketOutbox { radio, ..PacketOutbox::default() }
    }

    #[test]
    fn without_a_budget_every_packet_is_ready_at_once() {
        let mut outbox = PacketOutbox::for_network(None);
        assert_eq!(outbox.push(packet(0, 1_000_000), 5, 6), PacketAdmission::Sent);
        assert_eq!((outbox.take_ready().len(), outbox.next_due()), (1, None));
    }

    #[test]
    fn a_packet_to_many_counts_once_with_its_signature_and_the_next_one_waits_for_it() {
        let mut outbox = outbox(10.0);
        assert_eq!(outbox.push(packet(0, 36), 100, 1000), PacketAdmission::Sent);
        assert_eq!(outbox.push(packet(1, 36), 100, 1000), PacketAdmission::Deferred);
        assert_eq!(outbox.next_due(), Some(110));
        outbox.release(119);
        assert_eq!(outbox.take_ready(), [packet(0, 36)]);
        outbox.release(120);
        assert_eq!(outbox.take_ready(), [packet(1, 36)]);
    }

    #[test]
    fn a_packet_that_would_come_too_late_is_dropped_and_takes_no_time_from_the_next() {
        let mut outbox = outbox(10.0);
        assert_eq!(outbox.push(packet(0, 10_000), 0, 100), PacketAdmission::Dropped);
        assert_eq!(outbox.push(packet(1, 36), 0, 100), PacketAdmission::Sent);
        assert_eq!(outbox.next_due(), Some(10));
    }

    #[test]
    fn shares_of_all_agents_add_up_to_the_budget() {
        let budget = RadioBudget { bytes_s: 3937.0, senders: 50 };
        assert!((50.0 * budget.share_bytes_s() - 3937.0).abs() < 1e-9);
        assert!((RadioBudget::min_bytes_s(50, 2.25) - 2400.0).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn no_span_of_time_holds_more_than_its_bytes_and_no_packet_is_lost_silently(
            bytes_per_tick in 0.05..50.0f64,
            writes in prop::collection::vec((0u64..40, 0usize..600), 1..60),
        ) {
            const END: u64 = 1500;
            let mut outbox = outbox(bytes_per_tick);
            let (mut tick, mut sent, mut dropped, mut on_air) = (0, 0, 0, Vec::new());
            for (k, (wait, bytes)) in writes.iter().enumerate() {
                tick += wait;
                let number = k as u32;
                match outbox.push(packet(number, *bytes), tick, END) {
                    PacketAdmission::Dropped => dropped += 1,
                    PacketAdmission::Sent | PacketAdmission::Deferred => {
                        let end = outbox.radio.expect("a share").free_at;
                        let size = (bytes + SIGNATURE_BYTES) as f64;
                        on_air.push((end - size / bytes_per_tick, end));
                        sent += 1;
                    }
                }
            }
            // Packets on the air never overlap, each at the rate of the share: so no span holds more than that rate.
            for pair in on_air.windows(2) {
                prop_assert!(pair[0].1 <= pair[1].0 + 1e-6, "{pair:?}");
            }
            outbox.release(END);
            let ready = outbox.take_ready();
            prop_assert_eq!((ready.len(), sent + dropped), (sent, writes.len()));
            prop_assert!(ready.is_sorted_by_key(|one| one.sequence));
            prop_assert!(on_air.iter().all(|(_, end)| *end < END as f64));
        }
    }
}
