//! Other methods under the same limits, for comparison: each computes a heading, and the airplane
//! turns toward it as fast as it can.

pub(super) mod mvp;
pub(super) mod orca;

use super::flight::{Levels, Point};

/// The part of an airplane that a method knows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moving {
    pub(super) at: Point,
    /// Velocity in meters per second.
    pub(super) velocity: Point,
    /// The velocity that it would have if it were alone, in meters per second.
    pub(super) preferred: Point,
    pub(super) separation_m: f64,
    pub(super) levels: Levels,
    /// Whether it gives way to others, too.
    pub(super) yields: bool,
}
