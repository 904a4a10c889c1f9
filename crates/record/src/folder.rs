//! The folder of one run: created in one step, written by one process, resumed after a stop.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::{RecordError, TableSchema};

use crate::create_error::{CREATE_REMEDY, CreateError};
use crate::disk;
use crate::file_list::{FileList, SharedFileList};
use crate::if_exists::IfExists;
use crate::manifest::{self, Manifest, Status, json};
use crate::mcap_request::McapRequest;
use crate::origin::CycleOrigin;
use crate::parquet::ParquetRecorder;
use crate::process_lock::{LockError, ProcessLock, holder_text};
use crate::replacement::Replacement;
use crate::run_reader::{
    CHECKPOINT, LOCK, MANIFEST, RunReader, SCENARIO, SUMMARY, check_is_run, is_result, is_run, read,
};
use crate::schema::Provenance;
use crate::sealed_json::FileDigest;
use crate::staging::StagingFolder;

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
    /// How its cycles come about.
    pub cycle_origin: CycleOrigin,
    /// The MCAP file that is written at the same time.
    pub mcap: Option<McapRequest>,
    /// Number of cycles between the first rows of the table of metrics over time; 0 for none.
    pub series_every: u64,
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
    /// The files that are written so far; the manifest gets them when it is written.
    pub(crate) files: SharedFileList,
    /// How the cycles come about that are recorded from now on.
    pub(crate) cycle_origin: CycleOrigin,
    lock: ProcessLock,
    /// Folders that killed processes left beside it, and that were removed when it was created.
    leftovers: Vec<PathBuf>,
}

impl RunFolder {
    /// Creates the folder at `path` with its manifest and scenario: completely or not at all.
    ///
    /// The folder may be missing or empty; or it may hold a run, if `existing` allows that and no
    /// process writes it.
    ///
    /// # Errors
    /// A folder that may not be used; a place where none can be created.
    pub fn create(path: &Path, run: &NewRun, existing: IfExists) -> Result<Self, CreateError> {
        Self::create_with_files(path, run, &[], existing)
    }

    /// Creates the folder like [`Self::create`], with the files that its scenario names, by their paths in it.
    ///
    /// # Errors
    /// See [`Self::create`].
    pub fn create_with_files(
        path: &Path,
        run: &NewRun,
        files: &[(String, Vec<u8>)],
        existing: IfExists,
    ) -> Result<Self, CreateError> {
        check_vacant(path, existing)?;
        let staging = StagingFolder::new(path)?;
        // Once its parents are made, a path with `..` may lead to a folder that could not be seen before.
        check_vacant(path, existing)?;
        let Provenance { program_version, scenario, seed } = &run.origin;
        let mut manifest = Manifest {
            build: Some(run.build.clone()),
            mcap: run.mcap.clone(),
            series_every: Some(run.series_every),
            ..manifest::new_manifest(&run.world, *seed, program_version, run.cycles_planned)
        };
        // A flight is marked before its first cycle: however early it is killed, it is not taken for a simulation.
        manifest.record_progress(0, run.cycle_origin);
        staging.fill(|folder| fill(folder, &mut manifest, scenario, files))?;
        // Another process may be writing the run that `commit` replaces: hold its lock until then.
        let (old_lock, old) = if is_run(path) {
            (Some(lock(path)?), Replacement::of_run(path)?)
        } else {
            (None, Replacement::default())
        };
        let leftovers = staging.leftovers().to_vec();
        staging.commit(&old)?;
        drop(old_lock);
        let lock = lock(path)?;
        let scenario = scenario.clone();
        let files = SharedFileList::new(manifest.files.clone());
        let cycle_origin = run.cycle_origin;
        let path = path.to_path_buf();
        Ok(Self { path, manifest, scenario, files, cycle_origin, lock, leftovers })
    }

    /// Opens the folder at `path` to continue its run by simulation.
    ///
    /// # Errors
    /// No run folder; a run that is complete, or that another process writes; a flight in real time; a damaged
    /// manifest; another major format.
    pub fn resume(path: &Path) -> Result<(Self, ResumePoint), InputError> {
        let folder = Self::reopen(path)?;
        if folder.manifest.ends_in_flight() {
            let cause = "a flight in real time cannot be continued";
            let remedy = "give a folder whose run was simulated";
            return Err(InputError::new(path.display(), cause, remedy));
        }
        let point = resume_point(&path.join(CHECKPOINT))?;
        Ok((folder, point))
    }

    /// Opens the folder at `path` to write to it, a flight as well as a simulation; what is recorded from now on is
    /// simulated.
    ///
    /// # Errors
    /// Those of [`Self::resume`], except for a flight.
    pub fn reopen(path: &Path) -> Result<Self, InputError> {
        check_is_run(path)?;
        let lock = lock(path)?;
        let reader = RunReader::open(path)?;
        if reader.manifest.status == Status::Complete {
            let remedy = "read its tables, or start another run in a new folder";
            return Err(InputError::new(path.display(), "the run is complete", remedy));
        }
        // Results are written anew, so it does not matter what became of them.
        reader.check_files(|name| !is_result(name))?;
        let RunReader { manifest, scenario, .. } = reader;
        let mut files = manifest.files.clone();
        if !files.contains(SCENARIO) {
            files.insert(SCENARIO, FileDigest::of_bytes(scenario.as_bytes()));
        }
        // A kill may have come between the checkpoint and the manifest, and the run may end without another one.
        files.insert_file(path, CHECKPOINT).map_err(|e| {
            InputError::new(path.display(), e.to_string(), "make the folder readable")
        })?;
        let files = SharedFileList::new(files);
        let cycle_origin = CycleOrigin::Simulated;
        let path = path.to_path_buf();
        Ok(Self { path, manifest, scenario, files, cycle_origin, lock, leftovers: Vec::new() })
    }

    /// Checks that the folder is where it was: the system lets a process write on to files of a folder that is gone.
    ///
    /// # Errors
    /// When it was deleted, emptied or moved, or another one is in its place.
    pub fn check_in_place(&self) -> Result<(), RecordError> {
        if self.lock.is_at(&self.path.join(LOCK)) {
            return Ok(());
        }
        let cause = "the folder was deleted, emptied or moved while the run wrote to it: nothing more is written";
        Err(RecordError::new(self.path.display(), cause))
    }

    /// Returns the folders that killed processes left beside it, and that were removed when it was created.
    pub fn leftovers(&self) -> &[PathBuf] {
        &self.leftovers
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
        ParquetRecorder::resume_listed(&self.path, schemas, &origin, cycle, &self.files)
    }

    /// Replaces the checkpoint by the state before `cycle`.
    /// [Seal](sidestep_kernel::ports::Recorder::make_durable) the recorder at `cycle` first: a kill between
    /// the two then loses only rows of later cycles, which the resumed run writes again.
    ///
    /// # Errors
    /// An I/O error; the checkpoint before this one stays valid.
    pub fn save_checkpoint(&mut self, cycle: u64, state: &[u8]) -> Result<(), RecordError> {
        disk::replace(&self.path.join(CHECKPOINT), state)?;
        self.files.lock().insert(CHECKPOINT, FileDigest::of_bytes(state));
        let origin = self.cycle_origin;
        self.update(|manifest| {
            manifest.status = Status::Running;
            manifest.is_cut_off = false;
            manifest.digest = None;
            manifest.record_progress(cycle, origin);
            manifest.last_checkpoint = Some(cycle);
        })
    }

    /// Writes `summary.json`, durably, before the run is declared complete.
    ///
    /// # Errors
    /// An I/O error, or a summary that is not JSON.
    pub fn write_summary(&self, summary: &impl Serialize) -> Result<(), RecordError> {
        let path = self.path.join(SUMMARY);
        let text = json(summary, &path)?;
        disk::replace(&path, &text)?;
        self.files.lock().insert(SUMMARY, FileDigest::of_bytes(&text));
        Ok(())
    }

    /// Adds a file that was written into the folder to the manifest, which gets it when it is written next; without
    /// effect if it is not there.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn add_file(&self, name: &str) -> Result<(), RecordError> {
        let added = self.files.lock().insert_file(&self.path, name);
        added.map_err(|e| RecordError::new(self.path.join(name).display(), e))
    }

    /// Takes the results of an earlier stop out of the manifest: they are about to be written again, and a kill meanwhile
    /// must leave a folder that is whole.
    ///
    /// # Errors
    /// An I/O error.
    pub fn forget_results(&mut self) -> Result<(), RecordError> {
        if !self.files.lock().iter().any(|(name, _)| is_result(name)) {
            return Ok(());
        }
        self.files.lock().retain(|name| !is_result(name));
        self.update(|_| {})
    }

    /// Records that the run stopped in good order after `cycles_done` cycles and can be resumed.
    ///
    /// # Errors
    /// An I/O error; the folder can be resumed nevertheless.
    pub fn stop(mut self, cycles_done: u64) -> Result<(), RecordError> {
        let origin = self.cycle_origin;
        self.update(|manifest| {
            manifest.status = Status::Incomplete;
            manifest.record_progress(cycles_done, origin);
        })
    }

    /// Declares the run complete, with the digest of its final state. This is the last step of a
    /// run, after its recorder is finished and its summary is written.
    ///
    /// # Errors
    /// An I/O error; the run can be resumed at its last checkpoint.
    pub fn complete(mut self, cycles_done: u64, digest: &str) -> Result<(), RecordError> {
        let origin = self.cycle_origin;
        self.update(|manifest| {
            manifest.status = Status::Complete;
            manifest.record_progress(cycles_done, origin);
            manifest.digest = Some(digest.to_string());
        })
    }

    /// Changes the manifest on disk first: if that fails, this value still describes the folder.
    pub(crate) fn update(&mut self, change: impl FnOnce(&mut Manifest)) -> Result<(), RecordError> {
        let mut changed = self.manifest.clone();
        change(&mut changed);
        changed.files = self.files.lock().clone();
        changed.write(&self.path.join(MANIFEST))?;
        self.manifest = changed;
        Ok(())
    }
}

fn fill(
    folder: &Path,
    manifest: &mut Manifest,
    scenario: &str,
    files: &[(String, Vec<u8>)],
) -> Result<(), RecordError> {
    disk::replace(&folder.join(SCENARIO), scenario.as_bytes())?;
    let mut listed = FileList::default();
    listed.insert(SCENARIO, FileDigest::of_bytes(scenario.as_bytes()));
    for (name, bytes) in files {
        let path = folder.join(name);
        let parent = disk::parent(&path);
        fs::create_dir_all(parent).map_err(|e| RecordError::new(parent.display(), e))?;
        disk::write_new(&path, bytes)?;
        listed.insert(name.as_str(), FileDigest::of_bytes(bytes));
    }
    if !files.is_empty() {
        disk::sync_below(folder)?;
    }
    manifest.files = listed;
    manifest.write(&folder.join(MANIFEST))
}

fn resume_point(checkpoint: &Path) -> Result<ResumePoint, InputError> {
    if !checkpoint.exists() {
        return Ok(ResumePoint::Start);
    }
    read(checkpoint, |p| fs::read(p)).map(ResumePoint::Checkpoint)
}

/// Refuses a path at which a new run must not be created.
pub(crate) fn check_vacant(path: &Path, existing: IfExists) -> Result<(), InputError> {
    let mut entries = match fs::read_dir(path) {
        Ok(entries) => entries,
        Err(_) if !path.exists() => return Ok(()),
        Err(e) => {
            let cause = format!("cannot make the folder: {e}");
            return Err(InputError::new(path.display(), cause, CREATE_REMEDY));
        }
    };
    if entries.next().is_none() {
        return Ok(());
    }
    let cause = if path.join(manifest::SWEEP_MANIFEST).is_file() {
        "the folder holds a sweep"
    } else if is_run(path) {
        // Some other program's `run.json` does not make a folder one of ours.
        Manifest::read(&path.join(MANIFEST))?;
        if existing == IfExists::Replace {
            return Ok(());
        }
        let remedy = "resume that run, give another folder, or replace the old run (--replace)";
        return Err(InputError::new(path.display(), "the folder holds a run already", remedy));
    } else {
        "the folder holds something else than a run"
    };
    Err(InputError::new(path.display(), cause, "give a new or empty folder"))
}

fn lock(folder: &Path) -> Result<ProcessLock, InputError> {
    let path = folder.join(LOCK);
    ProcessLock::acquire(&path).map_err(|error| match error {
        LockError::Held(holder) => {
            let cause = format!("{} is writing this run", holder_text(holder));
            let remedy = "wait until it ends, stop it, or give another folder";
            InputError::new(folder.display(), cause, remedy)
        }
        LockError::System(e) => {
            let remedy =
                "make the folder writable, and put the run on a file system that can lock files";
            InputError::new(path.display(), e.to_string(), remedy)
        }
    })
}
