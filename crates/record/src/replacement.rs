//! What a new run may take the place of: the files of an old one that are as they were written. Nothing else is deleted.

use std::path::{Path, PathBuf};

use sidestep_kernel::InputError;

use crate::run_content::{RunContent, list_tree, unreadable};
use crate::run_reader::RunReader;
use crate::sealed_json::Seal;

/// Largest number of files that an error lists.
const MAX_LISTED: usize = 8;

/// The content of a folder that is replaced, by paths in it.
#[derive(Debug, Default)]
pub(crate) struct Replacement {
    /// Files that this program wrote, and nobody changed.
    pub(crate) own: Vec<PathBuf>,
    /// Files of others, and empty folders: they stay.
    pub(crate) others: Vec<PathBuf>,
}

/// The files of a folder that forbid to replace it.
#[derive(Debug, Default)]
struct Obstacles {
    changed: Vec<PathBuf>,
    in_the_way: Vec<PathBuf>,
}

impl Replacement {
    /// Returns what may be deleted of the run in a folder, and what stays.
    ///
    /// # Errors
    /// A run of an older version, whose files are not known; a file of the run that was changed; another file that is in
    /// the way of a new run.
    pub(crate) fn of_run(folder: &Path) -> Result<Self, InputError> {
        let reader = RunReader::open_for_replacement(folder)?;
        if reader.seal == Seal::Missing {
            let cause = "an older version wrote this run, without a list of its files";
            let remedy = "give another folder, or remove this one yourself";
            return Err(InputError::new(folder.display(), cause, remedy));
        }
        let run = RunContent::new(&reader)?;
        let mut content = Self::default();
        let mut obstacles = Obstacles::default();
        for path in list_tree(folder).map_err(|e| unreadable(folder, &e))? {
            if run.is_changed(&path) {
                obstacles.changed.push(path);
            } else if run.is_own(&path) {
                content.own.push(path);
            } else if run.is_in_the_way(&path) {
                obstacles.in_the_way.push(path);
            } else {
                content.others.push(path);
            }
        }
        obstacles.check(folder)?;
        Ok(content)
    }
}

impl Obstacles {
    fn check(&self, folder: &Path) -> Result<(), InputError> {
        let (files, what) = if self.changed.is_empty() {
            (&self.in_the_way, "files of others are in the way")
        } else {
            (&self.changed, "files were changed since they were written")
        };
        if files.is_empty() {
            return Ok(());
        }
        let mut names: Vec<String> =
            files.iter().take(MAX_LISTED).map(|path| path.display().to_string()).collect();
        if files.len() > MAX_LISTED {
            names.push(format!("and {} more", files.len() - MAX_LISTED));
        }
        let cause = format!("nothing was replaced: {what}: {}", names.join(", "));
        let remedy = "move them away, or give another folder";
        Err(InputError::new(folder.display(), cause, remedy))
    }
}
