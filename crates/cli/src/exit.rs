//! How the command ends: exit codes, and the failures behind them.

use sidestep::kernel::InputError;
use sidestep::kernel::ports::RecordError;
use sidestep_draw::DrawError;

/// The exit codes of `sidestep`; part of its interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum ExitCode {
    /// The command did what was asked.
    Done = 0,
    /// It could not be finished, or the answer is no: a full disk, a replay that differs from its
    /// record, a target that no posture reaches.
    Failed = 1,
    /// An option, a file or a folder is wrong. Nothing was written.
    WrongInput = 2,
    /// Stopped by Ctrl-C (or a termination signal) in good order; what was done is kept.
    Interrupted = 130,
}

impl From<ExitCode> for std::process::ExitCode {
    fn from(code: ExitCode) -> Self {
        Self::from(code as u8)
    }
}

/// Why a command ends before its goal.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// Wrong input; says where and what would be right.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Something could not be stored.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A picture could not be drawn.
    #[error("the picture cannot be drawn: {0}")]
    Draw(#[from] DrawError),
    /// Stopped by Ctrl-C before there was anything to keep.
    #[error("interrupted; nothing was written")]
    Interrupted,
    /// Anything else that stopped the work, with what helps.
    #[error("{cause}\n  help: {remedy}")]
    Stopped {
        /// What happened.
        cause: String,
        /// What helps.
        remedy: String,
    },
}

impl Failure {
    /// A stop with its remedy.
    pub(crate) fn stopped(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Stopped { cause: cause.into(), remedy: remedy.into() }
    }

    /// A file that could not be written.
    pub(crate) fn write(path: &std::path::Path, error: &std::io::Error) -> Self {
        let remedy = "check the folder, its permissions and the space on the disk";
        Self::stopped(format!("cannot write {}: {error}", path.display()), remedy)
    }

    /// The code the process ends with.
    pub(crate) fn exit_code(&self) -> ExitCode {
        match self {
            Self::Input(_) => ExitCode::WrongInput,
            Self::Interrupted => ExitCode::Interrupted,
            Self::Record(_) | Self::Draw(_) | Self::Stopped { .. } => ExitCode::Failed,
        }
    }
}
