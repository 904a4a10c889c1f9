//! The results of a finished sweep, for programs.

use super::folder::Folder;
use super::run::SweepResult;
use super::timing::SweepTiming;
use crate::files::display_path;
use serde_json::{Value, json};
use sidestep_experiment::sweep::rounds::variant_stops;
use sidestep_experiment::sweep::{Plan, RunTable, SeriesBand, Summary, series_bands};

impl SweepResult {
    /// Returns the output of `sidestep sweep --json`: the summary, the number of failed runs, the reason why each
    /// variant stopped, and the means of metrics over time.
    pub fn to_json(&self, plan: &Plan, folder: Option<&Folder>, summary: &Summary) -> Value {
        json!({
            "status": "complete",
            "name": plan.name,
            "world": plan.world,
            "parameters": plan.parameters,
            "first_seed": plan.first_seed,
            "runs": self.table.runs(),
            "failed": failed_rows(&self.table).count(),
            "stopped": variant_stops(plan, &self.table),
            "took": (self.effort.runs > 0).then(|| self.effort.to_json()),
            "results": folder.map(|folder| display_path(folder.results_file())),
            "summary": summary,
            "bands": self.bands_json(plan),
        })
    }

    /// Returns the means of metrics over time as columns: item k of each is of the same cycle.
    fn bands_json(&self, plan: &Plan) -> Vec<Value> {
        let names = plan.names();
        let band_json = |band: SeriesBand| {
            let SeriesBand { variant, metric, points } = band;
            let low = points.iter().map(|point| point.interval.map(|interval| interval.low));
            let high = points.iter().map(|point| point.interval.map(|interval| interval.high));
            json!({
                "variant": variant,
                "name": names.get(variant as usize),
                "metric": metric,
                "cycle": points.iter().map(|point| point.cycle).collect::<Vec<_>>(),
                "runs": points.iter().map(|point| point.runs).collect::<Vec<_>>(),
                "mean": points.iter().map(|point| point.mean).collect::<Vec<_>>(),
                "mean_low": low.collect::<Vec<_>>(),
                "mean_high": high.collect::<Vec<_>>(),
            })
        };
        series_bands(&self.table, &self.series).into_iter().map(band_json).collect()
    }
}

/// Returns the rows of runs that failed, in the order of the table.
pub fn failed_rows(table: &RunTable) -> impl Iterator<Item = usize> {
    let column = table.column("failure");
    (0..table.runs())
        .filter(move |row| column.is_some_and(|column| !column.values.text(*row).is_empty()))
}

impl SweepTiming {
    /// Returns the status for programs.
    pub fn to_json(&self) -> Value {
        json!({
            "runs": self.runs,
            "at_once": self.at_once,
            "wall_s": self.wall_s,
            "simulation_s_per_run": self.simulation_s_per_run(),
            "overhead_ms_per_run": self.overhead_ms_per_run(),
        })
    }
}
