//! `sidestep map`: a map as the simulator sees it.

use crate::console::{Console, terminal_columns};
use crate::exit::{ExitCode, Failure};
use clap::{Args, ValueEnum};
use serde::Serialize;
use sidestep::import::{GridOptions, ImportReport, ImportedMap, import_map, load_pixel_map};
use sidestep::kernel::InputError;
use sidestep::kernel::view::{Frame, Scenery};
use sidestep::map::{CellCounts, GridMap, UnknownPolicy};
use sidestep_draw::{PictureOptions, draw};
use sidestep_session::write_png;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep map building.yaml --box 0.25
  sidestep map building.yaml --box 0.25 --unknown wall --png building.png
  sidestep map plan.png --resolution 0.05
  sidestep map arena.map --width 60
  sidestep map building.yaml --box 0.5 --json

Reads ROS map_server (.yaml), images (.png, .pgm, .jpg, .bmp: dark is wall, light is free, between \
is unknown), MovingAI (.map) and character maps (.txt), each also with .gz. \
In the terminal: # wall, . free, ? unknown, numbers count boxes; a wide map is drawn smaller and \
loses no wall. What was guessed in the file, is suspicious or not used goes to standard error, and with \
--json into the field report.";

/// Show a map as the simulator sees it, in the terminal or as PNG.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct MapArgs {
    /// Map file
    #[arg(value_name = "FILE")]
    file: PathBuf,

    /// Side of a box in meters
    #[arg(long = "box", value_name = "B", default_value_t = 0.25)]
    box_size_m: f64,

    /// Side of a pixel in meters, for a plain image; a ROS map says its own
    #[arg(long = "resolution", value_name = "R")]
    resolution_m: Option<f64>,

    /// Treatment of unmapped (unknown) boxes; in scenarios the default is wall
    #[arg(long, value_enum, default_value_t = UnknownArg::Keep)]
    unknown: UnknownArg,

    /// Save a picture of the boxes to this PNG file
    #[arg(long, value_name = "OUT")]
    png: Option<PathBuf>,

    /// Largest number of text columns [default: width of the terminal]
    #[arg(long, value_name = "COLS", value_parser = clap::value_parser!(u16).range(1..))]
    width: Option<u16>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum UnknownArg {
    Wall,
    Free,
    Keep,
}

impl From<UnknownArg> for UnknownPolicy {
    fn from(unknown: UnknownArg) -> Self {
        match unknown {
            UnknownArg::Wall => Self::Wall,
            UnknownArg::Free => Self::Free,
            UnknownArg::Keep => Self::Keep,
        }
    }
}

/// Size and number of pixels of the file, and of boxes.
#[derive(Debug, Serialize)]
struct MapCounts {
    width: u32,
    height: u32,
    free: usize,
    occupied: usize,
    unknown: usize,
    resolution_m: f64,
    origin_m: [f64; 2],
    yaw_rad: f64,
    box_size_m: f64,
    width_boxes: u32,
    height_boxes: u32,
    boxes: CellCounts,
    /// What became of the file.
    report: ImportReport,
}

/// # Errors
/// When the map is wrong, or the picture cannot be written.
pub(crate) fn map(args: &MapArgs, console: Console) -> Result<ExitCode, Failure> {
    let (counts, map) = read(args)?;
    for finding in &counts.report.findings {
        console.note(format!("note: {finding}"));
    }
    if let Some(png) = &args.png {
        draw_boxes(&map, &args.file, png)?;
    }
    let width = args.width.unwrap_or_else(terminal_columns);
    console
        .print_result(&counts, || map.to_text_with_rulers(width.into()) + &counts_text(&counts))?;
    Ok(ExitCode::Done)
}

fn read(args: &MapArgs) -> Result<(MapCounts, GridMap), InputError> {
    let policy = args.unknown.into();
    let Some(pixels) = load_pixel_map(&args.file, args.resolution_m)? else {
        // A map in characters is given in boxes. Unknown ones are counted before the policy replaces them.
        let options = GridOptions {
            box_size_m: args.box_size_m,
            resolution_m: args.resolution_m,
            unknown: UnknownPolicy::Keep,
        };
        let ImportedMap { map, report } = import_map(&args.file, options)?;
        let pixels = map.counts();
        let map = map.with_unknown(policy);
        let mut counts = counts(&map, (map.width(), map.height()), pixels, map.box_size_m);
        counts.report = report;
        return Ok((counts, map));
    };
    let map = pixels.to_boxes(args.box_size_m, policy)?;
    let size = (pixels.width(), pixels.height());
    let mut counts = counts(&map, size, pixels.counts(), pixels.resolution_m());
    counts.report = pixels.into_report();
    Ok((counts, map))
}

fn counts(
    map: &GridMap,
    (width, height): (u32, u32),
    pixels: CellCounts,
    resolution_m: f64,
) -> MapCounts {
    MapCounts {
        width,
        height,
        free: pixels.free,
        occupied: pixels.wall,
        unknown: pixels.unknown,
        resolution_m,
        origin_m: map.plane.origin_m,
        yaw_rad: map.plane.yaw_rad,
        box_size_m: map.box_size_m,
        width_boxes: map.width(),
        height_boxes: map.height(),
        boxes: map.counts(),
        report: ImportReport::default(),
    }
}

fn counts_text(c: &MapCounts) -> String {
    format!(
        "{} x {} pixels of {} m: {} free, {} occupied, {} unknown\n\
         {} x {} boxes of {} m: {} free, {} wall, {} unknown\n",
        c.width,
        c.height,
        c.resolution_m,
        c.free,
        c.occupied,
        c.unknown,
        c.width_boxes,
        c.height_boxes,
        c.box_size_m,
        c.boxes.free,
        c.boxes.wall,
        c.boxes.unknown,
    )
}

fn draw_boxes(map: &GridMap, file: &Path, png: &Path) -> Result<(), Failure> {
    let scenery = Scenery {
        name: file.file_name().unwrap_or_default().display().to_string(),
        dimensions: 2,
        cycle_s: 1.0,
        floor: Some(map.occupancy_grid()),
        bodies: Vec::new(),
        names: Vec::new(),
        groups: Vec::new(),
        earth: Default::default(),
        traffic: None,
    };
    let caption = format!("{} x {} boxes of {} m", map.width(), map.height(), map.box_size_m);
    let svg = draw(&scenery, &Frame::default(), &[], &PictureOptions::page(&scenery, caption))?;
    write_png(png, &svg)
}
