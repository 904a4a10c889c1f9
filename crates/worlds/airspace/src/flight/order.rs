//! Orders that airplanes are given in flight.
//!
//! An order to keep a heading or to follow way-points changes only which maneuvers an airplane prefers, so it is
//! carried out at once. A new speed changes the orbit that it has stored as its fallback: with the shield, such an order has
//! to wait until it is safe. A new level changes the set of airplanes that it has to avoid: with the shield, the way
//! there is cleared in stages.

use super::motion::Point;

/// Largest number of orders for one airplane: more are a mistake in a file.
pub const MAX_ORDERS: usize = 10_000;

/// An order and its time.
#[derive(Debug, Clone, PartialEq)]
pub struct FlightOrder {
    /// Time at which it is given, in seconds after the start of the run.
    pub at_s: f64,
    /// What changes then; all else of the flight stays.
    pub task: FlightTask,
}

/// What an order changes in a flight.
#[derive(Debug, Clone, PartialEq)]
pub enum FlightTask {
    /// Keep a heading, radians counterclockwise from east, until sent to a way-point again.
    Heading(f64),
    /// Fly with this airspeed, m/s.
    Speed(f64),
    /// Fly with this airspeed, m/s, for one cycle on the way to one that was ordered (`acceleration.rs`).
    Acceleration(f64),
    /// Change to another level.
    Altitude {
        /// Altitude of the new level, in meters.
        altitude_m: f64,
        /// Rate of climb or descent, in meters per second.
        climb_m_s: f64,
    },
    /// Go on to the next way-point.
    Proceed,
    /// Follow these way-points instead.
    WayPoints(Vec<Point>),
}

impl FlightTask {
    /// Returns the airspeed in meters per second that it gives, if it gives one.
    pub(crate) fn speed_m_s(&self) -> Option<f64> {
        match self {
            Self::Speed(v_m_s) | Self::Acceleration(v_m_s) => Some(*v_m_s),
            _ => None,
        }
    }
}
