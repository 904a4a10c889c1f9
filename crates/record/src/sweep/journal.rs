//! Finished runs, one line each, appended by one process.
//!
//! A line is the CRC-32 of a JSON text in hexadecimal, a space, the text, a newline. The first line
//! records the version that wrote it. A line that a kill cut off has no newline, or, after a power failure, a wrong
//! checksum at the very end; it is deleted when the journal is opened to write, and its run is made again. A wrong
//! checksum elsewhere is damage, and an error; for readers one at the end, too, because they would miss a run.

use std::fs::{self, File, OpenOptions};
use std::io::{BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::RecordError;

use crate::format::{self, FormatVersion};
use crate::process_lock::{self, LockError, ProcessLock, holder_text};

/// Largest age of lines that a power failure may lose: their cells are run again. A kill loses
/// none.
const SYNC_INTERVAL: Duration = Duration::from_millis(200);

/// What a journal has to match: its runs may not go into the table of another sweep.
#[derive(Debug, Clone, Copy)]
pub struct SweepIdentity<'a> {
    /// Version of the program that makes its runs.
    pub program_version: &'a str,
    /// Fingerprint of its scenarios.
    pub fingerprint: &'a str,
}

/// The first line.
#[derive(Debug, Serialize, Deserialize)]
struct JournalHeader {
    format: FormatVersion,
    program_version: String,
    /// Fingerprint of the scenarios; early journals do not have it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    fingerprint: Option<String>,
}

/// A journal that this process writes; no other can write it while this value lives.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    /// Number of bytes of complete lines.
    length: u64,
    synced: Instant,
    /// None where the file system has no locks.
    lock: Option<ProcessLock>,
}

impl Journal {
    /// Opens or creates the journal at `path`, deletes an incomplete line at its end, and passes
    /// its entries on one by one.
    ///
    /// # Errors
    /// A journal that another process writes, that is damaged, or that another version wrote.
    pub fn open<T: DeserializeOwned>(
        path: &Path,
        of: SweepIdentity<'_>,
        each: impl FnMut(T),
    ) -> Result<Self, InputError> {
        // The lock comes first: nothing of a journal that another process writes is touched.
        let lock = lock(path)?;
        let file = OpenOptions::new().read(true).append(true).create(true).open(path);
        let file = file.map_err(|e| unwritable(path, &e))?;
        let length = read_complete_lines(path, of, Tail::Repaired, each)?;
        file.set_len(length).map_err(|e| unwritable(path, &e))?;
        let synced = Instant::now();
        let mut journal = Self { path: path.to_path_buf(), file, length, synced, lock };
        journal.file.seek(SeekFrom::End(0)).map_err(|e| unwritable(path, &e))?;
        if length == 0 {
            let header = JournalHeader {
                format: format::CURRENT,
                program_version: of.program_version.into(),
                fingerprint: Some(of.fingerprint.into()),
            };
            journal
                .append(&header)
                .and_then(|()| journal.sync())
                .map_err(|e| InputError::new(e.place, e.cause, "make space on the disk"))?;
        }
        Ok(journal)
    }

    /// Appends an entry. Once this returns, no kill of the process can lose it.
    ///
    /// # Errors
    /// An I/O error; the journal then has the entries before this one.
    pub fn append(&mut self, entry: &impl Serialize) -> Result<(), RecordError> {
        // The system lets a process write on to a file that was deleted with its folder.
        if self.lock.as_ref().is_some_and(|lock| !lock.is_at(&lock_path(&self.path))) {
            let cause =
                "the folder was deleted or moved while runs wrote to it: nothing more is written";
            return Err(RecordError::new(self.path.display(), cause));
        }
        let line = line(entry).map_err(|e| RecordError::new(self.path.display(), e))?;
        let written = self.file.write_all(line.as_bytes());
        if let Err(error) = written {
            // An incomplete line must not precede later ones.
            let _ = self.file.set_len(self.length);
            return Err(RecordError::new(self.path.display(), error));
        }
        self.length += line.len() as u64;
        if self.synced.elapsed() < SYNC_INTERVAL { Ok(()) } else { self.sync() }
    }

    /// Deletes the journal, once its entries are stored elsewhere.
    ///
    /// # Errors
    /// An I/O error; the journal may stay then.
    pub fn delete(self) -> Result<(), RecordError> {
        let Self { path, file, lock, .. } = self;
        // Some systems do not delete open files.
        drop(file);
        let deleted = fs::remove_file(&path);
        // Before the lock is released, so that it is not that of another process.
        let _ = fs::remove_file(lock_path(&path));
        drop(lock);
        deleted.map_err(|e| RecordError::new(path.display(), e))
    }

    /// Makes all entries durable against a power failure.
    ///
    /// # Errors
    /// An I/O error.
    pub fn sync(&mut self) -> Result<(), RecordError> {
        self.file.sync_data().map_err(|e| RecordError::new(self.path.display(), e))?;
        self.synced = Instant::now();
        Ok(())
    }
}

/// Returns whether a process writes the journal at `path`; none where the file system has no locks.
pub(super) fn is_locked(path: &Path) -> Option<bool> {
    process_lock::is_locked(&lock_path(path))
}

/// Returns the file that stands for the journal's lock: the journal itself is also opened to be read, and closing it
/// would release the lock.
fn lock_path(journal: &Path) -> PathBuf {
    journal.with_extension("lock")
}

/// Locks a journal against other writers; none where the file system has no locks.
fn lock(path: &Path) -> Result<Option<ProcessLock>, InputError> {
    let cause = match ProcessLock::acquire(&lock_path(path)) {
        Ok(lock) => return Ok(Some(lock)),
        Err(LockError::Held(holder)) => format!("{} is running this share", holder_text(holder)),
        // Some network file systems have no locks: there, the user's scheduler must prevent two
        // writers.
        Err(LockError::System(e)) if e.kind() == std::io::ErrorKind::Unsupported => {
            return Ok(None);
        }
        Err(LockError::System(e)) => return Err(unwritable(path, &e)),
    };
    let remedy = "wait for it, end it, or run another share";
    Err(InputError::new(path.display(), cause, remedy))
}

fn line(entry: &impl Serialize) -> serde_json::Result<String> {
    let json = serde_json::to_string(entry)?;
    Ok(format!("{:08x} {json}\n", crc32fast::hash(json.as_bytes())))
}

/// Passes on the entries of the journal at `path` up to the last complete line: a process may be
/// appending to it.
///
/// # Errors
/// A journal that cannot be read, is damaged, or was written by another version of the program.
pub fn read_journal<T: DeserializeOwned>(
    path: &Path,
    of: SweepIdentity<'_>,
    each: impl FnMut(T),
) -> Result<(), InputError> {
    read_complete_lines(path, of, Tail::Required, each).map(drop)
}

/// What becomes of a last line that is damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tail {
    /// It is cut off, and its run is made again.
    Repaired,
    /// It is an error unless it is merely cut off.
    Required,
}

/// Passes on the entries, and returns the number of bytes of complete lines.
fn read_complete_lines<T: DeserializeOwned>(
    path: &Path,
    of: SweepIdentity<'_>,
    tail: Tail,
    mut each: impl FnMut(T),
) -> Result<u64, InputError> {
    let file = File::open(path).map_err(|e| damaged(path, 1, e.to_string()))?;
    let mut reader = BufReader::new(file);
    let mut bytes = Vec::new();
    let mut length = 0;
    for number in 1.. {
        bytes.clear();
        let n = reader
            .read_until(b'\n', &mut bytes)
            .map_err(|e| damaged(path, number, e.to_string()))?;
        let Some(json) = json(&bytes) else {
            // A kill leaves an incomplete line at the end and nowhere else.
            let is_last = reader.fill_buf().is_ok_and(<[u8]>::is_empty);
            if is_last && tail == Tail::Required && is_changed_line(&bytes) {
                let remedy = "`sidestep resume DIR` makes the run of this line again";
                let cause = "the last line does not match its checksum";
                return Err(InputError::new(path.display(), cause, remedy).with_position(number, 1));
            }
            if is_last {
                break;
            }
            return Err(damaged(path, number, "the line does not match its checksum".into()));
        };
        if number == 1 {
            check_header(path, json, of)?;
        } else {
            let entry =
                serde_json::from_slice(json).map_err(|e| damaged(path, number, e.to_string()))?;
            each(entry);
        }
        length += n as u64;
    }
    Ok(length)
}

fn unwritable(path: &Path, error: &std::io::Error) -> InputError {
    let remedy = "make the folder writable, and see that the disk has space";
    InputError::new(path.display(), error.to_string(), remedy)
}

fn damaged(path: &Path, line: usize, cause: String) -> InputError {
    let remedy = "the file is damaged: delete it, and its runs are made again";
    InputError::new(path.display(), cause, remedy).with_position(line, 1)
}

/// Returns whether a line that is not as it was written was once whole: cut off, it would have no newline.
fn is_changed_line(line: &[u8]) -> bool {
    let Some((_, text)) = line.split_last() else { return false };
    line.ends_with(b"\n") || json(&[text, b"\n"].concat()).is_some()
}

/// Returns the text of a line if the line is complete.
fn json(line: &[u8]) -> Option<&[u8]> {
    let (checksum, json) = line.strip_suffix(b"\n")?.split_at_checked(9)?;
    let checksum = std::str::from_utf8(checksum).ok()?.strip_suffix(' ')?;
    let checksum = u32::from_str_radix(checksum, 16).ok()?;
    (crc32fast::hash(json) == checksum).then_some(json)
}

fn check_header(path: &Path, json: &[u8], of: SweepIdentity<'_>) -> Result<(), InputError> {
    let header: JournalHeader = serde_json::from_slice(json).map_err(|e| {
        InputError::new(path.display(), format!("this is no journal: {e}"), "delete it")
    })?;
    header.format.check_readable(path.display())?;
    if header.fingerprint.is_some_and(|fingerprint| fingerprint != of.fingerprint) {
        let remedy = "delete it, and its runs are made";
        return Err(InputError::new(path.display(), "its runs are of another sweep", remedy));
    }
    if header.program_version == of.program_version {
        return Ok(());
    }
    let cause = format!(
        "its runs are of sidestep {}, this is {}",
        header.program_version, of.program_version
    );
    let remedy =
        format!("continue with sidestep {}, or sweep into a new folder", header.program_version);
    Err(InputError::new(path.display(), cause, remedy))
}

#[cfg(test)]
mod tests {
    use super::*;

    const OF: SweepIdentity<'_> = SweepIdentity { program_version: "0.1.0", fingerprint: "f" };

    fn opened(path: &Path) -> (Journal, Vec<u32>) {
        let mut entries = Vec::new();
        let journal = Journal::open(path, OF, |n| entries.push(n)).unwrap();
        (journal, entries)
    }

    fn refused(path: &Path, of: SweepIdentity<'_>) -> InputError {
        Journal::open::<u32>(path, of, |_| ()).unwrap_err()
    }

    #[test]
    fn entries_survive_and_half_a_line_is_taken_away() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("j");
        let (mut journal, entries) = opened(&path);
        assert_eq!(entries, Vec::<u32>::new());
        (0..5u32).for_each(|n| journal.append(&n).unwrap());
        drop(journal);
        let whole = std::fs::read(&path).unwrap();
        // Killed at any byte: complete lines stay, the incomplete one is gone, and more can be
        // appended.
        for cut in 0..=whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let lines = whole[..cut].iter().filter(|b| **b == b'\n').count();
            let (mut journal, entries) = opened(&path);
            let kept: Vec<u32> = (0..lines.saturating_sub(1) as u32).collect();
            assert_eq!(entries, kept, "cut at {cut}");
            journal.append(&77u32).unwrap();
            drop(journal);
            let mut all: Vec<u32> = Vec::new();
            read_journal(&path, OF, |n| all.push(n)).unwrap();
            assert_eq!(all, [kept, vec![77]].concat(), "cut at {cut}");
        }
    }

    #[test]
    fn damage_in_the_middle_is_told_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("j");
        let (mut journal, _) = opened(&path);
        (0..5u32).for_each(|n| journal.append(&n).unwrap());
        drop(journal);
        let changed = std::fs::read_to_string(&path).unwrap().replace(" 1\n", " 7\n");
        std::fs::write(&path, changed).unwrap();
        let error = refused(&path, OF);
        assert_eq!(error.line_and_column(), Some((3, 1)), "{error}");
    }

    #[test]
    fn one_process_writes_and_one_version_of_one_sweep() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("j");
        let journal = opened(&path);
        let error = refused(&path, OF);
        assert!(error.cause().contains("this process itself is running"), "{error}");
        assert_eq!(is_locked(&path), Some(true));
        drop(journal);
        assert_eq!(is_locked(&path), Some(false), "also after a kill: the system takes locks away");
        let error = refused(&path, SweepIdentity { program_version: "0.2.0", ..OF });
        assert!(error.cause().contains("sidestep 0.1.0"), "{error}");
        let error = refused(&path, SweepIdentity { fingerprint: "g", ..OF });
        assert!(error.cause().contains("another sweep"), "{error}");
    }
}
