//! The scene as all airplanes of a group see it before they exchange their plans.

use crate::flight::Air;
use crate::shield::Flyer;
use sidestep_kernel::Cycle;

/// An airplane as others see it.
#[derive(Debug, Clone)]
pub struct Seen {
    /// Its place, its model, and its stored fallback.
    pub flyer: Flyer,
    /// Whether it is seen to be on that fallback.
    pub orbits: bool,
}

/// The scene as all of a group see it, and numbers on which they have agreed, before they exchange
/// their plans.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The air that all fly through.
    pub air: Air,
    /// Airplanes at least this many meters above each other need not mind each other.
    pub vertical_m: f64,
    /// The present cycle.
    pub now: Cycle,
    /// Number of talks in a row without a message after which a radio is taken to be dead.
    pub silent_after: u32,
    /// All airplanes of the group as they can be seen, by rising id.
    pub seen: Vec<Seen>,
}
