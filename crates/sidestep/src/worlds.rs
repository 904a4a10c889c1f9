//! The worlds. They are independent crates on top of the kernel and never import each other.

use crate::scenario::{WorldType, Worlds};
pub use {sidestep_airspace as airspace, sidestep_chain as chain, sidestep_robots as robots};

/// The list of all worlds. To add one, write a crate and add its kind to this list.
pub const WORLDS: Worlds = Worlds(&[&robots::Robots::new(), &airspace::Airspace, &chain::Chains]);

/// Returns the list of all worlds, in which robots have further behaviors, by name. The list stays for the
/// rest of the process.
pub fn with_behaviours(own: robots::scenario::Behaviours) -> Worlds {
    let robots: &'static dyn WorldType = Box::leak(Box::new(robots::Robots::with(own)));
    let named =
        |kind: &&'static dyn WorldType| if kind.name() == robots.name() { robots } else { *kind };
    Worlds(Box::leak(WORLDS.0.iter().map(named).collect()))
}
