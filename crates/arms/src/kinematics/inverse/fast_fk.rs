//! Forward kinematics of many postures of one arm: values independent of the posture are computed once,
//! and nothing is allocated per posture.

use super::super::serial::{JointCoupling, JointMotionKind, MovingJoint, SerialChain};
use super::super::transform::{Line, Transform, Vector, multiply_matrices};
use sidestep_kernel::geometry::{add, add_scaled, dot, scaled};
use sidestep_kernel::math::sin_cos;
use std::f64::consts::{FRAC_PI_2, PI};

/// The constants of an arm.
#[derive(Debug)]
pub(super) struct FastFk {
    joints: Vec<FastFkJoint>,
    to_tip: Transform,
}

/// A joint whose frame in the link before it is turned by `still + cos(q) cosine + sin(q) sine`
/// (Rodrigues' formula, with the constant origin multiplied in).
#[derive(Debug)]
struct FastFkJoint {
    motion: JointMotionKind,
    drive: JointCoupling,
    /// The origin's rotation if the joint slides.
    still: [Vector; 3],
    cosine: [Vector; 3],
    sine: [Vector; 3],
    origin_m: Vector,
    /// The axis in the link before.
    axis: Vector,
}

/// The poses of links and axes at a posture.
#[derive(Debug, Clone)]
pub(super) struct LinkTransforms {
    /// Link 0 (the base), then the link that each joint carries.
    pub(super) links: Vec<Transform>,
    /// The joints' axes in the base's frame.
    pub(super) lines: Vec<Line>,
    pub(super) tip: Transform,
}

impl LinkTransforms {
    pub(super) fn from_chain(chain: &SerialChain) -> Self {
        let n = chain.joints.len();
        let line = Line { through_m: [0.0; 3], along: [0.0; 3] };
        Self {
            links: vec![Transform::IDENTITY; n + 1],
            lines: vec![line; n],
            tip: Transform::IDENTITY,
        }
    }
}

impl FastFk {
    pub(super) fn new(chain: &SerialChain) -> Self {
        let joints = chain.joints.iter().map(FastFkJoint::new).collect();
        Self { joints, to_tip: chain.to_tip }
    }

    /// Computes the poses at `values` into `placed`, which is one of this arm's.
    pub(super) fn compute_link_poses(&self, values: &[f64], placed: &mut LinkTransforms) {
        for (i, joint) in self.joints.iter().enumerate() {
            let q = joint.drive.value(values);
            let before = &placed.links[i];
            let axis = before.transform_direction(joint.axis);
            let through_m = before.transform_point(joint.origin_m);
            let pose = match joint.motion {
                JointMotionKind::Turn => {
                    let rotation = multiply_matrices(&before.rotation, &joint.rotation_at_angle(q));
                    Transform { rotation, origin_m: through_m }
                }
                JointMotionKind::Slide => Transform {
                    rotation: multiply_matrices(&before.rotation, &joint.still),
                    origin_m: add_scaled(through_m, axis, q),
                },
            };
            placed.lines[i] = Line { through_m, along: axis };
            placed.links[i + 1] = pose;
        }
        placed.tip = placed.links[self.joints.len()].compose(&self.to_tip);
    }

    /// Calls a function with each joint before link `link`, with the velocity of the point `p_m` of
    /// that link if the joint's variable changes by 1 per second.
    #[inline]
    pub(super) fn for_each_joint(
        &self,
        lines: &[Line],
        link: usize,
        p_m: Vector,
        mut visit: impl FnMut(usize, Vector),
    ) {
        for (joint, line) in self.joints[..link].iter().zip(lines) {
            let moves = match joint.motion {
                JointMotionKind::Turn => line.velocity_at(p_m),
                JointMotionKind::Slide => line.along,
            };
            visit(joint.drive.variable, scaled(moves, joint.drive.multiplier));
        }
    }

    /// Calls a function with each joint and the angular velocity of the tip if the joint's variable
    /// changes by 1 per second.
    #[inline]
    pub(super) fn for_each_turning_joint(
        &self,
        lines: &[Line],
        mut visit: impl FnMut(usize, Vector),
    ) {
        for (joint, line) in self.joints.iter().zip(lines) {
            if joint.motion == JointMotionKind::Turn {
                visit(joint.drive.variable, scaled(line.along, joint.drive.multiplier));
            }
        }
    }
}

impl FastFkJoint {
    /// Prepares a joint. The three matrices follow from the rotations at 0, a quarter and half of a turn.
    fn new(joint: &MovingJoint) -> Self {
        let rotation = joint.origin.rotation;
        let still = match joint.motion {
            JointMotionKind::Turn => halve_matrix(&add_all(
                &joint_rotation_at_angle(joint, 0.0),
                &joint_rotation_at_angle(joint, PI),
            )),
            JointMotionKind::Slide => rotation,
        };
        let minus_still = still.map(|row| scaled(row, -1.0));
        Self {
            motion: joint.motion,
            drive: joint.drive,
            cosine: add_all(&rotation, &minus_still),
            sine: add_all(&joint_rotation_at_angle(joint, FRAC_PI_2), &minus_still),
            still,
            origin_m: joint.origin.origin_m,
            axis: joint.origin.transform_direction(joint.axis),
        }
    }

    fn rotation_at_angle(&self, angle_rad: f64) -> [Vector; 3] {
        let (s, c) = sin_cos(angle_rad);
        [0, 1, 2].map(|i| add_scaled(add_scaled(self.still[i], self.cosine[i], c), self.sine[i], s))
    }
}

/// Returns the rotation of a joint's frame in the link before it, at an angle.
fn joint_rotation_at_angle(joint: &MovingJoint, angle_rad: f64) -> [Vector; 3] {
    joint.origin.compose(&Transform::from_axis_angle(joint.axis, angle_rad)).rotation
}

fn add_all(a: &[Vector; 3], b: &[Vector; 3]) -> [Vector; 3] {
    [0, 1, 2].map(|i| add(a[i], b[i]))
}

fn halve_matrix(a: &[Vector; 3]) -> [Vector; 3] {
    a.map(|row| scaled(row, 0.5))
}

/// Returns the rotation by which `from` becomes `to`, as its axis times its angle in rad.
pub(crate) fn rotation_between(from: &[Vector; 3], to: &[Vector; 3]) -> Vector {
    // `to * from^T`.
    let r = to.map(|row| from.map(|other| dot(row, other)));
    let skew = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
    let twice_cosine = r[0][0] + r[1][1] + r[2][2] - 1.0;
    let twice_sine = dot(skew, skew).sqrt();
    let angle_rad = sidestep_kernel::math::atan2(twice_sine, twice_cosine);
    // Below, the angle is twice_sine / 2 to the last bit but a few; beyond, the axis is lost in the
    // difference of nearly equal entries.
    if twice_cosine > 0.0 && twice_sine < 1e-9 {
        return scaled(skew, 0.5);
    }
    if twice_cosine < 0.0 && twice_sine < 1e-4 {
        return half_turn_vector(&r, angle_rad, skew);
    }
    scaled(skew, angle_rad / twice_sine)
}

/// Returns a turn by nearly half a turn: its axis is the largest column of `R + R^T + (1 - tr) I`.
fn half_turn_vector(r: &[Vector; 3], angle_rad: f64, skew: Vector) -> Vector {
    let trace = r[0][0] + r[1][1] + r[2][2];
    let columns = [0, 1, 2].map(|j| {
        [0, 1, 2].map(|i| {
            let diagonal = if i == j { 1.0 - trace } else { 0.0 };
            r[i][j] + r[j][i] + diagonal
        })
    });
    let longest = columns.into_iter().max_by(|a, b| dot(*a, *a).total_cmp(&dot(*b, *b)));
    let axis = longest.and_then(sidestep_kernel::geometry::normalized).unwrap_or([1.0, 0.0, 0.0]);
    let sign = if dot(axis, skew) < 0.0 { -1.0 } else { 1.0 };
    scaled(axis, sign * angle_rad)
}
