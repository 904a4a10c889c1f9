//! A fleet: the server of a world as a process, with the nodes that it starts.

use super::certificates::{check_identity, credentials, with_signatures};
use super::children::NodeProcesses;
use super::denials::DenialLog;
use super::metrics::{MetricsExporter, fleet_metrics};
use super::node::endpoint_error;
use super::output::print_message;
use super::packet_table::PacketTable;
use super::parent_monitor::ParentMonitor;
use super::scenario::Scenario;
use super::view::{self, ViewPublisher};
use crate::distributed::DistributedWorld;
use crate::hosted_run::HostedRun;
use crate::identity::{CertificateName, SERVER_NAME};
use crate::messenger::Messenger;
use crate::protocol::{ClockMode, PacketRecord, Topology, Welcome};
use crate::server::histogram::Histogram;
use crate::server::{
    FleetContext, FleetError, FleetServer, NodeEntry, SILENCE_TIMEOUT, ServerConfig, ServerHooks,
};
use crate::wire::endpoint::{
    PortReservation, WireSetupError, check_reachable, reserve_port, with_port,
};
use crate::wire::view_server::ViewServer;
use crate::wire::zenoh::ZenohWire;
use crate::wire::{PeerId, draw_group};
use sidestep::kernel::ports::RecordError;
use sidestep::kernel::shell::sidestep_command;
use sidestep::kernel::view::Frame;
use sidestep::kernel::{Cycle, EntityId, Simulation};
use sidestep::worlds::WORLDS;
use sidestep_record::CycleOrigin;
use sidestep_session::fleet::{
    CommonSettings, FleetJob, FleetScene, FleetStatus, Job, LinkMessage, NodeJob, NodeStatus,
};
use sidestep_session::{Error, ManagedRun, OutputPaths, Watcher};
use std::collections::BTreeMap;
use std::net::SocketAddrV4;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time between two reports to the parent process: nodes report as often.
const REPORT_INTERVAL: Duration = Duration::from_millis(500);

/// Minimum time in seconds that nodes wait for the server to answer: on a busy machine many processes start at once.
const MIN_JOIN_TIMEOUT_S: f64 = 30.0;

/// Runs a fleet to its end.
///
/// # Errors
/// When anything is wrong with the job, a node is lost in lockstep, or results cannot be stored.
pub(super) fn run(job: &FleetJob, parent: &ParentMonitor) -> Result<(), Error> {
    let tls = job.common.tls.as_ref();
    check_identity(tls, |name| *name == CertificateName::Server, SERVER_NAME)?;
    if job.topology == Topology::Multicast && job.nodes.is_some() {
        // The interface by which a node reaches the server carries its packets: it must be the same network for all.
        job.listen.iter().try_for_each(|at| check_reachable(at)).map_err(endpoint_error)?;
    }
    let scenario = Scenario::read(&job.common.flown)?;
    // Before the overrides: nodes are given the scenario without them, and must find the same fingerprint.
    let fingerprint = scenario.fingerprint()?;
    let overrides = scenario.required_overrides(job.clock, job.out.is_some());
    let scenario = scenario.with_overrides(&overrides)?;
    let listen = resolve_ports(&job.listen).map_err(endpoint_error)?;
    let credentials = credentials(tls, scenario.world.as_ref());
    let wire = ZenohWire::server_wire(&listen, credentials.as_ref()).map_err(endpoint_error)?;
    let exporter = MetricsExporter::serve_at(job.common.metrics.as_deref())?;
    let cycle_origin = match job.clock {
        ClockMode::Lockstep => CycleOrigin::Simulated,
        ClockMode::Realtime { .. } => CycleOrigin::Flown,
    };
    let folder = job.out.as_deref();
    let paths = OutputPaths { folder, mcap: None, replace: job.replace, cycle_origin };
    // One worker, because the agents' decisions, which take most of the time, are made by the nodes.
    let run = ManagedRun::start(&WORLDS, scenario.compiled.as_ref(), &scenario.source, 1, paths)?;
    run.note_removals(&WarningLogger);
    print_message(&LinkMessage::Listens(listen.clone()));
    let scene = view::scene_json(&viewer_scene(run.simulation()));
    let views = ViewPublisher::new(ViewServer::start(&wire, scene).map_err(endpoint_error)?);
    let messenger = Messenger::new(PeerId::Server, Box::new(wire));
    let messenger = with_signatures(messenger, credentials.as_ref())?;
    let config = ServerConfig {
        scenario: fingerprint,
        build: WORLDS.build().into(),
        welcome: Welcome {
            clock: job.clock,
            topology: job.topology,
            multicast_group: multicast_group(job),
            overrides,
            logs_packets: job.packets,
        },
        lease: Duration::from_secs_f64(job.common.lease_s),
        has_faults: scenario.world.has_faults(),
    };
    let jobs = node_jobs(job, &listen, scenario.world.as_ref());
    // Where the loss of a node ends the fleet, starting it again is of no use.
    let restarts = job.clock != ClockMode::Lockstep || scenario.world.waits_for_lost_nodes();
    let children = NodeProcesses::start(jobs, restarts)?;
    let run_config = run.simulation().config();
    let mut supervisor = FleetSupervisor::new(children, parent, run_config.cycles, exporter, views);
    supervisor.denials = DenialLog::new(credentials.as_ref());
    supervisor.packets = create_packet_table(job, &scenario.source.text, run_config.seed)?;
    let mut run = HostedRun::new(run, scenario.world, &WarningLogger);
    let (result, _) = FleetServer::new(messenger, &mut run, &mut supervisor, config).run();
    supervisor.children.shut_down();
    let result = result.and_then(|()| supervisor.finish_packets());
    let FleetSupervisor { status, views, .. } = supervisor;
    let finished = finish(run.into_managed_run(), result, status, job.clock);
    views.wait_for_viewers();
    finished
}

/// Returns the group of all nodes, where they have one.
fn multicast_group(job: &FleetJob) -> Option<SocketAddrV4> {
    match job.topology {
        Topology::Mesh | Topology::Star => None,
        Topology::Multicast => Some(job.multicast_group.unwrap_or_else(draw_group)),
    }
}

/// Returns the unchanging part of a run, for viewers.
fn viewer_scene(run: &dyn Simulation) -> FleetScene {
    FleetScene {
        build: WORLDS.build().into(),
        world: run.world_name().into(),
        agent: run.agent_noun().into(),
        seed: run.config().seed,
        scenery: run.scenery(),
    }
}

/// Returns a quantile of durations in milliseconds; `None` without durations.
fn quantile_ms(durations: &Histogram, fraction: f64) -> Option<f64> {
    durations.quantile(fraction).map(|s| 1e3 * s)
}

/// Returns the increase of a count; 0 for a process that was restarted meanwhile, which counts from 0.
fn counter_increase(last: u64, now: u64) -> f64 {
    now.saturating_sub(last) as f64
}

/// Creates the table of all packets, if the job asks for one.
fn create_packet_table(
    job: &FleetJob,
    text: &str,
    seed: u64,
) -> Result<Option<PacketTable>, RecordError> {
    let folder = job.out.as_ref().filter(|_| job.packets);
    folder.map(|folder| PacketTable::create(folder, text, seed, job.clock)).transpose()
}

/// Returns the endpoints at which the server listens, with a port in place of each 0.
fn resolve_ports(listen: &[String]) -> Result<Vec<String>, WireSetupError> {
    // All ports are reserved at once, so that they differ; the server binds them right afterwards.
    let ports: Vec<PortReservation> =
        listen.iter().map(|endpoint| reserve_port(endpoint)).collect::<Result<_, _>>()?;
    Ok(ports.into_iter().map(|port| port.endpoint).collect())
}

/// Returns the jobs of the nodes that are started here, by their agents.
fn node_jobs(
    job: &FleetJob,
    connect: &[String],
    world: &dyn DistributedWorld,
) -> BTreeMap<EntityId, Job> {
    let listen = match job.topology {
        // The server's own address will do: these nodes are on its machine.
        Topology::Mesh => vec![with_port(&connect[0], 0)],
        Topology::Star | Topology::Multicast => Vec::new(),
    };
    let count = job.nodes.unwrap_or(usize::MAX).min(world.agent_count());
    let mut jobs = BTreeMap::new();
    for agent in 0..count as EntityId {
        let job = NodeJob {
            // One address for metrics cannot serve several processes.
            common: CommonSettings { metrics: None, ..job.common.clone() },
            agent: world.name(agent),
            connect: connect.to_vec(),
            listen: listen.clone(),
            patience_s: job.common.lease_s.max(MIN_JOIN_TIMEOUT_S),
        };
        jobs.insert(agent, Job::Node(job));
    }
    jobs
}

/// Stores and reports the results.
fn finish(
    run: ManagedRun,
    result: Result<(), FleetError>,
    fleet: FleetStatus,
    clock: ClockMode,
) -> Result<(), Error> {
    if let Err(FleetError::World(error)) = result {
        // A recording that has failed would fail again.
        return Err(error);
    }
    let summary = run.finish(&WarningLogger)?;
    let folder = summary.folder.clone();
    let outcome = summary.outcome.clone();
    let summary = serde_json::to_value(&summary).expect("summaries are plain data");
    print_message(&LinkMessage::Ended { summary, outcome, fleet });
    match result {
        Ok(()) => Ok(()),
        Err(FleetError::Interrupted) => Err(Error::Interrupted),
        Err(FleetError::World(error)) => Err(error),
        Err(lost @ FleetError::NodeLost { .. }) => {
            let remedy = match folder {
                Some(folder) if clock != ClockMode::Lockstep => {
                    format!("what was flown is kept: `{}`", sidestep_command("report", folder))
                }
                Some(folder) => {
                    format!("continue without nodes: `{}`", sidestep_command("resume", folder))
                }
                None => "start the fleet again; with --out DIR it could be resumed".into(),
            };
            Err(Error::other(lost.to_string(), remedy))
        }
    }
}

/// The watcher of the run, which only logs: the run advances by one cycle at a time, and the [`FleetSupervisor`] decides
/// when to stop.
pub(super) struct WarningLogger;

impl Watcher for WarningLogger {
    fn warn(&self, error: &Error) {
        tracing::warn!("{error}");
    }

    fn note_removal(&self, leftover: &Path) {
        tracing::warn!("removed {}, which a killed process left there", leftover.display());
    }
}

/// The hooks of the server: watches child processes and the parent process, and reports the state of the fleet.
struct FleetSupervisor<'a> {
    children: NodeProcesses,
    parent: &'a ParentMonitor,
    cycles: Cycle,
    exporter: MetricsExporter,
    views: ViewPublisher,
    denials: DenialLog,
    report_at: Instant,
    /// Time at which all nodes had joined.
    begun_at: Option<Instant>,
    status: FleetStatus,
    /// Time of the last status.
    status_at: Instant,
    /// Packets and bytes of each node at that time.
    traffic: BTreeMap<EntityId, (u64, u64)>,
    /// The table of all packets, if the job asks for one.
    packets: Option<PacketTable>,
    /// The reason why it cannot be written.
    packet_error: Option<RecordError>,
}

impl<'a> FleetSupervisor<'a> {
    fn new(
        children: NodeProcesses,
        parent: &'a ParentMonitor,
        cycles: Cycle,
        exporter: MetricsExporter,
        views: ViewPublisher,
    ) -> Self {
        let now = Instant::now();
        Self {
            children,
            parent,
            cycles,
            exporter,
            views,
            denials: DenialLog::default(),
            report_at: now,
            begun_at: None,
            status: FleetStatus { cycles, ..FleetStatus::default() },
            status_at: now,
            traffic: BTreeMap::new(),
            packets: None,
            packet_error: None,
        }
    }

    /// Completes the table of packets.
    fn finish_packets(&mut self) -> Result<(), FleetError> {
        let finished = self.packets.take().map_or(Ok(()), PacketTable::finish);
        let stored = self.packet_error.take().map_or(finished, Err);
        stored.map_err(|e| FleetError::World(e.into()))
    }

    fn update_status(&mut self, fleet: &FleetContext<'_>) {
        // Two updates may follow each other at once, at the end.
        let passed_s = self.status_at.elapsed().as_secs_f64().max(1e-3);
        self.status_at = Instant::now();
        let mut nodes = Vec::new();
        for (&agent, node) in fleet.nodes {
            nodes.push(self.node_status(fleet, agent, node, passed_s));
        }
        let world = fleet.run.world();
        let decision_time = &fleet.metrics.decision_time;
        self.status = FleetStatus {
            cycle: fleet.run.cycle(),
            cycles: self.cycles,
            has_begun: fleet.has_begun,
            flown_s: self.begun_at.map_or(0.0, |begun_at| begun_at.elapsed().as_secs_f64()),
            late_cycles: fleet.metrics.late_cycles,
            talk_p50_ms: quantile_ms(decision_time, 0.5),
            talk_p99_ms: quantile_ms(decision_time, 0.99),
            server_frame_bytes: fleet.messenger.stats().bytes,
            noun: world.name(0).noun.into(),
            waits_for: fleet.waits_for.iter().map(|&agent| world.name(agent).to_string()).collect(),
            nodes,
        };
    }

    /// Returns the present state of a node, a number of seconds after the last status.
    fn node_status(
        &mut self,
        fleet: &FleetContext<'_>,
        agent: EntityId,
        node: &NodeEntry,
        passed_s: f64,
    ) -> NodeStatus {
        let status = &node.status;
        let last_traffic = self.traffic.insert(agent, (status.packets, status.bytes));
        let (last_packets, last_bytes) = last_traffic.unwrap_or_default();
        let silent = fleet.messenger.silent_for(PeerId::Node(agent));
        let state = match &node.member {
            None => "awaited",
            Some(_) if node.is_lost => "gone",
            Some(_) if silent.is_some_and(|silent| silent > SILENCE_TIMEOUT) => "silent",
            Some(_) if !fleet.has_begun => "joined",
            Some(_) if node.control.is_some() => "done",
            Some(_) => &status.activity,
        };
        let name = fleet.run.world().name(agent);
        NodeStatus {
            agent,
            name: name.to_string(),
            number: name.number,
            part: name.part,
            state: state.into(),
            process: node.member.as_ref().map(|_| node.process),
            epoch: status.epoch,
            heard: status.heard.len(),
            heard_of: status.heard.clone(),
            round: status.round,
            flown: node.carried_out,
            late: node.late,
            lives: node.joins,
            packets: status.packets,
            bytes: status.bytes,
            frame_bytes: status.frame_bytes,
            processor_ms: status.processor_ms,
            packets_per_s: counter_increase(last_packets, status.packets) / passed_s,
            bytes_per_s: counter_increase(last_bytes, status.bytes) / passed_s,
            silent_s: silent.map(|silent| silent.as_secs_f64()),
            ..NodeStatus::default()
        }
    }

    fn report(&mut self, fleet: &FleetContext<'_>) {
        self.update_status(fleet);
        self.exporter.replace_text(|| fleet_metrics(&self.status, fleet));
        print_message(&LinkMessage::Fleet(self.status.clone()));
        if self.views.is_watched() {
            self.views.publish_view(&self.status, false);
        }
    }
}

impl ServerHooks for FleetSupervisor<'_> {
    fn on_poll(&mut self, fleet: &FleetContext<'_>) -> Result<Vec<(EntityId, String)>, FleetError> {
        if self.parent.has_ended() {
            return Err(FleetError::Interrupted);
        }
        if let Some(error) = self.packet_error.take() {
            return Err(FleetError::World(error.into()));
        }
        if fleet.has_begun {
            self.begun_at.get_or_insert_with(Instant::now);
        }
        if Instant::now() >= self.report_at {
            self.report_at = Instant::now() + REPORT_INTERVAL;
            self.denials.report();
            self.report(fleet);
        }
        let ended = self.children.poll_and_restart(|agent, job| {
            let member = fleet.nodes.get(&agent).and_then(|node| node.member.as_ref());
            if let (Job::Node(job), Some(member)) = (job, member) {
                job.listen.clone_from(&member.listens);
            }
        })?;
        // A node that ends before it has joined would end again: its job is wrong.
        if let Some((agent, reason)) = ended.first().filter(|_| !fleet.has_begun) {
            return Err(FleetError::NodeLost {
                agent: fleet.run.agent_display_name(*agent),
                cycle: fleet.run.cycle(),
                reason: reason.clone(),
            });
        }
        Ok(ended)
    }

    fn poll_farewell(&mut self) -> Result<Vec<EntityId>, FleetError> {
        if self.parent.has_ended() {
            return Err(FleetError::Interrupted);
        }
        Ok(self.children.poll_exits().into_iter().map(|(agent, _)| agent).collect())
    }

    fn on_end(&mut self, fleet: &FleetContext<'_>) {
        self.denials.report();
        self.update_status(fleet);
        self.views.publish_view(&self.status, true);
    }

    fn wants_frame(&self, cycle: Cycle) -> bool {
        self.views.wants_frame(cycle)
    }

    fn on_view_frame(&mut self, frame: Frame) {
        self.status.cycle = frame.cycle;
        self.views.push_frame(frame);
        self.views.publish_view(&self.status, false);
    }

    fn on_packets(&mut self, packets: Vec<(EntityId, PacketRecord)>) {
        if let Some(table) = &mut self.packets
            && let Err(error) = table.add(packets)
        {
            self.packet_error = Some(error);
        }
    }
}
