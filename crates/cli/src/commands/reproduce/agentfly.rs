//! `sidestep reproduce agentfly`.

use super::{EXAMPLES, Outcome, check_vacant, deliver};
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::progress::Stages;
use clap::Args;
use sidestep_papers::agentfly;
use std::path::PathBuf;

/// How much to run.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct AgentflyArgs {
    /// Write report.html, report.md, report.json and the figures to this new or empty folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Rehearse: run everything once, measure nothing well
    #[arg(long)]
    quick: bool,

    /// Seeds per number of airplanes
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    seeds: Option<u32>,
}

pub(super) fn reproduce(args: &AgentflyArgs, console: Console) -> Result<ExitCode, Failure> {
    let default = if args.quick { agentfly::Plan::quick() } else { agentfly::Plan::default() };
    let plan =
        agentfly::Plan { seeds: args.seeds.map_or(default.seeds, |n| n as usize), ..default };
    if let Some(folder) = &args.out {
        check_vacant(folder)?;
    }
    let stages = Stages::new(console);
    let report = agentfly::run(&plan, &mut |what, share| stages.at(what, share));
    stages.clear();
    let report = report?;
    let (document, claims, quick) = (report.document(), &report.claims, plan.quick);
    deliver(&report, &Outcome { document, claims, quick }, args.out.as_deref(), console)
}
