//! The check of a straight path of an arm's joints.
//!
//! The posture in the middle of a piece of a path tells how far each pair of bodies is apart there. A pair that is
//! farther apart than its bodies can travel against each other on half of the piece is apart on all of it. The other
//! pairs are checked on both halves in the same way, down to pieces so short that the middle counts for all of them.
//! Free paths so take few postures where nothing is near, and blocked ones are mostly found at the first ones.
//!
//! Source: Schwarzer, Saha and Latombe, "Adaptive dynamic collision checking for single and multiple articulated robots
//! in complex environments", IEEE Transactions on Robotics 21, 2005.

use super::contacts::{BodyContact, BodyPair, OtherBody, allowed_depth_m};
use super::surroundings::BodyPosture;
use super::travel::BodyTravel;
use super::{ArmBody, PlacedBody, PlacedShape};
use sidestep_kernel::interrupt;
use sidestep_rods::geometry::{Aabb, convert_dimensions};
use sidestep_rods::{Obstacle, Obstacles};
use std::collections::VecDeque;
use std::rc::Rc;

/// Distance in m that is added to bounds: far more than the error of distances.
const DISTANCE_TOLERANCE_M: f64 = 1e-6;

/// What an arm's body must not enter on a path.
pub struct BodyPathCheck<'a, const D: usize> {
    /// The body of the arm.
    pub body: &'a ArmBody,
    /// Bounds on the travel of its parts.
    pub travel: &'a BodyTravel,
    /// The start of the path.
    pub start: BodyPosture<'a>,
    /// The obstacles around it.
    pub obstacles: &'a Obstacles<D>,
    /// Whether its own parts must not touch either.
    pub own: bool,
    /// Overlaps that may stay as deep as they are.
    pub allowed: &'a [BodyContact],
}

/// Two bodies that may touch on a piece of a path.
#[derive(Clone, Copy)]
enum NearPair<const D: usize> {
    Obstacle { part: usize, obstacle: Obstacle<D> },
    Own { a: usize, b: usize },
}

/// A piece of a path, and the pairs that may touch on it.
struct Piece<const D: usize> {
    /// Its middle, as a fraction of the path.
    middle: f64,
    /// Half of its length, as a fraction of the path.
    half: f64,
    pairs: Rc<[NearPair<D>]>,
}

impl<const D: usize> BodyPathCheck<'_, D> {
    /// Returns whether all of the straight path to joint values is free, with pieces of 1/`steps` of it at the shortest.
    pub fn is_free(&self, to: &[f64], steps: usize) -> bool {
        let shortest = 1.0 / steps as f64;
        let from = self.start.values;
        let changes: Vec<f64> = from.iter().zip(to).map(|(from, to)| to - from).collect();
        let mut shapes = Vec::new();
        self.place_shapes(&changes, 0.5, &mut shapes);
        let pairs = self.pairs_near(&changes, &shapes);
        let mut pieces = VecDeque::from([Piece { middle: 0.5, half: 0.5, pairs }]);
        while let Some(Piece { middle, half, pairs }) = pieces.pop_front() {
            interrupt::check();
            self.place_shapes(&changes, middle, &mut shapes);
            let mut near = Vec::new();
            for pair in pairs.iter() {
                let travel_m = half * self.travel_m(pair, &changes) + DISTANCE_TOLERANCE_M;
                let Some(apart_m) = self.apart_m(pair, &shapes, travel_m) else { continue };
                if -apart_m > allowed_depth_m(self.allowed, pair.body_pair()) {
                    return false;
                }
                near.push(*pair);
            }
            // Both halves of a piece of the least length would be shorter than the least.
            if near.is_empty() || 2.0 * half <= shortest {
                continue;
            }
            let half = 0.5 * half;
            let pairs: Rc<[NearPair<D>]> = near.into();
            for middle in [middle - half, middle + half] {
                pieces.push_back(Piece { middle, half, pairs: Rc::clone(&pairs) });
            }
        }
        true
    }

    fn place_shapes(&self, changes: &[f64], fraction: f64, shapes: &mut Vec<PlacedShape>) {
        let from = self.start.values.iter();
        let values: Vec<f64> =
            from.zip(changes).map(|(from, change)| from + fraction * change).collect();
        let posture = BodyPosture { values: &values, ..self.start };
        self.body.place_shapes_at(posture, shapes);
    }

    /// Returns the pairs that may touch anywhere on the path, the shapes being those of its middle.
    fn pairs_near(&self, changes: &[f64], shapes: &[PlacedShape]) -> Rc<[NearPair<D>]> {
        let mut pairs = Vec::new();
        for (index, (part, shape)) in self.body.parts.iter().zip(shapes).enumerate() {
            if part.is_fixed_in_base() {
                continue;
            }
            let travel_m = 0.5 * self.travel.part_m(index, changes) + DISTANCE_TOLERANCE_M;
            let center = convert_dimensions(shape.center_m);
            let room = Aabb::from_points(&[center]).grown(part.radius_m + travel_m);
            self.obstacles.visit(&room, |obstacle| {
                pairs.push(NearPair::Obstacle { part: index, obstacle: *obstacle });
            });
        }
        if self.own {
            pairs.extend(self.body.pairs.iter().map(|&(a, b)| NearPair::Own { a, b }));
        }
        pairs.into()
    }

    /// Returns a bound on the travel in m of the bodies of a pair against each other, on all of the path.
    fn travel_m(&self, pair: &NearPair<D>, changes: &[f64]) -> f64 {
        match *pair {
            NearPair::Obstacle { part, .. } => self.travel.part_m(part, changes),
            NearPair::Own { a, b } => self.travel.pair_m(a, b, changes),
        }
    }

    /// Returns the distance of the bodies of a pair in m, if it is at most `within_m`.
    fn apart_m(&self, pair: &NearPair<D>, shapes: &[PlacedShape], within_m: f64) -> Option<f64> {
        match pair {
            NearPair::Obstacle { part, obstacle } => {
                self.body.parts[*part].distance_m(&shapes[*part], obstacle, within_m)
            }
            NearPair::Own { a, b } => {
                let placed = PlacedBody { body: self.body, shapes };
                placed.proximity(*a, *b, within_m).map(|near| near.apart_m)
            }
        }
    }
}

impl<const D: usize> NearPair<D> {
    fn body_pair(&self) -> BodyPair {
        match *self {
            Self::Obstacle { part, obstacle } => {
                BodyPair { part, other: OtherBody::Obstacle(obstacle.id) }
            }
            Self::Own { a, b } => BodyPair { part: a, other: OtherBody::Part(b) },
        }
    }
}
