//! `sidestep run`: scenario -> cycles -> report.

use super::finish::run_to_end;
use super::ros2::{Ros2Args, RunToShow, check_no_sweep, run_as_node};
use super::sweep::{SweepRequest, run_sweep};
use crate::console::{Console, LINE_COLS, wrap_text};
use crate::exit::{ExitCode, Failure};
use crate::foxglove;
use crate::interrupt;
use crate::scenario_args::{ScenarioArgs, WorkersArg};
use crate::sweep::ReplicationArgs;
use crate::worlds;
use clap::{ArgGroup, Args};
use sidestep::kernel::{Cycle, InputError};
use sidestep::scenario::{ImportOptions, Remark, Severity};
use sidestep_session::{ManagedRun, OutputPaths, ViewerAddress};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep run scenarios/robots/office.toml --out runs/office
  sidestep run office.toml --cycles 50000 --seed 7 --workers 4
  sidestep run office.toml --replicate 100 --vary regime=reliable,both
  sidestep run office.toml --json | jq .metrics.contacts
  sidestep run office.toml --mcap office.mcap    for Foxglove and other viewers
  sidestep run office.toml --foxglove 127.0.0.1:8765    watch it there
  sidestep run office.toml --ros2 --domain 7    a node of ROS 2, without ROS
  sidestep run tracks.csv              replay recorded traffic
  sidestep run problem.json            a problem of the League of Robot Runners

Without --out and --mcap nothing is written. The folder holds scenario.toml (complete), \
summary.json, trajectories/ and events/ (Parquet), trajectories.svg and .png, and a checkpoint.";

/// Run a scenario; record it with --out.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
#[command(group = ArgGroup::new("written").args(["out", "mcap"]).multiple(true))]
pub(crate) struct RunArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,

    #[command(flatten)]
    workers: WorkersArg,

    /// Output folder for the recorded run; it must be new or empty
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Record bodies, scans and events to this MCAP file, for Foxglove and other viewers
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,

    /// Number of cycles between frames of the MCAP file
    #[arg(long, value_name = "N", default_value_t = 1, requires = "mcap",
        value_parser = clap::value_parser!(u64).range(1..))]
    mcap_every: Cycle,

    /// Show the run live in Foxglove and Lichtblick ("Open connection", Foxglove WebSocket), which may
    /// pause it and set its speed; until then it runs as fast as it can
    #[arg(long, value_name = "ADDR", value_parser = clap::value_parser!(ViewerAddress))]
    foxglove: Option<ViewerAddress>,

    /// Overwrite an earlier run in DIR, and FILE
    #[arg(long, requires = "written")]
    replace: bool,

    // These are last, because their headings are those of all options that follow.
    #[command(flatten)]
    many: ReplicationArgs,

    #[command(flatten)]
    ros2: Ros2Args,
}

/// # Errors
/// When the scenario or the folder is wrong, or results cannot be stored.
pub(crate) fn run(args: &RunArgs, console: Console) -> Result<ExitCode, Failure> {
    if args.many.is_requested() {
        check_no_sweep(&args.ros2)?;
        if args.foxglove.is_some() {
            let remedy = "leave it out, or run one of them alone";
            return Err(InputError::new("--foxglove", "a sweep has no single view", remedy).into());
        }
        if args.mcap.is_some() || args.replace {
            let remedy =
                "record the runs with --record-runs, then `sidestep export DIR/runs/N --to mcap`";
            let cause = "a sweep has no single recording, and its folder is never overwritten";
            return Err(InputError::new("--mcap or --replace", cause, remedy).into());
        }
        let ScenarioArgs { file, changes, import } = &args.scenario;
        import.check_none("a sweep reads no navigation database")?;
        let request = SweepRequest {
            file,
            changes,
            many: &args.many,
            out: args.out.as_deref(),
            workers: args.workers.count(),
        };
        return run_sweep(&request, console);
    }
    args.many.check_single_run()?;
    let (source, compiled) = args.scenario.compile()?;
    print_warnings(&compiled.remarks(), console);
    let options = ImportOptions::from_overrides(&args.scenario.all_overrides());
    let import = worlds().import_scenario(&args.scenario.file, &options)?;
    let workers = args.workers.count();
    if args.ros2.is_requested() {
        let run = RunToShow {
            scenario: &args.scenario,
            workers,
            out: args.out.clone(),
            replace: args.replace,
        };
        return run_as_node(&args.ros2, &run, console);
    }
    let paths = OutputPaths {
        folder: args.out.as_deref(),
        mcap: args.mcap.as_deref().map(|file| (file, args.mcap_every)),
        replace: args.replace,
        ..OutputPaths::default()
    };
    interrupt::listen()?;
    // An address that cannot be used is refused before anything is written.
    let viewers = args.foxglove.as_ref().map(ViewerAddress::with_free_port).transpose()?;
    let mut run = ManagedRun::start(worlds(), compiled.as_ref(), &source, workers, paths)?
        .with_import_report(import);
    if let Some(at) = &viewers {
        serve_viewers(&mut run, at, console)?;
    }
    run_to_end(run, console)
}

fn serve_viewers(
    run: &mut ManagedRun,
    at: &ViewerAddress,
    console: Console,
) -> Result<(), Failure> {
    run.serve_viewers(at)?;
    foxglove::print_address(at, console);
    Ok(())
}

/// Prints the warnings that `sidestep check` prints, too: few users want a run to which they apply.
fn print_warnings(remarks: &[Remark], console: Console) {
    for remark in remarks.iter().filter(|remark| remark.severity == Severity::Warning) {
        console
            .warn(wrap_text(&format!("{}: {}", remark.key, remark.words), LINE_COLS).join("\n  "));
    }
}
