//! Pictures and animations of a run that is computed again.

use super::target::Target;
use super::{Film as Options, Job, Written};
use crate::driver::Sinks;
use crate::files::replace;
use crate::film::{Pictures, write_gif};
use crate::picture::{origin, svg};
use crate::watcher::{Progress, Watched};
use crate::{Error, Watcher};
use sidestep::kernel::Cycle;
use sidestep_draw::{Film, Still, to_png};
use std::io::Write;
use std::path::Path;

/// Largest number of frames of an animation, unless more are requested.
const MOST_PICTURES: Cycle = 150;
/// Frames per second.
const FPS: u16 = 15;
const GIF_PX: u16 = 640;
const FRAME_PX: u16 = 1280;
const PNG_PX: u16 = 1600;

/// Exports the picture of the run at its end, or at one cycle.
pub(super) fn export_svg(job: &Job<'_>) -> Result<Written, Error> {
    export_picture(job, ".svg", |svg| Ok(svg.into_bytes()))
}

/// Exports the same picture as PNG.
pub(super) fn export_png(job: &Job<'_>, width_px: Option<u16>) -> Result<Written, Error> {
    export_picture(job, ".png", |svg| Ok(to_png(&svg, width_px.unwrap_or(PNG_PX).into())?))
}

fn export_picture(
    job: &Job<'_>,
    ending: &str,
    encode: impl FnOnce(String) -> Result<Vec<u8>, Error>,
) -> Result<Written, Error> {
    let target = Target::file(job, ending)?;
    let mut run = job.run_up_to(job.wanted.from.unwrap_or(job.span.until))?;
    let is_confirmed = job.recorded.confirm(run.as_ref())?;
    let origin = format!("Cycle {}. {}", run.cycle(), origin(run.as_ref()));
    let svg = svg(run.as_mut(), job.recorded.folder.as_deref(), &origin)?;
    let bytes = encode(svg)?;
    replace(target.path(), |file| file.write_all(&bytes))?;
    Ok(Written::one(target.path(), is_confirmed))
}

/// Exports an animation as GIF.
pub(super) fn export_gif(job: &Job<'_>, options: Options) -> Result<Written, Error> {
    let target = Target::file(job, ".gif")?;
    export_film(job, options, &target, |film| {
        film.write_gif(options.width_px.unwrap_or(GIF_PX), target.path())
    })
}

/// Exports an animation as numbered pictures in a folder.
pub(super) fn export_frames(job: &Job<'_>, options: Options) -> Result<Written, Error> {
    let target = Target::folder(job, "-frames", &["png"])?;
    export_film(job, options, &target, |film| {
        let width_px = options.width_px.unwrap_or(FRAME_PX);
        target.make_folder(|folder| film.write_frames(width_px, folder))
    })
}

fn export_film(
    job: &Job<'_>,
    options: Options,
    target: &Target,
    write: impl FnOnce(&Drawn<'_>) -> Result<(), Error>,
) -> Result<Written, Error> {
    let span = job.span;
    let mut run = job.run_up_to(span.from)?;
    let usual = (span.until - span.from).div_ceil(MOST_PICTURES - 1).max(1);
    let mut pictures =
        Pictures::new(run.as_ref(), job.wanted.every.unwrap_or(usual), span.until - span.from);
    let sinks = Sinks { film: Some(&mut pictures), ..Sinks::default() };
    job.drive(run.as_mut(), span.until, sinks)?;
    let is_confirmed = job.recorded.confirm(run.as_ref())?;
    let film = Drawn { pictures, fps: options.fps.unwrap_or(FPS), watcher: job.watcher };
    let written = write(&film);
    if written.is_err() && !job.watcher.go_on() {
        return Err(Error::Interrupted);
    }
    written?;
    let shown = (film.pictures.len(), film.fps);
    Ok(Written { film: Some(shown), ..Written::one(target.path(), is_confirmed) })
}

/// An animation that is being drawn.
struct Drawn<'a> {
    pictures: Pictures,
    fps: u16,
    watcher: &'a dyn Watcher,
}

impl Drawn<'_> {
    fn write_gif(&self, width_px: u16, to: &Path) -> Result<(), Error> {
        let view = self.pictures.view(width_px.into())?;
        let watched = Watched(self.watcher);
        let pixels = (0..self.pictures.len()).map(|index| {
            let picture = self.draw(&view, index, &watched).map_err(std::io::Error::other)?;
            Ok(picture.rgba().to_vec())
        });
        replace(to, |file| write_gif(file, view.size_px(), f64::from(self.fps), pixels))
    }

    /// Writes numbered pictures to `folder`.
    fn write_frames(&self, width_px: u16, folder: &Path) -> Result<(), Error> {
        let view = self.pictures.view(width_px.into())?;
        let watched = Watched(self.watcher);
        for index in 0..self.pictures.len() {
            let png = self.draw(&view, index, &watched)?.to_png()?;
            // Numbers start at 1, as ffmpeg expects.
            let path = folder.join(format!("frame-{:05}.png", index + 1));
            std::fs::write(&path, png).map_err(|e| Error::write(&path, &e))?;
        }
        Ok(())
    }

    fn draw(&self, view: &Film, index: usize, watched: &Watched<'_>) -> Result<Still, Error> {
        if !self.watcher.go_on() {
            return Err(Error::Interrupted);
        }
        let share = index as f64 / self.pictures.len().max(1) as f64;
        watched.at(Progress::Stage { what: "drawing", share });
        self.pictures.draw(view, index)
    }
}
