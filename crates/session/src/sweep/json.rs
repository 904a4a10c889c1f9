//! The results of a finished sweep, for programs.

use super::folder::Folder;
use super::run::SweepResult;
use super::timing::SweepTiming;
use crate::files::display_path;
use serde_json::{Value, json};
use sidestep_experiment::sweep::rounds::variant_stops;
use sidestep_experiment::sweep::{Plan, RunTable, Summary};

impl SweepResult {
    /// Returns the output of `sidestep sweep --json`: the summary, the number of failed runs, and the reason why each
    /// variant stopped.
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
        })
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
