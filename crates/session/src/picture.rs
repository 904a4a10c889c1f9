//! Pictures as files.

use crate::Error;
use crate::VERSION;
use crate::files::write_atomically;
use crate::run_tables::read_trails;
use sidestep_draw::{PictureOptions, describe, draw, to_png};
use sidestep_kernel::Simulation;
use sidestep_kernel::view::FrameOptions;
use sidestep_record::RunFolder;
use std::io::Write;
use std::path::Path;

/// Longer side of a PNG in pixels.
const PNG_WIDTH_PX: u32 = 1600;

/// The names of the pictures in a run folder.
pub(crate) const NAMES: [&str; 2] = ["trajectories.svg", "trajectories.png"];

/// Draws the trajectory picture into a run folder, as SVG and PNG.
///
/// # Errors
/// When it cannot be drawn or written.
pub(crate) fn draw_run(run: &mut dyn Simulation, folder: &RunFolder) -> Result<(), Error> {
    let planned = run.config().cycles;
    let mut origin = footnote(run);
    if run.cycle() < planned && !run.is_over() {
        origin = format!("{origin} INCOMPLETE: {} of {planned} cycles.", run.cycle());
    }
    let svg = draw_svg(run, Some(folder.path()), &origin)?;
    let [as_svg, as_png] = NAMES.map(|name| folder.path().join(name));
    write_bytes(&as_svg, svg.as_bytes())?;
    write_png(&as_png, &svg)
}

/// Returns the present state of the run as SVG, with the tracks that its folder has. `origin` is a
/// line of small print that identifies the run.
///
/// # Errors
/// When the folder is damaged, or the picture cannot be drawn.
pub(crate) fn draw_svg(
    run: &mut dyn Simulation,
    folder: Option<&Path>,
    origin: &str,
) -> Result<String, Error> {
    let scenery = run.scenery();
    let frame = run.frame(FrameOptions::WITHOUT_SCANS);
    let trails = match folder {
        Some(folder) => read_trails(&run.position_columns(), folder, &scenery, &frame)?,
        None => Vec::new(),
    };
    let caption = format!("{} {origin}", describe(&scenery, &frame, &trails));
    Ok(draw(&scenery, &frame, &trails, &PictureOptions::page(&scenery, caption))?)
}

/// Returns the small print under a picture: what identifies the run.
pub(crate) fn footnote(run: &dyn Simulation) -> String {
    format!("Seed {}, sidestep {}.", run.config().seed, VERSION)
}

/// Writes an SVG picture as PNG.
///
/// # Errors
/// When it cannot be drawn or written.
pub fn write_png(path: &Path, svg: &str) -> Result<(), Error> {
    write_bytes(path, &png_bytes(svg)?)
}

/// Returns an SVG picture as PNG.
///
/// # Errors
/// When it cannot be drawn.
pub fn png_bytes(svg: &str) -> Result<Vec<u8>, Error> {
    Ok(to_png(svg, PNG_WIDTH_PX)?)
}

fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_atomically(path, |file| file.write_all(bytes))
}
