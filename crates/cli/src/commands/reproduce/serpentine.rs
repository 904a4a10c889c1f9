//! `sidestep reproduce serpentine`.

use super::{EXAMPLES, PaperResults, check_vacant, scene_picture, store_and_print};
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::progress::StageBar;
use clap::Args;
use sidestep_document::document::Picture;
use sidestep_papers::serpentine::{self, SerpentineConfig};
use std::path::PathBuf;

/// The extent of the experiments.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct SerpentineArgs {
    /// Output folder (new or empty) for report.html, report.md, report.json, figures and pictures
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Quick run: everything once; the numbers are not precise
    #[arg(long)]
    quick: bool,

    /// Number of seeds of each random case; the open field has three times as many
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    seeds: Option<u32>,
}

impl SerpentineArgs {
    fn plan(&self) -> SerpentineConfig {
        let default =
            if self.quick { SerpentineConfig::quick() } else { SerpentineConfig::default() };
        match self.seeds.map(|n| n as usize) {
            None => default,
            Some(seeds) => {
                SerpentineConfig { seeds, field_seeds: 3 * seeds, snake_seeds: seeds, ..default }
            }
        }
    }
}

pub(super) fn reproduce(args: &SerpentineArgs, console: Console) -> Result<ExitCode, Failure> {
    if let Some(folder) = &args.out {
        check_vacant(folder)?;
    }
    let stages = StageBar::new(console);
    let report = serpentine::run(&args.plan(), &mut |what, share| stages.set(what, share));
    stages.clear();
    let report = report?;
    let pictures: Vec<Picture> =
        report.scenes.iter().map(scene_picture).collect::<Result<_, _>>()?;
    store_and_print(
        &report,
        &PaperResults {
            document: report.document(pictures),
            claims: &report.claims,
            quick: report.plan.quick,
        },
        args.out.as_deref(),
        console,
    )
}
