//! What `run` and `resume` share: the way to the end, and what is left behind there.

use crate::console::Console;
use crate::driver::{Effort, drive};
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::picture;
use crate::recording::Recording;
use crate::report::{Cost, Status, Summary, SummaryFile};
use crate::worlds::{Run, Told};
use sidestep::kernel::Cycle;
use sidestep::kernel::ports::RecordError;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

/// A run that is ready to go.
pub(super) struct Journey {
    pub(super) run: Box<dyn Run>,
    pub(super) recording: Option<Recording>,
    pub(super) workers: usize,
    /// Where to stop, if before the planned end.
    pub(super) until: Option<Cycle>,
    /// What to report of the file that the scenario was made from.
    pub(super) told: Option<Told>,
}

/// Goes to the end of a recorded run and stores all that belongs to it; whether it got there.
///
/// # Errors
/// When something cannot be stored.
pub(crate) fn recorded_run(
    run: &mut dyn Run,
    mut recording: Recording,
    workers: usize,
    console: Console,
) -> Result<bool, Failure> {
    let until = run.plan().cycles;
    let effort = drive_guarded(run, until, Some(&mut recording), console)?;
    let folder = recording.folder().path().to_path_buf();
    let cost = Cost { workers, effort, recording: recording.took() };
    let summary = Summary::new(run, cost, Some(&folder));
    store(run, recording, &summary, console)?;
    Ok(summary.status() == Status::Complete)
}

/// Goes to the end (or until Ctrl-C), stores and prints the report.
///
/// # Errors
/// When something cannot be stored.
pub(super) fn travel(journey: Journey, console: Console) -> Result<ExitCode, Failure> {
    let Journey { mut run, mut recording, workers, until, told } = journey;
    let until = until.unwrap_or(run.plan().cycles);
    let effort = drive_guarded(run.as_mut(), until, recording.as_mut(), console)?;
    let folder = recording.as_ref().map(|r| r.folder().path().to_path_buf());
    let took = recording.as_ref().map_or(Duration::ZERO, Recording::took);
    let cost = Cost { workers, effort, recording: took };
    let mut summary = Summary::new(run.as_ref(), cost, folder.as_deref());
    if let Some(told) = told {
        summary.tell_of_file(told);
    }
    if let Some(recording) = recording {
        store(run.as_mut(), recording, &summary, console)?;
    }
    let short = || format!("{}\n", summary.digest());
    console.result_or_short(&summary, short, || summary.text(run.outcome()));
    Ok(ending(&summary, folder.is_some(), console))
}

fn ending(summary: &Summary, recorded: bool, console: Console) -> ExitCode {
    if summary.status() == Status::Incomplete && recorded {
        console.note("The run is marked as incomplete; `sidestep resume DIR` continues it.");
    }
    match interrupt::requested() && summary.status() == Status::Incomplete {
        true => ExitCode::Interrupted,
        false => ExitCode::Done,
    }
}

/// Ends the folder: whole tables and pictures, or a checkpoint to resume at.
fn store(
    run: &mut dyn Run,
    mut recording: Recording,
    summary: &Summary,
    console: Console,
) -> Result<(), Failure> {
    let closed = match summary.status() {
        Status::Complete => recording.finish_tables(),
        Status::Incomplete => recording.save_unfinished(run),
    };
    closed.map_err(|e| broken(run, Some(&recording), &e))?;
    let folder = recording.into_folder();
    if let Err(failure) = picture::draw_run(run, &folder) {
        console.warn(failure);
    }
    let (per_agent, per_pair) = (run.agent_metrics(), run.pair_metrics());
    folder.write_summary(&SummaryFile { summary, per_agent, per_pair })?;
    match summary.status() {
        Status::Complete => folder.complete(run.cycle(), summary.digest())?,
        Status::Incomplete => folder.stop(run.cycle())?,
    }
    Ok(())
}

/// Drives the run; whatever fails says what replays it.
fn drive_guarded(
    run: &mut dyn Run,
    until: Cycle,
    mut recording: Option<&mut Recording>,
    console: Console,
) -> Result<Effort, Failure> {
    let driven =
        catch_unwind(AssertUnwindSafe(|| drive(run, until, recording.as_deref_mut(), console)));
    match driven {
        Ok(driven) => driven.map_err(|e| broken(run, recording.as_deref(), &e)),
        Err(_) => Err(bug(run)),
    }
}

/// What replays a run up to where it failed.
fn whereabouts(run: &dyn Run) -> String {
    let plan = run.plan();
    let (cycle, version) = (run.cycle(), env!("CARGO_PKG_VERSION"));
    let (name, seed, cycles) = (plan.name, plan.seed, plan.cycles);
    format!("at cycle {cycle} of {cycles} of `{name}`, seed {seed}, sidestep {version}")
}

/// Recording failed: says what saves the run.
fn broken(run: &dyn Run, recording: Option<&Recording>, error: &RecordError) -> Failure {
    let folder = recording.map_or_else(String::new, |r| r.folder().path().display().to_string());
    let remedy = format!("make room, then continue with: sidestep resume {folder}");
    Failure::stopped(format!("{error}\n  {}", whereabouts(run)), remedy)
}

/// The simulation broke a rule of its own.
fn bug(run: &dyn Run) -> Failure {
    let cause = format!("this is a bug in sidestep, met shortly after\n  {}", whereabouts(run));
    Failure::stopped(cause, "please report it with the scenario and the lines above")
}
