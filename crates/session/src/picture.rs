//! Pictures as files.

use crate::Error;
use crate::files::replace;
use crate::recorded::trails;
use sidestep::VERSION;
use sidestep::kernel::Simulation;
use sidestep::kernel::view::Look;
use sidestep_draw::{Options, describe, draw, to_png};
use sidestep_record::RunFolder;
use std::io::Write;
use std::path::Path;

/// Longer side of a PNG in pixels.
const PNG_PX: u32 = 1600;

/// Draws the trajectory picture into a run folder, as SVG and PNG.
///
/// # Errors
/// When it cannot be drawn or written.
pub(crate) fn draw_run(run: &mut dyn Simulation, folder: &RunFolder) -> Result<(), Error> {
    let plan = run.plan();
    let origin = match run.cycle() < plan.cycles && !run.is_over() {
        true => {
            format!("{} INCOMPLETE: {} of {} cycles.", origin(run), run.cycle(), plan.cycles)
        }
        false => origin(run),
    };
    let svg = svg(run, Some(folder.path()), &origin)?;
    write(&folder.path().join("trajectories.svg"), svg.as_bytes())?;
    write_png(&folder.path().join("trajectories.png"), &svg)
}

/// Returns the present state of the run as SVG, with the tracks that its folder has. `origin` is a
/// line of small print that identifies the run.
///
/// # Errors
/// When the folder is damaged, or the picture cannot be drawn.
pub(crate) fn svg(
    run: &mut dyn Simulation,
    folder: Option<&Path>,
    origin: &str,
) -> Result<String, Error> {
    let (scenery, frame) = (run.scenery(), run.frame(Look::BODIES));
    let trails = match folder {
        Some(folder) => trails(&run.place_rows(), folder, &scenery, &frame)?,
        None => Vec::new(),
    };
    let caption = format!("{} {origin}", describe(&scenery, &frame, &trails));
    Ok(draw(&scenery, &frame, &trails, &Options::page(&scenery, caption))?)
}

/// Returns the small print under a picture.
pub(crate) fn origin(run: &dyn Simulation) -> String {
    format!("Seed {}, sidestep {}.", run.plan().seed, VERSION)
}

/// Writes an SVG picture as PNG.
///
/// # Errors
/// When it cannot be drawn or written.
pub fn write_png(path: &Path, svg: &str) -> Result<(), Error> {
    write(path, &to_png(svg, PNG_PX)?)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    replace(path, |file| file.write_all(bytes))
}
