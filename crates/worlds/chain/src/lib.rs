#![deny(clippy::disallowed_methods)]
//! Chains of connectors and rods that creep among obstacles.
//!
//! Source: "Serpentine motion" (Birbilis and Aspragathos, 2005); where this world does otherwise, the modules say
//! why. One code for two and three dimensions.
//!
//! ```text
//! rods/:   chains, constraints, propagation, search      arms/:   joints as rods, inverse kinematics
//! motion/: after a veto, out of the way                  script/: a turtle language for initiators
//! ground/: where obstacles come from                     swarm/:  robots on wheels that follow a leader
//!
//! scenario.rs -> world.rs (immutable), state.rs (bodies), driver.rs (tasks)
//! act.rs: a chain's cycle: broken.rs, navigate.rs, formation.rs, measure.rs -> metrics.rs, rows.rs
//! ```
//!
//! `rods` and `arms` know nothing of the world and of runs: a library that needs no cycle.

mod act;
pub mod arms;
mod broken;
pub mod bundle;
pub mod driver;
pub mod events;
pub mod formation;
pub mod ground;
mod kind;
mod measure;
pub mod metrics;
pub mod motion;
pub mod navigate;
pub mod rods;
mod rows;
pub mod run;
pub mod scenario;
#[cfg(test)]
mod scenes;
pub mod script;
pub mod state;
pub mod swarm;
mod view;
mod words;
pub mod world;

pub use arms::{ik, kinematics};
pub use kind::Chains;
pub use motion::escape::{Escape, Escaped, Escaper};
pub use motion::replan::{Climbed, Ladder, Rungs, Situation};
pub use rods::{
    BEND_TOLERANCE_RAD, Chain, Connector, Mobility, Mode, Motion, Moved, Obstacle, Obstacles,
    Outcome, Propagator, Reason, Request, Rod, Rotation, Rules, SKIN_M, Source, TOLERANCE_M, Veto,
    geometry, rebuild, wavefront,
};
pub use run::ChainRun;

use arms::arm;
use motion::{escape, replan};
use rods::{chain, obstacle, rules, veto};
