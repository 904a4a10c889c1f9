//! Joint limits as bend limits.
//!
//! The bend at a connector is the angle by which the next rod turns away from the direction of the
//! one before. If one revolute joint alone changes it, cos(bend) = A + B cos(q - q0), and the
//! joint's limits become a limit of the bend.

use std::f64::consts::PI;

use super::serial::{JointMotionKind, SerialChain};
use super::skeleton::Skeleton;
use super::transform::Vector;
use sidestep_kernel::geometry::{cross, dot, norm, perpendicular_component, scaled, sub};
use sidestep_kernel::math::{acos, atan2, cos, wrap_angle};

/// Angles that differ by less count as equal, because models are written with some ten digits.
const ANGLE_TOLERANCE_RAD: f64 = 1e-9;

/// How far a joint's limits let a connector bend.
#[derive(Debug, Clone, PartialEq)]
pub struct BendLimit {
    /// The joint whose limits it comes from.
    pub joint: String,
    /// The largest bend that the joint allows, in rad, in [0, pi].
    pub max_bend_rad: f64,
    /// Whether the joint is inside its limits if and only if the bend is below the limit.
    /// Otherwise there are bends below it that the joint cannot make: on one side, or because
    /// the rods cannot be straight.
    pub is_exact: bool,
}

impl SerialChain {
    /// Returns for each connector the limit of its bend; none if several joints bend it or none does,
    /// and at the tip. The bend at the first connector is measured from [`Skeleton::base_direction`].
    pub fn bend_limits(&self, skeleton: &Skeleton) -> Vec<Option<BendLimit>> {
        (0..skeleton.connectors.len()).map(|at| self.bend_limit(skeleton, at)).collect()
    }

    fn bend_limit(&self, skeleton: &Skeleton, at: usize) -> Option<BendLimit> {
        let here = &skeleton.connectors[at];
        let next = skeleton.connectors.get(at + 1)?;
        let frames = self.forward_kinematics(&vec![0.0; self.variables.len()]);
        let here_m = here.position_m(&frames);
        // The outermost link that holds the rod before, and the innermost that holds the next.
        let (before, held_by) = match at.checked_sub(1).map(|i| &skeleton.connectors[i]) {
            Some(last) => (sub(here_m, last.position_m(&frames)), last.last.min(here.last)),
            None => (skeleton.base_direction?, 1),
        };
        let holds_next = next.first.max(here.first);
        if holds_next != held_by + 1 || holds_next > here.last {
            return None;
        }
        let joint = &self.joints[held_by];
        if joint.motion != JointMotionKind::Turn || !joint.drive.is_identity() {
            return None;
        }
        let after = sub(next.position_m(&frames), here_m);
        let bend =
            JointBendFunction::new(before, after, joint.axis_line(&frames.links[held_by]).along)?;
        let (max_bend_rad, is_exact) = match joint.limits {
            Some(limits) => bend.limit(limits.lower, limits.upper),
            None => (bend.max_rad(), bend.can_be_straight()),
        };
        Some(BendLimit { joint: joint.name.clone(), max_bend_rad, is_exact })
    }
}

/// cos(bend) = `along` + `across` cos(q - `straight_rad`).
struct JointBendFunction {
    along: f64,
    across: f64,
    straight_rad: f64,
}

impl JointBendFunction {
    /// Returns the bend, or none if the joint turns one of the rods about itself.
    fn new(before: Vector, after: Vector, axis: Vector) -> Option<Self> {
        let before = scaled(before, 1.0 / norm(before));
        let after = scaled(after, 1.0 / norm(after));
        let u = perpendicular_component(before, axis);
        let v = perpendicular_component(after, axis);
        let product = norm(u) * norm(v);
        if product < ANGLE_TOLERANCE_RAD {
            return None;
        }
        let from_u_to_v_rad = atan2(dot(cross(u, v), axis), dot(u, v));
        Some(Self {
            along: dot(before, axis) * dot(after, axis),
            across: product,
            straight_rad: -from_u_to_v_rad,
        })
    }

    fn at(&self, from_straight_rad: f64) -> f64 {
        if self.can_be_straight() && self.along.abs() < ANGLE_TOLERANCE_RAD {
            return wrap_angle(from_straight_rad).abs();
        }
        acos((self.along + self.across * cos(from_straight_rad)).clamp(-1.0, 1.0))
    }

    fn max_rad(&self) -> f64 {
        self.at(PI)
    }

    fn can_be_straight(&self) -> bool {
        (1.0 - self.along - self.across).abs() < ANGLE_TOLERANCE_RAD
    }

    /// Returns the largest bend within limits of the joint, and whether it is equivalent to them.
    fn limit(&self, lower_rad: f64, upper_rad: f64) -> (f64, bool) {
        let half_rad = 0.5 * (upper_rad - lower_rad);
        let middle_rad = wrap_angle(0.5 * (upper_rad + lower_rad) - self.straight_rad);
        let is_exact = middle_rad.abs() < ANGLE_TOLERANCE_RAD && self.can_be_straight();
        let farthest_rad = (middle_rad.abs() + half_rad).min(PI);
        (self.at(farthest_rad), is_exact)
    }
}
