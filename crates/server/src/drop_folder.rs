//! Files that people drop on the page. A browser hands over their content, and not where they lie, so the server keeps
//! copies of them, in a folder of its own that ends with it. They may be read like files below the folders given at
//! start, and are never written.

use crate::protocol::Problem;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::{NamedTempFile, TempDir};
use tokio::sync::Semaphore;

/// Maximum size of one file, which is in memory until it is written.
pub(crate) const MAX_FILE_BYTES: usize = 256 << 20;
/// Maximum size of all copies of a server together.
pub(crate) const MAX_DROPPED_BYTES: u64 = 2 << 30;
/// Maximum length of a path in parts: folders of sweeps have folders of runs.
const MAX_PATH_PARTS: usize = 8;
/// Maximum length of a part in bytes, that of file systems.
const MAX_PART_BYTES: usize = 255;

/// The copies of one server.
#[derive(Debug)]
pub(crate) struct DropFolder {
    place: Mutex<DropPlace>,
    /// The turn of a file: one at a time is in memory.
    pub(crate) turn: Semaphore,
}

#[derive(Debug, Default)]
struct DropPlace {
    /// The folder, once there is something in it, with its path without links.
    folder: Option<(TempDir, PathBuf)>,
    bytes: u64,
}

impl Default for DropFolder {
    fn default() -> Self {
        Self { place: Mutex::default(), turn: Semaphore::new(1) }
    }
}

impl DropFolder {
    fn lock(&self) -> MutexGuard<'_, DropPlace> {
        // Every change is a single assignment, so it is consistent even if a thread has panicked while it held the lock.
        self.place.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns whether a path without links is that of a copy.
    pub(crate) fn contains(&self, real: &Path) -> bool {
        self.lock().folder.as_ref().is_some_and(|(_, folder)| real.starts_with(folder))
    }

    /// Returns the bytes of all copies.
    pub(crate) fn used_bytes(&self) -> u64 {
        self.lock().bytes
    }

    /// Keeps a copy of a file under a path of plain names, and returns where it is.
    ///
    /// # Errors
    /// When the path has other names, there are too many bytes, or it cannot be written.
    pub(crate) fn store(&self, path: &str, content: &[u8]) -> Result<PathBuf, Problem> {
        let below = plain_path(path).ok_or_else(|| {
            let remedy = "drop files with plain names, at most eight folders deep";
            Problem::new(path, "has a name that cannot be kept", remedy)
        })?;
        if let Some(same) = self.kept_already(&below, content) {
            return Ok(same);
        }
        let target = self.reserve(content.len() as u64, path)?.join(below);
        let folder = target.parent().unwrap_or(&target);
        let replaced_bytes = fs::metadata(&target).map_or(0, |about| about.len());
        if let Err(error) = write_whole(folder, &target, content) {
            self.lock().bytes -= content.len() as u64;
            let cause = format!("cannot be kept: {error}");
            let remedy = "make room on the disk, or start the studio with its folder";
            return Err(Problem::new(path, cause, remedy));
        }
        self.lock().bytes -= replaced_bytes;
        Ok(target)
    }

    /// Returns where a copy is that has the same path and content.
    fn kept_already(&self, below: &Path, content: &[u8]) -> Option<PathBuf> {
        let target = self.lock().folder.as_ref().map(|(_, folder)| folder.join(below))?;
        fs::read(&target).is_ok_and(|kept| kept == content).then_some(target)
    }

    /// Makes room for so many bytes, and returns the folder.
    fn reserve(&self, bytes: u64, path: &str) -> Result<PathBuf, Problem> {
        let mut place = self.lock();
        if place.bytes + bytes > MAX_DROPPED_BYTES {
            let limit_gib = MAX_DROPPED_BYTES >> 30;
            let cause = format!("the studio keeps at most {limit_gib} GiB of dropped files");
            let remedy = "start the studio with the folder instead: `sidestep studio FOLDER`";
            return Err(Problem::new(path, cause, remedy));
        }
        place.bytes += bytes;
        if let Some((_, real)) = &place.folder {
            return Ok(real.clone());
        }
        let made = TempDir::with_prefix("sidestep-studio-");
        let made = made.and_then(|folder| Ok((folder.path().canonicalize()?, folder)));
        let (real, folder) = made.map_err(|error| {
            let cause = format!("no folder can be made for dropped files: {error}");
            Problem::new(path, cause, "set TMPDIR to a folder where you may write")
        })?;
        place.folder = Some((folder, real.clone()));
        Ok(real)
    }
}

/// Writes a file under another name first: nobody reads a part of it.
fn write_whole(folder: &Path, target: &Path, content: &[u8]) -> std::io::Result<()> {
    fs::create_dir_all(folder)?;
    let mut file = NamedTempFile::new_in(folder)?;
    file.write_all(content)?;
    file.persist(target).map_err(|error| error.error)?;
    Ok(())
}

/// Returns a path of plain names as one of this system; `None` if it has others.
fn plain_path(text: &str) -> Option<PathBuf> {
    let is_plain = |part: &str| {
        let has_separator = part.contains(['\\', ':', '\0']);
        !part.is_empty() && part.len() <= MAX_PART_BYTES && !part.starts_with('.') && !has_separator
    };
    let parts: Vec<&str> = text.split('/').collect();
    let is_path = parts.len() <= MAX_PATH_PARTS && parts.iter().all(|part| is_plain(part));
    is_path.then(|| parts.iter().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_is_in_a_folder_of_its_own_that_ends_with_the_server() {
        let drops = DropFolder::default();
        assert!(!drops.contains(Path::new("/")), "there is no folder before the first copy");
        let path = drops.store("a1/run/run.json", b"{}").expect("kept");
        assert_eq!(fs::read(&path).expect("there"), b"{}");
        assert!(drops.contains(&path) && drops.used_bytes() == 2);
        assert!(path.ends_with("a1/run/run.json"));
        drop(drops);
        assert!(!path.exists());
    }

    #[test]
    fn a_name_that_leads_elsewhere_is_refused() {
        let drops = DropFolder::default();
        for name in ["../x", "a/../x", "/etc/x", "", "a//b", ".x", "a/.x", "a\\b", "c:x", "a/b/"] {
            assert!(drops.store(name, b"x").is_err(), "{name}");
        }
        assert!(drops.store(&["a"; MAX_PATH_PARTS + 1].join("/"), b"x").is_err());
        assert_eq!(drops.used_bytes(), 0);
    }

    #[test]
    fn a_copy_that_is_replaced_or_cannot_be_written_takes_no_room_any_more() {
        let drops = DropFolder::default();
        drops.store("a/x.toml", b"12345").expect("kept");
        drops.store("a/x.toml", b"123").expect("kept");
        assert_eq!(drops.used_bytes(), 3);
        // There is a file where a folder would have to be.
        assert!(drops.store("a/x.toml/y", b"12345678").is_err());
        assert_eq!(drops.used_bytes(), 3);
    }

    #[test]
    fn copies_have_a_bound_and_a_refused_one_takes_no_room() {
        let drops = DropFolder::default();
        drops.lock().bytes = MAX_DROPPED_BYTES - 3;
        let problem = drops.store("x.toml", b"1234").expect_err("too much");
        assert!(problem.remedy.contains("sidestep studio"), "{problem:?}");
        assert!(drops.store("x.toml", b"123").is_ok());
    }
}
