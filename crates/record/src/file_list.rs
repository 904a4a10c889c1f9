//! The files of a folder, by their paths in it, each with the digest of its bytes.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_kernel::digest::Hasher;

use crate::disk;
use crate::sealed_json::FileDigest;

/// The bytes that are read at a time while a file is hashed.
const READ_BYTES: usize = 1 << 18;

/// Files by their paths in a folder, with `/` between parts. A part of a table has the path that it has once the table is
/// complete, without `.partial`.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct FileList(BTreeMap<String, FileDigest>);

/// What is wrong with a file of a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FileFault {
    /// Its bytes are not those that were written.
    Changed,
    /// It is not there.
    Missing,
    /// The system cannot read it.
    Unreadable(String),
    /// Its list has a name that leads out of the folder.
    Outside,
    /// Its content is wrong in these words.
    Damaged(String),
}

/// A file that is not as it was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DamagedFile {
    /// Its path.
    pub path: PathBuf,
    /// What is wrong.
    pub fault: FileFault,
}

impl DamagedFile {
    /// Returns the words for the fault.
    pub fn cause(&self) -> String {
        match &self.fault {
            FileFault::Changed => {
                "the file does not match its digest: it is damaged, or was edited".into()
            }
            FileFault::Missing => "the file is missing".into(),
            FileFault::Unreadable(cause) => format!("the file cannot be read: {cause}"),
            FileFault::Damaged(cause) => cause.clone(),
            FileFault::Outside => "the manifest names a file outside of its folder".into(),
        }
    }

    /// Returns the file with the cause of an error of its reader.
    pub(crate) fn from_error(path: PathBuf, error: &InputError) -> Self {
        Self { path, fault: FileFault::Damaged(error.cause().to_string()) }
    }

    /// Returns the error of a reader that needs the file.
    pub(crate) fn to_error(&self) -> InputError {
        let remedy = "restore it, or run the scenario again in a new folder; `sidestep verify DIR` names every damaged file";
        InputError::new(self.path.display(), self.cause(), remedy)
    }
}

impl FileList {
    /// Returns whether it names no file.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The paths and digests, sorted by path.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &FileDigest)> {
        self.0.iter().map(|(name, digest)| (name.as_str(), digest))
    }

    /// Returns whether the list has the path.
    pub fn contains(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }

    /// Adds a file, or replaces its digest.
    pub fn insert(&mut self, name: impl Into<String>, digest: FileDigest) {
        self.0.insert(name.into(), digest);
    }

    /// Removes the files that `is_kept` does not keep.
    pub fn retain(&mut self, mut is_kept: impl FnMut(&str) -> bool) {
        self.0.retain(|name, _| is_kept(name));
    }

    /// Adds a file of the folder by its present bytes; without effect if there is no such file.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn insert_file(&mut self, folder: &Path, name: &str) -> io::Result<()> {
        match hash_file(&folder.join(name)) {
            Ok(digest) => self.insert(name, digest),
            Err(e) if e.kind() == io::ErrorKind::NotFound => {}
            Err(e) => return Err(e),
        }
        Ok(())
    }

    /// Returns the files that are not as they were written; only those whose path `is_wanted` wants.
    pub fn damaged_in(&self, folder: &Path, is_wanted: impl Fn(&str) -> bool) -> Vec<DamagedFile> {
        let mut damaged = Vec::new();
        for (name, digest) in self.iter().filter(|(name, _)| is_wanted(name)) {
            damaged.extend(check_file(folder, name, digest));
        }
        damaged
    }

    /// Returns the files that are not as they were written, with their paths in the list.
    pub(crate) fn damaged_entries(&self, folder: &Path) -> Vec<(&str, DamagedFile)> {
        let checked = self.iter().map(|(name, digest)| (name, check_file(folder, name, digest)));
        checked.filter_map(|(name, fault)| Some((name, fault?))).collect()
    }

    /// Returns the digest of a file.
    pub fn get(&self, name: &str) -> Option<&FileDigest> {
        self.0.get(name)
    }

    /// Checks all files whose path `is_wanted` wants.
    ///
    /// # Errors
    /// The first one that is not as it was written.
    pub fn check_in(
        &self,
        folder: &Path,
        is_wanted: impl Fn(&str) -> bool,
    ) -> Result<(), InputError> {
        let wanted = self.iter().filter(|(name, _)| is_wanted(name));
        let mut damaged = wanted.filter_map(|(name, digest)| check_file(folder, name, digest));
        damaged.next().map_or(Ok(()), |file| Err(file.to_error()))
    }
}

/// Returns what is wrong with a file; `None` if it is as it was written.
fn check_file(folder: &Path, name: &str, digest: &FileDigest) -> Option<DamagedFile> {
    let mut path = locate(folder, name);
    let mut fault = file_fault(&path, name, digest);
    if fault == Some(FileFault::Missing) {
        // The folder of a table is renamed once the table is complete, perhaps just now.
        path = locate(folder, name);
        fault = file_fault(&path, name, digest);
    }
    Some(DamagedFile { path, fault: fault? })
}

fn file_fault(path: &Path, name: &str, digest: &FileDigest) -> Option<FileFault> {
    if !is_inside(name) {
        return Some(FileFault::Outside);
    }
    match hash_file(path) {
        Ok(present) if present == *digest => None,
        Ok(_) => Some(FileFault::Changed),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Some(FileFault::Missing),
        Err(e) => Some(FileFault::Unreadable(e.to_string())),
    }
}

/// Returns whether a path stays in its folder.
fn is_inside(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    !name.is_empty() && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// Returns the present place of a listed file: a table that is incomplete is in `TABLE.partial`.
pub(crate) fn locate(folder: &Path, name: &str) -> PathBuf {
    let path = folder.join(name);
    if let Some((table, part)) = name.split_once('/')
        && !path.exists()
    {
        let partial = disk::partial_path(&folder.join(table)).join(part);
        if partial.exists() {
            return partial;
        }
    }
    path
}

/// Returns the digest of the bytes of a file.
///
/// # Errors
/// When it cannot be read.
pub fn hash_file(path: &Path) -> io::Result<FileDigest> {
    let mut file = File::open(path)?;
    let mut hasher = Hasher::default();
    let mut bytes = vec![0; READ_BYTES];
    loop {
        match file.read(&mut bytes) {
            Ok(0) => return Ok(hasher.finish().into()),
            Ok(n) => hasher.write_bytes(&bytes[..n]),
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
}

/// The list of a folder whose files are written in several places.
#[derive(Debug, Clone, Default)]
pub(crate) struct SharedFileList(Arc<Mutex<FileList>>);

impl SharedFileList {
    pub(crate) fn new(files: FileList) -> Self {
        Self(Arc::new(Mutex::new(files)))
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, FileList> {
        // Every change is a single call, so a panic elsewhere leaves a list that is right.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A file whose bytes are hashed while they are written.
pub(crate) struct HashedFile {
    pub(crate) file: File,
    hasher: Hasher,
}

impl HashedFile {
    pub(crate) fn new(file: File) -> Self {
        Self { file, hasher: Hasher::default() }
    }

    /// Waits for the disk, and returns the digest of all bytes.
    pub(crate) fn close(self) -> io::Result<FileDigest> {
        self.file.sync_all()?;
        Ok(self.hasher.finish().into())
    }
}

impl Write for HashedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.file.write(bytes)?;
        self.hasher.write_bytes(&bytes[..n]);
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_changed_missing_or_outside_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let mut files = FileList::default();
        std::fs::create_dir(folder.path().join("t.partial")).unwrap();
        for name in ["a", "b", "t.partial/c"] {
            std::fs::write(folder.path().join(name), name).unwrap();
        }
        for name in ["a", "b", "absent"] {
            files.insert_file(folder.path(), name).unwrap();
        }
        files.insert("t/c", FileDigest::of_bytes(b"t.partial/c"));
        assert_eq!(files.damaged_in(folder.path(), |_| true), []);
        assert!(!files.contains("absent"));
        std::fs::write(folder.path().join("a"), "A").unwrap();
        std::fs::remove_file(folder.path().join("b")).unwrap();
        files.insert("../x", FileDigest::of_bytes(b""));
        let faults = files.damaged_in(folder.path(), |_| true);
        let faults: Vec<_> = faults.into_iter().map(|file| file.fault).collect();
        assert_eq!(faults, [FileFault::Outside, FileFault::Changed, FileFault::Missing]);
        assert!(files.check_in(folder.path(), |name| name == "t/c").is_ok());
        let error = files.check_in(folder.path(), |name| name == "b").unwrap_err();
        assert!(error.place().ends_with('b') && error.cause().contains("missing"), "{error}");
    }
}
