//! Segments, boxes and their distances, in two and three dimensions with the same code.
//!
//! The distance between segments is the least of the four distances from an end to the other
//! segment and, if both feet are inside, the distance of the lines. The usual clamped formula is
//! off by up to 4e-8 for nearly parallel segments, too much for a promise of 1e-9 m.

pub use sidestep_kernel::geometry::{
    Point, add, add_scaled, angle_between_rad, convert_dimensions, cross, cross_2d, distance, dot,
    is_finite, lerp, move_toward, nearest_on_segment, norm, norm_squared, normalized,
    perpendicular, perpendicular_component, scaled, sub, unit_x,
};

/// Nearest points of two bodies, and their distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestPoints<const D: usize> {
    /// Distance between the nearest points, meters.
    pub distance_m: f64,
    /// The nearest point of the segment or point in question.
    pub on_body: Point<D>,
    /// The nearest point of the core, or of the second segment.
    pub on_core: Point<D>,
}

impl<const D: usize> NearestPoints<D> {
    /// Returns the distance between two points.
    pub fn from_points(on_body: Point<D>, on_core: Point<D>) -> Self {
        Self { distance_m: distance(on_body, on_core), on_body, on_core }
    }

    fn nearer(self, other: Self) -> Self {
        if other.distance_m < self.distance_m { other } else { self }
    }
}

/// Returns the nearest points of the segments `p q` (the body) and `a b` (the core).
pub fn between_segments<const D: usize>(
    [p, q]: [Point<D>; 2],
    [a, b]: [Point<D>; 2],
) -> NearestPoints<D> {
    let ends = NearestPoints::from_points(nearest_on_segment(a, p, q), a)
        .nearer(NearestPoints::from_points(nearest_on_segment(b, p, q), b))
        .nearer(NearestPoints::from_points(p, nearest_on_segment(p, a, b)))
        .nearer(NearestPoints::from_points(q, nearest_on_segment(q, a, b)));
    between_interiors([p, q], [a, b]).map_or(ends, |inside| ends.nearer(inside))
}

/// Returns the distance of two segments, meters: the bits of that of [`between_segments`], with one root in place of
/// four.
#[inline]
pub fn distance_of_segments_m<const D: usize>([p, q]: [Point<D>; 2], [a, b]: [Point<D>; 2]) -> f64 {
    let to_ends = [
        sub(nearest_on_segment(a, p, q), a),
        sub(nearest_on_segment(b, p, q), b),
        sub(p, nearest_on_segment(p, a, b)),
        sub(q, nearest_on_segment(q, a, b)),
    ];
    // The root of the least square is the least root: roots are rounded correctly, so they keep the order.
    let least2 = to_ends.map(norm_squared).into_iter().fold(f64::INFINITY, f64::min);
    let ends_m = least2.sqrt();
    between_interiors([p, q], [a, b]).map_or(ends_m, |inside| inside.distance_m.min(ends_m))
}

/// Distance beyond the one asked for that a bound on a distance must show, meters: far more than rounding, so that it
/// never says what the distance itself would not.
const BOUND_MARGIN_M: f64 = 1e-9;

/// Returns whether two segments are surely farther apart than `reach_m`: along the line through their middles. That
/// takes no division, no branch and one root, and for rods of a chain it is nearly as good as the distance. `false` says
/// nothing.
#[inline]
pub fn are_segments_surely_apart<const D: usize>(
    [p, q]: [Point<D>; 2],
    [a, b]: [Point<D>; 2],
    reach_m: f64,
) -> bool {
    // Each is twice as long as it would be: the middles are half of these sums.
    let between_middles = sub(add(p, q), add(a, b));
    let extents = dot(sub(q, p), between_middles).abs() + dot(sub(b, a), between_middles).abs();
    let length = norm(between_middles);
    length * length - extents > 2.0 * (reach_m + BOUND_MARGIN_M) * length
}

/// Returns a distance that two segments surely have at least, meters, by the same bound; it may be below zero.
#[inline]
pub fn bound_of_segments_m<const D: usize>([p, q]: [Point<D>; 2], [a, b]: [Point<D>; 2]) -> f64 {
    let between_middles = sub(add(p, q), add(a, b));
    let extents = dot(sub(q, p), between_middles).abs() + dot(sub(b, a), between_middles).abs();
    let length = norm(between_middles);
    if length > 0.0 { 0.5 * (length - extents / length) - BOUND_MARGIN_M } else { -BOUND_MARGIN_M }
}

/// Squared sine of the angle below which segments count as parallel: then the lines are nearer than
/// the ends by far less than any tolerance, and the nearest place is lost in rounding.
const PARALLEL2: f64 = 1e-14;

/// Returns the nearest points of the lines, if both lie inside the segments.
fn between_interiors<const D: usize>(
    [p, q]: [Point<D>; 2],
    [a, b]: [Point<D>; 2],
) -> Option<NearestPoints<D>> {
    let d1 = sub(q, p);
    let d2 = sub(b, a);
    let r = sub(p, a);
    let aa = dot(d1, d1);
    let ee = dot(d2, d2);
    let bb = dot(d1, d2);
    let c = dot(d1, r);
    let f = dot(d2, r);
    let s = (bb * f - c * ee) / (aa * ee - bb * bb);
    // In the plane two segments whose insides are nearest cross, so their distance is exactly zero.
    if D == 2 {
        return segments_cross([p, q], [a, b]).then(|| {
            // Lines that are parallel up to rounding cross at no place in particular.
            let part = if s.is_finite() { s.clamp(0.0, 1.0) } else { 0.5 };
            let at = add_scaled(p, d1, part);
            NearestPoints { distance_m: 0.0, on_body: at, on_core: at }
        });
    }
    let n = cross(d1, d2);
    let t = (bb * s + f) / ee;
    let is_inside = s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0;
    (is_inside && norm_squared(n) > PARALLEL2 * aa * ee).then(|| {
        let on_body = add_scaled(p, d1, s);
        let on_core = add_scaled(a, d2, t);
        // The points are slightly off along the lines; their distance across the lines is not.
        let r = sub(on_body, on_core);
        let distance_m = dot([r[0], r[1], r[2]], n).abs() / norm(n);
        NearestPoints { distance_m, on_body, on_core }
    })
}

/// Returns whether two plane segments cross: the ends of each are strictly on both sides of the other.
#[inline]
pub fn segments_cross<const D: usize>([p, q]: [Point<D>; 2], [a, b]: [Point<D>; 2]) -> bool {
    // Of segments on one line the products below are rounding, of any sign, however far apart they are.
    let is_apart = |axis: usize| {
        p[axis].max(q[axis]) < a[axis].min(b[axis]) || a[axis].max(b[axis]) < p[axis].min(q[axis])
    };
    if is_apart(0) || is_apart(1) {
        return false;
    }
    let d1 = sub(q, p);
    let d2 = sub(b, a);
    cross_2d(d1, sub(a, p)) * cross_2d(d1, sub(b, p)) < 0.0
        && cross_2d(d2, sub(p, a)) * cross_2d(d2, sub(q, a)) < 0.0
}

/// A box in any orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cuboid<const D: usize> {
    /// Its middle.
    pub center: Point<D>,
    /// Directions of its edges: unit vectors, each perpendicular to the others.
    pub axes: [Point<D>; D],
    /// Half its extent along each axis, meters.
    pub half_m: Point<D>,
}

impl<const D: usize> Cuboid<D> {
    fn to_local(self, p: Point<D>) -> Point<D> {
        let r = sub(p, self.center);
        std::array::from_fn(|i| dot(r, self.axes[i]))
    }

    fn to_world(self, local: Point<D>) -> Point<D> {
        (0..D).fold(self.center, |at, i| add_scaled(at, self.axes[i], local[i]))
    }

    /// Returns the nearest points of the segment `p q` and the box (which is solid).
    ///
    /// The squared distance along the segment is convex and made of parabolas; its slope rises, so
    /// the minimum lies where the slope changes sign between two of the at most `2 D` joints.
    pub fn nearest_to_segment(&self, [p, q]: [Point<D>; 2]) -> NearestPoints<D> {
        let from = self.to_local(p);
        let to = self.to_local(q);
        let d = sub(to, from);
        let fraction = self.nearest_fraction(from, d);
        let local = add_scaled(from, d, fraction);
        let clamped: Point<D> =
            std::array::from_fn(|i| local[i].clamp(-self.half_m[i], self.half_m[i]));
        NearestPoints {
            distance_m: distance(local, clamped),
            on_body: lerp(p, q, fraction),
            on_core: self.to_world(clamped),
        }
    }

    /// Returns half the slope of the squared distance at a fraction of the segment.
    fn slope(&self, from: Point<D>, d: Point<D>, fraction: f64) -> f64 {
        let terms = (0..D).map(|i| {
            let x = from[i] + d[i] * fraction;
            let outside = x - x.clamp(-self.half_m[i], self.half_m[i]);
            outside * d[i]
        });
        terms.sum()
    }

    /// Returns the fraction of the segment at which the squared distance is least.
    fn nearest_fraction(&self, from: Point<D>, d: Point<D>) -> f64 {
        let mut low = 0.0;
        let mut high = 1.0;
        if self.slope(from, d, low) >= 0.0 {
            return low;
        }
        if self.slope(from, d, high) <= 0.0 {
            return high;
        }
        for i in (0..D).filter(|&i| d[i] != 0.0) {
            for side in [-self.half_m[i], self.half_m[i]] {
                let joint = (side - from[i]) / d[i];
                if joint > low && joint < high {
                    if self.slope(from, d, joint) < 0.0 {
                        low = joint;
                    } else {
                        high = joint;
                    }
                }
            }
        }
        let a = self.slope(from, d, low);
        let b = self.slope(from, d, high);
        if b > a { low + (high - low) * (-a / (b - a)) } else { low }
    }

    /// Returns the corners' greatest distance from the middle along each world axis.
    fn extent(&self) -> Point<D> {
        std::array::from_fn(|w| (0..D).map(|i| (self.axes[i][w] * self.half_m[i]).abs()).sum())
    }

    /// Returns the outline of a plane box, counterclockwise.
    pub fn edges_2d(&self) -> [[Point<D>; 2]; 4] {
        let c = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[sx, sy]| {
            let mut local = [0.0; D];
            local[0] = sx * self.half_m[0];
            local[1] = sy * self.half_m[1];
            self.to_world(local)
        });
        [[c[0], c[1]], [c[1], c[2]], [c[2], c[3]], [c[3], c[0]]]
    }
}

/// The inner part of an obstacle or of a chain's own part; with a radius it becomes the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ConvexCore<const D: usize> {
    /// A disc or a sphere.
    Point(Point<D>),
    /// A wall or a capsule.
    Segment([Point<D>; 2]),
    /// A box.
    Cuboid(Cuboid<D>),
}

impl<const D: usize> ConvexCore<D> {
    /// Returns the nearest points of a segment and the core; their distance is 0 where they
    /// overlap.
    pub fn nearest_to_segment(&self, body: [Point<D>; 2]) -> NearestPoints<D> {
        match self {
            Self::Point(c) => {
                NearestPoints::from_points(nearest_on_segment(*c, body[0], body[1]), *c)
            }
            Self::Segment(core) => between_segments(body, *core),
            Self::Cuboid(cuboid) => cuboid.nearest_to_segment(body),
        }
    }

    /// Returns the nearest point of the core: `p` itself inside a box.
    pub fn nearest_to_point(&self, p: Point<D>) -> NearestPoints<D> {
        match self {
            Self::Point(c) => NearestPoints::from_points(p, *c),
            Self::Segment([a, b]) => NearestPoints::from_points(p, nearest_on_segment(p, *a, *b)),
            Self::Cuboid(cuboid) => cuboid.nearest_to_segment([p, p]),
        }
    }

    /// Returns whether no point of the core is nearer than `reach_m` to a segment. It agrees with the
    /// distance, but is faster in the usual case.
    #[inline]
    pub fn is_clear_of_segment(&self, [p, q]: [Point<D>; 2], reach_m: f64) -> bool {
        if reach_m <= 0.0 {
            return true;
        }
        match self {
            Self::Point(c) => is_far_from_segment(*c, [p, q], reach_m),
            Self::Segment([a, b]) if D == 2 => {
                is_on_one_side(*a, *b, p, q, reach_m)
                    || is_far_from_segment(*a, [p, q], reach_m)
                        && is_far_from_segment(*b, [p, q], reach_m)
                        && is_far_from_segment(p, [*a, *b], reach_m)
                        && is_far_from_segment(q, [*a, *b], reach_m)
                        && !segments_cross([p, q], [*a, *b])
            }
            Self::Segment(core) => {
                are_segments_surely_apart([p, q], *core, reach_m)
                    || distance_of_segments_m([p, q], *core) >= reach_m
            }
            Self::Cuboid(_) => self.nearest_to_segment([p, q]).distance_m >= reach_m,
        }
    }

    /// Returns whether no point of the core is nearer than `reach_m` to a point.
    #[inline]
    pub fn is_clear_of_point(&self, p: Point<D>, reach_m: f64) -> bool {
        if reach_m <= 0.0 {
            return true;
        }
        match self {
            Self::Point(c) => {
                let r = sub(p, *c);
                dot(r, r) >= reach_m * reach_m
            }
            Self::Segment(ends) => is_far_from_segment(p, *ends, reach_m),
            Self::Cuboid(_) => self.nearest_to_point(p).distance_m >= reach_m,
        }
    }

    /// Returns the box around the core.
    pub fn bounds(&self) -> Aabb<D> {
        match self {
            Self::Point(c) => Aabb::from_points(&[*c]),
            Self::Segment(ends) => Aabb::from_points(ends),
            Self::Cuboid(b) => {
                Aabb::from_points(&[sub(b.center, b.extent()), add(b.center, b.extent())])
            }
        }
    }

    /// Returns the core at another place, in the same orientation.
    #[must_use]
    pub fn shifted(self, by: Point<D>) -> Self {
        match self {
            Self::Point(c) => Self::Point(add(c, by)),
            Self::Segment(ends) => Self::Segment(ends.map(|p| add(p, by))),
            Self::Cuboid(b) => Self::Cuboid(Cuboid { center: add(b.center, by), ..b }),
        }
    }

    /// Returns whether all its numbers are finite.
    pub fn is_finite(&self) -> bool {
        match self {
            Self::Point(c) => is_finite(c),
            Self::Segment(ends) => ends.iter().all(is_finite),
            Self::Cuboid(b) => {
                is_finite(&b.center) && is_finite(&b.half_m) && b.axes.iter().all(is_finite)
            }
        }
    }
}

/// Returns whether a point is at least `reach_m` from a segment, without division or root.
#[inline]
fn is_far_from_segment<const D: usize>(c: Point<D>, [p, q]: [Point<D>; 2], reach_m: f64) -> bool {
    let d = sub(q, p);
    let r = sub(c, p);
    let along = dot(r, d);
    let length2 = dot(d, d);
    let reach2 = reach_m * reach_m;
    if along <= 0.0 {
        return dot(r, r) >= reach2;
    }
    if along >= length2 {
        let r = sub(c, q);
        return dot(r, r) >= reach2;
    }
    let across2 = if D == 2 { cross_2d(d, r) * cross_2d(d, r) } else { norm_squared(cross(d, r)) };
    across2 >= reach2 * length2
}

/// Returns whether a plane segment `a b` lies on one side of the line `p q`, farther away than `reach_m`.
#[inline]
fn is_on_one_side<const D: usize>(
    a: Point<D>,
    b: Point<D>,
    p: Point<D>,
    q: Point<D>,
    reach_m: f64,
) -> bool {
    let d = sub(q, p);
    let left_a = cross_2d(d, sub(a, p));
    let left_b = cross_2d(d, sub(b, p));
    let far = reach_m * reach_m * dot(d, d);
    left_a * left_b > 0.0 && left_a * left_a > far && left_b * left_b > far
}

/// A box along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb<const D: usize> {
    /// Its lower corner.
    pub lo: Point<D>,
    /// Its upper corner.
    pub hi: Point<D>,
}

impl<const D: usize> Aabb<D> {
    /// Returns the least box around points.
    #[inline]
    pub fn from_points(points: &[Point<D>]) -> Self {
        let mut lo = points[0];
        let mut hi = points[0];
        for p in &points[1..] {
            for i in 0..D {
                lo[i] = lo[i].min(p[i]);
                hi[i] = hi[i].max(p[i]);
            }
        }
        Self { lo, hi }
    }

    /// Returns the box around nothing: joined with another it gives that one.
    pub fn empty() -> Self {
        Self { lo: [f64::INFINITY; D], hi: [f64::NEG_INFINITY; D] }
    }

    /// Returns the box, larger by `by_m` on every side.
    #[inline]
    #[must_use]
    pub fn grown(self, by_m: f64) -> Self {
        Self { lo: self.lo.map(|x| x - by_m), hi: self.hi.map(|x| x + by_m) }
    }

    /// Returns the least box around both.
    #[inline]
    #[must_use]
    pub fn joined(self, other: &Self) -> Self {
        Self {
            lo: std::array::from_fn(|i| self.lo[i].min(other.lo[i])),
            hi: std::array::from_fn(|i| self.hi[i].max(other.hi[i])),
        }
    }

    /// Returns whether the other box lies completely in this one.
    #[inline]
    pub fn contains(&self, other: &Self) -> bool {
        let mut contains = true;
        for i in 0..D {
            contains &= self.lo[i] <= other.lo[i] && self.hi[i] >= other.hi[i];
        }
        contains
    }

    /// Returns the distance between the boxes, meters; 0 where they touch.
    pub fn distance_m(&self, other: &Self) -> f64 {
        let apart: Point<D> = std::array::from_fn(|i| {
            (self.lo[i] - other.hi[i]).max(other.lo[i] - self.hi[i]).max(0.0)
        });
        norm(apart)
    }

    /// Returns whether the boxes touch.
    #[inline]
    pub fn intersects(&self, other: &Self) -> bool {
        let mut meets = true;
        for i in 0..D {
            meets &= self.lo[i] <= other.hi[i] && self.hi[i] >= other.lo[i];
        }
        meets
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sidestep_kernel::math;

    fn sampled_distance<const D: usize>(body: [Point<D>; 2], core: &ConvexCore<D>) -> f64 {
        let at = |k: i32| lerp(body[0], body[1], f64::from(k) / 2000.0);
        (0..=2000).map(|k| core.nearest_to_point(at(k)).distance_m).fold(f64::INFINITY, f64::min)
    }

    fn point<const D: usize>() -> impl Strategy<Value = Point<D>> {
        proptest::array::uniform(-3.0..3.0f64)
    }

    #[test]
    fn segments_of_one_line_that_are_apart_do_not_cross() {
        // Two rods of a chain that is straight up to rounding.
        let one = [
            [-0.000_421_441_686_418_636_17, 0.599_999_851_989_069_2],
            [-0.000_632_162_529_627_954_3, 0.899_999_777_983_603_8],
        ];
        let other = [
            [-0.002_107_208_432_093_181_3, 2.999_999_259_945_346],
            [-0.002_317_929_275_302_499_4, 3.299_999_185_939_880_5],
        ];
        assert!(!segments_cross(one, other));
        assert!((between_segments(one, other).distance_m - 2.1).abs() < 1e-5);
        assert!(segments_cross([[0.0, 0.0], [1.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]]));
    }

    proptest! {
        #[test]
        fn distances_of_segments_are_those_of_their_points(
            p in point::<3>(), q in point::<3>(), a in point::<3>(), b in point::<3>(),
        ) {
            let nearest = between_segments([p, q], [a, b]);
            let sampled = sampled_distance([p, q], &ConvexCore::Segment([a, b]));
            prop_assert!(nearest.distance_m <= sampled + 1e-12);
            prop_assert!(nearest.distance_m >= sampled - 5e-3);
            let apart_m = distance(nearest.on_body, nearest.on_core);
            prop_assert!((apart_m - nearest.distance_m).abs() < 1e-7);
            prop_assert_eq!(distance_of_segments_m([p, q], [a, b]), nearest.distance_m);
            let back = between_segments([a, b], [p, q]);
            prop_assert!((back.distance_m - nearest.distance_m).abs() < 1e-12);
        }

        #[test]
        fn segments_that_are_surely_apart_are_apart(
            p in point::<3>(), d in point::<3>(), a in point::<3>(), e in point::<3>(),
            reach_m in 0.0..2.0f64, length in -3.0..0.0f64, is_flat in any::<bool>(),
        ) {
            fn check<const D: usize>(
                [p, d, a, e]: [Point<D>; 4], length: f64, reach_m: f64,
            ) -> Result<(), TestCaseError> {
                let length = math::exp(length * std::f64::consts::LN_10);
                let one = [p, add_scaled(p, d, length)];
                let other = [a, add_scaled(a, e, length)];
                let apart_m = between_segments(one, other).distance_m;
                if are_segments_surely_apart(one, other, reach_m) {
                    prop_assert!(apart_m > reach_m);
                }
                prop_assert!(apart_m > bound_of_segments_m(one, other));
                // Short rods far away are the usual case, in which the bound must suffice.
                if apart_m > reach_m + 3.0 * length * (norm(d) + norm(e)) {
                    prop_assert!(are_segments_surely_apart(one, other, reach_m));
                }
                Ok(())
            }
            let all = [p, d, a, e];
            if is_flat {
                check::<2>(all.map(convert_dimensions), length, reach_m)?;
            } else {
                check(all, length, reach_m)?;
            }
        }

        #[test]
        fn nearly_parallel_segments_keep_their_distance(
            p in point::<3>(), u in point::<3>(), tilt in -1e-7..1e-7f64, gap_m in 0.01..1.0f64,
        ) {
            let Some(u) = normalized(u) else { return Ok(()) };
            let n = perpendicular(u);
            let q = add_scaled(p, u, 2.0);
            let core = [add_scaled(p, n, gap_m), add_scaled(add_scaled(p, n, gap_m + tilt), u, 2.0)];
            let least = gap_m + tilt.min(0.0);
            prop_assert!((between_segments([p, q], core).distance_m - least).abs() < 1e-12);
        }

        #[test]
        fn segments_that_pass_each_other_are_apart_by_their_gap(
            at in point::<3>(), u in point::<3>(), magnitude in -14.0..0.0f64,
            gap_m in 0.001..1.0f64, parts in prop::array::uniform2(0.1..0.9f64),
        ) {
            let Some(u) = normalized(u) else { return Ok(()) };
            let n = perpendicular(u);
            let angle_rad = math::exp(magnitude * std::f64::consts::LN_10);
            let across = cross(n, u);
            let v = add(scaled(u, math::cos(angle_rad)), scaled(across, math::sin(angle_rad)));
            let through = |at: Point<3>, u: Point<3>, part: f64| {
                [add_scaled(at, u, -2.0 * part), add_scaled(at, u, 2.0 * (1.0 - part))]
            };
            let core = through(add_scaled(at, n, gap_m), v, parts[1]);
            let nearest = between_segments(through(at, u, parts[0]), core);
            prop_assert!((nearest.distance_m - gap_m).abs() < 1e-11, "{}", nearest.distance_m);
        }

        #[test]
        fn parallel_segments_are_apart_by_their_ends(
            p in point::<3>(), d in point::<3>(), a in point::<3>(), magnitude in -17.0..-12.0f64,
            noise in point::<3>(),
        ) {
            let tilt = math::exp(magnitude * std::f64::consts::LN_10);
            let (body, core) = ([p, add(p, d)], [a, add_scaled(add(a, d), noise, tilt)]);
            let ends = [body[0], body[1]].map(|x| distance(x, nearest_on_segment(x, core[0], core[1])));
            let others = [core[0], core[1]].map(|x| distance(x, nearest_on_segment(x, p, body[1])));
            let least_m = ends.into_iter().chain(others).fold(f64::INFINITY, f64::min);
            prop_assert!((between_segments(body, core).distance_m - least_m).abs() < 1e-10);
        }

        #[test]
        fn plane_distances_are_those_of_their_points(
            p in point::<2>(), q in point::<2>(), a in point::<2>(), b in point::<2>(),
            reach_m in 0.0..2.0f64,
        ) {
            let core = ConvexCore::Segment([a, b]);
            let nearest = core.nearest_to_segment([p, q]);
            let sampled = sampled_distance([p, q], &core);
            prop_assert!(nearest.distance_m <= sampled + 1e-12);
            prop_assert!(nearest.distance_m >= sampled - 5e-3);
            prop_assert_eq!(distance_of_segments_m([p, q], [a, b]), nearest.distance_m);
            let clear = core.is_clear_of_segment([p, q], reach_m);
            prop_assert!(clear == (nearest.distance_m >= reach_m));
        }

        #[test]
        fn clear_is_what_the_distance_says(
            p in point::<3>(), q in point::<3>(), a in point::<3>(), b in point::<3>(),
            reach_m in -0.1..3.0f64,
        ) {
            for core in [ConvexCore::Point(a), ConvexCore::Segment([a, b])] {
                let apart_m = core.nearest_to_segment([p, q]).distance_m;
                prop_assert_eq!(core.is_clear_of_segment([p, q], reach_m), apart_m >= reach_m);
                let apart_m = core.nearest_to_point(p).distance_m;
                prop_assert_eq!(core.is_clear_of_point(p, reach_m), apart_m >= reach_m);
            }
        }

        #[test]
        fn the_distance_to_a_box_is_the_least_along_the_segment(
            p in point::<3>(), q in point::<3>(), center in point::<3>(), u in point::<3>(),
            half_m in proptest::array::uniform3(0.1..1.5f64),
        ) {
            let Some(u) = normalized(u) else { return Ok(()) };
            let v = perpendicular(u);
            let cuboid = Cuboid { center, axes: [u, v, cross(u, v)], half_m };
            let nearest = cuboid.nearest_to_segment([p, q]);
            let sampled = sampled_distance([p, q], &ConvexCore::Cuboid(cuboid));
            prop_assert!(nearest.distance_m <= sampled + 1e-9);
            prop_assert!(nearest.distance_m >= sampled - 5e-3);
        }
    }

    #[test]
    fn points_at_one_place_are_never_surely_apart() {
        assert!(!are_segments_surely_apart([[1.0, 2.0]; 2], [[1.0, 2.0]; 2], 0.0));
        assert_eq!(distance_of_segments_m([[1.0, 2.0]; 2], [[1.0, 2.0]; 2]), 0.0);
    }

    #[test]
    fn segments_without_length_are_points() {
        let nearest = between_segments([[0.0, 0.0]; 2], [[3.0, 4.0]; 2]);
        assert_eq!(nearest.distance_m, 5.0);
    }

    #[test]
    fn segments_that_cross_have_no_distance() {
        let nearest = between_segments([[-1.0, 0.0], [1.0, 0.0]], [[0.0, -1.0], [0.0, 1.0]]);
        assert_eq!((nearest.distance_m, nearest.on_core), (0.0, [0.0, 0.0]));
    }
}
