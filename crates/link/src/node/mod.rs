//! The node of an agent: it joins a fleet, and carries percepts, packets and controls between the wire and the
//! agent's program.
//!
//! ```text
//! join.rs      asks the server until it may       turn.rs    one cycle of the agent
//! ```

mod agent_cycle;
mod join;

use crate::agent::{Activity, AgentProgram, Channel};
use crate::messenger::{Messenger, Received};
use crate::protocol::{ClockMode, CycleStart, JoinError, Member, Message, Packet, Status, Welcome};
use crate::wire::{Peer, WireError};
use agent_cycle::{AgentCycle, AgentIo};
pub use join::{JoinConfig, join};
use sidestep::kernel::{Cycle, EntityId};
use std::time::{Duration, Instant};

/// Time between two reports of a node.
const REPORT_INTERVAL: Duration = Duration::from_millis(500);

/// Time without answers from the other end of an open link before the link is taken for deaf.
const HALF_OPEN_TIMEOUT: Duration = Duration::from_secs(3);

/// Time between two openings of links, at least.
const MIN_REOPEN_INTERVAL: Duration = Duration::from_secs(10);

/// Time after which it looks around, at most.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// Most packets that are kept for a cycle that has not begun here: those beyond are lost.
const MAX_EARLY_PACKETS: usize = 100_000;

/// Most words that are taken before a node goes on, so that it does go on however much it hears.
const MAX_MESSAGES_PER_POLL: usize = 1_000;

/// The end of a node before the fleet's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NodeError {
    /// The server does not take it.
    #[error("{}", .0.cause)]
    Refused(JoinError),
    /// There is no wire.
    #[error(transparent)]
    Wire(#[from] WireError),
    /// The server is not there, or no longer.
    #[error("the server was not heard for {0} s")]
    Silence(u64),
    /// The server has not heard it for too long, and goes on without it.
    #[error("{}", .0.cause)]
    Dismissed(JoinError),
    /// A percept cannot be read.
    #[error("the server has sent a percept that cannot be read: {0}")]
    Percept(String),
}

/// A listener for the status of a node, called as often as the server is told.
type StatusListener = Box<dyn FnMut(&Status)>;

/// A node that has joined a fleet.
pub struct Node {
    agent: EntityId,
    mail: Messenger,
    program: Box<dyn AgentProgram>,
    channel: Option<Box<dyn Channel>>,
    clock: ClockMode,
    logs_packets: bool,
    lease: Duration,
    members: Vec<Member>,
    is_ready: bool,
    turn: Option<AgentCycle>,
    /// Packets of a cycle that has not begun here.
    early: Vec<(EntityId, Packet)>,
    status: Status,
    /// The part of a cycle that was logged last.
    part: (Cycle, &'static str),
    report_at: Instant,
    /// Time before which no link is opened again.
    mend_at: Instant,
    /// Whether its links are closed, and could not be opened.
    is_cut_off: bool,
    looks: StatusListener,
}

impl Node {
    /// Returns a node of an agent that may join, with its program and the faults of its packets.
    pub fn new(
        agent: EntityId,
        mail: Messenger,
        program: Box<dyn AgentProgram>,
        channel: Option<Box<dyn Channel>>,
        welcome: &Welcome,
        lease: Duration,
    ) -> Self {
        Self {
            agent,
            mail,
            program,
            channel,
            clock: welcome.clock,
            logs_packets: welcome.logs_packets,
            lease,
            members: Vec::new(),
            is_ready: false,
            turn: None,
            early: Vec::new(),
            status: Status::default(),
            part: Default::default(),
            report_at: Instant::now(),
            mend_at: Instant::now(),
            is_cut_off: false,
            looks: Box::new(|_| {}),
        }
    }

    /// Reports the status of the node to a listener as well, twice a second.
    #[must_use]
    pub fn with_listener(self, looks: impl FnMut(&Status) + 'static) -> Self {
        Self { looks: Box::new(looks), ..self }
    }

    /// Takes part in the fleet until the server ends it.
    ///
    /// # Errors
    /// When the server is gone, or its words make no sense.
    pub fn run(mut self) -> Result<Status, NodeError> {
        loop {
            let wait = self.turn.as_ref().and_then(|turn| turn.max_wait(self.program.as_ref()));
            let Some(heard) = self.receive_all(wait.unwrap_or(POLL_INTERVAL).min(POLL_INTERVAL))?
            else {
                self.leave();
                return Ok(self.status);
            };
            self.advance();
            self.report_status();
            let silent = self.mail.silent_for(Peer::Server);
            // Words that came while this process stood still are heard first.
            if heard == 0 && silent.is_some_and(|silent| silent > self.lease) {
                return Err(NodeError::Silence(self.lease.as_secs()));
            }
        }
    }

    /// Sends its remaining words, and waits a little until they have arrived.
    fn leave(&mut self) {
        if let Some(turn) = &mut self.turn {
            turn.send_log(&mut self.mail);
        }
        self.update_status();
        self.mail.send_reliable(Peer::Server, Message::Status(self.status.clone()));
        self.mail.send_reliable(Peer::Server, Message::Left);
        let until = Instant::now() + REPORT_INTERVAL;
        while !self.mail.has_delivered_to(Peer::Server) && Instant::now() < until {
            self.mail.receive(POLL_INTERVAL);
        }
    }

    /// Takes the words that have come, and waits for the first of them at most the given time. Nothing is answered
    /// before all are taken: so there is less to do, and less to send. Returns their number; none when the fleet has
    /// ended.
    fn receive_all(&mut self, within: Duration) -> Result<Option<usize>, NodeError> {
        let mut count = 0;
        let mut wait = within;
        while count < MAX_MESSAGES_PER_POLL
            && let Some(heard) = self.mail.receive(wait)
        {
            if self.on_message(heard)? {
                return Ok(None);
            }
            (count, wait) = (count + 1, Duration::ZERO);
        }
        Ok(Some(count))
    }

    /// Takes a word. Returns whether the fleet has ended.
    fn on_message(&mut self, Received { from, word, .. }: Received) -> Result<bool, NodeError> {
        match (from, word) {
            (Peer::Server, Message::End) => return Ok(true),
            (Peer::Server, Message::Refused(refusal)) => return Err(NodeError::Dismissed(refusal)),
            (Peer::Server, Message::Roster(members)) => self.on_roster(members)?,
            (Peer::Server, Message::Begin(begin)) => self.on_cycle_start(begin)?,
            (Peer::Server, Message::Tick(tick)) => {
                if let Some(turn) = &mut self.turn {
                    turn.on_grant(tick);
                }
            }
            (Peer::Server, Message::Close(cycle)) => {
                if let Some(turn) = self.turn.as_mut().filter(|turn| turn.cycle() == cycle) {
                    turn.close();
                }
            }
            (Peer::Node(from), Message::Packets(packets)) => {
                packets.into_iter().for_each(|packet| self.on_packet(from, packet));
            }
            // The arrival of `Hello` is its whole purpose; other parties send only the words above.
            _ => {}
        }
        Ok(false)
    }

    /// Begins a cycle.
    fn on_cycle_start(&mut self, begin: CycleStart) -> Result<(), NodeError> {
        let begun = self.program.start_cycle(begin.cycle, &begin.sight);
        let first_tick = begun.map_err(NodeError::Percept)?;
        self.status.cycle = begin.cycle;
        let tick_s = self.channel.as_mut().map(|channel| {
            channel.start_cycle(begin.cycle);
            channel.tick_s()
        });
        if let Some(turn) = &mut self.turn {
            turn.send_log(&mut self.mail);
        }
        let turn = AgentCycle::new(begin, self.clock, tick_s, first_tick);
        self.turn = Some(if self.logs_packets { turn.with_log() } else { turn });
        for (from, packet) in std::mem::take(&mut self.early) {
            self.on_packet(from, packet);
        }
        Ok(())
    }

    /// Meets the other nodes, and finds out whether they hear it.
    fn on_roster(&mut self, members: Vec<Member>) -> Result<(), NodeError> {
        self.mail.connect_mesh(self.agent, &members)?;
        let is_new =
            |member: &&Member| member.agent != self.agent && !self.members.contains(member);
        for member in members.iter().filter(is_new) {
            let party = Peer::Node(member.agent);
            self.mail.connect(party, member.life);
            self.mail.send_reliable(party, Message::Hello);
        }
        self.members = members;
        Ok(())
    }

    fn on_packet(&mut self, from: EntityId, packet: Packet) {
        match &mut self.turn {
            Some(turn) if packet.cycle == turn.cycle() => turn.on_packet(from, packet),
            // Another node may have heard of the cycle before this one.
            turn if turn.as_ref().is_none_or(|turn| packet.cycle > turn.cycle())
                && self.early.len() < MAX_EARLY_PACKETS =>
            {
                self.early.push((from, packet));
            }
            // Of a talk that is over, or one more than there is room for.
            _ => {}
        }
    }

    /// Does everything that can be done now.
    fn advance(&mut self) {
        if !self.is_ready && !self.members.is_empty() && self.mail.has_delivered() {
            self.is_ready = true;
            self.mail.send_reliable(Peer::Server, Message::Ready);
        }
        if let Some(turn) = &mut self.turn {
            let Self { program, channel, mail, .. } = self;
            let channel = channel.as_deref_mut();
            turn.advance(&mut AgentIo { program: program.as_mut(), channel, mail });
            let sent = turn.take_sent();
            self.status.packets += sent.packets;
            self.status.bytes += sent.bytes;
            self.log_activity();
        }
    }

    /// Logs that the agent has come to another part of a cycle.
    fn log_activity(&mut self) {
        let Activity { word, round, epoch } = self.program.activity();
        let (agent, cycle) = (self.agent, self.status.cycle);
        if std::mem::replace(&mut self.part, (cycle, word)) != (cycle, word) {
            tracing::debug!(agent, cycle, talk = word, round, epoch, "the talk goes on");
        }
    }

    /// Tells the server the status of this node, now and then.
    fn report_status(&mut self) {
        let now = Instant::now();
        if now < self.report_at {
            return;
        }
        self.report_at = now + REPORT_INTERVAL;
        self.update_status();
        (self.looks)(&self.status);
        self.mail.send_best_effort(Peer::Server, Message::Status(self.status.clone()));
        self.repair_links(now);
    }

    /// Opens the direct links again when one of them is deaf: alive at both ends, and nothing comes through. Zenoh
    /// leaves such links behind where opening one took as long as it may, and on a busy machine that is not rare.
    fn repair_links(&mut self, now: Instant) {
        // Of two, the one with the higher id has opened the link.
        let mut before = self.members.iter().filter(|member| member.agent < self.agent);
        let deaf = before.find(|member| self.mail.is_half_open(member, HALF_OPEN_TIMEOUT));
        if now < self.mend_at || (deaf.is_none() && !self.is_cut_off) {
            return;
        }
        let (agent, other) = (self.agent, deaf.map(|member| member.agent));
        tracing::warn!(agent, other, "a link is deaf or closed: links are opened anew");
        self.mend_at = now + MIN_REOPEN_INTERVAL;
        let opened = self.mail.reopen_links();
        self.is_cut_off = opened.is_err();
        if let Err(error) = opened {
            // Until it can be done, everything goes by the server.
            tracing::warn!(agent, %error, "links cannot be opened yet");
        }
    }

    fn update_status(&mut self) {
        let doing = self.program.activity();
        let counts = self.mail.stats();
        let dropped = counts.dropped.iter().map(|(&reason, &count)| (reason.to_string(), count));
        self.status.doing = doing.word.into();
        (self.status.round, self.status.epoch) = (doing.round, doing.epoch);
        self.status.heard = self.program.heard_agents();
        self.status.retries = counts.retries;
        self.status.dropped = dropped.chain(self.program.drop_counts()).collect();
    }
}
