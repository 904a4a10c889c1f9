//! Traffic: what a plan view shows beside bodies, and the trails of bodies.

use super::BodyId;
use serde::Serialize;

/// What a plan view of traffic shows beside its bodies.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Traffic {
    /// Where on earth places are; none where they are in a plane of their own.
    pub chart: Option<EarthChart>,
    /// The altitude of all traffic, in meters, where all of it is on one level.
    pub level_m: Option<f64>,
    /// The areas.
    pub areas: Vec<TrafficArea>,
    /// The routes as they are filed.
    pub routes: Vec<TrafficRoute>,
}

/// A map of the earth: x east and y north of its origin, in meters.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct EarthChart {
    /// Latitude and longitude of the origin, in degrees.
    pub origin_deg: [f64; 2],
    /// Radius in meters of a sphere whose longitudes are as long as at the origin; none where each place lies as far
    /// from the origin, and in the direction, in which it is on the WGS84 ellipsoid.
    pub sphere_radius_m: Option<f64>,
}

/// An area, whose borders are bodies of this kind and number.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct TrafficArea {
    /// The kind of its borders.
    pub kind: String,
    /// Its number.
    pub number: u32,
    /// Its name.
    pub name: String,
    /// Whether traffic stays inside of it, not outside.
    pub is_fence: bool,
    /// The lowest altitude, in meters; none where it begins at the ground.
    pub low_m: Option<f64>,
    /// The highest altitude, in meters; none where it has no end.
    pub high_m: Option<f64>,
}

/// A route as it is filed.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct TrafficRoute {
    /// The agent.
    pub agent: BodyId,
    /// Its start and its way-points, in meters.
    pub points_m: Vec<[f64; 3]>,
}

/// The trail of a body up to a cycle.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct BodyTrail {
    /// The body.
    pub body: BodyId,
    /// The cycles of its points, the earliest first.
    pub cycles: Vec<f64>,
    /// Its points, in meters: x, y and z of each in turn.
    pub points_m: Vec<f32>,
}
