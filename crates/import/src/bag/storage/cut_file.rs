//! Files in SQLite that were cut off, completed so that what is left of them can be read.

use std::fs::File;
use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;

use sidestep_kernel::InputError;
use sidestep_kernel::shell::shell_path;

/// Maximum size of a file that is copied to be completed, in bytes: the folder for such files may be in memory.
pub(super) const MAX_COPY_BYTES: u64 = 1 << 32;

/// Returns the length of a file before it was cut off, as its head says; `None` where it is whole.
pub(super) fn whole_length(path: &Path) -> io::Result<Option<u64>> {
    const PAGE_SIZE: Range<usize> = 16..18;
    const PAGE_COUNT: Range<usize> = 28..32;
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut head = [0; 32];
    file.read_exact(&mut head)?;
    let page_size = match head[PAGE_SIZE] {
        [0, 1] => 1 << 16,
        [high, low] => u64::from(u16::from_be_bytes([high, low])),
        _ => 0,
    };
    let page_count =
        head[PAGE_COUNT].iter().fold(0_u64, |count, byte| count << 8 | u64::from(*byte));
    let whole = page_size * page_count;
    // A file of less than half of its pages has lost more than it has.
    let is_cut = length < whole && whole <= 2 * length && !has_journal(path);
    Ok(is_cut.then_some(whole))
}

/// Returns a copy of a file that was cut off, as long as it was whole: without the pages that are missing, which are found
/// as damaged ones are, SQLite reads none.
///
/// # Errors
/// When it was longer than `limit` bytes, or cannot be copied.
pub(super) fn completed_copy(
    file: &str,
    path: &Path,
    [whole, limit]: [u64; 2],
) -> Result<tempfile::NamedTempFile, InputError> {
    let error = |cause: String| {
        let remedy = format!(
            "copy it again if its original is whole; else complete a copy of it: `cp {} whole.db3 && truncate -s {whole} \
             whole.db3`, and give whole.db3",
            shell_path(path)
        );
        InputError::new(file, cause, remedy)
    };
    if whole > limit {
        let cause = format!(
            "is cut off, and too large to be completed in the folder of temporary files: {whole} bytes, of at most {limit}"
        );
        return Err(error(cause));
    }
    let copied = || {
        let copy = tempfile::NamedTempFile::new()?;
        std::fs::copy(path, copy.path())?;
        copy.as_file().set_len(whole)?;
        Ok(copy)
    };
    copied().map_err(|e: io::Error| {
        error(format!("is cut off, and cannot be completed in the folder of temporary files: {e}"))
    })
}

/// Returns whether a file has a journal beside it.
pub(super) fn has_journal(path: &Path) -> bool {
    ["-wal", "-journal"]
        .iter()
        .any(|suffix| Path::new(&format!("{}{suffix}", path.display())).is_file())
}
