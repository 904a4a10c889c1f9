#![deny(clippy::disallowed_methods)]
//! Airplanes that avoid each other by probability collectives.
//!
//! See `README.md` beside this file for the model, and the paper "Integration of Probability
//! Collectives for Collision Avoidance in AGENTFLY" (2009) for its source.
//!
//! ```text
//! scenario.rs, flight_plan.rs, generate.rs -> world.rs (immutable), state.rs (cells)
//! perceive.rs -> join.rs -> decide.rs -> act.rs                            one cycle of dt
//! flight/: motion, orders, tracks       objective.rs: the minimized cost    behind it
//! shield/: plans that stay safe forever    agents/: programs aboard, and their messages
//! pilot/: an airplane from sight to control    deploy/: pilots on a network in memory
//! intruder.rs: airplanes that mind no other    outside.rs, wish.rs: decisions from outside
//! baseline/: other methods              metrics.rs: the sums of a run
//! ```

mod act;
pub mod agents;
mod avoid;
pub mod baseline;
mod bundle;
mod decide;
pub mod deploy;
pub mod events;
mod external;
pub mod external_action;
pub mod flight;
mod flight_plan;
mod generate;
mod import;
mod inspect;
mod join;
mod memory;
mod metric_info;
pub mod metrics;
mod non_cooperative;
pub mod objective;
mod perceive;
pub mod pilot;
mod purpose;
mod rows;
pub mod scenario;
pub mod shield;
pub mod state;
mod text;
mod trace;
pub mod traffic;
mod view;
pub mod world;
mod world_impl;
mod world_type;

use agents::network_traffic::NetworkTraffic;
pub use decide::{Optimization, OptimizationStats};
use events::Event;
use rows::FlownLeg;
use sidestep_kernel::conflict::ConflictGroups;
use sidestep_kernel::world::DecisionMode;
use sidestep_kernel::{Cycle, Phases, Slot};
use state::{AirspaceState, PairRecord};
use std::collections::BTreeMap;
use std::ops::Range;
pub use world::AirspaceWorld;
pub use world_impl::{AirspaceRun, Collector, airspace_run};
pub use world_type::Airspace;

/// A worker's turn in one phase of one cycle.
type PhaseContext<'a> = sidestep_kernel::PhaseContext<'a, AirspaceWorld>;

/// A worker's buffers and sums, kept between tasks.
#[derive(Debug, Default)]
pub struct Scratch {
    /// Pairs that came near each other.
    pairs: BTreeMap<(Slot, Slot), PairRecord>,
    optimizations: Vec<Optimization>,
    /// Beacons by which airplanes have found their groups.
    grouped: NetworkTraffic,
    /// Messages and bytes that the shield has sent.
    exchanged: NetworkTraffic,
    events: Vec<Event>,
    flown: Vec<FlownLeg>,
    /// Pairs that were named, for which the shield promises nothing: cycle and both airplanes.
    too_close: Vec<(Cycle, Slot, Slot)>,
    /// Processor time spent deciding, in nanoseconds: reported beside the results, never part of
    /// them.
    decide_ns: u64,
    flying: Vec<Slot>,
    /// Notes for an inspection of an airplane; none in a run.
    trace: Option<Box<trace::InspectionTrace>>,
}

impl Phases for AirspaceWorld {
    const DECISION_MODE: DecisionMode = DecisionMode::Joint;

    type State = AirspaceState;
    type Scratch = Scratch;

    fn scratch(&self) -> Scratch {
        Scratch::default()
    }

    fn bodies(&self, _: &AirspaceState) -> usize {
        self.airplanes.len()
    }

    fn claim(turn: &mut PhaseContext<'_>, bodies: Range<usize>) {
        perceive::claim(turn, bodies);
    }

    fn join(turn: &mut PhaseContext<'_>, bodies: Range<usize>, groups: &ConflictGroups) {
        join::join(turn, bodies, groups);
    }

    fn act(turn: &mut PhaseContext<'_>, group: &mut [Slot]) {
        act::act(turn, group);
    }
}
