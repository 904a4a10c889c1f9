//! The parts of a chain on the way between two postures: whether they stay apart.
//!
//! A way is bisected only where parts are nearer than they move: two parts whose gaps at both ends of a piece of the
//! way are together wider than their motion toward each other cannot meet on it (conservative advancement). A
//! stretched chain swings in a few pieces; only one that winds past itself is looked at step by step.

use super::ChainPosture;
use sidestep_kernel::interrupt;
use sidestep_rods::geometry::{
    Point, add, between_segments, distance, norm, norm_squared, scaled, sub,
};
use sidestep_rods::{Chain, contact_distance_m, part_pairs};

/// Longest move of a connector in a piece of a way before it is bisected, as a fraction of the longest rod: rods turn by
/// half a radian at most, so that their ends keep near straight lines.
const MAX_PIECE: f64 = 0.5;
/// How much longer a piece that is not bisected may be than it would be if connectors moved evenly, as a factor: on longer
/// ones they may jump.
const MAX_UNEVENNESS: f64 = 2.0;
/// Bisections of a piece, at most: one that has not come down to a step by then jumps.
const MAX_BISECTIONS: usize = 24;
/// Length that a rod has at least on a straight path, as a fraction of the lesser one at both ends of it.
const MIN_LENGTH_FRACTION: f64 = 0.5;
/// Distance of an arc from its chord, as a fraction of the squared chord over the radius; twice what it is, because rods
/// do not turn quite evenly.
const BOW_HEIGHT: f64 = 0.25;

/// The way between two postures of a chain.
pub(super) struct OwnPath<'a, F, const D: usize> {
    pub(super) chain: &'a Chain<D>,
    pub(super) from: &'a ChainPosture<D>,
    pub(super) to: &'a ChainPosture<D>,
    /// Returns the posture at a fraction of the way, if there is one.
    pub(super) posture_at: F,
    /// Whether the chain's own parts may not touch.
    pub(super) is_solid: bool,
    /// Longest move of a connector in a piece that is not bisected any more, meters.
    pub(super) step_m: f64,
    /// Longest move in a piece whose connectors go evenly from one end to the other, meters: there no jump can be hidden.
    pub(super) even_m: f64,
}

/// A piece of a way: its ends, and the fractions of the way at which they are.
#[derive(Clone, Copy)]
struct Piece<'a, const D: usize> {
    ends: [&'a [Point<D>]; 2],
    fractions: [f64; 2],
}

impl<F: Fn(f64) -> Option<ChainPosture<D>>, const D: usize> OwnPath<'_, F, D> {
    /// Returns whether all parts stay apart, from the first posture, where they are apart, to the second.
    pub(super) fn is_clear(&self) -> bool {
        let pairs = self.moving_pairs();
        let piece_m = MAX_PIECE * self.chain.max_rod_m();
        let pieces = (longest_move_m(self.from, self.to) / piece_m).ceil().max(1.0) as usize;
        let mut from = self.from.clone();
        (1..=pieces).all(|number| {
            interrupt::check();
            let fractions = [number - 1, number].map(|n| n as f64 / pieces as f64);
            let Some(to) = (self.posture_at)(fractions[1]) else { return false };
            let piece = Piece { ends: [&from, &to], fractions };
            let is_clear = pairs.iter().all(|pair| are_apart(self.chain, &to, *pair))
                && self.is_piece_clear(piece, &pairs, MAX_BISECTIONS);
            from = to;
            is_clear
        })
    }

    /// Returns the pairs of rods of which one moves, where they may not touch.
    fn moving_pairs(&self) -> Vec<[usize; 2]> {
        if !self.is_solid {
            return Vec::new();
        }
        let rods = self.chain.rods().len();
        let moves = |rod: usize| self.from[rod..rod + 2] != self.to[rod..rod + 2];
        let pairs = (0..rods).flat_map(|i| (i + 1..rods).map(move |j| [i, j]));
        pairs.filter(|[i, j]| moves(*i) || moves(*j)).collect()
    }

    /// Returns whether pairs of rods stay apart on a piece, at both of whose ends they are.
    fn is_piece_clear(&self, piece: Piece<'_, D>, pairs: &[[usize; 2]], bisections: usize) -> bool {
        let [from, to] = piece.ends;
        let bows_m = bow_heights(self.chain, piece);
        let may_meet = |pair: &&[usize; 2]| may_meet(self.chain, piece, **pair, &bows_m);
        let near: Vec<[usize; 2]> = pairs.iter().filter(may_meet).copied().collect();
        let move_m = longest_move_m(from, to);
        let even_m = self.even_m.min(MAX_UNEVENNESS * MAX_PIECE * self.chain.max_rod_m());
        if move_m <= if near.is_empty() { even_m } else { self.step_m } {
            return true;
        }
        if bisections == 0 {
            return false;
        }
        let [start, end] = piece.fractions;
        let middle = 0.5 * (start + end);
        let Some(between) = (self.posture_at)(middle) else { return false };
        let first = Piece { ends: [from, &between], fractions: [start, middle] };
        let second = Piece { ends: [&between, to], fractions: [middle, end] };
        near.iter().all(|pair| are_apart(self.chain, &between, *pair))
            && self.is_piece_clear(first, &near, bisections - 1)
            && self.is_piece_clear(second, &near, bisections - 1)
    }
}

/// Returns the longest move of a connector between two postures, meters.
pub(super) fn longest_move_m<const D: usize>(from: &[Point<D>], to: &[Point<D>]) -> f64 {
    from.iter().zip(to).map(|(a, b)| distance(*a, *b)).fold(0.0, f64::max)
}

/// Returns how far each connector may leave the straight line of its motion relative to connector 0, meters: each rod
/// before it turns on an arc. Differences of two of them bound that of connectors relative to each other.
fn bow_heights<const D: usize>(chain: &Chain<D>, piece: Piece<'_, D>) -> Vec<f64> {
    let [from, to] = piece.ends;
    let mut sum_m = 0.0;
    let mut bows_m = vec![0.0];
    for (rod, limits) in chain.rods().iter().enumerate() {
        let [start, end] = [from, to].map(|points| sub(points[rod + 1], points[rod]));
        // The limit of its length may be so tiny that the sum would lose all that came before. Between two postures a rod is
        // as long as at one of them, or somewhat shorter where the ends of the chain are held.
        let length_m = norm(start).min(norm(end));
        let shortest_m = limits.min_m.max(MIN_LENGTH_FRACTION * length_m);
        sum_m += BOW_HEIGHT * norm_squared(sub(end, start)) / shortest_m.max(f64::MIN_POSITIVE);
        bows_m.push(sum_m);
    }
    bows_m
}

/// Returns whether two rods, or connectors at their ends, may meet on a piece, at both of whose ends they are apart.
fn may_meet<const D: usize>(
    chain: &Chain<D>,
    piece: Piece<'_, D>,
    [one, other]: [usize; 2],
    bows_m: &[f64],
) -> bool {
    let [from, to] = piece.ends;
    let step = |i: usize, j: usize| norm(sub(sub(to[i], from[i]), sub(to[j], from[j])));
    let ends = [one, one + 1];
    let motion_m =
        ends.iter().flat_map(|&i| [step(i, other), step(i, other + 1)]).fold(0.0, f64::max);
    // Each end of the piece is as good a start, so half of both gaps is what is left in between.
    let spent_m = 0.5 * motion_m + bows_m[other + 1] - bows_m[one];
    let pair = [one, other];
    if 0.5 * (room_m(chain, from, pair) + room_m(chain, to, pair)) > spent_m {
        return false;
    }
    part_pairs(one, other, chain.rods().len()).any(|[first, second]| {
        let Some(keep_m) = chain.min_separation_m(first, second) else { return false };
        let gap_m = |points: &[Point<D>]| {
            between_segments(first.ends(points), second.ends(points)).distance_m
        };
        0.5 * (gap_m(from) + gap_m(to)) - spent_m <= keep_m
    })
}

/// Returns a bound on the gap between two rods, with the connectors at their ends, meters: quick to compute, and enough for
/// those that are far apart.
fn room_m<const D: usize>(chain: &Chain<D>, points: &[Point<D>], pair: [usize; 2]) -> f64 {
    let [one, other] = pair.map(|rod| scaled(add(points[rod], points[rod + 1]), 0.5));
    let reaches_m = pair.map(|rod| {
        let [low, high] = [rod, rod + 1].map(|k| chain.connectors()[k].radius_m);
        // Rods are no thicker than their connectors.
        0.5 * distance(points[rod], points[rod + 1]) + low.max(high)
    });
    distance(one, other) - reaches_m[0] - reaches_m[1]
}

/// Returns whether the parts of two rods keep their distances.
fn are_apart<const D: usize>(chain: &Chain<D>, points: &[Point<D>], pair: [usize; 2]) -> bool {
    if room_m(chain, points, pair) > 0.0 {
        return true;
    }
    part_pairs(pair[0], pair[1], chain.rods().len()).all(|[first, second]| {
        let Some(keep_m) = chain.min_separation_m(first, second) else { return true };
        let apart_m = between_segments(first.ends(points), second.ends(points)).distance_m;
        apart_m >= contact_distance_m(keep_m)
    })
}
