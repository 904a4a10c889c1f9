//! `sidestep sweep`: many variants of a scenario, each with many seeds.

use crate::console::{Console, align_pairs, group_thousands};
use crate::console_watcher::ConsoleWatcher;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::scenario_args::{ChangeArgs, WorkersArg};
use crate::sweep::{
    ReplicationArgs, SweepOutput, print_results, print_share, print_status, run_remaining,
};
use crate::worlds;
use clap::{Args, Subcommand};
use serde_json::json;
use sidestep::experiment::sweep::{Plan, Shard};
use sidestep::kernel::InputError;
use sidestep::kernel::shell::sidestep_command;
use sidestep_session::display_path;
use sidestep_session::sweep::{self, Folder};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep sweep methods.toml --out sweeps/methods       a sweep file
  sidestep sweep office.toml --vary robots.0.count=10,20,40 --out sweeps/office
  sidestep sweep sky.toml --vary airspace.method=none,mvp,pc \\
      --baseline airspace.method=none
  sidestep sweep office.toml --until ci=0.05 --max 1000 --metrics contacts

On a cluster (docs/src/clusters.md has a Slurm array and a Kubernetes job):
  sidestep sweep plan methods.toml --out sweeps/methods
  sidestep sweep run sweeps/methods --shard 0/8   and so on to 7/8
  sidestep sweep status sweeps/methods            how far it is
  sidestep sweep collect sweeps/methods

A sweep file is TOML: format = 1, scenario = \"FILE\", replicates, [set], [vary], [[variant]], \
[latin_hypercube], [until], metrics, baseline, series; scenarios/sweeps/ has commented ones. Replicate k of \
every variant has the same seed. DIR/results.parquet has one row per run. The same command again \
continues where a killed one stopped, as does `sidestep resume DIR`; no finished run is repeated. \
`sidestep export DIR --to page` makes pages of its runs, and `sidestep report DIR` a report.";

/// Run a parameter sweep: many variants of a scenario, each with many seeds.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, args_conflicts_with_subcommands = true)]
pub(crate) struct SweepArgs {
    #[command(subcommand)]
    step: Option<SweepCommand>,

    /// Sweep file or scenario
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,

    #[command(flatten)]
    changes: ChangeArgs,

    #[command(flatten)]
    workers: WorkersArg,

    /// Output folder; it must be new, empty, or hold this same sweep
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    // Last, because its heading is that of all options that follow.
    #[command(flatten)]
    many: ReplicationArgs,
}

#[derive(Debug, Subcommand)]
enum SweepCommand {
    /// Plan a sweep for a cluster: check all variants and list the runs
    Plan(Box<PlanArgs>),
    /// Run one share (shard) of a planned sweep
    Run(ShareArgs),
    /// Show the progress of a sweep that other processes run: shares, rate, time left, failed runs
    Status(FolderArgs),
    /// Collect the shares of a sweep into one table
    Collect(FolderArgs),
}

#[derive(Debug, Args)]
struct PlanArgs {
    /// Sweep file or scenario
    #[arg(value_name = "FILE")]
    file: PathBuf,

    #[command(flatten)]
    changes: ChangeArgs,

    #[command(flatten)]
    workers: WorkersArg,

    /// Folder of the sweep; it must be new or empty
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    // Last, because its heading is that of all options that follow.
    #[command(flatten)]
    many: ReplicationArgs,
}

#[derive(Debug, Args)]
struct ShareArgs {
    /// Folder of the sweep
    #[arg(value_name = "DIR")]
    folder: PathBuf,

    /// Share to run: I of N, with I from 0 to N-1
    #[arg(long, value_name = "I/N")]
    shard: Shard,

    #[command(flatten)]
    workers: WorkersArg,
}

#[derive(Debug, Args)]
struct FolderArgs {
    /// Folder of the sweep
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// # Errors
/// When the sweep or a folder is wrong, runs are missing, or results cannot be stored.
pub(crate) fn sweep(args: &SweepArgs, console: Console) -> Result<ExitCode, Failure> {
    let SweepArgs { step, file, changes, many, workers, out } = args;
    match (step, file) {
        (Some(SweepCommand::Plan(args)), _) => plan(args, console),
        (Some(SweepCommand::Run(args)), _) => share(args, console),
        (Some(SweepCommand::Status(args)), _) => status(args, console),
        (Some(SweepCommand::Collect(args)), _) => collect(args, console),
        (None, Some(file)) => {
            let request =
                SweepRequest { file, changes, many, out: out.as_deref(), workers: workers.count() };
            run_sweep(&request, console)
        }
        (None, None) => {
            let remedy = "give a sweep file or a scenario; see `sidestep sweep --help`";
            Err(InputError::new("sidestep sweep", "there is nothing to run", remedy).into())
        }
    }
}

/// A sweep to run: that of a file with the changes of the options.
pub(super) struct SweepRequest<'a> {
    pub(super) file: &'a Path,
    pub(super) changes: &'a ChangeArgs,
    pub(super) many: &'a ReplicationArgs,
    /// The folder of the results; without it they are only printed.
    pub(super) out: Option<&'a Path>,
    pub(super) workers: usize,
}

/// Runs a sweep.
///
/// # Errors
/// If the sweep or the folder is wrong, or results cannot be stored.
pub(super) fn run_sweep(request: &SweepRequest<'_>, console: Console) -> Result<ExitCode, Failure> {
    let workers = request.workers;
    let planned = request.many.sweep(request.file, request.changes)?;
    interrupt::listen()?;
    let watch = ConsoleWatcher::new(console);
    let Some(out) = request.out else {
        let (plan, end) = sweep::run_in_memory(worlds(), &planned, workers, &watch)?;
        return print_results(SweepOutput { plan: &plan, folder: None, console }, end, "");
    };
    let folder = sweep::open_or_create(worlds(), &planned, out, workers, &watch)?;
    run_remaining(&folder, workers, console)
}

fn share(args: &ShareArgs, console: Console) -> Result<ExitCode, Failure> {
    let folder = Folder::open(&args.folder)?;
    let workers = args.workers.count();
    interrupt::listen()?;
    let end =
        sweep::run_share(worlds(), &folder, args.shard, workers, &ConsoleWatcher::new(console))?;
    let output = SweepOutput { plan: folder.plan(), folder: Some(&folder), console };
    print_share(output, args.shard, end)
}

fn collect(args: &FolderArgs, console: Console) -> Result<ExitCode, Failure> {
    let folder = Folder::open(&args.folder)?;
    let end = sweep::collect(worlds(), &folder, &ConsoleWatcher::new(console))?;
    let output = SweepOutput { plan: folder.plan(), folder: Some(&folder), console };
    print_results(output, end, "The runs are collected already.")
}

fn status(args: &FolderArgs, console: Console) -> Result<ExitCode, Failure> {
    let folder = Folder::open(&args.folder)?;
    print_status(&folder, &sweep::read_status(&folder)?, console)?;
    Ok(ExitCode::Done)
}

fn plan(args: &PlanArgs, console: Console) -> Result<ExitCode, Failure> {
    let planned = args.many.sweep(&args.file, &args.changes)?;
    interrupt::listen()?;
    let watch = ConsoleWatcher::new(console);
    let folder = sweep::create(worlds(), &planned, &args.out, args.workers.count(), &watch)?;
    let plan = folder.plan();
    let json = json!({
        "folder": display_path(&args.out),
        "variants": plan.variants.len(),
        "replicates": plan.replicates,
        "cells": plan.runs(),
        "agents": plan.agents,
    });
    console.print_result_or_short(&json, "", || align_pairs(&plan_lines(plan, &args.out)))?;
    Ok(ExitCode::Done)
}

/// Returns the plan as text, and the commands that run it. A sweep that ends at a precision has no shares, because its
/// stopping rule needs the results of all runs in one process.
fn plan_lines(plan: &Plan, out: &Path) -> Vec<(String, String)> {
    let all = group_thousands(plan.runs());
    let at_most = if plan.until.is_some() { "at most " } else { "" };
    let mut lines = vec![
        ("variants", group_thousands(plan.variants.len() as u64)),
        ("runs", format!("{at_most}{} of each, {at_most}{all} in all", plan.replicates)),
    ];
    if plan.until.is_some() {
        lines.push(("run them", sidestep_command("resume", out)));
    } else {
        lines.push(("run them", sidestep_command("sweep run --shard 0/1", out)));
        lines.push(("join them", sidestep_command("sweep collect", out)));
    }
    lines.into_iter().map(|(name, value)| (name.to_string(), value)).collect()
}
