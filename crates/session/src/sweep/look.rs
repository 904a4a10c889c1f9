//! The parts of a sweep that a report needs: its finished runs, and pictures of some.

use super::gather::{Folder, gather, table_of};
use super::work::recorded;
use crate::watcher::Within;
use crate::{Error, Watcher};
use sidestep::experiment::sweep::{Cell, Rows, RunTable};
use sidestep::kernel::InputError;
use sidestep::scenario::{Source, Worlds};
use std::path::Path;

/// The finished runs of a sweep.
pub struct Finished {
    /// One row per run, with the times that it took.
    pub table: RunTable,
    /// Whether these are all runs.
    pub is_complete: bool,
}

/// Returns the finished runs of a sweep, whether it is done or in progress.
///
/// # Errors
/// When there are none, or they cannot be read.
pub fn finished(folder: &Folder) -> Result<Finished, InputError> {
    if folder.is_complete() {
        let mut table = table_of(folder.results()?);
        let costs = table_of(folder.timings()?).columns;
        let has = |name: &str| table.columns.iter().any(|c| c.name == name);
        let costs: Vec<_> = costs.into_iter().filter(|c| !has(&c.name)).collect();
        table.columns.extend(costs);
        return Ok(Finished { table, is_complete: true });
    }
    let mut rows = Rows::default();
    gather(folder, None, |outcome| rows.push(&outcome))?;
    if rows.is_empty() {
        let remedy = "run it first: sidestep resume DIR";
        return Err(InputError::new(folder.path().display(), "no run is finished yet", remedy));
    }
    Ok(Finished { table: rows.table(folder.plan())?, is_complete: false })
}

/// Returns the picture of a cell's run, as SVG: from its run folder, or from a run made again for
/// it.
///
/// # Errors
/// When the run cannot be made again.
pub(crate) fn picture_of(
    worlds: Worlds,
    folder: &Folder,
    cell: Cell,
    watcher: &dyn Watcher,
) -> Result<Option<String>, Error> {
    let kept = folder.run_folder(cell.id);
    if let Some(svg) = picture_in(&kept) {
        return Ok(Some(svg));
    }
    let place = tempfile::tempdir().map_err(|e| Error::write(&std::env::temp_dir(), &e))?;
    let again = place.path().join("run");
    let source = Source::read(&folder.scenario(cell.variant), &[])?;
    recorded(worlds, cell, source, 1, &again, &Within(watcher))?;
    Ok(picture_in(&again))
}

fn picture_in(run: &Path) -> Option<String> {
    std::fs::read_to_string(run.join("trajectories.svg")).ok()
}
