//! The worlds. They are independent crates on top of the kernel and never import each other.

use crate::BUILD;
use crate::scenario::Worlds;
use std::sync::LazyLock;
pub use {sidestep_airspace as airspace, sidestep_chain as chain, sidestep_robots as robots};

/// The list of all worlds. To add one, write a crate and add its type to this list; to add it to a program of your
/// own, take a clone of the list [`with`](Worlds::with) it.
pub static WORLDS: LazyLock<Worlds> = LazyLock::new(|| {
    Worlds::new(BUILD)
        .with(robots::Robots::new())
        .with(airspace::Airspace::new())
        .with(chain::Chains::new())
});
