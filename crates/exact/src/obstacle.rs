//! The obstacle rule as arithmetic: the outcomes of an action at a place, with probabilities.
//!
//! Written from the model's description alone, not from the simulator: boxes are found by
//! coordinates, where the simulator walks lists of prepared offsets. The tests compare the two.

use sidestep_error_models::effector::{ObstacleRule, Side, Transition};
use sidestep_error_models::sensor::FREE;
use std::collections::BTreeMap;

/// Place and heading of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct GridPose {
    /// Column of its lower-left box, from the west.
    pub col: i32,
    /// Row of its lower-left box, from the south.
    pub row: i32,
    /// Heading: 0 east, 1 north, 2 west, 3 south.
    pub heading: u8,
}

/// The end of an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct ActionOutcome {
    /// The pose of the body afterwards.
    pub pose: GridPose,
    /// Kind of the obstacle that stopped it, and the side of the body that touched it.
    pub contact: Option<(u8, Side)>,
}

impl GridPose {
    /// Returns the pose one box farther to `side`.
    fn shifted(self, side: Side) -> Self {
        let (dx, dy) = unit_vector(self.heading, side);
        Self { col: self.col + dx, row: self.row + dy, ..self }
    }

    fn turned(self, quarters: u8) -> Self {
        Self { heading: (self.heading + quarters) % 4, ..self }
    }

    /// Returns the boxes next to a `size` x `size` body on `side`, from left to right as seen
    /// looking that way.
    fn adjacent_boxes(self, size: u32, side: Side) -> impl Iterator<Item = (i32, i32)> {
        let last = size as i32 - 1;
        let (dx, dy) = unit_vector(self.heading, side);
        // The body's own boxes on that side lie on the line through this corner ...
        let corner = (self.col + last * i32::from(dx > 0), self.row + last * i32::from(dy > 0));
        // ... along the direction a quarter to the right, which may start at its far end.
        let (rx, ry) = (dy, -dx);
        let first =
            (corner.0 + last * i32::from(rx < 0) + dx, corner.1 + last * i32::from(ry < 0) + dy);
        (0..size as i32).map(move |k| (first.0 + k * rx, first.1 + k * ry))
    }
}

/// Returns the distribution of outcomes of an action of a `size` x `size` body at its present
/// place.
///
/// `transitions` hold in free space; `kind_at(col, row)` is the kind of a box's occupant, 0 for an
/// empty box, and does not count the body itself. Equal outcomes are merged, and sorted by their
/// poses. Probabilities are those of `transitions`, so they sum to 1 when those do.
pub fn outcome_distribution(
    transitions: &[Transition],
    size: u32,
    from: GridPose,
    rule: ObstacleRule,
    kind_at: impl Fn(i32, i32) -> u8,
) -> Vec<(ActionOutcome, f64)> {
    let possible = transitions.iter().filter(|t| t.p > 0.0);
    let walked: Vec<(ActionOutcome, f64)> =
        possible.map(|t| (walk(t, size, from, rule, &kind_at), t.p)).collect();
    match rule {
        ObstacleRule::Cut | ObstacleRule::Stay => merged(walked),
        ObstacleRule::Renormalise => renormalised(walked),
    }
}

/// Follows one path to its end, or to the first box that is not free.
fn walk(
    transition: &Transition,
    size: u32,
    from: GridPose,
    rule: ObstacleRule,
    kind_at: impl Fn(i32, i32) -> u8,
) -> ActionOutcome {
    let mut at = from;
    for &side in &transition.path {
        let met =
            at.adjacent_boxes(size, side).map(|(col, row)| kind_at(col, row)).find(|&k| k != FREE);
        if let Some(kind) = met {
            let pose = if rule == ObstacleRule::Cut { at } else { from };
            return ActionOutcome { pose, contact: Some((kind, side)) };
        }
        at = at.shifted(side);
    }
    ActionOutcome { pose: at.turned(transition.turn), contact: None }
}

/// Removes the blocked outcomes and rescales the rest; keeps the first contact when none is left.
fn renormalised(walked: Vec<(ActionOutcome, f64)>) -> Vec<(ActionOutcome, f64)> {
    let free = walked.iter().filter(|(outcome, _)| outcome.contact.is_none());
    let left: f64 = free.clone().map(|(_, p)| p).sum();
    if left > 0.0 {
        return merged(free.map(|&(outcome, p)| (outcome, p / left)).collect());
    }
    walked.first().map(|&(outcome, _)| vec![(outcome, 1.0)]).unwrap_or_default()
}

fn merged(outcomes: Vec<(ActionOutcome, f64)>) -> Vec<(ActionOutcome, f64)> {
    let mut sums = BTreeMap::new();
    for (outcome, p) in outcomes {
        *sums.entry(outcome).or_insert(0.0) += p;
    }
    sums.into_iter().collect()
}

/// A heading and a side are quarter turns to the left, so their sum is the direction in the world.
fn unit_vector(heading: u8, side: Side) -> (i32, i32) {
    match (heading + side as u8) % 4 {
        0 => (1, 0),
        1 => (0, 1),
        2 => (-1, 0),
        _ => (0, -1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beside(heading: u8, side: Side) -> Vec<(i32, i32)> {
        GridPose { col: 5, row: 7, heading }.adjacent_boxes(2, side).collect()
    }

    #[test]
    fn boxes_beside_a_body_run_from_its_left_to_its_right() {
        assert_eq!(beside(0, Side::Front), [(7, 8), (7, 7)]);
        assert_eq!(beside(1, Side::Front), [(5, 9), (6, 9)]);
        assert_eq!(beside(2, Side::Front), [(4, 7), (4, 8)]);
        assert_eq!(beside(3, Side::Front), [(6, 6), (5, 6)]);
        assert_eq!(beside(0, Side::Left), [(5, 9), (6, 9)]);
        assert_eq!(beside(0, Side::Back), [(4, 7), (4, 8)]);
        assert_eq!(beside(1, Side::Right), [(7, 8), (7, 7)]);
    }
}
