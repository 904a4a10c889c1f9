//! A folder that is filled under a temporary name and then moved to its place in one step.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use sidestep_kernel::InputError;
use sidestep_kernel::ports::RecordError;

use crate::create_error::{CREATE_REMEDY, CreateError, PathError};
use crate::disk::{self, MARKER};
use crate::leftovers::{hidden_prefix, remove_known, remove_leftovers};
use crate::process_lock::ProcessLock;
use crate::replacement::Replacement;
use crate::run_content::list_tree;

/// A folder with a temporary name. If it is dropped, it and the parents created for it are deleted.
pub(crate) struct StagingFolder {
    path: PathBuf,
    /// The place as it was given, which errors name.
    given: PathBuf,
    /// The place that it takes: of a link, the folder that it leads to.
    target: PathBuf,
    /// Parents created for the folder, the outermost first.
    made: Vec<PathBuf>,
    /// The lock of the marker; `None` once the folder is whole, and where the file system has no locks.
    lock: Option<ProcessLock>,
    /// Folders that killed processes left beside it, and that are removed now.
    leftovers: Vec<PathBuf>,
}

impl StagingFolder {
    /// Creates an empty folder in the parent of `target`, and that parent if it is missing. What killed processes left
    /// there of the same target is removed.
    pub(crate) fn new(target: &Path) -> Result<Self, CreateError> {
        let given = target.to_path_buf();
        let target = resolve_link(target).map_err(|e| CreateError::from_io(&given, &e))?;
        let leftovers = remove_leftovers(&target);
        let path = hidden_sibling(&target, "new")?;
        let made = disk::missing_folders(disk::parent(&target));
        let mut staging = Self { path, given, target, made, lock: None, leftovers };
        staging.make().map_err(|e| CreateError::from_io(&staging.given, &e))?;
        Ok(staging)
    }

    fn make(&mut self) -> io::Result<()> {
        fs::create_dir_all(disk::parent(&self.path))?;
        fs::create_dir(&self.path)?;
        let marker = self.path.join(MARKER);
        self.lock = ProcessLock::acquire(&marker).ok();
        if self.lock.is_none() {
            // Without a lock, nothing proves to others that this process is gone: they let the folder be.
            let _ = fs::remove_file(&marker);
        }
        Ok(())
    }

    /// Ends the proof that this process fills the folder: from now on no other process removes it.
    fn remove_marker(&mut self) {
        if self.lock.take().is_some() {
            let _ = fs::remove_file(self.path.join(MARKER));
        }
    }

    /// Returns the folders that killed processes left beside it, and that are removed now.
    pub(crate) fn leftovers(&self) -> &[PathBuf] {
        &self.leftovers
    }

    /// Does work that fills the folder, at its temporary name. An error names the place as it was given.
    pub(crate) fn fill<T, E: PathError>(
        &self,
        work: impl FnOnce(&Path) -> Result<T, E>,
    ) -> Result<T, E> {
        let filled = work(&self.path);
        // First, because what was deleted is the reason why the work fails, if it does.
        self.check_in_place()?;
        filled.map_err(|e| e.with_path(&self.path, &self.given))
    }

    /// Checks that the folder is still there with what was written first: others may have been removing it just now.
    fn check_in_place(&self) -> Result<(), RecordError> {
        let is_gone = |lock: &ProcessLock| !lock.is_at(&self.path.join(MARKER));
        if self.lock.as_ref().is_some_and(is_gone) {
            let cause = "what was written so far was deleted or moved meanwhile: nothing is stored";
            return Err(RecordError::new(self.given.display(), cause));
        }
        Ok(())
    }

    /// Moves the folder to its place. What is there is replaced: files that `old` calls own are deleted, all others are in
    /// the new folder afterwards.
    pub(crate) fn commit(mut self, old: &Replacement) -> Result<(), CreateError> {
        self.remove_marker();
        let target = &self.target;
        let failed = |e: io::Error| CreateError::from_io(&self.given, &e);
        old.check_room_in(&self.path, target)?;
        // The old folder is kept beside the new one until that is in place: a failure leaves one of them whole.
        let aside = hidden_sibling(target, "old")?;
        let replaces = target.exists();
        let mut later = Vec::new();
        for path in &old.others {
            // With a second name in the new folder, a file of others has its place there even if this process is killed.
            if link(&target.join(path), &self.path.join(path)).is_err() {
                later.push(path);
            }
        }
        if replaces {
            fs::rename(target, &aside).map_err(failed)?;
        }
        if let Err(e) = disk::rename(&self.path, target) {
            if replaces {
                let _ = fs::rename(&aside, target);
            }
            return Err(RecordError::new(self.given.display(), e.cause).into());
        }
        self.made.clear();
        for path in &later {
            move_file(&aside.join(path), &target.join(path)).map_err(failed)?;
        }
        if replaces {
            let linked = old.others.iter().filter(|path| !later.contains(path));
            remove_known(&aside, old.own.iter().chain(linked)).map_err(failed)?;
        }
        Ok(())
    }
}

/// Gives a file a second name, or makes a folder that is empty.
fn link(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir_all(disk::parent(to))?;
    if from.is_dir() && !from.is_symlink() {
        return fs::create_dir_all(to);
    }
    fs::hard_link(from, to)
}

/// Moves a file of others to the new folder; for file systems where a file has only one name.
fn move_file(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir_all(disk::parent(to))?;
    fs::rename(from, to)
}

impl Drop for StagingFolder {
    fn drop(&mut self) {
        self.remove_marker();
        // Everything in it was written or linked by this process.
        let all = list_tree(&self.path).unwrap_or_default();
        let _ = remove_known(&self.path, all.iter());
        for parent in self.made.iter().rev() {
            // Fails, as it should, if the folder is not empty.
            let _ = fs::remove_dir(parent);
        }
    }
}

/// Returns the place of a folder that is to be made, without `/` at its end: of a link, the folder that it leads to.
/// A rename would replace the link itself, and write to another disk than the one that the user has chosen.
///
/// # Errors
/// A link to a missing folder.
pub fn resolve_link(target: &Path) -> io::Result<PathBuf> {
    // With a `/` at its end, a link is not known as one, and a name beside the folder would be one inside.
    let target: PathBuf = target.components().collect();
    if !target.is_symlink() {
        return Ok(target);
    }
    target
        .canonicalize()
        .map_err(|e| io::Error::new(e.kind(), format!("a link to what is not there ({e})")))
}

/// Returns a hidden name in the same folder that nothing has.
fn hidden_sibling(target: &Path, role: &str) -> Result<PathBuf, InputError> {
    let cannot_create = |target: &Path, cause: &str| {
        let cause = format!("cannot make the folder: {cause}");
        InputError::new(target.display(), cause, CREATE_REMEDY)
    };
    let prefix =
        hidden_prefix(target, role).ok_or_else(|| cannot_create(target, "it has no name"))?;
    let name = format!("{prefix}{}", std::process::id());
    let folder = disk::parent(target);
    let names = (0..).map(|k| if k == 0 { name.clone() } else { format!("{name}-{k}") });
    let mut paths = names.map(|name| folder.join(name));
    let free = paths.find(|path| path.symlink_metadata().is_err());
    free.ok_or_else(|| cannot_create(target, "no name is free beside it"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_this_process_fills_stays_and_keeps_its_lock() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("x");
        let first = StagingFolder::new(&target).unwrap();
        let second = StagingFolder::new(&target).unwrap();
        assert!(first.leftovers().is_empty() && second.leftovers().is_empty());
        let count = || fs::read_dir(place.path()).unwrap().count();
        assert_eq!(count(), 2);
        #[cfg(target_os = "linux")]
        for entry in fs::read_dir(place.path()).unwrap() {
            use std::os::unix::fs::MetadataExt;
            // The system's lock, not the list of this process: to open the marker would have released it.
            let marker = fs::metadata(entry.unwrap().path().join(MARKER)).unwrap();
            let locks = fs::read_to_string("/proc/locks").unwrap_or_default();
            assert!(locks.is_empty() || locks.contains(&format!(":{} ", marker.ino())), "{locks}");
        }
        drop(first);
        drop(second);
        assert_eq!(count(), 0);
    }
}
