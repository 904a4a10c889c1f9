//! Files that are written completely or not at all.

use crate::Error;
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
    let real = |above: &Path| {
        let rest = whole.strip_prefix(above).ok()?;
        // Part by part: joined to nothing, a path would end in `/`.
        Some(above.canonicalize().ok()?.components().chain(rest.components()).collect())
    };
    whole.ancestors().find_map(real).unwrap_or_else(|| whole.clone())
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
    let mut growing = path.as_os_str().to_owned();
    growing.push(format!(".{}.partial", std::process::id()));
    let growing = Path::new(&growing);
    write_file(growing, write)
        .and_then(|()| std::fs::rename(growing, path))
        .inspect_err(|_| drop(std::fs::remove_file(growing)))
        .map_err(|e| Error::cannot_write(path, &e))
}

/// Fills a file, in a folder that is created if there is none.
fn write_file(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> Result<()>) -> Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let mut file = BufWriter::new(File::create(path)?);
    write(&mut file)?;
    file.flush()?;
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
