//! Pictures and films of a run that is computed again.

use super::target::Target;
use super::{ExportArgs, Form, Span, report, run_up_to};
use crate::console::Console;
use crate::driver::{Sinks, drive};
use crate::exit::{ExitCode, Failure};
use crate::files::replace;
use crate::film::{Pictures, write_gif};
use crate::interrupt;
use crate::picture::{origin, svg};
use crate::progress::Stages;
use crate::rerun::Recorded;
use sidestep::kernel::Cycle;
use sidestep_draw::{Film, Still, to_png};
use std::io::{Error, Write};
use std::path::Path;

/// A film has no more pictures than this unless more are asked for.
const MOST_PICTURES: Cycle = 150;
/// Pictures per second.
const FPS: u16 = 15;
const GIF_PX: u16 = 640;
const FRAME_PX: u16 = 1280;
const PNG_PX: u16 = 1600;

/// The picture of the run at its end, or at a moment.
pub(super) fn export_picture(
    args: &ExportArgs,
    recorded: &Recorded,
    span: Span,
    console: Console,
) -> Result<ExitCode, Failure> {
    let target = Target::file(args, &format!(".{}", args.to.name()))?;
    let at = args.from.unwrap_or(span.until);
    let Some(mut run) = run_up_to(recorded, at, args.workers, console)? else {
        return Ok(ExitCode::Interrupted);
    };
    let confirmed = recorded.confirm(run.as_ref())?;
    let origin = format!("Cycle {}. {}", run.cycle(), origin(run.as_ref()));
    let svg = svg(run.as_mut(), recorded.folder.as_deref(), &origin)?;
    let bytes = match args.to {
        Form::Svg => svg.into_bytes(),
        _ => to_png(&svg, args.width.unwrap_or(PNG_PX).into())?,
    };
    replace(target.path(), |file| file.write_all(&bytes))?;
    report(console, &[target.path().to_path_buf()], confirmed, None);
    Ok(ExitCode::Done)
}

/// A film.
pub(super) fn export_film(
    args: &ExportArgs,
    recorded: &Recorded,
    span: Span,
    console: Console,
) -> Result<ExitCode, Failure> {
    let target = match args.to {
        Form::Gif => Target::file(args, ".gif")?,
        _ => Target::folder(args, "-frames", "png")?,
    };
    let Some(mut run) = run_up_to(recorded, span.from, args.workers, console)? else {
        return Ok(ExitCode::Interrupted);
    };
    let every = args.every.unwrap_or((span.until - span.from).div_ceil(MOST_PICTURES - 1).max(1));
    let mut pictures = Pictures::new(run.as_ref(), every);
    drive(
        run.as_mut(),
        span.until,
        Sinks { film: Some(&mut pictures), ..Sinks::default() },
        console,
    )?;
    if run.cycle() < span.until && !run.is_over() {
        return Ok(ExitCode::Interrupted);
    }
    let confirmed = recorded.confirm(run.as_ref())?;
    let film = Drawn { pictures, fps: args.fps.unwrap_or(FPS), console };
    let written = match args.to {
        Form::Gif => film.write_gif(args, target.path()),
        _ => target.make_folder(|folder| film.write_frames(args, folder, target.path())),
    };
    if interrupt::requested() && written.is_err() {
        return Ok(ExitCode::Interrupted);
    }
    let more = written?;
    report(console, &[target.path().to_path_buf()], confirmed, Some(more));
    Ok(ExitCode::Done)
}

/// A film that is being drawn.
struct Drawn {
    pictures: Pictures,
    fps: u16,
    console: Console,
}

impl Drawn {
    fn write_gif(&self, args: &ExportArgs, to: &Path) -> Result<String, Failure> {
        let view = self.pictures.view(args.width.unwrap_or(GIF_PX).into())?;
        let progress = Stages::new(self.console);
        let pixels = (0..self.pictures.len()).map(|index| {
            let picture = self.draw(&view, index, &progress).map_err(Error::other)?;
            Ok(picture.rgba().to_vec())
        });
        let written =
            replace(to, |file| write_gif(file, view.size_px(), f64::from(self.fps), pixels));
        progress.clear();
        written?;
        let seconds = self.pictures.len() as f64 / f64::from(self.fps);
        Ok(format!("{} pictures, {seconds:.1} s", self.pictures.len()))
    }

    /// Numbered pictures in `folder`, which will be called `named`.
    fn write_frames(
        &self,
        args: &ExportArgs,
        folder: &Path,
        named: &Path,
    ) -> Result<String, Failure> {
        let view = self.pictures.view(args.width.unwrap_or(FRAME_PX).into())?;
        let progress = Stages::new(self.console);
        for index in 0..self.pictures.len() {
            let picture = self.draw(&view, index, &progress)?;
            let png = picture.to_png()?;
            // From 1 on, as ffmpeg counts.
            let path = folder.join(format!("frame-{:05}.png", index + 1));
            std::fs::write(&path, png).map_err(|e| Failure::write(&path, &e))?;
        }
        progress.clear();
        let named = named.display();
        Ok(format!(
            "{} pictures; join them with:\n  ffmpeg -framerate {} -i '{named}/frame-%05d.png' \
             -c:v libx264 -pix_fmt yuv420p '{named}.mp4'",
            self.pictures.len(),
            self.fps
        ))
    }

    fn draw(&self, view: &Film, index: usize, progress: &Stages) -> Result<Still, Failure> {
        if interrupt::requested() {
            return Err(Failure::stopped("interrupted", "start it again; nothing was written"));
        }
        progress.at("drawing", index as f64 / self.pictures.len().max(1) as f64);
        self.pictures.draw(view, index)
    }
}
