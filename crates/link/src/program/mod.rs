//! The program: reads its job, does it, and reports the results, each as a line of JSON.
//!
//! ```text
//! fleet.rs   the server of a world, and nodes that it starts    crew.rs     processes of nodes
//! node.rs    one node                                           lifeline.rs the end of the parent process
//! told.rs    lines for the parent process                       metrics.rs  Prometheus' text
//! log.rs     logs to standard error                             scenario.rs the scenario they fly
//! packets.rs the table of all packets                           certificates.rs whether they hold
//! shown.rs   the view of a fleet                                watch.rs    the watcher of one
//! ```

mod certificates;
mod children;
mod fleet;
mod log;
mod metrics;
mod node;
mod output;
mod packet_table;
mod parent_monitor;
mod scenario;
mod view;
mod watch;

use output::print_message;
use parent_monitor::ParentMonitor;
use sidestep::worlds::WORLDS;
use sidestep_session::Error;
use sidestep_session::fleet::{CommonSettings, Job, JobError, LinkMessage};
use std::io::BufRead;
use std::process::ExitCode;

/// Words for a user who starts the program by hand.
const USAGE: &str = "\
sidestep-link runs the server and the nodes of a fleet. `sidestep fleet` and `sidestep node` start it
and tell it, in a line of JSON, what to do: see `sidestep fleet --help`.";

/// Does the job that standard input asks for. Exit codes are those of `sidestep`.
pub fn main() -> ExitCode {
    if let Some(word) = std::env::args().nth(1) {
        let is_version = ["--version", "-V"].contains(&word.as_str());
        let text = if is_version { version() } else { USAGE.into() };
        println!("{text}");
        let is_known = is_version || ["--help", "-h", "help"].contains(&word.as_str());
        return ExitCode::from(if is_known { 0 } else { 2 });
    }
    let mut line = String::new();
    let job = std::io::stdin().lock().read_line(&mut line).map_err(|e| e.to_string());
    let job = job.and_then(|_| serde_json::from_str::<Job>(&line).map_err(|e| e.to_string()));
    match job {
        Ok(job) => exit_code(run_job(job)),
        Err(reason) => {
            eprintln!("error: standard input has no job: {reason}\n{USAGE}");
            ExitCode::from(2)
        }
    }
}

fn version() -> String {
    format!("sidestep-link {}", WORLDS.build())
}

fn run_job(job: Job) -> Result<(), Error> {
    match job {
        Job::Fleet(job) => {
            check_and_start_log(&job.common, &job.listen)?;
            fleet::fly(&job, &ParentMonitor::watch())
        }
        Job::Node(job) => {
            check_and_start_log(&job.common, job.connect.iter().chain(&job.listen))?;
            ParentMonitor::exit_with_parent();
            node::fly(&job)
        }
        Job::Watch(job) => {
            check_build(&job.build)?;
            certificates::check_all(&job.connect, job.tls.as_ref())?;
            watch::watch(&job, &ParentMonitor::watch())
        }
    }
}

/// Checks the options that server and nodes share, and begins their log.
fn check_and_start_log<'a>(
    common: &CommonSettings,
    endpoints: impl IntoIterator<Item = &'a String>,
) -> Result<(), Error> {
    log::start(common.json_log, &common.log)?;
    check_build(&common.flown.build)?;
    certificates::check_all(endpoints, common.tls.as_ref())?;
    Ok(())
}

/// Refuses the job of another build: all that decide must be of the same build.
fn check_build(build: &str) -> Result<(), Error> {
    let own = WORLDS.build();
    if build == own {
        return Ok(());
    }
    let cause = format!("sidestep-link is of sidestep {own}, and the command of {build}");
    let remedy = "install both from the same source: cargo install --path crates/link";
    Err(sidestep::kernel::InputError::new("sidestep-link", cause, remedy).into())
}

/// Tells why a job failed, and returns the exit code.
fn exit_code(done: Result<(), Error>) -> ExitCode {
    let Err(error) = done else { return ExitCode::SUCCESS };
    let failed = JobError::from(&error);
    let code = match () {
        () if failed.is_input => 2,
        () if failed.is_interrupted => 130,
        () => 1,
    };
    print_message(&LinkMessage::Failed(failed));
    ExitCode::from(code)
}
