//! The error type of sessions.

use sidestep_draw::DrawError;
use sidestep_kernel::ports::RecordError;
use sidestep_kernel::{Cycle, InputError};
use sidestep_record::{CreateError, PathError, replace_path};
use std::path::Path;

/// The remedy of what cannot be stored, whatever the system's reason.
pub const STORAGE_REMEDY: &str = "see that its folder is there, that you may write to it and that the disk has room; \
     or give another place with --out";

/// The reason why work stopped before its end.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Wrong input, with its place and a remedy.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A run folder, an MCAP file or a checkpoint could not be stored.
    #[error("{0}\n  help: {remedy}", remedy = STORAGE_REMEDY)]
    Record(#[from] RecordError),
    /// A picture could not be drawn: a size is too large, or a number has no place in it.
    #[error("the picture cannot be drawn: {0}")]
    Draw(#[from] DrawError),
    /// The watcher asked to stop before there was a result to keep.
    #[error("interrupted; nothing was written")]
    Interrupted,
    /// The watcher interrupted a run within a cycle that took too long to wait for. The number of
    /// cycles done; a folder continues from its last checkpoint.
    #[error(
        "interrupted within cycle {0}, which is lost; a run folder continues from its last checkpoint"
    )]
    InterruptedInCycle(Cycle),
    /// Anything else that stopped the work, with its remedy.
    #[error("{cause}\n  help: {remedy}")]
    Other {
        /// Becomes the message, in lower case and without an end mark.
        cause: String,
        /// Is shown below the message, as an instruction.
        remedy: String,
    },
}

impl Error {
    /// Returns [`Error::Other`].
    pub fn other(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Other { cause: cause.into(), remedy: remedy.into() }
    }

    /// Returns an [`Error::Other`] about `path`, with the system's reason.
    pub fn cannot_write(path: &Path, error: &std::io::Error) -> Self {
        let remedy =
            "see that its folder is there, that you may write to it and that the disk has room";
        Self::other(format!("cannot write {}: {error}", path.display()), remedy)
    }

    /// Returns an [`Error::Record`] about `path`, a place that a user chooses with `--out`.
    pub(crate) fn cannot_store(path: &Path, error: &std::io::Error) -> Self {
        RecordError::new(path.display(), error).into()
    }
}

impl From<CreateError> for Error {
    fn from(error: CreateError) -> Self {
        match error {
            CreateError::Refused(error) => error.into(),
            CreateError::Failed(error) => error.into(),
        }
    }
}

impl PathError for Error {
    fn with_path(self, from: &Path, to: &Path) -> Self {
        match self {
            Self::Record(error) => error.with_path(from, to).into(),
            Self::Other { cause, remedy } => {
                Self::Other { cause: replace_path(&cause, from, to), remedy }
            }
            other => other,
        }
    }
}
