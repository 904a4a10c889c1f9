#![deny(clippy::disallowed_methods)]
//! placeholder

pub mod error;
pub mod ports;

pub use error::InputError;
