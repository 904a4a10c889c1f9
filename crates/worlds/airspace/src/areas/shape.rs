//! Outlines of areas in a plane.

use crate::flight::{Point, distance_m};
use sidestep_kernel::geometry::{add_scaled, dot, lerp, norm_squared, sub};
use sidestep_kernel::math;

/// An outline, relative to the center of its area.
#[derive(Debug, Clone, PartialEq)]
pub enum AreaShape {
    /// A circle.
    Circle {
        /// Its radius in meters.
        radius_m: f64,
    },
    /// A polygon, or several, with holes.
    Polygon {
        /// Closed rings of corners in meters, the last joined to the first; a place inside an odd number of rings is
        /// inside the area.
        rings: Vec<Vec<Point>>,
        /// Largest distance of a corner from the center, in meters.
        radius_m: f64,
    },
}

/// Number of points of a line that is drawn for a circle.
const CIRCLE_POINTS: usize = 72;

/// A straight piece of a border.
pub(crate) type Edge = [Point; 2];

impl AreaShape {
    /// Returns a polygon of these rings.
    pub fn from_rings(rings: Vec<Vec<Point>>) -> Self {
        let corners = rings.iter().flatten();
        let radius_m = corners.map(|&[x, y]| math::hypot(x, y)).fold(0.0, f64::max);
        Self::Polygon { rings, radius_m }
    }

    /// Returns whether a place is inside.
    pub(crate) fn contains(&self, at: Point) -> bool {
        match self {
            Self::Circle { radius_m } => norm_squared(at) < radius_m * radius_m,
            Self::Polygon { radius_m, .. } if norm_squared(at) > radius_m * radius_m => false,
            Self::Polygon { .. } => {
                self.edges().filter(|edge| is_crossed_by_ray(*edge, at)).count() % 2 == 1
            }
        }
    }

    /// Returns the distance of a place from the border, in meters.
    pub(crate) fn border_distance_m(&self, at: Point) -> f64 {
        match self {
            Self::Circle { radius_m } => (math::hypot(at[0], at[1]) - radius_m).abs(),
            Self::Polygon { .. } => {
                let nearest_m2 = self
                    .edges()
                    .map(|edge| square_to_edge_m2(at, edge))
                    .fold(f64::INFINITY, f64::min);
                nearest_m2.sqrt()
            }
        }
    }

    /// Returns a distance from the area that a place surely has, in meters; negative where nothing is sure.
    pub(crate) fn min_outside_m(&self, at: Point) -> f64 {
        math::hypot(at[0], at[1]) - self.radius_m()
    }

    /// Returns the largest distance of a place of it from its center, in meters.
    pub(crate) fn radius_m(&self) -> f64 {
        match self {
            Self::Circle { radius_m } | Self::Polygon { radius_m, .. } => *radius_m,
        }
    }

    /// Returns closed lines along the border, for pictures.
    pub(crate) fn outlines(&self) -> Vec<Vec<Point>> {
        let mut lines: Vec<Vec<Point>> = match self {
            Self::Polygon { rings, .. } => rings.clone(),
            Self::Circle { radius_m } => {
                let step_rad = std::f64::consts::TAU / CIRCLE_POINTS as f64;
                let point = |k: usize| {
                    let (sin, cos) = math::sin_cos(k as f64 * step_rad);
                    [radius_m * cos, radius_m * sin]
                };
                vec![(0..CIRCLE_POINTS).map(point).collect()]
            }
        };
        for line in &mut lines {
            line.extend(line.first().copied());
        }
        lines
    }

    /// Returns the straight pieces of the border; a circle has none.
    pub(crate) fn edges(&self) -> impl Iterator<Item = Edge> + '_ {
        let rings = match self {
            Self::Circle { .. } => &[][..],
            Self::Polygon { rings, .. } => rings,
        };
        rings
            .iter()
            .flat_map(|ring| (0..ring.len()).map(move |k| [ring[k], ring[(k + 1) % ring.len()]]))
    }
}

/// Returns whether a ray from a place to the east crosses an edge. Of two edges that meet at a corner just one does.
fn is_crossed_by_ray([a, b]: Edge, at: Point) -> bool {
    if (a[1] > at[1]) == (b[1] > at[1]) {
        return false;
    }
    let fraction = (at[1] - a[1]) / (b[1] - a[1]);
    at[0] < a[0] + fraction * (b[0] - a[0])
}

/// Returns the point of an edge that is nearest to a place.
pub(crate) fn nearest_on_edge(at: Point, [a, b]: Edge) -> Point {
    let along = sub(b, a);
    let length2 = norm_squared(along);
    if length2 <= 0.0 {
        return a;
    }
    add_scaled(a, along, (dot(sub(at, a), along) / length2).clamp(0.0, 1.0))
}

/// Returns the square of the distance of a place from an edge.
pub(crate) fn square_to_edge_m2(at: Point, edge: Edge) -> f64 {
    norm_squared(sub(at, nearest_on_edge(at, edge)))
}

/// Returns the distance of two edges in meters; 0 if they cross.
pub(crate) fn edge_distance_m(one: Edge, other: Edge) -> f64 {
    if do_edges_cross(one, other) {
        return 0.0;
    }
    let squares = [
        square_to_edge_m2(one[0], other),
        square_to_edge_m2(one[1], other),
        square_to_edge_m2(other[0], one),
        square_to_edge_m2(other[1], one),
    ];
    squares.into_iter().fold(f64::INFINITY, f64::min).sqrt()
}

/// Returns whether two edges have a point in common that is an end of neither.
pub(crate) fn do_edges_cross([a, b]: Edge, [c, d]: Edge) -> bool {
    let side = |p: Point, q: Point, r: Point| {
        let [ux, uy] = sub(q, p);
        let [wx, wy] = sub(r, p);
        ux * wy - uy * wx
    };
    let of_c = side(a, b, c);
    let of_d = side(a, b, d);
    let of_a = side(c, d, a);
    let of_b = side(c, d, b);
    (of_c > 0.0) != (of_d > 0.0)
        && (of_a > 0.0) != (of_b > 0.0)
        && of_c != 0.0
        && of_d != 0.0
        && of_a != 0.0
        && of_b != 0.0
}

/// Returns the distance of an edge from a circle's line, in meters.
pub(crate) fn edge_to_circle_line_m(edge: Edge, center: Point, radius_m: f64) -> f64 {
    let nearest_m = square_to_edge_m2(center, edge).sqrt();
    // The farthest point of an edge is an end of it.
    let farthest_m = distance_m(edge[0], center).max(distance_m(edge[1], center));
    if nearest_m > radius_m {
        nearest_m - radius_m
    } else if farthest_m < radius_m {
        radius_m - farthest_m
    } else {
        0.0
    }
}

/// Returns the distance of the lines of two circles, in meters.
pub(crate) fn circle_lines_distance_m(between_m: f64, [one_m, other_m]: [f64; 2]) -> f64 {
    let outside_m = between_m - one_m - other_m;
    let inside_m = (one_m - other_m).abs() - between_m;
    outside_m.max(inside_m).max(0.0)
}

/// Returns a place where the border of a shape crosses itself, if there is one. Edges are swept from west to east, so
/// that only those that are beside each other are compared.
pub(crate) fn find_crossing(shape: &AreaShape) -> Option<Point> {
    let west = |[a, b]: Edge| a[0].min(b[0]);
    let east = |[a, b]: Edge| a[0].max(b[0]);
    let mut edges: Vec<Edge> = shape.edges().collect();
    edges.sort_by(|one, other| west(*one).total_cmp(&west(*other)));
    for (k, &one) in edges.iter().enumerate() {
        let beside = edges[k + 1..].iter().take_while(|other| west(**other) <= east(one));
        for &other in beside {
            if do_edges_cross(one, other) {
                return Some(nearest_on_edge(lerp(other[0], other[1], 0.5), one));
            }
        }
    }
    None
}
