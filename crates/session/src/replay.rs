//! A recorded run computed again: to its end, or up to any cycle.

use crate::compare::compare_poses;
use crate::compare_rows::RowComparison;
use crate::driver::{RunTiming, Sinks, drive};
use crate::picture::{PictureLook, draw_svg, footnote, write_png};
use crate::{Error, RecordedRun, Watcher};
use sidestep_kernel::shell::sidestep_command;
use sidestep_kernel::{Cycle, InputError, Simulation};
use std::path::Path;

/// The result of computing a run again.
pub struct ReplayReport {
    /// The run, at the requested cycle.
    pub run: Box<dyn Simulation>,
    /// Cycles and time that this took.
    pub effort: RunTiming,
    /// Number of recorded poses of that cycle that were compared.
    pub compared_poses: usize,
    /// Number of recorded rows that were compared, of all tables.
    pub compared_rows: u64,
}

/// Computes the whole run again, and compares its last state with the recorded digest, and all of its rows with the
/// recorded tables, where there are any.
///
/// # Errors
/// When no digest is recorded, or it differs, or a row does; [`Error::Interrupted`] when the watcher asked to
/// stop.
pub fn replay_all(
    recorded: &RecordedRun,
    workers: usize,
    watcher: &dyn Watcher,
) -> Result<ReplayReport, Error> {
    if recorded.is_flight && recorded.digest.is_none() {
        let cause = format!(
            "the flight was cut off after {} cycles: no digest of its last state is recorded",
            recorded.cycles_done
        );
        let remedy = format!("give a --cycle, 0 to {}", recorded.cycles_done);
        return Err(InputError::new(recorded.path.display(), cause, remedy).into());
    }
    if recorded.digest.is_none() {
        let resume = sidestep_command("resume", &recorded.path);
        let remedy = format!("end it with `{resume}`, or give a --cycle");
        let cause = "the run is not complete: no digest of it is recorded";
        return Err(InputError::new(recorded.path.display(), cause, remedy).into());
    }
    let mut run = recorded.start(workers)?;
    let until = recorded.cycles_done;
    let mut rows = recorded.folder.as_ref().map(|_| {
        run.start_recording();
        RowComparison::new(run.schemas())
    });
    let sinks = Sinks { rows: rows.as_mut().map(|rows| rows as _), ..Sinks::default() };
    let effort = drive(run.as_mut(), until, sinks, watcher)?;
    if run.cycle() < until && !run.is_over() {
        return Err(Error::Interrupted);
    }
    if run.cycle() != until {
        let cause = format!("the run is over after {} cycles, recorded are {until}", run.cycle());
        let remedy = "the recording was changed, or this is a bug: please report it";
        return Err(Error::other(cause, remedy));
    }
    recorded.verify_digest(run.as_ref())?;
    if let Some(rows) = &mut rows {
        // A recording that is complete has those of what lasts at its end, too.
        run.record_open(rows)?;
    }
    let compared_rows = match (&recorded.folder, &rows) {
        (Some(folder), Some(rows)) => rows.compare(folder)?,
        _ => 0,
    };
    Ok(ReplayReport { run, effort, compared_poses: 0, compared_rows })
}

/// Computes the state at the start of a cycle, and compares it with the poses recorded for
/// that cycle.
///
/// # Errors
/// When the run has no such cycle, or a pose differs; [`Error::Interrupted`] when the watcher asked
/// to stop.
pub fn replay_to(
    recorded: &RecordedRun,
    cycle: Cycle,
    workers: usize,
    watcher: &dyn Watcher,
) -> Result<ReplayReport, Error> {
    let mut run = recorded.start_near(cycle, workers)?;
    check_cycle(cycle, run.config().cycles)?;
    let effort = drive(run.as_mut(), cycle, Sinks::default(), watcher)?;
    if run.cycle() < cycle {
        if run.is_over() {
            return Err(no_such_cycle(cycle, run.cycle()).into());
        }
        return Err(Error::Interrupted);
    }
    let compared_poses = match &recorded.folder {
        Some(folder) => compare_poses(run.as_ref(), recorded.start(workers)?, folder)?,
        None => 0,
    };
    Ok(ReplayReport { run, effort, compared_poses, compared_rows: 0 })
}

fn check_cycle(cycle: Cycle, planned: Cycle) -> Result<(), InputError> {
    if cycle <= planned { Ok(()) } else { Err(no_such_cycle(cycle, planned)) }
}

fn no_such_cycle(cycle: Cycle, last: Cycle) -> InputError {
    let cause = format!("the run has {last} cycles");
    InputError::new(format!("--cycle {cycle}"), cause, format!("give 0 to {last}"))
}

impl ReplayReport {
    /// Draws the state to a PNG file, with the recorded tracks.
    ///
    /// # Errors
    /// When it cannot be drawn or written.
    pub fn draw(&mut self, recorded: &RecordedRun, png: &Path) -> Result<(), Error> {
        let origin = footnote(self.run.as_ref());
        let svg = draw_svg(
            self.run.as_mut(),
            recorded.folder.as_deref(),
            &origin,
            &PictureLook::default(),
        )?;
        write_png(png, &svg)
    }
}
