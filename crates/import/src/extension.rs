//! Kinds of files, by their names.

use std::path::Path;

use sidestep_kernel::InputError;

/// Returns the extension in lower case, the one before `.gz` where that is the last.
pub(crate) fn extension(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    name.rsplit_once('.').map_or("", |(_, extension)| extension).to_owned()
}

/// Refuses a file that does not have one of the extensions of its kind. It is needed for files that refer to further
/// files: one text can be a scenario and a map at once, so a user who may only write scenarios could otherwise have
/// files read that a scenario may not refer to.
///
/// # Errors
/// With the extensions of that kind.
pub(crate) fn check(path: &Path, kind: &str, extensions: &[&str]) -> Result<(), InputError> {
    if extensions.contains(&extension(path).as_str()) {
        return Ok(());
    }
    let cause = format!("the file name is not that of {kind}");
    let remedy = format!("give a file that ends in .{}, also with .gz", extensions.join(" or ."));
    Err(InputError::new(path.display(), cause, remedy))
}
