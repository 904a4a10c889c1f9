//! A node as a process.

use super::certificates::{check_identity, check_names, credentials, with_signatures};
use super::denials::DenialLog;
use super::metrics::{MetricsExporter, node_metrics};
use super::output::print_message;
use super::parent_monitor::ParentMonitor;
use super::scenario::Scenario;
use crate::identity::CertificateName;
use crate::messenger::Messenger;
use crate::node::{JoinConfig, Node, NodeError, Seat, join};
use crate::protocol::{JoinError, JoinRequest};
use crate::vehicle::ZenohPort;
use crate::wire::PeerId;
use crate::wire::endpoint::{
    PortReservation, WireSetupError, check_reachable, host_and_port, reserve_port,
};
use crate::wire::zenoh::ZenohWire;
use sidestep::kernel::InputError;
use sidestep::worlds::WORLDS;
use sidestep_session::Error;
use sidestep_session::fleet::{AgentName, LinkMessage, NodeJob};
use std::time::Duration;

/// Runs one agent until the server ends the fleet. Where there is an endpoint for its vehicle, that decides.
///
/// # Errors
/// When anything is wrong with the job, or the server is gone.
pub(super) fn run(
    job: &NodeJob,
    vehicle: Option<&String>,
    monitor: &ParentMonitor,
) -> Result<(), Error> {
    job.connect.iter().try_for_each(|at| host_and_port(at).map(drop)).map_err(endpoint_error)?;
    job.listen.iter().try_for_each(|at| check_reachable(at)).map_err(endpoint_error)?;
    let scenario = Scenario::read(&job.common.flown)?;
    let agent = scenario.world.find_agent_id(&job.agent)?;
    let tls = job.common.tls.as_ref();
    let wanted = CertificateName::Agent(job.agent.clone()).to_string();
    check_identity(tls, |name| name.may_run(&job.agent), &wanted)?;
    check_names(tls, &job.listen)?;
    let ports: Vec<PortReservation> = job
        .listen
        .iter()
        .map(|endpoint| reserve_port(endpoint))
        .collect::<Result<_, _>>()
        .map_err(endpoint_error)?;
    if vehicle.is_some() && !scenario.world.has_vehicles() {
        let cause =
            format!("there are no public messages for an agent of the kind `{}`", job.agent.noun);
        let remedy =
            "leave it out, and the node decides by itself; robots alone may have a vehicle";
        return Err(InputError::new("--vehicle", cause, remedy).into());
    }
    let port = vehicle.map(|endpoint| serve_vehicle(&job.agent, endpoint)).transpose()?;
    let exporter = MetricsExporter::serve_at(job.common.metrics.as_deref())?;
    let timeout = Duration::from_secs_f64(job.patience_s);
    let build = WORLDS.build();
    let mut request = JoinRequest {
        agent,
        scenario: scenario.fingerprint()?,
        build: build.into(),
        listens: ports.iter().map(|port| port.endpoint.clone()).collect(),
        process: std::process::id(),
        session: None,
    };
    let credentials = credentials(tls, scenario.world.as_ref());
    let wire =
        ZenohWire::node_wire(PeerId::Node(agent), &job.connect, credentials.as_ref(), timeout)
            .map_err(endpoint_error)?
            .with_listeners(ports);
    // From the first link on: what is denied while it joins may be the reason why it does not.
    let mut denials = DenialLog::new(credentials.as_ref());
    let messenger = Messenger::new(PeerId::Node(agent), Box::new(wire));
    let mut messenger = with_signatures(messenger, credentials.as_ref())?;
    request.session = messenger.session();
    let welcome = join(&mut messenger, &JoinConfig { join: request, timeout })
        .map_err(|e| node_error(e, job))?;
    monitor.record_seat();
    let mut seat = Seat::new(messenger);
    if let Some(group) = welcome.multicast_group {
        let joined = seat.join_multicast(group).map_err(endpoint_error);
        joined.inspect_err(|error| seat.leave(&error.to_string()))?;
    }
    let scenario = scenario.with_overrides(&welcome.overrides).inspect_err(|error| {
        seat.leave(&error.to_string());
    })?;
    let program = match port {
        None => Some(scenario.world.program(agent, build)),
        Some(port) => scenario.world.vehicle_program(agent, Box::new(port)),
    };
    let program = program.expect("`has_vehicles` was checked");
    let channel = scenario.world.channel(agent);
    let name = job.agent.clone();
    tracing::info!(agent, who = format!("{} {name}", name.noun), "joined");
    let interrupt = monitor.clone();
    let node = Node::new(agent, seat, program, channel, &welcome)
        .with_server_timeout(Duration::from_secs_f64(job.common.lease_s))
        .with_status_listener(move |status| {
            denials.report();
            exporter.replace_text(|| node_metrics(&name, status));
        })
        .with_interrupt(move || interrupt.has_ended());
    node.run().map(drop).map_err(|e| node_error(e, job))
}

/// Serves the vehicle of an agent, and says where.
fn serve_vehicle(agent: &AgentName, endpoint: &str) -> Result<ZenohPort, Error> {
    let reserved = reserve_port(endpoint).map_err(endpoint_error)?;
    let endpoint = reserved.endpoint.clone();
    // Zenoh binds the port itself.
    drop(reserved);
    let port = ZenohPort::serve(agent, &endpoint).map_err(endpoint_error)?;
    print_message(&LinkMessage::Listens(vec![endpoint]));
    Ok(port)
}

/// Converts the error of a wire that could not be made.
pub(super) fn endpoint_error(error: WireSetupError) -> Error {
    let cause = error.to_string();
    match error {
        WireSetupError::NoEndpoint { endpoint, .. } => {
            let remedy = "write it as tcp/HOST:PORT, or tls/HOST:PORT with certificates";
            InputError::new(endpoint, cause, remedy).into()
        }
        WireSetupError::Taken { endpoint, .. } => {
            let remedy =
                "give an address of this machine and a free port; port 0 stands for any free one";
            InputError::new(endpoint, cause, remedy).into()
        }
        WireSetupError::Distrust { endpoint, .. } => {
            let remedy = "have the certificates of all parties made by one authority, for the names or addresses at \
                          which they are reached, and give them by --tls-ca, --tls-cert and --tls-key";
            InputError::new(endpoint, cause, remedy).into()
        }
        WireSetupError::NoAnswer { .. } => {
            let remedy = "start the fleet first, and see whether its address can be reached; where it asks for \
                          certificates, give --tls-ca, --tls-cert and --tls-key";
            Error::other(cause, remedy)
        }
    }
}

fn node_error(error: NodeError, job: &NodeJob) -> Error {
    let cause = error.to_string();
    match error {
        NodeError::Refused(JoinError { remedy, .. }) => {
            InputError::new(job.connect.join(", "), cause, remedy).into()
        }
        NodeError::Wire(error) => endpoint_error(error),
        NodeError::Interrupted => Error::Interrupted,
        NodeError::Dismissed(JoinError { remedy, .. }) => Error::other(cause, remedy),
        NodeError::ServerSilent(_) => {
            Error::other(cause, "see whether the server runs, and start both again")
        }
        NodeError::Percept(_) => Error::other(cause, "please report it with the scenario"),
    }
}
