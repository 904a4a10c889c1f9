//! The worlds. They stand side by side on the kernel and never import each other.

use crate::scenario::Worlds;
pub use {sidestep_airspace as airspace, sidestep_chain as chain, sidestep_robots as robots};

/// Every world that there is: a fourth one is a crate of its own and its name in this list.
pub const WORLDS: Worlds = Worlds(&[&robots::Robots, &airspace::Airspace, &chain::Chains]);
