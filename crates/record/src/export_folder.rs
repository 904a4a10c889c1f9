//! The folder of an export: filled under a temporary name, then listed and moved to its place in one step.

use std::fs;
use std::path::{Path, PathBuf};

use sidestep_kernel::InputError;
use sidestep_kernel::ports::RecordError;

use crate::create_error::{CreateError, PathError};
use crate::disk::{self, MARKER};
use crate::file_manifest::{EXPORT, FileManifest};
use crate::if_exists::IfExists;
use crate::replacement::Replacement;
use crate::run_content::{list_tree, slashed};
use crate::staging::StagingFolder;

/// A folder that is filled. If it is dropped before it is [committed](Self::commit), it is deleted.
pub struct ExportFolder {
    target: PathBuf,
    staging: StagingFolder,
    existing: IfExists,
}

impl ExportFolder {
    /// Refuses a place where such a folder may not be made.
    ///
    /// # Errors
    /// Something is there, and may not be replaced: no folder, or one that has no list of its files, or in which one of
    /// them was changed.
    pub fn check(target: &Path, existing: IfExists) -> Result<(), InputError> {
        Self::find_old(target, existing).map(drop)
    }

    /// Returns what may be deleted of the folder that is there, and what stays.
    fn find_old(target: &Path, existing: IfExists) -> Result<Replacement, InputError> {
        let Ok(mut entries) = fs::read_dir(target) else {
            if target.exists() {
                let remedy = "give a new folder";
                return Err(InputError::new(target.display(), "this is no folder", remedy));
            }
            return Ok(Replacement::default());
        };
        match existing {
            IfExists::Refuse => {
                let remedy = "give another place with --out, or --replace";
                Err(InputError::new(target.display(), "is there already", remedy))
            }
            IfExists::Replace if entries.next().is_none() => Ok(Replacement::default()),
            IfExists::Replace => Replacement::of_export(target),
        }
    }

    /// Begins a folder that will be at `target`.
    ///
    /// # Errors
    /// Those of [`Self::check`]; a place where none can be made.
    pub fn create(target: &Path, existing: IfExists) -> Result<Self, CreateError> {
        Self::check(target, existing)?;
        let staging = StagingFolder::new(target)?;
        Ok(Self { target: target.to_path_buf(), staging, existing })
    }

    /// Does work that fills the folder, at the path that it has until then. An error names `target` instead.
    ///
    /// # Errors
    /// Those of `work`.
    pub fn fill<T, E: PathError>(&self, work: impl FnOnce(&Path) -> Result<T, E>) -> Result<T, E> {
        self.staging.fill(work)
    }

    /// Returns the folders that killed processes left beside it, and that are removed now.
    pub fn leftovers(&self) -> &[PathBuf] {
        self.staging.leftovers()
    }

    /// Lists all files and moves the folder to its place. Files that the earlier folder listed are deleted, all others are in
    /// the new one afterwards.
    ///
    /// # Errors
    /// Those of [`Self::check`]; another file that has the name of a new one; an I/O error. The earlier folder stays.
    pub fn commit(self, program_version: &str) -> Result<(), CreateError> {
        self.fill(|folder| {
            write_list(folder, program_version)?;
            disk::sync_below(folder)
        })?;
        let old = Self::find_old(&self.target, self.existing)?;
        self.staging.commit(&old)
    }
}

/// Writes the list of all files in a folder.
fn write_list(folder: &Path, program_version: &str) -> Result<(), RecordError> {
    let failed = |e: std::io::Error| RecordError::new(folder.display(), e);
    let mut list = FileManifest::new(EXPORT, program_version);
    let files = list_tree(folder).map_err(failed)?;
    // The marker is no part of the export, and to read it would release its lock.
    for path in files.iter().filter(|path| *path != Path::new(MARKER)) {
        list.files.insert_file(folder, &slashed(path)).map_err(failed)?;
    }
    list.write(&folder.join(FileManifest::name_for(EXPORT)))
}
