//! A run as a node of ROS 2.

use super::fleet::WarningLogger;
use super::output::print_message;
use super::parent_monitor::ParentMonitor;
use crate::ros2::node::RosNode;
use crate::ros2::run::{RosRun, RosRunError, RunPace};
use crate::wire::endpoint::{WireSetupError, reserve_port};
use sidestep::kernel::InputError;
use sidestep::worlds::WORLDS;
use sidestep_session::fleet::{FleetStatus, LinkMessage, Ros2Job};
use sidestep_session::{Error, ManagedRun, OutputPaths};

/// Runs a scenario as a node of ROS 2, to its end or until the parent process ends it.
///
/// # Errors
/// When anything is wrong with the job, an endpoint is taken, no router answers, or results cannot be stored.
pub(super) fn run(job: &Ros2Job, parent: &ParentMonitor) -> Result<(), Error> {
    let flown = &job.common.flown;
    let (source, compiled) =
        sidestep_session::read_scenario(&WORLDS, &flown.file, &flown.overrides)?;
    let job = Ros2Job { listen: with_ports(&job.listen)?, ..job.clone() };
    // Before the run: an address that cannot be used is refused before a folder is made.
    let mut node = RosNode::join(&job).map_err(network_error)?;
    let folder = job.out.as_deref();
    let paths = OutputPaths { folder, replace: job.replace, ..OutputPaths::default() };
    let run = ManagedRun::start(&WORLDS, compiled.as_ref(), &source, job.workers, paths)?;
    run.note_removals(&WarningLogger);
    print_message(&LinkMessage::Listens(job.listen.clone()));
    let pace = RunPace { speed: job.speed, starts_paused: job.starts_paused };
    let mut run = RosRun::start(run, &mut node, pace, &WarningLogger).map_err(run_error)?;
    print_message(&LinkMessage::Ros2(run.graph()));
    let passed = run.pass(&|| parent.has_ended());
    let run = run.into_managed_run();
    let ended = finish(run, passed);
    node.leave();
    ended
}

/// Stores and reports the results.
fn finish(run: ManagedRun, passed: Result<(), RosRunError>) -> Result<(), Error> {
    if let Err(RosRunError::Run(error)) = passed {
        // A recording that has failed would fail again.
        return Err(error);
    }
    let cycles = run.simulation().config().cycles;
    let fleet = FleetStatus { cycle: run.cycle(), cycles, ..FleetStatus::default() };
    let summary = run.finish(&WarningLogger)?;
    let outcome = summary.outcome.clone();
    let summary = serde_json::to_value(&summary).expect("summaries are plain data");
    print_message(&LinkMessage::Ended { summary, outcome, fleet });
    passed.map_err(run_error)
}

fn run_error(error: RosRunError) -> Error {
    match error {
        RosRunError::Interrupted => Error::Interrupted,
        RosRunError::Wire(error) => network_error(error),
        RosRunError::Run(error) => error,
    }
}

/// Returns endpoints with a free port in the place of each 0.
pub(super) fn with_ports(listen: &[String]) -> Result<Vec<String>, Error> {
    let mut endpoints = Vec::new();
    // All ports are reserved at once, so that they differ; the node binds them right afterwards.
    let mut reserved = Vec::new();
    for endpoint in listen {
        let port = reserve_port(endpoint).map_err(network_error)?;
        endpoints.push(port.endpoint.clone());
        reserved.push(port);
    }
    Ok(endpoints)
}

pub(super) fn network_error(error: WireSetupError) -> Error {
    let cause = error.to_string();
    match error {
        WireSetupError::NoEndpoint { endpoint, .. } => {
            InputError::new(endpoint, cause, "write it as tcp/HOST:PORT").into()
        }
        WireSetupError::Taken { endpoint, .. } => {
            let remedy = format!(
                "if a router of ROS 2 listens there, join it by --connect {endpoint}; else give another port by --listen"
            );
            InputError::new(endpoint, cause, remedy).into()
        }
        WireSetupError::NoAnswer { .. } | WireSetupError::Distrust { .. } => {
            let remedy = "start the router first (ros2 run rmw_zenoh_cpp rmw_zenohd), or leave --connect out: then this \
                          node is the router";
            Error::other(cause, remedy)
        }
    }
}
