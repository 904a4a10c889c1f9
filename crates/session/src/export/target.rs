//! The place of an export.

use super::ExportContext;
use crate::Error;
use crate::files::resolve_path;
use sidestep_kernel::InputError;
use sidestep_record::resolve_link;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// A file or folder that does not exist yet, or may be replaced.
#[derive(Debug)]
pub(super) struct Target {
    path: PathBuf,
}

impl Target {
    /// Returns the requested place, or one beside the recorded run, with its name and `ending`.
    ///
    /// # Errors
    /// When that is the recording itself, or a folder that contains it: it would be lost.
    fn resolve(job: &ExportContext<'_>, ending: &str) -> Result<Self, InputError> {
        let recorded = &job.recorded.path;
        let path = job.wanted.out.map_or_else(|| default_path(recorded, ending), Path::to_path_buf);
        let target = Self { path };
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
        match std::fs::metadata(&target.path) {
            Ok(found) if found.is_dir() => Err(target.error("this is a folder", "give a file")),
            Ok(_) if !job.wanted.replace => Err(target.error(EXISTS_CAUSE, REPLACE_REMEDY)),
            _ => Ok(target),
        }
    }

    /// Returns a folder; one that is replaced may hold only files with an extension in `holds`.
    ///
    /// # Errors
    /// When the folder exists and may not be replaced, or holds something else.
    pub(super) fn for_folder(
        job: &ExportContext<'_>,
        ending: &str,
        holds: &[&str],
    ) -> Result<Self, InputError> {
        let target = Self::resolve(job, ending)?;
        let Ok(mut entries) = std::fs::read_dir(&target.path) else {
            if target.path.exists() {
                return Err(target.error("this is no folder", "give a new folder"));
            }
            return Ok(target);
        };
        if !job.wanted.replace {
            return Err(target.error(EXISTS_CAUSE, REPLACE_REMEDY));
        }
        // A mistyped --out must not cost a folder of somebody's own files.
        if !entries.all(|entry| entry.is_ok_and(|entry| has_extension(&entry.path(), holds))) {
            let listed = holds.join(", .");
            let cause = format!("the folder holds something else than .{listed} files");
            return Err(target.error(&cause, "give a new folder"));
        }
        Ok(target)
    }

    fn error(&self, cause: &str, remedy: &str) -> InputError {
        InputError::new(self.path.display(), cause, remedy)
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Creates the folder: `fill` gets one with another name, which replaces the folder
    /// when it is complete.
    ///
    /// # Errors
    /// The error of `fill`, or an I/O error; nothing is left then.
    pub(super) fn write_folder<T>(
        &self,
        fill: impl FnOnce(&Path) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let cannot_write = |e: std::io::Error| Error::cannot_write(&self.path, &e);
        // A link stays: the folder that it leads to is replaced.
        let path = resolve_link(&self.path).map_err(cannot_write)?;
        let mut partial = path.as_os_str().to_owned();
        partial.push(".partial");
        let partial = PathBuf::from(partial);
        // Remains of a process that was killed.
        remove(&partial).map_err(cannot_write)?;
        std::fs::create_dir_all(&partial).map_err(cannot_write)?;
        let filled = fill(&partial).and_then(|filled| {
            remove(&path).and_then(|()| std::fs::rename(&partial, &path)).map_err(cannot_write)?;
            Ok(filled)
        });
        if filled.is_err() {
            let _ = remove(&partial);
        }
        filled
    }
}

fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    let extension = path.extension();
    path.is_file() && extensions.iter().any(|one| extension == Some(OsStr::new(one)))
}

const EXISTS_CAUSE: &str = "is there already";
const REPLACE_REMEDY: &str = "give another place with --out, or --replace";

fn remove(folder: &Path) -> std::io::Result<()> {
    match std::fs::remove_dir_all(folder) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

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
