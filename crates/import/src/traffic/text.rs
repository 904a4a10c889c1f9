//! The text of a file: UTF-8, UTF-16, or UTF-8 with some bytes that are none.

use super::rows::RowCollector;
use crate::report::Treatment;
use sidestep_kernel::InputError;

/// Number of bytes in which a zero tells that a file is no text.
const SEARCHED_BYTES: usize = 8192;

/// Returns the bytes of a file as text. Bytes that are no UTF-8, as in a name of another alphabet, are replaced and
/// counted by lines: what else such a line says is right.
///
/// # Errors
/// When the file is no text.
pub(super) fn decode(bytes: Vec<u8>, collector: &mut RowCollector) -> Result<String, InputError> {
    if let Some(text) = decode_utf16(&bytes) {
        return text.ok_or_else(|| no_text(collector, "begins as a text in UTF-16, and is none"));
    }
    let error = match String::from_utf8(bytes) {
        Ok(text) => return Ok(text),
        Err(error) => error,
    };
    let bytes = error.as_bytes();
    if bytes.iter().take(SEARCHED_BYTES).any(|byte| *byte == 0) {
        return Err(no_text(collector, "is neither a text (UTF-8) nor a Parquet file"));
    }
    let text = String::from_utf8_lossy(bytes).into_owned();
    let mut lines = bytes.split(|byte| *byte == b'\n').enumerate();
    let mut bad_lines = 0;
    for (k, _) in lines.by_ref().filter(|(_, line)| std::str::from_utf8(line).is_err()) {
        bad_lines += 1;
        let rule = "lines with characters that are not UTF-8, which are replaced";
        let place = if bad_lines <= crate::report::MAX_PLACES {
            format!("line {}", k + 1)
        } else {
            String::new()
        };
        collector.report.record(Treatment::Repaired, rule, place, "save the file as UTF-8");
    }
    let line_count = bytes.iter().filter(|byte| **byte == b'\n').count() + 1;
    if bad_lines * 2 > line_count {
        return Err(no_text(collector, "is neither a text (UTF-8) nor a Parquet file")
            .with_byte_offset(&text, error.utf8_error().valid_up_to()));
    }
    Ok(text)
}

fn no_text(collector: &RowCollector, cause: &str) -> InputError {
    InputError::new(collector.place(), cause, "save the file as UTF-8")
}

/// Returns a text in UTF-16, which a byte order mark or zeros beside its first letters tell: `None` for anything else,
/// `Some(None)` for one that is damaged.
pub(crate) fn decode_utf16(bytes: &[u8]) -> Option<Option<String>> {
    let (unit, begin): (fn([u8; 2]) -> u16, usize) = match bytes.get(..4)? {
        [0xff, 0xfe, ..] => (u16::from_le_bytes, 2),
        [0xfe, 0xff, ..] => (u16::from_be_bytes, 2),
        [a, 0, b, 0] if a.is_ascii_graphic() && b.is_ascii_graphic() => (u16::from_le_bytes, 0),
        [0, a, 0, b] if a.is_ascii_graphic() && b.is_ascii_graphic() => (u16::from_be_bytes, 0),
        _ => return None,
    };
    let pairs = bytes[begin..].chunks_exact(2);
    let units = pairs.map(|pair| unit([pair[0], pair[1]]));
    Some(char::decode_utf16(units).collect::<Result<String, _>>().ok())
}
