//! The list of the files of a report, an export, or a table of a sweep, in a file beside them.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::RecordError;

use crate::file_list::{DamagedFile, FileList};
use crate::format::{self, FormatVersion};
use crate::sealed_json::{self, Seal};

/// The end of the name of such a file.
const ENDING: &str = ".manifest.json";

/// The [kind](FileManifest::kind) of the files of a report.
pub const REPORT: &str = "report";
/// The [kind](FileManifest::kind) of the files of an export.
pub const EXPORT: &str = "export";

/// The content of `NAME.manifest.json`: files that were written together, by their paths beside it. `NAME` is that of a
/// report without its ending, that of an exported file with its ending, because a run has a picture `.svg` and one `.png`,
/// and `export` in the folder of an export.
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
    /// The files that these take the place of, and their digests: a process that is killed meanwhile leaves some of them.
    #[serde(default, skip_serializing_if = "FileList::is_empty")]
    pub replaced: FileList,
}

impl FileManifest {
    /// Returns a manifest without files.
    pub fn new(kind: &str, program_version: &str) -> Self {
        Self {
            format: format::CURRENT,
            program_version: program_version.into(),
            kind: kind.into(),
            files: FileList::default(),
            replaced: FileList::default(),
        }
    }

    /// Returns the path of the manifest of one file: `NAME.manifest.json` beside it.
    pub fn beside(path: &Path) -> PathBuf {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        path.with_file_name(Self::name_for(&name))
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

    /// Returns the files in a folder that are neither as they were written, nor as those that they take the place of.
    pub fn damaged_in(&self, folder: &Path) -> Vec<DamagedFile> {
        let is_replaced = |name: &str| {
            self.replaced.contains(name)
                && self.replaced.check_in(folder, |other| other == name).is_ok()
        };
        let damaged = self.files.damaged_entries(folder).into_iter();
        damaged.filter(|(name, _)| !is_replaced(name)).map(|(_, file)| file).collect()
    }

    /// Writes the manifest in one step.
    ///
    /// # Errors
    /// An I/O error; an earlier manifest stays.
    pub fn write(&self, path: &Path) -> Result<(), RecordError> {
        sealed_json::write_sealed(path, self)
    }
}
