//! Parts of an arm that are in another body, or nearly so.

use super::super::body::{self, ArmBody, PlacedBody, Proximity};
use super::super::skeleton::{LinkAnchor, Skeleton};
use super::super::transform::Vector;
use super::fast_fk::LinkTransforms;
use super::goal::{ArmGoal, ObstacleSphere};
use super::result::{ArmBodyPart, CollidesWith, Collision};
use sidestep_kernel::geometry::{dot, norm, scaled, sub};
use sidestep_rods::geometry::nearest_on_segment;

/// Clearance from all bodies that steps aim at, as a fraction of the reach: without it a posture that only
/// touches a body would count as a collision by rounding.
const MARGIN: f64 = 1e-4;

/// The parts of an arm, and the bodies that they must not enter.
pub(super) struct ContactFinder<'a> {
    anchors: &'a [LinkAnchor],
    /// Indices of the rods that stand for links without shapes.
    rods: Vec<usize>,
    spheres: &'a [ObstacleSphere],
    body: Option<&'a ArmBody>,
    own_body: bool,
    margin_m: f64,
}

/// Kept from posture to posture, so that none allocates.
#[derive(Debug, Clone, Default)]
pub(super) struct ContactSet {
    pub(super) contacts: Vec<Contact>,
    /// The deepest of those that are more than a mere margin.
    pub(super) hit: Option<Collision>,
    parts: Vec<body::PlacedShape>,
}

/// A place where a part is too near to a body.
#[derive(Debug, Clone)]
pub(super) struct Contact {
    /// The unit vector in which the part gets away.
    pub(super) away: Vector,
    /// The distance by which it must move, in m.
    pub(super) wanted_m: f64,
    /// The points that move it.
    pub(super) pulls: [LinkContactPoint; 2],
}

/// A point of a link, and its share in a contact's motion.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinkContactPoint {
    pub(super) link: usize,
    pub(super) at_m: Vector,
    pub(super) share: f64,
}

impl ContactSet {
    fn add(
        &mut self,
        contact: Contact,
        depth_m: f64,
        hit: impl FnOnce() -> (ArmBodyPart, CollidesWith),
    ) {
        self.contacts.push(contact);
        if depth_m > self.hit.as_ref().map_or(0.0, |hit| hit.depth_m) {
            let (part, against) = hit();
            self.hit = Some(Collision { part, against, depth_m });
        }
    }
}

impl<'a> ContactFinder<'a> {
    pub(super) fn new(skeleton: &'a Skeleton, goal: &'a ArmGoal) -> Self {
        let body = goal.body.as_ref().filter(|body| !body.is_empty());
        let anchors = &skeleton.connectors;
        let mut rods = Vec::new();
        for (rod, ends) in anchors.windows(2).enumerate() {
            let mut links = links_carrying_rod(&ends[0], &ends[1]);
            if body.is_none_or(|body| !links.any(|link| body.has_shape(link))) {
                rods.push(rod);
            }
        }
        Self {
            anchors,
            rods,
            spheres: &goal.spheres,
            body,
            own_body: goal.own_body,
            margin_m: MARGIN * skeleton.reach_m,
        }
    }

    /// Replaces `touched` by the contacts at `values`, where `placed` are the links.
    pub(super) fn find(&self, values: &[f64], placed: &LinkTransforms, touched: &mut ContactSet) {
        touched.contacts.clear();
        touched.hit = None;
        if !self.spheres.is_empty() {
            self.rods.iter().for_each(|&rod| self.add_rod_contacts(rod, placed, touched));
        }
        let Some(body) = self.body.filter(|_| self.own_body || !self.spheres.is_empty()) else {
            return;
        };
        let mut shapes = std::mem::take(&mut touched.parts);
        body.place_shapes_on(&placed.links, values, &mut shapes);
        let placed_body = PlacedBody { body, shapes: &shapes };
        self.add_part_sphere_contacts(placed_body, touched);
        if self.own_body {
            self.find_link_contacts(placed_body, touched);
        }
        touched.parts = shapes;
    }

    fn add_rod_contacts(&self, rod: usize, placed: &LinkTransforms, touched: &mut ContactSet) {
        let pair = [self.anchors[rod], self.anchors[rod + 1]];
        let ends = pair.map(|anchor| placed.links[anchor.first].transform_point(anchor.point_m));
        for (sphere, &ObstacleSphere { center_m, radius_m }) in self.spheres.iter().enumerate() {
            let nearest = nearest_on_segment(center_m, ends[0], ends[1]);
            let apart_m = norm(sub(nearest, center_m));
            let depth_m = radius_m - apart_m;
            if depth_m + self.margin_m <= 0.0 {
                continue;
            }
            let away = if apart_m > 0.0 {
                // A rod through the center gets out in any direction; a fixed one gives the same
                // steps everywhere.
                scaled(sub(nearest, center_m), 1.0 / apart_m)
            } else {
                [0.0, 0.0, 1.0]
            };
            let part = fraction_along(nearest, ends);
            let pulls = [
                LinkContactPoint { link: pair[0].first, at_m: ends[0], share: 1.0 - part },
                LinkContactPoint { link: pair[1].first, at_m: ends[1], share: part },
            ];
            let contact = Contact { away, wanted_m: depth_m + self.margin_m, pulls };
            touched.add(contact, depth_m, || (ArmBodyPart::Rod(rod), CollidesWith::Sphere(sphere)));
        }
    }

    fn add_part_sphere_contacts(&self, placed: PlacedBody<'_>, touched: &mut ContactSet) {
        let body = placed.body;
        for (sphere, &ObstacleSphere { center_m, radius_m }) in self.spheres.iter().enumerate() {
            for part in 0..body.len() {
                let near = placed.ball_proximity(part, center_m, radius_m, self.margin_m);
                if let Some(near) = near {
                    let contact = self.contact(&near, body.link(part), 0);
                    touched.add(contact, -near.apart_m, || {
                        (ArmBodyPart::Link(body.name(part).into()), CollidesWith::Sphere(sphere))
                    });
                }
            }
        }
    }

    fn find_link_contacts(&self, placed: PlacedBody<'_>, touched: &mut ContactSet) {
        let body = placed.body;
        for &(a, b) in body.own_pairs() {
            if let Some(near) = placed.proximity(a, b, self.margin_m) {
                let contact = self.contact(&near, body.link(a), body.link(b));
                touched.add(contact, -near.apart_m, || {
                    (
                        ArmBodyPart::Link(body.name(b).into()),
                        CollidesWith::Link(body.name(a).into()),
                    )
                });
            }
        }
    }

    /// Returns the contact of two bodies that are fixed in two links; the base stands still.
    fn contact(&self, near: &Proximity, link: usize, other: usize) -> Contact {
        Contact {
            away: near.away,
            wanted_m: self.margin_m - near.apart_m,
            pulls: [
                LinkContactPoint { link, at_m: near.first_m, share: 1.0 },
                LinkContactPoint { link: other, at_m: near.second_m, share: -1.0 },
            ],
        }
    }
}

/// Returns the links that hold the rod between two anchors, or on either side of its slide.
fn links_carrying_rod(inner: &LinkAnchor, outer: &LinkAnchor) -> impl Iterator<Item = usize> {
    let first = outer.first.max(inner.first);
    let last = inner.last.min(outer.last);
    first.min(last)..=first.max(last)
}

/// Returns the position of a point along a segment, in [0, 1].
fn fraction_along(p_m: Vector, [a, b]: [Vector; 2]) -> f64 {
    let d = sub(b, a);
    let square = dot(d, d);
    if square > 0.0 { (dot(sub(p_m, a), d) / square).clamp(0.0, 1.0) } else { 0.0 }
}
