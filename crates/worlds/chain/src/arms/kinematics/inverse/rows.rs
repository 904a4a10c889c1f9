//! Errors of a posture, and how the joints change them.

use super::super::pose::{Line, Vector};
use super::super::serial::{Frames, Motion, SerialChain};
use super::super::skeleton::{Anchor, Skeleton};
use super::apart_m;
use super::goal::{ArmGoal, Hit, Sphere};
use crate::rods::geometry::nearest_on_segment;
use sidestep_kernel::geometry::{cross, dot, scaled, sub};

/// Distance from spheres that steps aim at, in parts of the reach.
const MARGIN: f64 = 1e-4;

/// The criteria for a posture.
pub(super) struct Scene<'a> {
    chain: &'a SerialChain,
    anchors: &'a [Anchor],
    target_m: Vector,
    spheres: &'a [Sphere],
    margin_m: f64,
}

/// Errors of a posture in m, one for each row of the Jacobian.
pub(super) struct Errors {
    /// Wanted changes of the rows.
    pub(super) wanted: Vec<f64>,
    /// Rows of the Jacobian, each with an entry for each variable.
    pub(super) rows: Vec<Vec<f64>>,
    pub(super) tip_m: f64,
    /// The rod that is deepest in a sphere.
    pub(super) hit: Option<Hit>,
}

impl Errors {
    /// Returns the quantity that steps must reduce.
    pub(super) fn merit(&self) -> f64 {
        self.wanted.iter().map(|x| x * x).sum::<f64>().sqrt()
    }
}

impl<'a> Scene<'a> {
    pub(super) fn new(chain: &'a SerialChain, skeleton: &'a Skeleton, goal: &'a ArmGoal) -> Self {
        Self {
            chain,
            anchors: &skeleton.connectors,
            target_m: goal.target_m,
            spheres: &goal.spheres,
            margin_m: MARGIN * skeleton.reach_m,
        }
    }

    pub(super) fn errors(&self, values: &[f64]) -> Errors {
        let frames = self.chain.forward(values);
        let lines: Vec<Line> =
            self.chain.joints.iter().zip(&frames.links).map(|(j, link)| j.line(link)).collect();
        let tip = frames.tip.origin_m;
        let missing = sub(self.target_m, tip);
        let mut errors = Errors {
            wanted: missing.to_vec(),
            rows: vec![vec![0.0; values.len()]; 3],
            tip_m: apart_m(self.target_m, tip),
            hit: None,
        };
        self.each_joint(&lines, self.chain.joints.len(), tip, |variable, moves| {
            for (row, moves) in errors.rows.iter_mut().zip(moves) {
                row[variable] += moves;
            }
        });
        self.add_hits(&frames, &lines, &mut errors);
        errors
    }

    /// Calls a function with the motion of a point of link `link` for each of the joints before
    /// that link.
    fn each_joint(
        &self,
        lines: &[Line],
        link: usize,
        p_m: Vector,
        mut tell: impl FnMut(usize, Vector),
    ) {
        for (joint, line) in self.chain.joints[..link].iter().zip(lines) {
            let moves = match joint.motion {
                Motion::Turn => cross(line.along, sub(p_m, line.through_m)),
                Motion::Slide => line.along,
            };
            tell(joint.drive.variable, scaled(moves, joint.drive.multiplier));
        }
    }

    /// Adds a row for each rod that is in a sphere or nearly so.
    fn add_hits(&self, frames: &Frames, lines: &[Line], errors: &mut Errors) {
        for (rod, pair) in self.anchors.windows(2).enumerate() {
            let ends = [pair[0].position_m(frames), pair[1].position_m(frames)];
            for (sphere, &Sphere { center_m, radius_m }) in self.spheres.iter().enumerate() {
                let nearest = nearest_on_segment(center_m, ends[0], ends[1]);
                let apart = apart_m(nearest, center_m);
                let depth_m = radius_m - apart;
                if depth_m + self.margin_m <= 0.0 {
                    continue;
                }
                let away = if apart > 0.0 {
                    scaled(sub(nearest, center_m), 1.0 / apart)
                } else {
                    [0.0, 0.0, 1.0]
                };
                let part = share(nearest, ends);
                let mut row = vec![0.0; errors.rows[0].len()];
                for (anchor, (at, share)) in pair.iter().zip(ends.iter().zip([1.0 - part, part])) {
                    self.each_joint(lines, anchor.first, *at, |variable, moves| {
                        row[variable] += share * dot(moves, away);
                    });
                }
                errors.wanted.push(depth_m + self.margin_m);
                errors.rows.push(row);
                let is_deepest = errors.hit.as_ref().is_none_or(|hit| depth_m > hit.depth_m);
                if depth_m > 0.0 && is_deepest {
                    errors.hit = Some(Hit { rod, sphere, depth_m });
                }
            }
        }
    }
}

/// Returns the position of a point along a segment, in [0, 1].
fn share(p_m: Vector, [a, b]: [Vector; 2]) -> f64 {
    let d = sub(b, a);
    let square = dot(d, d);
    if square > 0.0 { (dot(sub(p_m, a), d) / square).clamp(0.0, 1.0) } else { 0.0 }
}
