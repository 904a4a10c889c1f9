//! An effector learned from displacements already measured.

use std::collections::BTreeMap;

use super::EffectorModel;
use super::events::{Events, Move, Turn};
use super::phase::{FORWARD_CLASSES, Outcome, forward_class, outcomes};
use super::report::{EffectorReport, ForwardShares};
use super::transitions::{EffectorProfile, Transition, exact, from_outcomes, intended, label};
use crate::import::table::{CsvRow, CsvTable, Word};
use crate::kernel::InputError;
use crate::learn::holdout::{fit, split};
use crate::learn::{Counts, EstimateOptions};

/// What a robot can be told to do.
const ACTIONS: [&str; 4] = ["forward", "left", "right", "stay"];
/// A longer displacement is no single action.
const BOXES_MAX: f64 = 16.0;
/// A wider turn is none either.
const TURN_MAX_DEG: f64 = 360.0;

/// How events become transitions.
const RULE: &str = "counts of measured displacements, phase-averaged where they are no whole \
    boxes or quarter turns; every outcome that was seen, plus alpha";

/// One row of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Displacement {
    /// Index in [`ACTIONS`].
    action: usize,
    ahead_boxes: f64,
    left_boxes: f64,
    turn_deg: f64,
}

impl Displacement {
    fn outcomes(&self) -> Vec<(Outcome, f64)> {
        outcomes(self.ahead_boxes, self.left_boxes, self.turn_deg / 90.0)
    }

    fn as_move(&self) -> Move {
        Move {
            ahead_boxes: self.ahead_boxes,
            left_boxes: self.left_boxes,
            turn_error_rad: self.turn_deg.to_radians(),
            duration_s: None,
        }
    }

    fn as_turn(&self) -> Turn {
        let commanded_deg = f64::from(90 * intended(ACTIONS[self.action]).quarters);
        Turn {
            commanded_rad: commanded_deg.to_radians(),
            true_rad: self.turn_deg.to_radians(),
            duration_s: None,
        }
    }
}

pub(super) fn learn(
    table: &CsvTable,
    options: &EstimateOptions,
) -> Result<EffectorModel, InputError> {
    let all = parse(table)?;
    let by_action: Vec<ActionLog> =
        (0..ACTIONS.len()).map(|action| ActionLog::of(&all, action)).collect();
    let report = report(table.place(), &by_action, options);
    Ok(EffectorModel { report, profile: profile(&by_action, options) })
}

/// The events of one action and the outcomes they had.
struct ActionLog {
    action: &'static str,
    events: Vec<Displacement>,
    /// The intended outcome, then the others, the more frequent first.
    outcomes: Vec<Outcome>,
}

impl ActionLog {
    fn of(all: &[Displacement], action: usize) -> Self {
        let events: Vec<Displacement> =
            all.iter().filter(|e| e.action == action).copied().collect();
        let mut weights: BTreeMap<Outcome, f64> = BTreeMap::new();
        for (outcome, weight) in events.iter().flat_map(Displacement::outcomes) {
            *weights.entry(outcome).or_insert(0.0) += weight;
        }
        // Infinite, so that what was intended comes first whether or not it was seen.
        weights.insert(intended(ACTIONS[action]), f64::INFINITY);
        let mut ranked: Vec<(Outcome, f64)> = weights.into_iter().collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        let outcomes = ranked.into_iter().map(|(outcome, _)| outcome).collect();
        Self { action: ACTIONS[action], events, outcomes }
    }

    fn counts<'e>(&self, events: impl IntoIterator<Item = &'e Displacement>) -> Counts {
        let columns: Vec<String> = self.outcomes.iter().map(label).collect();
        let mut counts = Counts::new("actions", &[self.action.to_string()], &columns);
        for (outcome, weight) in events.into_iter().flat_map(Displacement::outcomes) {
            let column = self.outcomes.iter().position(|known| *known == outcome);
            counts.add(0, column.expect("outcomes were collected from all events"), weight);
        }
        counts
    }

    fn transitions(&self, alpha: f64, assumed: &mut Vec<String>) -> Vec<Transition> {
        if self.events.is_empty() {
            assumed.push(format!("{}: never fails", self.action));
            return exact(intended(self.action));
        }
        from_outcomes(&self.outcomes, self.counts(&self.events).row(0), alpha)
    }

    /// Shares of the paper's classes.
    fn forward_shares(&self) -> Option<ForwardShares> {
        let mut shares = vec![0.0; FORWARD_CLASSES.len()];
        for (outcome, weight) in self.events.iter().flat_map(Displacement::outcomes) {
            let straight = outcome.quarters == 0;
            let class = if straight { forward_class(outcome.ahead, outcome.left) } else { 5 };
            shares[class] += weight;
        }
        ForwardShares::of(&shares)
    }
}

fn report(source: &str, logs: &[ActionLog], options: &EstimateOptions) -> EffectorReport {
    let [forward, left, right, _] = logs else { unreachable!("one log per action") };
    let events = Events {
        moves: forward.events.iter().map(Displacement::as_move).collect(),
        turns: left.events.iter().chain(&right.events).map(Displacement::as_turn).collect(),
    };
    let seen: Vec<&ActionLog> = logs.iter().filter(|log| !log.events.is_empty()).collect();
    let tables: Vec<Counts> = seen.iter().map(|log| log.counts(&log.events)).collect();
    let fits = seen.iter().map(|log| {
        let (train, held) = split(&log.events, options.hold_out_every);
        let mut fit = fit(&log.counts(train), &log.counts(held), options.alpha);
        fit.table = log.action.to_string();
        fit
    });
    EffectorReport {
        transitions: forward.forward_shares(),
        actions: tables.iter().map(by_name).collect(),
        probabilities: tables.iter().flat_map(Counts::estimates).collect(),
        thin: tables.iter().flat_map(|table| table.thin(options.thin_below)).collect(),
        hold_out: fits.collect(),
        ..events.report(source, options)
    }
}

/// The outcomes of a table's only row, by name.
fn by_name(table: &Counts) -> (String, BTreeMap<String, f64>) {
    let named = table.columns().iter().cloned().zip(table.row(0).iter().copied());
    (table.rows()[0].clone(), named.collect())
}

fn profile(logs: &[ActionLog], options: &EstimateOptions) -> EffectorProfile {
    let mut assumed = Vec::new();
    let mut transitions = |log: &ActionLog| log.transitions(options.alpha, &mut assumed);
    EffectorProfile {
        box_m: None,
        forward: transitions(&logs[0]),
        left: transitions(&logs[1]),
        right: transitions(&logs[2]),
        assumed,
        rule: RULE.to_string(),
    }
}

fn parse(table: &CsvTable) -> Result<Vec<Displacement>, InputError> {
    let names = ["action", "ahead_boxes", "left_boxes", "turn_deg"];
    let mut columns = [0; 4];
    for (column, name) in columns.iter_mut().zip(names) {
        *column = table.column(name)?;
    }
    let place = table.place();
    let rows: Vec<Displacement> =
        table.rows().map(|row| parse_row(place, row, columns)).collect::<Result<_, _>>()?;
    if rows.is_empty() {
        return Err(InputError::new(place, "the file has no displacements", "write one a row"));
    }
    Ok(rows)
}

fn parse_row(
    place: &str,
    row: CsvRow<'_>,
    columns: [usize; 4],
) -> Result<Displacement, InputError> {
    let [action, ahead, left, turn] = columns.map(|column| row.field(column));
    let known = ACTIONS.iter().position(|name| *name == action.text).ok_or_else(|| {
        let cause = format!("`{}` is not an action", action.text);
        action.error(&place, cause, &format!("use one of {}", ACTIONS.join(", ")))
    })?;
    Ok(Displacement {
        action: known,
        ahead_boxes: limited(place, ahead, BOXES_MAX)?,
        left_boxes: limited(place, left, BOXES_MAX)?,
        turn_deg: limited(place, turn, TURN_MAX_DEG)?,
    })
}

fn limited(place: &str, word: Word<'_>, most: f64) -> Result<f64, InputError> {
    let value = word.number(&place)?;
    if value.abs() <= most {
        return Ok(value);
    }
    let cause = format!("{value} is more than one action moves");
    Err(word.error(&place, cause, &format!("give a number from -{most} to {most}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "action,ahead_boxes,left_boxes,turn_deg\n";

    fn learned(rows: &str, alpha: f64) -> Result<EffectorModel, InputError> {
        let options = EstimateOptions { alpha, ..Default::default() };
        learn(&CsvTable::parse(&"f.csv", &format!("{HEAD}{rows}"))?, &options)
    }

    #[test]
    fn whole_displacements_are_counted_as_they_are() {
        let rows = "forward,1,0,0\nforward,1,0,0\nforward,1,1,0\nforward,0,0,90\n\
            left,0,0,90\nleft,0,0,0\nright,0,0,-90\nstay,0,0,0\n";
        let model = learned(rows, 0.0).unwrap();
        let shares = model.report.transitions.unwrap();
        assert_eq!((shares.ahead, shares.ahead_left, shares.other), (0.5, 0.25, 0.25));
        assert_eq!((model.report.events, model.report.actions["left"]["stay"]), (4, 1.0));
        let forward: Vec<_> =
            model.profile.forward.iter().map(|t| (t.path.as_str(), t.turn_deg, t.p)).collect();
        assert_eq!(forward, [("F", 0, 0.5), ("", 90, 0.25), ("FL", 0, 0.25)]);
        assert_eq!(model.profile.right.len(), 1);
        assert!(model.profile.assumed.is_empty());
    }

    #[test]
    fn displacements_between_boxes_are_phase_averaged() {
        let model = learned("forward,1.25,0,0\n", 0.0).unwrap();
        let forward: Vec<_> =
            model.profile.forward.iter().map(|t| (t.path.as_str(), t.p)).collect();
        assert_eq!(forward, [("F", 0.75), ("FF", 0.25)]);
        assert_eq!(model.profile.assumed, ["left: never fails", "right: never fails"]);
    }

    #[test]
    fn the_intended_outcome_comes_first_though_it_was_never_seen() {
        let model = learned("forward,0,0,0\n", 0.5).unwrap();
        let forward: Vec<_> =
            model.profile.forward.iter().map(|t| (t.path.as_str(), t.p)).collect();
        assert_eq!(forward, [("F", 0.25), ("", 0.75)]);
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
            assert_eq!(learned(row, 0.5).unwrap_err().position(), Some(position), "{row}");
        }
        assert!(learned("", 0.5).unwrap_err().cause().contains("no displacements"));
    }
}
