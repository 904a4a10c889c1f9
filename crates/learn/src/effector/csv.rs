//! An effector learned from displacements that were already measured.

use std::collections::BTreeMap;

use super::delays::{self, DelayReport, Pause};
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
    let ParsedRows { free, pauses, rejected, damage, effector, box_m } =
        rows::parse(table, options)?;
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
    report.warnings.extend(radian_warning(&free));
    report.warnings.extend(side_warning(&free));
    report.warnings.extend(meter_warning(&free, box_m));
    if let Some(pauses) = &pauses {
        add_delays(&mut report, pauses, estimate);
    }
    report.judge_left_out(free.len() as u64);
    let delays = pauses.as_deref().and_then(delays::model);
    Ok(LearnedEffector {
        report,
        profile: EffectorProfile { box_m, delays, ..profile(&by_action, estimate) },
    })
}

/// Adds the counts of delays to a report.
fn add_delays(report: &mut EffectorReport, pauses: &[Pause], options: &EstimateOptions) {
    let delays = DelayReport::new(pauses);
    report.warnings.extend(delays.warning());
    report.delays = Some(delays);
    for table in delays::count_tables(pauses) {
        report.probabilities.extend(table.estimates());
        report.thin.extend(table.low_count_rows(options.thin_below));
    }
}

/// Turns of so many degrees are usual where a quarter turn was commanded and the table has radians.
const QUARTER_TURN_IN_RADIANS: std::ops::RangeInclusive<f64> = 1.3..=1.9;
/// Number of turns from which on their usual size is known.
const MIN_TURNS: usize = 5;

/// Returns the warning on turns that look like radians.
fn radian_warning(displacements: &[MeasuredDisplacement]) -> Option<String> {
    let is_turn = |displacement: &&MeasuredDisplacement| {
        intended_displacement(STANDARD_ACTIONS[displacement.action]).quarters != 0
    };
    let mut turns: Vec<f64> =
        displacements.iter().filter(is_turn).map(|d| d.turn_deg.abs()).collect();
    turns.sort_by(f64::total_cmp);
    let usual = *turns.get(turns.len() / 2)?;
    (turns.len() >= MIN_TURNS && QUARTER_TURN_IN_RADIANS.contains(&usual)).then(|| {
        format!("turns to the side are usually of {usual:.2} degrees: the column turn_deg looks like radians")
    })
}

/// Turns by as many degrees have a side.
const SIDED_TURN_DEG: std::ops::RangeInclusive<f64> = 30.0..=150.0;

/// Returns the warning on turns to the side that is not the commanded one.
fn side_warning(displacements: &[MeasuredDisplacement]) -> Option<String> {
    let turns: Vec<f64> = displacements
        .iter()
        .map(|d| {
            let side = f64::from(intended_displacement(STANDARD_ACTIONS[d.action]).quarters);
            side * ((d.turn_deg + 180.0).rem_euclid(360.0) - 180.0)
        })
        .filter(|turn| SIDED_TURN_DEG.contains(&turn.abs()))
        .collect();
    let wrong = turns.iter().filter(|turn| **turn < 0.0).count();
    (turns.len() >= MIN_TURNS && 2 * wrong > turns.len()).then(|| {
        format!(
            "{wrong} of {} turns go to the side that was not commanded: turn_deg is counterclockwise, above 0 for a turn \
             to the left",
            turns.len()
        )
    })
}

/// Moves ahead of at most so many boxes are usual where the table has meters.
const MAX_USUAL_AHEAD_IN_METERS: f64 = 0.6;
/// Number of moves from which on their usual length is known.
const MIN_MOVES: usize = 10;

/// Returns the warning on moves of one box that are usually much shorter than a box.
fn meter_warning(displacements: &[MeasuredDisplacement], box_m: Option<f64>) -> Option<String> {
    let is_move = |displacement: &&MeasuredDisplacement| {
        STANDARD_ACTIONS[displacement.action] == "forward" && displacement.ahead_boxes > 0.0
    };
    let mut moves: Vec<f64> = displacements.iter().filter(is_move).map(|d| d.ahead_boxes).collect();
    moves.sort_by(f64::total_cmp);
    let usual = *moves.get(moves.len() / 2)?;
    let is_box = box_m.is_none_or(|box_m| (usual / box_m - 1.0).abs() < 0.25);
    (moves.len() >= MIN_MOVES && usual <= MAX_USUAL_AHEAD_IN_METERS && is_box).then(|| {
        format!(
            "moves ahead are usually of {usual:.2} boxes: the column ahead_boxes looks like meters"
        )
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
    EffectorProfile { box_m: None, delays: None, actions, assumed, rule: RULE.to_string() }
}

#[cfg(test)]
mod tests;
