#![deny(clippy::disallowed_methods)]
//! Chains of connectors and rods that creep among obstacles.
//!
//! Source: "Serpentine motion" (Birbilis and Aspragathos, 2005); where this world departs from it,
//! the modules say why. The same code serves two and three dimensions.
//!
//! ```text
//! rods/:   chains, constraints, propagation, search      arms/:   joints as rods, inverse kinematics
//! motion/: after a veto, out of the way                  script/: a turtle language for initiators
//! agents/: the program aboard a connector                deploy/: agents on a network in memory; elsewhere.rs
//! ground/: sources of obstacles                          swarm/:  robots on wheels that follow a leader
//!
//! scenario.rs -> world.rs (immutable), state.rs (bodies), driver.rs (tasks)
//! one cycle: claim.rs (perceive.rs) -> join.rs -> act/ -> metrics.rs, events.rs, rows.rs
//! ```
//!
//! `rods` and `arms` know neither the world nor runs: they can be used as a library, without
//! cycles.

mod act;
pub mod agents;
pub mod arms;
mod bundle;
mod claim;
mod clearance;
pub mod convoy;
mod deploy;
mod driver;
mod elsewhere;
mod events;
mod formation;
pub mod ground;
mod inspect;
mod join;
mod kind;
mod meanings;
pub mod metrics;
mod motion;
mod navigate;
mod neighbors;
mod notes;
mod outside;
mod perceive;
mod progress;
mod put_off;
mod remarks;
pub mod rods;
mod rows;
mod run;
pub mod scenario;
#[cfg(test)]
mod scenes;
mod scratch;
mod script;
mod state;
pub mod swarm;
mod view;
mod words;
mod world;

pub use arms::{ik, kinematics};
pub use deploy::Deployment;
pub use kind::Chains;
pub use motion::escape::{Escape, Escaped, Escaper, Method, WayOut};
pub use motion::replan::{Climbed, Ladder, Rungs, Situation};
pub use rods::{
    BEND_TOLERANCE_RAD, Chain, Connector, Mobility, Mode, Motion, Moved, Obstacle, Obstacles,
    Outcome, Propagator, Reason, Request, Rod, Rotation, Rules, SKIN_M, Source, TOLERANCE_M, Veto,
    geometry, rebuild, wavefront,
};
pub use run::{ChainRun, chain_run};
pub use state::{Body, ChainState};
pub use world::ChainWorld;

use scratch::Scratch;
use sidestep_kernel::conflict::Groups;
use sidestep_kernel::world::Decides;
use sidestep_kernel::{Phases, Slot, Turn};
use std::ops::Range;

impl<const D: usize> Phases for ChainWorld<D> {
    const DECIDES: Decides = Decides::Together;

    type State = ChainState<D>;
    type Scratch = Scratch<D>;

    fn scratch(&self) -> Scratch<D> {
        Scratch::new(self)
    }

    fn bodies(&self, state: &ChainState<D>) -> usize {
        state.len()
    }

    fn claim(turn: &mut Turn<'_, Self>, bodies: Range<usize>) {
        bodies.for_each(|slot| claim::claim(turn, slot));
    }

    fn join(turn: &mut Turn<'_, Self>, bodies: Range<usize>, groups: &Groups) {
        join::join(turn, bodies, groups);
    }

    fn act(turn: &mut Turn<'_, Self>, group: &mut [Slot]) {
        act::act(turn, group);
    }
}
