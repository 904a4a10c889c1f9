//! Other methods under the same limits, for comparison: each considers the airplanes near it once per
//! step of `dtau`, and gives a heading, toward which the airplane turns as fast as it can.

pub(super) mod bands;
pub(super) mod mvp;
pub(super) mod orca;

use super::flight::{FlightLevelRange, MethodCommand, Point};
use super::settings::ReactiveSettings;
use sidestep_kernel::{EntitySlot, math};

/// What a method that considers airplanes once per step of `dtau` keeps of one of them from step to step.
#[derive(Debug, Clone, Default)]
pub(crate) struct ReactiveMemory {
    /// The conflicts that it resolves by MVP.
    pub(crate) resolving: mvp::ActiveResolutions,
    /// What the method has commanded last.
    pub(crate) command: MethodCommand,
}

/// The part of an airplane that a method knows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AircraftState {
    /// The airplane, by its id.
    pub slot: EntitySlot,
    /// Its position in meters, x east and y north.
    pub at: Point,
    /// Heading in radians, counterclockwise from east.
    pub heading_rad: f64,
    /// Velocity in meters per second, relative to the air around the airplane that sees it: of itself, through the air.
    pub velocity: Point,
    /// Velocity of that air relative to the one that is common to all, in meters per second; 0 where all are in one wind.
    pub(crate) drift: Point,
    /// The heading that it would have if it were alone, in radians.
    pub preferred_rad: f64,
    /// Distance in meters within which no other airplane should come; of those that avoid nobody, enlarged by how far
    /// they may fly within `dt`.
    pub separation_m: f64,
    /// Altitude in meters.
    pub altitude_m: f64,
    /// Rate of climb in meters per second, negative downward.
    pub climb_m_s: f64,
    /// The levels that it is on, or passes as far as the method looks ahead.
    pub levels: FlightLevelRange,
    /// Whether it gives way to others, too.
    pub yields: bool,
    /// Whether it avoids others at all; one that has right of way does, and need not give way.
    pub is_cooperative: bool,
}

impl AircraftState {
    /// Returns the distance in meters within which another airplane is to be avoided.
    fn zone_m(&self, other: &Self, settings: ReactiveSettings) -> f64 {
        self.separation_m.max(other.separation_m) * settings.margin
    }
}

fn vector_length(a: Point) -> f64 {
    math::hypot(a[0], a[1])
}

/// Returns an airplane at 35 m/s that wants to keep its heading, as tests of all methods have it.
#[cfg(test)]
pub(crate) fn test_aircraft(slot: EntitySlot, at: Point, heading_rad: f64) -> AircraftState {
    AircraftState {
        slot,
        at,
        heading_rad,
        velocity: [35.0 * math::cos(heading_rad), 35.0 * math::sin(heading_rad)],
        drift: [0.0; 2],
        preferred_rad: heading_rad,
        separation_m: 500.0,
        altitude_m: 0.0,
        climb_m_s: 0.0,
        levels: FlightLevelRange::from_level(0.0),
        yields: true,
        is_cooperative: true,
    }
}
