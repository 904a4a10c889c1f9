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
pub mod flight;
mod flight_plan;
mod foreign;
mod generate;
mod inspect;
mod intruder;
mod join;
mod kind;
mod meanings;
mod memory;
pub mod metrics;
mod notes;
pub mod objective;
mod outside;
mod perceive;
pub mod pilot;
mod purpose;
mod rows;
mod run;
pub mod scenario;
pub mod shield;
pub mod state;
pub mod traffic;
mod view;
pub mod wish;
mod words;
pub mod world;

use agents::traffic::Traffic;
pub use decide::{Effort, Optimization};
use events::Event;
pub use kind::Airspace;
use rows::FlownLeg;
pub use run::{AirspaceRun, Books, airspace_run};
use sidestep_kernel::conflict::Groups;
use sidestep_kernel::world::Decides;
use sidestep_kernel::{Cycle, Phases, Slot};
use state::{AirspaceState, PairRecord};
use std::collections::BTreeMap;
use std::ops::Range;
pub use world::AirspaceWorld;

/// A worker's turn in one phase of one cycle.
type Turn<'a> = sidestep_kernel::Turn<'a, AirspaceWorld>;

/// A worker's buffers and sums, kept between tasks.
#[derive(Debug, Default)]
pub struct Scratch {
    /// Pairs that came near each other.
    pairs: BTreeMap<(Slot, Slot), PairRecord>,
    optimizations: Vec<Optimization>,
    /// Beacons by which airplanes have found their groups.
    grouped: Traffic,
    /// Messages and bytes that the shield has sent.
    exchanged: Traffic,
    events: Vec<Event>,
    flown: Vec<FlownLeg>,
    /// Pairs that were named, for which the shield promises nothing: cycle and both airplanes.
    too_close: Vec<(Cycle, Slot, Slot)>,
    /// Processor time spent deciding, in nanoseconds: reported beside the results, never part of
    /// them.
    decide_ns: u64,
    flying: Vec<Slot>,
    /// Notes for an inspection of an airplane; none in a run.
    notes: Option<Box<notes::Notes>>,
}

impl Phases for AirspaceWorld {
    const DECIDES: Decides = Decides::Together;

    type State = AirspaceState;
    type Scratch = Scratch;

    fn scratch(&self) -> Scratch {
        Scratch::default()
    }

    fn bodies(&self, _: &AirspaceState) -> usize {
        self.airplanes.len()
    }

    fn claim(turn: &mut Turn<'_>, bodies: Range<usize>) {
        perceive::claim(turn, bodies);
    }

    fn join(turn: &mut Turn<'_>, bodies: Range<usize>, groups: &Groups) {
        join::join(turn, bodies, groups);
    }

    fn act(turn: &mut Turn<'_>, group: &mut [Slot]) {
        act::act(turn, group);
    }
}
