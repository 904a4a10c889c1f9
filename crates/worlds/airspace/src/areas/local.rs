//! An area as an airplane has it around it.
//!
//! Plans are made in the air, in a frame of the airplane, from now on. In it an area moves at its own velocity less that
//! of the wind, and so a path through the air is compared with the area where it is now, moved back by as much as the area
//! has moved by then.

use super::shape::{AreaShape, Edge, square_to_edge_m2};
use super::{Area, AreaPlane, Areas};
use crate::flight::{FlightLevelRange, Frame, Point, Surface, distance_m};
use sidestep_kernel::geometry::{add_scaled, scaled, sub};
use sidestep_kernel::math;
use std::sync::Arc;

/// Number of edges up to which all are kept, whether they are near or not.
const MAX_KEPT_EDGES: usize = 32;
/// Seconds over which the velocity of an area is measured in a frame on the earth.
const VELOCITY_INTERVAL_S: f64 = 10.0;

/// The areas near an airplane; none where there are none.
pub(crate) type LocalAreas = Option<Arc<[LocalArea]>>;

/// What is the same for all areas around an airplane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AreaContext<'a> {
    pub(crate) areas: &'a Areas,
    pub(crate) surface: Surface,
    /// The wind in meters per second.
    pub(crate) wind_m_s: Point,
    /// Now, in seconds after the start of the run.
    pub(crate) now_s: f64,
    /// For how long areas that move relative to the air are considered, in seconds.
    pub(crate) look_ahead_s: f64,
}

/// An area in the frame of an airplane, with times from now on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LocalArea {
    /// Its number among the areas of the scenario.
    pub(crate) number: u32,
    area: Arc<Area>,
    frame: Frame,
    /// Where it is now.
    plane: AreaPlane,
    border: LocalBorder,
    /// The place about which the border is known, in the frame, and how far from it.
    about: Point,
    known_m: f64,
    /// Its velocity relative to the air once it has begun, in meters per second.
    pub(super) velocity_m_s: Point,
    /// How far it would have moved over the ground until it begins, if it moved by then, in meters.
    not_moved_m: Point,
    /// When it begins, in seconds from now; not negative.
    pub(super) from_s: f64,
    /// Until when it is considered, in seconds from now.
    pub(super) until_s: f64,
}

/// The border of an area in a frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum LocalBorder {
    Circle { center: Point, radius_m: f64 },
    Edges(Vec<Edge>),
}

impl AreaContext<'_> {
    /// Returns the areas that an airplane may come to within `reach_m` meters through the air, in its frame.
    pub(crate) fn near(&self, frame: Frame, at: Point, reach_m: f64) -> LocalAreas {
        if self.areas.is_empty() {
            return None;
        }
        let near: Vec<LocalArea> = (0..)
            .zip(self.areas.iter())
            .filter_map(|(number, area)| self.local_area(number, area, (frame, at), reach_m))
            .collect();
        (!near.is_empty()).then(|| near.into())
    }

    fn local_area(
        &self,
        number: u32,
        area: &Arc<Area>,
        (frame, at): (Frame, Point),
        reach_m: f64,
    ) -> Option<LocalArea> {
        let until_s = area.until_s - self.now_s;
        if until_s <= 0.0 {
            return None;
        }
        let from_s = (area.from_s - self.now_s).max(0.0);
        let drift_m_s = [area.velocity_m_s, self.wind_m_s].map(|[x, y]| math::hypot(x, y));
        let moves_m = (drift_m_s[0] + drift_m_s[1]) * self.look_ahead_s;
        let range_m = reach_m + moves_m;
        if area.is_surely_far(self.surface, at, self.now_s, range_m) {
            return None;
        }
        let plane = area.plane_at(self.surface, self.now_s);
        let in_area = plane.to_area(at);
        if area.min_clearance_m(in_area) > range_m || area.clearance_m(in_area) > range_m {
            return None;
        }
        let ground_velocity_m_s = self.ground_velocity_m_s(area, frame);
        let velocity_m_s = sub(ground_velocity_m_s, self.wind_m_s);
        let is_moving = velocity_m_s != [0.0; 2];
        let about = frame.to_local(at);
        // Twice the range, so that the border is known about each place within it.
        let known_m = 2.0 * range_m;
        Some(LocalArea {
            number,
            area: Arc::clone(area),
            frame,
            plane,
            border: local_border(area, frame, plane, (about, known_m)),
            about,
            known_m: if has_many_edges(&area.shape) { known_m } else { f64::INFINITY },
            velocity_m_s,
            not_moved_m: scaled(ground_velocity_m_s, from_s),
            from_s,
            until_s: if is_moving { until_s.min(self.look_ahead_s) } else { until_s },
        })
        .filter(|local| local.from_s < local.until_s)
    }

    /// Returns the velocity over the ground of an area once it has begun, in a frame.
    fn ground_velocity_m_s(&self, area: &Area, frame: Frame) -> Point {
        if !area.is_moving() || self.surface == Surface::Plane {
            return area.velocity_m_s;
        }
        // Before it begins it stays where it will begin.
        let start_s = self.now_s.max(area.from_s);
        let center_at =
            |t_s: f64| frame.to_local(area.plane_at(self.surface, t_s).to_world([0.0; 2]));
        let path = sub(center_at(start_s + VELOCITY_INTERVAL_S), center_at(start_s));
        scaled(path, 1.0 / VELOCITY_INTERVAL_S)
    }
}

fn has_many_edges(shape: &AreaShape) -> bool {
    shape.edges().nth(MAX_KEPT_EDGES).is_some()
}

/// Returns the border of an area in a frame; of many edges those within some distance of a place.
fn local_border(
    area: &Area,
    frame: Frame,
    plane: AreaPlane,
    (about, known_m): (Point, f64),
) -> LocalBorder {
    let to_frame = |in_area: Point| frame.to_local(plane.to_world(in_area));
    if let AreaShape::Circle { radius_m } = area.shape {
        return LocalBorder::Circle { center: to_frame([0.0; 2]), radius_m };
    }
    let about_in_area = plane.to_area(frame.to_world(about));
    let keeps_all = !has_many_edges(&area.shape);
    let is_near =
        |edge: &Edge| keeps_all || square_to_edge_m2(about_in_area, *edge) <= known_m * known_m;
    LocalBorder::Edges(area.shape.edges().filter(is_near).map(|edge| edge.map(to_frame)).collect())
}

impl LocalArea {
    /// Returns whether some level of an airplane is one of its own.
    pub(crate) fn is_on_levels(&self, levels: &FlightLevelRange) -> bool {
        self.area.is_on_levels(levels)
    }

    /// Returns the levels on which it counts.
    pub(crate) fn levels(&self) -> FlightLevelRange {
        self.area.levels
    }

    /// Returns whether it lasts at a time, in seconds from now.
    pub(crate) fn lasts_at(&self, t_s: f64) -> bool {
        self.from_s <= t_s && t_s < self.until_s
    }

    /// Returns the place relative to the area of an airplane that is somewhere in the air at a time.
    pub(super) fn relative_place(&self, at: Point, t_s: f64) -> Point {
        add_scaled(sub(at, scaled(self.velocity_m_s, t_s)), self.not_moved_m, 1.0)
    }

    /// Returns whether airplanes must not be in a place relative to the area.
    pub(super) fn forbids(&self, relative: Point) -> bool {
        self.area.forbids(self.plane.to_area(self.frame.to_world(relative)))
    }

    /// Returns the distance of a place relative to the area from its border, in meters.
    pub(super) fn border_distance_m(&self, relative: Point) -> f64 {
        let near_m = match &self.border {
            LocalBorder::Circle { center, radius_m } => {
                (distance_m(relative, *center) - radius_m).abs()
            }
            LocalBorder::Edges(edges) => {
                let squares = edges.iter().map(|&edge| square_to_edge_m2(relative, edge));
                squares.fold(f64::INFINITY, f64::min).sqrt()
            }
        };
        near_m.min(self.unknown_distance_m(relative))
    }

    /// Returns the distance in meters beyond which there may be edges that are not known, from a place.
    pub(super) fn unknown_distance_m(&self, relative: Point) -> f64 {
        self.known_m - distance_m(relative, self.about)
    }

    /// Returns how far an airplane in some place of the air at a time is from where it must not be, in meters; negative
    /// there.
    pub(crate) fn clearance_m(&self, at: Point, t_s: f64) -> f64 {
        let relative = self.relative_place(at, t_s);
        let border_m = self.border_distance_m(relative);
        if self.forbids(relative) { -border_m } else { border_m }
    }

    /// Returns by how many meters an airplane on a predicted path is too near, after each of its steps: nearer than `gap_m`
    /// to where it must not be, or beyond the border.
    pub(crate) fn shortfalls_m<'a>(
        &'a self,
        points: &'a [Point],
        dtau_s: f64,
        gap_m: f64,
    ) -> impl Iterator<Item = f64> + 'a {
        // The place before, how far its border was, and whether it was beyond that.
        let mut before: Option<(Point, f64, bool)> = None;
        points.iter().enumerate().map(move |(k, &at)| {
            let t_s = (k + 1) as f64 * dtau_s;
            if !self.lasts_at(t_s) {
                return 0.0;
            }
            let relative = self.relative_place(at, t_s);
            let border_m = self.border_distance_m(relative);
            // Only a path that may have crossed the border is looked up anew.
            let is_beyond = match before {
                Some((place, from_border_m, is_beyond))
                    if distance_m(place, relative) < from_border_m =>
                {
                    is_beyond
                }
                _ => self.forbids(relative),
            };
            before = Some((relative, border_m, is_beyond));
            let clearance_m = if is_beyond { -border_m } else { border_m };
            (gap_m - clearance_m).max(0.0)
        })
    }

    pub(super) fn border(&self) -> &LocalBorder {
        &self.border
    }

    /// Returns the direction, in radians, in which the border is nearest to a place of the air now.
    pub(crate) fn direction_to_border_rad(&self, at: Point) -> f64 {
        let nearest = match &self.border {
            LocalBorder::Circle { center, radius_m } => {
                let [x, y] = sub(at, *center);
                let length_m = math::hypot(x, y).max(1e-9);
                [center[0] + x / length_m * radius_m, center[1] + y / length_m * radius_m]
            }
            LocalBorder::Edges(edges) => {
                let nearest = edges.iter().map(|&edge| super::shape::nearest_on_edge(at, edge));
                let by_distance =
                    nearest.min_by(|a, b| distance_m(at, *a).total_cmp(&distance_m(at, *b)));
                by_distance.unwrap_or(at)
            }
        };
        math::atan2(nearest[1] - at[1], nearest[0] - at[0])
    }
}
