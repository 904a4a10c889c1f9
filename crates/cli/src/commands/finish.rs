//! What `run` and `resume` share: the way to the end, and what is left behind there.

use crate::console::Console;
use crate::driver::{Effort, Sinks, drive};
use crate::exit::{ExitCode, Failure};
use crate::film::{Ending, Film, McapFilm};
use crate::interrupt;
use crate::picture;
use crate::recording::Recording;
use crate::report::{Cost, Status, Summary, SummaryFile};
use sidestep::kernel::Cycle;
use sidestep::kernel::Simulation;
use sidestep::kernel::ports::RecordError;
use sidestep::scenario::Foreign;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

/// A run that is ready to go.
pub(super) struct Journey {
    pub(super) run: Box<dyn Simulation>,
    pub(super) recording: Option<Recording>,
    pub(super) film: Option<McapFilm>,
    pub(super) workers: usize,
    /// Where to stop, if before the planned end.
    pub(super) until: Option<Cycle>,
    /// What to report of the file that the scenario was made from.
    pub(super) told: Option<Foreign>,
}

/// Goes to the end of a recorded run and stores all that belongs to it; whether it got there.
///
/// # Errors
/// When something cannot be stored.
pub(crate) fn recorded_run(
    run: &mut dyn Simulation,
    mut recording: Recording,
    workers: usize,
    console: Console,
) -> Result<bool, Failure> {
    let until = run.plan().cycles;
    let sinks = Sinks { recording: Some(&mut recording), film: None };
    let effort = drive_guarded(run, until, sinks, console)?;
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
    let Journey { mut run, mut recording, mut film, workers, until, told } = journey;
    let until = until.unwrap_or(run.plan().cycles);
    let sinks = Sinks {
        recording: recording.as_mut(),
        film: film.as_mut().map(|film| film as &mut dyn Film),
    };
    let driven = drive_guarded(run.as_mut(), until, sinks, console);
    let effort = driven.map_err(|e| broken_by(e, run.as_ref(), recording.as_ref()))?;
    let folder = recording.as_ref().map(|r| r.folder().path().to_path_buf());
    let took = recording.as_ref().map_or(Duration::ZERO, Recording::took)
        + film.as_ref().map_or(Duration::ZERO, McapFilm::took);
    let cost = Cost { workers, effort, recording: took };
    let mut summary = Summary::new(run.as_ref(), cost, folder.as_deref());
    if let Some(told) = told {
        summary.tell_of_file(told);
    }
    if let Some(film) = film {
        let ending = match summary.status() {
            Status::Complete => Ending::Complete,
            Status::Incomplete => Ending::Stopped,
        };
        let path = film.finish(run.as_ref(), ending);
        let path = path.map_err(|e| broken_by(e, run.as_ref(), recording.as_ref()))?;
        summary.tell_of_mcap(path);
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
    run: &mut dyn Simulation,
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

/// Drives the run; a bug says what replays it.
fn drive_guarded(
    run: &mut dyn Simulation,
    until: Cycle,
    sinks: Sinks<'_>,
    console: Console,
) -> Result<Effort, Failure> {
    let driven = catch_unwind(AssertUnwindSafe(|| drive(run, until, sinks, console)));
    driven.unwrap_or_else(|_| Err(bug(run)))
}

/// Adds what saves the run where something could not be stored.
fn broken_by(failure: Failure, run: &dyn Simulation, recording: Option<&Recording>) -> Failure {
    match failure {
        Failure::Record(error) => broken(run, recording, &error),
        other => other,
    }
}

/// What replays a run up to where it failed.
fn whereabouts(run: &dyn Simulation) -> String {
    let plan = run.plan();
    let (cycle, version) = (run.cycle(), env!("CARGO_PKG_VERSION"));
    let (name, seed, cycles) = (&plan.name, plan.seed, plan.cycles);
    format!("at cycle {cycle} of {cycles} of `{name}`, seed {seed}, sidestep {version}")
}

/// Recording failed: says what saves the run.
fn broken(run: &dyn Simulation, recording: Option<&Recording>, error: &RecordError) -> Failure {
    let remedy = match recording.map(|r| r.folder().path().display()) {
        Some(folder) => format!("make room, then continue with: sidestep resume {folder}"),
        None => "make room, then run it again; without --out nothing can be continued".into(),
    };
    Failure::stopped(format!("{error}\n  {}", whereabouts(run)), remedy)
}

/// The simulation broke a rule of its own.
fn bug(run: &dyn Simulation) -> Failure {
    let cause = format!("this is a bug in sidestep, met shortly after\n  {}", whereabouts(run));
    Failure::stopped(cause, "please report it with the scenario and the lines above")
}
