//! The runs of a sweep, each with its results and the target that opens it.

use crate::encode::problem;
use crate::protocol::{Problem, ReplyBody, SweepColumn, SweepOutlier, SweepRun, TargetRef};
use serde::Deserialize;
use sidestep_experiment::sweep::outliers::{OUTLIER_RULE, outliers};
use sidestep_experiment::sweep::{Role, RunColumn, RunTable};
use sidestep_scenario::{MetricLabel, Source, WorldType, Worlds, metric_label};
use sidestep_session::sweep::{FinishedRuns, Folder, read_finished};
use std::collections::BTreeMap;
use std::path::Path;

/// Maximum number of runs listed: a longer list is sent and shown too slowly, and nobody reads it.
const MAX_RUNS: usize = 20_000;
/// Maximum number of results listed of each run.
const MAX_COLUMNS: usize = 40;

/// Share of a value below which a difference is an error of rounding.
const MAX_ROUNDING: f64 = 1e-9;

/// The key of a scenario that says whose results these are.
#[derive(Deserialize)]
struct WorldName {
    world: String,
}

/// Lists the runs of the sweep in a folder.
///
/// # Errors
/// When it is no sweep, none of its runs is finished, or something in it is damaged.
pub(crate) fn list_sweep_runs(path: &Path, worlds: &Worlds) -> Result<ReplyBody, Problem> {
    let folder = Folder::open(path).map_err(|e| problem(&e))?;
    let FinishedRuns { table, is_complete, .. } =
        read_finished(&folder).map_err(|e| problem(&e))?;
    let plan = folder.plan();
    let names = plan.names();
    let world_type = world_type_of(&folder, worlds);
    let (results, columns_left_out) = listed_results(&table, world_type);
    let all = table.runs();
    let mut outliers_of = outliers_by_row(&table, &results);
    let mut runs = Vec::new();
    for row in 0..all.min(MAX_RUNS) {
        let id = table.column("cell").and_then(|column| column.values.number(row));
        let Some(trial) = id.and_then(|id| plan.trial_of(id as u64)) else { continue };
        let Some(variant) = names.get(trial.variant as usize) else { continue };
        let failure = table.column("failure").map_or_else(String::new, |c| c.values.text(row));
        runs.push(SweepRun {
            variant: variant.clone(),
            seed: trial.seed.to_string(),
            failure,
            replay: replay_target(&folder, trial.id, trial.variant),
            values: results.iter().map(|column| finite_number(column, row)).collect(),
            outliers: outliers_of.remove(&row).unwrap_or_default(),
        });
    }
    Ok(ReplyBody::Runs {
        name: plan.name.clone(),
        is_complete,
        columns: results.iter().map(|column| sweep_column(column, world_type)).collect(),
        columns_left_out,
        runs,
        outlier_rule: OUTLIER_RULE.to_string(),
        left_out: all.saturating_sub(MAX_RUNS) as u64,
    })
}

/// Returns the world of a sweep; `None` where the program does not have it.
fn world_type_of<'w>(folder: &Folder, worlds: &'w Worlds) -> Option<&'w dyn WorldType> {
    let source = Source::read(&folder.scenario(0), &[]).ok()?;
    worlds.find(&source.parse::<WorldName>().ok()?.world)
}

/// Returns the results in which runs differ, those that the world is about first, and the number of all others.
fn listed_results<'t>(
    table: &'t RunTable,
    world_type: Option<&dyn WorldType>,
) -> (Vec<&'t RunColumn>, u32) {
    let chart_metrics = world_type.map_or(&[][..], WorldType::chart_metrics);
    let rank = |name: &str| {
        let place = chart_metrics.iter().position(|metric| *metric == name);
        place.unwrap_or(chart_metrics.len())
    };
    let all: Vec<&RunColumn> = table.columns_with_role(Role::Metric).collect();
    let mut listed: Vec<&RunColumn> =
        all.iter().copied().filter(|column| differs(column)).collect();
    listed.sort_by_key(|column| rank(&column.name));
    listed.truncate(MAX_COLUMNS);
    let left_out = (all.len() - listed.len()) as u32;
    (listed, left_out)
}

/// Returns the outliers among the results that are listed, by the row of their run.
fn outliers_by_row(table: &RunTable, results: &[&RunColumn]) -> BTreeMap<usize, Vec<SweepOutlier>> {
    let mut by_row: BTreeMap<usize, Vec<SweepOutlier>> = BTreeMap::new();
    for (place, column) in results.iter().enumerate() {
        for outlier in outliers(table, &[&column.name]) {
            by_row.entry(outlier.row).or_default().push(SweepOutlier {
                column: place as u32,
                is_high: outlier.is_high,
                distance_ranges: Some(outlier.distance_ranges).filter(|ranges| ranges.is_finite()),
            });
        }
    }
    by_row
}

/// Returns whether a column has numbers that differ by more than rounding.
fn differs(column: &RunColumn) -> bool {
    let mut low = f64::INFINITY;
    let mut high = f64::NEG_INFINITY;
    for value in (0..column.values.len()).filter_map(|row| finite_number(column, row)) {
        low = low.min(value);
        high = high.max(value);
    }
    high - low > MAX_ROUNDING * low.abs().max(high.abs())
}

fn finite_number(column: &RunColumn, row: usize) -> Option<f64> {
    column.values.number(row).filter(|value| value.is_finite())
}

fn sweep_column(column: &RunColumn, world_type: Option<&dyn WorldType>) -> SweepColumn {
    let infos = world_type.map_or(&[][..], WorldType::metric_infos);
    let MetricLabel { words, unit, .. } = metric_label(infos, &column.name);
    SweepColumn { key: column.name.clone(), label: words, unit: unit.unwrap_or_default().into() }
}

/// Returns the target that shows a run: its recording, or its variant's scenario, to be run with its seed.
fn replay_target(folder: &Folder, trial: u64, variant: u32) -> TargetRef {
    let recording = folder.run_folder(trial);
    let is_recorded = recording.join("run.json").is_file();
    let kind = if is_recorded { "recording" } else { "scenario" };
    let path = if is_recorded { recording } else { folder.scenario(variant) };
    TargetRef { kind: kind.into(), path: path.display().to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_kernel::ports::ColumnValues;

    #[test]
    fn outliers_are_told_with_their_run_and_the_place_of_their_column() {
        let column = |name: &str, role, values: [f64; 6]| RunColumn {
            name: name.into(),
            role,
            values: ColumnValues::F64(values.into_iter().map(Some).collect()),
        };
        let columns = vec![
            column("variant", Role::Variant, [0.0; 6]),
            column("hops", Role::Metric, [1.0, 2.0, 3.0, 4.0, 5.0, -90.0]),
            column("trips", Role::Metric, [7.0, 7.0, 9.0, 7.0, 7.0, 7.0]),
        ];
        let table = RunTable { columns };
        let [_, hops, trips] = &table.columns[..] else { panic!("three columns") };
        let found = outliers_by_row(&table, &[trips, hops]);
        let high = SweepOutlier { column: 0, is_high: true, distance_ranges: None };
        assert_eq!(found[&2], [high], "the quartiles are equal");
        let [low] = &found[&5][..] else { panic!("one outlier") };
        assert_eq!((low.column, low.is_high), (1, false));
        assert!(low.distance_ranges.is_some_and(|ranges| ranges > 1.5));
        assert_eq!(found.len(), 2);
    }
}
