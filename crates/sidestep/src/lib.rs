#![deny(clippy::disallowed_methods)]
//! placeholder

pub mod import;
pub mod learn;
pub mod map;
pub mod statistics;

pub use map::{Cell, GridMap};
pub use sidestep_kernel as kernel;
