//! The chain's own body: which of its parts may not touch, and how far each pair of them stays apart.
//!
//! Parts are connectors (balls) and rods (capsules). Which pairs are exempt follows from geometry alone:
//!
//! - Parts of one joint meet there in every posture: a rod and the connectors at its ends, two rods of one
//!   connector, the two connectors of a rod. Two rods of one connector cannot lie on each other, because the
//!   connector at the far end of each is kept off the other.
//! - Any other two parts keep the sum of their radii. If the rods between them can be shorter than that, the two
//!   meet even where the chain is straight; then they keep the distance that they have there.

use super::chain::{Chain, SKIN_M};
use super::geometry::{Aabb, Point, are_segments_surely_apart, distance, distance_of_segments_m};
use super::rod_bvh::RodBvh;
use super::sweep::{RodPairSweep, RodSweep};
use std::fmt::{self, Display, Formatter};
use std::ops::Range;

/// Room that parts of a chain keep to turn, meters, where the straight chain decides about their distance: rods that
/// turn keep a skin, and without this room each direction would be blocked by it.
const TURN_ROOM_M: f64 = 10.0 * SKIN_M;

/// Rounding of gaps between parts that move alike, meters.
pub(super) const ROUNDING_M: f64 = 1e-12;

/// A part of a chain; the order breaks ties.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ChainPart {
    /// The connector of this number.
    Connector(usize),
    /// The rod between a connector and the next.
    Rod(usize),
}

impl Display for ChainPart {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Connector(k) => write!(f, "connector {k}"),
            Self::Rod(i) => write!(f, "rod {i}"),
        }
    }
}

impl ChainPart {
    /// Returns the connector, or the one at the start of the rod.
    pub fn connector(self) -> usize {
        let (Self::Connector(k) | Self::Rod(k)) = self;
        k
    }

    /// Returns the connector, or the one at the end of the rod.
    pub fn last_connector(self) -> usize {
        match self {
            Self::Connector(k) => k,
            Self::Rod(i) => i + 1,
        }
    }

    /// Returns the ends of the core line of the part; for a connector its position twice.
    #[inline]
    pub fn ends<const D: usize>(self, points: &[Point<D>]) -> [Point<D>; 2] {
        [points[self.connector()], points[self.last_connector()]]
    }

    /// Returns the first and one past the last of the rods between two parts; none if they share a joint.
    #[inline]
    fn rods_between(self, other: Self) -> Option<[usize; 2]> {
        let is_first = self.connector() <= other.connector();
        let [first, second] = if is_first { [self, other] } else { [other, self] };
        let from = first.last_connector();
        let to = second.connector();
        let are_rod_ends =
            to == from + 1 && matches!([first, second], [Self::Connector(_), Self::Connector(_)]);
        (from < to && !are_rod_ends).then_some([from, to])
    }

    /// Returns whether two parts are so near along the chain that a motion of one nearly always moves the other: one
    /// rod is between them, or two between two connectors.
    #[inline]
    pub(super) fn is_near_along_chain(self, other: Self) -> bool {
        let are_connectors = matches!([self, other], [Self::Connector(_), Self::Connector(_)]);
        let most = if are_connectors { 2 } else { 1 };
        self.rods_between(other).is_none_or(|[from, to]| to - from <= most)
    }
}

/// The two parts of a chain that are nearest to each other among those that may not touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestOwnParts {
    /// The parts, that of lower order first.
    pub parts: [ChainPart; 2],
    /// Gap between them beyond the distance that they keep, meters; negative where they overlap.
    pub gap_m: f64,
}

impl<const D: usize> Chain<D> {
    /// Returns the radius of a part, meters.
    #[inline]
    pub fn part_radius_m(&self, part: ChainPart) -> f64 {
        match part {
            ChainPart::Connector(k) => self.connectors()[k].radius_m,
            ChainPart::Rod(i) => self.rods()[i].radius_m,
        }
    }

    /// Returns the least distance that the core lines of two parts keep, meters; none if they share a joint.
    #[inline]
    pub fn min_separation_m(&self, one: ChainPart, other: ChainPart) -> Option<f64> {
        let [from, to] = one.rods_between(other)?;
        let touching_m = self.part_radius_m(one) + self.part_radius_m(other);
        let mut straight_m = -TURN_ROOM_M;
        for rod in &self.rods()[from..to] {
            straight_m += rod.min_m;
            // Far along the chain the first rods already make room for both.
            if straight_m >= touching_m {
                return Some(touching_m);
            }
        }
        // Rods that can close leave their neighbors no room at all: these meet as if they had a joint.
        (straight_m > 0.0).then_some(straight_m)
    }

    /// Returns the gap of two parts beyond the distance that they keep, meters, where the connectors are at `points`;
    /// none if they share a joint.
    pub fn own_gap_m(&self, points: &[Point<D>], [one, other]: [ChainPart; 2]) -> Option<f64> {
        let separation_m = self.min_separation_m(one, other)?;
        Some(distance_of_segments_m(one.ends(points), other.ends(points)) - separation_m)
    }

    /// Returns the box around a rod and the connectors at its ends, which are at `ends`, grown by `by_m`.
    #[inline]
    pub(super) fn rod_bounds(&self, rod: usize, ends: [Point<D>; 2], by_m: f64) -> Aabb<D> {
        let [low, high] = [rod, rod + 1].map(|k| self.connectors()[k].radius_m);
        // Rods are no thicker than their connectors. A box that shrinks to less than its core line would miss parts.
        Aabb::from_points(&ends).grown((low.max(high) + by_m).max(0.0))
    }
}

/// Returns the pairs of parts that two rods stand for, `first` before `second`: each rod stands for the connector at
/// its start as well, and the last rod of the chain for the one at its end, so that no pair is missed or comes twice.
pub fn part_pairs(
    first: usize,
    second: usize,
    rods: usize,
) -> impl Iterator<Item = [ChainPart; 2]> {
    let parts_of = move |rod: usize| {
        let end = (rod + 1 == rods).then_some(ChainPart::Connector(rod + 1));
        [Some(ChainPart::Rod(rod)), Some(ChainPart::Connector(rod)), end].into_iter().flatten()
    };
    parts_of(first).flat_map(move |one| parts_of(second).map(move |other| [one, other]))
}

/// Returns the nearest two of a chain's parts that may not touch, if their gap is less than `within_m`; of equal ones
/// the first in order. `tree` is a buffer.
pub fn nearest_own_parts<const D: usize>(
    chain: &Chain<D>,
    tree: &mut RodBvh<D>,
    within_m: f64,
) -> Option<NearestOwnParts> {
    let mut nearest: Option<NearestOwnParts> = None;
    visit_near_parts(chain, tree, within_m, |found| {
        nearest = Some(found);
        found.gap_m
    });
    nearest
}

/// Returns the two parts that overlap most, by more than `tolerance_m` and deeper than where the connectors were at
/// `before`; of equal ones the first in order. `tree` is a buffer.
pub(super) fn deepest_new_overlap<const D: usize>(
    chain: &Chain<D>,
    before: &[Point<D>],
    tree: &mut RodBvh<D>,
    tolerance_m: f64,
) -> Option<NearestOwnParts> {
    let mut deepest: Option<NearestOwnParts> = None;
    visit_near_parts(chain, tree, -tolerance_m, |found| {
        let was_m = chain.own_gap_m(before, found.parts).unwrap_or(0.0);
        let is_deeper = found.gap_m < was_m - ROUNDING_M;
        if is_deeper && deepest.is_none_or(|deepest| found.gap_m < deepest.gap_m) {
            deepest = Some(found);
        }
        -tolerance_m
    });
    deepest
}

/// Visits the pairs of a chain's parts that may not touch and have a gap of less than `within_m`, in order; `visit`
/// returns the gap below which others are of interest.
fn visit_near_parts<const D: usize>(
    chain: &Chain<D>,
    tree: &mut RodBvh<D>,
    within_m: f64,
    mut visit: impl FnMut(NearestOwnParts) -> f64,
) {
    let points = chain.points();
    let rods = chain.rods().len();
    let ends = |rod: usize| ChainPart::Rod(rod).ends(points);
    tree.refit((0..rods).map(|rod| chain.rod_bounds(rod, ends(rod), 0.0)));
    let mut within_m = within_m;
    for rod in 0..rods {
        let near = chain.rod_bounds(rod, ends(rod), within_m);
        tree.visit(&near, |other| {
            if other < rod {
                return;
            }
            for parts in part_pairs(rod, other, rods) {
                let Some(separation_m) = chain.min_separation_m(parts[0], parts[1]) else {
                    continue;
                };
                let one = parts[0].ends(points);
                let other = parts[1].ends(points);
                // Of most pairs in the boxes a bound says enough, which takes much less time than the distance.
                if are_segments_surely_apart(one, other, separation_m + within_m) {
                    continue;
                }
                let gap_m = distance_of_segments_m(one, other) - separation_m;
                if gap_m < within_m {
                    within_m = visit(NearestOwnParts { parts: sorted(parts), gap_m });
                }
            }
        });
    }
}

fn sorted([one, other]: [ChainPart; 2]) -> [ChainPart; 2] {
    if one.connector() <= other.connector() { [one, other] } else { [other, one] }
}

/// A motion of a chain, in which every connector goes straight from one place to another.
pub(super) struct ChainSweep<'a, const D: usize> {
    pub(super) chain: &'a Chain<D>,
    pub(super) from: &'a [Point<D>],
    /// The connectors that move, and their places after the motion.
    pub(super) moved: Range<usize>,
    pub(super) to: &'a [Point<D>],
}

impl<const D: usize> ChainSweep<'_, D> {
    fn position(&self, k: usize) -> Point<D> {
        if self.moved.contains(&k) { self.to[k - self.moved.start] } else { self.from[k] }
    }

    fn part_sweep(&self, part: ChainPart) -> RodSweep<D> {
        let to = [part.connector(), part.last_connector()].map(|k| self.position(k));
        RodSweep { from: part.ends(self.from), to }
    }

    /// Returns two parts that would pass through each other, or come nearer to it than [`RodPairSweep::is_clear`]
    /// allows; the first in order. `tree` holds the rods where they are after the motion.
    pub(super) fn find_passage(&self, tree: &RodBvh<D>) -> Option<[ChainPart; 2]> {
        let moves = self.to.iter().zip(&self.from[self.moved.clone()]);
        let longest_m = moves.map(|(to, from)| distance(*to, *from)).fold(0.0, f64::max);
        let rods = self.moved.start.saturating_sub(1)..self.moved.end.min(self.chain.rods().len());
        let mut found: Option<[ChainPart; 2]> = None;
        for rod in rods.clone() {
            let RodSweep { from, to } = self.part_sweep(ChainPart::Rod(rod));
            let near = Aabb::from_points(&[from[0], from[1], to[0], to[1]])
                .grown(longest_m + self.chain.part_radius_m(ChainPart::Rod(rod)));
            tree.visit(&near, |other| {
                // Of two that move, the lower one visits the other.
                let is_visited = other <= rod && rods.contains(&other);
                if found.is_none() && !is_visited {
                    found = self.passing_parts(rod, other);
                }
            });
            if found.is_some() {
                break;
            }
        }
        found
    }

    /// Returns the parts of two rods that would pass through each other.
    fn passing_parts(&self, rod: usize, other: usize) -> Option<[ChainPart; 2]> {
        let low = rod.min(other);
        let high = rod.max(other);
        let rods = [ChainPart::Rod(low), ChainPart::Rod(high)];
        if high > low + 1 {
            return self.passes(rods).then_some(rods);
        }
        // Two rods of one connector pass through each other where the far end of one passes the other.
        let ends = [
            [ChainPart::Connector(low), ChainPart::Rod(high)],
            [ChainPart::Rod(low), ChainPart::Connector(high + 1)],
        ];
        ends.into_iter().find(|parts| self.passes(*parts))
    }

    fn passes(&self, [one, other]: [ChainPart; 2]) -> bool {
        let Some(separation_m) = self.chain.min_separation_m(one, other) else { return false };
        let pair = RodPairSweep { one: self.part_sweep(one), other: self.part_sweep(other) };
        !pair.is_clear(separation_m)
    }
}

/// Returns whether two parts of a chain stay apart on their way when every connector goes straight from `before` to
/// `after`; see [`find_own_passage`].
pub fn is_own_path_clear<const D: usize>(
    chain: &Chain<D>,
    [before, after]: [&[Point<D>]; 2],
    parts: [ChainPart; 2],
) -> bool {
    let moved = 0..after.len();
    !ChainSweep { chain, from: before, moved, to: after }.passes(parts)
}

/// Returns two parts of a chain that pass through each other, or nearly so, when every connector goes straight from
/// `before` to its present place; the first in order. `tree` is a buffer.
///
/// `before` has one point for every connector.
pub fn find_own_passage<const D: usize>(
    chain: &Chain<D>,
    before: &[Point<D>],
    tree: &mut RodBvh<D>,
) -> Option<[ChainPart; 2]> {
    let points = chain.points();
    let ends = |rod: usize| ChainPart::Rod(rod).ends(points);
    tree.refit((0..chain.rods().len()).map(|rod| chain.rod_bounds(rod, ends(rod), 0.0)));
    let moved = 0..points.len();
    ChainSweep { chain, from: before, moved, to: points }.find_passage(tree)
}

#[cfg(test)]
mod tests;
