#![deny(clippy::disallowed_methods)]
//! placeholder

pub mod map;

pub use map::{Cell, GridMap};
pub use sidestep_kernel as kernel;
