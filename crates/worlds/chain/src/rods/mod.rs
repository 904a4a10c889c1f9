//! Chains of connectors and rods, and how one motion goes through them: no run, no clock, no cycle.
//!
//! ```text
//! chain.rs, obstacle.rs: chains and obstacles   geometry.rs, grid.rs: distances, and the search nearby
//! veto.rs: requests and outcomes                rules.rs: named options
//! propagate.rs -> candidates.rs -> scene.rs     one motion: sweeps, a slave's choices, their judge
//!                 interval.rs, search.rs        free directions: exact in the plane, searched in space
//!                 sweep.rs, own_body.rs         nothing is passed through; the chain's own parts
//!                 open.rs, pass.rs, leeway.rs   the same where nothing is in the way, or comes near
//! wavefront.rs: many motions at once            passage.rs: passages between two states
//! reach.rs: a base that keeps its place         rebuild.rs, span.rs: broken chains
//! propagate/alone.rs: one connector by itself   wire.rs: points in messages
//! ```

mod candidates;
pub(crate) mod chain;
pub mod geometry;
pub(crate) mod grid;
mod interval;
mod leeway;
pub(crate) mod obstacle;
mod open;
pub(crate) mod own_body;
mod pass;
pub(crate) mod passage;
pub(crate) mod propagate;
pub(crate) mod reach;
pub mod rebuild;
pub(crate) mod rules;
pub(crate) mod scene;
mod search;
mod span;
pub(crate) mod sweep;
pub(crate) mod veto;
pub mod wavefront;
pub(crate) mod wire;

pub use chain::{Chain, Connector, Mobility, Rod};
pub use obstacle::{Obstacle, Obstacles};
pub use propagate::Propagator;
pub use rules::{Rotation, Rules};
pub use scene::{BEND_TOLERANCE_RAD, SKIN_M, TOLERANCE_M};
pub use veto::{Mode, Motion, Moved, Outcome, Reason, Request, Source, Veto};
