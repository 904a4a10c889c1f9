#![deny(clippy::disallowed_methods)]
//! Stochastic situated agents on a grid: robots with sensors that lie and wheels that slip.
//!
//! See `README.md` beside this file for the model, and the paper "A parallel simulation of
//! stochastic agent/environment interaction" (2001) for its source.
//!
//! ```text
//! scenario.rs -> world.rs (immutable), state.rs (columns)
//! perceive.rs + decide.rs  ->  join.rs  ->  act.rs, auction.rs, simultaneous/   one cycle
//! plan.rs: before a cycle, the planners of teams (team.rs)      action_progress.rs, long_action.rs: actions of several cycles
//! errands.rs: the tasks of teams      run_plan.rs: the plan of a run without errors, for vehicles
//! agents.rs: a robot's program outside of a run      remote_agents.rs: its percepts, and the controls that a run takes
//! drive/: a robot outside of the simulator, by its own measurements
//! action.rs, alias_table.rs: the error models, prepared         metrics.rs: the sums of a run
//! broadcast.rs: the words of the radio          watch/: who comes nearer to its goal, and gridlocks
//! ```

mod act;
mod action;
mod action_progress;
pub mod agents;
mod alias_table;
mod auction;
mod audit;
pub mod baseline;
mod belief;
mod broadcast;
mod bundle;
mod calibration_rows;
mod contact_remarks;
mod cycle_context;
pub mod decide;
mod delay;
mod delayed_turn;
pub mod drive;
mod errand_fields;
mod errands;
pub mod exact;
mod external;
mod facts;
pub mod goal_agent;
mod goal_distances;
mod grid_team;
mod import;
mod inspect;
mod join;
pub mod kinds;
mod long_action;
mod metric_info;
pub mod metrics;
mod odometry;
mod perceive;
mod plan;
pub mod policy;
pub mod progress;
mod purpose;
mod ranges;
mod remarks;
mod remote_agents;
mod reports;
mod routes;
pub mod rows;
mod run_plan;
pub mod scenario;
mod simultaneous;
pub mod state;
mod submitted_controls;
mod table_notes;
mod team;
mod team_delays;
mod team_memory;
mod team_situation;
mod team_words;
#[cfg(test)]
mod test_runs;
mod text;
mod view;
mod watch;
pub mod world;
pub mod world_impl;
mod world_type;

use cycle_context::with_cycle;
use effector::Side;
pub use metrics::heap_bytes;
use policy::ConflictPolicy;
use progress::GridlockEvent;
pub use run_plan::RunPlan;
use sensor::Reading;
pub use sidestep_error_models::{effector, sensor};
use sidestep_kernel::conflict::ConflictGroups;
use sidestep_kernel::world::Auction;
use sidestep_kernel::{Cycle, EntityId, EntitySlot, PhaseContext, Phases};
use state::RobotsState;
use std::ops::Range;
pub use world::RobotsWorld;
use world::StorageOrder;
pub use world_impl::{RobotsRun, robots_run};
pub use world_type::Robots;

/// Something that happened to a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Event {
    /// Cycle in which it happened.
    pub cycle: Cycle,
    /// The body that it happened to.
    pub body: EntityId,
    /// Column and row of its lower-left box, where it then is.
    pub at: (u32, u32),
    /// The kind of event, with its details.
    pub event: EventKind,
}

/// What happened. People's contacts are no events: they just try another time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventKind {
    /// A robot's action ran into something.
    Contact {
        /// Kind of the obstacle.
        kind: u8,
        /// Side of the robot that touched it.
        side: Side,
        /// The body touched; none for a wall.
        with: Option<EntityId>,
    },
    /// A door has opened: its boxes are free for bodies that act later in the same cycle.
    DoorOpened,
    /// A door has closed, after it has waited until no body stood in it.
    DoorClosed,
}

/// An event of a run, as its table and viewers have it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RobotsEvent {
    /// Of one body.
    Body(Event),
    /// Of robots that wait for each other.
    Gridlock(GridlockEvent),
}

impl RobotsEvent {
    /// Returns the cycle in which it happened.
    pub fn cycle(&self) -> Cycle {
        match self {
            Self::Body(event) => event.cycle,
            Self::Gridlock(event) => event.cycle,
        }
    }

    /// Returns the body that it happened to, the first of several.
    pub fn body(&self) -> EntityId {
        match self {
            Self::Body(event) => event.body,
            Self::Gridlock(event) => event.gridlock.robots.first().copied().unwrap_or_default(),
        }
    }
}

/// The true and the reported reading of one beam, kept where a log for learning is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SensorSample {
    /// Cycle of the reading.
    pub cycle: Cycle,
    /// The robot that carries the sensor.
    pub robot: EntityId,
    /// Number of the sensor on its robot, from 0.
    pub sensor: u16,
    /// The true reading: the first obstacle that the beam meets.
    pub truth: Reading,
    /// What the robot perceived; equal to `truth` unless the sensor erred.
    pub reported: Reading,
}

/// The range of one beam of a sensor that measures ranges, kept where a log for learning is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeSample {
    /// Cycle of the reading.
    pub cycle: Cycle,
    /// The robot that carries the sensor.
    pub robot: EntityId,
    /// Number of the sensor on its robot, from 0.
    pub sensor: u16,
    /// Number of the beam, from 0 in the order of the sensor's bearings.
    pub beam: u16,
    /// Distance in meters to the first obstacle that the beam meets; `None` without one in range.
    pub true_m: Option<f64>,
    /// The range in meters that the robot perceived; `None` for no echo.
    pub reported_m: Option<f64>,
}

/// The result of one action, kept where a log for learning is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotionSample {
    /// Cycle of the action.
    pub cycle: Cycle,
    /// The robot that acted.
    pub robot: EntityId,
    /// Number of the action in the robot's effector.
    pub action: u8,
    /// Boxes moved ahead.
    pub ahead: i32,
    /// Boxes moved to the left.
    pub left: i32,
    /// Quarter turns to the left that were made; an action that ends in a contact makes none.
    pub quarter_turns: u8,
    /// Whether an obstacle cut it short.
    pub contact: bool,
    /// Cycles for which it was delayed.
    pub delay_cycles: u32,
}

/// A worker's buffers and sums, kept between tasks.
#[derive(Debug, Default)]
pub struct Scratch {
    readings: Vec<Reading>,
    /// The rows of the readings that a sensor's beams truly have.
    truths: Vec<alias_table::RowIndex>,
    heard: Vec<decide::ReceivedMessage>,
    /// A conflict group in its order of acting.
    order: Vec<join::GroupMember>,
    /// What the bodies of a group do, where they act at once.
    group_moves: simultaneous::GroupMoves,
    /// This worker's bids of a round.
    bids: Vec<auction::Bid>,
    /// The kinds of rows that are wanted, see `Collector::prepare`.
    keep_events: bool,
    keep_readings: bool,
    keep_motions: bool,
    events: Vec<Event>,
    sensor_samples: Vec<SensorSample>,
    range_samples: Vec<RangeSample>,
    motion_samples: Vec<MotionSample>,
    /// The percepts of robots in their order of deciding, where these decide outside of the run.
    percept_log: Option<Vec<agents::RobotPercept>>,
    /// Whether that has robots that follow the orders of a caller, rather than the others.
    logs_external: bool,
}

impl Phases for RobotsWorld {
    type State = RobotsState;
    type Scratch = Scratch;

    fn new_scratch(&self) -> Scratch {
        Scratch::default()
    }

    fn body_count(&self, _: &RobotsState) -> usize {
        self.bodies.len()
    }

    fn reorder_slots(&self, state: &mut RobotsState) {
        if self.storage == StorageOrder::Spatial {
            state.arrange(self);
        }
    }

    fn has_plan(&self) -> bool {
        !self.planner_teams.is_empty() || self.has_long_actions || !self.delay_teams.is_empty()
    }

    fn plan(phase: &mut PhaseContext<'_, Self>) {
        phase.world.plan(phase.state, phase.now);
    }

    #[inline]
    fn claim(phase: &mut PhaseContext<'_, Self>, bodies: Range<usize>) {
        with_cycle!(phase.world, phase.state, phase.now, |cycle| {
            bodies.for_each(|slot| cycle.perceive(slot as EntitySlot, phase.scratch));
        });
    }

    #[inline]
    fn join(phase: &mut PhaseContext<'_, Self>, bodies: Range<usize>, groups: &ConflictGroups) {
        with_cycle!(phase.world, phase.state, phase.now, |cycle| {
            bodies.for_each(|slot| cycle.join(slot as EntitySlot, groups));
        });
    }

    #[inline]
    fn act(phase: &mut PhaseContext<'_, Self>, group: &mut [EntitySlot]) {
        with_cycle!(phase.world, phase.state, phase.now, |cycle| {
            // Most groups are one body, which needs no order.
            if let [alone] = *group {
                return cycle.act_with_draw(alone, phase.scratch);
            }
            cycle.order(group, phase.scratch);
            if cycle.world.policy == ConflictPolicy::Simultaneous {
                return cycle.act_at_once(phase.scratch);
            }
            // Taken out, because acting borrows the whole scratch.
            let order = std::mem::take(&mut phase.scratch.order);
            for member in &order {
                cycle.act(member.slot, member.word, phase.scratch);
            }
            phase.scratch.order = order;
        });
    }

    fn auction(&self) -> Option<&dyn Auction<Self>> {
        (self.policy == ConflictPolicy::Rounds).then_some(self)
    }
}
