//! The lines of a log without those that are damaged.

use std::path::Path;

use sidestep_kernel::InputError;
use sidestep_scenario::file::read_text;

use super::{inspect, messages};
use crate::report::ImportReport;
use crate::table::{MAX_TEXT_BYTES, data_lines};

/// Writes the lines of a log to a text file, without damaged messages. Returns the report of the log, which counts them.
///
/// # Errors
/// Those of [`inspect`]; when the file cannot be written.
pub fn write_clean(path: &Path, out: &Path) -> Result<ImportReport, InputError> {
    let report = inspect(path)?;
    let text = read_text(path, MAX_TEXT_BYTES)?;
    let damaged = damaged_lines(&text);
    let mut clean = String::with_capacity(text.len());
    for (k, line) in text.lines().enumerate() {
        if damaged.binary_search(&(k + 1)).is_err() {
            clean.push_str(line);
            clean.push('\n');
        }
    }
    std::fs::write(out, clean).map_err(|e| {
        let remedy = "give a file in a folder that exists and may be written to";
        InputError::new(out.display(), format!("cannot be written: {e}"), remedy)
    })?;
    Ok(report)
}

/// Returns the numbers of lines with damaged messages, from 1.
fn damaged_lines(text: &str) -> Vec<usize> {
    let lines = data_lines(text);
    lines
        .filter(|(line, words)| messages::parse("", *line, words).is_err())
        .map(|(line, _)| line)
        .collect()
}
