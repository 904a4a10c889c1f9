//! What a killed process leaves beside a place that it was to fill: a folder with a hidden name.
//!
//! A file in such a folder, the marker, is locked by the process that fills the folder, and holds its id. The system
//! releases the lock however the process ends, and only one that is killed leaves its id: so a folder whose marker has an
//! id and no lock is a leftover. Anything else with such a name is somebody's own.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::disk::{self, MARKER};
use crate::process_lock::{ProcessLock, is_locked};
use crate::run_content::list_tree;

/// Most bytes of a marker: more than a process id is nothing that a lock has written.
const MAX_MARKER_BYTES: u64 = 20;

/// Removes the folders that killed processes left while they filled a folder at `target`; returns their paths.
pub(crate) fn remove_leftovers(target: &Path) -> Vec<PathBuf> {
    let Some(prefix) = hidden_prefix(target, "new") else { return Vec::new() };
    let entries = fs::read_dir(disk::parent(target)).into_iter().flatten().flatten();
    let named = entries.filter(|entry| {
        let name = entry.file_name();
        name.to_str().and_then(|name| name.strip_prefix(&prefix)).is_some_and(is_process_suffix)
    });
    let mut leftovers: Vec<PathBuf> = named.map(|entry| entry.path()).collect();
    leftovers.sort();
    leftovers.retain(|folder| remove_leftover(folder).is_some());
    leftovers
}

/// Returns whether a name ends as that of a hidden folder does: `PROCESS`, or `PROCESS-NUMBER`.
fn is_process_suffix(text: &str) -> bool {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let (process, number) = text.split_once('-').unwrap_or((text, "0"));
    is_number(process) && is_number(number)
}

/// Removes a folder if a killed process left it; `None` if it stays.
fn remove_leftover(folder: &Path) -> Option<()> {
    let marker = folder.join(MARKER);
    // The lock comes first: to read a marker that this process has locked would release it.
    if !is_folder(folder) || is_locked(&marker) != Some(false) || !names_process(&marker) {
        return None;
    }
    // Held until the end: of two processes that find the folder, one removes it.
    let lock = ProcessLock::acquire(&marker).ok()?;
    let files = list_tree(folder).ok()?;
    // The marker comes last, so that what is left of a removal that is killed is a leftover, too.
    remove_known(folder, files.iter().filter(|file| *file != Path::new(MARKER))).ok()?;
    fs::remove_file(&marker).ok()?;
    drop(lock);
    remove_empty(folder);
    (!folder.exists()).then_some(())
}

/// Returns whether there is a folder, and no link to one.
fn is_folder(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|found| found.is_dir())
}

/// Returns whether a marker holds the id of a process: one that ends in good order takes it back.
fn names_process(marker: &Path) -> bool {
    let is_short = fs::symlink_metadata(marker)
        .is_ok_and(|found| found.is_file() && (1..=MAX_MARKER_BYTES).contains(&found.len()));
    is_short && fs::read(marker).is_ok_and(|text| text.iter().all(u8::is_ascii_digit))
}

/// Returns how the hidden names of folders begin that take a place, or made room for one there; a process id follows.
pub(crate) fn hidden_prefix(target: &Path, role: &str) -> Option<String> {
    Some(format!(".{}.{role}-", target.file_name()?.display()))
}

/// Deletes the given files of a folder, and the folders that are empty then. A file that came meanwhile stays, and with it
/// its folder.
pub(crate) fn remove_known<'a>(
    folder: &Path,
    known: impl Iterator<Item = &'a PathBuf>,
) -> io::Result<()> {
    for path in known {
        let path = folder.join(path);
        let removed = if path.is_dir() && !path.is_symlink() {
            fs::remove_dir(&path)
        } else {
            fs::remove_file(&path)
        };
        match removed {
            Err(e) if e.kind() == io::ErrorKind::NotFound => {}
            other => other?,
        }
    }
    remove_empty(folder);
    Ok(())
}

/// Removes a folder if there is no file below it.
fn remove_empty(folder: &Path) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries.filter(|entry| entry.file_type().is_ok_and(|ty| ty.is_dir())) {
        remove_empty(&entry.path());
    }
    // Fails, as it should, if the folder is not empty.
    let _ = fs::remove_dir(folder);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Makes a folder with a marker, as a process leaves it that ends in some way.
    fn make(place: &Path, name: &str, marker: Option<&str>) -> PathBuf {
        let folder = place.join(name);
        fs::create_dir_all(folder.join("deep/er")).unwrap();
        fs::write(folder.join("deep/er/a.csv"), "a").unwrap();
        if let Some(text) = marker {
            fs::write(folder.join(MARKER), text).unwrap();
        }
        folder
    }

    #[test]
    fn a_folder_whose_marker_names_a_process_that_has_no_lock_is_removed_and_no_other() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str, marker| make(place.path(), name, marker);
        let left = [at(".x.new-17", Some("17")), at(".x.new-17-2", Some("18"))];
        let stay = [
            at(".x.new-1", None),
            at(".x.new-2", Some("")),
            at(".x.new-3", Some("mine")),
            at(".x.new-4", Some("123456789012345678901")),
            at(".x.new-", Some("5")),
            at(".x.new-6-", Some("6")),
            at(".x.new-mine", Some("7")),
            at(".x.old-8", Some("8")),
            at(".xy.new-9", Some("9")),
            at("x.new-10", Some("10")),
            at("x", Some("11")),
        ];
        assert_eq!(remove_leftovers(&place.path().join("x")), left);
        assert!(left.iter().all(|folder| !folder.exists()));
        for folder in stay {
            assert!(folder.join("deep/er/a.csv").is_file(), "{}", folder.display());
        }
        assert_eq!(remove_leftovers(&place.path().join("gone/x")), Vec::<PathBuf>::new());
        assert_eq!(remove_leftovers(Path::new("/")), Vec::<PathBuf>::new());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_a_folder_is_not_followed_and_a_link_in_one_is_removed_alone() {
        let place = tempfile::tempdir().unwrap();
        let other = make(place.path(), "other", Some("17"));
        std::os::unix::fs::symlink(&other, place.path().join(".x.new-17")).unwrap();
        let left = make(place.path(), ".x.new-18", Some("18"));
        std::os::unix::fs::symlink(&other, left.join("link")).unwrap();
        assert_eq!(remove_leftovers(&place.path().join("x")), [left]);
        assert!(other.join("deep/er/a.csv").is_file() && other.join(MARKER).is_file());
    }
}
