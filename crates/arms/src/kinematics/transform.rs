//! Rotations and frames in three dimensions, in m and rad.

use sidestep_import::urdf::Origin;
use sidestep_kernel::InputError;
use sidestep_kernel::geometry::{Point, add, cross, dot, norm, scaled, sub};
use sidestep_kernel::math::{cos, sin};

/// Largest error of the products of a rotation's rows: a matrix in single precision passes.
const ROTATION_TOLERANCE: f64 = 1e-6;

/// A point or a direction.
pub type Vector = Point<3>;

/// A frame in another: its point `p` is at `rotation * p + origin_m` in the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transform {
    /// Rows of the rotation matrix.
    pub rotation: [Vector; 3],
    /// The frame's origin in m.
    pub origin_m: Vector,
}

impl Transform {
    /// The identity: the frame itself.
    pub const IDENTITY: Self =
        Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], origin_m: [0.0; 3] };

    /// Returns the frame that a URDF's `<origin>` describes.
    pub fn from_urdf_origin(origin: &Origin) -> Self {
        let [roll, pitch, yaw] = origin.rpy_rad;
        let [x, y, z] = Self::IDENTITY.rotation;
        let about_x = Self::from_axis_angle(x, roll).rotation;
        let about_y = Self::from_axis_angle(y, pitch).rotation;
        let about_z = Self::from_axis_angle(z, yaw).rotation;
        let rotation = multiply_matrices(&multiply_matrices(&about_z, &about_y), &about_x);
        Self { rotation, origin_m: origin.xyz_m }
    }

    /// Returns the frame at `origin_m` that a quaternion of any length but 0 turns, scalar last:
    /// `x, y, z, w`.
    ///
    /// # Errors
    /// When the quaternion has length 0 or is not finite; `place` names its source.
    pub fn from_quaternion(
        place: &str,
        origin_m: Vector,
        quaternion: [f64; 4],
    ) -> Result<Self, InputError> {
        let length = norm(quaternion);
        // Quaternions that people write have a length near 1; one so far off is a mistake.
        if !(length > 1e-9 && length < 1e9) {
            let cause = format!("{quaternion:?} has length {length}, and so no direction");
            let remedy = "give x,y,z,w, scalar last, such as 0,0,0,1 for no turn at all";
            return Err(InputError::new(place, cause, remedy));
        }
        let [x, y, z, w] = quaternion.map(|q| q / length);
        let rotation = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ];
        Ok(Self { rotation, origin_m })
    }

    /// Returns its orientation as a quaternion of length 1, scalar last and not negative:
    /// `x, y, z, w`.
    pub fn quaternion(&self) -> [f64; 4] {
        let r = &self.rotation;
        // Four times the squares of x, y, z, w; the largest is the divisor, so that no digits are lost.
        let squares = [
            1.0 + r[0][0] - r[1][1] - r[2][2],
            1.0 - r[0][0] + r[1][1] - r[2][2],
            1.0 - r[0][0] - r[1][1] + r[2][2],
            1.0 + r[0][0] + r[1][1] + r[2][2],
        ];
        let sums = [r[2][1] + r[1][2], r[0][2] + r[2][0], r[1][0] + r[0][1]];
        let differences = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
        let largest = (0..4).fold(0, |best, i| if squares[i] > squares[best] { i } else { best });
        let unscaled = match largest {
            0 => [squares[0], sums[2], sums[1], differences[0]],
            1 => [sums[2], squares[1], sums[0], differences[1]],
            2 => [sums[1], sums[0], squares[2], differences[2]],
            _ => [differences[0], differences[1], differences[2], squares[3]],
        };
        let sign = if unscaled[3] < 0.0 { -1.0 } else { 1.0 };
        scaled(unscaled, sign / norm(unscaled))
    }

    /// Returns whether its rotation is one, to 1e-6: three orthogonal unit vectors that form a right hand.
    pub(super) fn has_valid_rotation(&self) -> bool {
        let [x, y, z] = self.rotation;
        let errors = [
            dot(x, x) - 1.0,
            dot(y, y) - 1.0,
            dot(z, z) - 1.0,
            dot(x, y),
            dot(cross(x, y), z) - 1.0,
        ];
        errors.iter().all(|error| error.abs() <= ROTATION_TOLERANCE)
    }

    /// Returns the inverse: the outer frame in this one.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let [x, y, z] = self.rotation;
        let rotation = [0, 1, 2].map(|i| [x[i], y[i], z[i]]);
        let turned = Self { rotation, origin_m: [0.0; 3] };
        Self { origin_m: scaled(turned.transform_direction(self.origin_m), -1.0), ..turned }
    }

    /// Returns one of its axes in the outer frame.
    pub(super) fn axis(&self, index: usize) -> Vector {
        self.rotation.map(|row| row[index])
    }

    /// Returns a turn by `angle_rad` about the unit vector `axis` (Rodrigues' formula).
    pub(super) fn from_axis_angle(axis: Vector, angle_rad: f64) -> Self {
        let s = sin(angle_rad);
        let c = cos(angle_rad);
        let [x, y, z] = axis;
        let v = 1.0 - c;
        let rotation = [
            [c + x * x * v, x * y * v - z * s, x * z * v + y * s],
            [y * x * v + z * s, c + y * y * v, y * z * v - x * s],
            [z * x * v - y * s, z * y * v + x * s, c + z * z * v],
        ];
        Self { rotation, origin_m: [0.0; 3] }
    }

    /// Returns the turn by the length of a vector in rad about its direction.
    pub(crate) fn from_rotation_vector(turn: Vector) -> Self {
        let angle_rad = norm(turn);
        if angle_rad > 0.0 {
            Self::from_axis_angle(scaled(turn, 1.0 / angle_rad), angle_rad)
        } else {
            Self::IDENTITY
        }
    }

    /// Returns a displacement without a turn.
    pub(super) fn from_translation(by_m: Vector) -> Self {
        Self { origin_m: by_m, ..Self::IDENTITY }
    }

    /// Returns `inner`, which is given in this frame, in this frame's parent.
    #[must_use]
    pub fn compose(&self, inner: &Self) -> Self {
        Self {
            rotation: multiply_matrices(&self.rotation, &inner.rotation),
            origin_m: self.transform_point(inner.origin_m),
        }
    }

    /// Returns a point of this frame in the outer one.
    pub fn transform_point(&self, p_m: Vector) -> Vector {
        add(self.transform_direction(p_m), self.origin_m)
    }

    /// Returns a direction of this frame in the outer one.
    pub fn transform_direction(&self, d: Vector) -> Vector {
        self.rotation.map(|row| dot(row, d))
    }

    /// Returns a point of the outer frame in this one.
    pub fn inverse_transform_point(&self, p_m: Vector) -> Vector {
        let d = sub(p_m, self.origin_m);
        let [x, y, z] = self.rotation;
        add(add(scaled(x, d[0]), scaled(y, d[1])), scaled(z, d[2]))
    }
}

#[inline]
pub(super) fn multiply_matrices(a: &[Vector; 3], b: &[Vector; 3]) -> [Vector; 3] {
    a.map(|row| add(add(scaled(b[0], row[0]), scaled(b[1], row[1])), scaled(b[2], row[2])))
}

/// A straight line: a joint's axis in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    /// Any point on it, in m.
    pub(super) through_m: Vector,
    /// A unit vector; positive values turn about it or slide along it.
    pub(super) along: Vector,
}

impl Line {
    pub(super) fn nearest(&self, p_m: Vector) -> Vector {
        let t = dot(sub(p_m, self.through_m), self.along);
        add(self.through_m, scaled(self.along, t))
    }

    pub(super) fn distance_m(&self, p_m: Vector) -> f64 {
        norm(sub(p_m, self.nearest(p_m)))
    }

    /// Returns the velocity of the point `p_m` that turns about the line by 1 rad per second.
    #[inline]
    pub(super) fn velocity_at(&self, p_m: Vector) -> Vector {
        cross(self.along, sub(p_m, self.through_m))
    }

    /// Returns the ends of the common perpendicular, on this line and on `other`; none for parallel
    /// lines.
    pub(super) fn common_perpendicular(&self, other: &Self) -> Option<(Vector, Vector)> {
        // The sine of the smallest angle between lines that do not count as parallel; at smaller
        // ones rounding moves the feet as far as points that count as different.
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
