//! The runs of a sweep, each with the target that opens it.

use crate::encode::problem;
use crate::protocol::{Problem, ReplyBody, SweepRun, TargetRef};
use sidestep_session::sweep::{FinishedRuns, Folder, read_finished};
use std::path::Path;

/// Maximum number of runs listed.
const MAX_RUNS: usize = 20_000;

/// Lists the runs of the sweep in a folder.
///
/// # Errors
/// When it is no sweep, none of its runs is finished, or something in it is damaged.
pub(crate) fn runs(path: &Path) -> Result<ReplyBody, Problem> {
    let folder = Folder::open(path).map_err(|e| problem(&e))?;
    let FinishedRuns { table, is_complete } = read_finished(&folder).map_err(|e| problem(&e))?;
    let plan = folder.plan();
    let names = plan.names();
    let number = |name: &str, row: usize| table.column(name)?.values.number(row);
    let run = |row: usize| {
        let trial = plan.trial_of(number("cell", row)? as u64)?;
        let failure = table.column("failure").map_or_else(String::new, |c| c.values.text(row));
        let recording = folder.run_folder(trial.id);
        // A run that is not recorded is its variant's scenario run with its seed.
        let (kind, replay) = if recording.join("run.json").is_file() {
            ("recording", recording)
        } else {
            ("scenario", folder.scenario(trial.variant))
        };
        Some(SweepRun {
            variant: names.get(trial.variant as usize)?.clone(),
            seed: trial.seed.to_string(),
            failure,
            replay: TargetRef { kind: kind.into(), path: replay.display().to_string() },
        })
    };
    let all = table.runs();
    let runs = (0..all.min(MAX_RUNS)).filter_map(run).collect();
    let left_out = all.saturating_sub(MAX_RUNS) as u64;
    Ok(ReplyBody::Runs { name: plan.name.clone(), is_complete, runs, left_out })
}
