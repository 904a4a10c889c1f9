//! One cycle of an agent at its node: packets out and in, until its control is ready.

use crate::agent::{AgentProgram, Arrival, Channel, OutgoingPacket, Transmission};
use crate::messenger::Messenger;
use crate::protocol::{
    AdvanceDone, AdvanceGrant, ClockMode, Control, CycleStart, Message, Packet, PacketRecord,
};
use crate::wire::Peer;
use sidestep::kernel::{Cycle, EntityId};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// The course of time within a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
enum TimeMode {
    /// None passes: packets arrive as they come, and none is requested again.
    Untimed,
    /// Ticks that the server counts.
    Counted,
    /// A clock that runs this many times as fast as the real one.
    Running(f64),
}

/// The two ends of a turn: the agent's program, and the links to others.
pub(super) struct AgentIo<'a> {
    pub(super) program: &'a mut dyn AgentProgram,
    pub(super) channel: Option<&'a mut (dyn Channel + 'static)>,
    pub(super) mail: &'a mut Messenger,
}

/// A cycle of an agent.
pub(super) struct AgentCycle {
    begin: CycleStart,
    time: TimeMode,
    began: Instant,
    first_tick: u64,
    /// Tick of the last step.
    tick: u64,
    /// Duration of a tick, in seconds of the scenario.
    tick_s: f64,
    /// Number of its next packet.
    sequence: u32,
    /// Packets that have come, by the tick of their arrival.
    arrived: BTreeMap<u64, Vec<(EntityId, Packet)>>,
    /// Number of packets that the program has taken.
    taken: u64,
    /// The tick that it may go on to.
    granted: Option<AdvanceGrant>,
    /// Delayed packets, by the time at which they leave, and in their order.
    leaving: BTreeMap<(Instant, EntityId, u32), Packet>,
    /// Packets that leave at the end of the step, by receiver.
    outgoing: BTreeMap<EntityId, Vec<Packet>>,
    has_begun: bool,
    is_closed: bool,
    has_told: bool,
    sent: TrafficCounters,
    /// Packets that it has sent, where all are recorded.
    log: Option<Vec<PacketRecord>>,
}

/// Packets and their bytes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TrafficCounters {
    pub(super) packets: u64,
    pub(super) bytes: u64,
}

impl AgentCycle {
    /// Returns the turn that begins now; `tick_s` is the duration of a tick of the network, if there is one.
    pub(super) fn new(
        begin: CycleStart,
        clock: ClockMode,
        tick_s: Option<f64>,
        first_tick: u64,
    ) -> Self {
        let time = match clock {
            ClockMode::Lockstep if tick_s.is_some() => TimeMode::Counted,
            ClockMode::Lockstep => TimeMode::Untimed,
            ClockMode::Realtime { speed } => TimeMode::Running(speed),
        };
        Self {
            begin,
            time,
            began: Instant::now(),
            first_tick,
            tick: first_tick,
            tick_s: tick_s.unwrap_or(1e-3),
            sequence: 0,
            arrived: BTreeMap::new(),
            taken: 0,
            granted: None,
            leaving: BTreeMap::new(),
            outgoing: BTreeMap::new(),
            has_begun: false,
            is_closed: false,
            has_told: false,
            sent: TrafficCounters::default(),
            log: None,
        }
    }

    /// Returns the turn, set to keep a log of its packets.
    pub(super) fn with_log(self) -> Self {
        Self { log: Some(Vec::new()), ..self }
    }

    /// Hands over the packets sent since the last call.
    pub(super) fn send_log(&mut self, mail: &mut Messenger) {
        if let Some(log) = self.log.as_mut().filter(|log| !log.is_empty()) {
            mail.send_reliable(Peer::Server, Message::Log(std::mem::take(log)));
        }
    }

    pub(super) fn cycle(&self) -> Cycle {
        self.begin.cycle
    }

    /// Takes the count of packets and bytes sent since the last call.
    pub(super) fn take_sent(&mut self) -> TrafficCounters {
        std::mem::take(&mut self.sent)
    }

    pub(super) fn on_grant(&mut self, tick: AdvanceGrant) {
        self.granted = Some(tick).filter(|tick| tick.cycle == self.begin.cycle).or(self.granted);
    }

    pub(super) fn close(&mut self) {
        self.is_closed = true;
    }

    pub(super) fn on_packet(&mut self, from: EntityId, packet: Packet) {
        // Where time is not counted, a packet arrives when it comes.
        let arrives = if self.time == TimeMode::Counted { packet.arrives } else { 0 };
        self.arrived.entry(arrives).or_default().push((from, packet));
    }

    /// Returns the time that the node may wait, unless something comes; none if that may be forever.
    pub(super) fn max_wait(&self, program: &dyn AgentProgram) -> Option<Duration> {
        let TimeMode::Running(speed) = self.time else { return None };
        let leaves = self.leaving.keys().next().map(|&(at, ..)| at);
        let timer = program.next_timer().and_then(|tick| self.instant_of(tick, speed));
        let next = leaves.into_iter().chain(timer).min()?;
        Some(next.saturating_duration_since(Instant::now()))
    }

    /// Returns the time of a tick, if a clock gets there.
    fn instant_of(&self, tick: u64, speed: f64) -> Option<Instant> {
        let ticks = tick.saturating_sub(self.first_tick) as f64;
        let wait = Duration::try_from_secs_f64(ticks * self.tick_s / speed).ok()?;
        self.began.checked_add(wait)
    }

    fn current_tick(&self, speed: f64) -> u64 {
        let passed_s = self.began.elapsed().as_secs_f64() * speed;
        // A little more, so that a wait for a tick ends with the tick reached.
        self.first_tick + (passed_s / self.tick_s + 1e-6) as u64
    }

    /// Does everything that can be done now.
    pub(super) fn advance(&mut self, ends: &mut AgentIo<'_>) {
        match self.time {
            TimeMode::Untimed => drop(self.step(u64::MAX, ends)),
            TimeMode::Counted => self.advance_to_grant(ends),
            TimeMode::Running(speed) => {
                self.tick = self.current_tick(speed).max(self.tick);
                self.step(u64::MAX, ends);
                self.release_delayed();
            }
        }
        self.flush(ends.mail);
        // Where time is counted, messages are, too: until no agent has more to say.
        let may_tell = self.time != TimeMode::Counted || self.is_closed;
        if may_tell
            && !self.has_told
            && let Some(control) = ends.program.control()
        {
            self.has_told = true;
            self.send_log(ends.mail);
            let control = Control { cycle: self.begin.cycle, control };
            ends.mail.send_reliable(Peer::Server, Message::Control(control));
        }
    }

    /// Goes on to the tick that the server has granted, once all packets that arrive by then are there.
    fn advance_to_grant(&mut self, ends: &mut AgentIo<'_>) {
        let is_first = !std::mem::replace(&mut self.has_begun, true);
        if !is_first {
            let Some(tick) = self.granted else { return };
            let due: usize =
                self.arrived.range(..=tick.tick).map(|(_, packets)| packets.len()).sum();
            if self.taken + (due as u64) < tick.packets {
                return;
            }
            (self.granted, self.tick) = (None, tick.tick);
        }
        let sent = self.step(self.tick, ends);
        let report = AdvanceDone {
            cycle: self.begin.cycle,
            tick: self.tick,
            sent,
            timer: ends.program.next_timer(),
            is_done: ends.program.is_done(),
        };
        ends.mail.send_reliable(Peer::Server, Message::Ticked(report));
    }

    /// Takes the packets that have arrived by a tick, does everything that is due, and sends the resulting packets.
    /// Returns the receivers of those, with the ticks of arrival.
    fn step(&mut self, by: u64, ends: &mut AgentIo<'_>) -> Vec<(EntityId, u64)> {
        let later = by.checked_add(1).map(|next| self.arrived.split_off(&next));
        let due = std::mem::replace(&mut self.arrived, later.unwrap_or_default());
        let mut due: Vec<(EntityId, Packet)> = due.into_values().flatten().collect();
        // As in one process, regardless of the order in which they came.
        due.sort_by_key(|(from, packet)| (packet.left, *from, packet.sequence));
        self.taken += due.len() as u64;
        let mut sent = Vec::new();
        for (from, packet) in due {
            // Where no time passes, each packet is answered by itself, however many have come at once: so there are
            // as many of them as in one process.
            if self.time == TimeMode::Untimed {
                self.send_all(ends, &mut sent);
            }
            ends.program.on_packet(from, &packet.payload, self.tick);
        }
        if self.time != TimeMode::Untimed {
            ends.program.on_timer(self.tick);
        }
        self.send_all(ends, &mut sent);
        sent
    }

    /// Sends the program's packets.
    fn send_all(&mut self, ends: &mut AgentIo<'_>, sent: &mut Vec<(EntityId, u64)>) {
        for packet in ends.program.take_packets() {
            self.send(packet, ends, sent);
        }
    }

    /// Sends a packet to each of its receivers, with the faults that happen to it.
    fn send(
        &mut self,
        packet: OutgoingPacket,
        ends: &mut AgentIo<'_>,
        sent: &mut Vec<(EntityId, u64)>,
    ) {
        let bytes = packet.payload.len();
        // In real time packets are numbered within the whole cycle, because all draws are for its first tick.
        let (tick, sequence) = match self.time {
            TimeMode::Running(_) => (self.first_tick, self.sequence),
            _ => (self.tick, packet.sequence),
        };
        self.sequence += 1;
        for &to in &*packet.to {
            self.sent.packets += 1;
            self.sent.bytes += bytes as u64;
            let one = Transmission { to, tick, sequence, bytes };
            let arrivals = match &mut ends.channel {
                _ if self.begin.beyond.binary_search(&to).is_ok() => Vec::new(),
                Some(channel) => channel.arrivals(&one),
                None => vec![Arrival { leaves: tick, arrives: tick + 1 }],
            };
            self.log_packet(one, &arrivals);
            for Arrival { leaves, arrives } in arrivals {
                let (cycle, payload) = (self.begin.cycle, packet.payload.clone());
                let [left, arrives] = [leaves, arrives].map(|at| self.tick + (at - tick));
                sent.push((to, arrives));
                let packet = Packet { cycle, left, sequence, arrives, payload };
                self.schedule(to, packet);
            }
        }
    }

    fn log_packet(&mut self, packet: Transmission, arrivals: &[Arrival]) {
        let Some(log) = &mut self.log else { return };
        let Transmission { to, tick, sequence, bytes } = packet;
        let first = arrivals.iter().map(|one| one.arrives).min();
        log.push(PacketRecord {
            cycle: self.begin.cycle,
            sent: self.tick,
            to,
            sequence,
            bytes: bytes as u32,
            copies: arrivals.len() as u32,
            arrives: first.map_or(0, |at| self.tick + (at - tick)),
        });
    }

    /// Lets a packet leave: at the end of the step, or after its delay.
    fn schedule(&mut self, to: EntityId, packet: Packet) {
        // One tick is the time of the real network.
        let delay = packet.arrives.saturating_sub(self.tick + 1);
        match self.time {
            TimeMode::Running(speed) if delay > 0 => {
                let delay = Duration::from_secs_f64(delay as f64 * self.tick_s / speed);
                self.leaving.insert((Instant::now() + delay, to, packet.sequence), packet);
            }
            _ => self.outgoing.entry(to).or_default().push(packet),
        }
    }

    fn release_delayed(&mut self) {
        let now = Instant::now();
        while let Some(entry) = self.leaving.first_entry().filter(|entry| entry.key().0 <= now) {
            let ((_, to, _), packet) = entry.remove_entry();
            self.outgoing.entry(to).or_default().push(packet);
        }
    }

    /// Sends the packets of a step: one word to all that get the same packets.
    fn flush(&mut self, mail: &mut Messenger) {
        let mut words: Vec<(Vec<Packet>, Vec<Peer>)> = Vec::new();
        for (to, packets) in std::mem::take(&mut self.outgoing) {
            let to = Peer::Node(to);
            match words.iter_mut().find(|(same, _)| *same == packets) {
                Some((_, others)) => others.push(to),
                None => words.push((packets, vec![to])),
            }
        }
        for (packets, to) in words {
            let word = Message::Packets(packets);
            match self.time {
                TimeMode::Running(_) => mail.multicast_best_effort(&to, &word),
                // Only packets lost by the scenario are lost here.
                TimeMode::Untimed | TimeMode::Counted => mail.multicast_reliable(&to, word),
            }
        }
    }
}
