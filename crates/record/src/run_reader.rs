//! The folder of a run, for those who read it.

use std::fs;
use std::path::{Path, PathBuf};

use sidestep_kernel::InputError;
use sidestep_kernel::checkpoint::decode_header;

use crate::file_list::{DamagedFile, FileFault};
use crate::manifest::{Manifest, Status};
use crate::part::next_cycle;
use crate::read::check_part;
use crate::sealed_json::Seal;

/// File name of the manifest.
pub(crate) const MANIFEST: &str = "run.json";
pub(crate) const SCENARIO: &str = "scenario.toml";
pub(crate) const SUMMARY: &str = "summary.json";
pub(crate) const CHECKPOINT: &str = "checkpoint.bin";
pub(crate) const LOCK: &str = "run.lock";

/// A run folder to read from; its run may still be in progress.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunReader {
    /// Path of the folder, as it was given.
    pub path: PathBuf,
    /// The content of `run.json` when the folder was opened.
    pub manifest: Manifest,
    /// The text of `scenario.toml`, with every default and include resolved.
    pub scenario: String,
    /// Whether the manifest confirms its own content.
    pub seal: Seal,
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
        let (manifest, seal) = Manifest::read(&path.join(MANIFEST))?;
        manifest.files.check_in(path, |name| name == SCENARIO)?;
        let scenario = read(&path.join(SCENARIO), |p| fs::read_to_string(p))?;
        Ok(Self { path: path.to_path_buf(), manifest, scenario, seal })
    }

    /// Opens a run that is to be replaced: its files may be damaged, its manifest may not.
    pub(crate) fn open_for_replacement(path: &Path) -> Result<Self, InputError> {
        check_is_run(path)?;
        let (manifest, seal) = Manifest::read(&path.join(MANIFEST))?;
        Ok(Self { path: path.to_path_buf(), manifest, scenario: String::new(), seal })
    }

    /// Checks those files whose path `is_wanted` wants against the digests that the manifest has of them.
    ///
    /// # Errors
    /// The first file that is not as it was written.
    pub fn check_files(&self, is_wanted: impl Fn(&str) -> bool) -> Result<(), InputError> {
        let damaged = self.damaged_files(is_wanted);
        damaged.first().map_or(Ok(()), |file| Err(file.to_error()))
    }

    /// Returns the files that are not as they were written; only those whose path `is_wanted` wants.
    pub fn damaged_files(&self, is_wanted: impl Fn(&str) -> bool) -> Vec<DamagedFile> {
        let mut damaged = self.manifest.files.damaged_in(&self.path, is_wanted);
        let checkpoint = self.path.join(CHECKPOINT);
        damaged.retain(|file| {
            let is_checkpoint = file.path == checkpoint;
            !(is_checkpoint && self.is_newer_checkpoint(&checkpoint) || self.is_newer_part(file))
        });
        damaged
    }

    /// Returns whether a part of a flight is whole, and newer than the manifest: it grows while the flight lasts, and is
    /// written first.
    fn is_newer_part(&self, file: &DamagedFile) -> bool {
        let DamagedFile { path, fault } = file;
        let is_flying = self.manifest.status == Status::Running && self.manifest.ends_in_flight();
        if !is_flying || *fault != FileFault::Changed {
            return false;
        }
        let table = path.parent().and_then(Path::file_name).and_then(|name| name.to_str());
        let table = table.unwrap_or_default().trim_end_matches(".partial");
        let end = next_cycle(path).ok().flatten();
        let is_newer = end.is_some_and(|end| end > self.manifest.cycles_done);
        is_newer && check_part(path, table).is_ok()
    }

    /// Returns whether a checkpoint is whole, and newer than the manifest: a run writes it first.
    fn is_newer_checkpoint(&self, path: &Path) -> bool {
        let Ok(bytes) = fs::read(path) else { return false };
        let Ok(header) = decode_header(&bytes) else { return false };
        let last = self.manifest.last_checkpoint;
        self.manifest.status != Status::Complete && last.is_none_or(|last| header.cycle > last)
    }
}

pub(crate) fn read<T>(
    path: &Path,
    reader: impl FnOnce(&Path) -> std::io::Result<T>,
) -> Result<T, InputError> {
    reader(path).map_err(|e| {
        let remedy = "restore the file, or run the scenario again in a new folder";
        InputError::new(path.display(), e.to_string(), remedy)
    })
}

/// Returns whether a file is a result of a run, written at its end: not what a stopped run continues from.
pub(crate) fn is_result(name: &str) -> bool {
    !name.contains('/') && name != SCENARIO && name != CHECKPOINT
}

/// Returns whether a folder holds a run, even if its manifest is damaged.
pub(crate) fn is_run(path: &Path) -> bool {
    path.join(MANIFEST).is_file()
}

pub(crate) fn check_is_run(path: &Path) -> Result<(), InputError> {
    let cause = match fs::metadata(path) {
        Ok(m) if m.is_dir() && is_run(path) => return Ok(()),
        Ok(m) if m.is_dir() => format!("this is no run folder: it holds no `{MANIFEST}`"),
        Ok(_) => "this is no folder".to_string(),
        Err(e) => e.to_string(),
    };
    Err(InputError::new(path.display(), cause, "give the folder that a run was recorded to"))
}
