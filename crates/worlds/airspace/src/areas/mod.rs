//! Areas of the airspace that airplanes have to stay out of, or inside of.
//!
//! An area is a cylinder or a prism: a circle or a polygon, with holes if need be, between two levels, for some time. It
//! may move at a constant velocity, as a weather cell does. Airplanes keep *clear* of it: those on its levels stay out of
//! an area of kind `out`, and inside of one of kind `in`, for as long as it lasts.
//!
//! ```text
//! shape.rs    circles and polygons in a plane: what is inside, how far the border is
//! local.rs    an area as an airplane has it around it: in its frame, in its air, from now on
//! path.rs     when a path, flown forever, first comes too near an area
//! detour.rs   the shortest route around areas
//! ```

mod detour;
mod local;
mod path;
mod shape;
#[cfg(test)]
mod tests;

use crate::flight::{FlightLevelRange, Frame, Point, Surface, distance_m};
pub(crate) use detour::DetourPlanner;
pub(crate) use local::{AreaContext, LocalArea, LocalAreas};
pub(crate) use path::{PathPiece, TOLERANCE_M as AREA_TOLERANCE_M, profile_pieces};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
pub use shape::AreaShape;
pub(crate) use shape::{find_crossing, square_to_edge_m2};
use sidestep_kernel::geometry::{add_scaled, sub};
use sidestep_kernel::math;
use std::sync::Arc;

/// What airplanes have to do about an area.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AreaKind {
    /// They stay out of it.
    #[default]
    Out,
    /// They stay inside of it.
    In,
}

/// An area, for as long as it lasts.
#[derive(Debug, Clone, PartialEq)]
pub struct Area {
    /// Its name, by which people know it.
    pub name: Option<String>,
    /// Whether airplanes stay out of it or inside of it.
    pub kind: AreaKind,
    /// Its outline, in the plane that touches the surface at its center, relative to that.
    pub shape: AreaShape,
    /// Where its center is at `from_s`, in coordinates of the scenario.
    pub center: Point,
    /// The levels on which it counts; an airplane just at the lowest or the highest of them is not on it.
    pub levels: FlightLevelRange,
    /// When it begins, in seconds after the start of the run.
    pub from_s: f64,
    /// When it ends, in seconds after the start of the run; infinite for never.
    pub until_s: f64,
    /// How its center moves, in meters per second to the east and to the north.
    pub velocity_m_s: Point,
}

/// The plane of an area at some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AreaPlane {
    frame: Frame,
    /// The center of the area in the frame.
    center: Point,
}

impl AreaPlane {
    /// Returns where a place is in it, relative to the center of the area.
    pub(crate) fn to_area(self, at: Point) -> Point {
        sub(self.frame.to_local(at), self.center)
    }

    /// Returns the coordinates of a place of the area, which is relative to its center.
    pub(crate) fn to_world(self, in_area: Point) -> Point {
        self.frame.to_world(add_scaled(in_area, self.center, 1.0))
    }
}

impl Area {
    /// Returns where it is at a time.
    pub(crate) fn plane_at(&self, surface: Surface, t_s: f64) -> AreaPlane {
        // Before it begins it is nowhere else than where it will begin.
        let moved_s = (t_s - self.from_s).max(0.0);
        match surface {
            Surface::Plane => AreaPlane {
                frame: Frame::PLANE,
                center: add_scaled(self.center, self.velocity_m_s, moved_s),
            },
            Surface::Earth if self.velocity_m_s == [0.0; 2] => {
                AreaPlane { frame: surface.frame_at(self.center), center: [0.0; 2] }
            }
            Surface::Earth => {
                let path = self.velocity_m_s.map(|speed| speed * moved_s);
                let there = surface.frame_at(self.center).to_world(path);
                AreaPlane { frame: surface.frame_at(there), center: [0.0; 2] }
            }
        }
    }

    /// Returns how far a place of its plane is from where airplanes must not be, in meters; negative there, by how far
    /// the border is.
    pub(crate) fn clearance_m(&self, in_area: Point) -> f64 {
        let border_m = self.shape.border_distance_m(in_area);
        if self.forbids(in_area) { -border_m } else { border_m }
    }

    /// Returns whether airplanes must not be in a place of its plane.
    pub(crate) fn forbids(&self, in_area: Point) -> bool {
        self.shape.contains(in_area) == (self.kind == AreaKind::Out)
    }

    /// Returns a bound from below on [`Self::clearance_m`] that is cheap to find.
    pub(crate) fn min_clearance_m(&self, in_area: Point) -> f64 {
        match self.kind {
            AreaKind::Out => self.shape.min_outside_m(in_area),
            AreaKind::In => f64::NEG_INFINITY,
        }
    }

    /// Returns whether it is farther from a place than a limit at a time, as far as that is cheap to find out: most areas of
    /// a country are.
    pub(crate) fn is_surely_far(
        &self,
        surface: Surface,
        at: Point,
        t_s: f64,
        limit_m: f64,
    ) -> bool {
        let [vx, vy] = self.velocity_m_s;
        let moved_m = math::hypot(vx, vy) * (t_s - self.from_s).max(0.0);
        let range_m = limit_m + moved_m + self.shape.radius_m();
        let is_far = match surface {
            Surface::Plane => distance_m(at, self.center) > range_m,
            Surface::Earth => surface.is_surely_beyond(at, self.center, range_m),
        };
        self.kind == AreaKind::Out && is_far
    }

    /// Returns whether some level of an airplane is one of its own.
    pub(crate) fn is_on_levels(&self, levels: &FlightLevelRange) -> bool {
        self.levels.overlaps(levels, 0.0)
    }

    /// Returns whether it moves.
    pub(crate) fn is_moving(&self) -> bool {
        self.velocity_m_s != [0.0; 2]
    }

    /// Returns whether it is where it is for the whole run, from the start on.
    pub(crate) fn is_permanent(&self) -> bool {
        !self.is_moving() && self.from_s == 0.0 && self.until_s == f64::INFINITY
    }

    /// Returns whether it lasts at a time, in seconds after the start of the run.
    pub(crate) fn lasts_at(&self, t_s: f64) -> bool {
        self.from_s <= t_s && t_s < self.until_s
    }

    /// Returns the name that people use for it: its own, or else its number.
    pub(crate) fn display_name(&self, number: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("area/{number}"))
    }
}

/// All areas of a scenario, by number.
pub type Areas = Arc<[Arc<Area>]>;
