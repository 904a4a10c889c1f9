//! Airplanes that avoid each other by probability collectives.
pub mod airplane;
pub mod objective;
pub mod shield;
