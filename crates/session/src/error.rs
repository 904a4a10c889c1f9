//! The error type of sessions.

use sidestep_draw::DrawError;
use sidestep_kernel::ports::RecordError;
use sidestep_kernel::{Cycle, InputError};
use std::path::Path;

/// The reason why work stopped before its end.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Wrong input, with its place and a remedy.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A run folder, an MCAP file or a checkpoint could not be stored.
    #[error(transparent)]
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
        let remedy = "check the folder, its permissions and the space on the disk";
        Self::other(format!("cannot write {}: {error}", path.display()), remedy)
    }
}
