//! The program: reads its job, does it, and reports the results, each as a line of JSON.
//!
//! ```text
//! fleet.rs           the server of a world, with the nodes that it starts (children.rs)
//! node.rs            one node
//! dispatch.rs        the master control of vehicles (VDA 5050)
//! watch.rs           a viewer of a fleet; view.rs: the views at the server
//! ros2.rs            a run as a node of ROS 2
//! drive.rs           a real robot that is driven by ROS 2
//! flight.rs          one airplane in a flight without a server
//! flight_recorder.rs the recorder of such a flight, with the nodes that it starts
//! scenario.rs        the scenario that server and nodes read
//! certificates.rs    checks of certificates; denials.rs: what they do not allow, for the log
//! one_thread.rs      the one thread of the network that encrypted links need
//! output.rs          lines for the parent process; parent_monitor.rs: the end of that process
//! log.rs             logs to standard error
//! metrics.rs         metrics in Prometheus' text format
//! packet_table.rs    the table of all packets
//! ```

mod certificates;
mod children;
mod denials;
mod dispatch;
mod drive;
mod fleet;
mod flight;
mod flight_recorder;
mod log;
mod mavlink;
mod metrics;
mod node;
mod one_thread;
mod output;
mod packet_table;
mod parent_monitor;
mod ros2;
mod scenario;
mod view;
mod watch;

use crate::identity::{CertificateName, VIEWER_NAME};
use output::print_message;
use parent_monitor::ParentMonitor;
use sidestep::kernel::InputError;
use sidestep::kernel::terminal::escape_controls;
use sidestep::worlds::WORLDS;
use sidestep_session::Error;
use sidestep_session::fleet::{
    CommonSettings, FlightNetwork, Job, JobError, LinkMessage, VehicleJob,
};
use std::io::BufRead;
use std::process::ExitCode;

/// Usage, for a user who starts the program by hand.
const USAGE: &str = "\
sidestep-link runs the server and the nodes of a fleet, shows runs to ROS 2, drives robots and leads vehicles. `sidestep fleet`, `node`,
`run --ros2`, `drive` and `dispatch` start it and tell it, in a line of JSON, what to do: see `sidestep fleet --help`.";

/// Does the job that standard input asks for. Exit codes are those of `sidestep`.
pub fn main() -> ExitCode {
    let mut words = std::env::args().skip(1);
    let read = match words.next().as_deref() {
        None => read_line(),
        Some(one_thread::JOB_WORD) => Ok(words.collect()),
        Some(word) => return print_help(word),
    };
    let job = read.and_then(|line| {
        let job = serde_json::from_str::<Job>(&line).map_err(|e| e.to_string())?;
        Ok((job, line))
    });
    match job {
        Ok((job, line)) if one_thread::is_missing_for(&job) => {
            one_thread::start_again(&line).unwrap_or_else(|error| report_result(Err(error)))
        }
        Ok((job, _)) => report_result(run_job(job)),
        Err(reason) => {
            let reason = escape_controls(&reason);
            eprintln!("error: this is no job: {reason}\n{USAGE}");
            ExitCode::from(2)
        }
    }
}

/// Reads a job from standard input.
///
/// # Errors
/// When it cannot be read.
fn read_line() -> Result<String, String> {
    let mut line = String::new();
    std::io::stdin().lock().read_line(&mut line).map_err(|e| e.to_string())?;
    Ok(line)
}

/// Answers a user who has started the program by hand.
fn print_help(word: &str) -> ExitCode {
    let is_version = ["--version", "-V"].contains(&word);
    let text = if is_version { program_and_build() } else { USAGE.into() };
    println!("{text}");
    let is_known = is_version || ["--help", "-h", "help"].contains(&word);
    ExitCode::from(if is_known { 0 } else { 2 })
}

fn program_and_build() -> String {
    format!("sidestep-link {}", WORLDS.build())
}

fn run_job(job: Job) -> Result<(), Error> {
    match job {
        Job::Fleet(job) => {
            apply_common_settings(&job.common, &job.listen)?;
            fleet::run(&job, &ParentMonitor::watch())
        }
        Job::Node(job) => {
            apply_common_settings(&job.common, job.connect.iter().chain(&job.listen))?;
            node::run(&job, None, &ParentMonitor::watch_node())
        }
        Job::Vehicle(VehicleJob { node: job, endpoint }) => {
            apply_common_settings(&job.common, job.connect.iter().chain(&job.listen))?;
            certificates::check_links([&endpoint], None, job.common.is_insecure)?;
            node::run(&job, Some(&endpoint), &ParentMonitor::watch_node())
        }
        Job::Watch(job) => {
            check_build(&job.build)?;
            certificates::check_viewer_encryption(&job)?;
            certificates::check_identity(
                job.tls.as_ref(),
                |name| matches!(name, CertificateName::Viewer | CertificateName::Server),
                VIEWER_NAME,
            )?;
            watch::watch_fleet(&job, &ParentMonitor::watch())
        }
        Job::Ros2(job) => {
            apply_common_settings(&job.common, job.connect.iter().chain(&job.listen))?;
            ros2::run(&job, &ParentMonitor::watch())
        }
        Job::Dispatch(job) => {
            log::start(job.json_log, &job.log, false)?;
            check_build(&job.planned.build)?;
            dispatch::run(&job, &ParentMonitor::watch())
        }
        Job::Drive(job) => {
            let network = &job.network;
            apply_common_settings(&job.common, network.connect.iter().chain(&network.listen))?;
            drive::run(&job, &ParentMonitor::watch())
        }
        Job::Flight(job) => {
            check_flight_network(&job.common, &job.network)?;
            flight::run(&job, &ParentMonitor::watch())
        }
        Job::FlightRecorder(job) => {
            check_flight_network(&job.common, &job.network)?;
            flight_recorder::run(&job, &ParentMonitor::watch())
        }
    }
}

/// Checks the options of a party of a flight without a server, and starts its log.
fn check_flight_network(common: &CommonSettings, network: &FlightNetwork) -> Result<(), Error> {
    apply_common_settings(common, network.listen.iter().chain(&network.peers))?;
    if let Some(address) = &common.metrics {
        let cause = "a flight without a server serves no metrics";
        let remedy = "leave it out; --json tells what was counted";
        return Err(InputError::new(format!("--metrics {address}"), cause, remedy).into());
    }
    if network.is_scouting && common.tls.is_none() && !common.is_insecure {
        let cause = "whoever is on this network would be found, and could take part";
        let remedy = "give --tls-ca, --tls-cert and --tls-key, or --insecure on a network that you trust; without \
                      --scout the parties are those of --peers";
        return Err(InputError::new("--scout", cause, remedy).into());
    }
    Ok(())
}

/// Checks the options that server and nodes share, and starts their log.
fn apply_common_settings<'a>(
    common: &CommonSettings,
    endpoints: impl IntoIterator<Item = &'a String>,
) -> Result<(), Error> {
    log::start(common.json_log, &common.log, common.tls.is_some())?;
    check_build(&common.flown.build)?;
    certificates::check_encryption(endpoints, common)?;
    Ok(())
}

/// Refuses the job of another build: results are the same only if server, nodes and command are of one build.
fn check_build(build: &str) -> Result<(), Error> {
    let own = WORLDS.build();
    if build == own {
        return Ok(());
    }
    let cause = format!("sidestep-link is of sidestep {own}, and the command of {build}");
    let remedy = "install both from the same source: cargo install --path crates/link";
    Err(InputError::new("sidestep-link", cause, remedy).into())
}

/// Reports why a job failed, and returns the exit code.
fn report_result(result: Result<(), Error>) -> ExitCode {
    let Err(error) = result else { return ExitCode::SUCCESS };
    let error = JobError::from(&error);
    let code = if error.is_input {
        2
    } else if error.is_interrupted {
        130
    } else {
        1
    };
    print_message(&LinkMessage::Failed(error));
    ExitCode::from(code)
}
