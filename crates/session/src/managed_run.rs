//! One run, from its present cycle to its end, with everything that it records.

use crate::VERSION;
use crate::driver::{RunTiming, Sinks, drive};
use crate::files::resolve_path;
use crate::flight::{flight_error, replay_flight};
use crate::frame_sink::{EndReason, FrameRows, FrameSink, McapSink, frame_rows};
use crate::live::{LiveControl, ViewerAddress};
use crate::orders::has_orders;
use crate::row_store::{RowSelection, RowStore};
use crate::run_recorder::{RecordingPlan, RunRecorder, restore_run, start_recorded};
use crate::summary::{RunCost, RunStatus, Summary, SummaryFile};
use crate::{Error, Watcher, picture};
use sidestep_kernel::ports::{ColumnValues, RecordError, Recorder, TableSchema};
use sidestep_kernel::shell::sidestep_command;
use sidestep_kernel::view::Kinds;
use sidestep_kernel::{Cycle, InputError, Simulation};
use sidestep_record::parquet::DELETED_TABLE;
use sidestep_record::{CycleOrigin, IfExists, McapRecorder, RunFolder, RunReader, Status};
use sidestep_scenario::{CompiledScenario, ImportedScenario, ResolvedScenario, Source, Worlds};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::Duration;

mod restore;

pub use restore::RestoreError;

/// A run that is ready to start or continue.
pub struct ManagedRun {
    run: Box<dyn Simulation>,
    recording: Option<RunRecorder>,
    mcap: Option<McapSink>,
    /// Rows that [`Self::keep_rows`] asked for.
    rows: Option<RowStore>,
    frames: Option<FrameRows>,
    /// The kinds of bodies of the program's worlds.
    kinds: Kinds,
    viewers: Option<LiveControl>,
    workers: usize,
    /// The cycle to stop at, if before the planned end.
    until: Option<Cycle>,
    /// For the summary: the scenario's text was made from a file of another program.
    import: Option<ImportedScenario>,
    /// Cycles and time of all calls so far, without those of an earlier process.
    timing: RunTiming,
    /// The last cycle for which [`Self::order`] gave an order.
    ordered_at: Option<Cycle>,
}

/// The places where a run is recorded.
#[derive(Debug, Clone, Copy, Default)]
pub struct OutputPaths<'a> {
    /// A folder for rows, checkpoints, summary and picture.
    pub folder: Option<&'a Path>,
    /// An MCAP file for viewers, and the number of cycles between frames.
    pub mcap: Option<(&'a Path, Cycle)>,
    /// Whether existing files and folders there are replaced.
    pub replace: bool,
    /// How the cycles come about: those of a flight in real time are in the folder within a second.
    pub cycle_origin: CycleOrigin,
}

impl OutputPaths<'_> {
    fn if_exists(&self) -> IfExists {
        if self.replace { IfExists::Replace } else { IfExists::Refuse }
    }

    /// Refuses places that may not be used, before anything is created.
    ///
    /// # Errors
    /// When the MCAP file exists already and may not be replaced, or is at the path of the folder.
    fn check(&self) -> Result<(), InputError> {
        let Some((file, _)) = self.mcap else { return Ok(()) };
        if let Some(folder) = self.folder
            && resolve_path(folder).starts_with(resolve_path(file))
        {
            let cause = "the run folder is to be there";
            let remedy = "give a file beside the folder, or in it";
            return Err(InputError::new(file.display(), cause, remedy));
        }
        McapRecorder::check_vacant(file, self.if_exists())
    }

    /// Creates the places. The file comes first: if it cannot be created, no folder of a run that never existed may
    /// be left.
    ///
    /// # Errors
    /// When one cannot be created; then none is left, except a folder that the file was to be in.
    fn create(
        &self,
        resolved: &ResolvedScenario,
        run: &mut dyn Simulation,
        build: &str,
    ) -> Result<(Option<RunRecorder>, Option<McapSink>), Error> {
        if self.is_mcap_in_folder() {
            let recording = self.create_folder(resolved, run, build)?;
            let mcap = self.create_mcap(resolved, run, build)?;
            return Ok((recording, mcap));
        }
        let mcap = self.create_mcap(resolved, run, build)?;
        let recording = self.create_folder(resolved, run, build)?;
        Ok((recording, mcap))
    }

    fn create_mcap(
        &self,
        resolved: &ResolvedScenario,
        run: &mut dyn Simulation,
        build: &str,
    ) -> Result<Option<McapSink>, Error> {
        let Some((file, every)) = self.mcap else { return Ok(None) };
        McapSink::start(file, every, resolved.clone(), run, build).map(Some)
    }

    fn create_folder(
        &self,
        resolved: &ResolvedScenario,
        run: &mut dyn Simulation,
        build: &str,
    ) -> Result<Option<RunRecorder>, Error> {
        let Some(folder) = self.folder else { return Ok(None) };
        let recording = RecordingPlan {
            existing: self.if_exists(),
            build,
            cycle_origin: self.cycle_origin,
            mcap: self.mcap,
        };
        RunRecorder::create(folder, resolved, run, recording).map(Some)
    }

    /// Returns whether the MCAP file lies in the folder, which then has to exist before the file.
    fn is_mcap_in_folder(&self) -> bool {
        let (Some((file, _)), Some(folder)) = (self.mcap, self.folder) else { return false };
        resolve_path(file).starts_with(resolve_path(folder))
    }
}

impl ManagedRun {
    /// Returns a run of a scenario of one of `worlds` at its start.
    ///
    /// # Errors
    /// When a place is taken, or cannot be created.
    pub fn start(
        worlds: &Worlds,
        compiled: &dyn CompiledScenario,
        source: &Source,
        workers: usize,
        outputs: OutputPaths<'_>,
    ) -> Result<Self, Error> {
        outputs.check()?;
        if outputs.folder.is_none() && outputs.mcap.is_none() {
            let run = compiled.start(source, workers);
            return Ok(Self::new(worlds, run, None, None, workers));
        }
        let resolved = compiled.resolve(source)?;
        let mut run = match outputs.folder {
            None => compiled.start(source, workers),
            Some(folder) => {
                // A run with a folder is of the text in that folder, so that resuming it starts from the same text.
                let in_folder = Source::new("scenario.toml", &*resolved.text, folder);
                compiled.start(&in_folder, workers)
            }
        };
        let (recording, mcap) = outputs.create(&resolved, run.as_mut(), worlds.build())?;
        Ok(Self::new(worlds, run, recording, mcap, workers))
    }

    /// Returns a stopped run at the point from which its folder can continue, to go on to its end
    /// or to cycle `until`.
    ///
    /// # Errors
    /// When the folder holds no run of one of `worlds` that this build can continue, or the run
    /// is past that cycle.
    pub fn resume(
        worlds: &Worlds,
        path: &Path,
        workers: usize,
        until: Option<Cycle>,
    ) -> Result<Self, Error> {
        let manifest = RunReader::open(path)?.manifest;
        if manifest.ends_in_flight() && manifest.status != Status::Complete {
            return Err(flight_error(path, &manifest).into());
        }
        let (folder, point) = RunFolder::resume(path)?;
        let mut run = start_recorded(worlds, &folder, workers)?;
        restore_run(run.as_mut(), &point, path)?;
        check_end(until, run.cycle(), run.config().cycles)?;
        refuse_without_orders(run.as_ref(), path)?;
        let recording = Some(RunRecorder::start(folder, run.as_mut())?);
        Ok(Self { until, ..Self::new(worlds, run, recording, None, workers) })
    }

    /// Returns a flight in real time that was cut off at its end, to be simulated from there: what comes of it is marked as
    /// simulated, and was flown by nobody.
    ///
    /// # Errors
    /// Those of [`Self::resume`].
    pub fn simulate_flight(
        worlds: &Worlds,
        path: &Path,
        workers: usize,
        until: Option<Cycle>,
    ) -> Result<Self, Error> {
        let folder = RunFolder::reopen(path)?;
        let mut run = start_recorded(worlds, &folder, workers)?;
        replay_flight(run.as_mut(), &folder)?;
        check_end(until, run.cycle(), run.config().cycles)?;
        let mut recording = RunRecorder::start(folder, run.as_mut())?;
        // From here on it is a simulation, however early it is killed.
        recording.save_checkpoint(run.as_ref())?;
        Ok(Self { until, ..Self::new(worlds, run, Some(recording), None, workers) })
    }

    fn new(
        worlds: &Worlds,
        run: Box<dyn Simulation>,
        recording: Option<RunRecorder>,
        mcap: Option<McapSink>,
        workers: usize,
    ) -> Self {
        Self {
            run,
            recording,
            mcap,
            rows: None,
            frames: None,
            kinds: worlds.kinds(),
            viewers: None,
            workers,
            until: None,
            import: None,
            timing: RunTiming::default(),
            ordered_at: None,
        }
    }

    /// Returns the run with the report about the file of another program that its scenario was made from.
    #[must_use]
    pub fn with_import_report(self, import: Option<ImportedScenario>) -> Self {
        Self { import, ..self }
    }

    /// The run, to look at; it is at the end of the last call that advanced it.
    pub fn simulation(&self) -> &dyn Simulation {
        self.run.as_ref()
    }

    /// The run, for callers that watch it or hand controls over.
    pub fn simulation_mut(&mut self) -> &mut dyn Simulation {
        self.run.as_mut()
    }

    /// Returns the present frame as a table.
    pub fn frame_rows(&mut self) -> (TableSchema, Vec<ColumnValues>) {
        frame_rows(self.run.as_mut(), &self.kinds)
    }

    /// Shows the run to viewers while it advances.
    ///
    /// # Errors
    /// When the address cannot be taken.
    pub fn serve_viewers(&mut self, at: &ViewerAddress) -> Result<(), Error> {
        self.viewers = Some(LiveControl::start(at, self.run.as_mut())?);
        Ok(())
    }

    /// Returns the number of cycles done since the run's start.
    pub fn cycle(&self) -> Cycle {
        self.run.cycle()
    }

    /// Keeps rows, and frames where they are wanted, in memory from now on.
    ///
    /// # Errors
    /// When a table does not belong to the run, or rows are already kept or go to a folder: they are handed over only
    /// once.
    pub fn keep_rows(&mut self, wanted: &RowSelection) -> Result<(), InputError> {
        if let Some(recording) = &self.recording {
            let folder = recording.folder().path().display();
            let remedy = "read the tables from there when the run is finished";
            return Err(InputError::new(folder, "the rows of this run go to a folder", remedy));
        }
        if self.rows.is_some() {
            let remedy = "select the tables when you begin";
            return Err(InputError::new("record", "the rows of this run are kept already", remedy));
        }
        if wanted.frames.is_some() && self.mcap.is_some() {
            let remedy = "read them from there, or leave one of both out";
            let cause = "the frames of this run go to an MCAP file";
            return Err(InputError::new("frames", cause, remedy));
        }
        if wanted.frames == Some(0) {
            let remedy = "give 1 or more cycles";
            return Err(InputError::new("frames", "0 cycles cannot lie between frames", remedy));
        }
        self.run.start_recording();
        let schemas = self.run.schemas();
        self.rows = Some(RowStore::new(&schemas, wanted.tables.as_deref(), self.run.cycle())?);
        self.frames = wanted.frames.map(|every| FrameRows::new(every, self.kinds.clone()));
        Ok(())
    }

    /// Returns whether rows are kept in memory.
    pub fn keeps_rows(&self) -> bool {
        self.rows.is_some()
    }

    /// Takes the rows that were kept in memory so far, by table; none if rows are not kept. At the planned end of the run
    /// there are also those of what lasts beyond it.
    ///
    /// # Errors
    /// When the last ones cannot be handed over.
    pub fn take_rows(&mut self) -> Result<Vec<(TableSchema, Vec<ColumnValues>)>, RecordError> {
        let Some(rows) = &mut self.rows else { return Ok(Vec::new()) };
        self.run.record(rows)?;
        let is_complete = self.run.cycle() >= self.run.config().cycles || self.run.is_over();
        // Once, however often rows are taken there.
        if is_complete && rows.first_cycle() < self.run.cycle() {
            self.run.record_open(rows)?;
        }
        let frames = self.frames.as_mut().map(FrameRows::take);
        Ok(rows.take(self.run.cycle()).into_iter().chain(frames).collect())
    }

    /// Tells a watcher which folders killed processes had left beside that of the run, and that were removed when it was
    /// made.
    pub fn note_removals(&self, watcher: &dyn Watcher) {
        let leftovers = self.recording.iter().flat_map(|recording| recording.folder().leftovers());
        leftovers.for_each(|leftover| watcher.note_removal(leftover));
    }

    /// Drives the run to its end, or until the watcher asks to stop, and stores everything.
    ///
    /// # Errors
    /// When something cannot be stored; a bug of the simulation.
    pub fn run_to_end(mut self, watcher: &dyn Watcher) -> Result<Summary, Error> {
        self.note_removals(watcher);
        let until = self.until.unwrap_or(self.run.config().cycles);
        self.advance_to(until, watcher)?;
        self.finish(watcher)
    }

    /// Drives the run to cycle `until`, or until the watcher asks to stop; [`Self::finish`] stores the rest.
    /// Frames for viewers start again with every call.
    ///
    /// # Errors
    /// When something cannot be stored; a bug of the simulation.
    pub fn advance_to(&mut self, until: Cycle, watcher: &dyn Watcher) -> Result<(), Error> {
        let Self { run, recording, mcap, rows, frames, viewers, timing, .. } = self;
        // Frames go to one sink: `keep_rows` refuses to keep those of a run with an MCAP file.
        let kept_frames = frames.as_mut().map(|frames| frames as &mut dyn FrameSink);
        let mcap = mcap.as_mut().map(|mcap| mcap as &mut dyn FrameSink);
        let sinks = Sinks {
            recording: recording.as_mut(),
            rows: rows.as_mut().map(|rows| rows as &mut dyn Recorder),
            frames: mcap.or(kept_frames),
            viewers: viewers.as_mut(),
        };
        let driven = drive_guarded(run.as_mut(), until, sinks, watcher);
        *timing +=
            driven.map_err(|e| explain_storage_error(e, run.as_ref(), recording.as_ref()))?;
        Ok(())
    }

    /// Stores everything: a run at its planned end is complete, another can be resumed.
    ///
    /// # Errors
    /// When something cannot be stored.
    pub fn finish(self, watcher: &dyn Watcher) -> Result<Summary, Error> {
        let Self { mut run, recording, mcap, workers, import, timing, .. } = self;
        let folder = recording.as_ref().map(|r| r.folder().path().to_path_buf());
        let recording_time = recording.as_ref().map_or(Duration::ZERO, RunRecorder::elapsed)
            + mcap.as_ref().map_or(Duration::ZERO, McapSink::elapsed);
        let cost = RunCost { workers, timing, recording: recording_time };
        let mut summary = Summary::new(run.as_ref(), cost, folder.as_deref());
        if let Some(import) = import {
            summary.set_import_report(import);
        }
        // The MCAP file before the folder: the summary in the folder has the path of the finished file.
        if let Some(mcap) = mcap {
            let ending = match summary.status {
                RunStatus::Complete => EndReason::Complete,
                RunStatus::Incomplete => EndReason::Stopped,
            };
            let path = mcap
                .finish(run.as_ref(), ending)
                .map_err(|e| explain_storage_error(e, run.as_ref(), recording.as_ref()))?;
            summary.set_mcap_path(path);
        }
        if let Some(recording) = recording {
            store(run.as_mut(), recording, &summary, watcher)?;
        }
        Ok(summary)
    }
}

/// Refuses to continue a run whose agents had orders: they would get no more orders.
fn refuse_without_orders(run: &dyn Simulation, folder: &Path) -> Result<(), InputError> {
    if !has_orders(folder)? {
        return Ok(());
    }
    let cause = format!("its agents were controlled externally up to cycle {}", run.cycle());
    let replay = sidestep_command("replay", folder);
    let remedy = format!(
        "continue it with the program that decided for them, or look at it with `{replay} --cycle {}`",
        run.cycle()
    );
    Err(InputError::new(folder.display(), cause, remedy))
}

fn check_end(asked: Option<Cycle>, now: Cycle, planned: Cycle) -> Result<(), InputError> {
    let Some(end) = asked else { return Ok(()) };
    if (now..=planned).contains(&end) {
        return Ok(());
    }
    let cause = format!("the run stands at cycle {now} and was planned for {planned} cycles");
    let remedy = format!(
        "give {now} to {planned}; for a longer run: \
         sidestep run DIR/scenario.toml --cycles N --out NEW_DIR"
    );
    Err(InputError::new(format!("--cycles {end}"), cause, remedy))
}

/// Drives a recorded run to its end and stores all its results; returns whether it got there.
///
/// # Errors
/// When something cannot be stored.
pub(crate) fn record_to_end(
    run: &mut dyn Simulation,
    mut recording: RunRecorder,
    workers: usize,
    watcher: &dyn Watcher,
) -> Result<bool, Error> {
    let until = run.config().cycles;
    let sinks = Sinks { recording: Some(&mut recording), ..Sinks::default() };
    let timing = drive_guarded(run, until, sinks, watcher)?;
    let folder = recording.folder().path().to_path_buf();
    let cost = RunCost { workers, timing, recording: recording.elapsed() };
    let summary = Summary::new(run, cost, Some(&folder));
    store(run, recording, &summary, watcher)?;
    Ok(summary.status == RunStatus::Complete)
}

/// Completes the folder: with complete tables and pictures, or with a checkpoint to resume from. The folder is marked
/// complete last, so that a process that is killed before leaves one that is resumed, never one that is taken for whole.
fn store(
    run: &mut dyn Simulation,
    mut recording: RunRecorder,
    summary: &Summary,
    watcher: &dyn Watcher,
) -> Result<(), Error> {
    let closed = match summary.status {
        RunStatus::Complete => recording.finish_tables(run),
        RunStatus::Incomplete => recording.save_unfinished(run),
    };
    closed
        .and_then(|()| recording.forget_results())
        .map_err(|e| storage_error(run, Some(&recording), &e))?;
    let is_flight = recording.is_in_flight();
    let folder = recording.into_folder();
    // The results are worth more than their picture, so its failure is a warning.
    if let Err(error) = picture::draw_run(run, &folder) {
        watcher.warn(&error);
    }
    let per_agent = run.agent_metrics();
    let per_pair = run.pair_metrics();
    folder.write_summary(&SummaryFile { summary, per_agent, per_pair })?;
    for name in picture::NAMES.into_iter().chain(mcap_in(folder.path(), summary).as_deref()) {
        folder.add_file(name)?;
    }
    match summary.status {
        RunStatus::Complete => folder.complete(run.cycle(), &summary.digest)?,
        RunStatus::Incomplete if is_flight => folder.cut_off(run.cycle(), Some(&summary.digest))?,
        RunStatus::Incomplete => folder.stop(run.cycle())?,
    }
    Ok(())
}

/// Returns the name of the MCAP file if it is complete and lies in the run folder itself.
fn mcap_in(folder: &Path, summary: &Summary) -> Option<String> {
    let file = summary.mcap.as_deref()?;
    let inside = resolve_path(file).strip_prefix(resolve_path(folder)).ok()?.to_path_buf();
    let name = inside.to_str()?;
    (!name.ends_with(".partial")).then(|| name.to_string())
}

/// Drives the run; the error of a bug contains the facts to replay it.
fn drive_guarded(
    run: &mut dyn Simulation,
    until: Cycle,
    sinks: Sinks<'_>,
    watcher: &dyn Watcher,
) -> Result<RunTiming, Error> {
    match catch_unwind(AssertUnwindSafe(|| drive(run, until, sinks, watcher))) {
        Ok(result) => result,
        Err(_) => Err(internal_error(run)),
    }
}

/// Adds words for continuing the run, if something could not be stored.
fn explain_storage_error(
    error: Error,
    run: &dyn Simulation,
    recording: Option<&RunRecorder>,
) -> Error {
    match error {
        Error::Record(error) => storage_error(run, recording, &error),
        other => other,
    }
}

/// Returns the facts for replaying a run up to the cycle at which it failed.
fn replay_hint(run: &dyn Simulation) -> String {
    let config = run.config();
    format!(
        "at cycle {} of {} of `{}`, seed {}, sidestep {VERSION}",
        run.cycle(),
        config.cycles,
        config.name,
        config.seed
    )
}

/// Returns the error of a recording that failed, with words for continuing the run.
fn storage_error(
    run: &dyn Simulation,
    recording: Option<&RunRecorder>,
    error: &RecordError,
) -> Error {
    let is_gone = recording.is_some_and(|recording| recording.folder().check_in_place().is_err());
    let remedy = match recording.map(|r| (r.folder().path(), r.is_in_flight())) {
        _ if is_gone => "if it was moved, `sidestep resume DIR` continues it at its new place; else run the scenario again".into(),
        Some(_) if error.cause.ends_with(DELETED_TABLE) => {
            "put back what was deleted or moved, or run the scenario again in a new folder".into()
        }
        Some((folder, false)) => {
            format!("make room, then continue with `{}`", sidestep_command("resume", folder))
        }
        Some((folder, true)) => {
            let close = sidestep_command("resume", folder);
            format!("make room, then close the recording of the flight with `{close}`")
        }
        None => "make room, then run it again; without --out nothing can be continued".into(),
    };
    Error::other(format!("{error}\n  {}", replay_hint(run)), remedy)
}

/// Returns the error of a simulation that broke one of its own rules.
fn internal_error(run: &dyn Simulation) -> Error {
    let cause = format!("internal error (a bug in Sidestep) shortly after\n  {}", replay_hint(run));
    Error::other(cause, "please report it with the scenario and the lines above")
}
