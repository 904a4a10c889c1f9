//! Overlaps of an arm's body with obstacles and with itself, pair by pair.

use super::surroundings::BodyPosture;
use super::{ArmBody, PlacedBody, PlacedShape};
use sidestep_rods::Obstacles;
use sidestep_rods::geometry::{Aabb, convert_dimensions};
use std::cmp::Ordering;

/// A part of an arm that overlaps an obstacle or another part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyContact {
    /// The link of the arm that it moves with, the base being 0.
    pub link: usize,
    /// The obstacle; none of an overlap with another part.
    pub obstacle: Option<u32>,
    /// How far they overlap in m, above 0.
    pub depth_m: f64,
    /// Which two bodies overlap.
    pub(super) pair: BodyPair,
}

/// A part of an arm, and what it may overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct BodyPair {
    pub(super) part: usize,
    pub(super) other: OtherBody,
}

/// What a part may overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum OtherBody {
    /// Obstacles of this id: several may share one, as the walls of a room do.
    Obstacle(u32),
    /// Another part, by index.
    Part(usize),
}

impl BodyContact {
    /// Returns the order in which contacts are named: the deepest first, of equal ones that of the least pair.
    fn order(&self, other: &Self) -> Ordering {
        other.depth_m.total_cmp(&self.depth_m).then(self.pair.cmp(&other.pair))
    }

    /// Returns whether it is deeper than that of the same two bodies among `allowed`.
    fn exceeds(&self, allowed: &[Self]) -> bool {
        self.depth_m > allowed_depth_m(allowed, self.pair)
    }
}

/// Returns the depth that two bodies may overlap by, m.
pub(super) fn allowed_depth_m(allowed: &[BodyContact], pair: BodyPair) -> f64 {
    let same = allowed.iter().filter(|contact| contact.pair == pair);
    same.map(|contact| contact.depth_m).fold(0.0, f64::max)
}

/// Bodies around an arm that it must not enter.
#[derive(Clone, Copy)]
pub(super) struct BodyObstacles<'a, const D: usize> {
    pub(super) obstacles: &'a Obstacles<D>,
    /// Whether the arm's own parts are among them.
    pub(super) own: bool,
}

impl ArmBody {
    /// Returns all overlaps at a posture: with obstacles, and of two parts if `own` ones count. Parts that are fixed in
    /// the base never meet obstacles: they cannot get away.
    pub fn contacts<const D: usize>(
        &self,
        posture: BodyPosture<'_>,
        obstacles: &Obstacles<D>,
        own: bool,
    ) -> Vec<BodyContact> {
        let mut contacts = Vec::new();
        let around = BodyObstacles { obstacles, own };
        self.visit_contacts(&self.shapes_at(posture), around, |contact| {
            contacts.push(contact);
            false
        });
        contacts
    }

    /// Returns the deepest of [`contacts`](Self::contacts).
    pub fn deepest_contact<const D: usize>(
        &self,
        posture: BodyPosture<'_>,
        obstacles: &Obstacles<D>,
        own: bool,
    ) -> Option<BodyContact> {
        self.contacts(posture, obstacles, own).into_iter().min_by(BodyContact::order)
    }

    /// Returns the deepest of [`contacts`](Self::contacts) among those that are deeper than a contact of the same two
    /// bodies in `allowed`.
    pub fn find_deeper_contact<const D: usize>(
        &self,
        posture: BodyPosture<'_>,
        obstacles: &Obstacles<D>,
        own: bool,
        allowed: &[BodyContact],
    ) -> Option<BodyContact> {
        let contacts = self.contacts(posture, obstacles, own).into_iter();
        contacts.filter(|contact| contact.exceeds(allowed)).min_by(BodyContact::order)
    }

    /// Returns whether [`find_deeper_contact`](Self::find_deeper_contact) finds one, in less time.
    pub fn has_deeper_contact<const D: usize>(
        &self,
        posture: BodyPosture<'_>,
        obstacles: &Obstacles<D>,
        own: bool,
        allowed: &[BodyContact],
    ) -> bool {
        let around = BodyObstacles { obstacles, own };
        self.visit_contacts(&self.shapes_at(posture), around, |contact| contact.exceeds(allowed))
    }

    /// Visits all overlaps up to one for which `is_last` holds; returns whether there was one.
    fn visit_contacts<const D: usize>(
        &self,
        shapes: &[PlacedShape],
        around: BodyObstacles<'_, D>,
        mut is_last: impl FnMut(BodyContact) -> bool,
    ) -> bool {
        let mut has_ended = false;
        for (index, (part, shape)) in self.parts.iter().zip(shapes).enumerate() {
            if part.is_fixed_in_base() {
                continue;
            }
            let center = convert_dimensions(shape.center_m);
            let room = Aabb::from_points(&[center]).grown(part.radius_m);
            around.obstacles.visit(&room, |obstacle| {
                if has_ended {
                    return;
                }
                let Some(apart_m) = part.distance_m(shape, obstacle, 0.0) else { return };
                if apart_m < 0.0 {
                    let other = OtherBody::Obstacle(obstacle.id);
                    has_ended = is_last(BodyContact {
                        link: part.mount.link,
                        obstacle: Some(obstacle.id),
                        depth_m: -apart_m,
                        pair: BodyPair { part: index, other },
                    });
                }
            });
            if has_ended {
                return true;
            }
        }
        if !around.own {
            return false;
        }
        let placed = PlacedBody { body: self, shapes };
        self.pairs.iter().any(|&(a, b)| {
            let near = placed.proximity(a, b, 0.0).filter(|near| near.apart_m < 0.0);
            near.is_some_and(|near| {
                is_last(BodyContact {
                    link: self.link(a).max(self.link(b)),
                    obstacle: None,
                    depth_m: -near.apart_m,
                    pair: BodyPair { part: a, other: OtherBody::Part(b) },
                })
            })
        })
    }
}
