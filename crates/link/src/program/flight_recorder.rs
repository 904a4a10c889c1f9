//! The recorder of a flight without a server, as a process, with the nodes that it starts.

use super::certificates::{check_identity, credentials};
use super::children::NodeProcesses;
use super::fleet::WarningLogger;
use super::flight::{FlightScenario, listen_endpoints};
use super::node::endpoint_error;
use super::output::print_message;
use super::parent_monitor::ParentMonitor;
use crate::distributed::DistributedWorld;
use crate::flight::channel::{ChannelConfig, FlightChannel};
use crate::flight::recorder::{FlightRecorder, RecorderHooks};
use crate::flight::time::{FlightTime, WallClock};
use crate::hosted_run::HostedRun;
use crate::identity::{CertificateName, SERVER_NAME};
use crate::wire::PeerId;
use crate::wire::endpoint::{PortReservation, reserve_port, with_port};
use crate::wire::zenoh::{PeerOptions, ZenohWire};
use sidestep::kernel::EntityId;
use sidestep::worlds::WORLDS;
use sidestep_record::CycleOrigin;
use sidestep_session::fleet::{
    CommonSettings, FleetStatus, FlightClock, FlightJob, FlightNetwork, FlightRecorderJob, Job,
    LinkMessage,
};
use sidestep_session::{Error, ManagedRun, OutputPaths};
use std::collections::BTreeMap;
use std::path::Path;

/// Records a flight to its end, or until the parent process ends it.
///
/// # Errors
/// When anything is wrong with the job, a node does not begin, or results cannot be stored.
pub(super) fn run(job: &FlightRecorderJob, parent: &ParentMonitor) -> Result<(), Error> {
    let tls = job.common.tls.as_ref();
    check_identity(tls, |name| *name == CertificateName::Server, SERVER_NAME)?;
    // A run whose agents were elsewhere cannot be computed again without their controls.
    let further: &[String] =
        if job.out.is_some() { &["record.controls=true".to_string()] } else { &[] };
    let flown = FlightScenario::read(&job.common.flown, job.clock.speed, further)?;
    let scenario = flown.scenario;
    let world = scenario.world;
    let credentials = credentials(tls, world.as_ref());
    let listen = listen_endpoints(&job.network.listen)?;
    let ports = node_ports(job, world.as_ref())?;
    let nodes: Vec<String> = ports.iter().map(|port| port.endpoint.clone()).collect();
    // A run folder that is wrong is told before anything is started.
    let paths = OutputPaths {
        folder: job.out.as_deref(),
        mcap: None,
        replace: job.replace,
        cycle_origin: CycleOrigin::Flown,
    };
    let run = ManagedRun::start(&WORLDS, scenario.compiled.as_ref(), &scenario.source, 1, paths)?;
    run.note_removals(&WarningLogger);
    // Nodes bind their ports themselves.
    drop(ports);
    // It is removed with the flight's end.
    let journals = tempfile::tempdir().map_err(|error| {
        let cause = format!("the journals of the nodes have no folder: {error}");
        Error::other(cause, "set TMPDIR to a folder that can be written")
    })?;
    let jobs = node_jobs(job, &nodes, world.as_ref(), journals.path());
    let children = NodeProcesses::start(jobs, true)?;
    let peers: Vec<String> = nodes.into_iter().chain(job.network.peers.iter().cloned()).collect();
    let options =
        PeerOptions { is_scouting: job.network.is_scouting, credentials: credentials.as_ref() };
    let wire = ZenohWire::peer_wire(PeerId::Server, &listen, &peers, options);
    let wire = wire.map_err(endpoint_error)?;
    print_message(&LinkMessage::Listens(listen));
    let config = ChannelConfig {
        me: PeerId::Server,
        flight: flown.flight,
        tolerance_s: job.clock.tolerance_s,
        speed: job.clock.speed,
    };
    let channel = FlightChannel::new(config, Box::new(wire), WallClock::system(), None);
    let time = FlightTime {
        start_s: job.clock.start_s.unwrap_or(f64::INFINITY),
        speed: job.clock.speed,
        dt_s: world.cycle_s(),
    };
    let mut supervisor = FlightSupervisor { children, parent };
    let hosted = HostedRun::new(run, world, &WarningLogger);
    let recorder = FlightRecorder::new(channel, hosted, time, &mut supervisor);
    let mut recorder = recorder.with_run_up(job.guard.run_up_s);
    let listened = recorder.listen();
    let (status, hosted) = recorder.finish();
    supervisor.children.shut_down();
    finish(hosted.into_managed_run(), status, listened)
}

/// Stores and reports the results.
fn finish(run: ManagedRun, fleet: FleetStatus, listened: Result<(), Error>) -> Result<(), Error> {
    if let Err(error @ (Error::Record(_) | Error::Input(_))) = listened {
        // A recording that has failed would fail again.
        return Err(error);
    }
    let summary = run.finish(&WarningLogger)?;
    let outcome = summary.outcome.clone();
    let summary = serde_json::to_value(&summary).expect("summaries are plain data");
    print_message(&LinkMessage::Ended { summary, outcome, fleet });
    listened
}

/// Reserves a port for each node that is started here, so that all can be told where the others are.
fn node_ports(
    job: &FlightRecorderJob,
    world: &dyn DistributedWorld,
) -> Result<Vec<PortReservation>, Error> {
    let count = job.nodes.unwrap_or(usize::MAX).min(world.agent_count());
    let protocol = if job.common.tls.is_some() { "tls" } else { "tcp" };
    let loopback = format!("{protocol}/127.0.0.1:0");
    // Where the recorder listens others reach its machine.
    let address = job.network.listen.first().unwrap_or(&loopback);
    let any = with_port(address, 0);
    let ports: Result<Vec<PortReservation>, _> = (0..count).map(|_| reserve_port(&any)).collect();
    ports.map_err(endpoint_error)
}

/// Returns the jobs of the nodes that are started here, by their airplanes.
fn node_jobs(
    job: &FlightRecorderJob,
    endpoints: &[String],
    world: &dyn DistributedWorld,
    journals: &Path,
) -> BTreeMap<EntityId, Job> {
    let mut jobs = BTreeMap::new();
    for (agent, endpoint) in (0..).zip(endpoints) {
        // One link for each pair of nodes, opened by the one with the higher id.
        let lower = endpoints[..agent as usize].iter().cloned();
        let node = FlightJob {
            // One address for metrics cannot serve several processes.
            common: CommonSettings { metrics: None, ..job.common.clone() },
            agent: world.name(agent),
            clock: job.clock,
            network: FlightNetwork {
                listen: vec![endpoint.clone()],
                peers: lower.chain(job.network.peers.iter().cloned()).collect(),
                is_scouting: job.network.is_scouting,
            },
            plant: job.plant.clone(),
            guard: job.guard.clone(),
            journal: Some(journals.join(format!("airplane-{agent}.journal"))),
        };
        jobs.insert(agent, Job::Flight(Box::new(node)));
    }
    jobs
}

/// Looks after the nodes that were started here.
struct FlightSupervisor<'a> {
    children: NodeProcesses,
    parent: &'a ParentMonitor,
}

impl RecorderHooks for FlightSupervisor<'_> {
    fn poll(&mut self, start_s: Option<f64>) -> Result<(), Error> {
        if self.parent.has_ended() {
            return Err(Error::Interrupted);
        }
        // One that is started again joins a flight that has begun.
        let ended = self.children.poll_and_restart(|_, job| {
            if let (Job::Flight(node), Some(start_s)) = (job, start_s) {
                node.clock = FlightClock { start_s: Some(start_s), ..node.clock };
            }
        })?;
        // One that ends before the start would end again: its job is wrong.
        if let Some((agent, reason)) = ended.first().filter(|_| start_s.is_none()) {
            let cause =
                format!("the node of airplane {agent} has ended before the start: {reason}");
            return Err(Error::other(cause, "start the flight again; --log info tells more"));
        }
        for (agent, reason) in ended {
            tracing::warn!(agent, reason, "a node has ended");
        }
        Ok(())
    }

    fn report(&mut self, status: &FleetStatus) {
        print_message(&LinkMessage::Fleet(status.clone()));
    }
}
