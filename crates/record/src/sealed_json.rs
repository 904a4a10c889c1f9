//! JSON files that end with a digest of themselves, so that no changed byte in them goes unnoticed.
//!
//! The last key of such a file is `manifest_digest`: the digest, in hexadecimal, of every byte before the comma that
//! precedes this key. Its place is the same in every file, so that damage of the key itself is damage too.

use std::fmt;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer};
use sidestep_kernel::ports::RecordError;
use sidestep_kernel::{Digest, InputError};

use crate::disk;
use crate::format::FormatVersion;

/// The key of the digest.
const KEY: &str = "manifest_digest";
/// The first format of which every manifest has a digest.
const FIRST_SEALED: FormatVersion = FormatVersion { major: 1, minor: 1 };
/// Largest manifest that is read: that of a sweep of a million variants has about a hundred megabytes.
const MAX_BYTES: u64 = 1 << 30;

/// Whether a manifest confirms its own content.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seal {
    /// Its digest is right.
    Confirmed,
    /// It has none: an older version wrote it.
    Missing,
}

/// The one key that every format has.
#[derive(Deserialize)]
struct FormatProbe {
    format: FormatVersion,
}

/// Returns indented JSON that ends with its digest and a newline.
///
/// # Errors
/// A value that is no JSON object.
pub(crate) fn sealed_json(value: &impl Serialize) -> serde_json::Result<Vec<u8>> {
    let text = serde_json::to_string_pretty(value)?;
    let body = text.strip_suffix("\n}").unwrap_or(&text);
    Ok(format!("{body}{}", ending(body)).into_bytes())
}

/// Returns the text of a manifest, which may have a digest that is no longer right, with the right one; a text that is no
/// JSON object as it is.
pub fn seal_again(text: &str) -> String {
    let sealed = serde_json::from_str(text).and_then(|mut values: serde_json::Map<_, _>| {
        values.remove(KEY);
        sealed_json(&values)
    });
    let sealed = sealed.ok().and_then(|bytes| String::from_utf8(bytes).ok());
    sealed.unwrap_or_else(|| text.into())
}

/// Returns what follows the text before the digest.
fn ending(body: &str) -> String {
    let digest = Digest::hash_bytes(body.as_bytes());
    format!(",\n  \"{KEY}\": \"{digest}\"\n}}\n")
}

/// Reads a manifest, after checking its format and its digest.
///
/// # Errors
/// A missing file; text that is not a manifest (with line and column); another major format; a digest that is wrong, or
/// missing where the format has one.
pub(crate) fn read_sealed<T: DeserializeOwned>(path: &Path) -> Result<(T, Seal), InputError> {
    let text = read_text(path).map_err(|e| {
        InputError::new(path.display(), e.to_string(), "make the file readable, or restore it")
    })?;
    // The version comes first: a newer manifest need not have the keys of this one.
    let probe: FormatProbe = parse(path, &text)?;
    probe.format.check_readable(path.display())?;
    let seal = check_seal(path, &text, probe.format)?;
    Ok((parse(path, &text)?, seal))
}

/// Writes a manifest in one step: a reader finds the old or the new one.
pub(crate) fn write_sealed(path: &Path, value: &impl Serialize) -> Result<(), RecordError> {
    let bytes = sealed_json(value).map_err(|e| RecordError::new(path.display(), e))?;
    disk::replace(path, &bytes)
}

fn read_text(path: &Path) -> std::io::Result<String> {
    let length = std::fs::metadata(path)?.len();
    if length > MAX_BYTES {
        return Err(std::io::Error::other(format!("{length} bytes are too many for a manifest")));
    }
    std::fs::read_to_string(path)
}

fn check_seal(path: &Path, text: &str, format: FormatVersion) -> Result<Seal, InputError> {
    let length = ending("").len();
    let cut = text.len().checked_sub(length).filter(|cut| text.is_char_boundary(*cut));
    let (body, end) = text.split_at(cut.unwrap_or(0));
    if cut.is_some() && ending(body) == end {
        return Ok(Seal::Confirmed);
    }
    if format < FIRST_SEALED && !text.contains(KEY) {
        return Ok(Seal::Missing);
    }
    let cause = "the file does not match the digest at its end: it is damaged, or was edited";
    Err(InputError::new(path.display(), cause, REMEDY))
}

const REMEDY: &str =
    "restore it, or make the folder again: `sidestep verify DIR` names every damaged file";

fn parse<'a, T: Deserialize<'a>>(path: &Path, text: &'a str) -> Result<T, InputError> {
    serde_json::from_str(text).map_err(|e| {
        let remedy = "the file is damaged: restore it, or run the scenario again in a new folder";
        let error = InputError::new(path.display(), format!("this is no manifest: {e}"), remedy);
        if e.line() > 0 { error.with_position(e.line(), e.column().max(1)) } else { error }
    })
}

/// A digest of the bytes of a file, in hexadecimal.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct FileDigest(String);

impl FileDigest {
    /// Returns the digest of the bytes of a file.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        Self::from(Digest::hash_bytes(bytes))
    }
}

impl From<Digest> for FileDigest {
    fn from(digest: Digest) -> Self {
        Self(digest.to_string())
    }
}

impl<'de> Deserialize<'de> for FileDigest {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let is_digest = text.len() == 32 && text.bytes().all(|b| b.is_ascii_hexdigit());
        let error = || serde::de::Error::custom(format!("`{text}` is no digest of a file"));
        if is_digest { Ok(Self(text)) } else { Err(error()) }
    }
}

impl fmt::Display for FileDigest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn read(text: &[u8]) -> Result<(Value, Seal), InputError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.json");
        std::fs::write(&path, text).unwrap();
        read_sealed(&path)
    }

    #[test]
    fn every_flipped_bit_of_a_manifest_is_noticed() {
        let whole = sealed_json(&json!({"format": "1.1", "seed": 7, "files": {"a": "b"}})).unwrap();
        assert_eq!(read(&whole).unwrap().1, Seal::Confirmed);
        for bit in 0..whole.len() * 8 {
            let mut flipped = whole.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(read(&flipped).is_err(), "bit {bit}");
        }
    }

    #[test]
    fn a_manifest_of_an_older_version_is_read_and_says_that_it_has_no_digest() {
        assert_eq!(read(b"{\"format\": \"1.0\"}").unwrap().1, Seal::Missing);
        assert!(read(b"{\"format\": \"1.1\"}").is_err(), "this version writes one");
        let cut = sealed_json(&json!({"format": "1.0"})).unwrap();
        assert!(read(&cut[..cut.len() - 3]).is_err());
    }

    #[test]
    fn an_edited_manifest_is_sealed_again() {
        let whole = String::from_utf8(sealed_json(&json!({"format": "1.1", "seed": 7})).unwrap());
        let edited = whole.unwrap().replace('7', "8");
        let (values, seal) = read(seal_again(&edited).as_bytes()).unwrap();
        assert_eq!((&values["seed"], seal), (&json!(8), Seal::Confirmed));
    }
}
