//! The version of the format of a run folder.
//!
//! | reader \ file | same major, older or same minor | same major, newer minor | other major |
//! | --- | --- | --- | --- |
//! | this version | read completely | read; unknown additions are ignored | refused with a remedy |
//!
//! The minor number rises when something is added that an older reader may ignore (a key in
//! `run.json`, a key-value pair in a Parquet footer). The major number rises when an older reader
//! would misread: another meaning, another unit, another layout of files. Columns belong to the
//! world and are named in each file, so they do not count.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;

/// The format that this build writes. Since 1.1 manifests end with their digest, and list files with theirs.
pub const CURRENT: FormatVersion = FormatVersion { major: 1, minor: 1 };

/// A format version, `major.minor`; the [module](self) explains what each number guarantees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct FormatVersion {
    /// Rises when an older reader would misread.
    pub major: u32,
    /// Rises when an older reader may ignore the additions.
    pub minor: u32,
}

impl FormatVersion {
    /// Refuses a version that this build cannot read.
    ///
    /// # Errors
    /// Another major version; `place` is the file that carries it.
    pub fn check_readable(self, place: impl fmt::Display) -> Result<(), InputError> {
        if self.major == CURRENT.major {
            return Ok(());
        }
        let remedy = if self.major > CURRENT.major {
            "read it with a newer version of the program"
        } else {
            "read it with the version of the program that wrote it, or run its scenario again"
        };
        let cause = format!("format {self}, while this program reads {}.x", CURRENT.major);
        Err(InputError::new(place, cause, remedy))
    }
}

impl fmt::Display for FormatVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.major, self.minor)
    }
}

/// The error of a text that is not `major.minor`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no format version such as `1.0`")]
pub struct BadFormatVersion(String);

impl FromStr for FormatVersion {
    type Err = BadFormatVersion;

    fn from_str(text: &str) -> Result<Self, BadFormatVersion> {
        parse_version(text).ok_or_else(|| BadFormatVersion(text.to_string()))
    }
}

fn parse_version(text: &str) -> Option<FormatVersion> {
    let (major, minor) = text.split_once('.')?;
    Some(FormatVersion { major: major.parse().ok()?, minor: minor.parse().ok()? })
}

impl TryFrom<String> for FormatVersion {
    type Error = BadFormatVersion;

    fn try_from(text: String) -> Result<Self, BadFormatVersion> {
        text.parse()
    }
}

impl From<FormatVersion> for String {
    fn from(version: FormatVersion) -> Self {
        version.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_survives_its_text_and_nonsense_is_refused() {
        assert_eq!("1.12".parse(), Ok(FormatVersion { major: 1, minor: 12 }));
        assert_eq!(FormatVersion { major: 3, minor: 4 }.to_string(), "3.4");
        for bad in ["", "1", "1.", ".1", "1.x", "-1.0", "1.0.0", "99999999999.0"] {
            assert!(bad.parse::<FormatVersion>().is_err(), "{bad}");
        }
    }

    #[test]
    fn a_newer_minor_is_read_and_another_major_is_refused_with_a_remedy() {
        let newer_minor = FormatVersion { minor: CURRENT.minor + 1, ..CURRENT };
        assert!(newer_minor.check_readable("f").is_ok());
        let newer = FormatVersion { major: CURRENT.major + 1, minor: 0 };
        let error = newer.check_readable("f").unwrap_err();
        assert!(error.cause().contains("format 2.0"), "{error}");
        assert!(error.remedy().contains("newer version"), "{error}");
        assert!(FormatVersion { major: 0, minor: 9 }.check_readable("f").is_err());
    }
}
