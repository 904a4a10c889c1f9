//! The node of an agent: it joins a fleet, and carries percepts, packets and controls between the wire and the
//! agent's program.
//!
//! ```text
//! join.rs         asks the server until it may join
//! seat.rs         gives the seat back on every way out
//! agent_cycle.rs  one cycle of the agent
//! ```

mod agent_cycle;
mod join;
mod seat;

use crate::agent::{AgentActivity, AgentProgram, ChannelModel};
use crate::messenger::ReceivedMessage;
use crate::protocol::{
    AgentPacket, ClockMode, CycleStart, FleetMember, JoinError, Message, NodeStatusReport, Welcome,
};
use crate::resource_usage::processor_time_ms;
use crate::wire::{PeerId, WireSetupError};
use agent_cycle::{AgentCycle, AgentCycleIo};
pub use join::{JoinConfig, join};
pub use seat::Seat;
use sidestep::kernel::{Cycle, EntityId};
use std::time::{Duration, Instant};

/// Time between two reports of a node to the server. It is half of the time after which a node counts as silent
/// ([`SILENCE_TIMEOUT`](crate::server::SILENCE_TIMEOUT)), so that one lost report raises no alarm.
const REPORT_INTERVAL: Duration = Duration::from_millis(500);

/// Time in which the server acknowledges the goodbye of a node, unless it is gone: retransmissions and the opening of a
/// broken link have room in it.
const FAREWELL_TIMEOUT: Duration = Duration::from_secs(5);

/// Time beyond the lease for which a node waits for a silent server in real time: the fleet flies on without it, and gives
/// it its place back. A partition may last that long.
const RETURN_TIMEOUT: Duration = Duration::from_secs(60);

/// Time without answers from the other end of an open link before the link counts as half-open: longer than Zenoh's own
/// lease of 2 s, after which a link that is merely broken is closed.
const HALF_OPEN_TIMEOUT: Duration = Duration::from_secs(3);

/// Minimum time between two openings of the links: opening one takes up to 3 s, and all links of the node close with it.
const MIN_REOPEN_INTERVAL: Duration = Duration::from_secs(10);

/// Maximum time that the node waits for messages before it checks timers and the server's silence.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// Maximum number of packets that are kept for a cycle that has not started here; further ones are lost. Far more than
/// a group sends in a cycle, so the limit only bounds the memory that a faulty node can take.
const MAX_EARLY_PACKETS: usize = 100_000;

/// Maximum number of messages that are received before the node acts on them, so that it does act however many
/// messages arrive.
const MAX_MESSAGES_PER_POLL: usize = 1_000;

/// The end of a node before the fleet's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NodeError {
    /// The server does not let it join.
    #[error("{}", .0.cause)]
    Refused(JoinError),
    /// There is no wire.
    #[error(transparent)]
    Wire(#[from] WireSetupError),
    /// The server does not answer, or no longer.
    #[error("the server was not heard for {0} s")]
    ServerSilent(u64),
    /// The server has not heard it for too long, and has given it up.
    #[error("{}", .0.cause)]
    Dismissed(JoinError),
    /// It was asked to end.
    #[error("it was asked to end")]
    Interrupted,
    /// A percept cannot be read.
    #[error("the server has sent a percept that cannot be read: {0}")]
    Percept(String),
}

/// A listener for the status of a node, called whenever the status is sent to the server.
type StatusListener = Box<dyn FnMut(&NodeStatusReport)>;

/// A check whether a node is asked to end before its fleet does.
type Interrupt = Box<dyn Fn() -> bool>;

/// A node that has joined a fleet.
pub struct Node {
    agent: EntityId,
    messenger: Seat,
    program: Box<dyn AgentProgram>,
    /// The faults of the scenario's network; none where it has none.
    channel: Option<Box<dyn ChannelModel>>,
    clock: ClockMode,
    logs_packets: bool,
    /// Time without a message from the server after which it counts as gone.
    lease: Duration,
    /// Whether the server has been silent for longer than that.
    is_alone: bool,
    members: Vec<FleetMember>,
    /// Whether all other nodes have acknowledged its `Hello`.
    is_ready: bool,
    cycle: Option<AgentCycle>,
    /// Packets of a cycle that has not started here.
    early_packets: Vec<(EntityId, AgentPacket)>,
    status: NodeStatusReport,
    /// Processor time in milliseconds that the process had used when its first cycle began: reading a scenario is no part
    /// of flying it.
    processor_start_ms: Option<u64>,
    /// The activity that was logged last, and its cycle: only changes are logged.
    logged_activity: (Cycle, &'static str),
    report_at: Instant,
    /// Time before which the links are not opened again.
    reopen_at: Instant,
    /// Whether the links are closed because they could not be opened again.
    are_links_closed: bool,
    listener: StatusListener,
    /// Whether the node is asked to end.
    interrupt: Interrupt,
}

impl Node {
    /// Returns the node of an agent that may join, with its program and the faults of its packets.
    pub fn new(
        agent: EntityId,
        messenger: Seat,
        program: Box<dyn AgentProgram>,
        channel: Option<Box<dyn ChannelModel>>,
        welcome: &Welcome,
    ) -> Self {
        Self {
            agent,
            messenger,
            program,
            channel,
            clock: welcome.clock,
            logs_packets: welcome.logs_packets,
            lease: Duration::MAX,
            is_alone: false,
            members: Vec::new(),
            is_ready: false,
            cycle: None,
            early_packets: Vec::new(),
            status: NodeStatusReport::default(),
            processor_start_ms: None,
            logged_activity: Default::default(),
            report_at: Instant::now(),
            reopen_at: Instant::now(),
            are_links_closed: false,
            listener: Box::new(|_| {}),
            interrupt: Box::new(|| false),
        }
    }

    /// Makes the node end when it has not heard the server for some time: at once in lockstep, which has ended for it then,
    /// and a minute later in real time.
    #[must_use]
    pub fn with_server_timeout(self, lease: Duration) -> Self {
        Self { lease, ..self }
    }

    /// Reports the status of the node to a listener as well, twice a second.
    #[must_use]
    pub fn with_status_listener(self, listener: impl FnMut(&NodeStatusReport) + 'static) -> Self {
        Self { listener: Box::new(listener), ..self }
    }

    /// Makes the node leave the fleet as soon as a check says so.
    #[must_use]
    pub fn with_interrupt(self, interrupt: impl Fn() -> bool + 'static) -> Self {
        Self { interrupt: Box::new(interrupt), ..self }
    }

    /// Takes part in the fleet until the server ends it. Where it ends before, the server is told.
    ///
    /// # Errors
    /// When the server is silent, has given the node up, or sends a percept that cannot be read, or the node is asked to
    /// end.
    pub fn run(mut self) -> Result<NodeStatusReport, NodeError> {
        let result = self.run_until_end();
        match &result {
            // The goodbye is said, or the server knows that the node is gone.
            Ok(()) | Err(NodeError::Dismissed(_)) => self.messenger.mark_given_back(),
            // Nobody acknowledges it; perhaps somebody hears it.
            Err(error @ NodeError::ServerSilent(_)) => {
                let left = Message::Left(error.to_string());
                self.messenger.send_best_effort(PeerId::Server, left);
                self.messenger.mark_given_back();
            }
            Err(error) => self.messenger.leave(&error.to_string()),
        }
        result.map(|()| self.status)
    }

    fn run_until_end(&mut self) -> Result<(), NodeError> {
        loop {
            if (self.interrupt)() {
                return Err(NodeError::Interrupted);
            }
            let max_wait = self.cycle.as_ref().and_then(|cycle| cycle.max_wait(&*self.program));
            let poll_interval = self.program.poll_interval();
            let wait = max_wait.into_iter().chain(poll_interval).fold(POLL_INTERVAL, Duration::min);
            let Some(received) = self.receive_all(wait)? else {
                self.leave();
                return Ok(());
            };
            self.program.poll();
            self.advance();
            self.report_status();
            // If this process was stopped, messages have queued up meanwhile: they are received before the server counts
            // as silent.
            if received == 0 {
                self.check_server()?;
            }
        }
    }

    /// Checks whether the server is silent for so long that the node ends.
    fn check_server(&mut self) -> Result<(), NodeError> {
        let Some(silent) = self.messenger.silent_for(PeerId::Server) else { return Ok(()) };
        let is_alone = silent > self.lease;
        let limit = match self.clock {
            ClockMode::Lockstep => self.lease,
            ClockMode::Realtime { .. } => self.lease.saturating_add(RETURN_TIMEOUT),
        };
        if silent > limit {
            return Err(NodeError::ServerSilent(limit.as_secs()));
        }
        if is_alone && !self.is_alone {
            let agent = self.agent;
            let lease_s = self.lease.as_secs_f64();
            tracing::warn!(agent, lease_s, "the server is not heard: this node waits for it");
        }
        self.is_alone = is_alone;
        Ok(())
    }

    /// Sends the final status, and waits until it has arrived, unless the server is gone.
    fn leave(&mut self) {
        if let Some(cycle) = &mut self.cycle {
            cycle.send_log(&mut self.messenger);
        }
        self.update_status();
        self.messenger.send_reliable(PeerId::Server, Message::Status(self.status.clone()));
        self.messenger.send_reliable(PeerId::Server, Message::Goodbye);
        let until = Instant::now() + FAREWELL_TIMEOUT;
        while !self.messenger.has_delivered_to(PeerId::Server) && Instant::now() < until {
            self.messenger.receive(POLL_INTERVAL);
        }
    }

    /// Receives all messages that have arrived, and waits for the first of them at most the given time. The node acts on
    /// them only when all are received: then one step, and one frame, often answers several. Returns their number; none
    /// when the fleet has ended.
    fn receive_all(&mut self, within: Duration) -> Result<Option<usize>, NodeError> {
        let mut count = 0;
        let mut wait = within;
        while count < MAX_MESSAGES_PER_POLL
            && let Some(received) = self.messenger.receive(wait)
        {
            if self.on_message(received)? {
                return Ok(None);
            }
            count += 1;
            wait = Duration::ZERO;
        }
        Ok(Some(count))
    }

    /// Processes a message. Returns whether the fleet has ended.
    fn on_message(&mut self, received: ReceivedMessage) -> Result<bool, NodeError> {
        match (received.from, received.message) {
            (PeerId::Server, Message::End) => return Ok(true),
            (PeerId::Server, Message::Refused(error)) => return Err(NodeError::Dismissed(error)),
            (PeerId::Server, Message::Roster(members)) => self.on_roster(members)?,
            (PeerId::Server, Message::CycleStart(start)) => self.on_cycle_start(start)?,
            (PeerId::Server, Message::Grant(grant)) => {
                if let Some(cycle) = &mut self.cycle {
                    cycle.on_grant(grant);
                }
            }
            (PeerId::Server, Message::Close(number)) => {
                if let Some(cycle) =
                    self.cycle.as_mut().filter(|cycle| cycle.cycle_number() == number)
                {
                    cycle.on_close();
                }
            }
            (PeerId::Node(from), Message::Packets(packets)) => {
                packets.into_iter().for_each(|packet| self.on_packet(from, packet));
            }
            // `Hello` and `Heartbeat` have done their work by arriving; all else is not for a node.
            _ => {}
        }
        Ok(false)
    }

    /// Starts a cycle, with its packets that came early; an unfinished one is given up.
    fn on_cycle_start(&mut self, start: CycleStart) -> Result<(), NodeError> {
        let first_tick =
            self.program.start_cycle(start.cycle, &start.percept).map_err(NodeError::Percept)?;
        self.status.cycle = start.cycle;
        if self.processor_start_ms.is_none() {
            self.processor_start_ms = processor_time_ms();
        }
        let tick_s = self.channel.as_mut().map(|channel| {
            channel.start_cycle(start.cycle);
            channel.tick_s()
        });
        if let Some(previous) = &mut self.cycle {
            previous.send_log(&mut self.messenger);
        }
        let cycle = AgentCycle::new(start, self.clock, tick_s, first_tick);
        self.cycle = Some(if self.logs_packets { cycle.with_log() } else { cycle });
        for (from, packet) in std::mem::take(&mut self.early_packets) {
            self.on_packet(from, packet);
        }
        Ok(())
    }

    /// Connects with the other nodes, and sends each a `Hello` to find out whether it receives this node's messages.
    fn on_roster(&mut self, members: Vec<FleetMember>) -> Result<(), NodeError> {
        self.messenger.connect_mesh(self.agent, &members)?;
        for member in &members {
            if member.agent == self.agent || self.members.contains(member) {
                continue;
            }
            if self.messenger.connect_member(member) {
                self.messenger.send_reliable(PeerId::Node(member.agent), Message::Hello);
            }
        }
        self.members = members;
        Ok(())
    }

    fn on_packet(&mut self, from: EntityId, packet: AgentPacket) {
        let current = self.cycle.as_ref().map(AgentCycle::cycle_number);
        match &mut self.cycle {
            Some(cycle) if current == Some(packet.cycle) => cycle.on_packet(from, packet),
            // Another node may have heard of the cycle before this one.
            _ if current.is_none_or(|current| packet.cycle > current)
                && self.early_packets.len() < MAX_EARLY_PACKETS =>
            {
                self.early_packets.push((from, packet));
            }
            // Of a conversation that is over, or more than can be kept.
            _ => {}
        }
    }

    /// Does everything that can be done now.
    fn advance(&mut self) {
        if !self.is_ready && !self.members.is_empty() && self.messenger.has_delivered() {
            self.is_ready = true;
            self.messenger.send_reliable(PeerId::Server, Message::Ready);
        }
        if let Some(cycle) = &mut self.cycle {
            cycle.advance(&mut AgentCycleIo {
                program: &mut *self.program,
                channel: self.channel.as_deref_mut(),
                messenger: &mut self.messenger,
            });
            let sent = cycle.take_traffic();
            self.status.packets += sent.packets;
            self.status.bytes += sent.bytes;
            self.log_activity();
        }
    }

    /// Logs the agent's activity if it has changed.
    fn log_activity(&mut self) {
        let AgentActivity { name, round, epoch } = self.program.activity();
        let agent = self.agent;
        let cycle = self.status.cycle;
        if self.logged_activity != (cycle, name) {
            self.logged_activity = (cycle, name);
            tracing::debug!(
                agent,
                cycle,
                talk = name,
                round,
                epoch,
                "the agent's activity has changed"
            );
        }
    }

    /// Sends the status of this node to the server at intervals, and repairs its links.
    fn report_status(&mut self) {
        let now = Instant::now();
        if now < self.report_at {
            return;
        }
        self.report_at = now + REPORT_INTERVAL;
        self.update_status();
        (self.listener)(&self.status);
        self.messenger.send_best_effort(PeerId::Server, Message::Status(self.status.clone()));
        self.repair_links(now);
    }

    /// Opens the direct links again when one of them is half-open: alive at both ends, and nothing arrives through it.
    /// Zenoh leaves such links behind where opening one takes as long as it may, which is not rare on a busy machine.
    fn repair_links(&mut self, now: Instant) {
        // This node has opened the links to those with lower ids, and repairs only these: if both ends of a link did, one
        // would close what the other has just opened.
        let mut opened_here = self.members.iter().filter(|member| member.agent < self.agent);
        let half_open =
            opened_here.find(|member| self.messenger.is_half_open(member, HALF_OPEN_TIMEOUT));
        if now < self.reopen_at || (half_open.is_none() && !self.are_links_closed) {
            return;
        }
        let agent = self.agent;
        let other = half_open.map(|member| member.agent);
        if !self.are_links_closed {
            tracing::warn!(agent, other, "a link is half-open: all links are opened again");
        }
        let result = self.messenger.reopen_links();
        self.are_links_closed = result.is_err();
        // Until it can be done, everything goes through the server.
        let retry_delay = if self.are_links_closed { REPORT_INTERVAL } else { MIN_REOPEN_INTERVAL };
        self.reopen_at = now + retry_delay;
        if let Err(error) = result {
            tracing::debug!(agent, %error, "links cannot be opened yet");
        }
    }

    fn update_status(&mut self) {
        let activity = self.program.activity();
        let stats = self.messenger.stats();
        let dropped = stats.dropped.iter().map(|(&reason, &count)| (reason.to_string(), count));
        self.status.activity = activity.name.into();
        self.status.round = activity.round;
        self.status.epoch = activity.epoch;
        self.status.heard = self.program.heard_agents();
        self.status.retries = stats.retries;
        self.status.frame_bytes = stats.bytes;
        let processor_ms = self.processor_start_ms.zip(processor_time_ms());
        self.status.processor_ms = processor_ms.map(|(start_ms, now_ms)| now_ms - start_ms);
        self.status.dropped = dropped.chain(self.program.drop_counts()).collect();
    }
}
