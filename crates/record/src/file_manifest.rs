//! The list of the files of a report, an export, or a table of a sweep, in a file beside them.

use std::path::Path;

use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::RecordError;

use crate::file_list::FileList;
use crate::format::{self, FormatVersion};
use crate::sealed_json::{self, Seal};

/// The end of the name of such a file.
const ENDING: &str = ".manifest.json";

/// The content of `NAME.manifest.json`: files that were written together, by their paths beside it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileManifest {
    /// Version of the format.
    pub format: FormatVersion,
    /// Version of the program that wrote the files.
    pub program_version: String,
    /// What they are: `report`, `export` or `table`.
    pub kind: String,
    /// The files and their digests.
    pub files: FileList,
}

impl FileManifest {
    /// Returns a manifest without files.
    pub fn new(kind: &str, program_version: &str) -> Self {
        Self {
            format: format::CURRENT,
            program_version: program_version.into(),
            kind: kind.into(),
            files: FileList::default(),
        }
    }

    /// Returns the name of the manifest of files that are called `stem`.
    pub fn name_for(stem: &str) -> String {
        format!("{stem}{ENDING}")
    }

    /// Returns whether a file has the name of a manifest.
    pub fn is_named(path: &Path) -> bool {
        path.file_name().is_some_and(|name| name.to_string_lossy().ends_with(ENDING))
    }

    /// Reads the manifest at `path`.
    ///
    /// # Errors
    /// A missing file, another kind of file, another major format, a wrong digest.
    pub fn read(path: &Path) -> Result<(Self, Seal), InputError> {
        sealed_json::read_sealed(path)
    }

    /// Writes the manifest in one step.
    ///
    /// # Errors
    /// An I/O error; an earlier manifest stays.
    pub fn write(&self, path: &Path) -> Result<(), RecordError> {
        sealed_json::write_sealed(path, self)
    }
}
