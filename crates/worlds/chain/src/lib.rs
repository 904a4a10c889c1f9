#![deny(clippy::disallowed_methods)]
//! Chains of connectors and rods that creep among obstacles.
//!
//! Source: "Serpentine motion" (Birbilis and Aspragathos, 2005); where this world departs from it,
//! the modules say why. The same code serves two and three dimensions.
//!
//! ```text
//! motion/: after a veto, out of the way                  script/: a turtle language for initiators
//! agents/: the program of a connector                    deploy/: agents on a network in memory; remote_agents.rs
//! ground/: sources of obstacles                          swarm/:  robots on wheels that follow a leader
//!
//! scenario.rs -> world.rs (immutable), state.rs (bodies), driver.rs (tasks)
//! one cycle: claim.rs (perceive.rs) -> join.rs -> act/ -> metrics.rs, events.rs, rows.rs
//! ```
//!
//! Chains, their constraints, and the propagation of one motion are the crate `sidestep-rods`; joints as rods, inverse
//! kinematics and plans are `sidestep-arms`.

mod act;
pub mod agents;
mod bundle;
mod claim;
mod clearance;
mod deferred;
mod deploy;
mod driver;
mod events;
mod external;
mod facts;
#[cfg(test)]
mod fixtures;
mod formation;
pub mod ground;
mod inspect;
mod join;
pub mod kinds;
mod metric_info;
pub mod metrics;
mod motion;
mod navigate;
mod neighbors;
mod own_parts;
mod perceive;
mod progress;
mod remarks;
mod remote_agents;
mod rows;
pub mod scenario;
mod scratch;
mod script;
mod state;
pub mod swarm;
mod text;
mod trace;
mod view;
mod world;
mod world_impl;
mod world_type;

pub use deploy::Deployment;
pub use driver::VetoRecord;
pub use driver::own_driver::{
    Driver, DriverAction, DriverMemory, DriverPercept, DriverRegistry, NearbyObstacle,
};
pub use motion::escape::{
    EscapeMethod, EscapePlan, EscapeReport, ObstacleEscapeInput, ObstacleEscapeRules,
    ObstacleEscaper,
};
pub use motion::recovery::{
    DirectMover, InitiatorSituation, RecoveryLadder, RecoveryLimits, RecoveryOutcome,
};
pub use own_parts::{CustomBehaviors, ReactionRegistry};
pub use sidestep_rods::{MasterMove, Reaction};
pub use state::{ChainBodyState, ChainBodyStateRef, ChainWorldState};
pub use world::ChainWorld;
pub use world_impl::{ChainRun, chain_run};
pub use world_type::Chains;

use scratch::Scratch;
use sidestep_kernel::conflict::ConflictGroups;
use sidestep_kernel::world::DecisionMode;
use sidestep_kernel::{EntitySlot, PhaseContext, Phases};
use std::ops::Range;

impl<const D: usize> Phases for ChainWorld<D> {
    const DECISION_MODE: DecisionMode = DecisionMode::Joint;

    type State = ChainWorldState<D>;
    type Scratch = Scratch<D>;

    fn new_scratch(&self) -> Scratch<D> {
        Scratch::new(self)
    }

    fn body_count(&self, state: &ChainWorldState<D>) -> usize {
        state.len()
    }

    fn claim(phase: &mut PhaseContext<'_, Self>, bodies: Range<usize>) {
        bodies.for_each(|slot| claim::claim_box_and_decide(phase, slot));
    }

    fn join(phase: &mut PhaseContext<'_, Self>, bodies: Range<usize>, groups: &ConflictGroups) {
        join::join_conflict_groups(phase, bodies, groups);
    }

    fn act(phase: &mut PhaseContext<'_, Self>, group: &mut [EntitySlot]) {
        act::act(phase, group);
    }
}
