//! `sidestep reproduce agentfly`.

use super::{EXAMPLES, Outcome, check_vacant, deliver};
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::progress::Stages;
use clap::Args;
use sidestep_papers::agentfly;
use std::path::PathBuf;

/// The extent of the experiments.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct AgentflyArgs {
    /// Output folder (new or empty) for report.html, report.md, report.json and the figures
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Run everything once, in little time; its numbers are not precise
    #[arg(long)]
    quick: bool,

    /// Number of seeds for each number of airplanes
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
