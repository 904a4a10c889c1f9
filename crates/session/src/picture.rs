//! Pictures as files.

use crate::Error;
use crate::VERSION;
use crate::files::write_atomically;
use crate::run_tables::read_trails;
use sidestep_draw::{PictureOptions, PictureView, Style, TrailChoice, describe, draw, to_png};
use sidestep_kernel::view::{AgentNumber, Frame, FrameOptions, Scenery, Trail};
use sidestep_kernel::{Cycle, InputError, Simulation};
use sidestep_record::RunFolder;
use std::io::Write;
use std::path::Path;

/// Longer side of a PNG in pixels.
const PNG_WIDTH_PX: u32 = 1600;

/// What a picture or an animation shows of a run, and how large.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PictureLook {
    /// The agents whose trails and names are drawn; the others are pale. Without any, those that can be distinguished.
    pub agents: Vec<AgentNumber>,
    /// The first cycle of trails in a picture; without it, they are as long as they can be distinguished.
    pub trails_from: Option<Cycle>,
    /// The direction of view.
    pub view: PictureView,
    /// Width and height in pixels; without them the usual size.
    pub size_px: Option<[u32; 2]>,
}

impl PictureLook {
    pub(crate) fn trail_choice(&self) -> TrailChoice {
        TrailChoice { agents: self.agents.clone(), from: self.trails_from }
    }

    /// Refuses agents that are certainly none of the run, and views that would show a line.
    ///
    /// # Errors
    /// When there is such an agent or view.
    pub(crate) fn check(&self, scenery: &Scenery, frame: &Frame) -> Result<(), InputError> {
        AgentNumber::check_all(&self.agents, scenery, &frame.bodies)?;
        let is_from_above = matches!(self.view, PictureView::Usual | PictureView::Top);
        if scenery.dimensions == 2 && !is_from_above {
            let cause = "everything in this run lies in a plane, which is seen from above";
            let remedy = "give top, or leave it out";
            return Err(InputError::new(format!("--view {}", self.view), cause, remedy));
        }
        Ok(())
    }
}

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
    let svg = draw_svg(run, Some(folder.path()), &origin, &PictureLook::default())?;
    let [as_svg, as_png] = NAMES.map(|name| folder.path().join(name));
    write_bytes(&as_svg, svg.as_bytes())?;
    write_png(&as_png, &svg)
}

/// Returns the present state of the run as SVG, with the tracks that its folder has. `origin` is a
/// line of small print that identifies the run.
///
/// # Errors
/// When the folder is damaged, the look fits nothing of the run, or the picture cannot be drawn.
pub(crate) fn draw_svg(
    run: &mut dyn Simulation,
    folder: Option<&Path>,
    origin: &str,
    look: &PictureLook,
) -> Result<String, Error> {
    let scenery = run.scenery();
    let frame = run.frame(FrameOptions::WITHOUT_SCANS);
    look.check(&scenery, &frame)?;
    let choice = look.trail_choice();
    let trails = match folder {
        Some(folder) => read_trails(&run.position_columns(), folder, &scenery, &frame, &choice)?,
        None => Vec::new(),
    };
    draw_moment(&scenery, &frame, &trails, (origin, look))
}

/// Returns a moment with the tracks that led to it as SVG.
///
/// # Errors
/// When it cannot be drawn.
pub(crate) fn draw_moment(
    scenery: &Scenery,
    frame: &Frame,
    trails: &[Trail],
    (origin, look): (&str, &PictureLook),
) -> Result<String, Error> {
    let choice = look.trail_choice();
    let caption = format!("{} {origin}", describe(scenery, frame, trails, &choice));
    let options = PictureOptions {
        trails: choice,
        view: look.view,
        size_px: look.size_px,
        ..PictureOptions::page(scenery, caption)
    };
    Ok(draw(scenery, frame, trails, &options)?)
}

/// Returns the tracks of the run in a folder as a drawing of some size, without title and small print, and the tracks
/// in it.
///
/// # Errors
/// When the folder is damaged, or the drawing has no room.
pub(crate) fn draw_tracks(
    run: &mut dyn Simulation,
    folder: &Path,
    (style, may_grow): (&Style, bool),
) -> Result<(String, Vec<Trail>), Error> {
    let scenery = run.scenery();
    let frame = run.frame(FrameOptions::WITHOUT_SCANS);
    let choice = TrailChoice::default();
    let trails = read_trails(&run.position_columns(), folder, &scenery, &frame, &choice)?;
    let options = PictureOptions {
        style: *style,
        title: String::new(),
        may_grow,
        size_px: Some([style.width_px, style.height_px].map(|px| px.round() as u32)),
        ..PictureOptions::page(&scenery, "")
    };
    let svg = draw(&scenery, &frame, &trails, &options)?;
    Ok((svg, trails))
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
