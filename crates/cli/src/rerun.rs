//! A recorded run that is computed again: from its folder, or from a recording for viewers.

use crate::exit::Failure;
use crate::recording::{restore, write_inputs};
use sidestep::kernel::Simulation;
use sidestep::kernel::checkpoint::decode_header;
use sidestep::kernel::{Cycle, InputError};
use sidestep::scenario::Resolved;
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use sidestep_record::{McapRun, ResumePoint, RunView, Status, is_mcap};
use std::path::{Path, PathBuf};

/// What is recorded of a run, whatever it was recorded to.
#[derive(Debug)]
pub(crate) struct Recorded {
    /// The folder or file.
    pub(crate) path: PathBuf,
    /// The version that made it.
    version: String,
    /// Whether it came to its end.
    pub(crate) is_complete: bool,
    /// Cycles that are done for certain.
    pub(crate) cycles_done: Cycle,
    /// The digest of the state after these, where it is known.
    pub(crate) digest: Option<String>,
    /// The run folder, where it is one.
    pub(crate) folder: Option<PathBuf>,
    source: Source,
    /// The folder that the scenario's files lie in.
    base: PathBuf,
    /// The same, where it lasts only as long as this.
    _unpacked: Option<tempfile::TempDir>,
}

/// Where resolved scenarios have their files.
const INPUTS: &str = "inputs";

impl Recorded {
    /// Opens a run folder or an MCAP file of ours.
    ///
    /// # Errors
    /// When it is neither, or damaged.
    pub(crate) fn open(path: &Path) -> Result<Self, Failure> {
        if is_mcap(path) { Self::of_mcap(path) } else { Ok(Self::of_folder(path)?) }
    }

    fn of_folder(path: &Path) -> Result<Self, InputError> {
        let view = RunView::open(path)?;
        let place = path.join("scenario.toml").display().to_string();
        Ok(Self {
            path: path.to_path_buf(),
            version: view.manifest.program_version,
            is_complete: view.manifest.status == Status::Complete,
            cycles_done: view.manifest.cycles_done,
            digest: view.manifest.digest,
            folder: Some(path.to_path_buf()),
            source: Source::new(place, view.scenario, path),
            base: path.to_path_buf(),
            _unpacked: None,
        })
    }

    fn of_mcap(path: &Path) -> Result<Self, Failure> {
        let run = McapRun::open(path)?;
        let files = tempfile::tempdir().map_err(|e| Failure::write(&std::env::temp_dir(), &e))?;
        write_inputs(files.path(), &run.files)?;
        let place = format!("{}: scenario.toml", path.display());
        Ok(Self {
            path: path.to_path_buf(),
            version: run.program_version,
            is_complete: run.status == Status::Complete,
            cycles_done: run.cycles_done,
            digest: Some(run.digest),
            folder: None,
            source: Source::new(place, run.scenario, files.path()),
            base: files.path().to_path_buf(),
            _unpacked: Some(files),
        })
    }

    /// The scenario as it was recorded, and its files.
    ///
    /// # Errors
    /// When a file cannot be read any more.
    pub(crate) fn resolved(&self) -> Result<Resolved, InputError> {
        let folder = self.base.join(INPUTS);
        let mut files = Vec::new();
        if folder.is_dir() {
            let unreadable = |e: std::io::Error| {
                let remedy = "make the folder readable, or run the scenario again";
                InputError::new(folder.display(), e.to_string(), remedy)
            };
            for entry in std::fs::read_dir(&folder).map_err(unreadable)? {
                let entry = entry.map_err(unreadable)?;
                let name = format!("{INPUTS}/{}", entry.file_name().display());
                files.push((name, std::fs::read(entry.path()).map_err(unreadable)?));
            }
        }
        Ok(Resolved { text: self.source.text.clone(), files })
    }

    /// The run at its start.
    ///
    /// # Errors
    /// Results may change between versions, so only the writer's own can be computed again. A
    /// scenario that is wrong by now.
    pub(crate) fn start(&self, workers: usize) -> Result<Box<dyn Simulation>, InputError> {
        let (compiled, source) = (WORLDS.compile(&self.source)?, &self.source);
        let (wrote, reads) = (&self.version, env!("CARGO_PKG_VERSION"));
        if wrote == reads {
            return Ok(compiled.start(source, workers));
        }
        let cause = format!("the run is of sidestep {wrote}, this is {reads}");
        let remedy = format!("use sidestep {wrote}, or run its scenario again");
        Err(InputError::new(self.path.display(), cause, remedy))
    }

    /// The run at its last checkpoint, if that lies before `cycle`; else at its start.
    ///
    /// # Errors
    /// As [`Self::start`]; a damaged checkpoint.
    pub(crate) fn start_near(
        &self,
        cycle: Cycle,
        workers: usize,
    ) -> Result<Box<dyn Simulation>, InputError> {
        let mut run = self.start(workers)?;
        if let Some(folder) = &self.folder
            && let Ok(bytes) = std::fs::read(folder.join("checkpoint.bin"))
            && decode_header(&bytes).is_ok_and(|header| header.cycle <= cycle)
        {
            restore(run.as_mut(), &ResumePoint::Checkpoint(bytes), folder)?;
        }
        Ok(run)
    }

    /// Compares the state of a run that was computed again with what is recorded of its last one.
    /// Whether there was anything to compare.
    ///
    /// # Errors
    /// When they differ.
    pub(crate) fn confirm(&self, run: &dyn Simulation) -> Result<bool, Failure> {
        let Some(recorded) = self.digest.as_ref().filter(|_| run.cycle() == self.cycles_done)
        else {
            return Ok(false);
        };
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
        Err(Failure::stopped(format!("{}: {cause}", self.path.display()), remedy))
    }
}
