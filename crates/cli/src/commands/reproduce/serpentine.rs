//! `sidestep reproduce serpentine`.

use super::{EXAMPLES, Outcome, check_vacant, deliver};
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::progress::Stages;
use crate::worlds::chain::picture::drawn_obstacle;
use clap::Args;
use sidestep_document::document::Picture;
use sidestep_draw::{BodyScene, DrawError, Strand, Style, Trail};
use sidestep_papers::serpentine::scenes::{Scene, View};
use sidestep_papers::serpentine::{self, Plan};
use std::path::PathBuf;

/// How much to run.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct SerpentineArgs {
    /// Write report.html, report.md, report.json, figures and pictures to this new or empty folder
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
    let pictures: Vec<Picture> = report.scenes.iter().map(drawn).collect::<Result<_, _>>()?;
    let (document, claims) = (report.document(pictures), &report.claims);
    let quick = report.plan.quick;
    deliver(&report, &Outcome { document, claims, quick }, args.out.as_deref(), console)
}

fn drawn(scene: &Scene) -> Result<Picture, DrawError> {
    match scene {
        Scene::Plane(view) => picture(view, body_scene(view).to_svg(&Style::MAP)),
        Scene::Space(view) => picture(view, body_scene(view).to_svg(&Style::MAP)),
    }
}

fn picture<const D: usize>(
    view: &View<D>,
    svg: Result<String, DrawError>,
) -> Result<Picture, DrawError> {
    Ok(Picture { title: view.title.clone(), caption: view.caption.clone(), svg: svg? })
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
        // Both stand beside the picture.
        title: String::new(),
        caption: String::new(),
    }
}
