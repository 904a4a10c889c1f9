//! The one error of a session.

use sidestep::kernel::InputError;
use sidestep::kernel::ports::RecordError;
use sidestep_draw::DrawError;
use std::path::Path;

/// The reason why work ends before its goal.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Wrong input; says where and what would be right.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Something could not be stored.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A picture could not be drawn.
    #[error("the picture cannot be drawn: {0}")]
    Draw(#[from] DrawError),
    /// The watcher said no before there was anything to keep.
    #[error("interrupted; nothing was written")]
    Interrupted,
    /// Anything else that stopped the work, with its remedy.
    #[error("{cause}\n  help: {remedy}")]
    Stopped {
        /// What happened.
        cause: String,
        /// What helps.
        remedy: String,
    },
}

impl Error {
    /// Returns a stop with its remedy.
    pub fn stopped(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Stopped { cause: cause.into(), remedy: remedy.into() }
    }

    /// Returns the error of a file that could not be written.
    pub fn write(path: &Path, error: &std::io::Error) -> Self {
        let remedy = "check the folder, its permissions and the space on the disk";
        Self::stopped(format!("cannot write {}: {error}", path.display()), remedy)
    }
}
