//! The runs of a sweep, each with the target that opens it.

use crate::encode::problem;
use crate::protocol::{Problem, ReplyBody, SweepRun, TargetRef};
use sidestep_session::sweep::{FinishedRuns, Folder, read_finished};
use std::path::Path;

/// Maximum number of runs listed: a longer list is sent and shown too slowly, and nobody reads it.
const MAX_RUNS: usize = 20_000;

/// Lists the runs of the sweep in a folder.
///
/// # Errors
/// When it is no sweep, none of its runs is finished, or something in it is damaged.
pub(crate) fn list_sweep_runs(path: &Path) -> Result<ReplyBody, Problem> {
    let folder = Folder::open(path).map_err(|e| problem(&e))?;
    let FinishedRuns { table, is_complete, .. } =
        read_finished(&folder).map_err(|e| problem(&e))?;
    let plan = folder.plan();
    let names = plan.names();
    let all = table.runs();
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
        });
    }
    let left_out = all.saturating_sub(MAX_RUNS) as u64;
    Ok(ReplyBody::Runs { name: plan.name.clone(), is_complete, runs, left_out })
}

/// Returns the target that shows a run: its recording, or its variant's scenario, to be run with its seed.
fn replay_target(folder: &Folder, trial: u64, variant: u32) -> TargetRef {
    let recording = folder.run_folder(trial);
    let is_recorded = recording.join("run.json").is_file();
    let kind = if is_recorded { "recording" } else { "scenario" };
    let path = if is_recorded { recording } else { folder.scenario(variant) };
    TargetRef { kind: kind.into(), path: path.display().to_string() }
}
