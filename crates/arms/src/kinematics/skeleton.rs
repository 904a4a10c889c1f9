//! Connectors from joint axes, and the rods between them.
//!
//! Every connector is fixed in a range of links: a point on the axis of joint j is fixed in links j
//! and j + 1, a point where three axes meet in four links. From the base on, the next connector is
//! the one farthest out that shares a link with the last one, so that points between which no joint
//! bends (such as the elbow offsets of a Panda) drop out.

use super::serial::{JointMotionKind, LinkFrames, MovingJoint, SerialChain};
use super::transform::{Line, Transform, Vector};
use sidestep_kernel::geometry::{add, dot, norm, perpendicular_component, scaled, sub};

/// Points nearer to each other than this fraction of the arm's reach count as one: models are written with some ten
/// digits, and a rod between two such points would have no direction.
const SAME_POINT_TOLERANCE: f64 = 1e-9;

/// An arm as a chain of rods.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    /// The connectors, one more than rods; the last is the tip.
    pub(super) connectors: Vec<LinkAnchor>,
    /// One between each two connectors, from the base out.
    pub rods: Vec<SkeletonRod>,
    /// Unit vector in the base's frame along the first joint's axis, from which the bend at the
    /// first connector is measured. None if that joint slides or the connector is not on it.
    pub base_direction: Option<Vector>,
    /// The sum of the links' lengths in m, an upper bound of the arm's reach.
    pub reach_m: f64,
}

/// Distances that two neighbors can have: one, unless a joint between them slides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkeletonRod {
    /// Shortest length in m. It is zero if a prismatic joint can bring its ends together.
    pub min_m: f64,
    /// Longest length in m; infinite if a prismatic joint has no limits.
    pub max_m: f64,
}

/// A point that is fixed in the links `first..=last`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LinkAnchor {
    /// Its position in the frame of link `first`, in m.
    pub(super) point_m: Vector,
    pub(super) first: usize,
    pub(super) last: usize,
}

impl LinkAnchor {
    pub(super) fn position_m(&self, frames: &LinkFrames) -> Vector {
        frames.links[self.first].transform_point(self.point_m)
    }
}

impl Skeleton {
    /// Returns the first connector that is fixed in a link, or else the last before it.
    pub(crate) fn connector_of_link(&self, link: usize) -> usize {
        let mut anchors = self.connectors.iter();
        let fixed = anchors.position(|anchor| (anchor.first..=anchor.last).contains(&link));
        let before = self.connectors.iter().rposition(|anchor| anchor.first <= link);
        fixed.or(before).unwrap_or(0)
    }
}

impl SerialChain {
    /// Returns the arm's connectors and rods. They do not depend on the posture.
    pub fn skeleton(&self) -> Skeleton {
        let frames = self.forward_kinematics(&vec![0.0; self.variables.len()]);
        let reach_m = self.reach_m();
        let builder =
            SkeletonBuilder { chain: self, lines: self.joint_axes(&frames), frames, reach_m };
        let connectors = builder.connectors();
        let rods = connectors.windows(2).map(|pair| builder.rod(&pair[0], &pair[1])).collect();
        Skeleton { rods, base_direction: builder.base_direction(&connectors), reach_m, connectors }
    }

    /// Returns the positions of the connectors of `skeleton` (this chain's) at `frames`, in m in
    /// the base's frame.
    pub fn connector_positions(&self, skeleton: &Skeleton, frames: &LinkFrames) -> Vec<Vector> {
        skeleton.connectors.iter().map(|anchor| anchor.position_m(frames)).collect()
    }

    /// Returns the arm up to connector `k` of `skeleton` (this chain's), as if that were its tip, with all its
    /// variables.
    pub fn up_to_connector(&self, skeleton: &Skeleton, k: usize) -> Self {
        let anchor = &skeleton.connectors[k];
        Self {
            tip: format!("connector {k}"),
            joints: self.joints[..anchor.first].to_vec(),
            to_tip: Transform::from_translation(anchor.point_m),
            ..self.clone()
        }
    }

    fn joint_axes(&self, frames: &LinkFrames) -> Vec<Line> {
        self.joints
            .iter()
            .zip(&frames.links)
            .map(|(joint, before)| joint.axis_line(before))
            .collect()
    }

    fn reach_m(&self) -> f64 {
        let links = self.joints.iter().map(|j| norm(j.origin.origin_m) + slide_limit_m(j));
        links.sum::<f64>() + norm(self.to_tip.origin_m)
    }
}

/// Returns the farthest that a joint slides within its limits; 0 of a joint that turns, or without limits.
fn slide_limit_m(joint: &MovingJoint) -> f64 {
    match (joint.motion, joint.limits) {
        (JointMotionKind::Slide, Some(limits)) => limits.lower.abs().max(limits.upper.abs()),
        _ => 0.0,
    }
}

struct SkeletonBuilder<'a> {
    chain: &'a SerialChain,
    /// The posture in which points are compared.
    frames: LinkFrames,
    lines: Vec<Line>,
    reach_m: f64,
}

impl SkeletonBuilder<'_> {
    fn connectors(&self) -> Vec<LinkAnchor> {
        let tip_link = self.chain.joints.len();
        let tip = self.link_anchor_at(self.frames.tip.origin_m, tip_link);
        let candidates = self.candidates();
        let Some(&base) = candidates.iter().filter(|c| c.first == 0).reduce(outer_anchor) else {
            return self.rigid_body_anchors(tip);
        };
        let mut connectors = vec![base];
        let mut last = base;
        while !self.can_rod_join(&last, &tip) {
            let next =
                candidates.iter().filter(|c| c.last > last.last && self.can_rod_join(&last, c));
            // Far from the origin rounding may part a connector from its axis; the rest of the arm is then one rod.
            let Some(next) = next.reduce(outer_anchor) else { break };
            last = *next;
            connectors.push(last);
        }
        if !self.is_coincident(&last, &tip) {
            connectors.push(tip);
        }
        connectors
    }

    /// Returns the anchors of a single rigid body: its base and its tip.
    fn rigid_body_anchors(&self, tip: LinkAnchor) -> Vec<LinkAnchor> {
        let base = self.link_anchor_at([0.0; 3], 0);
        if self.is_coincident(&base, &tip) { vec![tip] } else { vec![base, tip] }
    }

    /// Returns points on the axes, from the base out: feet of the common perpendiculars of
    /// neighbors.
    fn candidates(&self) -> Vec<LinkAnchor> {
        let Some(first) = self.lines.first() else { return Vec::new() };
        let mut candidates = Vec::new();
        let mut entry = first.through_m;
        // A first joint that slides carries the next axis away from the base, so a point on its own axis stays there.
        if self.lines.len() == 1 || self.chain.joints[0].motion == JointMotionKind::Slide {
            candidates.push(self.link_anchor_at(entry, 0));
        }
        for (joint, pair) in self.lines.windows(2).enumerate() {
            let (near, far) =
                pair[0].common_perpendicular(&pair[1]).unwrap_or((entry, pair[1].nearest(entry)));
            candidates.push(self.link_anchor_at(near, joint + 1));
            candidates.push(self.link_anchor_at(far, joint + 1));
            entry = far;
        }
        candidates
    }

    /// Returns the point at `p_m` that is fixed in `link`, with all links in which it is fixed too.
    fn link_anchor_at(&self, p_m: Vector, link: usize) -> LinkAnchor {
        let mut first = link;
        let mut last = link;
        while first > 0 && self.is_on_axis(p_m, first - 1) {
            first -= 1;
        }
        while last < self.lines.len() && self.is_on_axis(p_m, last) {
            last += 1;
        }
        LinkAnchor { point_m: self.frames.links[first].inverse_transform_point(p_m), first, last }
    }

    /// Returns whether a turn of the joint leaves the point where it is.
    fn is_on_axis(&self, p_m: Vector, joint: usize) -> bool {
        self.chain.joints[joint].motion == JointMotionKind::Turn
            && self.lines[joint].distance_m(p_m) <= SAME_POINT_TOLERANCE * self.reach_m
    }

    /// Returns whether a rod can join two points: fixed in one link, or on either side of a slide.
    fn can_rod_join(&self, inner: &LinkAnchor, outer: &LinkAnchor) -> bool {
        outer.first <= inner.last || self.sliding_joint_between(inner, outer).is_some()
    }

    fn sliding_joint_between(&self, inner: &LinkAnchor, outer: &LinkAnchor) -> Option<usize> {
        let slides = outer.first == inner.last + 1
            && self.chain.joints[inner.last].motion == JointMotionKind::Slide;
        slides.then_some(inner.last)
    }

    fn vector_between_m(&self, inner: &LinkAnchor, outer: &LinkAnchor) -> Vector {
        sub(outer.position_m(&self.frames), inner.position_m(&self.frames))
    }

    fn is_coincident(&self, inner: &LinkAnchor, outer: &LinkAnchor) -> bool {
        self.sliding_joint_between(inner, outer).is_none()
            && norm(self.vector_between_m(inner, outer)) <= SAME_POINT_TOLERANCE * self.reach_m
    }

    fn rod(&self, inner: &LinkAnchor, outer: &LinkAnchor) -> SkeletonRod {
        let v = self.vector_between_m(inner, outer);
        let Some(joint) = self.sliding_joint_between(inner, outer) else {
            return SkeletonRod { min_m: norm(v), max_m: norm(v) };
        };
        let axis = self.lines[joint].along;
        let offset_m = norm(perpendicular_component(v, axis));
        let joint = &self.chain.joints[joint];
        // The frames of the builder have every variable at zero, a mimic joint at its offset.
        let zero = joint.drive.offset;
        let Some(limits) = joint.limits else {
            return SkeletonRod { min_m: offset_m, max_m: f64::INFINITY };
        };
        let ends =
            [limits.lower, limits.upper].map(|q| norm([offset_m, dot(v, axis) + q - zero, 0.0]));
        let passes = (limits.lower..=limits.upper).contains(&(zero - dot(v, axis)));
        SkeletonRod {
            min_m: if passes { offset_m } else { ends[0].min(ends[1]) },
            max_m: ends[0].max(ends[1]),
        }
    }

    fn base_direction(&self, connectors: &[LinkAnchor]) -> Option<Vector> {
        let first = connectors.first().filter(|c| c.first == 0 && c.last > 0)?;
        let axis = self.lines[0].along;
        let outward =
            connectors.get(1).map_or(0.0, |next| dot(self.vector_between_m(first, next), axis));
        // Adding 0 turns -0 into 0, so that equal directions are equal in every bit.
        Some(if outward < 0.0 { scaled(axis, -1.0) } else { add(axis, [0.0; 3]) })
    }
}

/// Returns the anchor that is fixed farther out; of several the first.
fn outer_anchor<'a>(a: &'a LinkAnchor, b: &'a LinkAnchor) -> &'a LinkAnchor {
    if b.last > a.last { b } else { a }
}
