//! The folder of a run while it is written.

use crate::Error;
use crate::VERSION;
use crate::files::resolve_path;
use crate::flight_recorder::FlightRecorder;
use crate::identity::Producer;
use sidestep_kernel::Simulation;
use sidestep_kernel::ports::{RecordError, Recorder};
use sidestep_kernel::{Cycle, InputError};
use sidestep_record::{
    CycleOrigin, IfExists, McapRequest, NewRun, ParquetRecorder, Provenance, ResumePoint, RunFolder,
};
use sidestep_scenario::{ResolvedScenario, Source, Worlds};
use std::path::Path;
use std::time::{Duration, Instant};

/// Rows are passed on at multiples of this many cycles (and when buffers are full, and at
/// checkpoints), never by the clock, so that their order, and the blocks of the files, are a function of the scenario
/// alone.
const BLOCK_CYCLES: Cycle = 1024;

/// A folder, its recorder, and the times of its checkpoints.
pub struct RunRecorder {
    folder: RunFolder,
    rows: RowWriter,
    checkpoint_every: Cycle,
    /// Time spent on recording.
    elapsed: Duration,
}

/// The writer of a run's rows.
enum RowWriter {
    /// It writes when rows are handed over, at cycles that are a function of the scenario.
    Simulation(ParquetRecorder),
    /// It writes in a thread of its own, by the clock.
    Flight(FlightRecorder),
}

/// What a new folder is made for.
#[derive(Debug, Clone, Copy)]
pub struct RecordingPlan<'a> {
    /// What to do with an earlier run there.
    pub existing: IfExists,
    /// The build that makes the run.
    pub build: &'a str,
    /// How its cycles come about.
    pub cycle_origin: CycleOrigin,
    /// The MCAP file that is written at the same time, and the number of cycles between its frames.
    pub mcap: Option<(&'a Path, Cycle)>,
}

impl RunRecorder {
    /// Creates a new folder at `path`, with the resolved scenario in it.
    ///
    /// # Errors
    /// A folder that may not be used, or an I/O error.
    pub fn create(
        path: &Path,
        resolved: &ResolvedScenario,
        run: &mut dyn Simulation,
        recording: RecordingPlan<'_>,
    ) -> Result<Self, Error> {
        let plan = run.config();
        let new = NewRun {
            world: run.world_name().into(),
            build: recording.build.into(),
            origin: Provenance {
                program_version: VERSION.into(),
                scenario: resolved.text.clone(),
                seed: plan.seed,
            },
            cycles_planned: plan.cycles,
            cycle_origin: recording.cycle_origin,
            mcap: recording.mcap.and_then(|(file, every)| {
                McapRequest::new(&resolve_path(path), &resolve_path(file), every)
            }),
            series_every: plan.series_interval().every(),
        };
        let folder = RunFolder::create_with_files(path, &new, &resolved.files, recording.existing)?;
        Ok(Self::start_as(folder, run, recording.cycle_origin)?)
    }

    /// Continues the recording of a run that is at the checkpoint of its folder.
    ///
    /// # Errors
    /// An I/O error.
    pub(crate) fn start(folder: RunFolder, run: &mut dyn Simulation) -> Result<Self, RecordError> {
        Self::start_as(folder, run, CycleOrigin::Simulated)
    }

    fn start_as(
        folder: RunFolder,
        run: &mut dyn Simulation,
        cycle_origin: CycleOrigin,
    ) -> Result<Self, RecordError> {
        run.start_recording();
        let recorder = folder.recorder(&run.schemas(), run.cycle())?;
        let rows = match cycle_origin {
            CycleOrigin::Simulated => RowWriter::Simulation(recorder),
            CycleOrigin::Flown => {
                RowWriter::Flight(FlightRecorder::start(recorder, Some(folder.progress())))
            }
        };
        let checkpoint_every = run.config().checkpoint_interval();
        Ok(Self { folder, rows, checkpoint_every, elapsed: Duration::ZERO })
    }

    /// Returns the first cycle after `cycle` at which rows must be passed on.
    pub(crate) fn next_flush(&self, cycle: Cycle) -> Cycle {
        next_multiple(BLOCK_CYCLES, cycle).min(next_multiple(self.checkpoint_every, cycle))
    }

    /// Takes the rows, and a checkpoint if one is due.
    ///
    /// # Errors
    /// An I/O error.
    pub(crate) fn record(&mut self, run: &mut dyn Simulation) -> Result<(), RecordError> {
        let started = Instant::now();
        self.folder.check_in_place()?;
        let is_checkpoint_due = run.cycle().is_multiple_of(self.checkpoint_every);
        match &mut self.rows {
            RowWriter::Simulation(recorder) => {
                run.record(recorder)?;
                if is_checkpoint_due {
                    self.save_checkpoint(run)?;
                }
            }
            RowWriter::Flight(recorder) => {
                run.record(recorder)?;
                recorder.seal_if_due(run.cycle(), is_checkpoint_due)?;
            }
        }
        self.elapsed += started.elapsed();
        Ok(())
    }

    /// Makes everything recorded so far durable. The tables are sealed first: a checkpoint that is newer than the rows
    /// before it could not be resumed from. A flight has no checkpoints: nothing can continue it.
    pub(crate) fn save_checkpoint(&mut self, run: &dyn Simulation) -> Result<(), RecordError> {
        match &mut self.rows {
            RowWriter::Simulation(recorder) => {
                recorder.make_durable(run.cycle())?;
                self.folder.save_checkpoint(run.cycle(), &run.checkpoint())
            }
            RowWriter::Flight(recorder) => recorder.make_durable(run.cycle()),
        }
    }

    /// Declares the tables of a run at its end complete; reports and pictures may follow.
    ///
    /// # Errors
    /// An I/O error.
    pub(crate) fn finish_tables(&mut self, run: &mut dyn Simulation) -> Result<(), RecordError> {
        match &mut self.rows {
            RowWriter::Simulation(recorder) => {
                run.record_open(recorder)?;
                recorder.finish()
            }
            RowWriter::Flight(recorder) => {
                recorder.make_durable(run.cycle())?;
                run.record_open(recorder)?;
                recorder.finish()
            }
        }
    }

    /// Saves a run that stops before its end: a simulation to be resumed, a flight with tables that are complete.
    ///
    /// # Errors
    /// An I/O error.
    pub(crate) fn save_unfinished(&mut self, run: &mut dyn Simulation) -> Result<(), RecordError> {
        match &mut self.rows {
            RowWriter::Simulation(recorder) => {
                run.record(recorder)?;
                self.save_checkpoint(run)?;
                self.save_open_rows(run)
            }
            RowWriter::Flight(recorder) => {
                run.record(recorder)?;
                recorder.make_durable(run.cycle())?;
                // Without what lasts: parts of a flight that are simulated on from here are not divided again.
                recorder.finish()
            }
        }
    }

    /// Saves what lasts, in parts of the cycle of the checkpoint, which a resumed run deletes.
    fn save_open_rows(&mut self, run: &mut dyn Simulation) -> Result<(), RecordError> {
        if let RowWriter::Simulation(recorder) = &mut self.rows
            && run.record_open(recorder)?
        {
            recorder.make_durable(run.cycle() + 1)?;
        }
        Ok(())
    }

    /// Returns whether it records a flight in real time.
    pub(crate) fn is_in_flight(&self) -> bool {
        matches!(self.rows, RowWriter::Flight(_))
    }

    pub(crate) fn folder(&self) -> &RunFolder {
        &self.folder
    }

    /// Takes the results of an earlier stop out of the folder's manifest, before they are written again.
    ///
    /// # Errors
    /// An I/O error.
    pub(crate) fn forget_results(&mut self) -> Result<(), RecordError> {
        self.folder.forget_results()
    }

    /// Returns the folder, for its last entries.
    pub(crate) fn into_folder(self) -> RunFolder {
        self.folder
    }

    /// Returns the time spent on recording so far.
    pub(crate) fn elapsed(&self) -> Duration {
        self.elapsed
    }
}

/// Returns the first multiple of `every` after `cycle`.
pub(crate) fn next_multiple(every: Cycle, cycle: Cycle) -> Cycle {
    (cycle / every + 1).saturating_mul(every)
}

/// Writes the files that a resolved scenario names beside it.
///
/// # Errors
/// An I/O error.
pub(crate) fn write_inputs(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), RecordError> {
    for (name, bytes) in files {
        let path = folder.join(name);
        let parent = path.parent().unwrap_or(folder);
        std::fs::create_dir_all(parent)
            .and_then(|()| std::fs::write(&path, bytes))
            .map_err(|e| RecordError::new(path.display(), e))?;
    }
    Ok(())
}

/// Returns the run of a folder at its start.
///
/// # Errors
/// When the folder holds no run of one of `worlds` that this build can continue.
pub(crate) fn start_recorded(
    worlds: &Worlds,
    folder: &RunFolder,
    workers: usize,
) -> Result<Box<dyn Simulation>, InputError> {
    let path = folder.path();
    let manifest = folder.manifest();
    let producer =
        Producer { version: manifest.program_version.clone(), build: manifest.build.clone() };
    producer.check(worlds.build(), path, "run", |wrote| {
        format!("continue it with sidestep {wrote}, or run its scenario again in a new folder")
    })?;
    let place = path.join("scenario.toml").display().to_string();
    let source = Source::new(place, folder.scenario(), path);
    Ok(worlds.compile(&source)?.start(&source, workers))
}

/// Sets a run to the point from which its folder can continue.
///
/// # Errors
/// When the checkpoint is damaged or belongs to another version or scenario.
pub(crate) fn restore_run(
    run: &mut dyn Simulation,
    point: &ResumePoint,
    folder: &Path,
) -> Result<(), InputError> {
    let ResumePoint::Checkpoint(bytes) = point else { return Ok(()) };
    run.restore(bytes).map_err(|e| {
        let remedy = "run the scenario again in a new folder: \
                      sidestep run DIR/scenario.toml --out NEW_DIR";
        InputError::new(folder.join("checkpoint.bin").display(), e.to_string(), remedy)
    })
}
