//! A folder that is filled under a temporary name and then moved to its place in one step.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use sidestep_kernel::InputError;

use crate::disk;
use crate::disk::cannot_create;

/// A folder with a temporary name. If it is dropped, it and the parents created for it are deleted.
pub(crate) struct StagingFolder {
    path: PathBuf,
    /// The place that it takes: of a link, the folder that it leads to.
    target: PathBuf,
    /// Parents created for the folder, the outermost first.
    made: Vec<PathBuf>,
}

impl StagingFolder {
    /// Creates an empty folder in the parent of `target`, and that parent if it is missing.
    pub(crate) fn new(target: &Path) -> Result<Self, InputError> {
        let target = resolve_link(target).map_err(|e| cannot_create(target, e))?;
        let path = hidden_sibling(&target, "new")?;
        let mut made: Vec<_> = disk::parent(&target)
            .ancestors()
            .take_while(|p| !p.as_os_str().is_empty() && !p.exists())
            .map(Path::to_path_buf)
            .collect();
        made.reverse();
        let staging = Self { path, target, made };
        staging.make().map_err(|e| cannot_create(&staging.target, e))?;
        Ok(staging)
    }

    fn make(&self) -> io::Result<()> {
        fs::create_dir_all(disk::parent(&self.path))?;
        // Remains of a killed process with the same id.
        remove_if_exists(&self.path)?;
        fs::create_dir(&self.path)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Moves the folder to its place, replacing anything there.
    pub(crate) fn commit(mut self) -> Result<(), InputError> {
        let target = &self.target;
        // The old folder is kept beside the new one until that is in place: a failure leaves one of them whole.
        let old = hidden_sibling(target, "old")?;
        remove_if_exists(&old).map_err(|e| cannot_create(target, e))?;
        let replaces = target.exists();
        if replaces {
            fs::rename(target, &old).map_err(|e| cannot_create(target, e))?;
        }
        if let Err(e) = disk::rename(&self.path, target) {
            if replaces {
                let _ = fs::rename(&old, target);
            }
            return Err(cannot_create(target, e.cause));
        }
        self.made.clear();
        remove_if_exists(&old).map_err(|e| cannot_create(target, e))
    }
}

impl Drop for StagingFolder {
    fn drop(&mut self) {
        let _ = remove_if_exists(&self.path);
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

/// Returns a hidden name in the same folder that no other process uses.
fn hidden_sibling(target: &Path, role: &str) -> Result<PathBuf, InputError> {
    let name = target.file_name().ok_or_else(|| cannot_create(target, "it has no name"))?;
    let name = format!(".{}.{role}-{}", name.display(), std::process::id());
    Ok(disk::parent(target).join(name))
}

fn remove_if_exists(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}
