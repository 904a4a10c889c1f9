//! Files that other files name: where they may lie.

use std::path::{Path, PathBuf};

/// Returns the folder in which files have to lie that a file names: the one above its own. Worlds, maps and images lie side
/// by side in packages, and a file that someone else wrote has no business with others.
pub(crate) fn allowed_folder(naming_file: &Path) -> PathBuf {
    let folder = folder_of(naming_file);
    let folder = std::fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    folder.parent().map(Path::to_owned).unwrap_or(folder)
}

/// Returns the folder of a file; the present one where its path has none.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Returns whether a file really lies in a folder, whatever links and `..` say.
pub(crate) fn is_inside(path: &Path, folder: &Path) -> bool {
    match (path.canonicalize(), folder.canonicalize()) {
        (Ok(path), Ok(folder)) => path.starts_with(folder),
        _ => false,
    }
}
