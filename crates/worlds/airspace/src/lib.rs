#![deny(clippy::disallowed_methods)]
//! Airplanes that avoid each other by probability collectives.
//!
//! See `README.md` beside this file for the model, and the paper "Integration of Probability
//! Collectives for Collision Avoidance in AGENTFLY" (2009) for its source.
//!
//! Layers, from the bottom up; a module uses only those of its own layer and of the layers below it
//! (`xtask/layers.toml`):
//!
//! ```text
//! settings   settings/: choices and bounds of a scenario        purpose.rs: purposes of random draws
//! flight     flight/: motion, orders, tracks    areas/: areas   non_cooperative.rs, flight_plan.rs, generate.rs
//! shield     shield/: plans that stay safe forever              avoid.rs: paths clear of non-cooperative aircraft
//! agents     agents/: programs aboard, and their messages       objective.rs: the minimized cost    baseline/: ORCA, MVP
//!            measures/: definitions of conflict, well clear, fuel
//! pilot      pilot/: an aircraft from percept to control        world.rs (immutable)    decide.rs: candidates
//! act        perceive.rs -> join.rs -> act.rs: one cycle of dt  state.rs (mutable)    deploy/: pilots on a network in memory
//!            encounters/: conflicts, losses and violations of pairs in a run    surveillance/: reports and tracks of each observer
//! run        scenario.rs, world_impl.rs, view.rs, ...           what a run, a file or a caller needs of it
//! ```

mod act;
pub mod agents;
pub mod areas;
mod avoid;
pub mod baseline;
mod bundle;
mod decide;
pub mod deploy;
pub mod encounters;
pub mod events;
mod external;
pub mod external_action;
mod facts;
mod fleet;
pub mod flight;
mod flight_plan;
mod flown_leg;
mod generate;
mod import;
mod inspect;
mod join;
pub mod kinds;
pub mod measures;
pub mod method;
mod metric_info;
pub mod metrics;
mod non_cooperative;
pub mod objective;
mod perceive;
pub mod pilot;
mod purpose;
pub mod replica;
mod right_of_way;
mod rows;
pub mod scenario;
mod scratch;
pub mod settings;
pub mod shield;
pub mod state;
pub mod surveillance;
mod text;
mod trace;
pub mod traffic;
mod view;
pub mod world;
mod world_impl;
mod world_type;

pub use decide::{OptimizationRecord, OptimizationStats};
pub use fleet::RemotePilotRun;
use scratch::PhaseContext;
pub use scratch::Scratch;
use sidestep_kernel::conflict::ConflictGroups;
use sidestep_kernel::world::DecisionMode;
use sidestep_kernel::{EntitySlot, Phases};
use state::AirspaceState;
use std::ops::Range;
pub use world::AirspaceWorld;
pub use world_impl::{AirspaceRun, Collector, airspace_run};
pub use world_type::Airspace;

impl Phases for AirspaceWorld {
    const DECISION_MODE: DecisionMode = DecisionMode::Joint;

    type State = AirspaceState;
    type Scratch = Scratch;

    fn new_scratch(&self) -> Scratch {
        Scratch::default()
    }

    fn body_count(&self, _: &AirspaceState) -> usize {
        self.airplanes.len()
    }

    fn claim(context: &mut PhaseContext<'_>, bodies: Range<usize>) {
        perceive::claim(context, bodies);
    }

    fn join(context: &mut PhaseContext<'_>, bodies: Range<usize>, groups: &ConflictGroups) {
        join::join(&mut under_rules_of_now(context), bodies, groups);
    }

    fn act(context: &mut PhaseContext<'_>, group: &mut [EntitySlot]) {
        act::act(&mut under_rules_of_now(context), group);
    }
}

/// Returns a worker's turn under the rules that hold in its cycle.
fn under_rules_of_now<'a>(context: &'a mut PhaseContext<'_>) -> PhaseContext<'a> {
    PhaseContext {
        world: context.world.with_rules_of(context.now),
        state: context.state,
        now: context.now,
        clock: context.clock,
        scratch: context.scratch,
    }
}
