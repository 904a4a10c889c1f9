#![deny(clippy::disallowed_methods)]
#![doc = include_str!("../README.md")]

pub mod beam;
pub mod delay;
pub mod effector;
mod policy;
pub mod ray;
pub mod sensor;

pub use policy::RandomPolicy;
