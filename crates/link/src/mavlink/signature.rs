//! The key of signed frames.

use std::path::Path;

/// Number of bytes of a key.
pub const KEY_BYTES: usize = 32;

/// Reads a key from a file: its 32 bytes, or as 64 hexadecimal digits.
///
/// # Errors
/// With what is wrong with the file.
pub fn read_key(file: &Path) -> Result<[u8; KEY_BYTES], String> {
    let content = std::fs::read(file).map_err(|error| error.to_string())?;
    if let Ok(key) = <[u8; KEY_BYTES]>::try_from(content.as_slice()) {
        return Ok(key);
    }
    let text = std::str::from_utf8(&content).unwrap_or_default();
    key_of_digits(text.trim()).ok_or_else(|| {
        format!(
            "it has {} bytes that are no key: give {KEY_BYTES} bytes, or {} hexadecimal digits, as written by `openssl \
             rand -hex {KEY_BYTES}`",
            content.len(),
            2 * KEY_BYTES
        )
    })
}

fn key_of_digits(text: &str) -> Option<[u8; KEY_BYTES]> {
    let is_hexadecimal = text.bytes().all(|byte| byte.is_ascii_hexdigit());
    if text.len() != 2 * KEY_BYTES || !is_hexadecimal {
        return None;
    }
    let mut key = [0; KEY_BYTES];
    for (k, byte) in key.iter_mut().enumerate() {
        *byte = u8::from_str_radix(&text[2 * k..2 * k + 2], 16).ok()?;
    }
    Some(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_read_as_bytes_or_as_digits() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("key");
        let write = |content: &[u8]| {
            std::fs::write(&file, content).expect("written");
            read_key(&file)
        };
        assert_eq!(write(&[7; 32]), Ok([7; 32]));
        let digits = "0a".repeat(32) + "\n";
        assert_eq!(write(digits.as_bytes()), Ok([10; 32]));
        for wrong in ["", "0a0a", &"xy".repeat(32)] {
            let error = write(wrong.as_bytes()).expect_err(wrong);
            assert!(error.contains("openssl"), "{error}");
        }
    }
}
