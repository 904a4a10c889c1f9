//! Points and vectors in any number of dimensions.
//!
//! Every sum is taken in the order of the coordinates, so that a result has the same bits wherever
//! it is computed.

use crate::math;

/// A position or a vector in `D` dimensions, meters.
pub type Point<const D: usize> = [f64; D];

/// The point `a` moved by the vector `b`, or the sum of two vectors.
#[inline]
pub fn add<const D: usize>(a: Point<D>, b: Point<D>) -> Point<D> {
    std::array::from_fn(|i| a[i] + b[i])
}

/// The vector from `b` to `a`.
#[inline]
pub fn sub<const D: usize>(a: Point<D>, b: Point<D>) -> Point<D> {
    std::array::from_fn(|i| a[i] - b[i])
}

/// The vector `a`, `k` times as long; in the opposite direction where `k` is negative.
#[inline]
pub fn scaled<const D: usize>(a: Point<D>, k: f64) -> Point<D> {
    std::array::from_fn(|i| a[i] * k)
}

/// The point reached from `a` along `k` times the vector `u`.
#[inline]
pub fn add_scaled<const D: usize>(a: Point<D>, u: Point<D>, k: f64) -> Point<D> {
    std::array::from_fn(|i| a[i] + u[i] * k)
}

/// Linear interpolation: the point at a fraction of the segment from `a` to `b`.
#[inline]
pub fn lerp<const D: usize>(a: Point<D>, b: Point<D>, fraction: f64) -> Point<D> {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * fraction)
}

/// Inner product.
#[inline]
pub fn dot<const D: usize>(a: Point<D>, b: Point<D>) -> f64 {
    let mut sum = a[0] * b[0];
    for i in 1..D {
        sum += a[i] * b[i];
    }
    sum
}

/// Length of a vector.
#[inline]
pub fn norm<const D: usize>(a: Point<D>) -> f64 {
    dot(a, a).sqrt()
}

/// Square of the length of a vector.
#[inline]
pub fn norm_squared<const D: usize>(a: Point<D>) -> f64 {
    dot(a, a)
}

/// Distance between two points.
#[inline]
pub fn distance<const D: usize>(a: Point<D>, b: Point<D>) -> f64 {
    norm(sub(a, b))
}

/// Returns whether every coordinate is a finite number.
pub fn is_finite<const D: usize>(a: &Point<D>) -> bool {
    a.iter().all(|x| x.is_finite())
}

/// The vector of length 1 in the direction of `a`; `None` where `a` is zero.
#[inline]
pub fn normalized<const D: usize>(a: Point<D>) -> Option<Point<D>> {
    let length = norm(a);
    (length > 0.0).then(|| scaled(a, 1.0 / length))
}

/// The component of `a` perpendicular to the unit vector `axis`.
#[inline]
pub fn perpendicular_component<const D: usize>(a: Point<D>, axis: Point<D>) -> Point<D> {
    sub(a, scaled(axis, dot(a, axis)))
}

/// The point reached from `from` toward `to` after at most `step_m` meters.
pub fn move_toward<const D: usize>(from: Point<D>, to: Point<D>, step_m: f64) -> Point<D> {
    let distance_m = distance(from, to);
    if distance_m <= step_m { to } else { add_scaled(from, sub(to, from), step_m / distance_m) }
}

/// A point in another number of dimensions: further coordinates are left out, missing ones are 0.
#[inline]
pub fn convert_dimensions<const D: usize, const N: usize>(p: Point<D>) -> Point<N> {
    std::array::from_fn(|i| if i < D { p[i] } else { 0.0 })
}

/// The unit vector along the first coordinate.
pub fn unit_x<const D: usize>() -> Point<D> {
    std::array::from_fn(|i| if i == 0 { 1.0 } else { 0.0 })
}

/// A unit vector perpendicular to the unit vector `u`, always the same for the same `u`: in two
/// dimensions `u` turned to the left.
pub fn perpendicular<const D: usize>(u: Point<D>) -> Point<D> {
    if D == 2 {
        return std::array::from_fn(|i| if i == 0 { -u[1] } else { u[0] });
    }
    // The axis that is farthest from parallel to `u`, so that the rejection is not near zero.
    let axis = (0..D).min_by(|&i, &j| u[i].abs().total_cmp(&u[j].abs())).unwrap_or(0);
    let e: Point<D> = std::array::from_fn(|i| if i == axis { 1.0 } else { 0.0 });
    normalized(add_scaled(e, u, -u[axis])).unwrap_or(e)
}

/// Signed area of the parallelogram of two plane vectors: positive where `b` is left of `a`.
#[inline]
pub fn cross_2d<const D: usize>(a: Point<D>, b: Point<D>) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Angle between two vectors, in [0, pi]. By the arc tangent, because the arc cosine loses half of the digits near 0
/// and pi.
pub fn angle_between_rad<const D: usize>(a: Point<D>, b: Point<D>) -> f64 {
    let cosine = dot(a, b);
    let sine = if D == 2 { cross_2d(a, b).abs() } else { norm(cross(a, b)) };
    // Both are scaled by the product of the lengths, which cancels.
    math::atan2(sine, cosine)
}

/// Cross product of vectors in space; `D` is 3, and generic for code that knows that only at run time.
///
/// # Panics
/// In fewer than three dimensions.
#[inline]
pub fn cross<const D: usize>(a: Point<D>, b: Point<D>) -> Point<3> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The point of the segment from `a` to `b` nearest to `p`; `a` where the segment has no length.
#[inline]
pub fn nearest_on_segment<const D: usize>(p: Point<D>, a: Point<D>, b: Point<D>) -> Point<D> {
    let d = sub(b, a);
    let length_squared = dot(d, d);
    // The position of the projection on the line, times the squared length.
    let projection = dot(sub(p, a), d);
    if projection <= 0.0 || length_squared <= 0.0 {
        a
    } else if projection >= length_squared {
        b
    } else {
        add_scaled(a, d, projection / length_squared)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_exact_near_zero_and_a_half_turn() {
        assert!((angle_between_rad([1.0, 0.0, 0.0], [1.0, 1e-9, 0.0]) - 1e-9).abs() < 1e-20);
        assert_eq!(angle_between_rad([1.0, 0.0], [-2.0, 0.0]), std::f64::consts::PI);
    }

    #[test]
    fn a_step_never_goes_beyond_its_goal() {
        assert_eq!(move_toward([0.0, 0.0], [3.0, 4.0], 10.0), [3.0, 4.0]);
        assert_eq!(move_toward([0.0, 0.0], [3.0, 4.0], 2.5), [1.5, 2.0]);
        assert_eq!(move_toward([1.0], [1.0], 0.0), [1.0]);
    }

    #[test]
    fn points_get_as_many_coordinates_as_asked_for() {
        assert_eq!(convert_dimensions::<2, 3>([1.0, 2.0]), [1.0, 2.0, 0.0]);
        assert_eq!(convert_dimensions::<3, 2>([1.0, 2.0, 3.0]), [1.0, 2.0]);
    }

    #[test]
    fn axes_make_a_right_handed_frame() {
        assert_eq!(cross([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        assert_eq!(perpendicular_component([1.0, 2.0, 3.0], [0.0, 0.0, 1.0]), [1.0, 2.0, 0.0]);
    }
}
