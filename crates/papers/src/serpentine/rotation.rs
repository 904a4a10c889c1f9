//! Reactions of a rod that hits an obstacle (slide A7): turn to the nearest direction that is free
//! of everything, turn once as the slides say, or do not turn.

use super::SerpentineConfig;
use super::corridor::{ARRIVED, CLEARANCE, ROD_VIOLATION, WIDTH};
use crate::case_results::{
    CaseResults, CaseRuns, Columns, Format, Summary, Value, column, figure, min_value,
};
use crate::study::{Progress, Study, downcast, run_to_end};
use serde::Serialize;
use sidestep::experiment::sweep::Outcome;
use sidestep::kernel::{InputError, Simulation};
use sidestep::worlds::chain::{ChainRun, chain_run};
use sidestep_document::figure::Point;
use sidestep_document::{Figure, Series, Table};

const SCENARIO: &str = include_str!("../../scenarios/serpentine/rotation.toml");
const SWEEP: &str = include_str!("../../scenarios/serpentine/rotation.sweep.toml");
const STEP: &str = "chain.step_m";

/// The rules; the second is the slides'.
pub(super) const RULES: [&str; 3] = ["union", "literal", "never"];

const COLUMNS: Columns = Columns {
    case: &[
        column("rotation", "rotation", Summary::Setting("chain.rotation")),
        column("step_m", "step, m", Summary::Setting(STEP)),
        column("width_m", "width, m", Summary::Setting(WIDTH)),
    ],
    results: &[
        ARRIVED,
        column("progress_percent", "progress, %", Summary::Computed(mean_progress_percent)),
        column("vetoes", "vetoes", Summary::Sum("vetoes")),
        column("penetrations", "steps inside", Summary::Sum("penetrations")),
        column("steps", "steps", Summary::Sum("steps")),
        CLEARANCE,
        column("slave_over_master", "follower / leader", Summary::Computed(slave_over_master))
            .with_format(Format::Decimals(2)),
        ROD_VIOLATION,
    ],
};

fn mean_progress_percent(case: &CaseRuns<'_>) -> Value {
    case.mean_proportion(|run| 100.0 * run.number_or_zero("furthest"))
}

/// Returns the longest step of a follower divided by that of the leader.
fn slave_over_master(case: &CaseRuns<'_>) -> Value {
    Value::Number(case.max_value("max_slave_step_m") / case.setting_number(STEP))
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct RotationResults {
    /// In the order of the sweep's variants.
    #[serde(rename = "cells")]
    pub(super) cases: Vec<CaseResults>,
}

/// Returns the sweep of a plan: corridors of medium width.
pub(super) fn study(plan: &SerpentineConfig) -> Result<Study, InputError> {
    let study = Study::from_file(SWEEP, SCENARIO)?.filtered_by_number(WIDTH, &plan.widths_m);
    Ok(study.filtered_by_number(STEP, &plan.steps_m).with_size(plan.seeds, None))
}

/// Runs to the end, and returns the greatest share of its way that the leader came to have behind it.
fn run_to_furthest(run: &mut dyn Simulation) -> f64 {
    let mut furthest = 0.0_f64;
    run_to_end(run, |run| {
        let run = downcast::<ChainRun<2>>(run);
        let body = run.state().body(0);
        // Once the only task is done there is no way of which to have a share.
        if body.driving.task == 0 {
            furthest = furthest.max(run.world().progress(0, &body));
        }
    });
    let has_arrived = downcast::<ChainRun<2>>(run).metrics().done == 1;
    if has_arrived { 1.0 } else { furthest }
}

impl RotationResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let what = "rules of rotation";
        let results = study(plan)?.run_by(plan.workers, what, progress, |scenario, _, trial| {
            let mut run = chain_run(&scenario()?, 1)?;
            let furthest = run_to_furthest(&mut *run);
            let mut outcome = Outcome::from_simulation(*trial, &*run);
            outcome.metrics.insert("furthest".into(), furthest.into());
            Ok(outcome)
        })?;
        Ok(Self { cases: COLUMNS.cases(&results) })
    }

    /// In the order of the sweep's variants.
    pub(super) fn cases_with_rule<'a>(
        &'a self,
        rotation: &'a str,
    ) -> impl Iterator<Item = &'a CaseResults> {
        self.cases.iter().filter(move |c| c.has_text("rotation", rotation))
    }

    pub(super) fn table(&self) -> Table {
        let note = "15 followers without wheels (connectors of 0.25 m, rods of 0.05 m); progress by \
                    points of the corridor's middle, 0.1 m apart. `literal` is the slides' rule: one \
                    turn to the tangent of the obstacle that is hit nearest to the master.";
        COLUMNS.table("Rules of rotation", note, &self.cases)
    }

    pub(super) fn figure(&self) -> Figure {
        let mut steps_m: Vec<f64> =
            self.cases_with_rule(RULES[0]).map(|c| c.number("step_m")).collect();
        steps_m.dedup();
        let series = RULES.map(|rule| {
            let points =
                steps_m.iter().map(|&s| Point::new(1e3 * s, self.deepest_mm(rule, s))).collect();
            Series { name: rule.into(), points }
        });
        let labels = ["step of the leader, mm", "deepest, mm"];
        figure("How deep parts get into walls, by rule of rotation", labels, series)
    }

    /// Returns how deep a part was in a wall at most, over all widths.
    fn deepest_mm(&self, rule: &str, step_m: f64) -> f64 {
        let cases = self.cases_with_rule(rule).filter(|c| c.number("step_m") == step_m);
        let clearances_m = cases.map(|c| c.optional_number("min_clearance_m"));
        let least_m = min_value(clearances_m).unwrap_or(0.0);
        1e3 * (-least_m).max(0.0)
    }
}
