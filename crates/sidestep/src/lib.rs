#![deny(clippy::disallowed_methods)]
//! placeholder

pub mod experiment;
pub mod import;
pub mod map;
pub mod office;
pub mod planning;
pub mod scenario;
pub mod statistics;
pub mod worlds;

pub use map::{Cell, GridMap};
pub use sidestep_kernel as kernel;
