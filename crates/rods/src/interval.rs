//! The blocked directions of a planar rod, computed exactly: the union rule.
//!
//! A rod turns about its master. The directions in which a rod of one length meets one convex
//! obstacle are one interval: how wide the obstacle, grown by the rod's radius and cut to the reach
//! of the rod, looks from the master. A thicker connector at the rod's end adds arcs, a bend limit
//! one more interval. The rod turns to the free direction nearest to the slave's old place, on either
//! side. That is the smallest turn that clears everything at once. The rule of the slides (A7) avoids the
//! obstacle hit nearest to the master and leads from there into the next one, up to 0.19 m deep where
//! measured; one obstacle after the other turns back and forth between two walls without end.

use super::geometry::{ConvexCore, Point, cross_2d, dot, nearest_on_segment, norm, sub};
use sidestep_kernel::math;
use std::f64::consts::TAU;

/// The directions from `from_rad`, counterclockwise, over `width_rad`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AngleInterval {
    /// Its start, rad.
    pub(crate) from_rad: f64,
    /// Its width, counterclockwise, rad; 2 pi for all directions.
    pub(crate) width_rad: f64,
}

impl AngleInterval {
    #[inline]
    fn from_center(center_rad: f64, low_rad: f64, high_rad: f64) -> Self {
        Self { from_rad: center_rad + low_rad, width_rad: (high_rad - low_rad).min(TAU) }
    }

    /// Returns whether a direction is inside.
    #[cfg(test)]
    pub(super) fn contains(&self, angle_rad: f64) -> bool {
        wrapped_rad(angle_rad - self.from_rad) < self.width_rad
    }
}

/// What of a rod decides in which directions an obstacle is in its way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RodTurnCircle {
    pub(crate) master: Point<2>,
    pub(crate) length_m: f64,
}

/// Adds the directions in which a rod of no thickness meets the points within `radius_m` of a
/// core. Returns false, and adds nothing, where the master itself is inside.
pub(super) fn block_rod(
    reach: &RodTurnCircle,
    core: &ConvexCore<2>,
    radius_m: f64,
    arcs: &mut Vec<AngleInterval>,
) -> bool {
    match core {
        ConvexCore::Point(c) => block_by_capsule(reach, [*c, *c], radius_m, arcs),
        ConvexCore::Segment(ends) => block_by_capsule(reach, *ends, radius_m, arcs),
        ConvexCore::Cuboid(cuboid) => {
            let is_outside = core.nearest_to_point(reach.master).distance_m >= radius_m
                && core.nearest_to_point(reach.master).distance_m > 0.0;
            is_outside
                && cuboid.edges_2d().iter().all(|e| block_by_capsule(reach, *e, radius_m, arcs))
        }
    }
}

fn block_by_capsule(
    reach: &RodTurnCircle,
    [a, b]: [Point<2>; 2],
    radius_m: f64,
    arcs: &mut Vec<AngleInterval>,
) -> bool {
    let a = sub(a, reach.master);
    let b = sub(b, reach.master);
    let nearest = nearest_on_segment([0.0; 2], a, b);
    let apart_m = norm(nearest);
    if apart_m >= reach.length_m + radius_m {
        return true;
    }
    if apart_m < radius_m || apart_m == 0.0 {
        return false;
    }
    // Seen from outside, a convex body lies within a quarter turn of its nearest point, so angles
    // from there never wrap.
    let view = ObstacleAngularView { middle: nearest, length_m: reach.length_m, radius_m };
    let mut extent = AngularExtent { low_rad: 0.0, high_rad: 0.0 };
    view.widen_by_disc(a, &mut extent);
    if a != b {
        view.widen_by_disc(b, &mut extent);
        view.widen_by_edges(a, b, &mut extent);
    }
    let middle_rad = math::atan2(nearest[1], nearest[0]);
    arcs.push(AngleInterval::from_center(middle_rad, extent.low_rad, extent.high_rad));
    true
}

/// The angles under which an obstacle is seen from the master, relative to its nearest point.
struct AngularExtent {
    low_rad: f64,
    high_rad: f64,
}

/// The view of an obstacle from the master, in angles from the direction of the nearest point.
struct ObstacleAngularView {
    middle: Point<2>,
    length_m: f64,
    radius_m: f64,
}

impl ObstacleAngularView {
    #[inline]
    fn angle_to(&self, p: Point<2>) -> f64 {
        math::atan2(cross_2d(self.middle, p), dot(self.middle, p))
    }

    fn widen_by_disc(&self, center: Point<2>, extent: &mut AngularExtent) {
        let apart_m = norm(center);
        if let Some(half_rad) = blocking_half_angle_rad(apart_m, self.radius_m, self.length_m) {
            let angle_rad = self.angle_to(center);
            extent.low_rad = extent.low_rad.min(angle_rad - half_rad);
            extent.high_rad = extent.high_rad.max(angle_rad + half_rad);
        }
    }

    /// Adds the two edges of the capsule, as far as the rod reaches.
    fn widen_by_edges(&self, a: Point<2>, b: Point<2>, extent: &mut AngularExtent) {
        let d = sub(b, a);
        let length_m = norm(d);
        let normal = [-d[1] / length_m, d[0] / length_m];
        for side in [-self.radius_m, self.radius_m] {
            let from = [a[0] + normal[0] * side, a[1] + normal[1] * side];
            for p in clip_to_circle(from, d, self.length_m).into_iter().flatten() {
                let angle_rad = self.angle_to(p);
                extent.low_rad = extent.low_rad.min(angle_rad);
                extent.high_rad = extent.high_rad.max(angle_rad);
            }
        }
    }
}

/// Returns half the angle under which a disc (or a sphere) blocks a rod: up to the tangent, or, if
/// that is out of reach, up to where the rod's tip touches. `None` if the disc is out of reach; the
/// master must not be inside.
#[inline]
pub(super) fn blocking_half_angle_rad(apart_m: f64, radius_m: f64, length_m: f64) -> Option<f64> {
    if apart_m - radius_m >= length_m {
        return None;
    }
    let tangent2 = apart_m * apart_m - radius_m * radius_m;
    if tangent2 <= length_m * length_m {
        return Some(math::asin((radius_m / apart_m).min(1.0)));
    }
    let cosine = (length_m * length_m + tangent2) / (2.0 * apart_m * length_m);
    Some(math::acos(cosine.clamp(-1.0, 1.0)))
}

/// Returns the ends of the part of the segment from `a` along `d` within `reach_m` of the origin.
fn clip_to_circle(a: Point<2>, d: Point<2>, reach_m: f64) -> [Option<Point<2>>; 2] {
    let dd = dot(d, d);
    let ad = dot(a, d);
    let discriminant = ad * ad - dd * (dot(a, a) - reach_m * reach_m);
    if discriminant < 0.0 {
        return [None; 2];
    }
    let root = discriminant.sqrt();
    let from = ((-ad - root) / dd).max(0.0);
    let to = ((-ad + root) / dd).min(1.0);
    if from > to {
        return [None; 2];
    }
    [from, to].map(|fraction| Some([a[0] + d[0] * fraction, a[1] + d[1] * fraction]))
}

/// Adds the directions in which the rod's far end is within `radius_m` of a core: arcs of the
/// circle on which it turns, up to four for a capsule.
pub(super) fn add_tip_blocked_arcs(
    reach: &RodTurnCircle,
    core: &ConvexCore<2>,
    radius_m: f64,
    arcs: &mut Vec<AngleInterval>,
) {
    match core {
        ConvexCore::Point(c) => add_tip_arcs_of_capsule(reach, [*c, *c], radius_m, arcs),
        ConvexCore::Segment(ends) => add_tip_arcs_of_capsule(reach, *ends, radius_m, arcs),
        ConvexCore::Cuboid(cuboid) => {
            for edge in cuboid.edges_2d() {
                add_tip_arcs_of_capsule(reach, edge, radius_m, arcs);
            }
        }
    }
}

fn add_tip_arcs_of_capsule(
    reach: &RodTurnCircle,
    [a, b]: [Point<2>; 2],
    radius_m: f64,
    arcs: &mut Vec<AngleInterval>,
) {
    let a = sub(a, reach.master);
    let b = sub(b, reach.master);
    let t = reach.length_m;
    if norm(nearest_on_segment([0.0; 2], a, b)) >= t + radius_m
        || norm(a).max(norm(b)) <= t - radius_m
    {
        return;
    }
    let mut borders = BorderAngles::default();
    borders.add_disc(a, radius_m, t);
    if a != b {
        borders.add_disc(b, radius_m, t);
        borders.add_edge_crossings(a, b, radius_m, t);
    }
    borders.arcs_where(
        |angle_rad| {
            let tip = [t * math::cos(angle_rad), t * math::sin(angle_rad)];
            norm(sub(tip, nearest_on_segment(tip, a, b))) < radius_m
        },
        arcs,
    );
}

/// Directions in which the circle of the tip crosses the border of a capsule: at most twice each of its two end discs
/// and two edges.
#[derive(Default)]
struct BorderAngles {
    angles_rad: [f64; 8],
    n: usize,
}

impl BorderAngles {
    fn push(&mut self, angle_rad: f64) {
        self.angles_rad[self.n] = wrapped_rad(angle_rad);
        self.n += 1;
    }

    fn add_disc(&mut self, center: Point<2>, radius_m: f64, t: f64) {
        let apart_m = norm(center);
        let cosine = (apart_m * apart_m + t * t - radius_m * radius_m) / (2.0 * apart_m * t);
        if cosine.abs() < 1.0 {
            let middle_rad = math::atan2(center[1], center[0]);
            let half_rad = math::acos(cosine);
            self.push(middle_rad - half_rad);
            self.push(middle_rad + half_rad);
        }
    }

    fn add_edge_crossings(&mut self, a: Point<2>, b: Point<2>, radius_m: f64, t: f64) {
        let d = sub(b, a);
        let length_m = norm(d);
        let normal = [-d[1] / length_m, d[0] / length_m];
        let height_m = dot(a, normal);
        for side in [-radius_m, radius_m] {
            let cosine = (height_m + side) / t;
            if cosine.abs() < 1.0 {
                let middle_rad = math::atan2(normal[1], normal[0]);
                let half_rad = math::acos(cosine);
                self.push(middle_rad - half_rad);
                self.push(middle_rad + half_rad);
            }
        }
    }

    /// Between two borders all directions give the same answer, so the middle one is tested.
    fn arcs_where(&mut self, is_blocked: impl Fn(f64) -> bool, arcs: &mut Vec<AngleInterval>) {
        let angles_rad = &mut self.angles_rad[..self.n];
        angles_rad.sort_unstable_by(f64::total_cmp);
        if angles_rad.is_empty() {
            if is_blocked(0.0) {
                arcs.push(AngleInterval { from_rad: 0.0, width_rad: TAU });
            }
            return;
        }
        for k in 0..angles_rad.len() {
            let from_rad = angles_rad[k];
            let to_rad = angles_rad.get(k + 1).copied().unwrap_or(angles_rad[0] + TAU);
            if to_rad > from_rad && is_blocked(0.5 * (from_rad + to_rad)) {
                arcs.push(AngleInterval { from_rad, width_rad: to_rad - from_rad });
            }
        }
    }
}

/// Returns the directions that bend a connector beyond its limit, when it is reached along `into`.
#[inline]
pub(super) fn bend_forbidden_arc(into: Point<2>, max_bend_rad: f64) -> AngleInterval {
    let into_rad = math::atan2(into[1], into[0]);
    AngleInterval {
        from_rad: into_rad + max_bend_rad,
        width_rad: (TAU - 2.0 * max_bend_rad).max(0.0),
    }
}

/// Returns the same direction in [0, 2 pi]: `rem_euclid` without a division, for angles that are at
/// most a few turns away.
#[inline]
fn wrapped_rad(mut angle_rad: f64) -> f64 {
    while angle_rad < 0.0 {
        angle_rad += TAU;
    }
    while angle_rad >= TAU {
        angle_rad -= TAU;
    }
    angle_rad
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TurnDirection {
    /// Counter-clockwise.
    Left,
    /// Clockwise.
    Right,
}

/// Returns the least turn from a direction to one in no arc, in [0, 2 pi); `None` if all are
/// blocked.
pub(super) fn min_turn_to_free_rad(
    arcs: &[AngleInterval],
    start_rad: f64,
    side: TurnDirection,
) -> Option<f64> {
    let mut turn_rad = 0.0;
    // Each round passes at least one arc for good, and an arc that contains the start may be met a second time after a
    // full turn.
    for _ in 0..=2 * arcs.len() {
        let mut next_rad: f64 = turn_rad;
        for arc in arcs {
            let into_rad = match side {
                TurnDirection::Left => start_rad + turn_rad - arc.from_rad,
                TurnDirection::Right => arc.from_rad + arc.width_rad - (start_rad - turn_rad),
            };
            let into_rad = wrapped_rad(into_rad);
            // An arc that starts where another ends leaves no gap, however both were rounded.
            let into_rad = if into_rad > TAU - ARC_TOLERANCE_RAD { 0.0 } else { into_rad };
            if into_rad < arc.width_rad {
                next_rad = next_rad.max(turn_rad + (arc.width_rad - into_rad));
            }
        }
        if next_rad >= TAU {
            return None;
        }
        if next_rad <= turn_rad + ARC_TOLERANCE_RAD {
            return Some(next_rad);
        }
        turn_rad = next_rad;
    }
    None
}

/// Tolerance at the ends of arcs, rad: rounding may move an end into its arc, or two touching arcs
/// apart, by this much; the skin is far larger.
const ARC_TOLERANCE_RAD: f64 = 1e-13;

/// Returns the direction of a turn from a unit vector.
#[inline]
pub(super) fn turn(u: Point<2>, turn_rad: f64, side: TurnDirection) -> Point<2> {
    let signed_rad = if side == TurnDirection::Left { turn_rad } else { -turn_rad };
    let c = math::cos(signed_rad);
    let s = math::sin(signed_rad);
    [u[0] * c - u[1] * s, u[0] * s + u[1] * c]
}

/// Returns the direction of a vector, in (-pi, pi].
#[inline]
pub(super) fn direction_rad(u: Point<2>) -> f64 {
    math::atan2(u[1], u[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::{Config, TestRunner};

    /// Number of random cases: `SIDESTEP_CASES`, or few enough for everyday runs.
    fn cases(usual: u32) -> u32 {
        std::env::var("SIDESTEP_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(usual)
    }

    fn tip(reach: &RodTurnCircle, angle_rad: f64) -> Point<2> {
        let RodTurnCircle { master: [x, y], length_m } = *reach;
        [x + length_m * math::cos(angle_rad), y + length_m * math::sin(angle_rad)]
    }

    #[derive(Debug, Clone)]
    struct Case {
        reach: RodTurnCircle,
        core: ConvexCore<2>,
        radius_m: f64,
        tip_radius_m: f64,
        angles_rad: Vec<f64>,
    }

    fn case() -> impl Strategy<Value = Case> {
        let point = || prop::array::uniform2(-2.0..2.0f64);
        let core = prop_oneof![
            point().prop_map(ConvexCore::Point),
            [point(), point()].prop_map(ConvexCore::Segment),
            (point(), 0.0..TAU, prop::array::uniform2(0.01..1.0f64)).prop_map(
                |(center, a, half_m)| {
                    let u = [math::cos(a), math::sin(a)];
                    let axes = [u, [-u[1], u[0]]];
                    ConvexCore::Cuboid(super::super::geometry::Cuboid { center, axes, half_m })
                }
            ),
        ];
        let radii = (prop_oneof![Just(1e-6), 0.0..0.8f64], 0.0..0.5f64);
        let angles = prop::collection::vec(0.0..TAU, 8);
        (point(), 0.05..2.5f64, core, radii, angles).prop_map(
            |(master, length_m, core, (radius_m, more_m), angles_rad)| Case {
                reach: RodTurnCircle { master, length_m },
                core,
                radius_m,
                tip_radius_m: radius_m + more_m,
                angles_rad,
            },
        )
    }

    /// Checks that intervals and distances agree, in random directions and beside every border.
    fn agree(case: &Case) -> Result<(), TestCaseError> {
        let Case { reach, core, radius_m, tip_radius_m, angles_rad } = case;
        let mut arcs = Vec::new();
        if !block_rod(reach, core, *radius_m, &mut arcs) {
            let apart_m = core.nearest_to_point(reach.master).distance_m;
            prop_assert!(apart_m < *radius_m || apart_m == 0.0);
            return Ok(());
        }
        let mut tips = Vec::new();
        add_tip_blocked_arcs(reach, core, *tip_radius_m, &mut tips);
        let borders = arcs
            .iter()
            .chain(&tips)
            .flat_map(|a| [a.from_rad - 1e-6, a.from_rad + 1e-6, a.from_rad + a.width_rad + 1e-6]);
        for angle_rad in angles_rad.iter().copied().chain(borders.collect::<Vec<_>>()) {
            let end = tip(reach, angle_rad);
            let rod_m = core.nearest_to_segment([reach.master, end]).distance_m - radius_m;
            let tip_m = core.nearest_to_point(end).distance_m - tip_radius_m;
            let says_rod = arcs.iter().any(|a| a.contains(angle_rad));
            let says_tip = tips.iter().any(|a| a.contains(angle_rad));
            prop_assert!(
                rod_m.abs() < 1e-9 || says_rod == (rod_m < 0.0),
                "rod {angle_rad} {rod_m}"
            );
            let hidden = matches!(core, ConvexCore::Cuboid(_)) && rod_m < 0.0;
            prop_assert!(
                hidden || tip_m.abs() < 1e-9 || says_tip == (tip_m < 0.0),
                "tip {angle_rad} {tip_m}"
            );
        }
        Ok(())
    }

    fn run(cases: u32) {
        let config = Config { cases, failure_persistence: None, ..Config::default() };
        TestRunner::new(config).run(&case(), |case| agree(&case)).unwrap();
    }

    #[test]
    fn intervals_are_what_distances_say() {
        run(cases(4_000));
    }

    /// `cargo test --release -- --ignored a_million`: 8 directions and the borders of each.
    #[test]
    #[ignore = "minutes; the quick one runs every day"]
    fn a_million_intervals_are_what_distances_say() {
        run(cases(1_000_000));
    }

    /// Returns the depth of the rod, or its end, in any core, meters.
    fn depth_m(
        reach: &RodTurnCircle,
        cores: &[ConvexCore<2>],
        [rod_m, tip_m]: [f64; 2],
        angle_rad: f64,
    ) -> f64 {
        let end = tip(reach, angle_rad);
        let depth_m = |core: &ConvexCore<2>| {
            let rod_m = rod_m - core.nearest_to_segment([reach.master, end]).distance_m;
            rod_m.max(tip_m - core.nearest_to_point(end).distance_m)
        };
        cores.iter().map(depth_m).fold(f64::NEG_INFINITY, f64::max)
    }

    proptest! {
        #![proptest_config(Config { failure_persistence: None, ..Config::default() })]

        #[test]
        fn the_least_turn_is_the_first_that_distances_allow(
            master in prop::array::uniform2(-1.0..1.0f64),
            length_m in 0.3..1.5f64,
            corners in prop::collection::vec(prop::array::uniform2(-2.0..2.0f64), 2..7),
            rod_m in 0.01..0.2f64, more_m in 0.01..0.3f64, start_rad in 0.0..TAU,
        ) {
            // Walls in a row: where one ends the next begins.
            let reach = RodTurnCircle { master, length_m };
            let cores: Vec<_> =
                corners.windows(2).map(|ends| ConvexCore::Segment([ends[0], ends[1]])).collect();
            let (mut arcs, radii_m) = (Vec::new(), [rod_m, rod_m + more_m]);
            for core in &cores {
                prop_assume!(block_rod(&reach, core, rod_m, &mut arcs));
                add_tip_blocked_arcs(&reach, core, radii_m[1], &mut arcs);
            }
            for (side, sign) in [(TurnDirection::Left, 1.0), (TurnDirection::Right, -1.0)] {
                let turn_rad = min_turn_to_free_rad(&arcs, start_rad, side);
                if let Some(turn_rad) = turn_rad {
                    let depth_m = depth_m(&reach, &cores, radii_m, start_rad + sign * turn_rad);
                    prop_assert!(depth_m < 1e-9, "{side:?} {turn_rad}: {depth_m}");
                }
                for k in 0..600 {
                    let earlier_rad = TAU * f64::from(k) / 600.0;
                    if earlier_rad < turn_rad.unwrap_or(TAU) {
                        let angle_rad = start_rad + sign * earlier_rad;
                        prop_assert!(depth_m(&reach, &cores, radii_m, angle_rad) > -1e-9);
                    }
                }
            }
        }
    }

    #[test]
    fn two_arcs_that_touch_are_left_together() {
        // The second begins at the direction 1 rad up to rounding, where the first ends.
        for gap_rad in [0.0, 1e-16, 2e-16, 1e-15] {
            let second = AngleInterval { from_rad: 1.0 + gap_rad, width_rad: 1.0 };
            let arcs = [AngleInterval { from_rad: 0.3, width_rad: 0.7 }, second];
            assert!(min_turn_to_free_rad(&arcs, 0.5, TurnDirection::Left).unwrap() > 1.4);
            assert!(min_turn_to_free_rad(&arcs, 1.5, TurnDirection::Right).unwrap() > 1.1);
        }
    }

    #[test]
    fn two_arcs_that_overlap_are_left_together() {
        let arcs = [
            AngleInterval { from_rad: 6.0, width_rad: 1.0 },
            AngleInterval { from_rad: 0.5, width_rad: 1.0 },
        ];
        assert!(
            (min_turn_to_free_rad(&arcs, 0.0, TurnDirection::Left).unwrap() - 1.5).abs() < 1e-12
        );
        assert!(
            (min_turn_to_free_rad(&arcs, 0.0, TurnDirection::Right).unwrap() - (TAU - 6.0)).abs()
                < 1e-12
        );
        assert_eq!(min_turn_to_free_rad(&arcs, 3.0, TurnDirection::Left), Some(0.0));
    }

    #[test]
    fn a_full_circle_has_no_way_out() {
        let arcs = [
            AngleInterval { from_rad: 1.0, width_rad: 4.0 },
            AngleInterval { from_rad: 4.5, width_rad: 3.0 },
        ];
        assert_eq!(min_turn_to_free_rad(&arcs, 2.0, TurnDirection::Left), None);
        assert_eq!(min_turn_to_free_rad(&arcs, 2.0, TurnDirection::Right), None);
    }
}
