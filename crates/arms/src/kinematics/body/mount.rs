//! The place of a link of a model, at a posture of an arm of it.

use super::super::serial::{JointCoupling, JointMotionKind, SerialChain};
use super::super::transform::Transform;
use sidestep_import::urdf::Model;
use sidestep_kernel::geometry::norm;

/// A frame that hangs on a link of the arm, at joints of its own where it is beside the arm.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LinkMount {
    /// The link of the arm, counted as its frames are.
    pub(super) link: usize,
    /// Joints that follow joints of the arm, from the link out.
    steps: Vec<MimicJoint>,
    /// The frame behind the last of them.
    last: Transform,
}

/// A joint beside the arm that follows one of its joints.
#[derive(Debug, Clone, PartialEq)]
struct MimicJoint {
    before: Transform,
    motion: JointMotionKind,
    axis: [f64; 3],
    drive: JointCoupling,
}

impl MimicJoint {
    /// Returns a bound on the distance of what it carries from what carries it, m; infinite if it slides after a joint
    /// without limits.
    fn reach_m(&self, chain: &SerialChain) -> f64 {
        let offset_m = norm(self.before.origin_m);
        match self.motion {
            JointMotionKind::Turn => offset_m,
            JointMotionKind::Slide => {
                let limits = chain.variables[self.drive.variable].limits;
                let largest = limits.map_or(f64::INFINITY, |l| l.lower.abs().max(l.upper.abs()));
                offset_m + self.drive.offset.abs() + self.drive.multiplier.abs() * largest
            }
        }
    }
}

impl LinkMount {
    /// Returns a frame that is fixed in a link of the arm.
    pub(super) fn rigid(link: usize, last: Transform) -> Self {
        Self { link, steps: Vec::new(), last }
    }

    pub(super) fn transform(&self, links: &[Transform], values: &[f64]) -> Transform {
        let start = links[self.link];
        let at = self.steps.iter().fold(start, |at, step| {
            at.compose(&step.before)
                .compose(&step.motion.transform(step.axis, step.drive.value(values)))
        });
        at.compose(&self.last)
    }

    /// Returns whether it never moves against the link that it hangs on.
    pub(super) fn is_rigid(&self) -> bool {
        self.steps.is_empty()
    }

    /// Returns a bound on the distance of the frame from the link that it hangs on, m.
    pub(super) fn reach_m(&self, chain: &SerialChain) -> f64 {
        let steps_m = self.steps.iter().map(|step| step.reach_m(chain));
        steps_m.sum::<f64>() + norm(self.last.origin_m)
    }

    /// Returns bounds on the travel of points up to `beyond_m` from the frame, per unit of the variable of each joint
    /// between it and the link, m.
    pub(super) fn levers_m(&self, chain: &SerialChain, beyond_m: f64) -> Vec<(usize, f64)> {
        let mut levers = Vec::with_capacity(self.steps.len());
        let mut reach_m = beyond_m + norm(self.last.origin_m);
        for step in self.steps.iter().rev() {
            let lever_m = match step.motion {
                JointMotionKind::Turn => reach_m,
                JointMotionKind::Slide => 1.0,
            };
            levers.push((step.drive.variable, lever_m * step.drive.multiplier.abs()));
            reach_m += step.reach_m(chain);
        }
        levers
    }

    /// Returns where `inner` is, a frame given in this one.
    fn compose(&self, inner: &Transform) -> Self {
        Self { last: self.last.compose(inner), ..self.clone() }
    }
}

/// By the index of the link in the model.
pub(super) struct LinkMountsOnArm(Vec<LinkMount>);

impl LinkMountsOnArm {
    pub(super) fn new(model: &Model, chain: &SerialChain) -> Self {
        let mut found: Vec<Option<LinkMount>> = vec![None; model.links.len()];
        let base = link_index(model, &chain.base);
        let tip = link_index(model, &chain.tip);
        found[base] = Some(LinkMount { link: 0, steps: Vec::new(), last: Transform::IDENTITY });
        let mut link = 0;
        for joint in model.joint_path(base, tip).expect("an arm of this model") {
            let joint = &model.joints[joint];
            let origin = Transform::from_urdf_origin(&joint.origin);
            let before = found[joint.parent].clone().expect("the path goes out from the base");
            found[joint.child] = Some(if joint.kind.has_one_value() {
                link += 1;
                LinkMount { link, steps: Vec::new(), last: Transform::IDENTITY }
            } else {
                before.compose(&origin)
            });
        }
        find_fixed_mounts(model, chain, base, &mut found);
        Self(
            (0..model.links.len())
                .map(|link| find_link_mount(model, chain, link, &mut found))
                .collect(),
        )
    }

    /// Returns the mount of a frame in a link of the model.
    pub(super) fn mount_in_link(&self, link: usize, inside: Transform) -> LinkMount {
        self.0[link].compose(&inside)
    }

    pub(super) fn link(&self, link: usize) -> &LinkMount {
        &self.0[link]
    }
}

fn link_index(model: &Model, name: &str) -> usize {
    model.links.iter().position(|link| link == name).expect("an arm of this model")
}

/// Finds the links from the base up to the root: they stand still with the base.
fn find_fixed_mounts(
    model: &Model,
    chain: &SerialChain,
    base: usize,
    found: &mut [Option<LinkMount>],
) {
    let mut link = base;
    while let Some(joint) = model.parent_joint(link) {
        let below = found[link].clone().expect("found before");
        let down = rest_transform(model, chain, joint);
        link = model.joints[joint].parent;
        found[link] = Some(below.compose(&down.inverse()));
    }
}

/// Finds the mount of a link from that of the link that carries it.
fn find_link_mount(
    model: &Model,
    chain: &SerialChain,
    link: usize,
    found: &mut [Option<LinkMount>],
) -> LinkMount {
    let mut out = Vec::new();
    let mut at = link;
    while found[at].is_none() {
        let joint = model.parent_joint(at).expect("the root is found");
        out.push(joint);
        at = model.joints[joint].parent;
    }
    for joint in out.into_iter().rev() {
        let before = found[model.joints[joint].parent].clone().expect("found before");
        found[model.joints[joint].child] = Some(match mimic_motion(model, chain, joint) {
            None => before.compose(&rest_transform(model, chain, joint)),
            Some((motion, drive)) => {
                let moving = &model.joints[joint];
                let before_it = before.last.compose(&Transform::from_urdf_origin(&moving.origin));
                let step = MimicJoint { before: before_it, motion, axis: moving.axis, drive };
                let steps = before.steps.into_iter().chain([step]).collect();
                LinkMount { steps, last: Transform::IDENTITY, link: before.link }
            }
        });
    }
    found[link].clone().expect("just found")
}

/// Returns the motion of a joint beside the arm that follows a joint of it.
fn mimic_motion(
    model: &Model,
    chain: &SerialChain,
    joint: usize,
) -> Option<(JointMotionKind, JointCoupling)> {
    let motion = JointMotionKind::from_kind(model.joints[joint].kind)?;
    Some((motion, chain.coupling(model, joint)?))
}

/// Returns the child's frame in the parent's if a joint is at rest: at the value nearest to zero.
fn rest_transform(model: &Model, chain: &SerialChain, joint: usize) -> Transform {
    let moving = &model.joints[joint];
    let origin = Transform::from_urdf_origin(&moving.origin);
    let rest = moving.limits.map_or(0.0, |l| 0f64.clamp(l.lower, l.upper));
    match JointMotionKind::from_kind(moving.kind) {
        // A link that floats or slides in a plane is taken as drawn.
        None => origin,
        Some(motion) => {
            let drive = chain.coupling(model, joint);
            let value = drive.map_or(rest, |drive| drive.value(&chain.rest_values()));
            origin.compose(&motion.transform(moving.axis, value))
        }
    }
}
