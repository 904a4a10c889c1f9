//! Checkpoints: a state as bytes that continue a run bit for bit, or an error that gives the reason.
//!
//! ```text
//! magic 8 | header (postcard) | conflict groups, state (postcard) | BLAKE3 of all before, 16 bytes
//! ```

use crate::digest::Digest;
use crate::units::Cycle;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

const MAGIC: &[u8; 8] = b"SIDESTEP";
/// Bytes of a checksum, which is a [`Digest`]: it detects damage, not forgery.
const CHECKSUM_BYTES: usize = 16;

/// Version of the checkpoint layout; checkpoints of any other version are refused.
pub const FORMAT_VERSION: u32 = 7;

/// The program, world, scenario and cycle that a checkpoint belongs to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CheckpointHeader {
    /// [`FORMAT_VERSION`] of the writer.
    pub format: u32,
    /// Version of the program that wrote it; results may differ between versions.
    pub program_version: String,
    /// Name of the world, as scenarios write it.
    pub world: String,
    /// Digest of the resolved scenario's text.
    pub scenario: [u8; 16],
    /// Cycles done: the run continues with the cycle of this number.
    pub cycle: Cycle,
}

impl CheckpointHeader {
    /// Checks that it is of the same program version, world and scenario as `expected`. Formats and cycles are not
    /// compared: decoding has refused other formats, and any cycle can be continued.
    ///
    /// # Errors
    /// When it is not; the error reports the first difference.
    pub fn check_compatibility(&self, expected: &Self) -> Result<(), CheckpointError> {
        check_match("version", &self.program_version, &expected.program_version)?;
        check_match("world", &self.world, &expected.world)?;
        check_match("scenario", &hex(&self.scenario), &hex(&expected.scenario))
    }
}

/// A reason why a checkpoint cannot be continued.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The bytes do not begin with the magic of checkpoints.
    #[error("this is not a checkpoint")]
    NotACheckpoint,
    /// Cut short or changed.
    #[error("the checkpoint is damaged: its checksum does not fit")]
    Damaged,
    /// Written with another layout.
    #[error("the checkpoint has format {found}, this program reads format {FORMAT_VERSION}")]
    Format {
        /// The version in the checkpoint's header.
        found: u32,
    },
    /// The checkpoint is of another program version, world or scenario.
    #[error("the checkpoint belongs to {what} `{found}`, not `{expected}`")]
    Foreign {
        /// The property that differs: `version`, `world` or `scenario`.
        what: &'static str,
        /// Its value in the checkpoint's header; digests in hexadecimal.
        found: String,
        /// Its value in the run that should continue.
        expected: String,
    },
}

/// Encodes a state as a checkpoint.
///
/// # Panics
/// When the state cannot be serialized, which is a bug of the world.
pub fn encode(header: &CheckpointHeader, state: &impl Serialize) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes = postcard::to_extend(header, bytes).expect("a header is plain data");
    bytes = postcard::to_extend(state, bytes).expect("a state is plain data");
    let checksum = Digest::hash_bytes(&bytes);
    bytes.extend_from_slice(checksum.as_bytes());
    bytes
}

/// Reads the header alone, after checking the checksum of all bytes.
///
/// # Errors
/// When the bytes are not a checkpoint, damaged, or of another format.
pub fn decode_header(bytes: &[u8]) -> Result<CheckpointHeader, CheckpointError> {
    split_checkpoint(bytes).map(|(header, _)| header)
}

/// Decodes a state written for `expected` (whose `cycle` is not compared).
///
/// # Errors
/// When the bytes are not a checkpoint, damaged, of another format, or of another program
/// version, world or scenario.
pub fn decode<S: DeserializeOwned>(
    bytes: &[u8],
    expected: &CheckpointHeader,
) -> Result<(Cycle, S), CheckpointError> {
    let (header, state) = split_checkpoint(bytes)?;
    header.check_compatibility(expected)?;
    let state = postcard::from_bytes(state).map_err(|_| CheckpointError::Damaged)?;
    Ok((header.cycle, state))
}

/// Checks the frame of a checkpoint, and returns its header and the bytes of its state.
fn split_checkpoint(bytes: &[u8]) -> Result<(CheckpointHeader, &[u8]), CheckpointError> {
    let body = bytes.strip_prefix(MAGIC).ok_or(CheckpointError::NotACheckpoint)?;
    let (_, checksum) =
        bytes.split_last_chunk::<CHECKSUM_BYTES>().ok_or(CheckpointError::Damaged)?;
    let hashed = &bytes[..bytes.len() - CHECKSUM_BYTES];
    if body.len() < CHECKSUM_BYTES || Digest::hash_bytes(hashed).as_bytes() != checksum {
        return Err(CheckpointError::Damaged);
    }
    let body = &body[..body.len() - CHECKSUM_BYTES];
    // The format is read on its own, because the rest of another layout cannot be decoded.
    let (found, _): (u32, _) =
        postcard::take_from_bytes(body).map_err(|_| CheckpointError::Damaged)?;
    if found != FORMAT_VERSION {
        return Err(CheckpointError::Format { found });
    }
    postcard::take_from_bytes(body).map_err(|_| CheckpointError::Damaged)
}

fn check_match(what: &'static str, found: &str, expected: &str) -> Result<(), CheckpointError> {
    if found == expected {
        return Ok(());
    }
    Err(CheckpointError::Foreign { what, found: found.into(), expected: expected.into() })
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header() -> CheckpointHeader {
        CheckpointHeader {
            format: FORMAT_VERSION,
            program_version: "1.2.3".into(),
            world: "toy".into(),
            scenario: [7; 16],
            cycle: 99,
        }
    }

    #[test]
    fn a_state_comes_back_whole() {
        let bytes = encode(&header(), &vec![1u64, 2, 3]);
        assert_eq!(decode::<Vec<u64>>(&bytes, &header()), Ok((99, vec![1, 2, 3])));
        assert_eq!(decode_header(&bytes), Ok(header()));
    }

    #[test]
    fn any_cut_and_any_changed_byte_is_noticed() {
        let bytes = encode(&header(), &vec![1u64, 2, 3]);
        for n in 0..bytes.len() {
            assert!(decode::<Vec<u64>>(&bytes[..n], &header()).is_err(), "cut to {n} bytes");
            let mut changed = bytes.clone();
            changed[n] ^= 1;
            assert!(decode::<Vec<u64>>(&changed, &header()).is_err(), "byte {n} changed");
        }
    }

    #[test]
    fn a_foreign_checkpoint_says_what_differs() {
        let bytes = encode(&header(), &0u8);
        let other = CheckpointHeader { world: "robots".into(), ..header() };
        let error = decode::<u8>(&bytes, &other).expect_err("another world");
        assert_eq!(error.to_string(), "the checkpoint belongs to world `toy`, not `robots`");
        let old = encode(&CheckpointHeader { format: 0, ..header() }, &0u8);
        assert_eq!(decode::<u8>(&old, &header()), Err(CheckpointError::Format { found: 0 }));
    }
}
