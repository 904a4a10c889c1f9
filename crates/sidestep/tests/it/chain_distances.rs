//! Promise: the distances on which the chain world rests are those that a geometry library finds
//! by other ways (parry: clamped parameters for segments, GJK for boxes).
//!
//! Parry gives the distance of two points that it takes for the nearest, so it is never too small,
//! but up to some 1e-7 m too large for nearly parallel segments; GJK ends within 1e-6 m or so.

use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query;
use parry3d_f64::shape::{Ball, Cuboid as Box3, Segment, Shape};
use proptest::prelude::*;
use sidestep::rods::geometry::{ConvexCore, Cuboid, Point};

/// A plane point lies in the plane z = 0.
fn vector<const D: usize>(p: Point<D>) -> Vector {
    Vector::new(p[0], p[1], if D == 3 { p[2] } else { 0.0 })
}

fn segment<const D: usize>([p, q]: [Point<D>; 2]) -> Segment {
    Segment::new(vector(p), vector(q))
}

/// The distance to a shape at a pose, by parry.
fn apart_m(body: &dyn Shape, core: &dyn Shape, pose: &Pose) -> f64 {
    query::distance(&Pose::IDENTITY, body, pose, core).expect("a pair that parry knows").distance
}

fn point<const D: usize>() -> impl Strategy<Value = Point<D>> {
    proptest::array::uniform(-3.0..3.0f64)
}

/// Segments in any position, and nearly parallel ones.
fn two_segments<const D: usize>() -> impl Strategy<Value = [[Point<D>; 2]; 2]> {
    let tilt = prop_oneof![Just(1.0), Just(1e-7), Just(1e-10), Just(1e-15), Just(0.0)];
    ([point(), point(), point(), point()], tilt).prop_map(|([p, q, a, b], tilt)| {
        let end = |i: usize| a[i] + (q[i] - p[i]) * (1.0 - tilt) + (b[i] - a[i]) * tilt;
        [[p, q], [a, std::array::from_fn(end)]]
    })
}

fn segments_agree<const D: usize>([body, core]: [[Point<D>; 2]; 2]) -> Result<(), TestCaseError> {
    let ours_m = ConvexCore::Segment(core).nearest_to_segment(body).distance_m;
    let theirs_m = apart_m(&segment(body), &segment(core), &Pose::IDENTITY);
    prop_assert!(ours_m <= theirs_m + 1e-12 && ours_m >= theirs_m - 1e-6, "{ours_m} {theirs_m}");
    Ok(())
}

/// Both ways: the point as a ball of no size, and the segment or box as it is.
fn points_agree<const D: usize>(
    p: Point<D>,
    ours: &ConvexCore<D>,
    theirs: &dyn Shape,
    pose: &Pose,
) -> Result<(), TestCaseError> {
    let ours_m = ours.nearest_to_point(p).distance_m;
    let theirs_m = theirs.distance_to_point(pose, vector(p), true);
    prop_assert!((ours_m - theirs_m).abs() < 1e-12, "{ours_m} {theirs_m}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2000, failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn segments_are_as_far_apart_as_parry_says(
        plane in two_segments::<2>(), space in two_segments::<3>(),
    ) {
        segments_agree(plane)?;
        segments_agree(space)?;
    }

    #[test]
    fn points_are_as_far_from_segments_as_parry_says(
        plane in [point::<2>(), point(), point()], space in [point::<3>(), point(), point()],
    ) {
        let [p, a, b] = plane;
        points_agree(p, &ConvexCore::Segment([a, b]), &segment([a, b]), &Pose::IDENTITY)?;
        let [p, a, b] = space;
        points_agree(p, &ConvexCore::Segment([a, b]), &segment([a, b]), &Pose::IDENTITY)?;
        let ours_m = ConvexCore::Point(a).nearest_to_segment([p, b]).distance_m;
        let at = Pose::from_translation(vector(a));
        let theirs_m = apart_m(&segment([p, b]), &Ball::new(0.0), &at);
        prop_assert!((ours_m - theirs_m).abs() < 1e-12, "{ours_m} {theirs_m}");
    }

    #[test]
    fn boxes_are_as_far_as_parry_says(
        center in point::<3>(), turn in point::<3>(),
        half_m in prop::array::uniform3(0.001..1.5f64),
        p in point::<3>(), q in point::<3>(),
    ) {
        let pose = Pose::new(vector(center), vector(turn));
        let axes = [Vector::X, Vector::Y, Vector::Z].map(|e| {
            let turned = pose.rotation * e;
            [turned.x, turned.y, turned.z]
        });
        let ours = ConvexCore::Cuboid(Cuboid { center, axes, half_m });
        let theirs = Box3::new(vector(half_m));
        points_agree(p, &ours, &theirs, &pose)?;
        let ours_m = ours.nearest_to_segment([p, q]).distance_m;
        let theirs_m = apart_m(&segment([p, q]), &theirs, &pose);
        prop_assert!((ours_m - theirs_m).abs() < 1e-6, "{ours_m} {theirs_m}");
    }

    #[test]
    fn plane_boxes_are_as_far_as_flat_ones_in_space(
        center in point::<2>(), angle_rad in -3.0..3.0f64,
        half_m in prop::array::uniform2(0.001..1.5f64), p in point::<2>(), q in point::<2>(),
    ) {
        let pose = Pose::new(vector(center), Vector::new(0.0, 0.0, angle_rad));
        let axes = [Vector::X, Vector::Y].map(|e| {
            let turned = pose.rotation * e;
            [turned.x, turned.y]
        });
        let ours = ConvexCore::Cuboid(Cuboid { center, axes, half_m });
        let theirs = Box3::new(Vector::new(half_m[0], half_m[1], 1.0));
        points_agree(p, &ours, &theirs, &pose)?;
        let ours_m = ours.nearest_to_segment([p, q]).distance_m;
        let theirs_m = apart_m(&segment([p, q]), &theirs, &pose);
        prop_assert!((ours_m - theirs_m).abs() < 1e-6, "{ours_m} {theirs_m}");
    }
}
