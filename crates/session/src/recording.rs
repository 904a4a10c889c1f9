//! A run's folder while it is being written.

use crate::Error;
use sidestep::kernel::Simulation;
use sidestep::kernel::ports::{RecordError, Recorder};
use sidestep::kernel::{Cycle, InputError};
use sidestep::scenario::Resolved;
use sidestep::{BUILD, VERSION};
use sidestep_record::{Existing, NewRun, Origin, ParquetRecorder, ResumePoint, RunFolder};
use std::path::Path;
use std::time::{Duration, Instant};

/// Rows are handed over at multiples of this many cycles (and where buffers are full, and at
/// checkpoints), never by the clock: so their order is a function of the scenario alone.
const BLOCK_CYCLES: Cycle = 1024;

/// A folder, its recorder, and when to save.
pub struct Recording {
    folder: RunFolder,
    recorder: ParquetRecorder,
    checkpoint_every: Cycle,
    /// Time spent on recording.
    took: Duration,
}

impl Recording {
    /// A new folder at `path`, with the resolved scenario in it.
    ///
    /// # Errors
    /// A folder that is not to be taken, and what the system says.
    pub fn create(
        path: &Path,
        resolved: &Resolved,
        run: &mut dyn Simulation,
        existing: Existing,
    ) -> Result<Self, Error> {
        let plan = run.plan();
        let new = NewRun {
            world: run.world().into(),
            build: BUILD.into(),
            origin: Origin {
                program_version: VERSION.into(),
                scenario: resolved.text.clone(),
                seed: plan.seed,
            },
            cycles_planned: plan.cycles,
        };
        let folder = RunFolder::create(path, &new, existing)?;
        write_inputs(path, &resolved.files)?;
        Ok(Self::begin(folder, run)?)
    }

    /// Takes up the recording of a run that stands where its folder's checkpoint is.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn begin(folder: RunFolder, run: &mut dyn Simulation) -> Result<Self, RecordError> {
        run.begin_recording();
        let recorder = folder.recorder(&run.schemas(), run.cycle())?;
        let checkpoint_every = run.plan().checkpoint_interval();
        Ok(Self { folder, recorder, checkpoint_every, took: Duration::ZERO })
    }

    /// The first cycle after `cycle` at which rows must be handed over.
    pub(crate) fn next_stop(&self, cycle: Cycle) -> Cycle {
        next(BLOCK_CYCLES, cycle).min(next(self.checkpoint_every, cycle))
    }

    /// Takes the rows, and a checkpoint where one is due.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn take(&mut self, run: &mut dyn Simulation) -> Result<(), RecordError> {
        let started = Instant::now();
        run.record(&mut self.recorder)?;
        if run.cycle().is_multiple_of(self.checkpoint_every) {
            self.save(run)?;
        }
        self.took += started.elapsed();
        Ok(())
    }

    /// Makes everything so far durable.
    fn save(&mut self, run: &dyn Simulation) -> Result<(), RecordError> {
        self.recorder.seal(run.cycle())?;
        self.folder.save_checkpoint(run.cycle(), &run.checkpoint())
    }

    /// Declares the tables whole; reports and pictures may follow.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn finish_tables(&mut self) -> Result<(), RecordError> {
        self.recorder.finish()
    }

    /// Saves a run that stops before its end.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn save_unfinished(&mut self, run: &mut dyn Simulation) -> Result<(), RecordError> {
        run.record(&mut self.recorder)?;
        self.save(run)
    }

    /// The folder.
    pub(crate) fn folder(&self) -> &RunFolder {
        &self.folder
    }

    /// The folder, for its last entries.
    pub(crate) fn into_folder(self) -> RunFolder {
        self.folder
    }

    /// Time spent on recording so far.
    pub(crate) fn took(&self) -> Duration {
        self.took
    }
}

/// The first multiple of `every` after `cycle`.
pub(crate) fn next(every: Cycle, cycle: Cycle) -> Cycle {
    (cycle / every + 1).saturating_mul(every)
}

/// Puts the files that a resolved scenario names beside it.
///
/// # Errors
/// What the system says.
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

/// Brings a run to the point where its folder says it can go on.
///
/// # Errors
/// When the checkpoint is damaged or belongs to another version or scenario.
pub(crate) fn restore(
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
