#![deny(clippy::disallowed_methods)]
#![doc = include_str!("../README.md")]

mod arm;
pub mod ik;
pub mod kinematics;
pub mod motion;
pub mod plan;

pub use arm::{Arm, RateSources};
pub use sidestep_kernel::InputError;
