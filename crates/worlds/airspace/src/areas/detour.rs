//! Detours: the shortest route from one place to another that keeps clear of areas.
//!
//! The shortest way around polygons leads along straight lines from corner to corner, past corners that jut out into the
//! free space (the visibility graph of Lozano-Pérez and Wesley, 1979). Corners are moved outward, so that an airplane can
//! fly around them. Only areas that a route crosses are looked at, and then those that the new route crosses, until none
//! is left; lines between corners are compared with the borders when the search comes to them (A*).

use super::shape::{AreaShape, Edge, edge_distance_m, edge_to_circle_line_m, square_to_edge_m2};
use super::{Area, AreaKind, AreaPlane};
use crate::flight::{Frame, Point, Surface, distance_m};
use sidestep_kernel::geometry::{add_scaled, normalized, scaled, sub};
use sidestep_kernel::math;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Number of corners of the polygon that stands for a circle: its sides are 2 % farther out than the circle at most.
const CIRCLE_CORNERS: usize = 16;
/// Fraction of the distance of corners from the border that lines between them keep.
const LINE_FRACTION: f64 = 0.5;
/// Sine of half the angle of a corner below which it counts as a spike, with corners of the detour to both sides of it.
const SPIKE_SINE: f64 = 0.5;
/// Step in meters from a corner by which is found out on which side of it the free space is.
const PROBE_M: f64 = 0.01;
/// Largest number of corners of a search: beyond, the wait would be felt, and the way around is left to the method.
const MAX_CORNERS: usize = 4000;

/// Finds detours around the areas that count for one airplane.
pub(crate) struct DetourPlanner<'a> {
    pub(crate) surface: Surface,
    /// The areas to keep clear of, which do not move.
    pub(crate) areas: Vec<&'a Area>,
    /// Distance from borders at which corners are rounded, in meters.
    pub(crate) gap_m: f64,
}

/// An area in the frame of a leg.
struct LegArea<'a> {
    area: &'a Area,
    plane: AreaPlane,
    frame: Frame,
    edges: Vec<Edge>,
    /// Center and radius of a circle.
    circle: Option<(Point, f64)>,
}

impl DetourPlanner<'_> {
    /// Returns the places between which a flight from one place to another leads straight on, without these two; none
    /// where the straight way is free, or where there is no other.
    pub(crate) fn way_points(&self, from: Point, to: Point) -> Vec<Point> {
        let frame = self.surface.frame_at(from);
        let ends = [from, to].map(|at| frame.to_local(at));
        // An area that forbids an end of the leg is left or entered on the straight way.
        let forbids_end = |area: &Area| {
            let plane = area.plane_at(self.surface, area.from_s);
            [from, to].into_iter().any(|end| area.forbids(plane.to_area(end)))
        };
        let mut others: Vec<(&Area, Point)> = self
            .areas
            .iter()
            .filter(|area| !forbids_end(area))
            .map(|&area| (area, frame.to_local(area.center)))
            .collect();
        let mut crossed: Vec<LegArea<'_>> = Vec::new();
        let mut route = ends.to_vec();
        loop {
            let before = crossed.len();
            others.retain(|&(area, center)| {
                let is_far = |line: &[Point]| {
                    let from_line_m = square_to_edge_m2(center, [line[0], line[1]]).sqrt();
                    area.kind == AreaKind::Out
                        && from_line_m > 1.01 * area.shape.radius_m() + self.gap_m
                };
                if route.windows(2).all(is_far) {
                    return true;
                }
                let one = LegArea::new(area, self.surface, frame);
                let is_free = |line: &[Point]| self.is_free(&one, [line[0], line[1]], ends);
                if route.windows(2).all(is_free) {
                    return true;
                }
                crossed.push(one);
                false
            });
            if crossed.len() == before {
                break;
            }
            match self.shortest_route(&crossed, ends) {
                Some(found) => route = found,
                None => return Vec::new(),
            }
        }
        route[1..route.len() - 1].iter().map(|&corner| frame.to_world(corner)).collect()
    }

    /// Returns whether a line keeps clear of an area. Where an end of the leg is nearer to the border than lines shall be,
    /// lines that begin or end there may be as near.
    fn is_free(&self, one: &LegArea<'_>, line: Edge, ends: Edge) -> bool {
        let mut gap_m = LINE_FRACTION * self.gap_m;
        for end in line.into_iter().filter(|end| ends.contains(end)) {
            // Slightly less, because both are rounded.
            gap_m = gap_m.min(0.9 * one.border_distance_m(end));
        }
        let is_straight_through =
            one.forbids([0.5 * (line[0][0] + line[1][0]), 0.5 * (line[0][1] + line[1][1])]);
        !is_straight_through && one.line_distance_m(line) >= gap_m
    }

    /// Returns the shortest route between the ends of a leg past corners of some areas, with the ends.
    fn shortest_route(&self, areas: &[LegArea<'_>], ends: Edge) -> Option<Vec<Point>> {
        let mut places = ends.to_vec();
        for one in areas {
            let corners = one.corners(self.gap_m);
            let is_free = |corner: &Point| {
                areas.iter().all(|other| {
                    !other.forbids(*corner)
                        && other.border_distance_m(*corner) >= LINE_FRACTION * self.gap_m
                })
            };
            places.extend(corners.into_iter().filter(is_free));
        }
        if places.len() > MAX_CORNERS {
            return None;
        }
        let is_free = |line: Edge| areas.iter().all(|one| self.is_free(one, line, ends));
        let goal = places[1];
        let mut length_m = vec![f64::INFINITY; places.len()];
        let mut before = vec![0; places.len()];
        let mut is_done = vec![false; places.len()];
        let mut queue = BinaryHeap::from([Candidate { bound_m: 0.0, place: 0 }]);
        length_m[0] = 0.0;
        while let Some(Candidate { place, .. }) = queue.pop() {
            if std::mem::replace(&mut is_done[place], true) {
                continue;
            }
            if place == 1 {
                return Some(route_to(1, &before, &places));
            }
            for next in (1..places.len()).filter(|&next| !is_done[next]) {
                let through_m = length_m[place] + distance_m(places[place], places[next]);
                if through_m < length_m[next] && is_free([places[place], places[next]]) {
                    length_m[next] = through_m;
                    before[next] = place;
                    let bound_m = through_m + distance_m(places[next], goal);
                    queue.push(Candidate { bound_m, place: next });
                }
            }
        }
        None
    }
}

fn route_to(goal: usize, before: &[usize], places: &[Point]) -> Vec<Point> {
    let mut route = vec![places[goal]];
    let mut place = goal;
    while place != 0 {
        place = before[place];
        route.push(places[place]);
    }
    route.reverse();
    route
}

/// A place in the queue of the search, by the least length of a route through it.
#[derive(Debug, PartialEq)]
struct Candidate {
    bound_m: f64,
    place: usize,
}

impl Eq for Candidate {}

impl Ord for Candidate {
    /// The greatest is the one with the least length; of equal ones the first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.bound_m.total_cmp(&self.bound_m).then(other.place.cmp(&self.place))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<'a> LegArea<'a> {
    fn new(area: &'a Area, surface: Surface, frame: Frame) -> Self {
        let plane = area.plane_at(surface, area.from_s);
        let to_frame = |in_area: Point| frame.to_local(plane.to_world(in_area));
        let circle = match area.shape {
            AreaShape::Circle { radius_m } => Some((to_frame([0.0; 2]), radius_m)),
            AreaShape::Polygon { .. } => None,
        };
        let edges = area.shape.edges().map(|edge| edge.map(to_frame)).collect();
        Self { area, plane, frame, edges, circle }
    }

    fn forbids(&self, at: Point) -> bool {
        self.area.forbids(self.plane.to_area(self.frame.to_world(at)))
    }

    fn border_distance_m(&self, at: Point) -> f64 {
        self.line_distance_m([at, at])
    }

    fn line_distance_m(&self, line: Edge) -> f64 {
        if let Some((center, radius_m)) = self.circle {
            return edge_to_circle_line_m(line, center, radius_m);
        }
        self.edges.iter().map(|&edge| edge_distance_m(edge, line)).fold(f64::INFINITY, f64::min)
    }

    /// Returns the corners past which a route may lead, `gap_m` meters from the border.
    fn corners(&self, gap_m: f64) -> Vec<Point> {
        if let Some((center, radius_m)) = self.circle {
            return match self.area.kind {
                AreaKind::Out => circle_corners(center, radius_m + gap_m),
                // The inside of a circle has no corners.
                AreaKind::In => Vec::new(),
            };
        }
        let AreaShape::Polygon { rings, .. } = &self.area.shape else { return Vec::new() };
        let to_frame = |&in_area: &Point| self.frame.to_local(self.plane.to_world(in_area));
        let mut corners = Vec::new();
        for ring in rings {
            let ring: Vec<Point> = ring.iter().map(to_frame).collect();
            for k in 0..ring.len() {
                let before = ring[(k + ring.len() - 1) % ring.len()];
                let after = ring[(k + 1) % ring.len()];
                corners.extend(self.corner_detour([before, ring[k], after], gap_m));
            }
        }
        corners
    }

    /// Returns the places at which a route may lead around a corner, if that juts out into the free space.
    fn corner_detour(&self, [before, corner, after]: [Point; 3], gap_m: f64) -> Vec<Point> {
        let directions = normalized(sub(before, corner)).zip(normalized(sub(after, corner)));
        let Some((to_before, to_after)) = directions else { return Vec::new() };
        // Into the smaller of the two angles at the corner.
        let Some(inward) = normalized(add_scaled(to_before, to_after, 1.0)) else {
            return Vec::new();
        };
        if !self.forbids(add_scaled(corner, inward, PROBE_M)) {
            return Vec::new();
        }
        let half_angle_sine = (to_before[0] * inward[1] - to_before[1] * inward[0]).abs();
        let outward = scaled(inward, -1.0);
        if half_angle_sine >= SPIKE_SINE {
            return vec![add_scaled(corner, outward, gap_m / half_angle_sine)];
        }
        // Beside a spike, to both sides and beyond its tip.
        let beside = [inward[1], -inward[0]];
        let beyond = add_scaled(corner, outward, gap_m);
        vec![add_scaled(beyond, beside, gap_m), add_scaled(beyond, beside, -gap_m)]
    }
}

/// Returns the corners of a polygon around a circle.
fn circle_corners(center: Point, radius_m: f64) -> Vec<Point> {
    let step_rad = std::f64::consts::TAU / CIRCLE_CORNERS as f64;
    let corner_m = radius_m / math::cos(0.5 * step_rad);
    (0..CIRCLE_CORNERS)
        .map(|k| {
            let (sin, cos) = math::sin_cos(k as f64 * step_rad);
            add_scaled(center, [cos, sin], corner_m)
        })
        .collect()
}
