//! Exit codes of the command.

pub(crate) use sidestep_session::Error as Failure;

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

impl From<&Failure> for ExitCode {
    fn from(failure: &Failure) -> Self {
        match failure {
            Failure::Input(_) => Self::WrongInput,
            Failure::Interrupted => Self::Interrupted,
            Failure::Record(_) | Failure::Draw(_) | Failure::Stopped { .. } => Self::Failed,
        }
    }
}
