//! The transitions from which a simulation draws a move.

use super::grid_displacement::{FORWARD_CLASSES, GridDisplacement};
use crate::CountTable;
use crate::counts::{rounded, smooth};
use sidestep_error_models::delay::DelayModel;
use sidestep_error_models::effector::{EffectorModel, Side, Transition};

/// An effector in the form of a profile; the probabilities of each action sum to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectorProfile {
    /// Side of a box in meters, where the transitions hold for boxes of that size only.
    pub box_m: Option<f64>,
    /// The transitions of each action, by its name; the first transition is the intended one.
    pub actions: Vec<(String, Vec<ProfileTransition>)>,
    /// How often actions are delayed; `None` where the log does not say, or none was.
    pub delays: Option<DelayModel>,
    /// Actions without any event, and the transitions that were assumed for them.
    pub assumed: Vec<String>,
    /// The rule by which events became transitions.
    pub rule: String,
}

impl EffectorProfile {
    /// Returns the transitions of an action; `None` if it was not learned.
    pub fn action(&self, name: &str) -> Option<&[ProfileTransition]> {
        let found = self.actions.iter().find(|(action, _)| action == name);
        found.map(|(_, transitions)| transitions.as_slice())
    }

    /// Returns the effector `name` as a model. Standard actions that the profile leaves out never err, as in a
    /// scenario that loads it.
    ///
    /// # Panics
    /// When a path has a letter other than `F`, `B`, `L` and `R`.
    pub fn model(&self, name: &str) -> EffectorModel {
        let mut model = EffectorModel {
            name: name.into(),
            delays: self.delays.clone(),
            ..EffectorModel::perfect()
        };
        for (action, learned) in &self.actions {
            let transitions = learned.iter().map(ProfileTransition::transition).collect();
            match model.actions.iter().position(|known| known == action) {
                Some(id) => model.transitions[id] = transitions,
                None => {
                    model.actions.push(action.clone());
                    model.transitions.push(transitions);
                }
            }
        }
        model
    }
}

/// One possible result of an action.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfileTransition {
    /// Probability of the result, rounded to nine decimals.
    pub p: f64,
    /// Boxes walked, in the robot's frame: `F`, `B`, `L`, `R`; empty where it stays.
    pub path: String,
    /// Turn in degrees, a multiple of 90, + to the left.
    pub turn_deg: i32,
}

impl ProfileTransition {
    fn transition(&self) -> Transition {
        let sides = self
            .path
            .chars()
            .map(|letter| Side::from_letter(letter).expect("a path of F, B, L and R"));
        Transition {
            p: self.p,
            path: sides.collect(),
            turn: (self.turn_deg / 90).rem_euclid(4) as u8,
        }
    }
}

/// Returns the path to an outcome: ahead first, then sideways.
fn path(ahead: i32, left: i32) -> String {
    let along = if ahead < 0 { "B" } else { "F" };
    let sideways = if left < 0 { "R" } else { "L" };
    along.repeat(ahead.unsigned_abs() as usize) + &sideways.repeat(left.unsigned_abs() as usize)
}

/// Returns the name of an outcome in tables.
pub(super) fn label(outcome: &GridDisplacement) -> String {
    let path = path(outcome.ahead, outcome.left);
    match (path.as_str(), 90 * outcome.quarters) {
        ("", 0) => "stay".to_string(),
        (_, 0) => path,
        ("", turn_deg) => format!("turn {turn_deg}"),
        (_, turn_deg) => format!("{path} turn {turn_deg}"),
    }
}

/// Returns transitions for outcomes with weights; the first is the intended one.
pub(super) fn from_outcomes(
    outcomes: &[GridDisplacement],
    weights: &[f64],
    alpha: f64,
) -> Vec<ProfileTransition> {
    let mut transitions = Vec::new();
    for (outcome, p) in outcomes.iter().zip(rounded(&smooth(weights, alpha))) {
        transitions.push(ProfileTransition {
            p,
            path: path(outcome.ahead, outcome.left),
            turn_deg: 90 * outcome.quarters,
        });
    }
    transitions
}

/// Returns the transitions of one box ahead by the paper's classes; `counts` has one row and a
/// column per class. Counts outside the first five classes are spread over them in proportion.
pub(super) fn forward_transitions(counts: &CountTable, alpha: f64) -> Vec<ProfileTransition> {
    // A profile's first transition is the intended one.
    let order = [1, 0, 2, 3, 4];
    debug_assert_eq!(FORWARD_CLASSES[order[0]], "ahead");
    let ends = [(1, 0), (0, 0), (2, 0), (1, 1), (1, -1)];
    let outcomes = ends.map(|(ahead, left)| GridDisplacement { ahead, left, quarters: 0 });
    from_outcomes(&outcomes, &order.map(|class| counts.row(0)[class]), alpha)
}

/// The possible results of a commanded turn of 90 degrees.
pub(super) const TURN_CLASSES: [&str; 4] = ["turn", "stay", "overshoot", "other"];

/// Returns the index in [`TURN_CLASSES`] of a turn by `quarters` along the command.
pub(super) fn turn_class(quarters: i32) -> usize {
    match quarters {
        1 => 0,
        0 => 1,
        2 => 2,
        _ => 3,
    }
}

/// Returns the transitions of a turn, `side` being 1 for left, -1 for right; `other` is spread.
pub(super) fn turn_transitions(
    counts: &CountTable,
    row: usize,
    side: i32,
    alpha: f64,
) -> Vec<ProfileTransition> {
    let outcomes = [1, 0, 2].map(|n| GridDisplacement { ahead: 0, left: 0, quarters: n * side });
    from_outcomes(&outcomes, &counts.row(row)[..3], alpha)
}

/// Returns the transition of an action that never fails.
pub(super) fn certain_transition(outcome: GridDisplacement) -> Vec<ProfileTransition> {
    from_outcomes(&[outcome], &[1.0], 0.0)
}

/// A name other than `forward`, `left` and `right` is meant to stay.
pub(super) fn intended_displacement(action: &str) -> GridDisplacement {
    let (ahead, quarters) = match action {
        "forward" => (1, 0),
        "left" => (0, 1),
        "right" => (0, -1),
        _ => (0, 0),
    };
    GridDisplacement { ahead, left: 0, quarters }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_go_ahead_first_then_sideways() {
        assert_eq!(path(0, 0), "");
        assert_eq!(path(2, 1), "FFL");
        assert_eq!(path(-1, -2), "BRR");
    }

    #[test]
    fn what_is_in_no_class_is_spread_in_proportion() {
        let columns = FORWARD_CLASSES.map(String::from);
        let mut counts = CountTable::new("forward", &["forward".to_string()], &columns);
        for (class, weight) in [(0, 1.0), (1, 6.0), (3, 1.0), (5, 2.0)] {
            counts.add(0, class, weight);
        }
        let transitions = forward_transitions(&counts, 0.0);
        let found: Vec<_> = transitions.iter().map(|t| (t.path.as_str(), t.p)).collect();
        assert_eq!(found, [("F", 0.75), ("", 0.125), ("FF", 0.0), ("FL", 0.125), ("FR", 0.0)]);
    }

    #[test]
    fn a_right_turn_mirrors_a_left_one() {
        let columns = TURN_CLASSES.map(String::from);
        let mut counts = CountTable::new("turns", &["left".to_string()], &columns);
        counts.add(0, 0, 9.0);
        counts.add(0, 1, 1.0);
        let turns: Vec<_> =
            turn_transitions(&counts, 0, -1, 0.0).iter().map(|t| (t.turn_deg, t.p)).collect();
        assert_eq!(turns, [(-90, 0.9), (0, 0.1), (-180, 0.0)]);
    }
}
