//! Reactions of a rod that hits an obstacle (slide A7): turn to the nearest direction that is free
//! of everything, turn once as the slides say, or do not turn.

use super::SerpentineConfig;
use super::corridor::{CLEARANCE, ROD_VIOLATION, WIDTH};
use crate::cells::{CaseResults, Columns, Value, column, figure, min_value};
use crate::study::{Progress, Study, downcast, run_to_end};
use serde::Serialize;
use sidestep::experiment::sweep::Outcome;
use sidestep::kernel::InputError;
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
        column("rotation", "rotation", |r| r.setting("chain.rotation")),
        column("step_m", "step, m", |r| r.setting(STEP)),
        column("width_m", "width, m", |r| r.setting(WIDTH)),
    ],
    results: &[
        column("arrived", "arrived", |r| r.proportion(|run| run.number_or_zero("done") == 1.0)),
        column("progress_percent", "progress, %", |r| {
            r.mean_proportion(|run| 100.0 * run.number_or_zero("furthest"))
        }),
        column("vetoes", "vetoes", |r| r.sum("vetoes")),
        column("penetrations", "steps inside", |r| r.sum("penetrations")),
        column("steps", "steps", |r| r.sum("steps")),
        CLEARANCE,
        column("slave_over_master", "follower / leader", |r| {
            Value::Number(r.max_value("max_slave_step_m") / r.setting_number(STEP))
        })
        .with_format(|c| format!("{:.2}", c.number("slave_over_master"))),
        ROD_VIOLATION,
    ],
};

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct RotationResults {
    /// Results by case.
    pub(super) cells: Vec<CaseResults>,
}

/// Returns the sweep of a plan: corridors of medium width.
pub(super) fn study(plan: &SerpentineConfig) -> Result<Study, InputError> {
    let study = Study::from_file(SWEEP, SCENARIO)?.filtered_by_number(WIDTH, &plan.widths_m);
    Ok(study.filtered_by_number(STEP, &plan.steps_m).with_size(plan.seeds, None))
}

impl RotationResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let what = "rules of rotation";
        let results = study(plan)?.run_by(plan.workers, what, progress, |scenario, _, cell| {
            let mut run = chain_run(&scenario()?, 1)?;
            let mut furthest = 0.0_f64;
            run_to_end(&mut *run, |run| {
                let run = downcast::<ChainRun<2>>(run);
                let body = run.state().body(0);
                if body.driving.task == 0 {
                    furthest = furthest.max(run.world().progress(0, &body));
                }
            });
            let furthest =
                if downcast::<ChainRun<2>>(&*run).metrics().done == 1 { 1.0 } else { furthest };
            let mut outcome = Outcome::from_simulation(*cell, &*run);
            outcome.metrics.insert("furthest".into(), furthest.into());
            Ok(outcome)
        })?;
        Ok(Self { cells: COLUMNS.cells(&results) })
    }

    /// Returns the cells of a rule.
    pub(super) fn cells_with_rule<'a>(
        &'a self,
        rotation: &'a str,
    ) -> impl Iterator<Item = &'a CaseResults> {
        self.cells.iter().filter(move |c| c.has_text("rotation", rotation))
    }

    pub(super) fn table(&self) -> Table {
        let note = "15 followers without wheels (connectors of 0.25 m, rods of 0.05 m); progress by \
                    points of the corridor's middle, 0.1 m apart. `literal` is the slides' rule: one \
                    turn to the tangent of the obstacle that is hit nearest to the master.";
        COLUMNS.table("Rules of rotation", note, &self.cells)
    }

    pub(super) fn figure(&self) -> Figure {
        let mut steps_m: Vec<f64> =
            self.cells_with_rule(RULES[0]).map(|c| c.number("step_m")).collect();
        steps_m.dedup();
        let deepest = |rule: &str, step_m: f64| {
            let cells = self.cells_with_rule(rule).filter(|c| c.number("step_m") == step_m);
            let least_m =
                min_value(cells.map(|c| c.optional_number("min_clearance_m"))).unwrap_or(0.0);
            1e3 * (-least_m).max(0.0)
        };
        let series = RULES.map(|rule| Series {
            name: rule.into(),
            points: steps_m.iter().map(|&s| Point::new(1e3 * s, deepest(rule, s))).collect(),
        });
        let labels = ["step of the leader, mm", "deepest, mm"];
        figure("How deep parts get into walls, by rule of rotation", labels, series)
    }
}
