//! The parts of a replay: deflated bytes as base64, which need no escaping anywhere in a page.

use super::unwritable;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use serde::Serialize;
use sidestep_kernel::InputError;
use sidestep_session::Error;
use std::io::Write;

/// Maximum size of all parts: browsers hold texts of about twice as much.
const MAX_BYTES: usize = 256 << 20;

/// Numbered parts; the first one is 1, because 0 is the directory of all.
#[derive(Default)]
pub(super) struct Parts {
    lines: Vec<String>,
    bytes: usize,
}

impl Parts {
    /// Adds a part; returns its number.
    ///
    /// # Errors
    /// When the file becomes too large.
    pub(super) fn push(&mut self, bytes: &[u8]) -> Result<u32, Error> {
        let line = compress(bytes);
        self.bytes += line.len();
        if self.bytes > MAX_BYTES {
            let cause = format!("the file would have more than {} MiB", MAX_BYTES >> 20);
            let remedy = "export fewer frames with --every 10, or a part with --from and --until";
            return Err(InputError::new("--to page", cause, remedy).into());
        }
        self.lines.push(line);
        Ok(self.lines.len() as u32)
    }

    /// Adds a part of JSON; returns its number.
    ///
    /// # Errors
    /// When the file becomes too large.
    pub(super) fn push_json(&mut self, value: &impl Serialize) -> Result<u32, Error> {
        let text = serde_json::to_vec(value).map_err(|e| unwritable(&e))?;
        self.push(&text)
    }

    /// Returns all parts, one in a line, after their directory.
    ///
    /// # Errors
    /// When the directory cannot be written as JSON, which is a bug.
    pub(super) fn into_text(self, directory: &impl Serialize) -> Result<String, Error> {
        let text = serde_json::to_vec(directory).map_err(|e| unwritable(&e))?;
        let mut lines = vec![compress(&text)];
        lines.extend(self.lines);
        Ok(lines.join("\n"))
    }
}

/// Returns bytes deflated, as base64.
pub(super) fn compress(bytes: &[u8]) -> String {
    let mut encoder = DeflateEncoder::new(Vec::with_capacity(bytes.len() / 3), Compression::best());
    // Writing to memory cannot fail.
    let written = encoder.write_all(bytes).and_then(|()| encoder.finish());
    STANDARD.encode(written.unwrap_or_default())
}
