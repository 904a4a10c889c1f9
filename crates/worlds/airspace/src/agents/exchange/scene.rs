//! The scene that all of a group see before they exchange their plans.

use crate::flight::Air;
use crate::shield::Flyer;
use sidestep_kernel::Cycle;

/// An airplane as others see it.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    /// Its place, its model, and its stored fallback.
    pub flyer: Flyer,
    /// Whether it is seen to be on that fallback.
    pub orbits: bool,
}

/// The scene that all of a group see, and numbers they have agreed on, before they exchange their
/// plans.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The air that all fly through.
    pub air: Air,
    /// Airplanes at least this far above each other do not mind each other.
    pub vertical_m: f64,
    /// The cycle.
    pub now: Cycle,
    /// See [`crate::agents::network::Network::silent_after`].
    pub silent_after: u32,
    /// All of the group as they can be seen, by rising id.
    pub seen: Vec<Seen>,
}
