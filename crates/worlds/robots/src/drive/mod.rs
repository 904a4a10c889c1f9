//! A robot outside of the simulator: what its program perceives by the measurements of a real robot, and the velocities by
//! which that robot carries out an action.
//!
//! Nothing here reads a clock or opens a socket: times are those of the robot's own stamps, so that a drive in memory is
//! the same in every test.
//!
//! ```text
//! grid.rs        places of a body on the map, continuous and in boxes
//! scan.rs        the ranges of a scanner
//! percept.rs     the readings of the scenario's sensors by such ranges
//! plan.rs        where an action is meant to end
//! controller.rs  velocities that lead there: turn, go, stop; and contacts on the way
//! guard.rs       limits that hold whatever the program decides
//! beacon.rs      what a robot tells the others
//! neighbors.rs   words and requests that it hears of them
//! team_plan.rs   the plan of all robots, which each computes for itself
//! plan_executor.rs  its own part of that plan, in the order of all
//! driver.rs      all of it together: measurements in, velocities out
//! ```

pub mod beacon;
pub mod controller;
pub mod driver;
pub mod grid;
pub mod guard;
pub mod neighbors;
pub mod percept;
pub mod plan;
pub mod plan_executor;
pub mod scan;
pub mod team_plan;
#[cfg(test)]
mod tests;

/// The velocity of a robot with two wheels.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DriveVelocity {
    /// Speed along the heading in m/s, below 0 backward.
    pub forward_mps: f64,
    /// Rate of turning in rad/s, above 0 to the left.
    pub turn_radps: f64,
}

impl DriveVelocity {
    /// Standing still.
    pub const ZERO: Self = Self { forward_mps: 0.0, turn_radps: 0.0 };
}
