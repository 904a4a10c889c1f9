//! A folder that is made beside its place and moved there in one step.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use sidestep_kernel::InputError;

use crate::disk;
use crate::disk::cannot_make;

/// A folder under a temporary name; dropped, it and the parents made for it are gone again.
pub(crate) struct Staging {
    path: PathBuf,
    /// Parents made for it, the outermost first.
    made: Vec<PathBuf>,
}

impl Staging {
    /// Makes an empty folder in the parent of `target`, and that parent if it is missing.
    pub(crate) fn new(target: &Path) -> Result<Self, InputError> {
        let path = beside(target, "new")?;
        let mut made: Vec<_> = disk::parent(target)
            .ancestors()
            .take_while(|p| !p.as_os_str().is_empty() && !p.exists())
            .map(Path::to_path_buf)
            .collect();
        made.reverse();
        let staging = Self { path, made };
        staging.make().map_err(|e| cannot_make(target, e))?;
        Ok(staging)
    }

    fn make(&self) -> io::Result<()> {
        fs::create_dir_all(disk::parent(&self.path))?;
        // What a killed process with this number left.
        remove_if_there(&self.path)?;
        fs::create_dir(&self.path)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Moves the folder to `target`, in place of what is there.
    pub(crate) fn take_place_of(mut self, target: &Path) -> Result<(), InputError> {
        let failed = |e| cannot_make(target, e);
        let old = beside(target, "old")?;
        remove_if_there(&old).map_err(failed)?;
        let replaces = target.exists();
        if replaces {
            fs::rename(target, &old).map_err(failed)?;
        }
        if let Err(e) = disk::rename(&self.path, target) {
            if replaces {
                let _ = fs::rename(&old, target);
            }
            return Err(failed(io::Error::other(e.cause)));
        }
        self.made.clear();
        remove_if_there(&old).map_err(failed)
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        let _ = remove_if_there(&self.path);
        for parent in self.made.iter().rev() {
            // Fails, as it should, where somebody has put something.
            let _ = fs::remove_dir(parent);
        }
    }
}

/// A hidden name in the same folder, of this process alone.
fn beside(target: &Path, role: &str) -> Result<PathBuf, InputError> {
    let name = target.file_name().ok_or_else(|| cannot_make(target, "it has no name"))?;
    let name = format!(".{}.{role}-{}", name.display(), std::process::id());
    Ok(disk::parent(target).join(name))
}

fn remove_if_there(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}
