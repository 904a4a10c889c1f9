//! Parts of an arm that are in something, or nearly so.

use super::super::pose::Vector;
use super::super::skeleton::{Anchor, Skeleton};
use super::answer::Hit;
use super::goal::{ArmGoal, Sphere};
use super::quick::Placed;
use crate::rods::geometry::nearest_on_segment;
use sidestep_kernel::geometry::{dot, norm, scaled, sub};

/// Distance from everything that steps aim at, in parts of the reach.
const MARGIN: f64 = 1e-4;

/// The parts of an arm, and what they must not enter.
pub(super) struct Contacts<'a> {
    anchors: &'a [Anchor],
    spheres: &'a [Sphere],
    margin_m: f64,
}

/// A place where a part is too near to something.
#[derive(Debug, Clone)]
pub(super) struct Contact {
    /// The unit vector in which the part gets away.
    pub(super) away: Vector,
    /// The way that it must go, in m.
    pub(super) wanted_m: f64,
    /// The points that move the part.
    pub(super) pulls: [Pull; 2],
}

/// A point of a link, and its share in a contact's motion.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pull {
    pub(super) link: usize,
    pub(super) at_m: Vector,
    pub(super) share: f64,
}

impl<'a> Contacts<'a> {
    pub(super) fn new(skeleton: &'a Skeleton, goal: &'a ArmGoal) -> Self {
        Self {
            anchors: &skeleton.connectors,
            spheres: &goal.spheres,
            margin_m: MARGIN * skeleton.reach_m,
        }
    }

    /// Finds all contacts of a posture, and returns the deepest hit.
    pub(super) fn find(&self, placed: &Placed, contacts: &mut Vec<Contact>) -> Option<Hit> {
        contacts.clear();
        let mut deepest: Option<Hit> = None;
        if self.spheres.is_empty() {
            return deepest;
        }
        for (rod, pair) in self.anchors.windows(2).enumerate() {
            let ends = [pair[0], pair[1]].map(|a| placed.links[a.first].point(a.point_m));
            for (sphere, &Sphere { center_m, radius_m }) in self.spheres.iter().enumerate() {
                let nearest = nearest_on_segment(center_m, ends[0], ends[1]);
                let apart_m = norm(sub(nearest, center_m));
                let depth_m = radius_m - apart_m;
                if depth_m + self.margin_m <= 0.0 {
                    continue;
                }
                let away = if apart_m > 0.0 {
                    scaled(sub(nearest, center_m), 1.0 / apart_m)
                } else {
                    [0.0, 0.0, 1.0]
                };
                let part = share(nearest, ends);
                let pull =
                    |end: usize, share| Pull { link: pair[end].first, at_m: ends[end], share };
                contacts.push(Contact {
                    away,
                    wanted_m: depth_m + self.margin_m,
                    pulls: [pull(0, 1.0 - part), pull(1, part)],
                });
                if depth_m > deepest.as_ref().map_or(0.0, |hit| hit.depth_m) {
                    deepest = Some(Hit { rod, sphere, depth_m });
                }
            }
        }
        deepest
    }
}

/// Returns the position of a point along a segment, in [0, 1].
fn share(p_m: Vector, [a, b]: [Vector; 2]) -> f64 {
    let d = sub(b, a);
    let square = dot(d, d);
    if square > 0.0 { (dot(sub(p_m, a), d) / square).clamp(0.0, 1.0) } else { 0.0 }
}
