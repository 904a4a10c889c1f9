//! The floor of the shown box, and the shadows on it, by which depths are seen.

use super::Scene;
use super::canvas::{Canvas, Px, corners};
use super::extent::BoxM;
use crate::style::GRID;
use crate::svg::{Svg, SvgNumber};
use crate::ticks::nice_step;
use sidestep_kernel::geometry::cross_2d;
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::view::{Body, BodyKind, Shape, Vec3};
use std::fmt::Write as _;

/// Corners of the shadow of a ball.
const CORNERS: usize = 24;
/// Lines of the floor along its longer side.
const MAX_LINES: usize = 8;
/// Shadows are as wide as what casts them, but can always be seen.
const MIN_SHADOW_PX: f64 = 2.0;

/// Draws the floor with lines at round coordinates.
pub(super) fn draw_floor(svg: &mut Svg, canvas: &Canvas, [lo, hi]: BoxM) {
    let corner = |x: f64, y: f64| canvas.px([x, y, lo[2]]);
    let edge =
        [corner(lo[0], lo[1]), corner(hi[0], lo[1]), corner(hi[0], hi[1]), corner(lo[0], hi[1])];
    svg.path(&polygon(edge), r##"class="floor" fill="#F7F7F5""##);
    let step = nice_step((hi[0] - lo[0]).max(hi[1] - lo[1]), MAX_LINES);
    // A step that a double cannot resolve at these coordinates would have no end.
    let has_lines = step > 1e-9 * lo[0].abs().max(lo[1].abs());
    if !has_lines {
        return;
    }
    for x in multiples(lo[0], hi[0], step) {
        svg.line(corner(x, lo[1]), corner(x, hi[1]), format_args!(r#"stroke="{GRID}""#));
    }
    for y in multiples(lo[1], hi[1], step) {
        svg.line(corner(lo[0], y), corner(hi[0], y), format_args!(r#"stroke="{GRID}""#));
    }
}

fn multiples(from: f64, until: f64, step: f64) -> impl Iterator<Item = f64> {
    let first = (from / step).ceil();
    let last = (until / step).floor();
    let count = if last >= first { (last - first) as usize + 1 } else { 0 };
    (0..count.min(4 * MAX_LINES)).map(move |k| (first + k as f64) * step)
}

/// Draws the shadows of balls and of agents, cast straight down.
pub(super) fn draw_shadows(svg: &mut Svg, scene: &Scene<'_>, canvas: &Canvas, floor_m: f64) {
    let visible = scene.visible();
    let obstacles = visible.iter().filter(|body| body.kind == BodyKind::OBSTACLE);
    let mut data = String::new();
    for body in obstacles.clone() {
        match &body.shape {
            Shape::Sphere { radius_m } | Shape::Cylinder { radius_m, .. } => {
                data += &disc(body.pose.at_m, *radius_m, canvas, floor_m);
            }
            Shape::Cuboid { size_m } => data += &cuboid(body, *size_m, canvas, floor_m),
            Shape::Line { .. } | Shape::Dart { .. } => {}
        }
    }
    // One path, so that shadows that overlap are no darker.
    if !data.is_empty() {
        svg.path(&data, r##"class="shadow" fill="#000000" fill-opacity="0.07""##);
    }
    for body in obstacles {
        draw_line(svg, canvas, body, (floor_m, 0.07));
    }
    for body in visible.iter().filter(|body| body.kind.is_of_agent()) {
        draw_line(svg, canvas, body, (floor_m, 0.22));
    }
}

/// Returns the shadow of a box: the hull of its corners.
fn cuboid(body: &Body, size_m: Vec3, canvas: &Canvas, floor_m: f64) -> String {
    let half = size_m.map(|side_m| 0.5 * side_m);
    let corners = corners([half.map(|m| -m), half]).map(|corner| body.pose.transform_point(corner));
    let hull = hull(corners.map(|[x, y, _]| [x, y]).to_vec());
    polygon(hull.into_iter().map(|[x, y]| canvas.px([x, y, floor_m])))
}

/// Returns the corners of the smallest convex polygon around points, by Andrew's monotone chains.
fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut hull: Vec<[f64; 2]> = Vec::new();
    let upper: Vec<[f64; 2]> = points.iter().rev().copied().collect();
    for side in [points, upper] {
        let begin = hull.len();
        for point in side {
            while let [.., a, b] = hull[begin..]
                && cross_2d([b[0] - a[0], b[1] - a[1]], [point[0] - b[0], point[1] - b[1]]) <= 0.0
            {
                hull.pop();
            }
            hull.push(point);
        }
        // The last point begins the other side.
        hull.pop();
    }
    hull
}

/// Draws the shadow of a line, with an opacity.
fn draw_line(svg: &mut Svg, canvas: &Canvas, body: &Body, (floor_m, opacity): (f64, f64)) {
    let Shape::Line { points_m, thickness_m } = &body.shape else { return };
    let mut data = String::new();
    for (k, at) in points_m.iter().enumerate() {
        let command = if k == 0 { 'M' } else { 'L' };
        let (x, y) = canvas.px([at[0], at[1], floor_m]);
        // Writing into a String cannot fail.
        let _ = write!(data, "{command}{} {}", SvgNumber(x), SvgNumber(y));
    }
    let width = SvgNumber((thickness_m * canvas.px_per_m).max(MIN_SHADOW_PX));
    svg.path(
        &data,
        format_args!(
            r##"class="shadow" fill="none" stroke="#000000" stroke-opacity="{opacity}" stroke-width="{width}" stroke-linecap="round" stroke-linejoin="round""##
        ),
    );
}

/// Returns a flat disc on the floor under a place.
fn disc([x, y, _]: Vec3, radius_m: f64, canvas: &Canvas, floor_m: f64) -> String {
    polygon((0..CORNERS).map(|k| {
        let angle = k as f64 * std::f64::consts::TAU / CORNERS as f64;
        canvas.px([x + radius_m * cos(angle), y + radius_m * sin(angle), floor_m])
    }))
}

fn polygon(points: impl IntoIterator<Item = Px>) -> String {
    let mut data = String::new();
    for (k, (x, y)) in points.into_iter().enumerate() {
        let command = if k == 0 { 'M' } else { 'L' };
        // Writing into a String cannot fail.
        let _ = write!(data, "{command}{} {}", SvgNumber(x), SvgNumber(y));
    }
    data + "Z"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hull_has_the_corners_around_all_points() {
        let points = vec![[0.0, 0.0], [2.0, 0.0], [1.0, 0.5], [2.0, 2.0], [0.0, 2.0], [1.0, 0.0]];
        assert_eq!(hull(points), [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
    }

    #[test]
    fn lines_of_the_floor_are_at_round_coordinates() {
        assert_eq!(multiples(-3.0, 7.0, 5.0).collect::<Vec<_>>(), [0.0, 5.0]);
        assert_eq!(multiples(1.0, 4.0, 5.0).count(), 0);
    }
}
