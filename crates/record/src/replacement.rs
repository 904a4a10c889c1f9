//! What a new run or export may take the place of: the files of an old one that are as they were written. Nothing else is
//! deleted.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use sidestep_kernel::InputError;

use crate::file_manifest::{EXPORT, FileManifest};
use crate::run_content::{RunContent, list_tree, slashed, unreadable};
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
            } else if run.is_own(&path) && is_plain(&folder.join(&path)) {
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

    /// Returns what may be deleted of an exported folder, and what stays.
    ///
    /// # Errors
    /// A folder without a list of its files; a file that was changed.
    pub(crate) fn of_export(folder: &Path) -> Result<Self, InputError> {
        let list = FileManifest::name_for(EXPORT);
        let place = folder.join(&list);
        if fs::symlink_metadata(&place).is_err() {
            let cause = "no list names the files in this folder: another program wrote them, or an older version of this one";
            let remedy = "give another place with --out, or remove this one yourself";
            return Err(InputError::new(folder.display(), cause, remedy));
        }
        let (manifest, _) = FileManifest::read(&place)?;
        if manifest.kind != EXPORT {
            let cause = format!("this is the list of another kind of files: {}", manifest.kind);
            let remedy = "give another place with --out";
            return Err(InputError::new(place.display(), cause, remedy));
        }
        let changed = manifest.files.damaged_in(folder, |_| true).into_iter().map(|file| file.path);
        let changed: BTreeSet<_> = changed.collect();
        let mut content = Self::default();
        let mut obstacles = Obstacles::default();
        for path in list_tree(folder).map_err(|e| unreadable(folder, &e))? {
            let whole = folder.join(&path);
            let is_listed = path == Path::new(&list) || manifest.files.contains(&slashed(&path));
            if !is_listed {
                content.others.push(path);
            } else if changed.contains(&whole) || !is_plain(&whole) {
                obstacles.changed.push(path);
            } else {
                content.own.push(path);
            }
        }
        obstacles.check(folder)?;
        Ok(content)
    }

    /// Refuses a new folder in which a file of others would have the name of a new file. `target` is its later place.
    ///
    /// # Errors
    /// The files that are in the way.
    pub(crate) fn check_room_in(&self, new: &Path, target: &Path) -> Result<(), InputError> {
        let is_taken = |path: &&PathBuf| {
            let [old, new] = [target.join(path), new.join(path)];
            // Two folders become one.
            fs::symlink_metadata(&new).is_ok() && !(is_folder(&old) && is_folder(&new))
        };
        let in_the_way = self.others.iter().filter(is_taken).cloned().collect();
        Obstacles { in_the_way, ..Obstacles::default() }.check(target)
    }
}

/// Returns whether there is a file or a folder, and no link to one.
fn is_plain(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|found| found.is_file() || found.is_dir())
}

fn is_folder(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|found| found.is_dir())
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
