//! The ground on which chains move: its obstacles, and their places.
//!
//! ```text
//! corridor.rs:   winding corridors         fields.rs:  balls and capsules at random
//! floor.rs:      floors of pixels          courses.rs: positions of movers at a time
//! ground_map.rs: maps and Stage worlds     route.rs:   room for a chain
//! ```

pub mod corridor;
pub(crate) mod courses;
pub(crate) mod fields;
pub(crate) mod floor;
pub(crate) mod ground_map;
pub(crate) mod route;

pub use corridor::{Corridor, CorridorLeg};
pub use courses::{MovingObstacle, MovingObstacles, ObstaclePath};
pub use floor::FloorMap;
pub use ground_map::GroundMap;

use sidestep_kernel::stream::Purpose;
use sidestep_rods::geometry::Point;

/// A place in the plane and a heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundPose {
    /// The place, meters.
    pub at: Point<2>,
    /// Heading, counterclockwise from the first axis, rad.
    pub heading_rad: f64,
}

/// Purposes of random draws here; entities are obstacles or attempts.
mod purposes {
    use super::Purpose;

    pub(super) const STILL: Purpose = Purpose(101);
    pub(super) const MOVING: Purpose = Purpose(102);
    pub(super) const ROUTE: Purpose = Purpose(103);
}
