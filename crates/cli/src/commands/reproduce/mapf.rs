//! `sidestep reproduce mapf`.

use super::{EXAMPLES, PaperResults, forget_trials, keep_trials, store_and_print};
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::progress::StageBar;
use clap::Args;
use sidestep_papers::mapf::{self, MapfConfig};
use std::path::PathBuf;

/// The extent of the study.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct MapfArgs {
    /// Output folder (new or empty) for report.html, report.md, report.json and the figures; after an interrupt the same
    /// command goes on there
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Quick run: everything once; the numbers are not precise
    #[arg(long)]
    quick: bool,

    /// Number of seeds of each case
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    seeds: Option<u32>,
}

pub(super) fn reproduce(args: &MapfArgs, console: Console) -> Result<ExitCode, Failure> {
    let default = if args.quick { MapfConfig::quick() } else { MapfConfig::default() };
    let plan = MapfConfig { seeds: args.seeds.map_or(default.seeds, |n| n as usize), ..default };
    let kept = keep_trials(args.out.as_deref(), &plan, console)?;
    let stages = StageBar::new(console);
    let report = mapf::run(&plan, &kept, &mut |what, share| stages.set(what, share));
    stages.clear();
    let report = report?;
    let exit = store_and_print(
        &report,
        &PaperResults { document: report.document(), claims: &report.claims, quick: plan.quick },
        args.out.as_deref(),
        console,
    )?;
    forget_trials(kept, console);
    Ok(exit)
}
