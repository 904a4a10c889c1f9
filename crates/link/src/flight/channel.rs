//! Messages of one party of a flight to and from the others, with the faults of the scenario's network.

use super::message::{FlightContent, FlightMessage};
use super::time::{ClockDifference, WallClock};
use crate::agent::{ChannelModel, PacketInTransit};
use crate::protocol::{Incarnation, TransportFrame};
use crate::wire::{PeerId, Wire};
use sidestep::kernel::{Cycle, EntityId};
use std::collections::BTreeMap;
use std::hash::{BuildHasher, RandomState};
use std::time::{Duration, Instant};

/// Most frames that wait for their delay to be over; further ones are lost.
const MAX_DELAYED: usize = 100_000;

/// Reasons for which messages are dropped or do not count.
mod reason {
    /// It cannot be read.
    pub(super) const UNREADABLE: &str = "unreadable";
    /// It is of another scenario or build.
    pub(super) const OTHER_FLIGHT: &str = "other-flight";
    /// It is of a flight that starts at another time.
    pub(super) const OTHER_START: &str = "other-start";
    /// Its sender is not who it says, or is this party itself.
    pub(super) const FORGED: &str = "forged";
    /// The clocks differ by more than the tolerance.
    pub(super) const CLOCK: &str = "clock";
}

/// A message that has come.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceivedContent {
    /// Its sender.
    pub from: PeerId,
    /// The sender's process.
    pub incarnation: Incarnation,
    /// When cycle 0 begins, as far as the sender knows.
    pub start_s: Option<f64>,
    /// Whether the sender's clock is within the tolerance.
    pub is_in_time: bool,
    /// What it says.
    pub content: FlightContent,
}

/// How a party takes part in a flight.
#[derive(Debug, Clone, Copy)]
pub struct ChannelConfig {
    /// The party.
    pub me: PeerId,
    /// The number of the flight.
    pub flight: u64,
    /// Seconds by which the clocks of two parties may differ.
    pub tolerance_s: f64,
    /// Seconds of the scenario in a second.
    pub speed: f64,
}

/// A party's messages to and from all others.
pub struct FlightChannel {
    config: ChannelConfig,
    incarnation: Incarnation,
    next_number: u64,
    wire: Box<dyn Wire>,
    clock: WallClock,
    start_s: Option<f64>,
    /// The faults of the scenario's network; none of the recorder, which is not on the radio.
    faults: Option<Box<dyn ChannelModel>>,
    /// The tick for which the faults of the present cycle are drawn, and the number of the next packet in it.
    tick: u64,
    sequence: u32,
    /// Frames that leave later, by time and number.
    delayed: BTreeMap<(Instant, u64), (PeerId, Vec<u8>)>,
    differences: BTreeMap<(PeerId, Incarnation), ClockDifference>,
    counts: BTreeMap<&'static str, u64>,
    sent: (u64, u64),
}

impl FlightChannel {
    /// Returns the channel of a party over a wire.
    pub fn new(
        config: ChannelConfig,
        wire: Box<dyn Wire>,
        clock: WallClock,
        faults: Option<Box<dyn ChannelModel>>,
    ) -> Self {
        Self {
            config,
            incarnation: Incarnation(RandomState::new().hash_one(std::process::id())),
            next_number: 0,
            wire,
            clock,
            start_s: None,
            faults,
            tick: 0,
            sequence: 0,
            delayed: BTreeMap::new(),
            differences: BTreeMap::new(),
            counts: BTreeMap::new(),
            sent: (0, 0),
        }
    }

    /// Returns the clock of the party.
    pub fn clock(&self) -> WallClock {
        self.clock
    }

    /// Says when cycle 0 begins: messages that say otherwise are dropped from now on.
    pub fn set_start(&mut self, start_s: f64) {
        self.start_s = Some(start_s);
    }

    /// Starts a cycle, whose faults are drawn for a tick.
    pub fn start_cycle(&mut self, cycle: Cycle, tick: u64) {
        if let Some(faults) = &mut self.faults {
            faults.start_cycle(cycle);
        }
        self.tick = tick;
        self.sequence = 0;
    }

    /// Returns what was counted, by name.
    pub fn counts(&self) -> Vec<(String, u64)> {
        self.counts.iter().map(|(&name, &count)| (name.to_string(), count)).collect()
    }

    /// Returns the numbers of frames and bytes that were sent over the radio.
    pub fn sent(&self) -> (u64, u64) {
        self.sent
    }

    /// Returns by how many seconds the clock of another party seems to be behind this one's.
    pub fn behind_s(&self, peer: PeerId) -> Option<f64> {
        let newest = self.differences.iter().rfind(|((other, _), _)| *other == peer);
        newest.and_then(|(_, difference)| difference.behind_s())
    }

    fn count(&mut self, reason: &'static str) {
        *self.counts.entry(reason).or_default() += 1;
    }

    /// Sends a message that no fault of the scenario concerns.
    pub fn send(&mut self, to: &[PeerId], content: FlightContent) {
        let frame = self.frame(content);
        for &peer in to {
            self.wire.send(&[peer], &frame);
        }
    }

    /// Sends a message over the radio to some nodes: it may be lost, delayed or doubled.
    pub fn broadcast(&mut self, to: &[EntityId], content: FlightContent) {
        let frame = self.frame(content);
        let sequence = self.sequence;
        self.sequence += 1;
        for &node in to {
            self.sent.0 += 1;
            self.sent.1 += frame.len() as u64;
            let packet =
                PacketInTransit { to: node, tick: self.tick, sequence, bytes: frame.len() };
            for delay in self.delays(&packet) {
                self.schedule(PeerId::Node(node), frame.clone(), delay);
            }
        }
    }

    /// Returns the delays with which a packet arrives, beyond what the real network takes: none if it is lost.
    fn delays(&mut self, packet: &PacketInTransit) -> Vec<Duration> {
        let Some(faults) = &mut self.faults else { return vec![Duration::ZERO] };
        let tick_s = faults.tick_s() / self.config.speed;
        let arrivals = faults.arrivals(packet).into_iter();
        // One tick of delay is what the real network takes.
        arrivals
            .map(|timing| {
                let ticks = timing.arrives.saturating_sub(packet.tick + 1);
                Duration::try_from_secs_f64(ticks as f64 * tick_s).unwrap_or_default()
            })
            .collect()
    }

    fn schedule(&mut self, to: PeerId, frame: Vec<u8>, delay: Duration) {
        if delay.is_zero() {
            self.wire.send(&[to], &frame);
        } else if self.delayed.len() < MAX_DELAYED {
            let number = self.next_number;
            self.next_number += 1;
            self.delayed.insert((Instant::now() + delay, number), (to, frame));
        }
    }

    fn frame(&mut self, content: FlightContent) -> Vec<u8> {
        let number = self.next_number;
        self.next_number += 1;
        let message = FlightMessage {
            flight: self.config.flight,
            start_s: self.start_s,
            sent_s: self.clock.now_s(),
            content,
        };
        let from = self.config.me;
        let incarnation = self.incarnation;
        let to = Vec::new();
        TransportFrame { from, incarnation, number, to, message: Some(message) }.encode()
    }

    /// Returns the next message that comes within some time, if any. Frames that are due leave meanwhile.
    pub fn receive(&mut self, within: Duration) -> Option<ReceivedContent> {
        let until = Instant::now() + within;
        loop {
            let wake_at = self.release().map_or(until, |due| due.min(until));
            let wait = wake_at.saturating_duration_since(Instant::now());
            let frame = self.wire.receive(wait);
            for _ in 0..self.wire.take_forged() {
                self.count(reason::FORGED);
            }
            if let Some(received) = frame.and_then(|frame| self.read(&frame)) {
                return Some(received);
            }
            if Instant::now() >= until {
                self.release();
                return None;
            }
        }
    }

    /// Sends the frames whose delay is over. Returns when the next one is due.
    fn release(&mut self) -> Option<Instant> {
        let now = Instant::now();
        while let Some(entry) = self.delayed.first_entry() {
            let due = entry.key().0;
            if due > now {
                return Some(due);
            }
            let waited = entry.remove();
            self.wire.send(&[waited.0], &waited.1);
        }
        None
    }

    fn read(&mut self, frame: &[u8]) -> Option<ReceivedContent> {
        let received_s = self.clock.now_s();
        let Ok(frame) = TransportFrame::<FlightMessage>::read(frame) else {
            self.count(reason::UNREADABLE);
            return None;
        };
        let TransportFrame { from, incarnation, message: Some(message), .. } = frame else {
            self.count(reason::UNREADABLE);
            return None;
        };
        if from == self.config.me {
            self.count(reason::FORGED);
            return None;
        }
        if message.flight != self.config.flight {
            self.count(reason::OTHER_FLIGHT);
            return None;
        }
        let is_other_start = self.start_s.zip(message.start_s).is_some_and(|(own, its)| own != its);
        if is_other_start {
            self.count(reason::OTHER_START);
            return None;
        }
        let difference = self.differences.entry((from, incarnation)).or_default();
        difference.add(message.sent_s, received_s);
        let is_in_time = !difference.is_beyond(self.config.tolerance_s);
        if !is_in_time {
            self.count(reason::CLOCK);
        }
        let FlightMessage { start_s, content, .. } = message;
        Some(ReceivedContent { from, incarnation, start_s, is_in_time, content })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agent::PacketTiming;
    use crate::flight::message::Presence;
    use crate::wire::memory::MemoryHub;

    /// Loses all to an even node, and delays and doubles all to an odd one.
    struct TestFaults;

    impl ChannelModel for TestFaults {
        fn arrivals(&mut self, packet: &PacketInTransit) -> Vec<PacketTiming> {
            let arrives = packet.tick + 11;
            let timing = PacketTiming { departs: packet.tick, arrives };
            if packet.to.is_multiple_of(2) { Vec::new() } else { vec![timing; 2] }
        }

        fn tick_s(&self) -> f64 {
            0.001
        }

        fn start_cycle(&mut self, _: Cycle) {}
    }

    fn channel(hub: &MemoryHub, me: PeerId, flight: u64) -> FlightChannel {
        let config = ChannelConfig { me, flight, tolerance_s: 0.5, speed: 1.0 };
        let wire = Box::new(hub.open_wire(me));
        FlightChannel::new(config, wire, WallClock::system(), Some(Box::new(TestFaults)))
    }

    fn content() -> FlightContent {
        FlightContent::Presence(Presence { is_ready: true, process: 7 })
    }

    const LONG: Duration = Duration::from_secs(60);

    #[test]
    fn the_faults_of_the_scenario_happen_to_what_is_broadcast_and_to_nothing_else() {
        let hub = MemoryHub::default();
        let mut sender = channel(&hub, PeerId::Node(0), 5);
        let mut odd = channel(&hub, PeerId::Node(1), 5);
        let mut even = channel(&hub, PeerId::Node(2), 5);
        sender.broadcast(&[1, 2], content());
        assert_eq!(odd.receive(Duration::ZERO), None, "it is delayed");
        // The sender releases it while it listens.
        assert_eq!(sender.receive(Duration::from_millis(50)), None);
        for _ in 0..2 {
            let received = odd.receive(LONG).expect("it comes twice");
            assert_eq!((received.from, received.content), (PeerId::Node(0), content()));
        }
        assert_eq!((odd.receive(Duration::ZERO), even.receive(Duration::ZERO)), (None, None));
        sender.send(&[PeerId::Node(2)], content());
        assert!(even.receive(LONG).is_some());
        assert_eq!(sender.sent().0, 2);
    }

    #[test]
    fn what_is_of_no_such_flight_is_dropped_and_counted() {
        let hub = MemoryHub::default();
        let mut receiver = channel(&hub, PeerId::Node(0), 5);
        let to = [PeerId::Node(0)];
        channel(&hub, PeerId::Node(1), 6).send(&to, content());
        let mut later = channel(&hub, PeerId::Node(2), 5);
        later.set_start(10.0);
        receiver.set_start(20.0);
        later.send(&to, content());
        hub.open_wire(PeerId::Node(3)).send(&to, b"nothing that is known");
        channel(&hub, PeerId::Node(4), 5).send(&to, content());
        let received = receiver.receive(LONG).expect("the last one is good");
        assert_eq!(received.from, PeerId::Node(4));
        let names: Vec<String> = receiver.counts().into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["other-flight", "other-start", "unreadable"]);
        // A frame in its own name is of somebody else.
        let wire = hub.open_wire(PeerId::Server);
        let config = ChannelConfig { me: PeerId::Node(0), flight: 5, tolerance_s: 1.0, speed: 1.0 };
        let mut liar = FlightChannel::new(config, Box::new(wire), WallClock::system(), None);
        liar.send(&to, content());
        assert_eq!(receiver.receive(Duration::from_millis(5)), None);
        assert!(receiver.counts().contains(&("forged".to_string(), 1)));
    }
}
