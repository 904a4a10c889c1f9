//! Bounds on the travel of an arm's parts along a straight path of its joints.

use super::super::serial::{JointMotionKind, MovingJoint, SerialChain};
use super::ArmBody;
use super::mount::LinkMount;
use sidestep_kernel::geometry::norm;

/// Bounds on the travel of every point of a part.
#[derive(Debug, Clone)]
struct PartLevers {
    /// Variable and travel per unit of it of each joint between the base and the part's link, from the base out.
    joints: Vec<(usize, f64)>,
    /// The same of the joints beside the arm that the part hangs on.
    beside: Vec<(usize, f64)>,
}

/// Bounds on the travel of an arm's parts.
#[derive(Debug, Clone, Default)]
pub struct BodyTravel {
    parts: Vec<PartLevers>,
}

impl BodyTravel {
    /// Returns the bounds of a body of `chain`.
    pub fn new(chain: &SerialChain, body: &ArmBody) -> Self {
        let parts = body.parts.iter();
        let levers = parts.map(|part| PartLevers::new(chain, &part.mount, part.radius_m));
        Self { parts: levers.collect() }
    }

    /// Returns a bound on the travel in m of any point of a part if the joints change by `changes`.
    pub(super) fn part_m(&self, part: usize, changes: &[f64]) -> f64 {
        let levers = &self.parts[part];
        travel_m(&levers.joints, changes) + travel_m(&levers.beside, changes)
    }

    /// Returns the same of the travel of two parts against each other: joints that carry both do not count.
    pub(super) fn pair_m(&self, a: usize, b: usize, changes: &[f64]) -> f64 {
        let [a, b] = [&self.parts[a], &self.parts[b]];
        let (inner, outer) = if a.joints.len() <= b.joints.len() { (a, b) } else { (b, a) };
        let between = &outer.joints[inner.joints.len()..];
        travel_m(between, changes)
            + travel_m(&inner.beside, changes)
            + travel_m(&outer.beside, changes)
    }
}

/// Returns the travel in m of levers if variables change.
fn travel_m(levers: &[(usize, f64)], changes: &[f64]) -> f64 {
    let turned = levers.iter().filter(|(variable, _)| changes[*variable] != 0.0);
    turned.map(|(variable, lever_m)| changes[*variable].abs() * lever_m).sum()
}

impl PartLevers {
    fn new(chain: &SerialChain, mount: &LinkMount, radius_m: f64) -> Self {
        let beside = mount.levers_m(chain, radius_m);
        let mut reach_m = radius_m + mount.reach_m(chain);
        let mut joints = Vec::with_capacity(mount.link);
        for joint in chain.joints[..mount.link].iter().rev() {
            let lever_m = match joint.motion {
                JointMotionKind::Turn => reach_m,
                JointMotionKind::Slide => 1.0,
            };
            joints.push((joint.drive.variable, lever_m * joint.drive.multiplier.abs()));
            reach_m += norm(joint.origin.origin_m) + slide_limit_m(joint);
        }
        joints.reverse();
        Self { joints, beside }
    }
}

/// Returns the farthest that a joint slides; infinite without limits.
fn slide_limit_m(joint: &MovingJoint) -> f64 {
    match (joint.motion, joint.limits) {
        (JointMotionKind::Turn, _) => 0.0,
        (JointMotionKind::Slide, Some(limits)) => limits.lower.abs().max(limits.upper.abs()),
        (JointMotionKind::Slide, None) => f64::INFINITY,
    }
}
