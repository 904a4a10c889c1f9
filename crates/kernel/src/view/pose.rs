//! Positions and orientations of bodies.

use serde::{Deserialize, Serialize};

/// A place in space, in meters; worlds of the plane have height 0.
pub type Place = [f64; 3];

/// Position and orientation of a body's center.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// The position, in meters.
    pub at_m: Place,
    /// The orientation: a unit quaternion x, y, z, w.
    pub turn: [f64; 4],
}

impl Pose {
    /// Creates a pose at a place, facing along x.
    pub fn at(at_m: Place) -> Self {
        Self { at_m, turn: [0.0, 0.0, 0.0, 1.0] }
    }

    /// Creates a pose at a place, turned about the vertical axis.
    pub fn heading(at_m: Place, heading_rad: f64) -> Self {
        let half = 0.5 * heading_rad;
        Self { at_m, turn: [0.0, 0.0, crate::math::sin(half), crate::math::cos(half)] }
    }

    /// Creates a pose at a place with these unit vectors as its axes; they must be perpendicular to
    /// each other and right-handed.
    pub fn axes(at_m: Place, axes: [Place; 3]) -> Self {
        // Entry [row][column] of the rotation is axes[column][row].
        let m = |row: usize, column: usize| axes[column][row];
        let trace = m(0, 0) + m(1, 1) + m(2, 2);
        // The largest of the four components is computed first, because the others divide by it.
        let largest = (0..3).max_by(|&a, &b| m(a, a).total_cmp(&m(b, b))).unwrap_or(0);
        let turn = if trace > m(largest, largest) {
            let w4 = 2.0 * (1.0 + trace).max(0.0).sqrt();
            let part = |i: usize, j: usize| (m(i, j) - m(j, i)) / w4;
            [part(2, 1), part(0, 2), part(1, 0), 0.25 * w4]
        } else {
            let (i, j, k) = (largest, (largest + 1) % 3, (largest + 2) % 3);
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
    pub fn turned(&self, [x, y, z]: Place) -> Place {
        let [qx, qy, qz, w] = self.turn;
        // v + 2 q x (q x v + w v)
        let t = [2.0 * (qy * z - qz * y), 2.0 * (qz * x - qx * z), 2.0 * (qx * y - qy * x)];
        [
            x + w * t[0] + qy * t[2] - qz * t[1],
            y + w * t[1] + qz * t[0] - qx * t[2],
            z + w * t[2] + qx * t[1] - qy * t[0],
        ]
    }

    /// Transforms a point from the frame of the body into that of the world.
    pub fn place(&self, of_body: Place) -> Place {
        let turned = self.turned(of_body);
        std::array::from_fn(|i| self.at_m[i] + turned[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::cross;
    use crate::math::{cos, sin};
    use proptest::prelude::*;

    fn near(a: Place, b: Place) -> bool {
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
            let y: Place = std::array::from_fn(|i| cos(roll) * level[i] + sin(roll) * up[i]);
            let z = cross(x, y);
            let pose = Pose::axes([1.0, 2.0, 3.0], [x, y, z]);
            let length: f64 = pose.turn.iter().map(|q| q * q).sum();
            prop_assert!((length - 1.0).abs() < 1e-9);
            for (axis, to) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().zip([x, y, z]) {
                prop_assert!(near(pose.turned(axis), to), "{axis:?}: {:?} {to:?}", pose.turned(axis));
            }
        }
    }

    #[test]
    fn a_heading_turns_to_the_left() {
        let pose = Pose::heading([1.0, 1.0, 0.0], 0.5 * std::f64::consts::PI);
        assert!(near(pose.place([2.0, 0.0, 0.0]), [1.0, 3.0, 0.0]));
    }
}
