//! The one thread of the network that encrypted links need ([`ONE_THREAD`]): a process that would have more starts again,
//! whoever has started it.

use crate::wire::zenoh::ONE_THREAD;
use sidestep_session::Error;
use sidestep_session::fleet::{Job, LINK_PROGRAM, Tls, VehicleJob};
use std::process::{Command, ExitCode};

/// The word before a job that is given as an argument: a process that starts again has read its standard input.
pub(super) const JOB_WORD: &str = "job";

/// Longest part of a job in bytes: Linux allows 128 KiB in one argument, and far more in all of them.
const MAX_ARGUMENT_BYTES: usize = 100_000;

/// Returns whether this process has more threads than a job allows.
pub(super) fn is_missing_for(job: &Job) -> bool {
    let (variable, one_thread) = ONE_THREAD;
    certificates(job).is_some() && std::env::var_os(variable).is_none_or(|own| own != one_thread)
}

fn certificates(job: &Job) -> Option<&Tls> {
    match job {
        Job::Fleet(job) => job.common.tls.as_ref(),
        Job::Node(job) | Job::Vehicle(VehicleJob { node: job, .. }) => job.common.tls.as_ref(),
        Job::Watch(job) => job.tls.as_ref(),
        Job::Ros2(job) => job.common.tls.as_ref(),
        // Its link to the broker is none of Zenoh.
        Job::Dispatch(_) => None,
        Job::Drive(job) => job.common.tls.as_ref(),
        Job::Flight(job) => job.common.tls.as_ref(),
        Job::FlightRecorder(job) => job.common.tls.as_ref(),
    }
}

/// Starts this program again, with one thread, to do a job that was read as a line.
///
/// # Errors
/// When it cannot be started.
pub(super) fn start_again(line: &str) -> Result<ExitCode, Error> {
    let program = std::env::current_exe().map_err(start_error)?;
    let (variable, one_thread) = ONE_THREAD;
    let mut command = Command::new(program);
    command.arg(JOB_WORD).args(job_arguments(line)).env(variable, one_thread);
    replace_process(&mut command)
}

/// Returns a job in parts that are short enough for arguments; joined they are the job.
fn job_arguments(line: &str) -> Vec<&str> {
    let mut parts = Vec::new();
    let mut rest = line;
    while !rest.is_empty() {
        let mut end = rest.len().min(MAX_ARGUMENT_BYTES);
        while !rest.is_char_boundary(end) {
            end -= 1;
        }
        let (part, after) = rest.split_at(end);
        parts.push(part);
        rest = after;
    }
    parts
}

/// Puts a program in the place of this one, which keeps its process id: who has started it signals that one.
#[cfg(unix)]
fn replace_process(command: &mut Command) -> Result<ExitCode, Error> {
    Err(start_error(std::os::unix::process::CommandExt::exec(command)))
}

/// Runs a program with the standard input and output of this one, and returns its exit code.
#[cfg(not(unix))]
fn replace_process(command: &mut Command) -> Result<ExitCode, Error> {
    let status = command.status().map_err(start_error)?;
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    Ok(ExitCode::from(code.unwrap_or(1)))
}

fn start_error(error: std::io::Error) -> Error {
    let (variable, one_thread) = ONE_THREAD;
    let cause = format!("{LINK_PROGRAM} cannot start again for encrypted links: {error}");
    Error::other(cause, format!("start it with {variable}='{one_thread}'"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_job_is_given_in_parts_that_an_argument_can_have() {
        let job = "é".repeat(MAX_ARGUMENT_BYTES);
        let parts = job_arguments(&job);
        assert!(parts.iter().all(|part| part.len() <= MAX_ARGUMENT_BYTES));
        assert_eq!(parts.concat(), job);
        assert_eq!(job_arguments("{}"), ["{}"]);
    }
}
