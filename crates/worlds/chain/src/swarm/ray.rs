//! Exact distances from a point along a ray to the first obstacle, in the plane.

use sidestep_rods::Obstacles;
use sidestep_rods::geometry::{
    Aabb, ConvexCore, Point, add, cross_2d, distance, dot, normalized, perpendicular, scaled, sub,
};

/// Returns the distance at which a ray from `from` along the unit vector `u` enters the region
/// within `radius_m` of a core; 0 from inside, `None` if it never does.
pub(crate) fn distance_m(
    from: Point<2>,
    u: Point<2>,
    core: &ConvexCore<2>,
    radius_m: f64,
) -> Option<f64> {
    match core {
        ConvexCore::Point(c) => ray_distance_to_disc(from, u, *c, radius_m),
        ConvexCore::Segment(ends) => ray_distance_to_capsule(from, u, *ends, radius_m),
        // The outline of a box with round corners is the outer one of its edges' capsules.
        ConvexCore::Cuboid(cuboid) => {
            if core.nearest_to_point(from).distance_m <= radius_m {
                return Some(0.0);
            }
            let edges =
                cuboid.edges_2d().map(|edge| ray_distance_to_capsule(from, u, edge, radius_m));
            edges.into_iter().flatten().reduce(f64::min)
        }
    }
}

fn ray_distance_to_disc(
    from: Point<2>,
    u: Point<2>,
    center: Point<2>,
    radius_m: f64,
) -> Option<f64> {
    let to = sub(center, from);
    let ahead_m = dot(u, to);
    let aside_m = cross_2d(u, to);
    if dot(to, to) <= radius_m * radius_m {
        return Some(0.0);
    }
    let half2 = radius_m * radius_m - aside_m * aside_m;
    (half2 >= 0.0 && ahead_m > 0.0).then(|| (ahead_m - half2.sqrt()).max(0.0))
}

fn ray_distance_to_capsule(
    from: Point<2>,
    u: Point<2>,
    ends: [Point<2>; 2],
    radius_m: f64,
) -> Option<f64> {
    if radius_m > 0.0 && ConvexCore::Segment(ends).nearest_to_point(from).distance_m <= radius_m {
        return Some(0.0);
    }
    let caps = ends.map(|end| ray_distance_to_disc(from, u, end, radius_m)).into_iter().flatten();
    caps.chain(distance_to_capsule_sides(from, u, ends, radius_m)).reduce(f64::min)
}

/// Returns the distance to the long sides of a capsule; without a radius, they are the segment.
fn distance_to_capsule_sides(
    from: Point<2>,
    u: Point<2>,
    ends: [Point<2>; 2],
    radius_m: f64,
) -> Option<f64> {
    let aside = scaled(perpendicular(normalized(sub(ends[1], ends[0]))?), radius_m);
    let left = ray_distance_to_segment(from, u, ends.map(|end| add(end, aside)));
    if radius_m == 0.0 {
        return left;
    }
    let right = ray_distance_to_segment(from, u, ends.map(|end| sub(end, aside)));
    [left, right].into_iter().flatten().reduce(f64::min)
}

fn ray_distance_to_segment(from: Point<2>, u: Point<2>, [a, b]: [Point<2>; 2]) -> Option<f64> {
    let d = sub(b, a);
    let to_a = sub(a, from);
    // The ends lie on both sides of the ray's line, or on it.
    let side_a = cross_2d(u, to_a);
    let side_b = cross_2d(u, sub(b, from));
    let crossing = cross_2d(u, d);
    if side_a * side_b > 0.0 || crossing == 0.0 {
        return None;
    }
    let ahead_m = cross_2d(to_a, d) / crossing;
    (ahead_m >= 0.0).then_some(ahead_m)
}

/// Returns whether no obstacle lies on a line.
pub(crate) fn is_clear(obstacles: &Obstacles<2>, line: [Point<2>; 2]) -> bool {
    let mut is_clear = true;
    obstacles.visit(&Aabb::from_points(&line), |o| {
        is_clear &= o.core.nearest_to_segment(line).distance_m > o.radius_m;
    });
    is_clear
}

/// Returns the directions in which a capsule is seen from `from`: the middle one and half the angle
/// between the outermost; `None` if it may be in any direction.
pub(super) fn capsule_extent_rad(
    from: Point<2>,
    ends: [Point<2>; 2],
    radius_m: f64,
) -> Option<(f64, f64)> {
    use sidestep_kernel::math::{asin, atan2, wrap_angle};
    // At the surface rounding decides what is seen in which direction.
    if ConvexCore::Segment(ends).nearest_to_point(from).distance_m <= radius_m + 1e-9 {
        return None;
    }
    let [a, b] = ends.map(|end| {
        let to = sub(end, from);
        (atan2(to[1], to[0]), asin((radius_m / distance(end, from)).min(1.0)))
    });
    let apart = wrap_angle(b.0 - a.0);
    let low = (-a.1).min(apart - b.1);
    let high = a.1.max(apart + b.1);
    Some((a.0 + 0.5 * (low + high), 0.5 * (high - low)))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;
    use sidestep_kernel::math::{cos, sin};
    use sidestep_rods::geometry::{Cuboid, add_scaled};

    /// Marches along the ray by the distance to the core, which never oversteps.
    pub(crate) fn marched_m(
        from: Point<2>,
        u: Point<2>,
        core: &ConvexCore<2>,
        radius_m: f64,
    ) -> Option<f64> {
        let mut gone_m = 0.0;
        for _ in 0..200_000 {
            let gap_m = core.nearest_to_point(add_scaled(from, u, gone_m)).distance_m - radius_m;
            if gap_m < 1e-9 {
                return Some(gone_m);
            }
            gone_m += gap_m;
            if gone_m > 20.0 {
                return None;
            }
        }
        None
    }

    pub(crate) fn core_strategy() -> impl Strategy<Value = ConvexCore<2>> {
        let point = || prop::array::uniform2(-3.0..3.0f64);
        let cuboid = (point(), -3.0..3.0f64, prop::array::uniform2(0.05..1.0f64)).prop_map(
            |(center, turn, half_m)| {
                let axis = [cos(turn), sin(turn)];
                ConvexCore::Cuboid(Cuboid { center, axes: [axis, perpendicular(axis)], half_m })
            },
        );
        prop_oneof![
            point().prop_map(ConvexCore::Point),
            (point(), point()).prop_map(|(a, b)| ConvexCore::Segment([a, b])),
            cuboid,
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]
        #[test]
        fn a_ray_goes_as_far_as_marching_does(
            from in prop::array::uniform2(-3.0..3.0f64), toward in -3.2..3.2f64,
            core in core_strategy(), radius_m in 0.01..0.8f64,
        ) {
            let u = [cos(toward), sin(toward)];
            let (exact, marched) = (distance_m(from, u, &core, radius_m), marched_m(from, u, &core, radius_m));
            match (exact, marched) {
                (Some(e), Some(m)) => prop_assert!((e - m).abs() < 1e-3, "{e} {m}"),
                (None, None) => {}
                // A ray that just grazes.
                (e, m) => {
                    let least = core.nearest_to_segment([from, add_scaled(from, u, 20.0)]).distance_m;
                    prop_assert!((least - radius_m).abs() < 1e-6, "{e:?} {m:?}");
                }
            }
        }

        #[test]
        fn a_thin_wall_is_met_where_it_is_crossed(
            from in prop::array::uniform2(-3.0..3.0f64),
            a in prop::array::uniform2(-3.0..3.0f64), b in prop::array::uniform2(-3.0..3.0f64),
            part in 0.01..0.99f64,
        ) {
            let at = sidestep_rods::geometry::lerp(a, b, part);
            let Some(u) = normalized(sub(at, from)) else { return Ok(()) };
            prop_assume!(cross_2d(u, sub(b, a)).abs() > 1e-3);
            let hit_m = distance_m(from, u, &ConvexCore::Segment([a, b]), 0.0).unwrap();
            prop_assert!((hit_m - distance(at, from)).abs() < 1e-9);
        }
    }

    #[test]
    fn a_wall_seen_end_on_is_seen() {
        let wall = ConvexCore::Segment([[1.0, 0.0], [2.0, 0.0]]);
        assert_eq!(distance_m([0.0, 0.0], [1.0, 0.0], &wall, 0.0), Some(1.0));
        assert_eq!(distance_m([0.0, 0.0], [-1.0, 0.0], &wall, 0.0), None);
    }
}
