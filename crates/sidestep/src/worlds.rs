//! The worlds. They are independent crates on top of the kernel and never import each other.

use crate::scenario::Worlds;
pub use {sidestep_airspace as airspace, sidestep_chain as chain, sidestep_robots as robots};

/// The list of all worlds. To add one, write a crate and add its kind to this list.
pub const WORLDS: Worlds = Worlds(&[&robots::Robots, &airspace::Airspace, &chain::Chains]);
