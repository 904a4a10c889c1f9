//! Files that are written completely or not at all.

use crate::Error;
use sidestep_kernel::InputError;
use sidestep_record::{PathError, free_name, missing_folders, remove_folders, resolve_link};
use std::fs::File;
use std::io::{BufWriter, Result, Write};
use std::path::{Path, PathBuf};

/// Returns a path for programs and people to read. One that is not valid text is shown with marks in place of the
/// invalid parts: JSON cannot express it otherwise, and a result must not be lost because of its name.
pub fn display_path(path: impl AsRef<Path>) -> String {
    path.as_ref().display().to_string()
}

/// Returns the target of a path, links resolved as far as it exists: two paths to one place are equal.
pub(crate) fn resolve_path(path: &Path) -> PathBuf {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    for ancestor in whole.ancestors() {
        if let Ok(existing) = ancestor.canonicalize()
            && let Ok(rest) = whole.strip_prefix(ancestor)
        {
            // Part by part: joined to nothing, a path would end in `/`.
            return existing.components().chain(rest.components()).collect();
        }
    }
    whole
}

/// Replaces the file at `path` by the output of `write`: an earlier file stays until the new one is
/// complete.
///
/// # Errors
/// An I/O error.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
) -> std::result::Result<(), Error> {
    replace_atomically(path, |partial| {
        write_file(partial, write).map_err(|e| Error::cannot_write(path, &e))
    })
}

/// Replaces the file at `path` by the one that `make` makes at the path that it is given: an earlier file stays until
/// the new one is complete.
///
/// # Errors
/// Those of `make`; an I/O error.
pub(crate) fn replace_atomically<T>(
    path: &Path,
    make: impl FnOnce(&Path) -> std::result::Result<T, Error>,
) -> std::result::Result<T, Error> {
    // A link stays: the file that it leads to is replaced.
    let wrong = |cause: &str| InputError::new(path.display(), cause, "give a file, or a new name");
    let path = &resolve_link(path).map_err(|e| wrong(&e.to_string()))?;
    if std::fs::symlink_metadata(path).is_ok_and(|found| !found.is_file()) {
        return Err(wrong("this is no file").into());
    }
    // Beside the target, because a file is renamed in one step only within its file system; with the process id,
    // because two processes may write the same file at once.
    let partial = &free_name(path);
    let folders = missing_folders(path.parent().unwrap_or(path));
    let made = make(partial).map_err(|e| e.with_path(partial, path)).and_then(|made| {
        std::fs::rename(partial, path).map_err(|e| Error::cannot_write(path, &e))?;
        Ok(made)
    });
    if made.is_err() {
        let _ = std::fs::remove_file(partial);
        remove_folders(&folders);
    }
    made
}

/// Fills a file, in a folder that is created if there is none, and waits for the disk.
pub(crate) fn write_file(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
) -> Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let mut file = BufWriter::new(File::create(path)?);
    write(&mut file)?;
    file.flush()?;
    // Before the rename: after a power failure the new name could otherwise stand for an empty file.
    file.get_ref().sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_written_leaves_the_old_file_and_no_other() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        write_atomically(&path, |f| f.write_all(b"old")).expect("written");
        let fails = write_atomically(&path, |f| {
            f.write_all(b"half")?;
            Err(std::io::Error::other("no"))
        });
        assert!(fails.is_err());
        assert_eq!(std::fs::read(&path).expect("read"), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).expect("read").count(), 1);
    }

    #[test]
    #[cfg(unix)]
    fn a_link_stays_and_its_file_is_replaced_and_what_is_no_file_is_refused_and_stays() {
        use std::os::unix::fs::{FileTypeExt, symlink};
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("file"), "old").expect("written");
        symlink(at("file"), at("link")).expect("linked");
        write_atomically(&at("link"), |f| f.write_all(b"new")).expect("written");
        assert!(at("link").is_symlink());
        assert_eq!(std::fs::read(at("file")).expect("read"), b"new");
        symlink(at("nowhere"), at("lost")).expect("linked");
        std::fs::create_dir(at("folder")).expect("made");
        let made = std::process::Command::new("mkfifo").arg(at("pipe")).status();
        assert!(made.expect("mkfifo is there").success());
        let names = || {
            let entries = std::fs::read_dir(folder.path()).expect("a folder");
            let mut names: Vec<_> = entries.map(|e| e.expect("an entry").file_name()).collect();
            names.sort();
            names
        };
        let before = names();
        let refused = [
            ("lost", "a link to what is not there"),
            ("folder", "this is no file"),
            ("pipe", "this is no file"),
        ];
        for (name, why) in refused {
            let error = write_atomically(&at(name), |_| unreachable!("nothing is written"));
            let told = error.expect_err(name).to_string();
            assert!(told.contains(why) && told.contains(name), "{told}");
            assert_eq!(names(), before, "{name}");
        }
        assert!(at("lost").is_symlink() && at("folder").is_dir());
        let pipe = std::fs::symlink_metadata(at("pipe")).expect("there");
        assert!(pipe.file_type().is_fifo());
    }

    #[test]
    #[cfg(unix)]
    fn a_path_that_is_no_text_is_shown() {
        use std::os::unix::ffi::OsStrExt;
        let path = std::ffi::OsStr::from_bytes(b"ou\xfft");
        assert_eq!(display_path(path), "ou\u{fffd}t");
    }

    #[test]
    fn the_folder_of_a_file_is_made_with_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a/b/c.txt");
        write_atomically(&path, |f| f.write_all(b"new")).expect("written");
        assert_eq!(std::fs::read(&path).expect("read"), b"new");
    }
}
