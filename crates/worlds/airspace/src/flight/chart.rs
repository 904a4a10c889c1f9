//! How positions are drawn, and where on earth they are.

use super::motion::{Point, Pose2};
use super::surface::{Frame, Surface, coordinates_from_degrees};
use sidestep_import::local_plane::EARTH_RADIUS_M;
use sidestep_kernel::view::{EarthChart, EarthProjection};

/// The drawing of a scenario in a plane, in meters east and north.
///
/// A plane is drawn as it is. The earth is drawn in the frame that touches it at the scenario's origin: every place lies
/// there as far from the origin, and in the direction, in which it is; other distances are not true, and nothing is
/// computed from them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chart {
    surface: Surface,
    frame: Frame,
    origin_deg: Option<Point>,
}

impl Chart {
    /// Returns the chart of a surface around an origin of this latitude and longitude, if it is known.
    pub(crate) fn new(surface: Surface, origin_deg: Option<Point>) -> Self {
        let origin = coordinates_from_degrees(origin_deg.unwrap_or_default());
        Self { surface, frame: surface.frame_at(origin), origin_deg }
    }

    /// Returns where a position is drawn.
    pub(crate) fn point(&self, at: Point) -> Point {
        self.frame.to_local(at)
    }

    /// Returns how a pose is drawn.
    pub(crate) fn pose(&self, pose: Pose2) -> Pose2 {
        self.frame.pose_to_local(pose)
    }

    /// Returns whether positions have a latitude and a longitude.
    pub(crate) fn is_on_earth(&self) -> bool {
        self.surface == Surface::Earth || self.origin_deg.is_some()
    }

    /// Returns the map that the drawing is, if it is one of the earth.
    pub(crate) fn earth_chart(&self) -> Option<EarthChart> {
        let origin_deg = self.origin_deg?;
        let projection = match self.surface {
            Surface::Earth => EarthProjection::AzimuthalEquidistant,
            // Scenarios in a plane with an origin were imported by this projection.
            Surface::Plane => EarthProjection::Equirectangular { radius_m: EARTH_RADIUS_M },
        };
        Some(EarthChart { origin_deg, projection })
    }

    /// Returns latitude and longitude of a position in degrees, where it has them.
    pub(crate) fn lat_lon_deg(&self, at: Point) -> Option<[f64; 2]> {
        match self.surface {
            Surface::Earth => Some([at[1].to_degrees(), at[0].to_degrees()]),
            Surface::Plane => Some(self.earth_chart()?.lat_lon_deg(at)),
        }
    }

    /// Returns the same of a place as it is drawn.
    pub(crate) fn lat_lon_of_drawn_deg(&self, at_m: Point) -> Option<[f64; 2]> {
        Some(self.earth_chart()?.lat_lon_deg(at_m))
    }
}
