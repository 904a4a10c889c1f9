//! The place of an export.

use super::{ExportContext, ExportScope};
use crate::files::{resolve_path, write_file};
use crate::{Error, VERSION, Watcher};
use sidestep_kernel::InputError;
use sidestep_record::{EXPORT, ExportFolder, FileManifest, FileSet, IfExists, McapRecorder};
use std::ffi::OsStr;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// A file or folder that does not exist yet, or may be replaced.
#[derive(Debug)]
pub(super) struct Target {
    path: PathBuf,
    existing: IfExists,
}

impl Target {
    /// Returns the requested place, or one beside the recorded run, with its name and `ending`.
    ///
    /// # Errors
    /// When that is the recording itself, or a folder that contains it: it would be lost.
    fn resolve(job: &ExportContext<'_>, ending: &str) -> Result<Self, InputError> {
        Self::beside(&job.recorded.path, job.wanted, ending)
    }

    /// Returns the requested place, or one beside a recorded run or a sweep.
    fn beside(recorded: &Path, wanted: &ExportScope<'_>, ending: &str) -> Result<Self, InputError> {
        let path = wanted.out.map_or_else(|| default_path(recorded, ending), Path::to_path_buf);
        let existing = if wanted.replace { IfExists::Replace } else { IfExists::Refuse };
        let target = Self { path, existing };
        if resolve_path(recorded).starts_with(resolve_path(&target.path)) {
            let cause = "this is the recording that is exported, or holds it";
            return Err(target.error(cause, "give another place with --out"));
        }
        Ok(target)
    }

    /// Returns the requested file, or the run's name with `ending`.
    ///
    /// # Errors
    /// When the file exists and may not be replaced.
    pub(super) fn for_file(job: &ExportContext<'_>, ending: &str) -> Result<Self, InputError> {
        let target = Self::resolve(job, ending)?;
        target.file_set()?;
        Ok(target)
    }

    /// Returns the requested recording, or the run's name with `.mcap`. It has no list: it confirms itself.
    ///
    /// # Errors
    /// When the file exists and may not be replaced.
    pub(super) fn for_mcap(job: &ExportContext<'_>) -> Result<Self, InputError> {
        let target = Self::resolve(job, ".mcap")?;
        McapRecorder::check_vacant(&target.path, target.existing)?;
        Ok(target)
    }

    /// Returns a folder.
    ///
    /// # Errors
    /// When the folder exists and may not be replaced.
    pub(super) fn for_folder(job: &ExportContext<'_>, ending: &str) -> Result<Self, InputError> {
        Self::for_folder_beside(&job.recorded.path, job.wanted, ending)
    }

    /// Returns a folder: the requested one, or one beside a recorded run or a sweep.
    ///
    /// # Errors
    /// When the folder exists and may not be replaced.
    pub(super) fn for_folder_beside(
        recorded: &Path,
        wanted: &ExportScope<'_>,
        ending: &str,
    ) -> Result<Self, InputError> {
        let target = Self::beside(recorded, wanted, ending)?;
        ExportFolder::check(&target.path, target.existing)?;
        Ok(target)
    }

    /// Returns the file and its list, not yet written.
    ///
    /// # Errors
    /// When the file exists and may not be replaced.
    fn file_set(&self) -> Result<FileSet, InputError> {
        let name = self.name();
        let found = std::fs::symlink_metadata(&self.path);
        if self.existing == IfExists::Refuse && found.is_ok_and(|found| found.is_file()) {
            return Err(self.error(EXISTS_CAUSE, REPLACE_REMEDY));
        }
        let set = FileSet::new(&FileManifest::beside(&self.path), EXPORT, VERSION)?;
        set.check(&name)?;
        Ok(set)
    }

    fn name(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    fn error(&self, cause: &str, remedy: &str) -> InputError {
        InputError::new(self.path.display(), cause, remedy)
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Creates the file and its list: `fill` gets another name, under which the file has to be whole and on the disk.
    ///
    /// # Errors
    /// The error of `fill`, or an I/O error; nothing is left then.
    pub(super) fn write_file<T>(
        &self,
        fill: impl FnOnce(&Path) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let mut set = self.file_set()?;
        let filled = set.stage(&self.name(), fill)?;
        set.commit()?;
        Ok(filled)
    }

    /// Creates the file from what `write` writes, and its list.
    ///
    /// # Errors
    /// An I/O error; nothing is left then.
    pub(super) fn write_stream(
        &self,
        write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
    ) -> Result<(), Error> {
        self.write_file(|partial| {
            write_file(partial, write).map_err(|e| Error::cannot_store(&self.path, &e))
        })
    }

    /// Creates the folder: `fill` gets one with another name, which replaces the folder
    /// when it is complete.
    ///
    /// # Errors
    /// The error of `fill`, or an I/O error; nothing is left then.
    pub(super) fn write_folder<T>(
        &self,
        watcher: &dyn Watcher,
        fill: impl FnOnce(&Path) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let folder = ExportFolder::create(&self.path, self.existing)?;
        folder.leftovers().iter().for_each(|leftover| watcher.note_removal(leftover));
        let filled = folder.fill(fill)?;
        folder.commit(VERSION)?;
        Ok(filled)
    }
}

const EXISTS_CAUSE: &str = "is there already";
const REPLACE_REMEDY: &str = "give another place with --out, or --replace";

/// Returns the place beside a recording, with its name.
fn default_path(recorded: &Path, ending: &str) -> PathBuf {
    // `.` and `..` have no name of their own.
    let whole = std::fs::canonicalize(recorded).unwrap_or_else(|_| recorded.to_path_buf());
    let named = if recorded.file_name().is_some() { recorded } else { &whole };
    let stem = if named.is_file() { named.file_stem() } else { named.file_name() };
    let mut name = stem.unwrap_or(OsStr::new("run")).to_owned();
    name.push(ending);
    named.with_file_name(name)
}
