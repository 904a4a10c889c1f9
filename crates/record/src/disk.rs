//! Files that are written completely or not at all, even after a power failure.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use sidestep_kernel::ports::RecordError;

/// The name of a file by which a folder that is being filled is known; the process that fills it has it locked. It is
/// hidden, so that no file of a scenario or an export has it.
pub(crate) const MARKER: &str = ".sidestep-unfinished";

/// Returns the name of a file or folder while it is incomplete: `NAME.partial`.
pub(crate) fn partial_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".partial");
    name.into()
}

/// Replaces the file at `path` by `bytes`: afterwards it holds the old or the new content,
/// never a mixture. One writer at a time.
///
/// # Errors
/// An I/O error; the old content stays.
pub(crate) fn replace(path: &Path, bytes: &[u8]) -> Result<(), RecordError> {
    let partial = partial_path(path);
    let written = write_through(&partial, bytes);
    written.map_err(|e| {
        // On a full disk the half-written copy must not keep its space.
        let _ = fs::remove_file(&partial);
        RecordError::new(path.display(), e)
    })?;
    rename(&partial, path)
}

/// Makes a file of these bytes, and waits for the disk.
pub(crate) fn write_through(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Writes a file into a folder that has no name yet: one call of [`sync_below`] makes all of them
/// durable, which is some thousand times faster than one each.
///
/// # Errors
/// An I/O error.
pub(crate) fn write_new(path: &Path, bytes: &[u8]) -> Result<(), RecordError> {
    fs::write(path, bytes).map_err(|e| RecordError::new(path.display(), e))
}

/// Makes all files of a folder and of those in it durable.
///
/// # Errors
/// An I/O error.
pub(crate) fn sync_below(folder: &Path) -> Result<(), RecordError> {
    sync_tree(folder).map_err(|e| RecordError::new(folder.display(), e))
}

/// Syncs the folder's file system at once.
#[cfg(target_os = "linux")]
fn sync_tree(folder: &Path) -> io::Result<()> {
    Ok(rustix::fs::syncfs(File::open(folder)?)?)
}

/// Syncs file by file: other systems have no call for all.
#[cfg(not(target_os = "linux"))]
fn sync_tree(folder: &Path) -> io::Result<()> {
    use std::ffi::OsStr;
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            sync_tree(&path)?;
        } else if path.file_name() != Some(OsStr::new(MARKER)) {
            // To close the marker would release its lock.
            // Open for writing, because Windows flushes only such files.
            File::options().write(true).open(&path)?.sync_all()?;
        }
    }
    sync_folder(folder)
}

/// Renames `from` to `to` in the same folder, and makes the new name durable.
pub(crate) fn rename(from: &Path, to: &Path) -> Result<(), RecordError> {
    fs::rename(from, to)
        .and_then(|()| sync_folder(parent(to)))
        .map_err(|e| RecordError::new(to.display(), e))
}

/// Returns the paths of the files and folders in a folder, in no particular order.
pub(crate) fn list(folder: &Path) -> Result<Vec<PathBuf>, RecordError> {
    let entries = fs::read_dir(folder).and_then(|entries| {
        entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>()
    });
    entries.map_err(|e| RecordError::new(folder.display(), e))
}

/// The folder that holds `path`: of a bare name the current one, for which the standard library has an empty path.
pub(crate) fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Returns the folders that have to be made for a folder, and itself, the outermost first.
pub fn missing_folders(folder: &Path) -> Vec<PathBuf> {
    let ancestors = folder.ancestors().take_while(|p| !p.as_os_str().is_empty() && !p.exists());
    let mut missing: Vec<_> = ancestors.map(Path::to_path_buf).collect();
    missing.reverse();
    missing
}

/// Removes folders that were made in vain, the outermost of which is first; one with something in it stays.
pub fn remove_folders(made: &[PathBuf]) {
    for folder in made.iter().rev() {
        // Fails, as it should, if the folder is not empty.
        let _ = fs::remove_dir(folder);
    }
}

/// Makes the names in a folder durable, if the system can.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

/// Does nothing: other systems do not open folders, and the rename itself is atomic there too.
#[cfg(not(unix))]
fn sync_folder(_folder: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replacing_leaves_the_new_content_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        replace(&path, b"old").unwrap();
        replace(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_was_put_into_folders_is_there_after_one_sync() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("a");
        fs::create_dir(&inner).unwrap();
        write_new(&inner.join("b"), b"text").unwrap();
        sync_below(folder.path()).unwrap();
        assert_eq!(fs::read(inner.join("b")).unwrap(), b"text");
        assert!(sync_below(&folder.path().join("gone")).is_err());
        assert!(
            write_new(&folder.path().join("gone/b"), b"").unwrap_err().to_string().contains("gone")
        );
    }

    #[test]
    fn a_failed_replacement_names_the_file_and_keeps_the_old_content() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        replace(&path, b"old").unwrap();
        fs::create_dir(partial_path(&path)).unwrap();
        let error = replace(&path, b"new").unwrap_err();
        assert!(error.to_string().contains("a.bin"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
    }
}
