//! An airplane as the shield knows it.

use super::orbit::{Orbit, Side};
use crate::flight::{Levels, Point, Pose, distance_m};
use sidestep_kernel::EntityId;

/// Meters that new plans keep in addition to the separation.
pub(super) const SLACK_M: f64 = 0.01;

/// An airplane as the shield knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flyer {
    /// The airplane whose orbit this is. One that may be on several orbits takes part once with
    /// each.
    pub id: EntityId,
    /// Its pose.
    pub pose: Pose,
    /// Airspeed in meters per second.
    pub v_m_s: f64,
    /// Largest turn rate in radians per second.
    pub omega_max_rad_s: f64,
    /// Its separation in meters; of two airplanes the larger one counts.
    pub separation_m: f64,
    /// The levels it keeps or passes in the next `dt`.
    pub levels: Levels,
    /// Height in meters above which airplanes need not mind each other.
    pub vertical_m: f64,
    /// Its stored fallback.
    pub fallback: Side,
    /// Whether it came in too close to another: with that one it is left to the method until
    /// their fallbacks are apart.
    pub came_too_close: bool,
    /// Rank, unique; airplanes of higher rank keep their wishes.
    pub rank: u64,
}

impl Flyer {
    /// Returns whether two airplanes that came in too close are still without fallbacks that are
    /// apart. They are left to the method until they have such fallbacks, because falling back
    /// would bring these two together. For all other pairs the invariant still holds.
    pub(super) fn is_left_alone_with(&self, other: &Self) -> bool {
        let gap_m = self.separation_m.max(other.separation_m);
        self.came_too_close
            && other.came_too_close
            && !self.orbit(self.fallback).stays_apart(&other.orbit(other.fallback), gap_m)
    }

    /// Returns the orbit to a side that it enters where it is.
    pub(super) fn orbit(&self, side: Side) -> Orbit {
        Orbit::from(self.pose, self.v_m_s, side.sign() * self.omega_max_rad_s)
    }

    /// Returns the distance in meters that two airplanes have to keep on new plans.
    pub(super) fn gap_m(&self, other: &Self) -> f64 {
        self.separation_m.max(other.separation_m) + SLACK_M
    }

    /// Returns whether some ways of `dt_s` seconds, and orbits after them, could bring two airplanes
    /// too near each other.
    pub(super) fn is_in_reach(&self, other: &Self, dt_s: f64) -> bool {
        let reach_m = |f: &Self| f.v_m_s * dt_s + 2.0 * (f.v_m_s / f.omega_max_rad_s);
        let apart_m = distance_m(self.pose.at, other.pose.at);
        apart_m < self.gap_m(other) + reach_m(self) + reach_m(other)
    }

    /// Returns two discs that it cannot leave, whatever way it flies for `dt_s` seconds and to
    /// whichever side it turns for ever after that: their centers, and their radius in meters.
    ///
    /// At any time it is on the circle to its left that it would fly from there, whose center is at
    /// right angles to its heading. Flown straight on, that center ends `v dt` ahead, which is the
    /// center of the disc. A turn shifts the airplane by at most `v omega dt^2 / 2`, and the center
    /// about it by at most `r omega dt`. Earlier it is nearer, because `r omega` is not less than
    /// `v`. The same holds to the right.
    pub(super) fn reach(&self, dt_s: f64) -> ([Point; 2], f64) {
        let ahead = self.pose.step(self.v_m_s, 0.0, dt_s);
        let centers = Side::BOTH.map(|side| Flyer { pose: ahead, ..*self }.orbit(side).center());
        let turn_rad = self.omega_max_rad_s * dt_s;
        let radius_m = self.orbit(Side::Left).radius_m;
        let shift_m = 0.5 * self.v_m_s * dt_s * turn_rad;
        (centers, radius_m * (1.0 + turn_rad) + shift_m)
    }

    /// Returns whether two different airplanes are on levels that meet.
    pub(super) fn is_on_level(&self, other: &Self) -> bool {
        let vertical_m = self.vertical_m.max(other.vertical_m);
        self.id != other.id && self.levels.meets(&other.levels, vertical_m)
    }

    /// Returns whether the shield keeps two airplanes apart.
    pub(crate) fn minds(&self, other: &Self) -> bool {
        self.is_on_level(other) && !self.is_left_alone_with(other)
    }
}
