#![deny(clippy::disallowed_methods)]
#![doc = include_str!("../README.md")]

// The fixtures that this crate shares with others call it by this name.
#[cfg(test)]
extern crate self as sidestep_rods;

mod candidates;
mod chain;
#[cfg(test)]
#[path = "../../testing/include/chains.rs"]
mod fixtures;
pub mod geometry;
mod grid;
mod interval;
mod motion_bounds;
mod motion_context;
mod obstacle;
mod open;
mod own_body;
mod pass;
mod posture;
mod projection;
mod propagate;
mod reach;
mod reaction;
pub mod rebuild;
mod rod_bvh;
mod rules;
mod search;
pub mod serde_point;
mod solid_motions;
mod span;
mod sweep;
mod tunneling;
mod veto;
pub mod wavefront;

pub use chain::{
    Chain, Connector, LENGTH_TOLERANCE_M, MAX_COORDINATE_M, Mobility, Rod, SKIN_M, is_in_range,
};
pub use grid::SpatialGrid;
pub use motion_context::{
    BEND_TOLERANCE_RAD, IncompleteVeto, TOLERANCE_M, contact_distance_m, is_length_allowed,
};
pub use obstacle::{Obstacle, Obstacles, bounds_around, outline_walls};
pub use own_body::{
    ChainPart, NearestOwnParts, find_own_passage, is_own_path_clear, nearest_own_parts, part_pairs,
};
pub use projection::ConstraintProjector;
pub use propagate::{Propagator, local_solver};
pub use reach::{ReachOutcome, ReachRequest, reach_target};
pub use reaction::{MasterMove, Reaction};
pub use rod_bvh::RodBvh;
pub use rules::{ReactionRules, RotationRule};
pub use sidestep_kernel::InputError;
pub use solid_motions::DeferredSolidMotions;
pub use sweep::RodSweep;
pub use tunneling::{TunneledRod, blocking_obstacle, find_tunneling};
pub use veto::{
    CompletedMotion, MotionOutcome, MotionRequest, RequestSource, RequestedMotion, Veto,
    VetoEffect, VetoReason,
};
