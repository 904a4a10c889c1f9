//! A recorded flight in real time: it is closed where its recording ends, and never continued unasked.

use crate::driver::{RunTiming, Sinks, drive};
use crate::orders::replay_recorded;
use crate::run_recorder::start_recorded;
use crate::run_tables::read_summary;
use crate::summary::{RunCost, Summary, SummaryFile};
use crate::watcher::{NoWatcher, Watcher};
use crate::{Error, picture};
use serde_json::Value;
use sidestep_kernel::ports::Recorder;
use sidestep_kernel::shell::sidestep_command;
use sidestep_kernel::{Cycle, InputError, Simulation};
use sidestep_record::{Manifest, RunFolder, RunReader};
use sidestep_scenario::Worlds;
use std::path::Path;
use std::time::Duration;

/// A flight that ended before its planned end.
#[derive(Debug)]
pub struct CutFlight {
    /// Number of cycles flown.
    pub cycles: Cycle,
    /// Cycles planned.
    pub planned: Cycle,
    /// The content of `summary.json`; `None` if the build that flew is another one, or nothing was flown.
    pub summary: Option<Value>,
    path: std::path::PathBuf,
}

impl CutFlight {
    /// Returns the error of a request to continue the flight.
    pub fn to_error(&self) -> Error {
        let Self { cycles, planned, path, .. } = self;
        let cause = format!("{}: {}", path.display(), cut_off_text(*cycles, *planned));
        Error::other(cause, flight_remedy(path))
    }
}

/// Returns how far a flight came that was cut off.
pub fn cut_off_text(cycles: Cycle, planned: Cycle) -> String {
    format!(
        "flown until cycle {cycles} of {planned}, cut off; a flight in real time cannot be continued"
    )
}

/// Returns the error of a request to continue a flight.
pub(crate) fn flight_error(path: &Path, manifest: &Manifest) -> InputError {
    let cause = cut_off_text(manifest.cycles_done, manifest.cycles_planned);
    InputError::new(path.display(), cause, flight_remedy(path))
}

fn flight_remedy(path: &Path) -> String {
    let report = sidestep_command("report", path);
    let simulate = sidestep_command("resume", path);
    format!(
        "`{report}` shows what was flown; `{simulate} --simulate` computes the other cycles, and marks \
         them as simulated"
    )
}

/// Closes the recording of a flight whose server was killed: its tables end with the last cycle that all of them
/// have. Of a flight that was closed already, nothing changes.
///
/// # Errors
/// When another process still writes it, a table is damaged, or the folder cannot be written.
pub fn close_flight(
    worlds: &Worlds,
    path: &Path,
    watcher: &dyn Watcher,
) -> Result<CutFlight, Error> {
    let reader = RunReader::open(path)?;
    if !reader.manifest.is_cut_off {
        close(worlds, RunFolder::reopen(path)?, watcher)?;
    }
    let manifest = RunReader::open(path)?.manifest;
    Ok(CutFlight {
        cycles: manifest.cycles_done,
        planned: manifest.cycles_planned,
        summary: read_summary(path)?,
        path: path.to_path_buf(),
    })
}

fn close(worlds: &Worlds, folder: RunFolder, watcher: &dyn Watcher) -> Result<(), Error> {
    let end = folder.trim_flight()?;
    match start_recorded(worlds, &folder, 1) {
        Ok(run) => {
            // Of a run of its own: one that records must hand its rows over, and these were flown already.
            let mut recorded = start_recorded(worlds, &folder, 1)?;
            recorded.start_recording();
            folder.recorder(&recorded.schemas(), end)?.finish()?;
            store_flight(run, &folder, watcher)?;
        }
        // Another build flew: the rows are whole, only their summary cannot be computed.
        Err(error) => watcher.warn(&error.into()),
    }
    Ok(folder.cut_off(end, None)?)
}

/// Computes the summary and the picture of what was flown.
fn store_flight(
    mut run: Box<dyn Simulation>,
    folder: &RunFolder,
    watcher: &dyn Watcher,
) -> Result<(), Error> {
    let timing = replay_flight(run.as_mut(), folder)?;
    if let Err(error) = picture::draw_run(run.as_mut(), folder) {
        watcher.warn(&error);
    }
    let cost = RunCost { workers: 1, timing, recording: Duration::ZERO };
    let summary = Summary::new(run.as_ref(), cost, Some(folder.path()));
    let per_agent = run.agent_metrics();
    let per_pair = run.pair_metrics();
    folder.write_summary(&SummaryFile { summary: &summary, per_agent, per_pair })?;
    Ok(())
}

/// Sets a run to the end of a recorded flight, by the controls that were flown.
///
/// # Errors
/// When the controls are damaged.
pub(crate) fn replay_flight(
    run: &mut dyn Simulation,
    folder: &RunFolder,
) -> Result<RunTiming, Error> {
    replay_recorded(run, folder.path())?;
    drive(run, folder.manifest().cycles_done, Sinks::default(), &NoWatcher)
}
