//! An effector learned from displacements that were already measured.

use std::collections::BTreeMap;

use super::events::{Events, MoveEvent, TurnEvent, nearest_turn};
use super::grid_displacement::{
    FORWARD_CLASSES, GridDisplacement, OTHER_CLASS, forward_class, grid_displacements,
};
use super::report::{EffectorReport, ForwardShares};
use super::rows::{self, MeasuredDisplacement, ParsedRows};
use super::transitions::{
    EffectorProfile, ProfileTransition, certain_transition, from_outcomes, intended_displacement,
    label,
};
use super::{EffectorOptions, LearnedEffector};
use crate::holdout::{HoldoutTest, holdout_test, split, tests_by_parts};
use crate::{CountTable, EstimateOptions};
use sidestep_error_models::effector::STANDARD_ACTIONS;
use sidestep_import::table::CsvTable;
use sidestep_kernel::InputError;

/// The rule by which events become transitions.
const RULE: &str = "counts of measured displacements, phase-averaged where they are no whole \
    boxes or quarter turns; every outcome that was seen, plus alpha";

impl MeasuredDisplacement {
    /// Returns where it ends; turns that end alike, such as 270 and -90 degrees, are one outcome.
    fn outcomes(&self) -> Vec<(GridDisplacement, f64)> {
        let mut ends = grid_displacements(self.ahead_boxes, self.left_boxes, self.turn_deg / 90.0);
        for (outcome, _) in &mut ends {
            // Quarters -1 (right), 0, 1 (left) and 2 (back).
            outcome.quarters = (outcome.quarters + 1).rem_euclid(4) - 1;
        }
        ends
    }

    fn as_move(&self) -> MoveEvent {
        MoveEvent {
            robot: self.robot,
            ahead_boxes: self.ahead_boxes,
            left_boxes: self.left_boxes,
            turn_error_rad: nearest_turn(0.0, self.turn_deg.to_radians()),
            duration_s: None,
        }
    }

    fn as_turn(&self) -> TurnEvent {
        let commanded_deg =
            f64::from(90 * intended_displacement(STANDARD_ACTIONS[self.action]).quarters);
        let turn = TurnEvent::new(commanded_deg.to_radians(), self.turn_deg.to_radians(), None);
        TurnEvent { robot: self.robot, ..turn }
    }
}

pub(super) fn learn(
    table: &CsvTable,
    options: &EffectorOptions,
) -> Result<LearnedEffector, InputError> {
    let ParsedRows { free, rejected, damage, effector, box_m } = rows::parse(table, options)?;
    let by_action: Vec<ActionLog> = (0..STANDARD_ACTIONS.len())
        .map(|action| ActionLog::from_displacements(&free, action))
        .collect();
    let estimate = &options.estimate;
    let mut report = report(table.place(), &by_action, estimate);
    report.effector = effector;
    report.box_m = box_m;
    report.rejected = rejected;
    if let Some(n_cut) = report.rejected.get("contact") {
        report.warnings.push(format!(
            "{n_cut} actions met an obstacle and were left out: near obstacles the outcomes that \
             lead into them are seen too rarely, so learn in the open"
        ));
    }
    report.warnings.extend(damage);
    report.judge_left_out(free.len() as u64);
    Ok(LearnedEffector {
        report,
        profile: EffectorProfile { box_m, ..profile(&by_action, estimate) },
    })
}

/// The events of one action and the outcomes they had.
struct ActionLog {
    action: &'static str,
    events: Vec<MeasuredDisplacement>,
    /// The intended outcome, then the others, the more frequent first.
    outcomes: Vec<GridDisplacement>,
}

impl ActionLog {
    fn from_displacements(all: &[MeasuredDisplacement], action: usize) -> Self {
        let events: Vec<MeasuredDisplacement> =
            all.iter().filter(|e| e.action == action).copied().collect();
        let mut weights: BTreeMap<GridDisplacement, f64> = BTreeMap::new();
        for (outcome, weight) in events.iter().flat_map(MeasuredDisplacement::outcomes) {
            *weights.entry(outcome).or_insert(0.0) += weight;
        }
        // Infinite, so that the intended outcome comes first whether or not it was seen.
        weights.insert(intended_displacement(STANDARD_ACTIONS[action]), f64::INFINITY);
        let mut ranked: Vec<(GridDisplacement, f64)> = weights.into_iter().collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        let outcomes = ranked.into_iter().map(|(outcome, _)| outcome).collect();
        Self { action: STANDARD_ACTIONS[action], events, outcomes }
    }

    fn counts<'e>(&self, events: impl IntoIterator<Item = &'e MeasuredDisplacement>) -> CountTable {
        let columns: Vec<String> = self.outcomes.iter().map(label).collect();
        let mut counts = CountTable::new("actions", &[self.action.to_string()], &columns);
        for (outcome, weight) in events.into_iter().flat_map(MeasuredDisplacement::outcomes) {
            let column = self.outcomes.iter().position(|known| *known == outcome);
            counts.add(0, column.expect("outcomes were collected from all events"), weight);
        }
        counts
    }

    fn holdout_tests(&self, options: &EstimateOptions) -> Vec<HoldoutTest> {
        let (train, held) = split(&self.events, options.hold_out_every);
        let mut fits = vec![holdout_test(&self.counts(train), &self.counts(held), options.alpha)];
        let count = |events: &[&MeasuredDisplacement]| self.counts(events.iter().copied());
        fits.extend(tests_by_parts(&self.events, |e| e.robot, count, options.alpha));
        fits.iter_mut().for_each(|fit| fit.table = self.action.to_string());
        fits
    }

    fn transitions(&self, alpha: f64, assumed: &mut Vec<String>) -> Vec<ProfileTransition> {
        if self.events.is_empty() {
            assumed.push(format!("{}: never fails", self.action));
            return certain_transition(intended_displacement(self.action));
        }
        from_outcomes(&self.outcomes, self.counts(&self.events).row(0), alpha)
    }

    /// Returns the shares of the paper's classes.
    fn forward_shares(&self) -> Option<ForwardShares> {
        let mut shares = vec![0.0; FORWARD_CLASSES.len()];
        for (outcome, weight) in self.events.iter().flat_map(MeasuredDisplacement::outcomes) {
            let class = if outcome.quarters == 0 {
                forward_class(outcome.ahead, outcome.left)
            } else {
                OTHER_CLASS
            };
            shares[class] += weight;
        }
        ForwardShares::from_counts(&shares)
    }
}

fn report(source: &str, logs: &[ActionLog], options: &EstimateOptions) -> EffectorReport {
    let [forward, left, right, _] = logs else { unreachable!("one log per action") };
    let events = Events {
        moves: forward.events.iter().map(MeasuredDisplacement::as_move).collect(),
        turns: left.events.iter().chain(&right.events).map(MeasuredDisplacement::as_turn).collect(),
    };
    let seen: Vec<&ActionLog> = logs.iter().filter(|log| !log.events.is_empty()).collect();
    let tables: Vec<CountTable> = seen.iter().map(|log| log.counts(&log.events)).collect();
    EffectorReport {
        transitions: forward.forward_shares(),
        actions: tables.iter().map(by_name).collect(),
        probabilities: tables.iter().flat_map(CountTable::estimates).collect(),
        thin: tables.iter().flat_map(|table| table.low_count_rows(options.thin_below)).collect(),
        hold_out: seen.iter().flat_map(|log| log.holdout_tests(options)).collect(),
        ..events.report(source, options)
    }
}

/// Returns the outcomes of a table's only row, by name.
fn by_name(table: &CountTable) -> (String, BTreeMap<String, f64>) {
    let named = table.columns().iter().cloned().zip(table.row(0).iter().copied());
    (table.rows()[0].clone(), named.collect())
}

fn profile(logs: &[ActionLog], options: &EstimateOptions) -> EffectorProfile {
    let mut assumed = Vec::new();
    let mut actions = Vec::new();
    for log in logs {
        // Few logs have the action `stay`; a profile without it stands still without error, so it is not assumed.
        if log.action == "stay" && log.events.is_empty() {
            continue;
        }
        let transitions = log.transitions(options.alpha, &mut assumed);
        actions.push((log.action.to_string(), transitions));
    }
    EffectorProfile { box_m: None, actions, assumed, rule: RULE.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "action,ahead_boxes,left_boxes,turn_deg\n";

    fn learned(rows: &str, alpha: f64) -> Result<LearnedEffector, InputError> {
        learned_table(&format!("{HEAD}{rows}"), alpha, |options| options)
    }

    fn learned_table(
        text: &str,
        alpha: f64,
        change: impl FnOnce(EffectorOptions) -> EffectorOptions,
    ) -> Result<LearnedEffector, InputError> {
        let options = EstimateOptions { alpha, ..Default::default() }.into();
        learn(&CsvTable::parse(&"f.csv", text)?, &change(options))
    }

    #[test]
    fn whole_displacements_are_counted_as_they_are() {
        let rows = "forward,1,0,0\nforward,1,0,0\nforward,1,1,0\nforward,0,0,90\n\
            left,0,0,90\nleft,0,0,0\nright,0,0,-90\nstay,0,0,0\n";
        let model = learned(rows, 0.0).unwrap();
        let shares = model.report.transitions.unwrap();
        assert_eq!((shares.ahead, shares.ahead_left, shares.other), (0.5, 0.25, 0.25));
        assert_eq!((model.report.events, model.report.actions["left"]["stay"]), (4, 1.0));
        let forward: Vec<_> = model
            .profile
            .action("forward")
            .unwrap()
            .iter()
            .map(|t| (t.path.as_str(), t.turn_deg, t.p))
            .collect();
        assert_eq!(forward, [("F", 0, 0.5), ("", 90, 0.25), ("FL", 0, 0.25)]);
        assert_eq!(model.profile.action("right").unwrap().len(), 1);
        assert!(model.profile.action("stay").is_some());
        assert!(model.profile.assumed.is_empty());
    }

    #[test]
    fn displacements_between_boxes_are_phase_averaged() {
        let model = learned("forward,1.25,0,0\n", 0.0).unwrap();
        let forward: Vec<_> = model
            .profile
            .action("forward")
            .unwrap()
            .iter()
            .map(|t| (t.path.as_str(), t.p))
            .collect();
        assert_eq!(forward, [("F", 0.75), ("FF", 0.25)]);
        assert_eq!(model.profile.assumed, ["left: never fails", "right: never fails"]);
    }

    #[test]
    fn the_intended_outcome_comes_first_though_it_was_never_seen() {
        let model = learned("forward,0,0,0\n", 0.5).unwrap();
        let forward: Vec<_> = model
            .profile
            .action("forward")
            .unwrap()
            .iter()
            .map(|t| (t.path.as_str(), t.p))
            .collect();
        assert_eq!(forward, [("F", 0.25), ("", 0.75)]);
    }

    #[test]
    fn a_recorded_table_of_motions_is_read_and_contacts_are_left_out() {
        let text = "cycle,robot,action,ahead_boxes,left_boxes,turn_deg,contact\n\
            0,0,0,1,0,0,no\n1,0,0,0,0,0,yes\n2,0,1,0,0,90,no\n3,0,1,0,0,270,no\n4,0,1,0,0,-90,no\n";
        let table = CsvTable::parse(&"f.csv", text).unwrap();
        let report = learn(&table, &EffectorOptions::default()).unwrap().report;
        assert_eq!((report.events, report.rejected["contact"]), (1, 1));
        assert!(report.warnings[0].contains("learn in the open"));
        assert_eq!(report.actions["left"]["turn -90"], 2.0, "270 degrees to the left end alike");
    }

    #[test]
    fn a_turn_that_overshoots_has_the_same_moments_on_both_sides() {
        let turns = |rows: &str| learned(rows, 0.0).unwrap().report.turns.unwrap();
        // A recording calls two quarters 180 degrees, whichever way they were turned.
        let (left, right) = (turns("left,0,0,180\n"), turns("right,0,0,180\n"));
        assert_eq!(left.error_deg_along_turn.map(|m| m.mean.round()), Some(90.0));
        assert_eq!(right.error_deg_along_turn, left.error_deg_along_turn);
        assert_eq!(right.true_over_commanded, left.true_over_commanded);
        assert_eq!(right.hist_15deg, left.hist_15deg);
        let astray = learned("forward,1,0,270\n", 0.0).unwrap().report.moments;
        assert!((astray["dtheta_minus_cmd_rad"].mean + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }

    #[test]
    fn damaged_rows_name_line_and_column() {
        let cases = [
            ("jump,1,0,0\n", (2, 1)),
            ("forward,x,0,0\n", (2, 9)),
            ("forward,1e9,0,0\n", (2, 9)),
            ("forward,1,0,720\n", (2, 13)),
        ];
        for (row, position) in cases {
            assert_eq!(learned(row, 0.5).unwrap_err().line_and_column(), Some(position), "{row}");
        }
        assert!(learned("", 0.5).unwrap_err().cause().contains("no displacements"));
    }

    proptest::proptest! {
        #[test]
        fn any_rows_are_learned_or_refused(
            rows in "((forward|left|right|stay|3),-?[0-9]{1,2}(\\.[0-9])?,-?[0-9](\\.[0-9])?,-?[0-9]{0,3}\n){0,9}"
        ) {
            if let Ok(model) = learned(&rows, 0.5) {
                for (action, transitions) in &model.profile.actions {
                    let sum: f64 = transitions.iter().map(|transition| transition.p).sum();
                    proptest::prop_assert!((sum - 1.0).abs() < 1e-9, "{}: {}", action, sum);
                    proptest::prop_assert!(transitions.iter().all(|t| t.path.len() <= 16));
                }
            }
        }
    }
}
