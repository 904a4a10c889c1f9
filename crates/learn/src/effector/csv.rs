//! An effector learned from displacements that were already measured.

use std::collections::BTreeMap;

use super::delays::{self, DelayReport, Pause};
use super::displacements::{ACTIONS, Displacements, MeasuredDisplacement};
use super::events::{EventLog, MoveEvent, TurnEvent, nearest_turn, summary};
use super::grid_displacement::{
    FORWARD_CLASSES, GridDisplacement, OTHER_CLASS, OutcomeColumns, OutcomeSums, forward_class,
    visit_outcomes,
};
use super::report::{EffectorReport, ForwardShares};
use super::rows::{self, ParsedRows};
use super::transitions::{
    EffectorProfile, ProfileTransition, certain_transition, from_outcomes, intended_displacement,
    label,
};
use super::{EffectorOptions, LearnedEffector};
use crate::holdout::{
    HoldoutTest, PartCounter, PartTables, TIME_PARTS, holdout_test, tests_of_tables,
};
use crate::log_table::LogTable;
use crate::{CountTable, EstimateOptions};
use sidestep_error_models::effector::STANDARD_ACTIONS;
use sidestep_kernel::InputError;

/// The rule by which events become transitions.
const RULE: &str = "counts of measured displacements, phase-averaged where they are no whole \
    boxes or quarter turns; every outcome that was seen, plus alpha";

impl MeasuredDisplacement {
    /// Visits where it ends, with probabilities; turns that end alike, such as 270 and -90 degrees, are one outcome.
    fn visit_outcomes(&self, visit: &mut impl FnMut(GridDisplacement, f64)) {
        let displacement = [self.ahead_boxes, self.left_boxes, self.turn_deg / 90.0];
        visit_outcomes(displacement, &mut |outcome, weight| {
            // Quarters -1 (right), 0, 1 (left) and 2 (back).
            let quarters = (outcome.quarters + 1).rem_euclid(4) - 1;
            visit(GridDisplacement { quarters, ..outcome }, weight);
        });
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

    /// Returns the degrees turned to the side that the action turns to, from -180 to 180.
    fn turn_along_deg(&self) -> f64 {
        let side = f64::from(intended_displacement(STANDARD_ACTIONS[self.action]).quarters);
        side * ((self.turn_deg + 180.0).rem_euclid(360.0) - 180.0)
    }

    fn as_turn(&self) -> TurnEvent {
        let commanded_deg =
            f64::from(90 * intended_displacement(STANDARD_ACTIONS[self.action]).quarters);
        let turn = TurnEvent::new(commanded_deg.to_radians(), self.turn_deg.to_radians(), None);
        TurnEvent { robot: self.robot, ..turn }
    }
}

pub(super) fn learn(
    table: &dyn LogTable,
    options: &EffectorOptions,
) -> Result<LearnedEffector, InputError> {
    let ParsedRows { free, pauses, rejected, damage, effector, box_m } =
        rows::parse(table, options)?;
    let estimate = &options.estimate;
    let by_action = ActionLog::of_actions(&free, estimate);
    let mut report = report(table.place(), &free, &by_action, estimate);
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
    report.warnings.extend(turn_warnings(&free));
    report.warnings.extend(meter_warning(&free, box_m));
    if let Some(pauses) = &pauses {
        add_delays(&mut report, pauses, estimate);
    }
    report.judge_left_out(free.count() as u64);
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

/// Turns by as many degrees have a side.
const SIDED_TURN_DEG: std::ops::RangeInclusive<f64> = 30.0..=150.0;

/// Returns the warnings on turns that look like radians, and on those to the side that is not the commanded one.
fn turn_warnings(all: &Displacements<'_>) -> Vec<String> {
    let mut sizes_deg = Vec::with_capacity(all.count_of(1) + all.count_of(2));
    let mut sided = 0;
    let mut wrong = 0;
    all.visit(TURNS, &mut |displacement| {
        sizes_deg.push(displacement.turn_deg.abs());
        let along_deg = displacement.turn_along_deg();
        if SIDED_TURN_DEG.contains(&along_deg.abs()) {
            sided += 1;
            wrong += usize::from(along_deg < 0.0);
        }
    });
    radian_warning(sizes_deg).into_iter().chain(side_warning(wrong, sided)).collect()
}

/// Returns the warning on turns of sizes that look like radians.
fn radian_warning(sizes_deg: Vec<f64>) -> Option<String> {
    let count = sizes_deg.len();
    let usual = upper_median(sizes_deg)?;
    (count >= MIN_TURNS && QUARTER_TURN_IN_RADIANS.contains(&usual)).then(|| {
        format!("turns to the side are usually of {usual:.2} degrees: the column turn_deg looks like radians")
    })
}

/// Returns the value in the middle, or the upper one of the two there.
fn upper_median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Returns the warning where most of `sided` turns go to the wrong side.
fn side_warning(wrong: usize, sided: usize) -> Option<String> {
    (sided >= MIN_TURNS && 2 * wrong > sided).then(|| {
        format!(
            "{wrong} of {sided} turns go to the side that was not commanded: turn_deg is counterclockwise, above 0 for a turn \
             to the left"
        )
    })
}

/// Moves ahead of at most so many boxes are usual where the table has meters.
const MAX_USUAL_AHEAD_IN_METERS: f64 = 0.6;
/// Number of moves from which on their usual length is known.
const MIN_MOVES: usize = 10;

/// Returns the warning on moves of one box that are usually much shorter than a box.
fn meter_warning(all: &Displacements<'_>, box_m: Option<f64>) -> Option<String> {
    let mut moves = Vec::with_capacity(all.count_of(0));
    all.visit(FORWARD, &mut |displacement| {
        if displacement.ahead_boxes > 0.0 {
            moves.push(displacement.ahead_boxes);
        }
    });
    let count = moves.len();
    let usual = upper_median(moves)?;
    let is_box = box_m.is_none_or(|box_m| (usual / box_m - 1.0).abs() < 0.25);
    (count >= MIN_MOVES && usual <= MAX_USUAL_AHEAD_IN_METERS && is_box).then(|| {
        format!(
            "moves ahead are usually of {usual:.2} boxes: the column ahead_boxes looks like meters"
        )
    })
}

/// Whether the actions turn to a side: `left` and `right`.
const TURNS: [bool; ACTIONS] = [false, true, true, false];
/// The action of one box ahead alone.
const FORWARD: [bool; ACTIONS] = [true, false, false, false];

impl EventLog for Displacements<'_> {
    fn move_count(&self) -> usize {
        self.count_of(0)
    }

    fn visit_moves(&self, visit: &mut dyn FnMut(&MoveEvent)) {
        self.visit(FORWARD, &mut |displacement| visit(&displacement.as_move()));
    }

    fn visit_turns(&self, visit: &mut dyn FnMut(&TurnEvent)) {
        self.visit(TURNS, &mut |displacement| visit(&displacement.as_turn()));
    }
}

/// The outcomes of one action, and how often each occurred.
struct ActionLog {
    action: &'static str,
    /// Number of events.
    n: usize,
    /// The intended outcome, then the others, the more frequent first.
    outcomes: Vec<GridDisplacement>,
    /// Sums of the weights of these outcomes.
    weights: Vec<f64>,
    /// The same sums by the paper's classes; of one box ahead alone.
    class_weights: [f64; FORWARD_CLASSES.len()],
    /// The same over parts of the events.
    parts: ActionParts,
}

/// What the first pass over all displacements finds of each action.
struct OutcomeCounts {
    n: usize,
    sums: OutcomeSums,
    class_weights: [f64; FORWARD_CLASSES.len()],
    robots: PartCounter,
}

impl OutcomeCounts {
    fn of_actions(all: &Displacements<'_>) -> [Self; ACTIONS] {
        let mut counts = [(); ACTIONS].map(|()| Self {
            n: 0,
            sums: OutcomeSums::new(),
            class_weights: [0.0; FORWARD_CLASSES.len()],
            robots: PartCounter::default(),
        });
        all.visit([true; ACTIONS], &mut |displacement| {
            let of_action = &mut counts[displacement.action];
            of_action.n += 1;
            of_action.robots.count(displacement.robot);
            // The paper has classes of one box ahead alone.
            let has_classes = FORWARD[displacement.action];
            displacement.visit_outcomes(&mut |outcome, weight| {
                of_action.sums.add(outcome, weight);
                if has_classes {
                    of_action.class_weights[class_of(outcome)] += weight;
                }
            });
        });
        counts
    }
}

/// Returns the index in [`FORWARD_CLASSES`] of an outcome.
fn class_of(outcome: GridDisplacement) -> usize {
    if outcome.quarters == 0 { forward_class(outcome.ahead, outcome.left) } else { OTHER_CLASS }
}

/// Sums of the weights of an action's outcomes over parts of its events.
struct ActionParts {
    columns: OutcomeColumns,
    robots: PartCounter,
    /// Number of events so far.
    n: usize,
    learned: Vec<f64>,
    held_out: Vec<f64>,
    /// Of each quarter of the time; empty without events.
    quarters: Vec<Vec<f64>>,
    /// Of each robot, by its place among all; empty where there is one, whose sums are those of the action.
    by_robot: Vec<Vec<f64>>,
}

impl ActionParts {
    fn new(outcomes: &[GridDisplacement], robots: PartCounter) -> Self {
        let robot_count = robots.robots().count();
        Self {
            columns: OutcomeColumns::new(outcomes),
            by_robot: vec![Vec::new(); Some(robot_count).filter(|count| *count > 1).unwrap_or(0)],
            robots,
            n: 0,
            learned: vec![0.0; outcomes.len()],
            held_out: vec![0.0; outcomes.len()],
            quarters: vec![Vec::new(); TIME_PARTS],
        }
    }

    fn add(&mut self, displacement: &MeasuredDisplacement, hold_out_every: usize) {
        let is_held_out = self.n % hold_out_every == hold_out_every - 1;
        self.n += 1;
        let parts = self.robots.next(displacement.robot);
        let sample = if is_held_out { &mut self.held_out } else { &mut self.learned };
        let quarter = &mut self.quarters[parts.quarter];
        quarter.resize(sample.len(), 0.0);
        let mut robot = self.by_robot.get_mut(parts.robot);
        robot.iter_mut().for_each(|sums| sums.resize(sample.len(), 0.0));
        displacement.visit_outcomes(&mut |outcome, weight| {
            // All outcomes have a column, unless numbers are changed while they are read.
            if let Some(column) = self.columns.find(outcome) {
                sample[column] += weight;
                quarter[column] += weight;
                if let Some(robot) = &mut robot {
                    robot[column] += weight;
                }
            }
        });
    }
}

impl ActionLog {
    /// Counts the outcomes of all actions.
    fn of_actions(all: &Displacements<'_>, options: &EstimateOptions) -> Vec<Self> {
        let counts = OutcomeCounts::of_actions(all);
        let named = STANDARD_ACTIONS.into_iter().zip(counts);
        let mut logs: Vec<Self> = named.map(|(action, counts)| Self::new(action, counts)).collect();
        all.visit([true; ACTIONS], &mut |displacement| {
            logs[displacement.action].parts.add(displacement, options.hold_out_every);
        });
        logs
    }

    fn new(action: &'static str, counts: OutcomeCounts) -> Self {
        let intended = intended_displacement(action);
        let mut sums = counts.sums.into_sorted();
        // Infinite, so that the intended outcome comes first whether or not it was seen.
        let intended_sum = sums.insert(intended, f64::INFINITY).unwrap_or(0.0);
        let mut ranked: Vec<(GridDisplacement, f64)> = sums.into_iter().collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        let (outcomes, mut weights): (Vec<_>, Vec<_>) = ranked.into_iter().unzip();
        weights[0] = intended_sum;
        let parts = ActionParts::new(&outcomes, counts.robots);
        Self { action, n: counts.n, outcomes, weights, class_weights: counts.class_weights, parts }
    }

    fn counts(&self) -> CountTable {
        self.table(&self.weights)
    }

    /// Returns a table with these weights of the outcomes.
    fn table(&self, weights: &[f64]) -> CountTable {
        let columns: Vec<String> = self.outcomes.iter().map(label).collect();
        let mut table = CountTable::new("actions", &[self.action.to_string()], &columns);
        for (column, weight) in weights.iter().enumerate() {
            table.add(0, column, *weight);
        }
        table
    }

    fn holdout_tests(&self, options: &EstimateOptions) -> Vec<HoldoutTest> {
        let learned = self.table(&self.parts.learned);
        let held_out = self.table(&self.parts.held_out);
        let mut fits = vec![holdout_test(&learned, &held_out, options.alpha)];
        let parts = PartTables { time: self.tables_of_quarters(), robots: self.tables_of_robots() };
        fits.extend(tests_of_tables(&parts, options.alpha));
        fits.iter_mut().for_each(|fit| fit.table = self.action.to_string());
        fits
    }

    fn tables_of_quarters(&self) -> Vec<(String, CountTable)> {
        let quarters = self.parts.quarters.iter().enumerate();
        let seen = quarters.filter(|(_, weights)| !weights.is_empty());
        seen.map(|(quarter, weights)| (quarter.to_string(), self.table(weights))).collect()
    }

    fn tables_of_robots(&self) -> Vec<(String, CountTable)> {
        let robots = self.parts.robots.robots();
        let table =
            |place: usize| self.table(self.parts.by_robot.get(place).unwrap_or(&self.weights));
        robots.map(|(number, place)| (number.to_string(), table(place))).collect()
    }

    fn transitions(&self, alpha: f64, assumed: &mut Vec<String>) -> Vec<ProfileTransition> {
        if self.n == 0 {
            assumed.push(format!("{}: never fails", self.action));
            return certain_transition(intended_displacement(self.action));
        }
        from_outcomes(&self.outcomes, &self.weights, alpha)
    }
}

fn report(
    source: &str,
    all: &Displacements<'_>,
    logs: &[ActionLog],
    options: &EstimateOptions,
) -> EffectorReport {
    let seen: Vec<&ActionLog> = logs.iter().filter(|log| log.n > 0).collect();
    let tables: Vec<CountTable> = seen.iter().map(|log| log.counts()).collect();
    EffectorReport {
        // The shares of the paper's classes are of the first action, one box ahead.
        transitions: ForwardShares::from_counts(&logs[0].class_weights),
        actions: tables.iter().map(by_name).collect(),
        probabilities: tables.iter().flat_map(CountTable::estimates).collect(),
        thin: tables.iter().flat_map(|table| table.low_count_rows(options.thin_below)).collect(),
        hold_out: seen.iter().flat_map(|log| log.holdout_tests(options)).collect(),
        ..summary(all, source, options)
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
        if log.action == "stay" && log.n == 0 {
            continue;
        }
        let transitions = log.transitions(options.alpha, &mut assumed);
        actions.push((log.action.to_string(), transitions));
    }
    EffectorProfile { box_m: None, delays: None, actions, assumed, rule: RULE.to_string() }
}

#[cfg(test)]
mod tests;
