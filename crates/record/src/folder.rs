//! The folder of one run: created in one step, written by one process, resumed after a stop.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};

use serde::Serialize;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::{RecordError, TableSchema};

use crate::disk;
use crate::manifest::{self, Manifest, Status, json};
use crate::parquet::ParquetRecorder;
use crate::schema::Provenance;
use crate::staging::StagingFolder;

/// File name of the manifest.
pub(crate) const MANIFEST: &str = "run.json";
const SCENARIO: &str = "scenario.toml";
const SUMMARY: &str = "summary.json";
const CHECKPOINT: &str = "checkpoint.bin";
const LOCK: &str = "run.lock";

/// The description of a new run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewRun {
    /// The world to simulate, e.g. `robots`.
    pub world: String,
    /// The build that makes the run, which alone can resume it.
    pub build: String,
    /// Scenario, seed and version that its rows result from.
    pub origin: Provenance,
    /// Cycles that the scenario asks for.
    pub cycles_planned: u64,
}

/// What to do if the folder holds a run already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IfExists {
    /// Leave it alone and fail.
    Refuse,
    /// Delete it. Folders that hold something other than a run are refused anyway.
    Replace,
}

/// The state from which a stopped run goes on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ResumePoint {
    /// Cycle 0: the run was stopped before its first checkpoint.
    Start,
    /// The checkpoint with these bytes; the kernel verifies their checksum.
    Checkpoint(Vec<u8>),
}

/// A run folder that this process writes; no other process can write it while this value lives.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    manifest: Manifest,
    scenario: String,
    /// Locked; the system releases the lock when the process ends in any way.
    _lock: File,
}

impl RunFolder {
    /// Creates the folder at `path` with its manifest and scenario: completely or not at all.
    ///
    /// The folder may be missing or empty; or it may hold a run, if `existing` allows that and no
    /// process writes it.
    ///
    /// # Errors
    /// A folder that may not be used; a place where none can be created.
    pub fn create(path: &Path, run: &NewRun, existing: IfExists) -> Result<Self, InputError> {
        check_vacant(path, existing)?;
        let staging = StagingFolder::new(path)?;
        let Provenance { program_version, scenario, seed } = &run.origin;
        let manifest = Manifest {
            build: Some(run.build.clone()),
            ..manifest::new_manifest(&run.world, *seed, program_version, run.cycles_planned)
        };
        fill(staging.path(), &manifest, scenario)
            .map_err(|e| disk::cannot_create(path, format!("{}: {}", e.place, e.cause)))?;
        // Another process may be writing the run that `commit` deletes: hold its lock until then.
        let old_lock = if is_run(path) { Some(lock(path)?) } else { None };
        staging.commit()?;
        drop(old_lock);
        let lock = lock(path)?;
        let scenario = scenario.clone();
        Ok(Self { path: path.to_path_buf(), manifest, scenario, _lock: lock })
    }

    /// Opens the folder at `path` to continue its run.
    ///
    /// # Errors
    /// No run folder; a run that is complete, or that another process writes; a damaged
    /// manifest; another major format.
    pub fn resume(path: &Path) -> Result<(Self, ResumePoint), InputError> {
        check_is_run(path)?;
        let lock = lock(path)?;
        let RunReader { manifest, scenario, .. } = RunReader::open(path)?;
        if manifest.status == Status::Complete {
            let remedy = "read its tables, or start another run in a new folder";
            return Err(InputError::new(path.display(), "the run is complete", remedy));
        }
        let point = resume_point(&path.join(CHECKPOINT))?;
        Ok((Self { path: path.to_path_buf(), manifest, scenario, _lock: lock }, point))
    }

    /// Returns the path of the folder, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the content of `run.json`, as it is on the disk.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Returns the text of `scenario.toml`, with every default and include resolved.
    pub fn scenario(&self) -> &str {
        &self.scenario
    }

    /// Returns the recorder of the run's tables from `cycle` on: 0 for a new run, the checkpoint's
    /// cycle for a resumed one, of which later rows are deleted.
    ///
    /// # Errors
    /// A schema that cannot become a file; an I/O error.
    pub fn recorder(
        &self,
        schemas: &[TableSchema],
        cycle: u64,
    ) -> Result<ParquetRecorder, RecordError> {
        let origin = Provenance {
            program_version: self.manifest.program_version.clone(),
            scenario: self.scenario.clone(),
            seed: self.manifest.seed,
        };
        ParquetRecorder::resume(&self.path, schemas, &origin, cycle)
    }

    /// Replaces the checkpoint by the state before `cycle`.
    /// [Seal](sidestep_kernel::ports::Recorder::make_durable) the recorder at `cycle` first: a kill between
    /// the two then loses only rows of later cycles, which the resumed run writes again.
    ///
    /// # Errors
    /// An I/O error; the checkpoint before this one stays valid.
    pub fn save_checkpoint(&mut self, cycle: u64, state: &[u8]) -> Result<(), RecordError> {
        disk::replace(&self.path.join(CHECKPOINT), state)?;
        self.update(|manifest| {
            manifest.status = Status::Running;
            manifest.cycles_done = cycle;
            manifest.last_checkpoint = Some(cycle);
        })
    }

    /// Writes `summary.json`, durably, before the run is declared complete.
    ///
    /// # Errors
    /// An I/O error, or a summary that is not JSON.
    pub fn write_summary(&self, summary: &impl Serialize) -> Result<(), RecordError> {
        let path = self.path.join(SUMMARY);
        disk::replace(&path, &json(summary, &path)?)
    }

    /// Records that the run stopped in good order after `cycles_done` cycles and can be resumed.
    ///
    /// # Errors
    /// An I/O error; the folder can be resumed nevertheless.
    pub fn stop(mut self, cycles_done: u64) -> Result<(), RecordError> {
        self.update(|manifest| {
            manifest.status = Status::Incomplete;
            manifest.cycles_done = cycles_done;
        })
    }

    /// Declares the run complete, with the digest of its final state. This is the last step of a
    /// run, after its recorder is finished and its summary is written.
    ///
    /// # Errors
    /// An I/O error; the run can be resumed at its last checkpoint.
    pub fn complete(mut self, cycles_done: u64, digest: &str) -> Result<(), RecordError> {
        self.update(|manifest| {
            manifest.status = Status::Complete;
            manifest.cycles_done = cycles_done;
            manifest.digest = Some(digest.to_string());
        })
    }

    /// Changes the manifest on disk first: if that fails, this value still describes the folder.
    fn update(&mut self, change: impl FnOnce(&mut Manifest)) -> Result<(), RecordError> {
        let mut changed = self.manifest.clone();
        change(&mut changed);
        changed.write(&self.path.join(MANIFEST))?;
        self.manifest = changed;
        Ok(())
    }
}

/// A run folder to read from; its run may still be in progress.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunReader {
    /// Path of the folder, as it was given.
    pub path: PathBuf,
    /// The content of `run.json` when the folder was opened.
    pub manifest: Manifest,
    /// The text of `scenario.toml`, with every default and include resolved.
    pub scenario: String,
}

impl RunReader {
    /// Returns whether there is a run in a folder, even if it is damaged.
    pub fn is_at(path: &Path) -> bool {
        is_run(path)
    }

    /// Opens the folder at `path` without locking it.
    ///
    /// # Errors
    /// No run folder; a damaged manifest; another major format.
    pub fn open(path: &Path) -> Result<Self, InputError> {
        check_is_run(path)?;
        let manifest = Manifest::read(&path.join(MANIFEST))?;
        let scenario = read(&path.join(SCENARIO), |p| fs::read_to_string(p))?;
        Ok(Self { path: path.to_path_buf(), manifest, scenario })
    }
}

fn read<T>(path: &Path, reader: impl FnOnce(&Path) -> std::io::Result<T>) -> Result<T, InputError> {
    reader(path).map_err(|e| {
        let remedy = "restore the file, or run the scenario again in a new folder";
        InputError::new(path.display(), e.to_string(), remedy)
    })
}

fn fill(folder: &Path, manifest: &Manifest, scenario: &str) -> Result<(), RecordError> {
    disk::replace(&folder.join(SCENARIO), scenario.as_bytes())?;
    manifest.write(&folder.join(MANIFEST))
}

fn resume_point(checkpoint: &Path) -> Result<ResumePoint, InputError> {
    if !checkpoint.exists() {
        return Ok(ResumePoint::Start);
    }
    read(checkpoint, |p| fs::read(p)).map(ResumePoint::Checkpoint)
}

/// Returns whether a folder holds a run, even if its manifest is damaged.
fn is_run(path: &Path) -> bool {
    path.join(MANIFEST).is_file()
}

fn check_is_run(path: &Path) -> Result<(), InputError> {
    let cause = match fs::metadata(path) {
        Ok(m) if m.is_dir() && is_run(path) => return Ok(()),
        Ok(m) if m.is_dir() => format!("this is no run folder: it holds no `{MANIFEST}`"),
        Ok(_) => "this is no folder".to_string(),
        Err(e) => e.to_string(),
    };
    Err(InputError::new(path.display(), cause, "give the folder that a run was recorded to"))
}

/// Refuses a path at which a new run must not be created.
pub(crate) fn check_vacant(path: &Path, existing: IfExists) -> Result<(), InputError> {
    let mut entries = match fs::read_dir(path) {
        Ok(entries) => entries,
        Err(_) if !path.exists() => return Ok(()),
        Err(e) => return Err(disk::cannot_create(path, e)),
    };
    if entries.next().is_none() {
        return Ok(());
    }
    match (is_run(path), existing) {
        (true, IfExists::Replace) => Ok(()),
        (true, IfExists::Refuse) => Err(InputError::new(
            path.display(),
            "the folder holds a run already",
            "resume that run, give another folder, or replace the old run (--replace)",
        )),
        (false, _) => {
            let cause = if path.join(manifest::SWEEP_MANIFEST).is_file() {
                "the folder holds a sweep"
            } else {
                "the folder holds something else than a run"
            };
            Err(InputError::new(path.display(), cause, "give a new or empty folder"))
        }
    }
}

fn lock(folder: &Path) -> Result<File, InputError> {
    let path = folder.join(LOCK);
    let file = read(&path, |p| OpenOptions::new().create(true).append(true).open(p))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => {
            let cause = "another process is writing this run";
            let remedy = "wait until it ends, stop it, or give another folder";
            Err(InputError::new(folder.display(), cause, remedy))
        }
        Err(TryLockError::Error(e)) => {
            let remedy = "put the run on a file system that can lock files";
            Err(InputError::new(path.display(), e.to_string(), remedy))
        }
    }
}
