//! One cycle of an agent at its node: packets out and in, until its control is ready.

use crate::agent::{AgentProgram, ChannelModel, OutgoingPacket, PacketInTransit, PacketTiming};
use crate::messenger::Messenger;
use crate::protocol::{
    AdvanceDone, AdvanceGrant, AgentPacket, ClockMode, Control, CycleStart, Message, PacketRecord,
};
use crate::wire::PeerId;
use sidestep::kernel::{Cycle, EntityId};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Duration of a tick where the scenario has no network, in seconds: the default latency of one, which is the unit in
/// which networks count time.
const DEFAULT_TICK_S: f64 = 1e-3;

/// How time passes within a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
enum TimeMode {
    /// Not at all: packets are processed as they arrive, and no timer ends.
    Untimed,
    /// In ticks that the server counts.
    Ticks,
    /// By a clock that runs `speed` times as fast as the real one.
    RealTime { speed: f64 },
}

/// What a cycle works with: the agent's program, and its connection to others.
pub(super) struct AgentCycleIo<'a> {
    pub(super) program: &'a mut dyn AgentProgram,
    pub(super) channel: Option<&'a mut (dyn ChannelModel + 'static)>,
    pub(super) messenger: &'a mut Messenger,
}

/// A cycle of an agent, from its percept until that of the next one.
pub(super) struct AgentCycle {
    number: Cycle,
    /// Agents out of range of the agent's radio, in ascending order.
    out_of_range: Vec<EntityId>,
    time: TimeMode,
    started: Instant,
    first_tick: u64,
    /// Tick of the last step.
    tick: u64,
    /// Duration of a tick, in seconds of the scenario.
    tick_s: f64,
    /// Number of its next packet.
    sequence: u32,
    /// Packets that the program has not received yet, by the tick of their arrival.
    arrived: BTreeMap<u64, Vec<(EntityId, AgentPacket)>>,
    /// Number of packets that the program has received.
    processed: u64,
    /// The tick to which it may advance.
    grant: Option<AdvanceGrant>,
    /// Delayed packets, by the time at which they leave, and in their order.
    delayed: BTreeMap<(Instant, EntityId, u32), AgentPacket>,
    /// Packets that leave at the end of the step, by receiver.
    outgoing: BTreeMap<EntityId, Vec<AgentPacket>>,
    /// Whether the first step was done, where time is counted in ticks.
    has_stepped: bool,
    /// Whether the server has closed the conversations.
    is_closed: bool,
    has_sent_control: bool,
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
    /// Returns the cycle that starts now; `tick_s` is the duration of a tick of the network, if there is one.
    pub(super) fn new(
        start: CycleStart,
        clock: ClockMode,
        tick_s: Option<f64>,
        first_tick: u64,
    ) -> Self {
        let time = match clock {
            // Without a network nothing is lost, so nothing is ever repeated and results depend on no timer.
            ClockMode::Lockstep if tick_s.is_none() => TimeMode::Untimed,
            ClockMode::Lockstep => TimeMode::Ticks,
            ClockMode::Realtime { speed } => TimeMode::RealTime { speed },
        };
        Self {
            number: start.cycle,
            out_of_range: start.out_of_range,
            time,
            started: Instant::now(),
            first_tick,
            tick: first_tick,
            tick_s: tick_s.unwrap_or(DEFAULT_TICK_S),
            sequence: 0,
            arrived: BTreeMap::new(),
            processed: 0,
            grant: None,
            delayed: BTreeMap::new(),
            outgoing: BTreeMap::new(),
            has_stepped: false,
            is_closed: false,
            has_sent_control: false,
            sent: TrafficCounters::default(),
            log: None,
        }
    }

    /// Returns the cycle with a log of its packets, for the server's table of all packets.
    pub(super) fn with_log(self) -> Self {
        Self { log: Some(Vec::new()), ..self }
    }

    /// Sends the server the records of packets sent since the last call.
    pub(super) fn send_log(&mut self, messenger: &mut Messenger) {
        if let Some(log) = self.log.as_mut().filter(|log| !log.is_empty()) {
            messenger.send_reliable(PeerId::Server, Message::PacketLog(std::mem::take(log)));
        }
    }

    pub(super) fn cycle_number(&self) -> Cycle {
        self.number
    }

    /// Takes the count of packets and bytes sent since the last call.
    pub(super) fn take_traffic(&mut self) -> TrafficCounters {
        std::mem::take(&mut self.sent)
    }

    pub(super) fn on_grant(&mut self, grant: AdvanceGrant) {
        // One of the cycle before may arrive late.
        if grant.cycle == self.number {
            self.grant = Some(grant);
        }
    }

    pub(super) fn on_close(&mut self) {
        self.is_closed = true;
    }

    pub(super) fn on_packet(&mut self, from: EntityId, packet: AgentPacket) {
        // Where time is not counted in ticks, a packet arrives when it arrives.
        let arrives = if self.time == TimeMode::Ticks { packet.arrives } else { 0 };
        self.arrived.entry(arrives).or_default().push((from, packet));
    }

    /// Returns the time that the node may wait unless a message arrives; none if nothing happens before one does.
    pub(super) fn max_wait(&self, program: &dyn AgentProgram) -> Option<Duration> {
        let TimeMode::RealTime { speed } = self.time else { return None };
        let next_delayed = self.delayed.keys().next().map(|&(at, ..)| at);
        let next_timer = program.next_timer().and_then(|tick| self.instant_of(tick, speed));
        let next = next_delayed.into_iter().chain(next_timer).min()?;
        Some(next.saturating_duration_since(Instant::now()))
    }

    /// Returns the time of a tick; none if it is too far away for a clock.
    fn instant_of(&self, tick: u64, speed: f64) -> Option<Instant> {
        let ticks = tick.saturating_sub(self.first_tick) as f64;
        let wait = Duration::try_from_secs_f64(ticks * self.tick_s / speed).ok()?;
        self.started.checked_add(wait)
    }

    fn current_tick(&self, speed: f64) -> u64 {
        let passed_s = self.started.elapsed().as_secs_f64() * speed;
        // A millionth of a tick more, so that a wait for a tick ends with the tick reached in spite of rounding.
        self.first_tick + (passed_s / self.tick_s + 1e-6) as u64
    }

    /// Does everything that can be done now.
    pub(super) fn advance(&mut self, io: &mut AgentCycleIo<'_>) {
        match self.time {
            TimeMode::Untimed => {
                self.process_tick(u64::MAX, io);
            }
            TimeMode::Ticks => self.advance_to_grant(io),
            TimeMode::RealTime { speed } => {
                self.tick = self.current_tick(speed).max(self.tick);
                self.process_tick(u64::MAX, io);
                self.release_delayed();
            }
        }
        self.multicast_outgoing(io.messenger);
        self.send_control(io);
    }

    /// Sends the agent's control, once.
    fn send_control(&mut self, io: &mut AgentCycleIo<'_>) {
        // Where time is counted in ticks, an agent that is done still answers others until the server closes the cycle:
        // the numbers of messages, which are results, would else depend on which node is faster.
        let may_send = self.time != TimeMode::Ticks || self.is_closed;
        if !may_send || self.has_sent_control {
            return;
        }
        let Some(control) = io.program.control() else { return };
        self.has_sent_control = true;
        self.send_log(io.messenger);
        let control = Control { cycle: self.number, control };
        io.messenger.send_reliable(PeerId::Server, Message::Control(control));
    }

    /// Advances to the tick that the server has granted, once all packets that arrive by then are there.
    fn advance_to_grant(&mut self, io: &mut AgentCycleIo<'_>) {
        // The first step, in which the agent starts its conversation, needs no grant.
        if self.has_stepped {
            let Some(grant) = self.grant else { return };
            let due: usize =
                self.arrived.range(..=grant.tick).map(|(_, packets)| packets.len()).sum();
            if self.processed + (due as u64) < grant.packets {
                return;
            }
            self.grant = None;
            self.tick = grant.tick;
        }
        self.has_stepped = true;
        let sent = self.process_tick(self.tick, io);
        let report = AdvanceDone {
            cycle: self.number,
            tick: self.tick,
            sent,
            next_timer: io.program.next_timer(),
            is_done: io.program.is_done(),
        };
        io.messenger.send_reliable(PeerId::Server, Message::TickDone(report));
    }

    /// Gives the program the packets that have arrived by a tick, does everything that is due, and sends the resulting
    /// packets. Returns the receivers of these, with the ticks of arrival.
    fn process_tick(&mut self, by: u64, io: &mut AgentCycleIo<'_>) -> Vec<(EntityId, u64)> {
        let later = by.checked_add(1).map(|next| self.arrived.split_off(&next));
        let due = std::mem::replace(&mut self.arrived, later.unwrap_or_default());
        let mut due: Vec<(EntityId, AgentPacket)> = due.into_values().flatten().collect();
        // The order of one process, regardless of the order in which they have arrived here.
        due.sort_by_key(|(from, packet)| (packet.departs, *from, packet.sequence));
        self.processed += due.len() as u64;
        let mut sent = Vec::new();
        for (from, packet) in due {
            // Where no time passes, each packet is answered by itself, however many have arrived at once: so there are
            // as many answers as in one process.
            if self.time == TimeMode::Untimed {
                self.send_all(io, &mut sent);
            }
            io.program.on_packet(from, &packet.payload, self.tick);
        }
        if self.time != TimeMode::Untimed {
            io.program.on_timer(self.tick);
        }
        self.send_all(io, &mut sent);
        sent
    }

    /// Sends the program's packets.
    fn send_all(&mut self, io: &mut AgentCycleIo<'_>, sent: &mut Vec<(EntityId, u64)>) {
        for packet in io.program.take_packets() {
            self.send(packet, io, sent);
        }
    }

    /// Sends a packet to each of its receivers, with the faults that happen to it.
    fn send(
        &mut self,
        packet: OutgoingPacket,
        io: &mut AgentCycleIo<'_>,
        sent: &mut Vec<(EntityId, u64)>,
    ) {
        let bytes = packet.payload.len();
        // Faults are drawn by tick and number. In real time all draws are for the first tick of the cycle, because the
        // tick of sending depends on the machine: so packets are numbered within the whole cycle.
        let (draw_tick, sequence) = match self.time {
            TimeMode::RealTime { .. } => (self.first_tick, self.sequence),
            TimeMode::Untimed | TimeMode::Ticks => (self.tick, packet.sequence),
        };
        self.sequence += 1;
        for &to in &*packet.to {
            self.sent.packets += 1;
            self.sent.bytes += bytes as u64;
            let transmission = PacketInTransit { to, tick: draw_tick, sequence, bytes };
            let mut arrivals = self.arrivals(&transmission, io);
            for arrival in &mut arrivals {
                arrival.departs = self.tick + (arrival.departs - draw_tick);
                arrival.arrives = self.tick + (arrival.arrives - draw_tick);
            }
            self.log_packet(transmission, &arrivals);
            for PacketTiming { departs, arrives } in arrivals {
                sent.push((to, arrives));
                let payload = packet.payload.clone();
                let packet =
                    AgentPacket { cycle: self.number, departs, sequence, arrives, payload };
                self.schedule_packet(to, packet);
            }
        }
    }

    /// Returns the arrivals of a packet, counted from the tick for which its faults are drawn.
    fn arrivals(&self, packet: &PacketInTransit, io: &mut AgentCycleIo<'_>) -> Vec<PacketTiming> {
        if self.out_of_range.binary_search(&packet.to).is_ok() {
            return Vec::new();
        }
        match &mut io.channel {
            Some(channel) => channel.arrivals(packet),
            None => vec![PacketTiming { departs: packet.tick, arrives: packet.tick + 1 }],
        }
    }

    fn log_packet(&mut self, packet: PacketInTransit, arrivals: &[PacketTiming]) {
        let Some(log) = &mut self.log else { return };
        let first_arrival = arrivals.iter().map(|arrival| arrival.arrives).min();
        log.push(PacketRecord {
            cycle: self.number,
            sent: self.tick,
            to: packet.to,
            sequence: packet.sequence,
            bytes: packet.bytes as u32,
            copies: arrivals.len() as u32,
            arrives: first_arrival.unwrap_or(0),
        });
    }

    /// Schedules the sending of a packet: at the end of the step, or after its delay.
    fn schedule_packet(&mut self, to: EntityId, packet: AgentPacket) {
        // One tick of delay is what the real network takes, so only the rest is waited for.
        let delay = packet.arrives.saturating_sub(self.tick + 1);
        match self.time {
            TimeMode::RealTime { speed } if delay > 0 => {
                let delay = Duration::from_secs_f64(delay as f64 * self.tick_s / speed);
                self.delayed.insert((Instant::now() + delay, to, packet.sequence), packet);
            }
            _ => self.outgoing.entry(to).or_default().push(packet),
        }
    }

    fn release_delayed(&mut self) {
        let now = Instant::now();
        while let Some(entry) = self.delayed.first_entry().filter(|entry| entry.key().0 <= now) {
            let ((_, to, _), packet) = entry.remove_entry();
            self.outgoing.entry(to).or_default().push(packet);
        }
    }

    /// Sends the packets of a step: one message to all that get the same packets. A broadcast to a team is then encoded
    /// once, and published once.
    fn multicast_outgoing(&mut self, messenger: &mut Messenger) {
        let mut multicasts: Vec<(Vec<AgentPacket>, Vec<PeerId>)> = Vec::new();
        for (to, packets) in std::mem::take(&mut self.outgoing) {
            let to = PeerId::Node(to);
            match multicasts.iter_mut().find(|(same, _)| *same == packets) {
                Some((_, receivers)) => receivers.push(to),
                None => multicasts.push((packets, vec![to])),
            }
        }
        for (packets, to) in multicasts {
            let message = Message::Packets(packets);
            match self.time {
                // A control that is late counts for nothing, so a retransmission would come too late as well; the agents'
                // own protocol repeats what it needs.
                TimeMode::RealTime { .. } => messenger.multicast_best_effort(&to, &message),
                // Only packets that the scenario's network loses may be lost here.
                TimeMode::Untimed | TimeMode::Ticks => messenger.multicast_reliable(&to, message),
            }
        }
    }
}
