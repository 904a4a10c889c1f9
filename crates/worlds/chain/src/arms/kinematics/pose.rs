//! Rotations and frames in three dimensions, in m and rad.

use sidestep_import::urdf::Origin;
use sidestep_kernel::geometry::{Point, add, cross, dot, norm, scaled, sub};
use sidestep_kernel::math::{cos, sin};

/// A point or a direction.
pub type Vector = Point<3>;

/// A frame in another: its point `p` is at `rotation * p + origin_m` in the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Rows of the rotation matrix.
    pub rotation: [Vector; 3],
    /// The frame's origin in m.
    pub origin_m: Vector,
}

impl Pose {
    /// The identity: the frame itself.
    pub const IDENTITY: Self =
        Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], origin_m: [0.0; 3] };

    /// Returns the frame that a URDF's `<origin>` describes.
    pub fn from_origin(origin: &Origin) -> Self {
        let [roll, pitch, yaw] = origin.rpy_rad;
        let about = |axis, angle_rad| Self::turn(axis, angle_rad).rotation;
        let [x, y, z] = Self::IDENTITY.rotation;
        let rotation = multiply(&multiply(&about(z, yaw), &about(y, pitch)), &about(x, roll));
        Self { rotation, origin_m: origin.xyz_m }
    }

    /// Returns a turn by `angle_rad` about the unit vector `axis` (Rodrigues' formula).
    pub(super) fn turn(axis: Vector, angle_rad: f64) -> Self {
        let (s, c) = (sin(angle_rad), cos(angle_rad));
        let [x, y, z] = axis;
        let v = 1.0 - c;
        let rotation = [
            [c + x * x * v, x * y * v - z * s, x * z * v + y * s],
            [y * x * v + z * s, c + y * y * v, y * z * v - x * s],
            [z * x * v - y * s, z * y * v + x * s, c + z * z * v],
        ];
        Self { rotation, origin_m: [0.0; 3] }
    }

    /// Returns a displacement.
    pub(super) fn shift(by_m: Vector) -> Self {
        Self { origin_m: by_m, ..Self::IDENTITY }
    }

    /// Returns `inner`, which is given in this frame, in this frame's parent.
    #[must_use]
    pub fn then(&self, inner: &Self) -> Self {
        Self {
            rotation: multiply(&self.rotation, &inner.rotation),
            origin_m: self.point(inner.origin_m),
        }
    }

    /// Returns a point of this frame in the outer one.
    pub fn point(&self, p_m: Vector) -> Vector {
        add(self.direction(p_m), self.origin_m)
    }

    /// Returns a direction of this frame in the outer one.
    pub fn direction(&self, d: Vector) -> Vector {
        self.rotation.map(|row| dot(row, d))
    }

    /// Returns a point of the outer frame in this one.
    pub fn point_inside(&self, p_m: Vector) -> Vector {
        let d = sub(p_m, self.origin_m);
        let [x, y, z] = self.rotation;
        add(add(scaled(x, d[0]), scaled(y, d[1])), scaled(z, d[2]))
    }
}

fn multiply(a: &[Vector; 3], b: &[Vector; 3]) -> [Vector; 3] {
    a.map(|row| add(add(scaled(b[0], row[0]), scaled(b[1], row[1])), scaled(b[2], row[2])))
}

/// A straight line: a joint's axis in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    /// A point on it.
    pub(super) through_m: Vector,
    /// Unit vector along it.
    pub(super) along: Vector,
}

impl Line {
    /// Returns the point on the line that is nearest to `p_m`.
    pub(super) fn nearest(&self, p_m: Vector) -> Vector {
        let t = dot(sub(p_m, self.through_m), self.along);
        add(self.through_m, scaled(self.along, t))
    }

    /// Returns the distance of `p_m` from the line.
    pub(super) fn distance_m(&self, p_m: Vector) -> f64 {
        norm(sub(p_m, self.nearest(p_m)))
    }

    /// Returns the ends of the common perpendicular, on this line and on `other`; none for parallel
    /// lines.
    pub(super) fn feet(&self, other: &Self) -> Option<(Vector, Vector)> {
        // The sine of the smallest angle between lines that do not count as parallel.
        const PARALLEL: f64 = 1e-6;
        let normal = cross(self.along, other.along);
        let sine_squared = dot(normal, normal);
        if sine_squared < PARALLEL * PARALLEL {
            return None;
        }
        let between = sub(other.through_m, self.through_m);
        let t = dot(cross(between, other.along), normal) / sine_squared;
        let foot = add(self.through_m, scaled(self.along, t));
        Some((foot, other.nearest(foot)))
    }
}
