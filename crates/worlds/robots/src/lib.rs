#![deny(clippy::disallowed_methods)]
//! Stochastic situated agents on a grid: robots whose sensors lie and whose wheels slip.
//!
//! See `README.md` beside this file for the model, and the paper "A parallel simulation of
//! stochastic agent/environment interaction" (2001) for its source.
//!
//! ```text
//! scenario.rs -> world.rs (immutable), state.rs (columns)
//! perceive.rs + decide.rs  ->  resolve.rs  ->  react.rs        one cycle
//! sensor.rs, ray.rs, effector.rs: the tables behind it         metrics.rs: what came of it
//! ```

mod audit;
pub mod baseline;
pub mod bundle;
pub mod decide;
pub mod effector;
pub mod exact;
mod kind;
pub mod learn;
pub mod metrics;
mod perceive;
pub mod ray;
mod react;
pub mod resolve;
mod rounds;
pub mod rows;
pub mod run;
pub mod scenario;
pub mod sensor;
pub mod state;
mod view;
mod words;
pub mod world;

use effector::Side;
pub use kind::Robots;
use resolve::ConflictPolicy;
pub use run::{RobotsRun, robots_run};
use scenario::StorageOrder;
use sensor::Reading;
use sidestep_kernel::conflict::Groups;
use sidestep_kernel::world::Auction;
use sidestep_kernel::{Cycle, EntityId, Phases, Slot, Turn};
use state::RobotsState;
use std::ops::Range;
pub use world::RobotsWorld;

/// Something that happened to a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Event {
    /// When.
    pub cycle: Cycle,
    /// To whom.
    pub body: EntityId,
    /// What.
    pub event: EventKind,
}

/// What can happen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventKind {
    /// A robot's action met something.
    Contact {
        /// Kind of the thing.
        kind: u8,
        /// Side of the robot.
        side: Side,
    },
    /// A door has opened.
    Opened,
    /// A door has closed.
    Closed,
}

/// One beam's truth and report, kept where a log for learning is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SensorSample {
    /// When.
    pub cycle: Cycle,
    /// Whose.
    pub robot: EntityId,
    /// Which of its sensors.
    pub sensor: u16,
    /// What the beam met.
    pub truth: Reading,
    /// What it reported.
    pub reported: Reading,
}

/// What one action came to, kept where a log for learning is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotionSample {
    /// When.
    pub cycle: Cycle,
    /// Whose.
    pub robot: EntityId,
    /// Which action.
    pub action: u8,
    /// Boxes moved ahead.
    pub ahead: i32,
    /// Boxes moved to the left.
    pub left: i32,
    /// Quarter turns to the left that were made; an action that ends in a contact makes none.
    pub quarter_turns: u8,
    /// Whether an obstacle cut it.
    pub contact: bool,
}

/// What a worker keeps between tasks.
#[derive(Debug, Default)]
pub struct Scratch {
    readings: Vec<Reading>,
    /// What a sensor's beams truly meet.
    truths: Vec<sensor::Row>,
    heard: Vec<decide::Heard>,
    order: Vec<resolve::Place>,
    bids: Vec<rounds::Bid>,
    keep_events: bool,
    keep_samples: bool,
    events: Vec<Event>,
    sensor_samples: Vec<SensorSample>,
    motion_samples: Vec<MotionSample>,
}

impl Phases for RobotsWorld {
    type State = RobotsState;
    type Scratch = Scratch;

    fn scratch(&self) -> Scratch {
        Scratch::default()
    }

    fn bodies(&self, _: &RobotsState) -> usize {
        self.bodies.len()
    }

    fn arrange(&self, state: &mut RobotsState) {
        if self.storage == StorageOrder::Spatial {
            state.arrange(self);
        }
    }

    #[inline]
    fn claim(turn: &mut Turn<'_, Self>, bodies: Range<usize>) {
        for slot in bodies {
            turn.world.perceive_one(turn.state, turn.now, slot as Slot, turn.scratch);
        }
    }

    #[inline]
    fn join(turn: &mut Turn<'_, Self>, bodies: Range<usize>, groups: &Groups) {
        for slot in bodies {
            turn.world.join_one(turn.state, slot as Slot, groups);
        }
    }

    #[inline]
    fn act(turn: &mut Turn<'_, Self>, group: &mut [Slot]) {
        let &mut Turn { world, state, now, ref mut scratch, .. } = turn;
        if let [alone] = *group {
            return world.act_drawn(state, now, alone, scratch);
        }
        world.order(state, now, group, scratch);
        let order = std::mem::take(&mut scratch.order);
        for place in &order {
            world.act(state, now, place.slot, place.word, scratch);
        }
        scratch.order = order;
    }

    fn auction(&self) -> Option<&dyn Auction<Self>> {
        (self.policy == ConflictPolicy::Rounds).then_some(self)
    }
}

impl Auction<Self> for RobotsWorld {
    fn bid(&self, turn: &mut Turn<'_, Self>, body: Slot) {
        self.bid_one(turn.state, turn.now, body, turn.scratch);
    }

    fn act_on_bids(&self, turn: &mut Turn<'_, Self>, pending: &mut Vec<Slot>) {
        pending.clear();
        for k in 0..turn.scratch.bids.len() {
            let bid = turn.scratch.bids[k];
            if self.is_highest(turn.state, bid) {
                self.act(turn.state, turn.now, bid.slot, bid.word, turn.scratch);
            } else {
                pending.push(bid.slot);
            }
        }
    }

    fn retract_bids(&self, turn: &mut Turn<'_, Self>) {
        for bid in turn.scratch.bids.drain(..) {
            self.retract(turn.state, bid);
        }
    }
}
