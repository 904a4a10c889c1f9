//! The worlds. They stand side by side on the kernel and never import each other.

pub mod any;

pub use {sidestep_airspace as airspace, sidestep_chain as chain, sidestep_robots as robots};
