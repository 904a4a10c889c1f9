//! Locks that belong to one process alone, whatever processes it forks.
//!
//! A lock of an open file (`flock`) is shared with forked children: a pool of workers, as Python forks them, would hold
//! the lock of its driver for as long as any worker lives, also after the driver was killed. So on Unix these are record
//! locks (`fcntl`), which a child does not inherit. They have two traps. A process never waits for itself: a list of
//! the locks of this process refuses the second one. And they end when the process closes *any* handle of the file:
//! the locked file is one that nothing else opens.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Number of further tries to lock a file that is locked: [`is_locked`] holds a shared lock for a moment,
const MAX_RETRIES: usize = 5;
/// and the time between two.
const RETRY_DELAY: Duration = Duration::from_millis(10);

/// The locks of this process: of each the file's identity, and the process, because a forked child has a copy of the list
/// and none of the locks.
static HELD: Mutex<Vec<(FileId, u32)>> = Mutex::new(Vec::new());

/// A file on this machine, whatever its name: device and number on Unix, elsewhere its full path.
#[derive(Debug, Clone, PartialEq, Eq)]
struct FileId(u64, u64, PathBuf);

/// A lock that this process holds; the system releases it when the process ends in any way.
#[derive(Debug)]
pub(crate) struct ProcessLock {
    file: File,
    id: FileId,
    process: u32,
}

/// The reason why a lock was not taken.
#[derive(Debug)]
pub(crate) enum LockError {
    /// The process with this id holds it, if that is known.
    Held(Option<u32>),
    /// The file cannot be opened, or its file system cannot lock.
    System(io::Error),
}

impl ProcessLock {
    /// Locks the file at `path`, which is created if it is missing, and holds the id of this process meanwhile.
    ///
    /// # Errors
    /// When another process holds the lock, or this one does already; an I/O error.
    pub(crate) fn acquire(path: &Path) -> Result<Self, LockError> {
        let mut held = held();
        if is_held_here(&held, path) {
            return Err(LockError::Held(Some(std::process::id())));
        }
        let mut options = OpenOptions::new();
        let file = options.create(true).read(true).write(true).truncate(false).open(path);
        let mut file = file.map_err(LockError::System)?;
        if !try_lock(&file).map_err(LockError::System)? {
            return Err(LockError::Held(read_holder(&mut file)));
        }
        let id = file_id(path).map_err(LockError::System)?;
        let process = std::process::id();
        held.push((id.clone(), process));
        let mut lock = Self { file, id, process };
        // Only the message of another process needs it.
        let _ = lock.write_holder();
        Ok(lock)
    }

    /// Returns whether the locked file is still at a path: its folder may be gone, or another one be in its place.
    pub(crate) fn is_at(&self, path: &Path) -> bool {
        file_id(path).is_ok_and(|id| id == self.id)
    }

    fn write_holder(&mut self) -> io::Result<()> {
        self.file.set_len(0)?;
        self.file.write_all(self.process.to_string().as_bytes())
    }
}

impl Drop for ProcessLock {
    fn drop(&mut self) {
        // The copy of a forked child holds nothing.
        if self.process == std::process::id() {
            let _ = self.file.set_len(0);
            held().retain(|held| *held != (self.id.clone(), self.process));
        }
    }
}

/// Returns whether a process holds the lock of the file at `path`; none where the file system has no locks.
pub(crate) fn is_locked(path: &Path) -> Option<bool> {
    let held = held();
    if is_held_here(&held, path) {
        return Some(true);
    }
    match File::open(path) {
        Err(_) => Some(false),
        Ok(file) => try_lock_shared(&file).ok().map(|is_free| !is_free),
    }
}

fn held() -> MutexGuard<'static, Vec<(FileId, u32)>> {
    HELD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns whether this process holds the lock of a file. The file is not opened: closing it would release the lock.
fn is_held_here(held: &[(FileId, u32)], path: &Path) -> bool {
    let Ok(id) = file_id(path) else { return false };
    held.contains(&(id, std::process::id()))
}

/// Returns the id of the process that has locked a file.
fn read_holder(file: &mut File) -> Option<u32> {
    let mut text = String::new();
    file.rewind().ok()?;
    // More than an id is nothing that a lock has written.
    file.take(20).read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

/// Returns whether the lock was free, and is taken now.
fn try_lock(file: &File) -> io::Result<bool> {
    for _ in 0..MAX_RETRIES {
        if try_lock_once(file)? {
            return Ok(true);
        }
        std::thread::sleep(RETRY_DELAY);
    }
    try_lock_once(file)
}

#[cfg(unix)]
fn file_id(path: &Path) -> io::Result<FileId> {
    use std::os::unix::fs::MetadataExt;
    let metadata = fs::metadata(path)?;
    Ok(FileId(metadata.dev(), metadata.ino(), PathBuf::new()))
}

#[cfg(not(unix))]
fn file_id(path: &Path) -> io::Result<FileId> {
    Ok(FileId(0, 0, fs::canonicalize(path)?))
}

#[cfg(unix)]
fn try_lock_once(file: &File) -> io::Result<bool> {
    record_lock(file, rustix::fs::FlockOperation::NonBlockingLockExclusive)
}

#[cfg(unix)]
fn try_lock_shared(file: &File) -> io::Result<bool> {
    record_lock(file, rustix::fs::FlockOperation::NonBlockingLockShared)
}

#[cfg(unix)]
fn record_lock(file: &File, operation: rustix::fs::FlockOperation) -> io::Result<bool> {
    use rustix::io::Errno;
    match rustix::fs::fcntl_lock(file, operation) {
        Ok(()) => Ok(true),
        Err(Errno::AGAIN | Errno::ACCESS) => Ok(false),
        // A network file system whose server of locks is off.
        Err(Errno::NOLCK) => Err(io::ErrorKind::Unsupported.into()),
        Err(error) => Err(error.into()),
    }
}

#[cfg(not(unix))]
fn try_lock_once(file: &File) -> io::Result<bool> {
    free_or_error(file.try_lock())
}

#[cfg(not(unix))]
fn try_lock_shared(file: &File) -> io::Result<bool> {
    free_or_error(file.try_lock_shared())
}

#[cfg(not(unix))]
fn free_or_error(locked: Result<(), fs::TryLockError>) -> io::Result<bool> {
    match locked {
        Ok(()) => Ok(true),
        Err(fs::TryLockError::WouldBlock) => Ok(false),
        Err(fs::TryLockError::Error(error)) => Err(error),
    }
}

/// Returns the words for the holder of a lock, e.g. `another process (12345)`.
pub(crate) fn holder_text(holder: Option<u32>) -> String {
    match holder {
        Some(process) if process == std::process::id() => "this process itself".to_string(),
        Some(process) => format!("another process ({process})"),
        None => "another process".to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_is_taken_once_named_by_its_holder_and_free_afterwards() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.lock");
        assert_eq!(is_locked(&path), Some(false), "there is no file");
        let lock = ProcessLock::acquire(&path).unwrap();
        assert_eq!(is_locked(&path), Some(true));
        assert_eq!(fs::read_to_string(&path).unwrap(), std::process::id().to_string());
        let second = ProcessLock::acquire(&path).unwrap_err();
        let LockError::Held(Some(holder)) = second else { panic!("{second:?}") };
        assert_eq!(holder_text(Some(holder)), "this process itself");
        drop(lock);
        assert_eq!((is_locked(&path), fs::read(&path).unwrap().len()), (Some(false), 0));
        assert!(ProcessLock::acquire(&path).is_ok());
    }

    #[test]
    fn looking_at_a_lock_of_this_process_does_not_release_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.lock");
        let lock = ProcessLock::acquire(&path).unwrap();
        assert_eq!([is_locked(&path), is_locked(&path)], [Some(true), Some(true)]);
        // Another process asks: it sees the system's lock, not the list of this one.
        #[cfg(target_os = "linux")]
        {
            use std::os::unix::fs::MetadataExt;
            let number = format!(":{} ", fs::metadata(&path).unwrap().ino());
            let locks = fs::read_to_string("/proc/locks").unwrap_or_default();
            assert!(locks.is_empty() || locks.contains(&number), "{locks}");
        }
        drop(lock);
    }

    #[test]
    fn a_file_that_cannot_be_opened_is_an_error_of_the_system() {
        let folder = tempfile::tempdir().unwrap();
        let error = ProcessLock::acquire(&folder.path().join("gone/a.lock")).unwrap_err();
        assert!(matches!(error, LockError::System(_)), "{error:?}");
    }
}
