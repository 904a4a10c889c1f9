//! Robots on wheels that keep to the connectors of their chain (slides E2, K5 to K7).

use super::swarm::drive::Pose2;
use super::swarm::follower::Follower;
use super::swarm::laser::RobotBody;
use serde::{Deserialize, Serialize};
use sidestep_rods::geometry::Point;

/// The robots of a swarm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RobotSwarmConfig {
    /// Behavior of each robot.
    pub(crate) follower: Follower,
    /// Distance between a robot and its connector at which a leader on wheels stops to wait,
    /// meters; it slows down from half of that on. Infinite: it never waits.
    pub(crate) lag_limit_m: f64,
}

/// A robot that keeps to the connector of the same index.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Robot {
    /// Its place and heading.
    pub pose: Pose2,
    /// Whether its bumper is pressed: whether it touches something.
    pub is_bumped: bool,
}

/// A round solid body in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SolidDisc {
    pub(crate) at: Point<2>,
    pub(crate) radius_m: f64,
}

impl SolidDisc {
    /// Returns the body as lasers and bumpers see it.
    pub(crate) fn robot_body(&self) -> RobotBody {
        RobotBody::disc(self.at, self.radius_m)
    }
}
