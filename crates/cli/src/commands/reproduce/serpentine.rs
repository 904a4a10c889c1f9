//! `sidestep reproduce serpentine`.

use super::{EXAMPLES, check_vacant, folder_of_figures, store, store_svg, summary};
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::progress::Stages;
use crate::worlds::chain::picture::drawn_obstacle;
use clap::Args;
use sidestep::experiment::serpentine::scenes::{Scene, View};
use sidestep::experiment::serpentine::{self, Plan};
use sidestep_draw::{BodyScene, Strand, Style, Trail};
use std::path::{Path, PathBuf};

/// How much to run.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct SerpentineArgs {
    /// Write report.md, report.json, the figures and pictures to this new or empty folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Rehearse: run everything once, measure nothing well
    #[arg(long)]
    quick: bool,

    /// Seeds of every case that is random; of the open field three times as many
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    seeds: Option<u32>,
}

impl SerpentineArgs {
    fn plan(&self) -> Plan {
        let default = if self.quick { Plan::quick() } else { Plan::default() };
        match self.seeds.map(|n| n as usize) {
            None => default,
            Some(seeds) => Plan { seeds, field_seeds: 3 * seeds, snake_seeds: seeds, ..default },
        }
    }
}

pub(super) fn reproduce(args: &SerpentineArgs, console: Console) -> Result<ExitCode, Failure> {
    if let Some(folder) = &args.out {
        check_vacant(folder)?;
    }
    let stages = Stages::new(console);
    let report = serpentine::run(&args.plan(), &mut |what, share| stages.at(what, share));
    stages.clear();
    let report = report?;
    if let Some(folder) = &args.out {
        // Pictures first: where the report is, everything is.
        for (k, scene) in report.scenes.iter().enumerate() {
            draw(scene, k + 1, folder)?;
        }
        store(&report, &report.figures(), &report.to_markdown(), folder)?;
    }
    console.result(&report, || match &args.out {
        None => report.to_markdown(),
        Some(folder) => summary(&report.claims, report.plan.quick, folder),
    });
    Ok(ExitCode::Done)
}

fn draw(scene: &Scene, number: usize, folder: &Path) -> Result<(), Failure> {
    let (title, svg) = match scene {
        Scene::Plane(view) => (&view.title, body_scene(view).to_svg(&Style::MAP)?),
        Scene::Space(view) => (&view.title, body_scene(view).to_svg(&Style::MAP)?),
    };
    let figures = folder_of_figures(folder)?;
    store_svg(&svg, &figures.join(format!("scene-{number}-{}", super::file_name(title))))
}

fn body_scene<const D: usize>(view: &View<D>) -> BodyScene<D> {
    let strand = |s: &serpentine::scenes::Strand<D>| Strand {
        points: s.points.clone(),
        connector_radius_m: s.connector_radius_m,
        rod_radius_m: s.rod_radius_m,
        label: s.name.clone(),
    };
    let trail =
        |points: &Vec<[f64; D]>| Trail { points: points.clone(), color: 0, label: String::new() };
    BodyScene {
        obstacles: view.obstacles.iter().map(drawn_obstacle).collect(),
        strands: view.strands.iter().map(strand).collect(),
        trails: view.trails.iter().map(trail).collect(),
        view_m: None,
        title: view.title.clone(),
        caption: view.caption.clone(),
    }
}
