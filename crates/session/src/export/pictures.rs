//! Pictures and animations of a run that is computed again.

use super::target::Target;
use super::{AnimationOptions as Options, ExportContext, ExportResult};
use crate::driver::Sinks;
use crate::frame_sink::{AnimationFrames, write_gif};
use crate::picture::{draw_moment, draw_svg, footnote};
use crate::run_tables::has_rows;
use crate::watcher::{Progress, ProgressGuard};
use crate::{Error, Watcher};
use sidestep_draw::{AnimationFrame, AnimationRenderer, AnimationSize, to_png};
use sidestep_kernel::view::{FrameOptions, Trail};
use sidestep_kernel::{Cycle, Simulation};
use std::io::Write;
use std::path::Path;

/// Largest number of frames of an animation, unless more are requested: ten seconds at [`DEFAULT_FPS`].
const MAX_FRAMES: Cycle = 150;
/// Fast enough for the eye to join the frames, and slow enough that 150 of them show a whole run.
const DEFAULT_FPS: u16 = 15;
/// Number of cycles of tracks in a picture of a run without recorded places: as many as can be read on a floor.
const SAMPLED_CYCLES: Cycle = 400;
// A GIF is mostly shown inside a page and grows with its area; frames are material for videos, and a PNG is one
// picture.
const DEFAULT_GIF_WIDTH_PX: u16 = 640;
const DEFAULT_FRAME_WIDTH_PX: u16 = 1280;
const DEFAULT_PNG_WIDTH_PX: u16 = 1600;

/// Exports the picture of the run at its end, or at one cycle.
pub(super) fn export_svg(job: &ExportContext<'_>) -> Result<ExportResult, Error> {
    export_picture(job, ".svg", |svg| Ok(svg.into_bytes()))
}

pub(super) fn export_png(
    job: &ExportContext<'_>,
    width_px: Option<u16>,
) -> Result<ExportResult, Error> {
    let default_px = match job.look.size_px {
        Some([width, height]) => width.max(height),
        None => DEFAULT_PNG_WIDTH_PX.into(),
    };
    let longer_px = width_px.map_or(default_px, u32::from);
    export_picture(job, ".png", |svg| Ok(to_png(&svg, longer_px)?))
}

fn export_picture(
    job: &ExportContext<'_>,
    ending: &str,
    encode: impl FnOnce(String) -> Result<Vec<u8>, Error>,
) -> Result<ExportResult, Error> {
    let target = Target::for_file(job, ending)?;
    let cycle = job.wanted.from.unwrap_or(job.span.until);
    let from = job.look.trails_from.unwrap_or(cycle.saturating_sub(SAMPLED_CYCLES)).min(cycle);
    let has_rows = job.has_positions()?;
    let mut run = job.run_up_to(if has_rows { cycle } else { from })?;
    let sampled = if has_rows { None } else { Some(job.sample_trails(run.as_mut(), cycle)?) };
    let is_confirmed = job.recorded.verify_digest(run.as_ref())?;
    let origin = format!("Cycle {}. {}", run.cycle(), footnote(run.as_ref()));
    let svg = match sampled {
        None => draw_svg(run.as_mut(), job.recorded.folder.as_deref(), &origin, &job.look)?,
        Some(trails) => {
            let scenery = run.scenery();
            let frame = run.frame(FrameOptions::WITHOUT_SCANS);
            job.look.check(&scenery, &frame)?;
            draw_moment(&scenery, &frame, &trails, (&origin, &job.look))?
        }
    };
    let bytes = encode(svg)?;
    target.write_stream(|file| file.write_all(&bytes))?;
    Ok(ExportResult::single_file(target.path(), is_confirmed))
}

pub(super) fn export_gif(job: &ExportContext<'_>, options: Options) -> Result<ExportResult, Error> {
    let target = Target::for_file(job, ".gif")?;
    export_animation(job, options, &target, |animation| {
        animation.write_gif(job.animation_size(options.width_px, DEFAULT_GIF_WIDTH_PX), &target)
    })
}

pub(super) fn export_frames(
    job: &ExportContext<'_>,
    options: Options,
) -> Result<ExportResult, Error> {
    let target = Target::for_folder(job, "-frames")?;
    export_animation(job, options, &target, |animation| {
        let size = job.animation_size(options.width_px, DEFAULT_FRAME_WIDTH_PX);
        target.write_folder(job.watcher, |folder| animation.write_frames(size, folder))
    })
}

impl ExportContext<'_> {
    /// Returns whether places are recorded: an MCAP file has none, nor a run that was told to keep none.
    fn has_positions(&self) -> Result<bool, Error> {
        let Some(folder) = self.recorded.folder.as_deref() else { return Ok(false) };
        let start = self.recorded.start(1)?;
        Ok(start.position_columns().iter().any(|rows| has_rows(folder, rows.table)))
    }

    /// Drives the run to a cycle, and returns the tracks since its present one.
    fn sample_trails(&self, run: &mut dyn Simulation, until: Cycle) -> Result<Vec<Trail>, Error> {
        let cycles = until.saturating_sub(run.cycle());
        let mut frames = AnimationFrames::new(run, cycles.max(1), cycles, &self.look);
        let sinks = Sinks { frames: Some(&mut frames), ..Sinks::default() };
        self.drive(run, until, sinks)?;
        Ok(frames.last_trails())
    }

    /// Returns the size of an animation: a given one, or a longer side.
    fn animation_size(&self, longer_px: Option<u16>, default_px: u16) -> AnimationSize {
        match self.look.size_px {
            Some(size_px) => AnimationSize::Exact(size_px),
            None => AnimationSize::LongerSide(longer_px.unwrap_or(default_px).into()),
        }
    }
}

fn export_animation(
    job: &ExportContext<'_>,
    options: Options,
    target: &Target,
    write: impl FnOnce(&Animation<'_>) -> Result<(), Error>,
) -> Result<ExportResult, Error> {
    let span = job.span;
    let mut run = job.run_up_to(span.from)?;
    let cycles = span.until - span.from;
    // One frame is of the start, before the first interval.
    let default_every = cycles.div_ceil(MAX_FRAMES - 1).max(1);
    let every = job.wanted.every.unwrap_or(default_every);
    job.look.check(&run.scenery(), &run.frame(FrameOptions::WITHOUT_SCANS))?;
    let mut pictures = AnimationFrames::new(run.as_ref(), every, cycles, &job.look);
    let sinks = Sinks { frames: Some(&mut pictures), ..Sinks::default() };
    job.drive(run.as_mut(), span.until, sinks)?;
    let is_confirmed = job.recorded.verify_digest(run.as_ref())?;
    let fps = options.fps.unwrap_or(DEFAULT_FPS);
    let animation = Animation { pictures, fps, watcher: job.watcher };
    let written = write(&animation);
    // The interrupt of a GIF comes back inside an I/O error, as a file that could not be written.
    if written.is_err() && !job.watcher.should_continue() {
        return Err(Error::Interrupted);
    }
    written?;
    let shown = (animation.pictures.len(), animation.fps);
    Ok(ExportResult { film: Some(shown), ..ExportResult::single_file(target.path(), is_confirmed) })
}

/// An animation that is being drawn.
struct Animation<'a> {
    pictures: AnimationFrames,
    fps: u16,
    watcher: &'a dyn Watcher,
}

impl Animation<'_> {
    fn write_gif(&self, size: AnimationSize, to: &Target) -> Result<(), Error> {
        let view = self.pictures.view(size)?;
        let watched = ProgressGuard(self.watcher);
        let pixels = (0..self.pictures.len()).map(|index| {
            let picture = self.draw(&view, index, &watched).map_err(std::io::Error::other)?;
            Ok(picture.rgba().to_vec())
        });
        to.write_stream(|file| write_gif(file, view.size_px(), f64::from(self.fps), pixels))
    }

    fn write_frames(&self, size: AnimationSize, folder: &Path) -> Result<(), Error> {
        let view = self.pictures.view(size)?;
        let watched = ProgressGuard(self.watcher);
        for index in 0..self.pictures.len() {
            let png = self.draw(&view, index, &watched)?.to_png()?;
            // Numbers start at 1, as ffmpeg expects.
            let path = folder.join(format!("frame-{:05}.png", index + 1));
            std::fs::write(&path, png).map_err(|e| Error::cannot_store(&path, &e))?;
        }
        Ok(())
    }

    fn draw(
        &self,
        view: &AnimationRenderer,
        index: usize,
        watched: &ProgressGuard<'_>,
    ) -> Result<AnimationFrame, Error> {
        if !self.watcher.should_continue() {
            return Err(Error::Interrupted);
        }
        let share = index as f64 / self.pictures.len().max(1) as f64;
        watched.report(Progress::Stage { what: "drawing", share });
        self.pictures.draw(view, index)
    }
}
