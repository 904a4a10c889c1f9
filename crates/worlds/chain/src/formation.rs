//! Robots on wheels that keep to the connectors of their chain (slides E2, K5 to K7).

use super::rods::geometry::Point;
use super::swarm::drive::Pose;
use super::swarm::follower::Follower;
use super::swarm::laser::Body as Seen;
use serde::{Deserialize, Serialize};

/// The robots of a swarm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Robots {
    /// How each behaves.
    pub(crate) follower: Follower,
    /// A leader on wheels waits for a robot that is so far from its connector, and is slower from
    /// half of that on; infinite for never.
    pub(crate) lag_limit_m: f64,
}

/// A robot of a swarm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Robot {
    /// Where it is.
    pub pose: Pose,
    /// Whether its bumper is pressed.
    pub is_bumped: bool,
}

/// A round solid thing in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Solid {
    pub(crate) at: Point<2>,
    pub(crate) radius_m: f64,
}

impl Solid {
    /// The thing as lasers and bumpers see it.
    pub(crate) fn as_seen(&self) -> Seen {
        Seen::disc(self.at, self.radius_m)
    }
}
