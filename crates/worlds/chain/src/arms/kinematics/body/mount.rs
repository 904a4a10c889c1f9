//! The place of a link of a model, at a posture of an arm of it.

use super::super::pose::Pose;
use super::super::serial::{Drive, Motion, SerialChain};
use sidestep_import::urdf::Model;

/// A frame that hangs on a link of the arm, at joints of its own where it is beside the arm.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mount {
    /// The link of the arm, counted as its frames are.
    pub(super) link: usize,
    /// Joints that follow joints of the arm, from the link out.
    steps: Vec<Step>,
    /// The frame behind the last of them.
    last: Pose,
}

/// A joint beside the arm that follows one of its joints.
#[derive(Debug, Clone, PartialEq)]
struct Step {
    before: Pose,
    motion: Motion,
    axis: [f64; 3],
    drive: Drive,
}

impl Mount {
    pub(super) fn at(&self, links: &[Pose], values: &[f64]) -> Pose {
        let start = links[self.link];
        let at = self.steps.iter().fold(start, |at, step| {
            at.then(&step.before).then(&step.motion.moved(step.axis, step.drive.value(values)))
        });
        at.then(&self.last)
    }

    /// Returns whether it never moves against the link that it hangs on.
    pub(super) fn is_rigid(&self) -> bool {
        self.steps.is_empty()
    }

    /// Returns a frame in this one.
    fn then(&self, inner: &Pose) -> Self {
        Self { last: self.last.then(inner), ..self.clone() }
    }
}

/// The mounts of all links of a model.
pub(super) struct Mounts(Vec<Mount>);

impl Mounts {
    pub(super) fn new(model: &Model, chain: &SerialChain) -> Self {
        let mut found: Vec<Option<Mount>> = vec![None; model.links.len()];
        let index = |name: &str| model.links.iter().position(|link| link == name);
        let ends = index(&chain.base).zip(index(&chain.tip));
        let (base, tip) = ends.expect("an arm of this model");
        found[base] = Some(Mount { link: 0, steps: Vec::new(), last: Pose::IDENTITY });
        let mut link = 0;
        for joint in model.way(base, tip).expect("an arm of this model") {
            let joint = &model.joints[joint];
            let origin = Pose::from_origin(&joint.origin);
            let before = found[joint.parent].clone().expect("the way goes out from the base");
            found[joint.child] = Some(if joint.kind.has_one_value() {
                link += 1;
                Mount { link, steps: Vec::new(), last: Pose::IDENTITY }
            } else {
                before.then(&origin)
            });
        }
        above(model, chain, base, &mut found);
        Self((0..model.links.len()).map(|link| reach(model, chain, link, &mut found)).collect())
    }

    /// Returns the mount of a frame in a link of the model.
    pub(super) fn of(&self, link: usize, inside: Pose) -> Mount {
        self.0[link].then(&inside)
    }

    pub(super) fn link(&self, link: usize) -> &Mount {
        &self.0[link]
    }
}

/// Finds the links from the base up to the root: they stand still with the base.
fn above(model: &Model, chain: &SerialChain, base: usize, found: &mut [Option<Mount>]) {
    let mut link = base;
    while let Some(joint) = model.joint_above(link) {
        let below = found[link].clone().expect("found before");
        let down = still(model, chain, joint);
        link = model.joints[joint].parent;
        found[link] = Some(below.then(&down.inverse()));
    }
}

/// Finds the mount of a link from that of the link that carries it.
fn reach(model: &Model, chain: &SerialChain, link: usize, found: &mut [Option<Mount>]) -> Mount {
    let mut out = Vec::new();
    let mut at = link;
    while found[at].is_none() {
        let joint = model.joint_above(at).expect("the root is found");
        out.push(joint);
        at = model.joints[joint].parent;
    }
    for joint in out.into_iter().rev() {
        let before = found[model.joints[joint].parent].clone().expect("found before");
        found[model.joints[joint].child] = Some(match follows(model, chain, joint) {
            None => before.then(&still(model, chain, joint)),
            Some((motion, drive)) => {
                let moving = &model.joints[joint];
                let before_it = before.last.then(&Pose::from_origin(&moving.origin));
                let step = Step { before: before_it, motion, axis: moving.axis, drive };
                let steps = before.steps.into_iter().chain([step]).collect();
                Mount { steps, last: Pose::IDENTITY, link: before.link }
            }
        });
    }
    found[link].clone().expect("just found")
}

/// Returns the motion of a joint beside the arm that follows a joint of it.
fn follows(model: &Model, chain: &SerialChain, joint: usize) -> Option<(Motion, Drive)> {
    let motion = Motion::of(model.joints[joint].kind)?;
    Some((motion, chain.drive(model, joint)?))
}

/// Returns the child's frame in the parent's if a joint is at rest: at the value nearest to zero.
fn still(model: &Model, chain: &SerialChain, joint: usize) -> Pose {
    let moving = &model.joints[joint];
    let origin = Pose::from_origin(&moving.origin);
    let rest = moving.limits.map_or(0.0, |l| 0f64.clamp(l.lower, l.upper));
    match Motion::of(moving.kind) {
        // A link that floats or slides in a plane is taken as drawn.
        None => origin,
        Some(motion) => {
            let drive = chain.drive(model, joint);
            let value = drive.map_or(rest, |drive| drive.value(&chain.rest()));
            origin.then(&motion.moved(moving.axis, value))
        }
    }
}
