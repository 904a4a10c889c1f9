//! Exit codes of the command.

pub(crate) use sidestep_session::Error as Failure;

/// The exit codes of `sidestep`; part of its interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum ExitCode {
    /// The command did its work.
    Done = 0,
    /// The command could not finish, or the answer is no: a full disk, a replay that differs from
    /// its recording, a target that no posture reaches.
    Failed = 1,
    /// An option, a file or a folder is wrong. Nothing was written.
    WrongInput = 2,
    /// Ctrl-C (or a termination signal) stopped the command in good order; results so far are kept.
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
            Failure::Interrupted | Failure::InterruptedInCycle(_) => Self::Interrupted,
            Failure::Record(_) | Failure::Draw(_) | Failure::Other { .. } => Self::Failed,
        }
    }
}
