//! What a map of traffic shows beside bodies: the altitudes of areas, and routes.

use super::body::BodyId;
use super::pose::Vec3;
use serde::{Deserialize, Serialize};

/// Marks a scene as traffic, which is shown in plan view: from above, with north up and altitudes in words.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TrafficPlan {
    /// The areas, by number; bodies that are lines along their borders have the same kinds and numbers.
    pub areas: Vec<AreaLevels>,
    /// The routes of agents, by number.
    pub routes: Vec<Route>,
}

/// The altitudes on which an area counts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AreaLevels {
    /// The area; its borders are its parts.
    pub area: BodyId,
    /// Whether traffic stays inside of it, not outside.
    pub is_fence: bool,
    /// The lowest altitude, in meters; none where it begins at the ground.
    pub low_m: Option<f64>,
    /// The highest altitude, in meters; none where it has no end.
    pub high_m: Option<f64>,
}

/// The route of an agent as it is filed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Route {
    /// The agent.
    pub agent: BodyId,
    /// Its start and its way-points, in meters, at the altitude of the start.
    pub points_m: Vec<Vec3>,
}
