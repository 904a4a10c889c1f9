//! Moves on a grid that come of a displacement in the plane.
//!
//! The simulation knows whole boxes only. A log does not say where in its box a robot was when it
//! started to move; *phase averaging* takes all places as equally likely and asks how often each
//! box is reached: a displacement of 1.2 boxes ends 1 box ahead with probability 0.8 and 2 ahead
//! with 0.2. Ahead, left and turn are averaged independently, the turn in quarters of 90 degrees.
//! *Rounding*, in contrast, puts the robot in the center of its box, and calls nearly every real
//! move perfect.

use std::collections::BTreeMap;

use serde::Serialize;

/// The end of a displacement, in whole boxes and quarter turns of the start frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct GridDisplacement {
    /// Boxes ahead; below 0 behind.
    pub ahead: i32,
    /// Boxes to the left; below 0 to the right.
    pub left: i32,
    /// Number of quarter turns (90 degrees) to the left.
    pub quarters: i32,
}

/// A number this close to a whole one counts as whole, because text files round.
const INTEGER_TOLERANCE: f64 = 1e-6;

/// Displacements beyond this number of boxes count as this one: no map is as large, and a log with poses that
/// jump like that must not make numbers overflow.
const MAX_DISPLACEMENT_BOXES: f64 = 1e9;

/// Returns the two whole numbers around `x` and their probabilities; one alone where `x` is whole.
pub fn phase_average(x: f64) -> Vec<(i32, f64)> {
    PhaseShares::new(x).as_slice().to_vec()
}

/// The whole numbers around a number and their probabilities, without an allocation: there are millions.
#[derive(Debug, Clone, Copy)]
pub(super) struct PhaseShares {
    shares: [(i32, f64); 2],
    count: usize,
}

impl PhaseShares {
    #[inline]
    pub(super) fn new(x: f64) -> Self {
        let x = x.clamp(-MAX_DISPLACEMENT_BOXES, MAX_DISPLACEMENT_BOXES);
        let below = floor(x);
        let fraction = x - f64::from(below);
        if fraction <= INTEGER_TOLERANCE {
            return Self { shares: [(below, 1.0), (0, 0.0)], count: 1 };
        }
        if f64::from(below + 1) - x <= INTEGER_TOLERANCE {
            return Self { shares: [(below + 1, 1.0), (0, 0.0)], count: 1 };
        }
        Self { shares: [(below, 1.0 - fraction), (below + 1, fraction)], count: 2 }
    }

    #[inline]
    pub(super) fn as_slice(&self) -> &[(i32, f64)] {
        &self.shares[..self.count]
    }
}

/// Returns the outcomes of a displacement (boxes ahead, boxes left, quarter turns left) and their
/// probabilities, which sum to 1.
pub fn grid_displacements(ahead: f64, left: f64, quarters: f64) -> Vec<(GridDisplacement, f64)> {
    let mut outcomes = Vec::new();
    let displacement = [ahead, left, quarters];
    visit_outcomes(displacement, &mut |outcome, p| outcomes.push((outcome, p)));
    outcomes
}

/// Visits the outcomes of a displacement (boxes ahead, boxes left, quarter turns left) with their probabilities, in the
/// order of [`grid_displacements`].
#[inline]
pub(super) fn visit_outcomes(
    [ahead, left, quarters]: [f64; 3],
    visit: &mut impl FnMut(GridDisplacement, f64),
) {
    let aheads = PhaseShares::new(ahead);
    let lefts = PhaseShares::new(left);
    let turns = PhaseShares::new(quarters);
    for &(ahead, p_ahead) in aheads.as_slice() {
        for &(left, p_left) in lefts.as_slice() {
            for &(quarters, p_quarters) in turns.as_slice() {
                visit(GridDisplacement { ahead, left, quarters }, p_ahead * p_left * p_quarters);
            }
        }
    }
}

/// Boxes up to this distance ahead or to a side have a place of their own in sums.
const NEAR_BOXES: i32 = 9;
const NEAR_SIDE: usize = 2 * NEAR_BOXES as usize + 1;
/// Quarter turns -1, 0, 1 and 2.
const NEAR_TURNS: usize = 4;

/// Sums of weights by outcome. Nearly all moves end a few boxes away, so these are found by their place; others by name.
#[derive(Debug, Clone)]
pub(super) struct OutcomeSums {
    near: Vec<f64>,
    far: BTreeMap<GridDisplacement, f64>,
}

impl OutcomeSums {
    pub(super) fn new() -> Self {
        Self { near: vec![0.0; NEAR_SIDE * NEAR_SIDE * NEAR_TURNS], far: BTreeMap::new() }
    }

    /// Adds a weight above 0 to the sum of an outcome.
    #[inline]
    pub(super) fn add(&mut self, outcome: GridDisplacement, weight: f64) {
        match near_place(outcome) {
            Some(place) => self.near[place] += weight,
            None => *self.far.entry(outcome).or_insert(0.0) += weight,
        }
    }

    /// Returns the outcomes that have a sum, in order.
    pub(super) fn into_sorted(self) -> BTreeMap<GridDisplacement, f64> {
        let mut sums = self.far;
        for (place, &sum) in self.near.iter().enumerate() {
            if sum > 0.0 {
                sums.insert(near_outcome(place), sum);
            }
        }
        sums
    }
}

#[inline]
fn near_place(outcome: GridDisplacement) -> Option<usize> {
    let GridDisplacement { ahead, left, quarters } = outcome;
    let is_near = ahead.unsigned_abs() <= NEAR_BOXES as u32
        && left.unsigned_abs() <= NEAR_BOXES as u32
        && (-1..3).contains(&quarters);
    let along = |boxes: i32| (boxes + NEAR_BOXES) as usize;
    is_near.then(|| (along(ahead) * NEAR_SIDE + along(left)) * NEAR_TURNS + (quarters + 1) as usize)
}

fn near_outcome(place: usize) -> GridDisplacement {
    let boxes = place / NEAR_TURNS;
    let along = |index: usize| index as i32 - NEAR_BOXES;
    GridDisplacement {
        ahead: along(boxes / NEAR_SIDE),
        left: along(boxes % NEAR_SIDE),
        quarters: (place % NEAR_TURNS) as i32 - 1,
    }
}

/// The columns of a table of outcomes, found by their place like [`OutcomeSums`].
#[derive(Debug, Clone)]
pub(super) struct OutcomeColumns {
    near: Vec<Option<u32>>,
    far: BTreeMap<GridDisplacement, u32>,
}

impl OutcomeColumns {
    pub(super) fn new(outcomes: &[GridDisplacement]) -> Self {
        let near = vec![None; NEAR_SIDE * NEAR_SIDE * NEAR_TURNS];
        let mut columns = Self { near, far: BTreeMap::new() };
        for (column, &outcome) in (0_u32..).zip(outcomes) {
            match near_place(outcome) {
                Some(place) => columns.near[place] = Some(column),
                None => drop(columns.far.insert(outcome, column)),
            }
        }
        columns
    }

    /// Returns the column of an outcome; `None` where the table has none for it.
    #[inline]
    pub(super) fn find(&self, outcome: GridDisplacement) -> Option<usize> {
        let column = match near_place(outcome) {
            Some(place) => self.near[place],
            None => self.far.get(&outcome).copied(),
        };
        column.map(|column| column as usize)
    }
}

/// Returns the nearest whole number, halves rounded up.
pub fn round_half_up(x: f64) -> i32 {
    floor(x + 0.5)
}

/// Returns the greatest whole number up to a number; beyond 32 bits the last one of these. A conversion there and back is
/// a fraction of the cost of [`f64::floor`].
#[inline]
fn floor(x: f64) -> i32 {
    let toward_zero = x as i32;
    toward_zero.saturating_sub(i32::from(f64::from(toward_zero) > x))
}

/// The possible results of one box ahead: the five transitions of the paper's action "go one box ahead", and all others.
pub const FORWARD_CLASSES: [&str; 6] =
    ["stay", "ahead", "ahead2", "ahead_left", "ahead_right", "other"];

/// Index in [`FORWARD_CLASSES`] of all results that the paper does not have.
pub(super) const OTHER_CLASS: usize = 5;

/// Returns the index of the class of a move in [`FORWARD_CLASSES`].
pub fn forward_class(ahead: i32, left: i32) -> usize {
    match (ahead, left) {
        (0, 0) => 0,
        (1, 0) => 1,
        (2, 0) => 2,
        (1, 1) => 3,
        (1, -1) => 4,
        _ => OTHER_CLASS,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_displacement_beyond_all_maps_ends_at_the_farthest_box() {
        for (x, end) in [(4.4e12, 1_000_000_000), (-2_147_483_647.5, -1_000_000_000)] {
            assert_eq!(phase_average(x), [(end, 1.0)]);
            assert_eq!(
                grid_displacements(x, -x, 0.0)[0].0,
                GridDisplacement { ahead: end, left: -end, quarters: 0 }
            );
        }
    }

    #[test]
    fn a_displacement_is_shared_by_the_boxes_around_its_end() {
        let shares = grid_displacements(1.25, -0.5, 0.0);
        let share = |ahead, left| {
            let wanted = GridDisplacement { ahead, left, quarters: 0 };
            shares.iter().find(|(outcome, _)| *outcome == wanted).unwrap().1
        };
        assert_eq!(shares.len(), 4);
        assert_eq!((share(1, -1), share(1, 0)), (0.375, 0.375));
        assert_eq!((share(2, -1), share(2, 0)), (0.125, 0.125));
    }

    #[test]
    fn whole_boxes_are_certain() {
        assert_eq!(phase_average(1.0), [(1, 1.0)]);
        assert_eq!(phase_average(-1.000_000_01), [(-1, 1.0)]);
        assert_eq!(
            grid_displacements(0.0, 0.0, -1.0),
            [(GridDisplacement { ahead: 0, left: 0, quarters: -1 }, 1.0)]
        );
    }

    #[test]
    fn halves_round_up_as_the_rule_says() {
        assert_eq!([0.5, 1.49, -0.5, -0.51].map(round_half_up), [1, 1, 0, -1]);
    }
}
