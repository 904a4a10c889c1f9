//! Pictures as files.

use crate::exit::Failure;
use crate::files::replace;
use crate::worlds::{Pictured, Run};
use sidestep_draw::to_png;
use sidestep_record::RunFolder;
use std::io::Write;
use std::path::Path;

/// Longer side of a PNG.
const PNG_PX: u32 = 1600;

/// Draws the trajectory picture into a run folder, as SVG and PNG.
///
/// # Errors
/// When it cannot be drawn or written.
pub(crate) fn draw_run(run: &dyn Run, folder: &RunFolder) -> Result<(), Failure> {
    let plan = run.plan();
    let origin = match run.cycle() < plan.cycles && !run.is_over() {
        true => {
            format!("{} INCOMPLETE: {} of {} cycles.", origin(run), run.cycle(), plan.cycles)
        }
        false => origin(run),
    };
    let svg = run.picture(Pictured { folder: Some(folder.path()), origin: &origin })?;
    write(&folder.path().join("trajectories.svg"), svg.as_bytes())?;
    write_png(&folder.path().join("trajectories.png"), &svg)
}

/// Small print under a picture.
pub(crate) fn origin(run: &dyn Run) -> String {
    format!("Seed {}, sidestep {}.", run.plan().seed, env!("CARGO_PKG_VERSION"))
}

/// Writes an SVG picture as PNG.
///
/// # Errors
/// When it cannot be drawn or written.
pub(crate) fn write_png(path: &Path, svg: &str) -> Result<(), Failure> {
    write(path, &to_png(svg, PNG_PX)?)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    replace(path, |file| file.write_all(bytes))
}
