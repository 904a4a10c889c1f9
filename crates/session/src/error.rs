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
    /// Something could not be stored.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A picture could not be drawn.
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
        /// The reason.
        cause: String,
        /// The remedy.
        remedy: String,
    },
}

impl Error {
    /// Returns a stop with its cause and remedy.
    pub fn other(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Other { cause: cause.into(), remedy: remedy.into() }
    }

    /// Returns the error of a file that could not be written.
    pub fn cannot_write(path: &Path, error: &std::io::Error) -> Self {
        let remedy = "check the folder, its permissions and the space on the disk";
        Self::other(format!("cannot write {}: {error}", path.display()), remedy)
    }
}
