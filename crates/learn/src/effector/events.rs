//! Measured moves and turns, from any kind of log, and their counts.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use super::grid_displacement::{
    FORWARD_CLASSES, GridDisplacement, OutcomeSums, PhaseShares, forward_class, round_half_up,
    visit_outcomes,
};
use super::report::{EffectorReport, ForwardShares, TurnReport};
use super::transitions::{
    self, EffectorProfile, ProfileTransition, TURN_CLASSES, intended_displacement, turn_class,
};
use crate::holdout::{HoldoutTest, holdout_test, split, tests_by_parts};
use crate::{CountTable, EstimateOptions};
use sidestep_statistics::Moments;

/// One commanded box ahead, and the motion that followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MoveEvent {
    /// Number of the robot; 0 where the log is of one.
    pub(super) robot: u32,
    pub(super) ahead_boxes: f64,
    pub(super) left_boxes: f64,
    /// True turn minus commanded turn.
    pub(super) turn_error_rad: f64,
    /// `None` where the log does not say.
    pub(super) duration_s: Option<f64>,
}

/// One commanded turn, and the motion that followed; both in rad, + to the left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TurnEvent {
    /// Number of the robot; 0 where the log is of one.
    pub(super) robot: u32,
    pub(super) commanded_rad: f64,
    pub(super) true_rad: f64,
    /// `None` where the log does not say.
    pub(super) duration_s: Option<f64>,
}

impl TurnEvent {
    /// Creates a turn; see [`nearest_turn`].
    pub(super) fn new(commanded_rad: f64, true_rad: f64, duration_s: Option<f64>) -> Self {
        let true_rad = nearest_turn(commanded_rad, true_rad);
        Self { robot: 0, commanded_rad, true_rad, duration_s }
    }

    fn ratio(&self) -> f64 {
        self.true_rad / self.commanded_rad
    }

    /// Returns the degrees turned in the direction of the command.
    fn along_deg(&self) -> f64 {
        (self.true_rad * self.commanded_rad.signum()).to_degrees()
    }

    fn error_deg(&self) -> f64 {
        self.along_deg() - self.commanded_rad.abs().to_degrees()
    }

    fn is_left(&self) -> bool {
        self.commanded_rad > 0.0
    }
}

/// Returns, of all turns that end like `true_rad`, the one nearest to the command. A log knows
/// headings only: a commanded turn of -90 degrees that ends at 180 has overshot.
pub(super) fn nearest_turn(commanded_rad: f64, true_rad: f64) -> f64 {
    let error_rad = true_rad - commanded_rad;
    // Half a turn off is ambiguous, so the log's own sign stays; the tolerance is for angles converted from degrees.
    if error_rad.abs() <= PI + 1e-9 { true_rad } else { true_rad - TAU * error_rad.signum() }
}

/// Moves and turns that are visited in the order of time, again for each figure: a log of millions of rows makes them
/// anew each time, which takes less than to keep them.
pub(super) trait EventLog {
    /// Returns the number of moves.
    fn move_count(&self) -> usize;

    /// Visits all moves.
    fn visit_moves(&self, visit: &mut dyn FnMut(&MoveEvent));

    /// Visits all turns.
    fn visit_turns(&self, visit: &mut dyn FnMut(&TurnEvent));
}

/// All moves and turns of a robot's log.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Events {
    pub(super) moves: Vec<MoveEvent>,
    pub(super) turns: Vec<TurnEvent>,
}

impl EventLog for Events {
    fn move_count(&self) -> usize {
        self.moves.len()
    }

    fn visit_moves(&self, visit: &mut dyn FnMut(&MoveEvent)) {
        self.moves.iter().for_each(visit);
    }

    fn visit_turns(&self, visit: &mut dyn FnMut(&TurnEvent)) {
        self.turns.iter().for_each(visit);
    }
}

/// Returns the parts of a report that say what moves and turns were, without tables of counts.
pub(super) fn summary(
    log: &dyn EventLog,
    source: &str,
    options: &EstimateOptions,
) -> EffectorReport {
    let moves = MoveCounts::new(log);
    EffectorReport {
        source: source.to_owned(),
        events: moves.n as u64,
        transitions_rounded: ForwardShares::from_counts(&moves.rounded_classes),
        outcomes: moves.box_shares(),
        rounded_counts: moves.rounded_boxes(),
        moments: move_moments(log, &moves),
        turns: turn_report(log),
        estimate: *options,
        ..EffectorReport::default()
    }
}

impl Events {
    /// Returns the parts of a report that follow from moves and turns; the rest is left empty.
    pub(super) fn report(&self, source: &str, options: &EstimateOptions) -> EffectorReport {
        let all: Vec<&MoveEvent> = self.moves.iter().collect();
        let forward = forward_counts(&all);
        let turns = self.turn_counts();
        let tables = [&forward, &turns];
        EffectorReport {
            transitions: ForwardShares::from_counts(forward.row(0)),
            probabilities: tables.iter().flat_map(|table| table.estimates()).collect(),
            thin: tables
                .iter()
                .flat_map(|table| table.low_count_rows(options.thin_below))
                .collect(),
            hold_out: self.holdout_tests(options),
            ..summary(self, source, options)
        }
    }

    /// Returns the transitions of all three actions.
    pub(super) fn profile(&self, rule: &str, options: &EstimateOptions) -> EffectorProfile {
        let forward = forward_counts(&self.moves.iter().collect::<Vec<_>>());
        let mut assumed = Vec::new();
        let left = self.turn_transitions("left", options.alpha, &mut assumed);
        let right = self.turn_transitions("right", options.alpha, &mut assumed);
        let actions = [
            ("forward", transitions::forward_transitions(&forward, options.alpha)),
            ("left", left),
            ("right", right),
        ];
        EffectorProfile {
            box_m: None,
            delays: None,
            actions: actions.map(|(name, list)| (name.to_string(), list)).to_vec(),
            assumed,
            rule: rule.to_owned(),
        }
    }

    fn holdout_tests(&self, options: &EstimateOptions) -> Vec<HoldoutTest> {
        let (train, held) = split(&self.moves, options.hold_out_every);
        let moves = holdout_test(&forward_counts(&train), &forward_counts(&held), options.alpha);
        let (train, held) = split(&self.turns, options.hold_out_every);
        let train = turn_counts(train.into_iter());
        let held = turn_counts(held.into_iter());
        let mut tests = vec![moves, holdout_test(&train, &held, options.alpha)];
        tests.extend(tests_by_parts(&self.moves, |m| m.robot, forward_counts, options.alpha));
        let turns = |turns: &[&TurnEvent]| turn_counts(turns.iter().copied());
        tests.extend(tests_by_parts(&self.turns, |turn| turn.robot, turns, options.alpha));
        tests
    }

    fn turn_counts(&self) -> CountTable {
        turn_counts(self.turns.iter())
    }

    /// Returns the transitions of turns to one side; without any, those to the other side mirrored;
    /// without any at all, turns that never fail.
    fn turn_transitions(
        &self,
        action: &str,
        alpha: f64,
        assumed: &mut Vec<String>,
    ) -> Vec<ProfileTransition> {
        let counts = self.turn_counts();
        let (own, other, side) = if action == "left" { (0, 1, 1) } else { (1, 0, -1) };
        if counts.total(own) > 0.0 {
            return transitions::turn_transitions(&counts, own, side, alpha);
        }
        if counts.total(other) > 0.0 {
            assumed.push(format!("{action}: mirrored from turns to the other side"));
            return transitions::turn_transitions(&counts, other, side, alpha);
        }
        assumed.push(format!("{action}: never fails"));
        transitions::certain_transition(intended_displacement(action))
    }
}

/// What one pass over all moves counts.
struct MoveCounts {
    n: usize,
    /// Number of those with a duration.
    timed: usize,
    /// By [`FORWARD_CLASSES`], each move rounded to a box.
    rounded_classes: [f64; 6],
    boxes: OutcomeSums,
    /// Phase-averaged shares of boxes.
    shares: OutcomeSums,
}

impl MoveCounts {
    fn new(log: &dyn EventLog) -> Self {
        let mut counts = Self {
            n: log.move_count(),
            timed: 0,
            rounded_classes: [0.0; 6],
            boxes: OutcomeSums::new(),
            shares: OutcomeSums::new(),
        };
        let n = counts.n as f64;
        log.visit_moves(&mut |m| {
            let ahead = round_half_up(m.ahead_boxes);
            let left = round_half_up(m.left_boxes);
            counts.timed += usize::from(m.duration_s.is_some());
            counts.rounded_classes[forward_class(ahead, left)] += 1.0;
            counts.boxes.add(GridDisplacement { ahead, left, quarters: 0 }, 1.0);
            visit_outcomes([m.ahead_boxes, m.left_boxes, 0.0], &mut |outcome, weight| {
                counts.shares.add(outcome, weight / n);
            });
        });
        counts
    }

    /// Returns the phase-averaged share of each box, by its name.
    fn box_shares(&self) -> BTreeMap<String, f64> {
        let boxes = self.shares.clone().into_sorted().into_iter();
        boxes.map(|(outcome, share)| (box_name(outcome), share)).collect()
    }

    /// Returns the number of moves by the box to which they round, by its name.
    fn rounded_boxes(&self) -> BTreeMap<String, u64> {
        let boxes = self.boxes.clone().into_sorted().into_iter();
        boxes.map(|(outcome, count)| (box_name(outcome), count as u64)).collect()
    }
}

/// Returns the name of a box, `"ahead,left"`.
fn box_name(outcome: GridDisplacement) -> String {
    format!("{},{}", outcome.ahead, outcome.left)
}

/// Returns the moments of what moves are measured by, by name.
fn move_moments(log: &dyn EventLog, counts: &MoveCounts) -> BTreeMap<String, Moments> {
    // One after the other, because the values of each are sorted in a list of their own.
    let of = |n: usize, value: fn(&MoveEvent) -> Option<f64>| {
        let mut values = Vec::with_capacity(n);
        if n > 0 {
            log.visit_moves(&mut |m| values.extend(value(m)));
        }
        Moments::from_values(values)
    };
    let named = [
        ("ahead_boxes", of(counts.n, |m| Some(m.ahead_boxes))),
        ("left_boxes", of(counts.n, |m| Some(m.left_boxes))),
        ("dtheta_minus_cmd_rad", of(counts.n, |m| Some(m.turn_error_rad))),
        ("duration_s", of(counts.timed, |m| m.duration_s)),
    ];
    named.into_iter().filter_map(|(name, moments)| Some((name.to_string(), moments?))).collect()
}

fn turn_report(log: &dyn EventLog) -> Option<TurnReport> {
    let mut n = 0;
    let mut n_left = 0;
    let mut timed = 0;
    let mut along_15deg = Histogram::new(15);
    let mut error_5deg = Histogram::new(5);
    log.visit_turns(&mut |turn| {
        n += 1;
        n_left += usize::from(turn.is_left());
        timed += usize::from(turn.duration_s.is_some());
        along_15deg.add(turn.along_deg());
        error_5deg.add(turn.error_deg());
    });
    if n == 0 {
        return None;
    }
    let of = |n: usize, value: fn(&TurnEvent) -> Option<f64>| {
        let mut values = Vec::with_capacity(n);
        if n > 0 {
            log.visit_turns(&mut |turn| values.extend(value(turn)));
        }
        Moments::from_values(values)
    };
    Some(TurnReport {
        n,
        n_left,
        n_right: n - n_left,
        true_over_commanded: of(n, |turn| Some(turn.ratio())),
        error_deg_along_turn: of(n, |turn| Some(turn.error_deg())),
        duration_s: of(timed, |turn| turn.duration_s),
        hist_15deg: along_15deg.bins,
        error_hist_5deg: error_5deg.bins,
    })
}

/// Counts the phase-averaged classes of moves ahead.
fn forward_counts(moves: &[&MoveEvent]) -> CountTable {
    let mut counts = empty_forward_counts();
    for m in moves {
        visit_outcomes([m.ahead_boxes, m.left_boxes, 0.0], &mut |outcome, weight| {
            counts.add(0, forward_class(outcome.ahead, outcome.left), weight);
        });
    }
    counts
}

fn empty_forward_counts() -> CountTable {
    CountTable::new("moves", &["forward".to_string()], &FORWARD_CLASSES.map(String::from))
}

/// Counts turns by side, phase-averaged: the ratio of true to commanded turn gives the result of a
/// turn of 90 degrees in quarters.
fn turn_counts<'t>(turns: impl Iterator<Item = &'t TurnEvent>) -> CountTable {
    let rows = ["left", "right"].map(String::from);
    let mut counts = CountTable::new("turns", &rows, &TURN_CLASSES.map(String::from));
    for turn in turns {
        for &(quarters, weight) in PhaseShares::new(turn.ratio()).as_slice() {
            counts.add(usize::from(!turn.is_left()), turn_class(quarters), weight);
        }
    }
    counts
}

/// The number of values by their nearest multiple of a width.
struct Histogram {
    width: i32,
    bins: BTreeMap<i32, u64>,
}

impl Histogram {
    fn new(width: i32) -> Self {
        Self { width, bins: BTreeMap::new() }
    }

    fn add(&mut self, value: f64) {
        let bin = round_half_up(value / f64::from(self.width)) * self.width;
        *self.bins.entry(bin).or_insert(0) += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_4;

    fn turn(ratio: f64, side: f64) -> TurnEvent {
        let commanded_rad = side * FRAC_PI_4;
        TurnEvent { robot: 0, commanded_rad, true_rad: commanded_rad * ratio, duration_s: None }
    }

    #[test]
    fn a_turn_too_short_fails_as_often_as_it_is_short() {
        let events = Events { moves: vec![], turns: vec![turn(0.75, 1.0), turn(1.25, 1.0)] };
        let counts = events.turn_counts();
        assert_eq!(counts.row(0), [1.5, 0.25, 0.25, 0.0]);
        let options = EstimateOptions { alpha: 0.0, ..Default::default() };
        let profile = events.profile("", &options);
        let p: Vec<_> = profile.action("left").unwrap().iter().map(|t| (t.turn_deg, t.p)).collect();
        assert_eq!(p, [(90, 0.75), (0, 0.125), (180, 0.125)]);
        assert_eq!(profile.action("right").unwrap()[0].turn_deg, -90);
        assert_eq!(profile.assumed, ["right: mirrored from turns to the other side"]);
    }

    #[test]
    fn a_wide_turn_that_overshoots_past_half_a_turn_has_not_turned_back() {
        // 170 degrees were commanded; 190 were made, which a heading shows as -170.
        let turn = TurnEvent::new(170_f64.to_radians(), (-170_f64).to_radians(), None);
        assert!((turn.error_deg() - 20.0).abs() < 1e-9);
        assert_eq!(
            TurnEvent::new(1.0, -1.0, None).true_rad,
            -1.0,
            "it may have turned the other way"
        );
    }

    #[test]
    fn without_turns_an_exact_turn_is_assumed_and_said() {
        let profile = Events::default().profile("", &EstimateOptions::default());
        let left = profile.action("left").unwrap();
        assert_eq!((left.len(), left[0].p), (1, 1.0));
        assert_eq!(profile.assumed, ["left: never fails", "right: never fails"]);
        assert_eq!(turn_report(&Events::default()), None);
    }

    #[test]
    fn histograms_tell_degrees_along_the_turn() {
        let events = Events { moves: vec![], turns: vec![turn(0.9, -1.0), turn(1.0, 1.0)] };
        let report = turn_report(&events).unwrap();
        assert_eq!((report.n_left, report.n_right), (1, 1));
        assert_eq!(report.hist_15deg, BTreeMap::from([(45, 2)]));
        assert_eq!(report.error_hist_5deg, BTreeMap::from([(-5, 1), (0, 1)]));
    }
}
