//! Proof ahead of time: from which connector on nothing can object to the next motions of connector 0, wherever it goes.
//!
//! No connector moves farther than connector 0 does, because each goes toward its master, or from it, by no more than
//! the master has moved. So far parts stay apart as long as their gaps are longer than all these motions.
//!
//! Parts near each other along the chain stay apart as long as their rods point forward along one direction. Where two
//! rods in a row enclose a right angle at most and the first is pulled, so is the second, as on a tow: it turns toward
//! the first, never past it, by at most the fraction `step / length` of the angle between them. Angles to a direction
//! are convex along such a turn, so rods within a cone stay within it, but for what comes down the chain from rods
//! outside of it. That fades with every rod ([`fade_rods`]), and a stretch whose rods, and so many before them, are
//! within a narrow cone stays within a slightly wider one.
//!
//! Rods that are pushed turn away from each other, and a push goes far down a straight chain. So a motion counts as
//! foreseen only if nothing is pushed from the start of the cone on, which is among the first rods
//! ([`first_cone_rod`]); then all beyond are pulled, because the angles between them are small.

use super::{
    BLOCK, MARGIN_M, STRETCH, STRIDE, SeparationBounds, block_rods, needed_gap_m, stretches,
};
use crate::chain::Chain;
use crate::geometry::{Point, dot, sub};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// Half-angle of the cone within which the rods of a stretch and those before them have to be, rad: 20 degrees. A wider
/// cone would hold more stretches, and let rods from outside of it turn by less.
const CONE_RAD: f64 = 0.349_065_850_398_865_9;
/// Square of its cosine.
const CONE_COS2: f64 = 0.883_022_221_559_489_2;
/// Angle by which rods of a stretch may leave the cone for what comes down the chain, rad: half a degree.
const MAX_FADE_RAD: f64 = 0.008_726_646_259_971_648;
/// Cosine of twice the angle of both, 41 degrees: the greatest angle between two rods of a stretch, and so between one
/// of them and the line from end to end.
const SPREAD_COS: f64 = 0.754_709_580_222_771_9;
/// Rods before a stretch that may have to be in its cone: as many as lie before the second stretch. The first one has
/// none.
const MAX_FADE_RODS: usize = 48;
/// Greatest length of a motion in lengths of the least rod, which is the sine of the angle by which a rod turns at most.
const MAX_STEP_RATIO: f64 = 0.5;
/// Least length of a rod, meters: shorter ones would turn by rounding.
const MIN_ROD_M: f64 = 1e-3;
/// Amount by which a rod may be outside its limits, meters, where it counts as within them: rounding of coordinates up
/// to 1e6 m.
pub(in super::super) const ROUNDING_M: f64 = 1e-9;

/// The next motions of connector 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct NextMotions {
    pub(in super::super) count: usize,
    /// The longest of them, meters.
    pub(in super::super) step_m: f64,
}

impl NextMotions {
    /// Returns the longest travel of any connector in one of them, meters: as far as connector 0, and as far as a rod is
    /// outside its limits.
    pub(in super::super) fn travel_m(self) -> f64 {
        self.step_m + ROUNDING_M
    }
}

impl<const D: usize> SeparationBounds<D> {
    /// Returns the least number of rods at the start of a plain chain, up to the end of a stretch, such that nothing can
    /// object to what the others do in the next motions; none if that may be more than half of them. The chain's
    /// positions are to be recorded.
    pub(in super::super) fn foresee(
        &mut self,
        chain: &Chain<D>,
        motions: NextMotions,
    ) -> Option<usize> {
        let rods = chain.rods().len();
        let min_rod_m = chain.min_rod_m();
        let spread_m = SPREAD_COS * (min_rod_m - ROUNDING_M);
        if min_rod_m < MIN_ROD_M || spread_m < chain.neighbor_separation_m() + MARGIN_M {
            return None;
        }
        let fade = fade_rods(motions.travel_m() / min_rod_m, motions.count)?;
        let mut first_rods = 0;
        for stretch in stretches(rods) {
            // The first stretch follows connector 0, which may go anywhere.
            let before = stretch.start.checked_sub(fade.max(1));
            let holds = before.is_some_and(|start| is_in_cone(chain, start..stretch.end));
            if !holds {
                first_rods = stretch.end;
            }
            if first_rods > rods / 2 {
                return None;
            }
        }
        // Both parts of a pair travel, and the boxes of blocks come nearer along each axis.
        let approach_m = 2.0 * motions.count as f64 * motions.travel_m() * (D as f64).sqrt();
        let needed_m = needed_gap_m(motions.travel_m()) + approach_m;
        // Blocks whose gaps may be used up are proven with each motion, as all of the first rods are.
        for stretch in stretches(rods) {
            let blocks = stretch.start / BLOCK..stretch.end.div_ceil(BLOCK);
            let mut later = blocks.filter(|&block| block_rods(block, rods).end > first_rods);
            if !later.all(|block| self.is_block_apart(chain, block, needed_m)) {
                first_rods = stretch.end;
            }
        }
        // A stretch that bends is proven by the gaps of its rods, which nobody knows well beside rods that lag behind.
        let first_rods = (first_rods + STRIDE).min(rods);
        (first_rods <= rods / 2).then_some(first_rods)
    }

    /// Records that connectors beyond the first rods lag behind by one more motion.
    pub(in super::super) fn add_lag(&mut self, first_rods: usize, travel_m: f64) {
        self.first_lagging_rod = first_rods;
        self.lag_m += travel_m;
    }

    /// Records that connectors from `first` on have followed where they lagged behind; their travel was counted.
    pub(in super::super) fn end_lag(&mut self, chain: &Chain<D>, first: usize) {
        self.points[first..].copy_from_slice(&chain.points()[first..]);
        self.lag_m = 0.0;
    }
}

/// Returns whether all rods of a run are within the cone around the line from its start to its end, and within their
/// limits of length.
fn is_in_cone<const D: usize>(chain: &Chain<D>, rods: Range<usize>) -> bool {
    let points = &chain.points()[rods.start..rods.end + 1];
    let along = sub(points[points.len() - 1], points[0]);
    let cone2 = CONE_COS2 * dot(along, along);
    let is_rod_in_cone = |(ends, limits): (&[Point<D>], &crate::Rod)| {
        let rod = sub(ends[1], ends[0]);
        let advance = dot(rod, along);
        let length2 = dot(rod, rod);
        let shortest_m = (limits.min_m - ROUNDING_M).max(0.0);
        let longest_m = limits.max_m + ROUNDING_M;
        // All at once, because a branch for each would take longer than the tests.
        (advance > 0.0)
            & (advance * advance >= cone2 * length2)
            & (length2 >= shortest_m * shortest_m)
            & (length2 <= longest_m * longest_m)
    };
    points.windows(2).zip(&chain.rods()[rods]).all(is_rod_in_cone)
}

/// Returns the first rod that may have to be in the cone of a stretch which ends beyond the first rods.
pub(in super::super) fn first_cone_rod(first_rods: usize) -> usize {
    let first_start = first_rods + STRIDE - STRETCH;
    first_start.saturating_sub(MAX_FADE_RODS)
}

/// Returns the number of rods after which what comes down the chain has faded, if connector 0 moves by at most
/// `step_ratio` times the least rod in each of so many motions; none if it may not have faded.
///
/// For each rod after the start of the cone the greatest angle by which it may have left the cone is carried along.
/// Whatever the first rod does, it turns by no more than its ends allow.
fn fade_rods(step_ratio: f64, motions: usize) -> Option<usize> {
    if step_ratio > MAX_STEP_RATIO {
        return None;
    }
    // No arc sine is more than this many times its sine.
    let max_turn_rad = FRAC_PI_2 * step_ratio;
    let mut left_rad = [0.0; MAX_FADE_RODS + 1];
    for _ in 0..motions {
        left_rad[0] += max_turn_rad;
        for k in 1..left_rad.len() {
            // Two rods that enclose a right angle at most.
            let is_towed = left_rad[k] + left_rad[k - 1] <= FRAC_PI_2 - 2.0 * CONE_RAD;
            left_rad[k] +=
                if is_towed { step_ratio * (left_rad[k - 1] - left_rad[k]) } else { max_turn_rad };
        }
    }
    left_rad.iter().position(|&left_rad| left_rad <= MAX_FADE_RAD)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_down_the_chain_fades_the_later_the_longer_the_motions_are() {
        assert_eq!(fade_rods(0.0, 12), Some(0));
        let short = fade_rods(0.05, 12).unwrap();
        let long = fade_rods(0.2, 12).unwrap();
        assert!(short < long, "{short} {long}");
        assert_eq!(fade_rods(0.6, 12), None);
    }
}
