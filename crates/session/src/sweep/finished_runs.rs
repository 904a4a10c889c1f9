//! The parts of a sweep that a report needs: its finished runs, and pictures of some.

use super::folder::{Folder, check_build, for_each_outcome, to_run_table};
use super::trial_runner::RecordedTrial;
use crate::watcher::NestedWatcher;
use crate::{Error, Watcher, picture};
use sidestep_experiment::sweep::{RunTable, RunTableBuilder, Trial};
use sidestep_kernel::InputError;
use sidestep_kernel::shell::sidestep_command;
use sidestep_record::RunReader;
use sidestep_scenario::{Source, Worlds};
use std::path::Path;

/// The runs of a sweep in progress or done, for readers that need the whole table.
pub struct FinishedRuns {
    /// One row per run, with the times that it took.
    pub table: RunTable,
    /// Their metrics over time, one row per run and cycle; without columns where none were kept.
    pub series: RunTable,
    /// Whether these are all planned runs.
    pub is_complete: bool,
}

/// Returns the finished runs of a sweep, whether it is done or in progress.
///
/// # Errors
/// When there are none, or they cannot be read.
pub fn read_finished(folder: &Folder) -> Result<FinishedRuns, InputError> {
    if folder.is_complete() {
        let mut table = to_run_table(folder.results()?);
        let costs = to_run_table(folder.timings()?).columns;
        // Both tables identify a run by the same columns.
        for cost in costs {
            if table.column(&cost.name).is_none() {
                table.columns.push(cost);
            }
        }
        let series = read_series(folder)?;
        return Ok(FinishedRuns { table, series, is_complete: true });
    }
    let mut rows = RunTableBuilder::default();
    for_each_outcome(folder, None, |outcome| rows.push(&outcome))?;
    if rows.is_empty() {
        let remedy = format!("run it first: `{}`", sidestep_command("resume", folder.path()));
        return Err(InputError::new(folder.path().display(), "no run is finished yet", remedy));
    }
    let (table, series) = rows.build(folder.plan())?.split_series();
    Ok(FinishedRuns { table, series, is_complete: false })
}

/// Returns the metrics over time of a sweep that is done; without columns where none were kept.
pub(super) fn read_series(folder: &Folder) -> Result<RunTable, InputError> {
    Ok(folder.series()?.map(to_run_table).unwrap_or_default())
}

/// Returns the picture of the run of a trial that ended with `digest`, as SVG: from its run folder, or from a repeated
/// run. If there is none of that very run, returns the reason.
///
/// # Errors
/// When nothing can be stored, or the watcher asks to stop.
pub(crate) fn run_picture(
    worlds: &Worlds,
    folder: &Folder,
    trial: Trial,
    digest: &str,
    watcher: &dyn Watcher,
) -> Result<Result<String, String>, Error> {
    let recorded = folder.run_folder(trial.id);
    if let Some(svg) = stored_picture(&recorded) {
        let reader = RunReader::open(&recorded);
        if let Ok(reader) = &reader {
            reader.check_files(|name| name == picture::NAMES[0])?;
        }
        let made = reader.ok().and_then(|view| view.manifest.digest);
        if made.as_deref() == Some(digest) {
            return Ok(Ok(svg));
        }
        return Ok(Err(format!("the run in {} is another one", recorded.display())));
    }
    // Another build or another scenario makes another run.
    if let Err(e) = check_build(worlds, folder).and_then(|()| folder.check_variant(trial.variant)) {
        return Ok(Err(e.cause().to_string()));
    }
    let place = tempfile::tempdir().map_err(|e| Error::cannot_write(&std::env::temp_dir(), &e))?;
    let again = place.path().join("run");
    let source = Source::read(&folder.scenario(trial.variant), &[])?;
    let series = folder.plan().series.as_deref();
    let repeated = RecordedTrial { trial, source, workers: 1, folder: &again, series };
    let outcome = match repeated.run(worlds, &NestedWatcher(watcher)) {
        Err(Error::Input(e)) => return Ok(Err(e.cause().to_string())),
        result => result?.ok_or(Error::Interrupted)?,
    };
    if outcome.digest != digest {
        return Ok(Err(format!("run again, it gives the digest {}", outcome.digest)));
    }
    Ok(stored_picture(&again).ok_or_else(|| "it could not be drawn".to_string()))
}

fn stored_picture(run: &Path) -> Option<String> {
    std::fs::read_to_string(run.join("trajectories.svg")).ok()
}
