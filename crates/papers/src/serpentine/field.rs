//! A robot in an open field of discs, with a target that it sees (slides N4 to N6): readings of
//! "leaving a wall", with and without the rule that a free way to the target ends following a
//! wall, and discs that move as fast as it.

use super::corridor::{ARRIVED, CLEARANCE};
use super::{SPEED_M_S, SerpentineConfig, draws};
use crate::case_results::{CaseResults, CaseRuns, Columns, Summary, Value, column, figure, series};
use crate::study::{Progress, Study, setting, setting_number};
use serde::Serialize;
use sidestep::experiment::sweep::{Setting, Variant, start_trial};
use sidestep::kernel::InputError;
use sidestep::kernel::math::{cos, sin};
use sidestep::kernel::stream::Draws;
use sidestep::rods::geometry::{Point, distance};
use sidestep::worlds::WORLDS;
use sidestep_document::{Figure, Table};
use std::f64::consts::TAU;
use toml::Value as TomlValue;

const SCENARIO: &str = include_str!("../../scenarios/serpentine/field.toml");

/// Half the side of the field.
const HALF_M: f64 = 10.0;
/// Start and target, in opposite corners.
const ENDS_M: [Point<2>; 2] = [[-8.5, -8.5], [8.5, 8.5]];
/// Free distance around them.
const MIN_CLEARANCE_M: f64 = 1.5;

/// Readings of "leaving a wall", and whether the leave rule is added.
const READINGS: [Reading; 5] = [
    Reading { leaving: "latched", leave_rule: true },
    Reading { leaving: "latched", leave_rule: false },
    Reading { leaving: "range", leave_rule: true },
    Reading { leaving: "range", leave_rule: false },
    Reading { leaving: "level", leave_rule: false },
];

/// A reading of the slides: when a wall counts as being left, and whether a free way to the target
/// ends following a wall.
#[derive(Clone, Copy)]
struct Reading {
    leaving: &'static str,
    leave_rule: bool,
}

const COLUMNS: Columns = Columns {
    case: &[
        column("discs", "discs", Summary::Setting("discs")),
        column("speed_ratio", "disc / robot speed", Summary::Setting("speed_ratio")),
        column("leaving", "leaving", Summary::Setting("leaving")),
        column("leave_rule", "leave rule", Summary::Setting("leave_rule")),
    ],
    results: &[
        ARRIVED,
        column("untouched", "untouched", Summary::Computed(untouched)),
        column("penetrations", "steps inside", Summary::Sum("penetrations")),
        column("steps", "steps", Summary::Sum("steps")),
        column("vetoes", "vetoes", Summary::Sum("vetoes")),
        CLEARANCE,
    ],
};

fn untouched(case: &CaseRuns<'_>) -> Value {
    case.proportion(|run| !run.is_true("penetrations"))
}

/// Returns the settings of a case: discs of 0.2 to 0.5 m, their speed divided by the robot's (0 if
/// they stand), and a reading.
fn case(discs: usize, speed_ratio: f64, reading: Reading) -> Vec<Setting> {
    vec![
        setting("discs", discs as i64),
        setting("speed_ratio", speed_ratio),
        setting("leaving", reading.leaving),
        setting("leave_rule", reading.leave_rule),
    ]
}

fn cases(plan: &SerpentineConfig) -> Vec<Vec<Setting>> {
    let mut cases = Vec::new();
    for reading in READINGS {
        // The slides' layers must lead to a target in an empty field, too.
        cases.push(case(0, 0.0, reading));
        for &discs in &plan.discs {
            cases.push(case(discs, 0.0, reading));
        }
    }
    let most_discs = plan.discs.iter().max().copied().unwrap_or(0);
    for &speed_ratio in &plan.speed_ratios {
        cases.push(case(most_discs, speed_ratio, READINGS[0]));
    }
    cases
}

/// Returns the settings of a case with this seed in the scenario: the robot's heading and the
/// discs.
fn settings(case: &Variant, seed: u64) -> Vec<Setting> {
    let draws = &mut draws(seed);
    let heading_deg = 360.0 * draws.uniform();
    let mut discs: Vec<TomlValue> = Vec::new();
    while discs.len() < setting_number(case, "discs") as usize {
        discs.extend(disc(draws, setting_number(case, "speed_ratio")));
    }
    let navigator = "chains.tasks.navigator";
    let mut settings =
        vec![setting("chains.heading_deg", heading_deg), setting("obstacles", discs)];
    for key in ["leaving", "leave_rule"] {
        let value = case.value(key).cloned().unwrap_or(TomlValue::Boolean(false));
        settings.push(Setting { key: [navigator, key].join("."), value });
    }
    settings
}

/// Returns a random disc, if it leaves room around start and target.
fn disc(draws: &mut Draws, speed_ratio: f64) -> Option<TomlValue> {
    // All draws come first, so that a disc at rest and one that moves stand at the same place.
    let [u, v, w, turn] = [0; 4].map(|_: u8| draws.uniform());
    let at: Point<2> = [u, v].map(|x| HALF_M * (2.0 * x - 1.0));
    let radius_m = 0.2 + 0.3 * w;
    if ENDS_M.iter().any(|end| distance(*end, at) < radius_m + MIN_CLEARANCE_M) {
        return None;
    }
    let mut disc = toml::Table::new();
    disc.insert("at_m".into(), toml_point(at));
    disc.insert("radius_m".into(), radius_m.into());
    if speed_ratio > 0.0 {
        let velocity = [cos(TAU * turn), sin(TAU * turn)].map(|x| x * speed_ratio * SPEED_M_S);
        let bounds = [[-HALF_M - 1.0; 2], [HALF_M + 1.0; 2]].map(toml_point);
        disc.insert("velocity_m_s".into(), toml_point(velocity));
        disc.insert("bounces_m".into(), bounds.to_vec().into());
    }
    Some(disc.into())
}

fn toml_point(point: Point<2>) -> TomlValue {
    TomlValue::from(point.to_vec())
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct FieldResults {
    /// By reading and number of discs at rest, then by the speed of discs that move.
    #[serde(rename = "cells")]
    pub(super) cases: Vec<CaseResults>,
}

impl FieldResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let study = Study::from_variants(SCENARIO, cases(plan))
            .with_size(plan.field_seeds, Some(plan.field_cycles));
        let results = study.run_by(plan.workers, "open field", progress, |_, case, trial| {
            let source = study.scenario_with(&settings(case, trial.seed))?;
            let run = start_trial(&WORLDS, *trial, &source, 1)?;
            Ok(run.run(&|| true).expect("nobody stops it"))
        })?;
        Ok(Self { cases: COLUMNS.cases(&results) })
    }

    /// Returns cases with discs at rest, for a reading with or without the rule.
    pub(super) fn at_rest(
        &self,
        leaving: &str,
        leave_rule: bool,
    ) -> impl Iterator<Item = &CaseResults> {
        let at_rest = self.cases.iter().filter(|c| c.number("speed_ratio") == 0.0);
        at_rest.filter(move |c| {
            c.has_text("leaving", leaving) && c.is_true("leave_rule") == leave_rule
        })
    }

    /// All of them have the first of the [`READINGS`].
    pub(super) fn moving(&self) -> impl Iterator<Item = &CaseResults> {
        self.cases.iter().filter(|c| c.number("speed_ratio") > 0.0)
    }

    pub(super) fn table(&self) -> Table {
        let note = "One robot in 20 m x 20 m, its target in the opposite corner; discs of 0.2 to \
                    0.5 m. Discs that move run into a robot too: it steps aside, but not faster \
                    than it may.";
        COLUMNS.table("A robot in the open", note, &self.cases)
    }

    pub(super) fn figure(&self) -> Figure {
        let readings = [("latched", true), ("latched", false), ("range", true), ("level", false)];
        let lines = readings.map(|(leaving, rule)| {
            let name = format!("{leaving}{}", if rule { ", leave rule" } else { "" });
            series(name, self.at_rest(leaving, rule), ["discs", "arrived"])
        });
        figure("Runs that come to their target among discs", ["discs", "arrived, %"], lines)
    }
}
