//! Other methods under the same limits, for comparison: each considers the airplanes near it once per
//! step of `dtau`, and gives a heading, toward which the airplane turns as fast as it can.

pub(super) mod mvp;
pub(super) mod orca;

use super::flight::{Levels, Point};
use super::settings::ReactiveSettings;
use sidestep_kernel::{Slot, math};

/// The part of an airplane that a method knows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AircraftState {
    pub(super) slot: Slot,
    pub(super) at: Point,
    /// Heading in radians, counterclockwise from east.
    pub(super) heading_rad: f64,
    /// Velocity in meters per second.
    pub(super) velocity: Point,
    /// The heading that it would have if it were alone, in radians.
    pub(super) preferred_rad: f64,
    pub(super) separation_m: f64,
    pub(super) levels: Levels,
    /// Whether it gives way to others, too.
    pub(super) yields: bool,
}

impl AircraftState {
    /// Returns the distance in meters within which another airplane is to be avoided.
    fn zone_m(&self, other: &Self, settings: ReactiveSettings) -> f64 {
        self.separation_m.max(other.separation_m) * settings.margin
    }
}

fn length(a: Point) -> f64 {
    math::hypot(a[0], a[1])
}

/// Returns an airplane at 35 m/s that wants to keep its heading, as tests of all methods have it.
#[cfg(test)]
fn moving(slot: Slot, at: Point, heading_rad: f64) -> AircraftState {
    AircraftState {
        slot,
        at,
        heading_rad,
        velocity: [35.0 * math::cos(heading_rad), 35.0 * math::sin(heading_rad)],
        preferred_rad: heading_rad,
        separation_m: 500.0,
        levels: Levels::at(0.0),
        yields: true,
    }
}
