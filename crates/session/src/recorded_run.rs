//! A recorded run that is computed again: from its folder, or from a recording for viewers.

use crate::Error;
use crate::identity::Producer;
use crate::orders::replay_recorded;
use crate::playback::RecordedPlayback;
use crate::run_recorder::{restore_run, write_inputs};
use crate::sweep::{Folder, check_build};
use sidestep_experiment::sweep::Trial;
use sidestep_kernel::Simulation;
use sidestep_kernel::checkpoint::decode_header;
use sidestep_kernel::shell::sidestep_command;
use sidestep_kernel::{Cycle, InputError};
use sidestep_record::{
    McapRunInfo, OriginRange, ResumePoint, RunReader, Status, check_mcap, is_mcap, tables,
};
use sidestep_scenario::ResolvedScenario;
use sidestep_scenario::{Source, Worlds};
use std::path::{Path, PathBuf};

/// A recorded run, in a folder or a file.
pub struct RecordedRun {
    /// The folder or file.
    pub path: PathBuf,
    worlds: Worlds,
    producer: Producer,
    /// Whether the run reached its end.
    pub is_complete: bool,
    /// Number of cycles that are certainly done.
    pub cycles_done: Cycle,
    /// Digest of the state after these cycles, if it is known.
    pub digest: Option<String>,
    /// How each of the cycles came about, by rising cycles; empty for an MCAP file, which does not say so.
    pub origins: Vec<OriginRange>,
    /// Whether it is a flight in real time, at least up to a cycle from which it was simulated.
    pub is_flight: bool,
    /// Whether it is a flight that ended before its planned end, and was closed.
    pub is_cut_off: bool,
    /// The run folder; `None` for an MCAP file, which has neither tables nor checkpoints.
    pub folder: Option<PathBuf>,
    source: Source,
    /// The folder of the scenario's files.
    base: PathBuf,
    /// Deletes that folder when this value is dropped, if it is temporary.
    _unpacked: Option<tempfile::TempDir>,
}

/// The end of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunEnd {
    /// Number of cycles done.
    pub cycles: Cycle,
    /// Digest of the state after them.
    pub digest: String,
}

/// Name of the folder of files beside a resolved scenario.
const INPUTS: &str = "inputs";

impl RecordedRun {
    /// Opens a run folder or an MCAP file of this program, with a run of one of `worlds`.
    ///
    /// # Errors
    /// When it is neither, or is damaged.
    pub fn open(worlds: &Worlds, path: &Path) -> Result<Self, Error> {
        if is_mcap(path) {
            Self::from_mcap(worlds, path)
        } else {
            Ok(Self::from_folder(worlds, path)?)
        }
    }

    /// Returns the run of a trial as one that is computed again: the sweep's table has its length and the digest of its
    /// end.
    ///
    /// # Errors
    /// When another build made the sweep, or the scenario of its variant is not as it was planned.
    pub fn from_sweep(
        worlds: &Worlds,
        folder: &Folder,
        trial: Trial,
        end: RunEnd,
    ) -> Result<Self, InputError> {
        check_build(worlds, folder)?;
        folder.check_variant(trial.variant)?;
        let file = folder.scenario(trial.variant);
        let source = Source::read(&file, &[])?.with_overrides(&[format!("seed={}", trial.seed)])?;
        let manifest = folder.manifest();
        Ok(Self {
            worlds: worlds.clone(),
            producer: Producer {
                version: manifest.program_version.clone(),
                build: manifest.build.clone(),
            },
            is_complete: true,
            cycles_done: end.cycles,
            digest: Some(end.digest),
            origins: Vec::new(),
            is_flight: false,
            is_cut_off: false,
            folder: None,
            source,
            base: file.parent().unwrap_or(Path::new("")).to_path_buf(),
            path: file,
            _unpacked: None,
        })
    }

    fn from_folder(worlds: &Worlds, path: &Path) -> Result<Self, InputError> {
        let view = RunReader::open(path)?;
        view.check_files(|_| true)?;
        let place = path.join("scenario.toml").display().to_string();
        let origins = view.manifest.all_origins();
        let is_flight = view.manifest.is_flight();
        Ok(Self {
            path: path.to_path_buf(),
            worlds: worlds.clone(),
            producer: Producer {
                version: view.manifest.program_version,
                build: view.manifest.build,
            },
            is_complete: view.manifest.status == Status::Complete,
            cycles_done: view.manifest.cycles_done,
            origins,
            is_flight,
            is_cut_off: view.manifest.is_cut_off,
            digest: view.manifest.digest,
            folder: Some(path.to_path_buf()),
            source: Source::new(place, view.scenario, path),
            base: path.to_path_buf(),
            _unpacked: None,
        })
    }

    fn from_mcap(worlds: &Worlds, path: &Path) -> Result<Self, Error> {
        let run = McapRunInfo::open(path).map_err(|e| explain_partial(path, e))?;
        check_mcap(path)?;
        let files =
            tempfile::tempdir().map_err(|e| Error::cannot_write(&std::env::temp_dir(), &e))?;
        write_inputs(files.path(), &run.files)?;
        let place = format!("{}: scenario.toml", path.display());
        Ok(Self {
            path: path.to_path_buf(),
            worlds: worlds.clone(),
            producer: Producer { version: run.program_version, build: run.build },
            is_complete: run.status == Status::Complete,
            cycles_done: run.cycles_done,
            digest: Some(run.digest),
            origins: Vec::new(),
            is_flight: false,
            is_cut_off: false,
            folder: None,
            source: Source::new(place, run.scenario, files.path()),
            base: files.path().to_path_buf(),
            _unpacked: Some(files),
        })
    }

    /// Returns the recorded scenario and its files.
    ///
    /// # Errors
    /// When a file can no longer be read.
    pub fn resolved_scenario(&self) -> Result<ResolvedScenario, InputError> {
        let folder = self.base.join(INPUTS);
        let files = read_inputs(&folder).map_err(|e| {
            let remedy = "make the folder readable, or run the scenario again";
            InputError::new(folder.display(), e.to_string(), remedy)
        })?;
        Ok(ResolvedScenario { text: self.source.text.clone(), files })
    }

    /// The build of this program, which makes what is computed again.
    pub(crate) fn build(&self) -> &str {
        self.worlds.build()
    }

    /// Returns the names of the recorded tables; none for a recording for viewers.
    ///
    /// # Errors
    /// When the folder can no longer be read.
    pub fn tables(&self) -> Result<Vec<String>, InputError> {
        self.folder.as_ref().map_or(Ok(Vec::new()), |folder| tables(folder))
    }

    /// Refuses a recording of which nothing is on disk.
    ///
    /// # Errors
    /// When it was killed before its first rows were written.
    pub fn check_has_content(&self) -> Result<(), InputError> {
        let is_begun = self.is_complete || self.cycles_done > 0 || self.folder.is_none();
        if is_begun || !(self.is_flight || self.tables()?.is_empty()) {
            return Ok(());
        }
        Err(nothing_recorded(&self.path, self.is_flight))
    }

    /// Returns the run at its start.
    ///
    /// # Errors
    /// When another build made the recording, because results may change between builds; or when
    /// the scenario is no longer valid.
    pub fn start(&self, workers: usize) -> Result<Box<dyn Simulation>, InputError> {
        let compiled = self.worlds.compile(&self.source)?;
        self.producer.check(self.worlds.build(), &self.path, "run", |wrote| {
            format!("use sidestep {wrote}, or run its scenario again")
        })?;
        let mut run = compiled.start(&self.source, workers);
        self.check_end(run.config().cycles)?;
        if let Some(folder) = &self.folder {
            replay_recorded(run.as_mut(), folder)?;
        }
        Ok(run)
    }

    /// Refuses a recording that claims more cycles than its scenario has: its computation would take that long.
    fn check_end(&self, planned: Cycle) -> Result<(), InputError> {
        let done = self.cycles_done;
        if done <= planned {
            return Ok(());
        }
        let cause = format!("{done} cycles are recorded, and its scenario has {planned}");
        let remedy = "the recording was changed: restore it, or run its scenario again";
        Err(InputError::new(self.path.display(), cause, remedy))
    }

    /// Returns the build that made the recording, if it is another one: then it is not computed again.
    pub fn other_build(&self) -> Option<&str> {
        let Producer { version, build } = &self.producer;
        let own = self.worlds.build();
        let is_other = self.producer.check(own, &self.path, "run", |_| String::new()).is_err();
        is_other.then(|| build.as_deref().unwrap_or(version))
    }

    /// Returns the run at its start, for watching: computed again, or from its own tables or messages if another
    /// build made it.
    ///
    /// # Errors
    /// When the scenario is no longer valid; when the tables or messages of another build are damaged.
    pub fn start_for_viewing(&self, workers: usize) -> Result<Box<dyn Simulation>, InputError> {
        if self.other_build().is_none() {
            return self.start(workers);
        }
        // One worker is enough for a run that never advances: it only knows the scenery and the start.
        let start = self.worlds.compile(&self.source)?.start(&self.source, 1);
        self.check_end(start.config().cycles)?;
        let playback = match &self.folder {
            Some(folder) => RecordedPlayback::from_tables(start, folder, self.cycles_done)?,
            None => {
                let kinds = self.worlds.kinds();
                RecordedPlayback::from_messages(start, &self.path, kinds, self.cycles_done)?
            }
        };
        Ok(Box::new(playback))
    }

    /// Returns the run at its last checkpoint, if that is before `cycle`; otherwise at its start.
    ///
    /// # Errors
    /// Those of [`Self::start`]; a damaged checkpoint.
    pub fn start_near(
        &self,
        cycle: Cycle,
        workers: usize,
    ) -> Result<Box<dyn Simulation>, InputError> {
        let mut run = self.start(workers)?;
        if let Some(folder) = &self.folder
            && let Ok(bytes) = std::fs::read(folder.join("checkpoint.bin"))
            && decode_header(&bytes).is_ok_and(|header| header.cycle <= cycle)
        {
            restore_run(run.as_mut(), &ResumePoint::Checkpoint(bytes), folder)?;
        }
        Ok(run)
    }

    /// Compares the state of a run that was computed again with its recorded last state. Returns
    /// whether there was anything to compare.
    ///
    /// # Errors
    /// When they differ.
    pub fn verify_digest(&self, run: &dyn Simulation) -> Result<bool, Error> {
        let Some(recorded) = &self.digest else { return Ok(false) };
        if run.cycle() != self.cycles_done {
            return Ok(false);
        }
        let digest = run.digest().to_string();
        if *recorded == digest {
            return Ok(true);
        }
        let cause = format!(
            "after {} cycles the digest is {digest}, recorded is {recorded}",
            self.cycles_done
        );
        let remedy =
            "the recording was changed, or this is a bug: please report it with the recording";
        Err(Error::other(format!("{}: {cause}", self.path.display()), remedy))
    }
}

/// Returns the error of a recording that was never ended with words for getting a whole one.
fn explain_partial(path: &Path, error: InputError) -> InputError {
    if path.extension() != Some("partial".as_ref()) {
        return error;
    }
    let cause = "this is an MCAP file that is still being written, or whose process was killed: its end is missing";
    let remedy = "if its run has a folder, `sidestep resume DIR` and then `sidestep export DIR --to mcap` make it whole; \
                  else run the scenario again";
    InputError::new(path.display(), cause, remedy)
}

/// Returns the error of a recording of which nothing is on disk.
pub(crate) fn nothing_recorded(path: &Path, is_flight: bool) -> InputError {
    let cause = "nothing of this run is on disk: it was killed before its first rows were written, or has just begun";
    let remedy = if is_flight {
        "wait until it has flown for a second, or fly it again with --replace".to_string()
    } else {
        format!("run it with `{}`", sidestep_command("resume", path))
    };
    InputError::new(path.display(), cause, remedy)
}

/// Returns the files of a folder of inputs, by their names relative to the scenario; none without such a folder.
fn read_inputs(folder: &Path) -> std::io::Result<Vec<(String, Vec<u8>)>> {
    let mut files = Vec::new();
    if folder.is_dir() {
        for entry in std::fs::read_dir(folder)? {
            let entry = entry?;
            let name = format!("{INPUTS}/{}", entry.file_name().display());
            files.push((name, std::fs::read(entry.path())?));
        }
    }
    Ok(files)
}
