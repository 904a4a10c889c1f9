//! The move that a chain's driver wants in a cycle.

use super::wheels::WheelStep;
use crate::driver::step_motion::StepMotion;
use sidestep_rods::geometry::Point;

/// The move that a driver wants in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum DesiredMove<const D: usize> {
    /// None.
    Rest,
    /// The initiator to another position.
    Go(Point<D>),
    /// The whole chain along its plan.
    Follow,
    /// A robot on wheels to another pose.
    Steer(WheelStep),
    /// The connector of a robot on wheels back toward its robot.
    Return(Point<D>),
    /// A robot on wheels to another heading, on the spot.
    Face(f64),
    /// As an external caller orders.
    Obey(StepMotion<D>),
    /// None: the task is done.
    Done,
}
