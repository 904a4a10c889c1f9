//! The text of a scenario file: UTF-8, UTF-16, or text of another encoding, of which only letters of names and comments
//! are lost.

use crate::traffic::text::decode_utf16;
use sidestep_kernel::InputError;
use sidestep_scenario::file::{decode_text, read_bytes};
use std::path::Path;

/// The text of a scenario file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct ScnText {
    pub(super) text: String,
    /// The lines, from 1, with characters that are replaced because they are not UTF-8.
    pub(super) replaced_lines: Vec<usize>,
}

impl ScnText {
    /// Reads a file, plain or compressed with gzip.
    ///
    /// # Errors
    /// When it cannot be read, is no text, or has more than `max_bytes` after decompression.
    pub(super) fn read(path: &Path, max_bytes: u64) -> Result<Self, InputError> {
        let bytes = read_bytes(path, max_bytes)?;
        if let Some(Some(text)) = decode_utf16(&bytes) {
            return Ok(Self { text, replaced_lines: Vec::new() });
        }
        let is_bad = |line: &[u8]| std::str::from_utf8(line).is_err();
        let mut replaced_lines = Vec::new();
        let mut line_count = 0;
        for line in bytes.split(|byte| *byte == b'\n') {
            line_count += 1;
            if is_bad(line) {
                replaced_lines.push(line_count);
            }
        }
        let is_other_file = bytes.contains(&0) || replaced_lines.len() * 2 > line_count;
        let text = if replaced_lines.is_empty() || is_other_file {
            decode_text(path, bytes)?
        } else {
            String::from_utf8_lossy(&bytes).into_owned()
        };
        let text = text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text);
        Ok(Self { text, replaced_lines })
    }
}
