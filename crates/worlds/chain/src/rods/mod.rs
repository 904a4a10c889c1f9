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
mod motion_bounds;
pub(crate) mod motion_context;
pub(crate) mod obstacle;
mod open;
mod pass;
pub(crate) mod propagate;
pub(crate) mod reach;
pub mod rebuild;
pub(crate) mod rod_bvh;
pub(crate) mod rules;
mod search;
pub(crate) mod serde_point;
mod span;
pub(crate) mod sweep;
pub(crate) mod tunneling;
pub(crate) mod veto;
pub mod wavefront;

pub use chain::{Chain, Connector, Mobility, Rod};
pub use motion_context::{BEND_TOLERANCE_RAD, SKIN_M, TOLERANCE_M};
pub use obstacle::{Obstacle, Obstacles};
pub use propagate::Propagator;
pub use rules::{Rotation, Rules};
pub use veto::{
    CompletedMotion, Motion, Outcome, Request, RequestSource, Veto, VetoEffect, VetoReason,
};
