#![deny(clippy::disallowed_methods)]
//! Chains of connectors and rods that creep among obstacles.
//!
//! Source: "Serpentine motion" (Birbilis and Aspragathos, 2005); where this world does otherwise, the modules say
//! why. One code for two and three dimensions.
//!
//! ```text
//! chain.rs, obstacle.rs: what there is          geometry.rs, grid.rs: distances, and what is near
//! veto.rs: requests and outcomes                rules.rs: named options
//! propagate.rs -> candidates.rs -> scene.rs     one motion: sweeps, a slave's choices, their judge
//!                 interval.rs, search.rs        free directions: exact in the plane, searched in space
//!                 sweep.rs, own_body.rs         nothing is passed through; the chain's own parts
//!                 open.rs                       the same where nothing is in the way
//! wavefront.rs: many motions at once            passage.rs: who passed through what, between states
//! reach.rs: an arm with a fixed base            rebuild.rs: broken chains
//! ground/: where obstacles come from            script/: a turtle language that drives an initiator
//! swarm/: robots on wheels, one that navigates and those that follow
//! kinematics/: arms of joints, as chains        ik/: postures that reach a target
//!
//! scenario.rs -> world.rs (immutable), state.rs (bodies), driver.rs (tasks), simulation.rs
//! act.rs: a chain's cycle: escape.rs, replan.rs, broken.rs, navigate.rs, formation.rs,
//!                         measure.rs -> metrics.rs, rows.rs
//! ```

mod act;
pub mod arm;
mod broken;
pub mod bundle;
mod candidates;
#[expect(clippy::module_inception, reason = "the chain itself, of the world of chains")]
pub mod chain;
pub mod driver;
pub mod escape;
pub mod events;
pub mod formation;
pub mod geometry;
mod grid;
pub mod ground;
pub mod ik;
pub mod interval;
mod kind;
pub mod kinematics;
mod measure;
pub mod metrics;
pub mod navigate;
pub mod obstacle;
mod open;
mod own_body;
pub mod passage;
pub mod propagate;
pub mod reach;
pub mod rebuild;
pub mod replan;
mod rows;
pub mod rules;
pub mod run;
pub mod scenario;
mod scene;
#[cfg(test)]
mod scenes;
pub mod script;
mod search;
pub mod state;
pub mod swarm;
pub mod sweep;
pub mod veto;
mod view;
pub mod wavefront;
mod words;
pub mod world;

pub use chain::{Chain, Connector, Mobility, Rod};
pub use escape::{Escape, Escaped, Escaper};
pub use kind::Chains;
pub use obstacle::{Obstacle, Obstacles};
pub use propagate::Propagator;
pub use replan::{Climbed, Ladder, Rungs, Situation};
pub use rules::{Rotation, Rules};
pub use run::ChainRun;
pub use scene::{BEND_TOLERANCE_RAD, SKIN_M, TOLERANCE_M};
pub use veto::{Mode, Motion, Moved, Outcome, Reason, Request, Source, Veto};
