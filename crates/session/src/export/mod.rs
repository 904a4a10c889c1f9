//! Exports of recorded runs to other formats. Tables are copied from the run folder; everything
//! else is computed again from the recorded scenario.

mod cycle_window;
mod frame_export;
mod geojson;
mod league;
mod pictures;
mod tables;
mod target;
mod trajectory;

pub use cycle_window::CycleWindow;
pub use frame_export::{ExportFile, ExportPlace, FrameSource};

use crate::driver::{Sinks, drive};
use crate::frame_sink::{BagSink, EndReason, McapSink};
use crate::picture::PictureLook;
use crate::{Error, RecordedRun, Watcher};
use sidestep_kernel::{Cycle, InputError, Simulation};
use std::path::{Path, PathBuf};
use target::Target;

/// The output formats, each with those options that no other one has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Format {
    /// Tables as text: one of this name, or all.
    Csv(Option<String>),
    /// Tables as Parquet, one file each: one of this name, or all.
    Parquet(Option<String>),
    /// Paths of airplanes on earth, for maps.
    GeoJson,
    /// Robots, tasks and the map in the format of the League of Robot Runners, for its viewer.
    League,
    /// Bodies, scans and events, for Foxglove and other viewers.
    Mcap,
    /// ROS 2 bag: odometry, true poses and scans of robots, also of those that form a chain, with the map.
    RosBag,
    /// Motions of the joints of arms: a ROS 2 bag with `JointTrajectory` and `JointState`, CSV and JSON.
    Trajectory,
    /// Picture of the run, or of one cycle.
    Svg,
    /// The same picture as PNG.
    Png {
        /// The longer side in pixels; `None` for the default.
        width_px: Option<u16>,
    },
    /// Animated GIF; it repeats without end.
    Gif(AnimationOptions),
    /// Animation as PNG files `frame-00001.png` and so on in a folder.
    Frames(AnimationOptions),
}

/// Options that both kinds of animations have; they change nothing in the frames that are taken.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AnimationOptions {
    /// Frames shown per second, whatever time passes between them in the run; `None` for 15.
    pub fps: Option<u16>,
    /// The longer side in pixels; `None` for 640 of a GIF, and 1280 of PNG files.
    pub width_px: Option<u16>,
}

/// A requested export: its format, its part of the run and its place.
#[derive(Debug, Clone)]
pub struct ExportRequest<'a> {
    /// The format, with its own options.
    pub form: Format,
    /// The look of a picture or an animation.
    pub look: PictureLook,
    /// The part of the run, and the place.
    pub scope: ExportScope<'a>,
}

/// The part of a run that is exported, and the place of the result.
#[derive(Debug, Clone)]
pub struct ExportScope<'a> {
    /// The file or folder; `None` for one beside the recorded run, with its name.
    pub out: Option<&'a Path>,
    /// Whether an earlier export is replaced; without it the export is refused where something exists.
    pub replace: bool,
    /// The first cycle; for pictures, the cycle that is shown.
    pub from: Option<Cycle>,
    /// The last cycle, whose state is still exported; without it the last recorded one.
    pub until: Option<Cycle>,
    /// Only cycles that are multiples of this; tables always have all events. Without it,
    /// animations have at most 150 frames.
    pub every: Option<Cycle>,
    /// Number of workers, if something is computed again.
    pub workers: usize,
}

/// The files that were written, and how far they are trusted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExportResult {
    /// The files, or the folder of an animation's frames.
    pub paths: Vec<PathBuf>,
    /// Whether a run that was computed again reached the recorded digest; false for tables, which are copied, and for
    /// an export that stops before the recorded end.
    pub is_confirmed: bool,
    /// Number of frames of an animation, and number shown per second.
    pub film: Option<(usize, u16)>,
}

impl ExportResult {
    fn single_file(path: impl Into<PathBuf>, is_confirmed: bool) -> Self {
        Self { paths: vec![path.into()], is_confirmed, film: None }
    }
}

/// Exports a recorded run.
///
/// # Errors
/// When the part or the place is wrong, the result cannot be stored, or the run differs from the
/// recorded one; [`Error::Interrupted`] when the watcher asked to stop.
pub fn export(
    recorded: &RecordedRun,
    wanted: &ExportRequest<'_>,
    watcher: &dyn Watcher,
) -> Result<ExportResult, Error> {
    recorded.check_has_content()?;
    let job = ExportContext {
        recorded,
        wanted: &wanted.scope,
        look: wanted.look.clone(),
        span: CycleRange::from_request(&wanted.scope, recorded)?,
        watcher,
    };
    match &wanted.form {
        Format::Csv(table) => tables::export(&job, tables::TableFormat::Csv, table.as_deref()),
        Format::Parquet(table) => {
            tables::export(&job, tables::TableFormat::Parquet, table.as_deref())
        }
        Format::GeoJson => geojson::export(&job),
        Format::League => league::export(&job),
        Format::Mcap => export_mcap(&job),
        Format::RosBag => export_bag(&job),
        Format::Trajectory => trajectory::export(&job),
        Format::Svg => pictures::export_svg(&job),
        Format::Png { width_px } => pictures::export_png(&job, *width_px),
        Format::Gif(options) => pictures::export_gif(&job, *options),
        Format::Frames(options) => pictures::export_frames(&job, *options),
    }
}

/// An export whose cycles were checked against the recorded ones.
struct ExportContext<'a> {
    recorded: &'a RecordedRun,
    wanted: &'a ExportScope<'a>,
    look: PictureLook,
    span: CycleRange,
    watcher: &'a dyn Watcher,
}

/// The requested cycles, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct CycleRange {
    from: Cycle,
    until: Cycle,
}

impl CycleRange {
    fn from_request(wanted: &ExportScope<'_>, recorded: &RecordedRun) -> Result<Self, InputError> {
        let done = recorded.cycles_done;
        let from = wanted.from.unwrap_or(0);
        let until = wanted.until.unwrap_or(done);
        if from > done {
            let cause = format!("{done} cycles are recorded");
            let remedy = format!("give 0 to {done}");
            return Err(InputError::new(format!("--from {from}"), cause, remedy));
        }
        if until < from || until > done {
            let cause = format!("the part begins at cycle {from}, {done} cycles are recorded");
            let remedy = format!("give {from} to {done}");
            return Err(InputError::new(format!("--until {until}"), cause, remedy));
        }
        Ok(Self { from, until })
    }
}

impl ExportContext<'_> {
    /// Returns the run at the start of a cycle, computed from the last checkpoint if that is before it.
    fn run_up_to(&self, cycle: Cycle) -> Result<Box<dyn Simulation>, Error> {
        let mut run = self.recorded.start_near(cycle, self.wanted.workers)?;
        self.drive(run.as_mut(), cycle, Sinks::default())?;
        Ok(run)
    }

    /// Drives the run to a cycle, or to its end if that comes first.
    fn drive(&self, run: &mut dyn Simulation, until: Cycle, sinks: Sinks<'_>) -> Result<(), Error> {
        drive(run, until, sinks, self.watcher)?;
        if run.cycle() < until && !run.is_over() {
            return Err(Error::Interrupted);
        }
        Ok(())
    }
}

fn export_mcap(job: &ExportContext<'_>) -> Result<ExportResult, Error> {
    let ExportContext { recorded, wanted, span, .. } = job;
    let target = Target::for_mcap(job)?;
    let resolved = recorded.resolved_scenario()?;
    let mut run = job.run_up_to(span.from)?;
    let every = wanted.every.unwrap_or(1);
    let mut sink = McapSink::start(target.path(), every, resolved, run.as_mut(), recorded.build())?;
    job.drive(run.as_mut(), span.until, Sinks { frames: Some(&mut sink), ..Sinks::default() })?;
    let is_confirmed = recorded.verify_digest(run.as_ref())?;
    // A part of a run must not be taken for a complete one.
    let is_whole = span.from == 0 && is_confirmed && recorded.is_complete;
    let ending = if is_whole { EndReason::Complete } else { EndReason::Extract };
    Ok(ExportResult::single_file(sink.finish(run.as_ref(), ending)?, is_confirmed))
}

fn export_bag(job: &ExportContext<'_>) -> Result<ExportResult, Error> {
    let ExportContext { recorded, wanted, span, .. } = job;
    let target = Target::for_folder(job, "-rosbag")?;
    let mut run = job.run_up_to(span.from)?;
    let every = wanted.every.unwrap_or(1);
    let is_confirmed = target.write_folder(job.watcher, |folder| {
        let mut sink = BagSink::start(folder, every, run.as_mut())?;
        let sinks = Sinks { frames: Some(&mut sink), ..Sinks::default() };
        job.drive(run.as_mut(), span.until, sinks)?;
        sink.finish()?;
        recorded.verify_digest(run.as_ref())
    })?;
    Ok(ExportResult::single_file(target.path(), is_confirmed))
}
