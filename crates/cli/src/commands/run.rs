//! `sidestep run`: scenario -> cycles -> report.

use super::finish::{Journey, travel};
use super::sweep::many_runs;
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::plan::{ScenarioArgs, WorkersArg};
use crate::recording::Recording;
use crate::sweep::ManyArgs;
use crate::worlds::{self, Compiled, Run};
use clap::Args;
use sidestep::scenario::Source;
use sidestep_record::Existing;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep run scenarios/robots/office.toml --out runs/office
  sidestep run office.toml --cycles 50000 --seed 7 --workers 4
  sidestep run office.toml --regime sensors --set robots.0.count=40 --set map.box_size_m=0.2
  sidestep run office.toml --replicate 100 --vary regime=reliable,both   see `sidestep sweep`
  sidestep run office.toml --json | jq .metrics.contacts
  sidestep run tracks.csv                                   replay recorded traffic
  sidestep run tracks.csv --set airspace.replay_until_s=600 fly it anew from then on

Without --out nothing is written. The folder holds scenario.toml (resolved), summary.json,
trajectories/ and events/ (Parquet), trajectories.svg and .png, and a checkpoint.";

/// Run a scenario, and record it with --out.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,

    #[command(flatten)]
    many: ManyArgs,

    #[command(flatten)]
    workers: WorkersArg,

    /// Record the run to this folder, which must be new or empty
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Delete the run that DIR holds already
    #[arg(long, requires = "out")]
    replace: bool,
}

/// Runs the command.
///
/// # Errors
/// When the scenario or the folder is wrong, or results cannot be stored.
pub(crate) fn run(args: &RunArgs, console: Console) -> Result<ExitCode, Failure> {
    if args.many.is_asked() {
        let workers = args.workers.count();
        return many_runs(&args.scenario, &args.many, args.out.as_ref(), workers, console);
    }
    let (source, compiled) = args.scenario.compile()?;
    let told = worlds::told_of(&args.scenario.file)?;
    let workers = args.workers.count();
    interrupt::listen()?;
    let (run, recording) = match &args.out {
        None => (compiled.start(&source, workers), None),
        Some(folder) => {
            let existing = if args.replace { Existing::Replace } else { Existing::Refuse };
            let (run, recording) = recorded(&source, compiled, workers, folder, existing)?;
            (run, Some(recording))
        }
    };
    travel(Journey { run, recording, workers, until: None, told }, console)
}

/// A run and the new folder that it is recorded to.
fn recorded(
    source: &Source,
    compiled: Compiled,
    workers: usize,
    folder: &Path,
    existing: Existing,
) -> Result<(Box<dyn Run>, Recording), Failure> {
    let resolved = compiled.resolve(source)?;
    let itself = Source::new("scenario.toml", &*resolved.text, folder);
    let mut run = compiled.start(&itself, workers);
    let recording = Recording::create(folder, &resolved, run.as_mut(), existing)?;
    Ok((run, recording))
}
