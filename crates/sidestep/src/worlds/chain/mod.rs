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
//! kinematics/: arms of joints, as chains        script/: a turtle language that drives an initiator
//! ```

mod candidates;
#[expect(clippy::module_inception, reason = "the chain itself, of the world of chains")]
pub mod chain;
pub mod geometry;
mod grid;
pub mod interval;
pub mod kinematics;
pub mod obstacle;
mod open;
mod own_body;
pub mod passage;
pub mod propagate;
pub mod reach;
pub mod rebuild;
pub mod rules;
mod scene;
#[cfg(test)]
mod scenes;
pub mod script;
mod search;
pub mod sweep;
pub mod veto;
pub mod wavefront;

pub use chain::{Chain, Connector, Mobility, Rod};
pub use obstacle::{Obstacle, Obstacles};
pub use propagate::Propagator;
pub use rules::{Rotation, Rules};
pub use scene::{BEND_TOLERANCE_RAD, SKIN_M, TOLERANCE_M};
pub use veto::{Mode, Motion, Moved, Outcome, Reason, Request, Source, Veto};
