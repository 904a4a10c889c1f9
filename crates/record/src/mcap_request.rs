//! The MCAP file that was asked for beside a run folder: a killed run leaves it incomplete.

use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::disk;

/// An MCAP file that a run was to write, as its manifest has it. A reader only tells of it: it names a place outside of the
/// folder, and the folder may be somebody else's.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct McapRequest {
    /// Its path from the run folder, e.g. `../office.mcap`; absolute if it is in another branch of the file system.
    pub file: String,
    /// Number of cycles between its frames.
    pub every: u64,
}

impl McapRequest {
    /// Returns the request of a run in `folder`; both paths are absolute. None where the path is no Unicode text, which
    /// JSON cannot hold.
    pub fn new(folder: &Path, file: &Path, every: u64) -> Option<Self> {
        let beside = folder.parent().and_then(|parent| file.strip_prefix(parent).ok());
        let file = match (file.strip_prefix(folder), beside) {
            (Ok(inside), _) => inside.to_path_buf(),
            (_, Some(beside)) => Path::new("..").join(beside),
            _ => file.to_path_buf(),
        };
        let file = file.into_os_string().into_string().ok()?;
        Some(Self { file, every })
    }

    /// Returns the path of the file, by the path of the folder as a user has given it.
    pub fn path(&self, folder: &Path) -> PathBuf {
        let mut parts = Path::new(&self.file).components();
        let name = folder.file_name();
        // `runs/office.mcap` reads better than `runs/office/../office.mcap`.
        if parts.next() == Some(Component::ParentDir) && name.is_some() {
            let parent = folder.parent().unwrap_or(Path::new(""));
            return parent.join(parts.as_path());
        }
        folder.join(&self.file)
    }

    /// Returns the path of what a killed process has left of the file.
    pub fn partial_path(&self, folder: &Path) -> PathBuf {
        disk::partial_path(&self.path(folder))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_is_found_again_when_folder_and_file_are_moved_together() {
        for (file, stored, found) in [
            ("/runs/office.mcap", "../office.mcap", "there/office.mcap"),
            ("/runs/mcap/a.mcap", "../mcap/a.mcap", "there/mcap/a.mcap"),
            ("/runs/office/a.mcap", "a.mcap", "there/office/a.mcap"),
            ("/elsewhere/a.mcap", "/elsewhere/a.mcap", "/elsewhere/a.mcap"),
        ] {
            let request = McapRequest::new(Path::new("/runs/office"), Path::new(file), 20);
            let request = request.expect("text");
            assert_eq!(request.file, stored);
            assert_eq!(request.path(Path::new("there/office")), Path::new(found));
        }
        let beside = McapRequest { file: "../a.mcap".into(), every: 1 };
        assert_eq!(beside.path(Path::new("office")), Path::new("a.mcap"));
        assert_eq!(beside.path(Path::new(".")), Path::new("./../a.mcap"));
    }
}
