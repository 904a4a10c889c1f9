//! A snake of 450 and more connectors creeps at random through space (slides E1, V6, F4): among
//! balls that stand, and balls that fly.

use super::corridor::{CLEARANCE, MAX_SPEED, OWN_GAP, ROD_VIOLATION};
use super::{DT_S, SerpentineConfig};
use crate::case_results::{CaseResults, CaseRuns, Columns, Format, Summary, Value, column};
use crate::study::{Progress, Study, setting_number};
use crate::trial_file::TrialFile;
use serde::Serialize;
use sidestep::experiment::sweep::Variant;
use sidestep::kernel::InputError;
use sidestep_document::Table;

/// The scenario, of which a picture shows a run as well.
pub(super) const SCENARIO: &str = include_str!("../../scenarios/serpentine/snake.toml");
const SWEEP: &str = include_str!("../../scenarios/serpentine/snake.sweep.toml");
const CONNECTORS: &str = "chains.connectors";

const COLUMNS: Columns = Columns {
    case: &[
        column("connectors", "connectors", Summary::Setting(CONNECTORS)),
        column("filled", "filled, %", Summary::Computed(filled))
            .with_format(Format::Computed(format_filled)),
        column("movers", "flying balls", Summary::Computed(movers)),
    ],
    results: &[
        column("steps_per_s", "steps / CPU s", Summary::Mean("steps_per_cpu_s")),
        column("real_time", "times real time", Summary::Computed(mean_real_time)),
        column("veto_percent", "vetoes, %", Summary::RatePercent("vetoes")),
        column("penetrations", "steps inside", Summary::Sum("penetrations")),
        column("steps", "steps", Summary::Sum("steps")),
        CLEARANCE,
        OWN_GAP,
        MAX_SPEED,
        column("way_percent", "way, %", Summary::Computed(mean_way_percent)),
        ROD_VIOLATION,
    ],
};

fn filled(case: &CaseRuns<'_>) -> Value {
    Value::Number(of_fields(case.variant(), "part"))
}

fn format_filled(case: &CaseResults) -> String {
    (100.0 * case.number("filled")).to_string()
}

/// Returns the number of balls that fly: fields of those that stand give a share to fill, and no number.
fn movers(case: &CaseRuns<'_>) -> Value {
    Value::Count(of_fields(case.variant(), "n") as u64)
}

fn mean_real_time(case: &CaseRuns<'_>) -> Value {
    case.mean_of(|run| run.number_or_zero("steps_per_cpu_s") * DT_S)
}

fn mean_way_percent(case: &CaseRuns<'_>) -> Value {
    case.mean_proportion(|run| 100.0 * run.number_or_zero("progress"))
}

/// Returns the total of a key over the fields of a case.
fn of_fields(case: &Variant, key: &str) -> f64 {
    // From 0, because the sum of none is -0.
    let mut total = 0.0;
    for field in case.value("fields").and_then(toml::Value::as_array).into_iter().flatten() {
        total += match field.get(key) {
            Some(toml::Value::Float(x)) => *x,
            Some(toml::Value::Integer(n)) => *n as f64,
            _ => continue,
        };
    }
    total
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct SnakeResults {
    /// In the order of the sweep's variants.
    #[serde(rename = "cells")]
    pub(super) cases: Vec<CaseResults>,
}

/// The sweep's variants that have the plan's numbers of connectors.
pub(super) fn study(plan: &SerpentineConfig) -> Result<Study, InputError> {
    let study = Study::from_file(SWEEP, SCENARIO)?;
    let study = study
        .filtered(|v| plan.snake_connectors.contains(&(setting_number(v, CONNECTORS) as usize)));
    Ok(study.with_size(plan.snake_seeds, Some(plan.snake_cycles)))
}

impl SnakeResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let results =
            study(plan)?.run(plan.workers, "snake in space", &TrialFile::none(), progress)?;
        Ok(Self { cases: COLUMNS.cases(&results) })
    }

    /// Returns cases among balls that all stand.
    pub(super) fn at_rest(&self) -> impl Iterator<Item = &CaseResults> {
        self.cases.iter().filter(|c| c.count("movers") == 0 && c.number("filled") > 0.0)
    }

    pub(super) fn table(&self) -> Table {
        let note = "Rods of 0.1 m, balls of 0.4 m in a room of 16 m, in which the snake lies in folds at \
                    the start, with balls between them; steps of 1 cm; a step includes looking for the least distance of every part. Real time is 50 steps \
                    a second.";
        COLUMNS.table("A snake in space", note, &self.cases)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_room_without_balls_is_filled_by_nothing_not_by_less() {
        let none = of_fields(&Variant::default(), "part");
        assert_eq!(none.to_string(), "0");
    }
}
