//! An airplane as the shield knows it.

use super::orbit::{Orbit, Side};
use crate::flight::{Levels, Pose};
use sidestep_kernel::EntityId;

/// Meters that new plans keep beyond the separation.
pub(super) const SLACK_M: f64 = 0.01;

/// An airplane as the shield knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flyer {
    /// Whose orbit this is. Where it is not sure on which of several an airplane is, it takes
    /// part with each of them.
    pub id: EntityId,
    /// Its pose.
    pub pose: Pose,
    /// Airspeed.
    pub v_m_s: f64,
    /// Largest turn rate.
    pub omega_max_rad_s: f64,
    /// Its separation; of two airplanes the larger one counts.
    pub separation_m: f64,
    /// The levels it keeps or passes in the next `dt`,
    pub levels: Levels,
    /// and how far above each other airplanes need not mind each other.
    pub vertical_m: f64,
    /// Its stored fallback.
    pub fallback: Side,
    /// Whether it came in too close to another: with that one it is left to the method until
    /// their fallbacks are apart.
    pub came_too_close: bool,
    /// Higher ranks keep what they want; unique.
    pub rank: u64,
}

impl Flyer {
    /// Whether two airplanes that came in too close are still without fallbacks that are apart.
    /// Falling back would bring these two together, so they are left to the method until they
    /// have such fallbacks. For all other pairs the invariant holds all the same.
    pub(super) fn is_left_alone_with(&self, other: &Self) -> bool {
        let gap_m = self.separation_m.max(other.separation_m);
        self.came_too_close
            && other.came_too_close
            && !self.orbit(self.fallback).stays_apart(&other.orbit(other.fallback), gap_m)
    }

    /// The orbit to a side that it enters where it is.
    pub(super) fn orbit(&self, side: Side) -> Orbit {
        Orbit::from(self.pose, self.v_m_s, side.sign() * self.omega_max_rad_s)
    }

    /// Returns how far apart two airplanes are to be on new plans.
    pub(super) fn gap_m(&self, other: &Self) -> f64 {
        self.separation_m.max(other.separation_m) + SLACK_M
    }

    /// Whether two different airplanes are on levels that meet.
    pub(super) fn is_on_level(&self, other: &Self) -> bool {
        let vertical_m = self.vertical_m.max(other.vertical_m);
        self.id != other.id && self.levels.meets(&other.levels, vertical_m)
    }

    /// Whether the shield keeps two airplanes apart.
    pub(crate) fn minds(&self, other: &Self) -> bool {
        self.is_on_level(other) && !self.is_left_alone_with(other)
    }
}
