//! Whose the files in a run folder are.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use sidestep_kernel::InputError;

use crate::file_list::{DamagedFile, locate};
use crate::file_manifest::{FileManifest, REPORT};
use crate::manifest::Status;
use crate::part::first_cycle;
use crate::run_reader::{CHECKPOINT, LOCK, MANIFEST, RunReader, SCENARIO, SUMMARY};

/// Names that every run writes.
const RUN_NAMES: [&str; 7] =
    [MANIFEST, LOCK, SCENARIO, CHECKPOINT, SUMMARY, "trajectories.svg", "trajectories.png"];
/// The bytes of the largest process id, in decimal digits.
const MAX_PROCESS_ID_BYTES: u64 = 10;
/// The folder of the files that a scenario names.
const INPUTS: &str = "inputs";

/// The files of a run folder: those of its manifest, and those of reports and exports in it.
pub(crate) struct RunContent {
    folder: PathBuf,
    is_complete: bool,
    /// The paths that the manifests name, as they are on the disk.
    pub(crate) listed: BTreeSet<PathBuf>,
    /// Exports that the user has put there, which a new run does not replace, with their lists.
    pub(crate) exported: BTreeSet<PathBuf>,
    pub(crate) damaged: Vec<DamagedFile>,
    changed: BTreeSet<PathBuf>,
    /// Folders of tables and inputs: nothing else may lie in them.
    folders: BTreeSet<String>,
}

impl RunContent {
    /// Reads all files of the run that `run` describes.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub(crate) fn new(run: &RunReader) -> Result<Self, InputError> {
        let folder = &run.path;
        let mut content = Self {
            folder: folder.clone(),
            is_complete: run.manifest.status == Status::Complete,
            listed: BTreeSet::new(),
            exported: BTreeSet::new(),
            damaged: Vec::new(),
            changed: BTreeSet::new(),
            folders: BTreeSet::from([INPUTS.to_string()]),
        };
        for (name, _) in run.manifest.files.iter() {
            content.listed.insert(content.relative(&locate(folder, name)));
            content.folders.extend(name.split_once('/').map(|(folder, _)| folder.to_string()));
        }
        content.damaged = run.damaged_files(|_| true);
        content.add_reports().map_err(|e| unreadable(folder, &e))?;
        content.changed = content.damaged.iter().map(|file| content.relative(&file.path)).collect();
        content.changed.retain(|path| !content.exported.contains(path));
        Ok(content)
    }

    /// Adds the reports and exports in the folder.
    fn add_reports(&mut self) -> io::Result<()> {
        for entry in fs::read_dir(&self.folder)? {
            let path = entry?.path();
            if !FileManifest::is_named(&path) {
                continue;
            }
            let report = match FileManifest::read(&path) {
                Ok((report, _)) => report,
                Err(error) => {
                    self.damaged.push(DamagedFile::from_error(path, &error));
                    continue;
                }
            };
            let own = self.relative(&path);
            let is_report = report.kind == REPORT;
            let names = if is_report { &mut self.listed } else { &mut self.exported };
            names.extend(report.files.iter().map(|(name, _)| PathBuf::from(name)));
            names.insert(own);
            self.damaged.extend(report.damaged_in(&self.folder));
        }
        Ok(())
    }

    fn relative(&self, path: &Path) -> PathBuf {
        path.strip_prefix(&self.folder).unwrap_or(path).to_path_buf()
    }

    /// Returns whether a file that a manifest names is not as it was written.
    pub(crate) fn is_changed(&self, path: &Path) -> bool {
        self.changed.contains(path)
    }

    /// Returns whether this program wrote a file: a manifest names it, or a killed process left it.
    pub(crate) fn is_own(&self, path: &Path) -> bool {
        let name = slashed(path);
        match name.split_once('/') {
            _ if self.listed.contains(path) => true,
            None if name == MANIFEST => true,
            None if name == LOCK => is_lock(&self.folder.join(path)),
            // A run that was killed early leaves folders without a part.
            None if self.folder.join(path).is_dir() => name.ends_with(".partial"),
            None => self.is_remains(&name),
            // Parts after the last checkpoint of a run that was killed.
            Some((table, part)) => {
                let part = part.strip_suffix(".partial").unwrap_or(part);
                !self.is_complete && self.is_table(table) && first_cycle(part).is_some()
            }
        }
    }

    /// Returns whether a file was left by a killed process: a run that is not complete may have results, and any writer
    /// leaves `NAME.partial` or `NAME.PROCESS.partial`.
    fn is_remains(&self, name: &str) -> bool {
        let Some(whole) = name.strip_suffix(".partial") else {
            return !self.is_complete && RUN_NAMES.contains(&name);
        };
        let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        let stem = whole.rsplit_once('.').filter(|(_, process)| is_number(process));
        let stem = stem.map_or(whole, |(stem, _)| stem);
        RUN_NAMES.contains(&stem)
    }

    fn is_table(&self, folder: &str) -> bool {
        let table = folder.strip_suffix(".partial").unwrap_or(folder);
        folder.ends_with(".partial") || self.folders.contains(table)
    }

    /// Returns whether a file of others lies where runs write.
    pub(crate) fn is_in_the_way(&self, path: &Path) -> bool {
        let name = slashed(path);
        match name.split_once('/') {
            None => RUN_NAMES.contains(&name.as_str()),
            Some((folder, _)) => RUN_NAMES.contains(&folder) || self.is_table(folder),
        }
    }
}

/// Returns whether a file is a lock: it is empty, or holds the id of the process that was killed while it held it.
fn is_lock(path: &Path) -> bool {
    let is_file = fs::symlink_metadata(path).is_ok_and(|found| found.is_file());
    let is_short = fs::metadata(path).is_ok_and(|found| found.len() <= MAX_PROCESS_ID_BYTES);
    is_file && is_short && fs::read(path).is_ok_and(|text| text.iter().all(u8::is_ascii_digit))
}

pub(crate) fn unreadable(folder: &Path, error: &io::Error) -> InputError {
    InputError::new(folder.display(), error.to_string(), "make the folder readable")
}

/// Returns a path with `/` between its parts, on every system.
pub(crate) fn slashed(path: &Path) -> String {
    let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
    parts.join("/")
}

/// Returns the files below a folder, and the folders that are empty, by their paths in it, sorted. Links are not followed.
pub(crate) fn list_tree(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut all = Vec::new();
    add_tree(folder, Path::new(""), &mut all)?;
    all.sort();
    Ok(all)
}

fn add_tree(folder: &Path, under: &Path, all: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder.join(under))? {
        let entry = entry?;
        let path = under.join(entry.file_name());
        let before = all.len();
        if entry.file_type()?.is_dir() {
            add_tree(folder, &path, all)?;
            if all.len() > before {
                continue;
            }
        }
        all.push(path);
    }
    Ok(())
}
