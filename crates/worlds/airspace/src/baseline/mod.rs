//! Other methods under the same limits, to compare with: every one is asked for a heading, and
//! the airplane turns towards it as fast as it can.

pub(super) mod mvp;
pub(super) mod orca;

use super::flight::{Levels, Point};

/// What a method is told of an airplane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moving {
    pub(super) at: Point,
    /// Meters per second.
    pub(super) velocity: Point,
    /// Where it would fly if it were alone, meters per second.
    pub(super) preferred: Point,
    pub(super) separation_m: f64,
    pub(super) levels: Levels,
}
