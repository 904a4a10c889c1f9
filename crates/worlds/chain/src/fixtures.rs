//! Numbers, chains and surroundings that several tests share.

#[path = "../../../testing/include/chains.rs"]
#[allow(dead_code, reason = "other crates that include the file use the rest of it")]
pub(super) mod chains;
pub(super) mod convoy;

pub(super) use chains::{TestRng, clearance_m};

use super::ground::Corridor;
use sidestep_rods::{Chain, Connector, Obstacle, Rod};

/// Poses along the center line of the corridor of the measurements.
pub(super) fn corridor_line(step_m: f64) -> Vec<([f64; 2], f64)> {
    let line = Corridor::reference_corridor(1.0).expect("a width").center_line(step_m);
    line.into_iter().map(|pose| (pose.at, pose.heading_rad)).collect()
}

/// The walls of that corridor.
pub(super) fn corridor_walls(width_m: f64) -> Vec<Obstacle<2>> {
    Corridor::reference_corridor(width_m).expect("a width").walls(0)
}

/// A straight chain on the first axis, its leader at `lead_m`; the tail of a long one is still outside
/// the corridor.
pub(super) fn straight_chain(lead_m: f64, followers: usize, rod: Rod, radius_m: f64) -> Chain<2> {
    Chain::straight([lead_m, 0.0], [-1.0, 0.0], followers, rod, Connector::free(radius_m))
        .expect("a straight chain is right")
}
