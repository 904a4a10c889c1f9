//! A robot in an open field of discs, with a target that it sees (slides N4 to N6): readings of
//! "leaving a wall", with and without the rule that a free way to the target ends following a
//! wall, and discs that move as fast as it.

use super::Plan;
use super::runs::{DT_S, SPEED_M_S, Share, begun, draws, finish, grid, head, least, mm};
use crate::farm::Progress;
use serde::Serialize;
use sidestep::kernel::InputError;
use sidestep::kernel::math::{cos, sin};
use sidestep::worlds::chain::geometry::{Point, distance};
use sidestep::worlds::chain::metrics::Metrics;
use sidestep_document::{Figure, FigureKind, Series, Table};
use std::f64::consts::TAU;
use std::fmt::Write;

/// Half the side of the field.
const HALF_M: f64 = 10.0;
/// Start and target, in opposite corners.
const ENDS_M: [Point<2>; 2] = [[-8.5, -8.5], [8.5, 8.5]];
/// Air around them.
const AIR_M: f64 = 1.5;

/// Readings of "leaving a wall", and whether the leave rule is added.
const READINGS: [(&str, bool); 5] =
    [("latched", true), ("latched", false), ("range", true), ("range", false), ("level", false)];

/// What is run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Case {
    /// Discs of 0.2 to 0.5 m.
    pub discs: usize,
    /// Their speed over the robot's; 0 where they stand.
    pub speed_ratio: f64,
    /// When a wall counts as being left.
    pub leaving: &'static str,
    /// Whether a free way to the target ends following a wall.
    pub leave_rule: bool,
}

impl Case {
    fn text(&self, seed: u64, cycles: u64) -> String {
        let Self { discs, speed_ratio, leaving, leave_rule } = self;
        let draws = &mut draws(seed);
        let heading_deg = 360.0 * draws.uniform();
        let [[x, y], target] = ENDS_M;
        let mut text = format!(
            "{}dt_s = {DT_S:?}\n[[chains]]\nconnectors = 1\nat_m = [{x:?}, {y:?}]\n\
             heading_deg = {heading_deg:?}\nrod_m = 0.7\nradius_m = 0.25\nrod_radius_m = 0.05\n\
             [[chains.tasks]]\nkind = \"navigate\"\nspeed_m_s = {SPEED_M_S:?}\npatience_s = 30.0\n\
             navigator = {{ leaving = \"{leaving}\", leave_rule = {leave_rule}, target_m = {target:?} }}\n",
            head::<2>(seed, cycles),
        );
        let mut placed = 0;
        while placed < *discs {
            let [u, v, w, turn] = [0; 4].map(|_: u8| draws.uniform());
            let (at, radius_m) = ([u, v].map(|x| HALF_M * (2.0 * x - 1.0)), 0.2 + 0.3 * w);
            if ENDS_M.iter().any(|end| distance(*end, at) < radius_m + AIR_M) {
                continue;
            }
            // Writing to a string cannot fail.
            let _ = writeln!(text, "[[obstacles]]\nat_m = {at:?}\nradius_m = {radius_m:?}");
            if *speed_ratio > 0.0 {
                let velocity =
                    [cos(TAU * turn), sin(TAU * turn)].map(|x| x * speed_ratio * SPEED_M_S);
                let [lo, hi] = [[-HALF_M - 1.0; 2], [HALF_M + 1.0; 2]];
                let _ = writeln!(text, "velocity_m_s = {velocity:?}\nbounces_m = [{lo:?}, {hi:?}]");
            }
            placed += 1;
        }
        text
    }
}

/// What came of one case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// The case.
    pub case: Case,
    /// Runs that came to the target.
    pub arrived: Share,
    /// Runs in which the robot touched nothing.
    pub untouched: Share,
    /// Steps with the robot in a disc, of all runs,
    pub penetrations: u64,
    /// and steps.
    pub steps: u64,
    /// Vetoes of all runs.
    pub vetoes: u64,
    /// The least distance from a disc.
    pub min_clearance_m: Option<f64>,
}

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fields {
    /// Results by case.
    pub cells: Vec<Cell>,
}

impl Fields {
    pub(super) fn run(plan: &Plan, progress: &mut Progress<'_>) -> Result<Self, InputError> {
        let mut cases = Vec::new();
        for (leaving, leave_rule) in READINGS {
            let case = |discs| Case { discs, speed_ratio: 0.0, leaving, leave_rule };
            cases.extend(std::iter::once(0).chain(plan.discs.iter().copied()).map(case));
        }
        let most = plan.discs.iter().max().copied().unwrap_or(0);
        let moving = |&speed_ratio: &f64| Case {
            discs: most,
            speed_ratio,
            leaving: "latched",
            leave_rule: true,
        };
        cases.extend(plan.speed_ratios.iter().map(moving));
        let run = |case: &Case, seed: u64| -> Result<Metrics, InputError> {
            let mut run = begun::<2>(case.text(seed, plan.field_cycles))?;
            finish(&mut run, |_| ());
            Ok(run.chain_metrics())
        };
        let all = grid((plan, plan.field_seeds), "open field", &cases, progress, run)?;
        Ok(Self { cells: cases.iter().zip(&all).map(|(case, runs)| cell(*case, runs)).collect() })
    }

    /// Cells with discs at rest, of a reading with or without the rule.
    pub(super) fn at_rest(&self, leaving: &str, leave_rule: bool) -> impl Iterator<Item = &Cell> {
        let is_wanted = move |c: &Case| c.leaving == leaving && c.leave_rule == leave_rule;
        self.cells.iter().filter(move |c| c.case.speed_ratio == 0.0 && is_wanted(&c.case))
    }

    /// Cells with discs that move.
    pub(super) fn moving(&self) -> impl Iterator<Item = &Cell> {
        self.cells.iter().filter(|c| c.case.speed_ratio > 0.0)
    }

    pub(super) fn table(&self) -> Table {
        let note = "One robot in 20 m x 20 m, its target in the opposite corner; discs of 0.2 to \
                    0.5 m. Discs that move run into a robot too: it steps aside, but not faster \
                    than it may.";
        let columns = [
            "discs",
            "disc / robot speed",
            "leaving",
            "leave rule",
            "arrived",
            "untouched",
            "steps inside",
            "steps",
            "vetoes",
            "clearance, mm",
        ];
        let mut table = Table::new("A robot in the open", note, &columns);
        for c in &self.cells {
            table.row([
                c.case.discs.to_string(),
                c.case.speed_ratio.to_string(),
                c.case.leaving.into(),
                if c.case.leave_rule { "yes" } else { "no" }.into(),
                c.arrived.to_string(),
                c.untouched.to_string(),
                c.penetrations.to_string(),
                c.steps.to_string(),
                c.vetoes.to_string(),
                mm(c.min_clearance_m),
            ]);
        }
        table
    }

    pub(super) fn figure(&self) -> Figure {
        let readings = [("latched", true), ("latched", false), ("range", true), ("level", false)];
        let series = readings.map(|(leaving, rule)| Series {
            name: format!("{leaving}{}", if rule { ", leave rule" } else { "" }),
            points: self
                .at_rest(leaving, rule)
                .map(|c| c.arrived.point(c.case.discs as f64))
                .collect(),
        });
        Figure {
            title: "Runs that come to their target among discs".into(),
            x_label: "discs".into(),
            y_label: "arrived, %".into(),
            kind: FigureKind::Lines,
            series: series.into(),
            ..Figure::default()
        }
    }
}

fn cell(case: Case, runs: &[Metrics]) -> Cell {
    let sum = |count: fn(&Metrics) -> u64| runs.iter().map(count).sum();
    Cell {
        case,
        arrived: Share::of(runs.iter().map(|m| m.done == 1)),
        untouched: Share::of(runs.iter().map(|m| m.penetrations == 0)),
        penetrations: sum(|m| m.penetrations),
        steps: sum(|m| m.steps),
        vetoes: sum(|m| m.vetoes),
        min_clearance_m: least(runs.iter().map(|m| m.min_clearance_m)),
    }
}
