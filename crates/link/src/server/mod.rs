//! The server of a fleet: it holds the world, sends each node its percept, receives the controls, and advances the world.
//!
//! ```text
//! join.rs        nodes join, until all are there    node_entry.rs  what is known of a node
//! lockstep.rs    waits for every control            realtime.rs    each cycle is a deadline
//! rounds.rs      percepts out and controls in       liveness.rs    lost and silent nodes
//! ticks.rs       time counted in ticks, on a network with faults
//! histogram.rs   durations by bucket, for metrics
//! ```
//!
//! It opens no socket: all its messages go through a [`Messenger`].

pub mod histogram;
mod join;
mod liveness;
mod lockstep;
mod node_entry;
mod realtime;
mod rounds;
mod ticks;

use crate::hosted_run::HostedRun;
use crate::messenger::{Messenger, ReceivedMessage};
use crate::protocol::{
    AdvanceDone, ClockMode, Message, PacketRecord, ScenarioFingerprint, Welcome,
};
use crate::wire::PeerId;
use histogram::Histogram;
pub use liveness::SILENCE_TIMEOUT;
pub use node_entry::NodeEntry;
use sidestep::kernel::view::Frame;
use sidestep::kernel::{Cycle, EntityId};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Maximum time that the server waits for messages before it calls its hooks: 50 times a second, so that viewers get
/// frames that look continuous, and an interrupt ends the fleet at once.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Time between two signs of life to all nodes: several of them may be lost before a node's lease ends.
const HEARTBEAT_INTERVAL: Duration = Duration::from_millis(500);

/// Time that nodes have to say goodbye to a fleet that has failed or was interrupted.
const FAREWELL_TIMEOUT: Duration = Duration::from_millis(500);

/// What a server demands of nodes, and how it treats them.
#[derive(Debug, Clone)]
pub struct ServerConfig {
    /// Fingerprint of the scenario, which every node must have found as well.
    pub scenario: ScenarioFingerprint,
    /// The build of the program, which every node must have.
    pub build: String,
    /// The answer to nodes that may join.
    pub welcome: Welcome,
    /// Time after which a node that is not heard counts as lost.
    pub lease: Duration,
    /// Whether packets may be lost, delayed or duplicated, so that lockstep counts time in ticks.
    pub has_faults: bool,
}

/// The reason why a fleet ends before its world.
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    /// It was asked to end.
    #[error("interrupted")]
    Interrupted,
    /// A node is lost, and the fleet cannot continue without it.
    #[error("the node of {agent} is gone in cycle {cycle}: {reason}")]
    NodeLost {
        /// Its agent, by its name for people.
        agent: String,
        /// The cycle that cannot be computed without it.
        cycle: Cycle,
        /// How it was lost: its process has ended, or it was not heard.
        reason: String,
    },
    /// The world cannot advance.
    #[error(transparent)]
    World(#[from] sidestep_session::Error),
}

/// The state of the fleet, as its [`ServerHooks`] see it.
pub struct FleetContext<'a> {
    /// The nodes, by their agents.
    pub nodes: &'a BTreeMap<EntityId, NodeEntry>,
    /// The counts of the server.
    pub metrics: &'a ServerMetrics,
    /// The messenger of the server, which knows when each node was last heard.
    pub messenger: &'a Messenger,
    /// The run, between two cycles or rounds.
    pub run: &'a HostedRun,
    /// Whether all nodes have joined.
    pub has_begun: bool,
    /// Agents for which all wait, because their nodes are not heard.
    pub waits_for: &'a [EntityId],
}

/// Hooks that a server calls while it waits for messages.
pub trait ServerHooks {
    /// Inspects the fleet, about 50 times a second. Returns the nodes whose processes have ended, with the reason.
    ///
    /// # Errors
    /// When the fleet is to end.
    fn on_poll(&mut self, fleet: &FleetContext<'_>) -> Result<Vec<(EntityId, String)>, FleetError>;

    /// Receives the records of packets that nodes have sent, where all are recorded: those of the cycles before the
    /// present one, each with its sender.
    fn on_packets(&mut self, _: Vec<(EntityId, PacketRecord)>) {}

    /// Returns whether a viewer waits for a frame of this cycle.
    fn wants_frame(&self, _: Cycle) -> bool {
        false
    }

    /// Receives a frame that a viewer waits for.
    fn on_view_frame(&mut self, _: Frame) {}

    /// Returns the nodes whose processes have ended since the last call, while the others say goodbye.
    ///
    /// # Errors
    /// When the fleet is to end sooner.
    fn poll_farewell(&mut self) -> Result<Vec<EntityId>, FleetError> {
        Ok(Vec::new())
    }

    /// Inspects the fleet when all nodes have said goodbye.
    fn on_end(&mut self, _: &FleetContext<'_>) {}
}

/// Counts of a server.
#[derive(Debug, Clone, Default)]
pub struct ServerMetrics {
    /// Time from the percepts of a cycle to its last control.
    pub decision_time: Histogram,
    /// Time to advance the world by one cycle.
    pub advance_time: Histogram,
    /// Time by which a cycle has started later than due, in real time.
    pub lateness: Histogram,
    /// Number of cycles that started later than a tenth of their length.
    pub late_cycles: u64,
    /// Number of controls that did not arrive in time.
    pub late_controls: u64,
    /// Number of controls that could not be read or carried out.
    pub invalid_controls: u64,
    /// Nodes that were refused, by reason.
    pub refused: BTreeMap<&'static str, u64>,
}

/// The server of a fleet.
pub struct FleetServer<'a> {
    messenger: Messenger,
    run: &'a mut HostedRun,
    hooks: &'a mut dyn ServerHooks,
    config: ServerConfig,
    nodes: BTreeMap<EntityId, NodeEntry>,
    metrics: ServerMetrics,
    /// Whether all nodes have joined.
    has_begun: bool,
    /// Agents for which all wait, because their nodes are not heard.
    waits_for: Vec<EntityId>,
    heartbeat_at: Instant,
    poll_at: Instant,
    /// Reports of nodes that have done a tick.
    advance_reports: Vec<(EntityId, AdvanceDone)>,
    /// Records of packets that nodes have sent, where all are recorded.
    packets: Vec<(EntityId, PacketRecord)>,
    /// Nodes that have left since the last poll, with the reasons.
    departures: Vec<(EntityId, String)>,
}

impl<'a> FleetServer<'a> {
    /// Returns a server that no node has joined yet.
    pub fn new(
        messenger: Messenger,
        run: &'a mut HostedRun,
        hooks: &'a mut dyn ServerHooks,
        config: ServerConfig,
    ) -> Self {
        let nodes = run.all_agents().map(|agent| (agent, NodeEntry::default())).collect();
        let now = Instant::now();
        Self {
            messenger,
            run,
            hooks,
            config,
            nodes,
            metrics: ServerMetrics::default(),
            has_begun: false,
            waits_for: Vec::new(),
            heartbeat_at: now,
            poll_at: now,
            advance_reports: Vec::new(),
            packets: Vec::new(),
            departures: Vec::new(),
        }
    }

    /// Waits for all nodes, and runs the world to its end. The nodes are asked to end in any case.
    ///
    /// # Errors
    /// When it ends before.
    pub fn run(mut self) -> (Result<(), FleetError>, ServerMetrics) {
        let result = self.wait_for_nodes().and_then(|()| self.run_cycles());
        // What nodes say last are results of a fleet that has flown to its end: it waits for them as long as for a control.
        let farewell_timeout = if result.is_ok() { self.config.lease } else { FAREWELL_TIMEOUT };
        self.shut_down(farewell_timeout);
        (result, self.metrics)
    }

    fn run_cycles(&mut self) -> Result<(), FleetError> {
        self.has_begun = true;
        match self.config.welcome.clock {
            ClockMode::Lockstep => {
                while !self.run.is_over() {
                    self.run_lockstep_cycle()?;
                }
                Ok(())
            }
            ClockMode::Realtime { speed } => self.run_in_real_time(speed),
        }
    }

    /// Tells all nodes that the fleet has ended, and waits at most the given time until they have said goodbye, because
    /// their last counts and records of packets come before that.
    fn shut_down(&mut self, farewell_timeout: Duration) {
        self.send_to_joined(|messenger, node| messenger.send_reliable(node, Message::End));
        // One that joins after this is never told the end, and has nothing to say.
        let told: Vec<EntityId> = self.joined_agents().collect();
        let mut until = Instant::now() + farewell_timeout;
        while told.iter().any(|agent| !self.nodes[agent].has_left) && Instant::now() < until {
            if let Some(received) = self.messenger.receive(POLL_INTERVAL) {
                self.on_message(received);
            }
            match self.hooks.poll_farewell() {
                Ok(ended) => self.record_left(&ended),
                Err(_) => until = until.min(Instant::now() + FAREWELL_TIMEOUT),
            }
        }
        self.messenger.send_acks();
        self.hooks.on_packets(std::mem::take(&mut self.packets));
        self.waits_for.clear();
        self.publish_frame();
        let (hooks, view) = self.hooks_and_context();
        hooks.on_end(&view);
    }

    /// Records that the processes of nodes have ended, after their last messages.
    fn record_left(&mut self, agents: &[EntityId]) {
        if agents.is_empty() {
            return;
        }
        while let Some(received) = self.messenger.receive(Duration::ZERO) {
            self.on_message(received);
        }
        for agent in agents {
            if let Some(node) = self.nodes.get_mut(agent) {
                node.has_left = true;
            }
        }
    }

    /// Agents that have nodes, in ascending order.
    fn joined_agents(&self) -> impl Iterator<Item = EntityId> + '_ {
        self.nodes.iter().filter(|(_, node)| node.incarnation().is_some()).map(|(&agent, _)| agent)
    }

    fn send_to_joined(&mut self, send: impl Fn(&mut Messenger, PeerId)) {
        let joined: Vec<EntityId> = self.joined_agents().collect();
        joined.into_iter().for_each(|agent| send(&mut self.messenger, PeerId::Node(agent)));
    }

    /// Receives the messages that arrive within some time, at most until the next poll.
    ///
    /// # Errors
    /// When the fleet is to end.
    fn receive(&mut self, within: Duration) -> Result<(), FleetError> {
        if let Some(received) = self.messenger.receive(within.min(POLL_INTERVAL)) {
            self.on_message(received);
        }
        let now = Instant::now();
        if now >= self.poll_at {
            // If this process was stopped, messages have queued up meanwhile: they are received before any node counts
            // as silent.
            while let Some(received) = self.messenger.receive(Duration::ZERO) {
                self.on_message(received);
            }
            self.poll_at = now + POLL_INTERVAL;
            self.run_periodic_tasks(now)?;
        }
        Ok(())
    }

    fn run_periodic_tasks(&mut self, now: Instant) -> Result<(), FleetError> {
        if now >= self.heartbeat_at {
            self.heartbeat_at = now + HEARTBEAT_INTERVAL;
            self.send_to_joined(|messenger, node| {
                messenger.send_best_effort(node, Message::Heartbeat);
            });
        }
        self.publish_frame();
        let (hooks, view) = self.hooks_and_context();
        // Before the ends of processes: what a node says itself is the better reason.
        let ended = hooks.on_poll(&view)?;
        let mut lost = std::mem::take(&mut self.departures);
        lost.extend(ended);
        for (agent, reason) in lost {
            self.mark_lost(agent, reason)?;
        }
        let lease = self.config.lease;
        let silent = self.joined_agents().filter(|&agent| self.is_silent(agent, lease));
        for agent in silent.collect::<Vec<EntityId>>() {
            self.mark_silent(agent)?;
        }
        self.report_waits();
        Ok(())
    }

    /// Returns the hooks, and the state of the fleet that is shown to them.
    fn hooks_and_context(&mut self) -> (&mut dyn ServerHooks, FleetContext<'_>) {
        let view = FleetContext {
            nodes: &self.nodes,
            metrics: &self.metrics,
            messenger: &self.messenger,
            run: &*self.run,
            has_begun: self.has_begun,
            waits_for: &self.waits_for,
        };
        (&mut *self.hooks, view)
    }

    /// Gives viewers a frame if they wait for one.
    fn publish_frame(&mut self) {
        if self.hooks.wants_frame(self.run.cycle()) {
            self.hooks.on_view_frame(self.run.frame());
        }
    }

    fn on_message(&mut self, ReceivedMessage { from, incarnation, message }: ReceivedMessage) {
        let PeerId::Node(agent) = from else { return };
        if let Message::Join(join) = message {
            self.on_join(agent, incarnation, join);
            return;
        }
        let is_known =
            self.nodes.get(&agent).is_some_and(|node| node.incarnation() == Some(incarnation));
        if !is_known && !self.take_back(agent, incarnation) {
            return self.dismiss(agent, incarnation);
        }
        let Some(node) = self.nodes.get_mut(&agent) else { return };
        match message {
            Message::Ready => node.is_ready = true,
            Message::Status(status) => node.status = status,
            Message::Control(control) => self.on_control(agent, control),
            Message::TickDone(report) => self.advance_reports.push((agent, report)),
            Message::PacketLog(records) => {
                self.packets.extend(records.into_iter().map(|record| (agent, record)));
            }
            Message::Goodbye => node.has_left = true,
            Message::Left(reason) => {
                node.has_left = true;
                self.departures.push((agent, reason));
            }
            // A message that only servers send, or that nodes send to each other: of a faulty program.
            _ => {}
        }
    }
}
