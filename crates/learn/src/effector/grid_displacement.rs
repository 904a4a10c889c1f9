//! Moves on a grid that come of a displacement in the plane.
//!
//! The simulation knows whole boxes only. A log does not say where in its box a robot was when it
//! started to move; *phase averaging* takes all places as equally likely and asks how often each
//! box is reached: a displacement of 1.2 boxes ends 1 box ahead with probability 0.8 and 2 ahead
//! with 0.2. Ahead, left and turn are averaged independently, the turn in quarters of 90 degrees.
//! *Rounding*, in contrast, puts the robot in the center of its box, and calls nearly every real
//! move perfect.

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
    let x = x.clamp(-MAX_DISPLACEMENT_BOXES, MAX_DISPLACEMENT_BOXES);
    let whole = x.round();
    if (x - whole).abs() <= INTEGER_TOLERANCE {
        return vec![(whole as i32, 1.0)];
    }
    let below = x.floor();
    let fraction = x - below;
    vec![(below as i32, 1.0 - fraction), (below as i32 + 1, fraction)]
}

/// Returns the outcomes of a displacement (boxes ahead, boxes left, quarter turns left) and their
/// probabilities, which sum to 1.
pub fn grid_displacements(ahead: f64, left: f64, quarters: f64) -> Vec<(GridDisplacement, f64)> {
    let mut outcomes = Vec::new();
    for (ahead, p_ahead) in phase_average(ahead) {
        for (left, p_left) in phase_average(left) {
            for (quarters, p_quarters) in phase_average(quarters) {
                let outcome = GridDisplacement { ahead, left, quarters };
                outcomes.push((outcome, p_ahead * p_left * p_quarters));
            }
        }
    }
    outcomes
}

/// Returns the nearest whole number, halves rounded up.
pub fn round_half_up(x: f64) -> i32 {
    (x + 0.5).floor() as i32
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
