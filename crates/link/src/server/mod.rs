//! The server of a fleet: it has the world, hands each node its percept, takes the controls, and lets the world go on.
//!
//! ```text
//! muster.rs    nodes join, until all are there       seat.rs      the known state of a node
//! lockstep.rs  waits for every control               realtime.rs  each cycle is a deadline
//! rounds.rs    sights out and controls in            missing.rs   nodes not heard
//! ticks.rs     counted time, on a network with faults
//! ```
//!
//! It names no socket: all its words go over [`Messenger`].

pub mod histogram;
mod join;
mod liveness;
mod lockstep;
mod node_entry;
mod realtime;
mod rounds;
mod ticks;

use crate::hosted_run::HostedRun;
use crate::messenger::{Messenger, Received};
use crate::protocol::{AdvanceDone, ClockMode, Fingerprint, Message, PacketRecord, Welcome};
use crate::wire::Peer;
use histogram::Histogram;
pub use liveness::SILENCE_TIMEOUT;
pub use node_entry::NodeEntry;
use sidestep::kernel::view::Frame;
use sidestep::kernel::{Cycle, EntityId};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// The longest wait of the server before it looks around.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Time between two signs of life to all nodes.
const HEARTBEAT_INTERVAL: Duration = Duration::from_millis(500);

/// The terms on which nodes join, and how the fleet is flown.
#[derive(Debug, Clone)]
pub struct ServerConfig {
    /// Fingerprint of the scenario.
    pub scenario: Fingerprint,
    /// The build of the program.
    pub build: String,
    /// The answer to nodes that may join.
    pub welcome: Welcome,
    /// Time after which a node that is not heard counts as gone.
    pub lease: Duration,
    /// Whether packets may be lost, delayed or doubled, so that lockstep counts time in ticks.
    pub has_faults: bool,
}

/// The reason why a fleet ends before its world.
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    /// It was asked to end.
    #[error("interrupted")]
    Interrupted,
    /// A node is gone, and lockstep does not go on without it.
    #[error("the node of {agent} is gone in cycle {cycle}: {reason}")]
    Gone {
        /// Its agent, by its name for people.
        agent: String,
        /// The cycle.
        cycle: Cycle,
        /// The reason.
        reason: String,
    },
    /// The world cannot go on.
    #[error(transparent)]
    World(#[from] sidestep_session::Error),
}

/// The fleet as seen by its [`ServerHooks`] now and then.
pub struct FleetView<'a> {
    /// The seats.
    pub seats: &'a BTreeMap<EntityId, NodeEntry>,
    /// The counts of the server.
    pub tally: &'a ServerMetrics,
    /// The mail of the server.
    pub mail: &'a Messenger,
    /// The stage.
    pub stage: &'a HostedRun,
    /// Whether all nodes are there.
    pub has_begun: bool,
    /// Agents for which all wait, because nothing is heard of their nodes.
    pub waits_for: &'a [EntityId],
}

/// An attendant, which looks after the fleet while the server waits.
pub trait ServerHooks {
    /// Looks at the fleet, 50 times a second or so. Returns the nodes that have ended, with the reason.
    ///
    /// # Errors
    /// When the fleet is to end.
    fn on_poll(&mut self, fleet: &FleetView<'_>) -> Result<Vec<(EntityId, String)>, FleetError>;

    /// Takes packets that nodes have sent, where all are recorded: those of the cycles before the present one, each
    /// with its sender.
    fn on_packets(&mut self, _: Vec<(EntityId, PacketRecord)>) {}

    /// Returns whether a watcher has no frame of this cycle yet.
    fn wants_frame(&self, _: Cycle) -> bool {
        false
    }

    /// Takes a frame that it wanted.
    fn on_frame(&mut self, _: Frame) {}

    /// Looks at the fleet when all nodes have sent their last words.
    fn on_end(&mut self, _: &FleetView<'_>) {}
}

/// Counts of a server.
#[derive(Debug, Clone, Default)]
pub struct ServerMetrics {
    /// Time from the sights to the last control of a cycle.
    pub talked: Histogram,
    /// Time to advance the world by one cycle.
    pub advanced: Histogram,
    /// Lateness of cycles: the delay between the due time and the start of one, in real time.
    pub late: Histogram,
    /// Number of cycles that began later than a tenth of their length.
    pub late_cycles: u64,
    /// Number of controls that were not there in time.
    pub late_controls: u64,
    /// Number of controls that made no sense.
    pub absurd_controls: u64,
    /// Nodes that were refused, by reason.
    pub refused: BTreeMap<&'static str, u64>,
}

/// The server of a fleet.
pub struct Server<'a> {
    mail: Messenger,
    stage: &'a mut HostedRun,
    attendant: &'a mut dyn ServerHooks,
    terms: ServerConfig,
    seats: BTreeMap<EntityId, NodeEntry>,
    tally: ServerMetrics,
    has_begun: bool,
    /// Agents for which all wait, because nothing is heard of their nodes.
    waits_for: Vec<EntityId>,
    beat_at: Instant,
    look_at: Instant,
    /// Reports of nodes that have done a tick.
    ticked: Vec<(EntityId, AdvanceDone)>,
    /// Packets that nodes have sent, where all are recorded.
    packets: Vec<(EntityId, PacketRecord)>,
}

impl<'a> Server<'a> {
    /// Returns a server that no node has joined yet.
    pub fn new(
        mail: Messenger,
        stage: &'a mut HostedRun,
        attendant: &'a mut dyn ServerHooks,
        terms: ServerConfig,
    ) -> Self {
        let seats = stage.agents().map(|agent| (agent, NodeEntry::default())).collect();
        let (beat_at, look_at) = (Instant::now(), Instant::now());
        let (tally, ticked, packets) = (ServerMetrics::default(), Vec::new(), Vec::new());
        Self {
            mail,
            stage,
            attendant,
            terms,
            seats,
            tally,
            has_begun: false,
            waits_for: Vec::new(),
            beat_at,
            look_at,
            ticked,
            packets,
        }
    }

    /// Waits for all nodes, and flies the world to its end. The nodes are told to end in any case.
    ///
    /// # Errors
    /// When it ends before.
    pub fn run(mut self) -> (Result<(), FleetError>, ServerMetrics) {
        let flown = self.wait_for_nodes().and_then(|()| self.fly());
        self.shut_down();
        (flown, self.tally)
    }

    fn fly(&mut self) -> Result<(), FleetError> {
        self.has_begun = true;
        match self.terms.welcome.clock {
            ClockMode::Lockstep => {
                while !self.stage.is_over() {
                    self.run_lockstep_cycle()?;
                }
                Ok(())
            }
            ClockMode::Realtime { speed } => self.fly_in_real_time(speed),
        }
    }

    /// Tells all nodes that the fleet has ended, and waits a little until they have sent their last words.
    fn shut_down(&mut self) {
        let seated: Vec<EntityId> = self.joined_agents().collect();
        seated.iter().for_each(|&agent| self.mail.send_reliable(Peer::Node(agent), Message::End));
        let until = Instant::now() + HEARTBEAT_INTERVAL;
        while self.joined_agents().any(|agent| !self.seats[&agent].has_left)
            && Instant::now() < until
        {
            if let Some(heard) = self.mail.receive(POLL_INTERVAL) {
                self.on_message(heard);
            }
        }
        self.attendant.on_packets(std::mem::take(&mut self.packets));
        self.waits_for.clear();
        self.publish_frame();
        let Self { mail, seats, tally, has_begun, stage, waits_for, .. } = self;
        let has_begun = *has_begun;
        self.attendant.on_end(&FleetView { seats, tally, mail, stage, has_begun, waits_for });
    }

    /// Agents with nodes that are there, rising.
    fn joined_agents(&self) -> impl Iterator<Item = EntityId> + '_ {
        self.seats.iter().filter(|(_, seat)| seat.incarnation().is_some()).map(|(&agent, _)| agent)
    }

    /// Hears the words that come within some time, at most until the next look around.
    ///
    /// # Errors
    /// When the fleet is to end.
    fn receive(&mut self, within: Duration) -> Result<(), FleetError> {
        if let Some(heard) = self.mail.receive(within.min(POLL_INTERVAL)) {
            self.on_message(heard);
        }
        let now = Instant::now();
        if now >= self.look_at {
            // Words that came while this process stood still are heard before any node counts as missing.
            while let Some(heard) = self.mail.receive(Duration::ZERO) {
                self.on_message(heard);
            }
            self.look_at = now + POLL_INTERVAL;
            self.poll(now)?;
        }
        Ok(())
    }

    fn poll(&mut self, now: Instant) -> Result<(), FleetError> {
        if now >= self.beat_at {
            self.beat_at = now + HEARTBEAT_INTERVAL;
            let seated: Vec<EntityId> = self.joined_agents().collect();
            seated
                .into_iter()
                .for_each(|agent| self.mail.send_best_effort(Peer::Node(agent), Message::Beat));
        }
        self.publish_frame();
        let Self { mail, seats, tally, has_begun, stage, waits_for, .. } = self;
        let has_begun = *has_begun;
        let look = FleetView { seats, tally, mail, stage, has_begun, waits_for };
        let mut gone = self.attendant.on_poll(&look)?;
        let lease = self.terms.lease;
        let silent = self.joined_agents().filter(|&agent| self.is_silent(agent, lease));
        let reason = || format!("not heard for {} s", lease.as_secs_f64());
        gone.extend(silent.map(|agent| (agent, reason())));
        gone.into_iter().try_for_each(|(agent, reason)| self.mark_lost(agent, reason))?;
        self.report_waits();
        Ok(())
    }

    /// Shows the world to its watchers.
    fn publish_frame(&mut self) {
        if self.attendant.wants_frame(self.stage.cycle()) {
            self.attendant.on_frame(self.stage.frame());
        }
    }

    fn on_message(&mut self, Received { from, life, word }: Received) {
        let Peer::Node(agent) = from else { return };
        if let Message::Join(join) = word {
            self.on_join(agent, life, join);
            return;
        }
        let Some(seat) = self.seats.get_mut(&agent).filter(|seat| seat.incarnation() == Some(life))
        else {
            return self.dismiss(agent, life);
        };
        match word {
            Message::Ready => seat.is_ready = true,
            Message::Status(status) => seat.status = status,
            Message::Control(control) => self.on_control(agent, control),
            Message::Ticked(ticked) => self.ticked.push((agent, ticked)),
            Message::Log(sent) => {
                self.packets.extend(sent.into_iter().map(|logged| (agent, logged)));
            }
            Message::Left => seat.has_left = true,
            // From a node, a word that only other parties send.
            _ => {}
        }
    }
}
