//! Positions and orientations of bodies.

use serde::{Deserialize, Serialize};

/// A position in space, in meters; planar worlds have height 0.
pub type Vec3 = [f64; 3];

/// A rigid transform of the plane, such as from the image of a map to the world: a rotation and a translation.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Isometry2 {
    /// Its origin in the world, in meters.
    pub origin_m: [f64; 2],
    /// The direction of its x axis in the world, in radians, counterclockwise.
    pub yaw_rad: f64,
}

impl Isometry2 {
    /// Returns the point of the world of a point of the plane, in meters.
    pub fn transform_point(&self, point: [f64; 2]) -> [f64; 2] {
        self.cached().transform_point(point)
    }

    /// Returns the transform with its sine and cosine, for many points.
    pub fn cached(&self) -> CachedIsometry2 {
        CachedIsometry2 {
            origin_m: self.origin_m,
            sine: crate::math::sin(self.yaw_rad),
            cosine: crate::math::cos(self.yaw_rad),
        }
    }

    /// Returns the point of the plane of a point of the world, in meters.
    pub fn inverse_transform_point(&self, at_m: [f64; 2]) -> [f64; 2] {
        let s = crate::math::sin(self.yaw_rad);
        let c = crate::math::cos(self.yaw_rad);
        let [x, y] = [at_m[0] - self.origin_m[0], at_m[1] - self.origin_m[1]];
        [c * x + s * y, c * y - s * x]
    }
}

/// An [`Isometry2`] with the sine and cosine of its angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CachedIsometry2 {
    origin_m: [f64; 2],
    sine: f64,
    cosine: f64,
}

impl CachedIsometry2 {
    /// Returns the point of the world of a point of the plane, in meters.
    #[inline]
    pub fn transform_point(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let Self { sine: s, cosine: c, .. } = self;
        [self.origin_m[0] + (c * x - s * y), self.origin_m[1] + (s * x + c * y)]
    }
}

/// Position and orientation of a body's center.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// The position, in meters.
    pub at_m: Vec3,
    /// The orientation: a unit quaternion x, y, z, w.
    pub turn: [f64; 4],
}

impl Pose {
    /// Creates a pose at a position, facing along x.
    pub fn from_position(at_m: Vec3) -> Self {
        Self { at_m, turn: [0.0, 0.0, 0.0, 1.0] }
    }

    /// Creates a pose at a position, rotated about the vertical axis.
    pub fn from_heading(at_m: Vec3, heading_rad: f64) -> Self {
        let half = 0.5 * heading_rad;
        Self { at_m, turn: [0.0, 0.0, crate::math::sin(half), crate::math::cos(half)] }
    }

    /// Creates a pose at a position with these unit vectors as its axes; they must be perpendicular to
    /// each other and right-handed.
    pub fn from_axes(at_m: Vec3, axes: [Vec3; 3]) -> Self {
        // Entry [row][column] of the rotation matrix is axes[column][row].
        let m = |row: usize, column: usize| axes[column][row];
        let trace = m(0, 0) + m(1, 1) + m(2, 2);
        // Shepperd's method: the largest of the four components is computed first, because the others divide by it.
        let largest = (0..3).max_by(|&a, &b| m(a, a).total_cmp(&m(b, b))).unwrap_or(0);
        let turn = if trace > m(largest, largest) {
            let w4 = 2.0 * (1.0 + trace).max(0.0).sqrt();
            [
                (m(2, 1) - m(1, 2)) / w4,
                (m(0, 2) - m(2, 0)) / w4,
                (m(1, 0) - m(0, 1)) / w4,
                0.25 * w4,
            ]
        } else {
            let i = largest;
            let j = (largest + 1) % 3;
            let k = (largest + 2) % 3;
            let r4 = 2.0 * (1.0 + m(i, i) - m(j, j) - m(k, k)).max(0.0).sqrt();
            let mut turn = [0.0; 4];
            turn[i] = 0.25 * r4;
            turn[j] = (m(i, j) + m(j, i)) / r4;
            turn[k] = (m(i, k) + m(k, i)) / r4;
            turn[3] = (m(k, j) - m(j, k)) / r4;
            turn
        };
        Self { at_m, turn }
    }

    /// Rotates a vector from the frame of the body into that of the world.
    pub fn rotate(&self, [x, y, z]: Vec3) -> Vec3 {
        let [qx, qy, qz, w] = self.turn;
        // v + 2 q x (q x v + w v), which takes fewer operations than q v q*, with t = 2 q x v.
        let t = [2.0 * (qy * z - qz * y), 2.0 * (qz * x - qx * z), 2.0 * (qx * y - qy * x)];
        [
            x + w * t[0] + qy * t[2] - qz * t[1],
            y + w * t[1] + qz * t[0] - qx * t[2],
            z + w * t[2] + qx * t[1] - qy * t[0],
        ]
    }

    /// Transforms a point from the frame of the body into that of the world.
    pub fn transform_point(&self, point: Vec3) -> Vec3 {
        let rotated = self.rotate(point);
        std::array::from_fn(|i| self.at_m[i] + rotated[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::cross;
    use crate::math::{cos, sin};
    use proptest::prelude::*;

    fn near(a: Vec3, b: Vec3) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    proptest! {
        #[test]
        fn a_pose_of_axes_turns_the_axes_of_the_world_into_them(
            yaw in -3.2..3.2f64, pitch in -1.6..1.6f64, roll in -3.2..3.2f64,
        ) {
            let x = [cos(yaw) * cos(pitch), sin(yaw) * cos(pitch), sin(pitch)];
            let level = [-sin(yaw), cos(yaw), 0.0];
            let up = cross(x, level);
            let y: Vec3 = std::array::from_fn(|i| cos(roll) * level[i] + sin(roll) * up[i]);
            let z = cross(x, y);
            let pose = Pose::from_axes([1.0, 2.0, 3.0], [x, y, z]);
            let length: f64 = pose.turn.iter().map(|q| q * q).sum();
            prop_assert!((length - 1.0).abs() < 1e-9);
            for (axis, to) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().zip([x, y, z]) {
                prop_assert!(near(pose.rotate(axis), to), "{axis:?}: {:?} {to:?}", pose.rotate(axis));
            }
        }
    }

    #[test]
    fn a_plane_is_turned_about_its_origin_and_not_at_all_without_a_yaw() {
        let quarter = Isometry2 { origin_m: [10.0, 20.0], yaw_rad: 0.5 * std::f64::consts::PI };
        let [x, y] = quarter.transform_point([2.0, 1.0]);
        assert!((x - 9.0).abs() < 1e-12 && (y - 22.0).abs() < 1e-12, "{x} {y}");
        let [x, y] = quarter.inverse_transform_point([9.0, 22.0]);
        assert!((x - 2.0).abs() < 1e-12 && (y - 1.0).abs() < 1e-12, "{x} {y}");
        let still = Isometry2 { origin_m: [0.1, 0.2], yaw_rad: 0.0 };
        assert_eq!(still.transform_point([0.7, -0.3]), [0.1 + 0.7, 0.2 - 0.3]);
    }

    #[test]
    fn a_heading_turns_to_the_left() {
        let pose = Pose::from_heading([1.0, 1.0, 0.0], 0.5 * std::f64::consts::PI);
        assert!(near(pose.transform_point([2.0, 0.0, 0.0]), [1.0, 3.0, 0.0]));
    }
}
