//! The server of a fleet: it has the world, hands each node its percept, takes the controls, and lets the world go on.
//!
//! ```text
//! muster.rs    nodes join, until all are there       seat.rs      the known state of a node
//! lockstep.rs  waits for every control               realtime.rs  each cycle is a deadline
//! rounds.rs    sights out and controls in            missing.rs   nodes not heard
//! ticks.rs     counted time, on a network with faults
//! ```
//!
//! It names no socket: all its words go over [`Mail`].

mod lockstep;
mod missing;
mod muster;
mod realtime;
mod rounds;
mod seat;
pub mod tally;
mod ticks;

use crate::mail::{Heard, Mail};
use crate::stage::Stage;
use crate::wire::Party;
use crate::words::{Clock, Fingerprint, Logged, Ticked, Welcome, Word};
pub use missing::SILENT;
pub use seat::Seat;
use sidestep::kernel::view::Frame;
use sidestep::kernel::{Cycle, EntityId};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use tally::Histogram;

/// The longest wait of the server before it looks around.
const LOOK: Duration = Duration::from_millis(20);

/// Time between two signs of life to all nodes.
const BEAT: Duration = Duration::from_millis(500);

/// The terms on which nodes join, and how the fleet is flown.
#[derive(Debug, Clone)]
pub struct Terms {
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
pub enum Broken {
    /// It was asked to end.
    #[error("interrupted")]
    Stopped,
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

/// The fleet as seen by its [`Attendant`] now and then.
pub struct Look<'a> {
    /// The seats.
    pub seats: &'a BTreeMap<EntityId, Seat>,
    /// The counts of the server.
    pub tally: &'a Tally,
    /// The mail of the server.
    pub mail: &'a Mail,
    /// The stage.
    pub stage: &'a Stage,
    /// Whether all nodes are there.
    pub has_begun: bool,
    /// Agents for which all wait, because nothing is heard of their nodes.
    pub waits_for: &'a [EntityId],
}

/// An attendant, which looks after the fleet while the server waits.
pub trait Attendant {
    /// Looks at the fleet, 50 times a second or so. Returns the nodes that have ended, with the reason.
    ///
    /// # Errors
    /// When the fleet is to end.
    fn attend(&mut self, fleet: &Look<'_>) -> Result<Vec<(EntityId, String)>, Broken>;

    /// Takes packets that nodes have sent, where all are recorded: those of the cycles before the present one, each
    /// with its sender.
    fn take_packets(&mut self, _: Vec<(EntityId, Logged)>) {}

    /// Returns whether a watcher has no frame of this cycle yet.
    fn wants_frame(&self, _: Cycle) -> bool {
        false
    }

    /// Takes a frame that it wanted.
    fn take_frame(&mut self, _: Frame) {}

    /// Looks at the fleet when all nodes have sent their last words.
    fn look_back(&mut self, _: &Look<'_>) {}
}

/// Counts of a server.
#[derive(Debug, Clone, Default)]
pub struct Tally {
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
    mail: Mail,
    stage: &'a mut Stage,
    attendant: &'a mut dyn Attendant,
    terms: Terms,
    seats: BTreeMap<EntityId, Seat>,
    tally: Tally,
    has_begun: bool,
    /// Agents for which all wait, because nothing is heard of their nodes.
    waits_for: Vec<EntityId>,
    beat_at: Instant,
    look_at: Instant,
    /// Reports of nodes that have done a tick.
    ticked: Vec<(EntityId, Ticked)>,
    /// Packets that nodes have sent, where all are recorded.
    packets: Vec<(EntityId, Logged)>,
}

impl<'a> Server<'a> {
    /// Returns a server that no node has joined yet.
    pub fn new(
        mail: Mail,
        stage: &'a mut Stage,
        attendant: &'a mut dyn Attendant,
        terms: Terms,
    ) -> Self {
        let seats = stage.agents().map(|agent| (agent, Seat::default())).collect();
        let (beat_at, look_at) = (Instant::now(), Instant::now());
        let (tally, ticked, packets) = (Tally::default(), Vec::new(), Vec::new());
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
    pub fn run(mut self) -> (Result<(), Broken>, Tally) {
        let flown = self.muster().and_then(|()| self.fly());
        self.end();
        (flown, self.tally)
    }

    fn fly(&mut self) -> Result<(), Broken> {
        self.has_begun = true;
        match self.terms.welcome.clock {
            Clock::Lockstep => {
                while !self.stage.is_over() {
                    self.cycle_in_lockstep()?;
                }
                Ok(())
            }
            Clock::Realtime { speed } => self.fly_in_real_time(speed),
        }
    }

    /// Tells all nodes that the fleet has ended, and waits a little until they have sent their last words.
    fn end(&mut self) {
        let seated: Vec<EntityId> = self.seated().collect();
        seated.iter().for_each(|&agent| self.mail.letter(Party::Node(agent), Word::End));
        let until = Instant::now() + BEAT;
        while self.seated().any(|agent| !self.seats[&agent].has_left) && Instant::now() < until {
            if let Some(heard) = self.mail.receive(LOOK) {
                self.take(heard);
            }
        }
        self.attendant.take_packets(std::mem::take(&mut self.packets));
        self.waits_for.clear();
        self.show();
        let Self { mail, seats, tally, has_begun, stage, waits_for, .. } = self;
        let has_begun = *has_begun;
        self.attendant.look_back(&Look { seats, tally, mail, stage, has_begun, waits_for });
    }

    /// Agents with nodes that are there, rising.
    fn seated(&self) -> impl Iterator<Item = EntityId> + '_ {
        self.seats.iter().filter(|(_, seat)| seat.life().is_some()).map(|(&agent, _)| agent)
    }

    /// Hears the words that come within some time, at most until the next look around.
    ///
    /// # Errors
    /// When the fleet is to end.
    fn hear(&mut self, within: Duration) -> Result<(), Broken> {
        if let Some(heard) = self.mail.receive(within.min(LOOK)) {
            self.take(heard);
        }
        let now = Instant::now();
        if now >= self.look_at {
            // Words that came while this process stood still are heard before any node counts as missing.
            while let Some(heard) = self.mail.receive(Duration::ZERO) {
                self.take(heard);
            }
            self.look_at = now + LOOK;
            self.look_around(now)?;
        }
        Ok(())
    }

    fn look_around(&mut self, now: Instant) -> Result<(), Broken> {
        if now >= self.beat_at {
            self.beat_at = now + BEAT;
            let seated: Vec<EntityId> = self.seated().collect();
            seated.into_iter().for_each(|agent| self.mail.note(Party::Node(agent), Word::Beat));
        }
        self.show();
        let Self { mail, seats, tally, has_begun, stage, waits_for, .. } = self;
        let has_begun = *has_begun;
        let look = Look { seats, tally, mail, stage, has_begun, waits_for };
        let mut gone = self.attendant.attend(&look)?;
        let lease = self.terms.lease;
        let silent = self.seated().filter(|&agent| self.is_silent(agent, lease));
        let reason = || format!("not heard for {} s", lease.as_secs_f64());
        gone.extend(silent.map(|agent| (agent, reason())));
        gone.into_iter().try_for_each(|(agent, reason)| self.lose(agent, reason))?;
        self.note_waits();
        Ok(())
    }

    /// Shows the world to its watchers.
    fn show(&mut self) {
        if self.attendant.wants_frame(self.stage.cycle()) {
            self.attendant.take_frame(self.stage.frame());
        }
    }

    fn take(&mut self, Heard { from, life, word }: Heard) {
        let Party::Node(agent) = from else { return };
        if let Word::Join(join) = word {
            self.on_join(agent, life, join);
            return;
        }
        let Some(seat) = self.seats.get_mut(&agent).filter(|seat| seat.life() == Some(life)) else {
            return self.dismiss(agent, life);
        };
        match word {
            Word::Ready => seat.is_ready = true,
            Word::Status(status) => seat.status = status,
            Word::Control(control) => self.on_control(agent, control),
            Word::Ticked(ticked) => self.ticked.push((agent, ticked)),
            Word::Log(sent) => {
                self.packets.extend(sent.into_iter().map(|logged| (agent, logged)));
            }
            Word::Left => seat.has_left = true,
            // From a node, a word that only other parties send.
            _ => {}
        }
    }
}
