//! `sidestep resume`: continues a run or a sweep that was stopped or killed.

use super::finish::run_to_end;
use crate::console::{Console, group_thousands};
use crate::console_watcher::ConsoleWatcher;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::scenario_args::WorkersArg;
use crate::sweep::run_remaining;
use crate::worlds;
use clap::Args;
use sidestep::kernel::shell::{shell_path, sidestep_command};
use sidestep::kernel::{Cycle, InputError};
use sidestep_record::{RunReader, Status};
use sidestep_session::sweep::Folder;
use sidestep_session::{ManagedRun, close_flight, read_summary};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep resume runs/office
  sidestep resume sweeps/methods
  sidestep resume runs/office --workers 8
  sidestep resume runs/office --cycles 20000     to cycle 20000 only

The result has the same digest and the same rows as an uninterrupted run. Of a run that is complete \
already, the result is printed and nothing is written. A flight in real time is not continued: its \
recording is closed where it ends, and the exit code is 1. With --simulate the other cycles are \
computed, and marked as simulated.";

/// Continue a recorded run or a sweep that was stopped or killed.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ResumeArgs {
    /// Folder of a run or a sweep
    #[arg(value_name = "DIR")]
    folder: PathBuf,

    #[command(flatten)]
    workers: WorkersArg,

    /// Simulate the cycles that a flight in real time has not flown; they are marked as simulated
    #[arg(long)]
    simulate: bool,

    /// Stop at this cycle [default: the planned end]
    #[arg(long, value_name = "N")]
    cycles: Option<Cycle>,
}

/// # Errors
/// When the folder holds no run that can be continued, or results cannot be stored.
pub(crate) fn resume(args: &ResumeArgs, console: Console) -> Result<ExitCode, Failure> {
    if Folder::is_at(&args.folder) {
        return resume_sweep(args, console);
    }
    let reader = RunReader::open(&args.folder)?;
    if reader.manifest.status == Status::Complete && args.cycles.is_none() {
        return print_finished(&reader, console);
    }
    if reader.manifest.ends_in_flight() {
        return resume_flight(args, console);
    }
    if args.simulate && !reader.manifest.is_flight() {
        let cause = "this run was simulated from its start";
        let remedy = "leave it out: it is for flights in real time";
        return Err(InputError::new("--simulate", cause, remedy).into());
    }
    let workers = args.workers.count();
    interrupt::listen()?;
    let run = ManagedRun::resume(worlds(), &args.folder, workers, args.cycles)?;
    let cycle = group_thousands(run.cycle());
    console.note(format!("Continuing {} at cycle {cycle}", args.folder.display()));
    let end = run_to_end(run, console)?;
    tell_of_mcap(&args.folder, console)?;
    Ok(end)
}

/// Tells how to get the MCAP file that the run was to write: it ends where the run was stopped, or has no end at all where
/// its process was killed. The file is not written unasked, because its place is named by a file in the folder.
fn tell_of_mcap(folder: &Path, console: Console) -> Result<(), Failure> {
    let manifest = RunReader::open(folder)?.manifest;
    let Some(request) = manifest.mcap.filter(|_| manifest.status == Status::Complete) else {
        return Ok(());
    };
    let file = request.path(folder);
    let state = if file.exists() {
        "ends where the run was stopped"
    } else {
        "was not finished, because the run was killed"
    };
    let export = sidestep_command("export --to mcap", folder);
    let out = shell_path(&file);
    let every = request.every;
    console.note(format!(
        "{} {state}; `{export} --every {every} --out {out} --replace` writes all of it.",
        file.display()
    ));
    Ok(())
}

/// Closes the recording of a flight, and simulates the rest only if the user asks for it.
fn resume_flight(args: &ResumeArgs, console: Console) -> Result<ExitCode, Failure> {
    interrupt::listen()?;
    let flight = close_flight(worlds(), &args.folder, &ConsoleWatcher::new(console))?;
    if !args.simulate {
        console.print_result(&flight.summary, String::new)?;
        return Err(flight.to_error());
    }
    let workers = args.workers.count();
    let run = ManagedRun::simulate_flight(worlds(), &args.folder, workers, args.cycles)?;
    let folder = args.folder.display();
    let cycle = group_thousands(run.cycle());
    console.note(format!(
        "Simulating {folder} from cycle {cycle} on: these cycles are flown by nobody, and marked as simulated"
    ));
    run_to_end(run, console)
}

/// Prints the results of a finished run: a user who resumes all runs need not know which had ended.
fn print_finished(reader: &RunReader, console: Console) -> Result<ExitCode, Failure> {
    reader.check_files(|_| true)?;
    let mcap = reader.manifest.mcap.as_ref();
    if mcap.is_some_and(|request| request.partial_path(&reader.path).exists()) {
        tell_of_mcap(&reader.path, console)?;
    }
    let folder = reader.path.display();
    let cycles = group_thousands(reader.manifest.cycles_done);
    console.note(format!(
        "{folder} is complete ({cycles} cycles): nothing is left to run. `{}` writes its page.",
        sidestep_command("report", &reader.path)
    ));
    let digest = reader.manifest.digest.as_deref().unwrap_or_default();
    console.print_result(&read_summary(&reader.path)?, || format!("{digest}\n"))?;
    Ok(ExitCode::Done)
}

fn resume_sweep(args: &ResumeArgs, console: Console) -> Result<ExitCode, Failure> {
    if args.simulate {
        let remedy = "leave it out: it is for flights in real time";
        return Err(InputError::new("--simulate", "this is the folder of a sweep", remedy).into());
    }
    if args.cycles.is_some() {
        let remedy = "leave --cycles out: the runs of a sweep go to their ends";
        return Err(InputError::new("--cycles", "this is the folder of a sweep", remedy).into());
    }
    run_remaining(&Folder::open(&args.folder)?, args.workers.count(), console)
}
