//! Convex hulls of meshes, by the crate `parry3d-f64`.

use super::vector;
use parry3d_f64::math::Vector as ParryVector;
use parry3d_f64::shape::ConvexPolyhedron;

/// The maximum number of corners of a hull: each query looks at all of them.
const MAX_CORNERS: usize = 1000;

/// The number of cells along the longest side in which the corners of a finer hull are collected.
const CELLS: f64 = 64.0;

/// The smallest ratio of the shortest side of a hull to its longest: a flatter one has no inside.
const MIN_THICKNESS: f64 = 1e-6;

/// Returns the convex hull of points about the middle of the box around them; `None` where they have no inside.
///
/// A hull of very many corners is replaced by a slightly larger one, which reaches at most 1/64 of its longest side
/// further.
pub(super) fn of_points(points_m: &[[f64; 3]]) -> Option<ConvexPolyhedron> {
    let half_m = half_extents_m(points_m);
    let longest_m = half_m.into_iter().fold(0.0, f64::max);
    if half_m.into_iter().any(|half_m| half_m <= MIN_THICKNESS * longest_m) {
        return None;
    }
    let points: Vec<ParryVector> = points_m.iter().map(|point| vector(*point)).collect();
    let exact = ConvexPolyhedron::from_convex_hull(&points)?;
    if exact.points().len() <= MAX_CORNERS {
        return Some(exact);
    }
    let corners = cell_corners(exact.points(), 2.0 * longest_m / CELLS);
    ConvexPolyhedron::from_convex_hull(&corners)
}

/// Returns half of the extent of points about the middle of the box around them.
pub(super) fn half_extents_m(points_m: &[[f64; 3]]) -> [f64; 3] {
    let mut half_m = [0.0_f64; 3];
    for point in points_m {
        half_m = [0, 1, 2].map(|i| half_m[i].max(point[i].abs()));
    }
    half_m
}

/// Returns the corners of all cells with a point in them, each once.
fn cell_corners(points: &[ParryVector], side_m: f64) -> Vec<ParryVector> {
    let mut corners = std::collections::BTreeSet::new();
    for point in points {
        let cell = [point.x, point.y, point.z].map(|x| (x / side_m).floor() as i64);
        for corner in 0..8 {
            corners.insert([0, 1, 2].map(|i| cell[i] + (corner >> i & 1)));
        }
    }
    corners.into_iter().map(|corner| vector(corner.map(|k| k as f64 * side_m))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d_f64::query::PointQuery;
    use proptest::prelude::*;
    use sidestep_kernel::math::{cos, sin};

    fn ball(rings: usize) -> Vec<[f64; 3]> {
        let mut points = Vec::new();
        for i in 0..rings {
            let latitude = std::f64::consts::PI * (i as f64 / (rings - 1) as f64 - 0.5);
            for k in 0..rings {
                let longitude = std::f64::consts::TAU * k as f64 / rings as f64;
                let r = cos(latitude);
                points.push([r * cos(longitude), r * sin(longitude), sin(latitude)]);
            }
        }
        points
    }

    #[test]
    fn a_hull_has_its_corners_and_a_finer_one_few_more_around_them() {
        let coarse = of_points(&ball(12)).expect("a hull");
        assert!(coarse.points().len() <= 146);
        let points = ball(90);
        let fine = of_points(&points).expect("a hull");
        assert!(fine.points().len() <= MAX_CORNERS, "{}", fine.points().len());
        for point in &points {
            assert!(fine.distance_to_local_point(vector(*point), true) < 1e-9);
        }
        let farthest = fine.points().iter().map(|p| p.length()).fold(0.0, f64::max);
        assert!(farthest < 1.0 + 3.5 / CELLS, "{farthest}");
    }

    #[test]
    fn flat_points_have_no_hull() {
        let square = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        assert!(of_points(&square).is_none());
        assert!(of_points(&[[0.0; 3]]).is_none());
        assert_eq!(half_extents_m(&square), [1.0, 1.0, 0.0]);
    }

    proptest! {
        #[test]
        fn no_points_panic_and_a_hull_holds_them_all(
            points in proptest::collection::vec(
                [0, 1, 2].map(|_| prop_oneof![Just(0.0), Just(1.0), -1.0f64..1.0, (-3i32..4).prop_map(f64::from)]),
                1..60,
            ),
            shift in -2.0f64..2.0,
        ) {
            // Some in a tilted plane.
            let tilted: Vec<_> = points.iter().map(|[x, y, z]| [*x, *y, if shift < 0.0 { x + y } else { *z }]).collect();
            if let Some(hull) = of_points(&tilted) {
                for point in &tilted {
                    prop_assert!(hull.distance_to_local_point(vector(*point), true) < 1e-6);
                }
            }
        }
    }
}
