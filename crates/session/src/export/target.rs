//! The place of an export.

use super::Job;
use crate::Error;
use crate::files::whereabouts_of;
use sidestep::kernel::InputError;
use sidestep_record::followed;
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
    fn named(job: &Job<'_>, ending: &str) -> Result<Self, InputError> {
        let recorded = &job.recorded.path;
        let path = job.wanted.out.map_or_else(|| beside(recorded, ending), Path::to_path_buf);
        let target = Self { path };
        if whereabouts_of(recorded).starts_with(whereabouts_of(&target.path)) {
            let cause = "this is the recording that is exported, or holds it";
            return Err(target.refuse(cause, "name another place with --out"));
        }
        Ok(target)
    }

    /// Returns the requested file, or the run's name with `ending`.
    ///
    /// # Errors
    /// When the file exists and may not be replaced.
    pub(super) fn file(job: &Job<'_>, ending: &str) -> Result<Self, InputError> {
        let target = Self::named(job, ending)?;
        match std::fs::metadata(&target.path) {
            Ok(found) if found.is_dir() => Err(target.refuse("this is a folder", "name a file")),
            Ok(_) if !job.wanted.replace => Err(target.refuse(EXISTS, REPLACE)),
            _ => Ok(target),
        }
    }

    /// Returns a folder; one that is replaced may hold only files with an extension in `holds`.
    ///
    /// # Errors
    /// When the folder exists and may not be replaced, or holds something else.
    pub(super) fn folder(job: &Job<'_>, ending: &str, holds: &[&str]) -> Result<Self, InputError> {
        let target = Self::named(job, ending)?;
        let Ok(mut entries) = std::fs::read_dir(&target.path) else {
            return match target.path.exists() {
                true => Err(target.refuse("this is no folder", "name a new folder")),
                false => Ok(target),
            };
        };
        let is_ours = |entry: std::io::Result<std::fs::DirEntry>| {
            entry.is_ok_and(|e| {
                let path = e.path();
                path.is_file() && holds.iter().any(|end| path.extension() == Some(OsStr::new(end)))
            })
        };
        if !job.wanted.replace {
            return Err(target.refuse(EXISTS, REPLACE));
        }
        if !entries.all(is_ours) {
            let listed = holds.join(", .");
            let cause = format!("the folder holds something else than .{listed} files");
            return Err(target.refuse(&cause, "name a new folder"));
        }
        Ok(target)
    }

    fn refuse(&self, cause: &str, remedy: &str) -> InputError {
        InputError::new(self.path.display(), cause, remedy)
    }

    /// Returns the path.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Creates the folder: `fill` gets one with another name, which replaces the folder
    /// when it is complete.
    ///
    /// # Errors
    /// The error of `fill`, or an I/O error; nothing is left then.
    pub(super) fn make_folder<T>(
        &self,
        fill: impl FnOnce(&Path) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let failed = |e: std::io::Error| Error::write(&self.path, &e);
        let path = followed(&self.path).map_err(failed)?;
        let mut growing = path.as_os_str().to_owned();
        growing.push(".partial");
        let growing = PathBuf::from(growing);
        // Remains of a process that was killed.
        remove(&growing).map_err(failed)?;
        std::fs::create_dir_all(&growing).map_err(failed)?;
        let filled = fill(&growing).and_then(|done| {
            remove(&path).and_then(|()| std::fs::rename(&growing, &path)).map_err(failed)?;
            Ok(done)
        });
        filled.inspect_err(|_| drop(remove(&growing)))
    }
}

const EXISTS: &str = "is there already";
const REPLACE: &str = "name another place with --out, or give --replace";

fn remove(folder: &Path) -> std::io::Result<()> {
    match std::fs::remove_dir_all(folder) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

/// Returns the place beside a recording, with its name.
fn beside(recorded: &Path, ending: &str) -> PathBuf {
    // `.` and `..` have no name of their own.
    let whole = std::fs::canonicalize(recorded).unwrap_or_else(|_| recorded.to_path_buf());
    let named = if recorded.file_name().is_some() { recorded } else { &whole };
    let stem = if named.is_file() { named.file_stem() } else { named.file_name() };
    let mut name = stem.unwrap_or(OsStr::new("run")).to_owned();
    name.push(ending);
    named.with_file_name(name)
}
