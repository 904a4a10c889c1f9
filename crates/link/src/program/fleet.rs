//! A fleet: the server of a world as a process, with the nodes that it starts.

use super::children::NodeProcesses;
use super::metrics;
use super::node::endpoint_error;
use super::output::print_message;
use super::packet_table::PacketTable;
use super::parent_monitor::ParentMonitor;
use super::scenario::Scenario;
use super::view::{self, ViewPublisher};
use crate::distributed::DistributedWorld;
use crate::hosted_run::HostedRun;
use crate::messenger::Messenger;
use crate::protocol::{ClockMode, PacketRecord, Topology, Welcome};
use crate::server::{
    FleetError, FleetView, NodeEntry, SILENCE_TIMEOUT, Server, ServerConfig, ServerHooks,
};
use crate::wire::Peer;
use crate::wire::endpoint::{WireError, reserve_port};
use crate::wire::view_server::ViewServer;
use crate::wire::zenoh::ZenohWire;
use sidestep::kernel::ports::RecordError;
use sidestep::kernel::view::Frame;
use sidestep::kernel::{Cycle, EntityId, Simulation};
use sidestep::worlds::WORLDS;
use sidestep_session::fleet::{
    CommonSettings, FleetJob, FleetScene, FleetStatus, LinkMessage, NodeJob, NodeStatus,
};
use sidestep_session::{Error, ManagedRun, OutputPaths, Watcher};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Time between two reports.
const REPORT_INTERVAL: Duration = Duration::from_millis(500);

/// Flies a fleet to its end.
///
/// # Errors
/// When anything is wrong with the job, a node is gone in lockstep, or results cannot be stored.
pub(super) fn fly(job: &FleetJob, lifeline: &ParentMonitor) -> Result<(), Error> {
    let scenario = Scenario::read(&job.common.flown)?;
    let fingerprint = scenario.fingerprint()?;
    let overrides = scenario.required_overrides(job.clock, job.out.is_some());
    let scenario = scenario.with_overrides(&overrides)?;
    let listen = bound_endpoints(&job.listen).map_err(endpoint_error)?;
    let wire = ZenohWire::server(&listen, job.common.tls.as_ref()).map_err(endpoint_error)?;
    let told = metrics::MetricsExporter::open(job.common.metrics.as_deref())?;
    let keep = OutputPaths { folder: job.out.as_deref(), mcap: None, replace: job.replace };
    let journey =
        ManagedRun::start(&WORLDS, scenario.compiled.as_ref(), &scenario.source, 1, keep)?;
    print_message(&LinkMessage::Listens(listen.clone()));
    let scene = view::scene_json(&fleet_scene(journey.simulation()));
    let shown = ViewPublisher::new(ViewServer::open(&wire, scene).map_err(endpoint_error)?);
    let mail = Messenger::new(Peer::Server, Box::new(wire));
    let welcome =
        Welcome { clock: job.clock, topology: job.topology, overrides, logs_packets: job.packets };
    let terms = ServerConfig {
        scenario: fingerprint,
        build: WORLDS.build().into(),
        welcome,
        lease: Duration::from_secs_f64(job.common.lease_s),
        has_faults: scenario.world.has_faults(),
    };
    let jobs = node_jobs(job, &listen, scenario.world.as_ref());
    let restarts = job.clock != ClockMode::Lockstep || scenario.world.waits_for_lost_nodes();
    let crew = NodeProcesses::start(jobs, restarts)?;
    let mut stage = HostedRun::new(journey, scenario.world, &TracingWatcher);
    let plan = stage.run().config().clone();
    let mut captain = FleetSupervisor::new(crew, lifeline, plan.cycles, told, shown);
    captain.packets = create_packet_table(job, &scenario.source.text, plan.seed)?;
    let (flown, _) = Server::new(mail, &mut stage, &mut captain, terms).run();
    captain.crew.shut_down();
    let flown = flown.and_then(|()| captain.finish_packets());
    let FleetSupervisor { now, shown, .. } = captain;
    let done = finish(stage.into_managed_run(), flown, now);
    shown.wait_for_viewers();
    done
}

/// Returns the unchanging part of a run that is watched.
fn fleet_scene(run: &dyn Simulation) -> FleetScene {
    FleetScene {
        build: WORLDS.build().into(),
        world: run.world().into(),
        agent: run.agent().into(),
        seed: run.config().seed,
        scenery: run.scenery(),
    }
}

/// Begins the table of all packets, if it is wanted.
fn create_packet_table(
    job: &FleetJob,
    text: &str,
    seed: u64,
) -> Result<Option<PacketTable>, RecordError> {
    let folder = job.out.as_ref().filter(|_| job.packets);
    folder.map(|folder| PacketTable::create(folder, text, seed)).transpose()
}

/// Returns the endpoints at which the server listens, each with a port.
fn bound_endpoints(listen: &[String]) -> Result<Vec<String>, WireError> {
    // The ports are free again when the list is complete, and taken right away.
    let held =
        listen.iter().map(|endpoint| reserve_port(endpoint)).collect::<Result<Vec<_>, _>>()?;
    Ok(held.into_iter().map(|held| held.endpoint).collect())
}

/// Returns the jobs of the nodes that are started here, by their agents' ids.
fn node_jobs(
    job: &FleetJob,
    connect: &[String],
    world: &dyn DistributedWorld,
) -> BTreeMap<EntityId, NodeJob> {
    let any = match job.topology {
        // As with the server's own: these nodes are on its machine.
        Topology::Mesh => vec![with_any_port(&connect[0])],
        Topology::Star => Vec::new(),
    };
    let one = |agent| {
        let job = NodeJob {
            common: CommonSettings { metrics: None, ..job.common.clone() },
            agent: world.name(agent),
            connect: connect.to_vec(),
            listen: any.clone(),
            patience_s: job.common.lease_s.max(30.0),
        };
        (agent, job)
    };
    let count = job.nodes.unwrap_or(usize::MAX).min(world.count());
    (0..count as EntityId).map(one).collect()
}

fn with_any_port(endpoint: &str) -> String {
    let host = endpoint.rsplit_once(':').map_or(endpoint, |(host, _)| host);
    format!("{host}:0")
}

/// Stores and tells the results.
fn finish(
    journey: ManagedRun,
    flown: Result<(), FleetError>,
    fleet: FleetStatus,
) -> Result<(), Error> {
    if let Err(FleetError::World(error)) = flown {
        // A record that failed before would fail again.
        return Err(error);
    }
    let summary = journey.finish(&TracingWatcher)?;
    let (folder, outcome) = (summary.folder.clone(), summary.outcome.clone());
    let summary = serde_json::to_value(&summary).expect("summaries are plain data");
    print_message(&LinkMessage::Ended { summary, outcome, fleet });
    match flown {
        Ok(()) => Ok(()),
        Err(FleetError::Interrupted) => Err(Error::Interrupted),
        Err(FleetError::World(error)) => Err(error),
        Err(gone @ FleetError::Gone { .. }) => {
            let remedy = match folder {
                Some(folder) => {
                    format!("go on without nodes: sidestep resume {}", folder.display())
                }
                None => "start the fleet again; with --out DIR it could be resumed".into(),
            };
            Err(Error::other(gone.to_string(), remedy))
        }
    }
}

/// The program as a watcher of the run, which goes on cycle by cycle: the attendant of the fleet decides when to
/// stop.
struct TracingWatcher;

impl Watcher for TracingWatcher {
    fn warn(&self, error: &Error) {
        tracing::warn!("{error}");
    }
}

/// The attendant of the fleet: looks after nodes, and tells the fleet's state.
struct FleetSupervisor<'a> {
    crew: NodeProcesses,
    lifeline: &'a ParentMonitor,
    cycles: u64,
    board: metrics::MetricsExporter,
    shown: ViewPublisher,
    report_at: Instant,
    /// Time at which all nodes had joined.
    began: Option<Instant>,
    now: FleetStatus,
    /// Packets and bytes of each node at the last report, and its time.
    before: BTreeMap<EntityId, (u64, u64)>,
    reported: Instant,
    /// The table of all packets, if it is wanted.
    packets: Option<PacketTable>,
    /// The reason why it cannot be written.
    unwritten: Option<RecordError>,
}

impl<'a> FleetSupervisor<'a> {
    fn new(
        crew: NodeProcesses,
        lifeline: &'a ParentMonitor,
        cycles: u64,
        board: metrics::MetricsExporter,
        shown: ViewPublisher,
    ) -> Self {
        let now = Instant::now();
        Self {
            crew,
            lifeline,
            cycles,
            board,
            shown,
            report_at: now,
            began: None,
            now: FleetStatus { cycles, ..FleetStatus::default() },
            before: BTreeMap::new(),
            reported: now,
            packets: None,
            unwritten: None,
        }
    }

    /// Completes the table of packets.
    fn finish_packets(&mut self) -> Result<(), FleetError> {
        let finished = self.packets.take().map_or(Ok(()), PacketTable::finish);
        let stored = self.unwritten.take().map_or(finished, Err);
        stored.map_err(|e| FleetError::World(e.into()))
    }

    fn update_status(&mut self, fleet: &FleetView<'_>) {
        let passed_s = self.reported.elapsed().as_secs_f64().max(1e-3);
        self.reported = Instant::now();
        let nodes =
            fleet.seats.iter().map(|(&agent, seat)| self.node_status(fleet, agent, seat, passed_s));
        let nodes = nodes.collect();
        let world = fleet.stage.world();
        let quantile_ms = |q: f64| fleet.tally.talked.quantile(q).map(|s| 1e3 * s);
        self.now = FleetStatus {
            cycle: fleet.stage.cycle(),
            cycles: self.cycles,
            has_begun: fleet.has_begun,
            flown_s: self.began.map_or(0.0, |began| began.elapsed().as_secs_f64()),
            late_cycles: fleet.tally.late_cycles,
            talk_p50_ms: quantile_ms(0.5),
            talk_p99_ms: quantile_ms(0.99),
            noun: world.name(0).noun().into(),
            waits_for: fleet.waits_for.iter().map(|&agent| world.name(agent).to_string()).collect(),
            nodes,
        };
    }

    /// Returns the present state of a node, a number of seconds after the last look.
    fn node_status(
        &mut self,
        fleet: &FleetView<'_>,
        agent: EntityId,
        seat: &NodeEntry,
        passed_s: f64,
    ) -> NodeStatus {
        let status = &seat.status;
        let before = self.before.insert(agent, (status.packets, status.bytes));
        let (packets, bytes) = before.unwrap_or_default();
        let rate = |now: u64, before: u64| now.saturating_sub(before) as f64 / passed_s;
        let silent = fleet.mail.silent_for(Peer::Node(agent));
        let state = match &seat.member {
            None => "awaited",
            Some(_) if seat.is_gone => "gone",
            Some(_) if silent.is_some_and(|silent| silent > SILENCE_TIMEOUT) => "silent",
            Some(_) if !fleet.has_begun => "joined",
            Some(_) if seat.control.is_some() => "done",
            Some(_) => &status.doing,
        };
        let name = fleet.stage.world().name(agent);
        let (number, part) = name.body();
        NodeStatus {
            agent,
            name: name.to_string(),
            number,
            part,
            state: state.into(),
            process: seat.member.as_ref().map(|_| seat.process),
            epoch: status.epoch,
            heard: status.heard.len(),
            heard_of: status.heard.clone(),
            round: status.round,
            flown: seat.flown,
            late: seat.late,
            lives: seat.lives,
            packets: status.packets,
            bytes: status.bytes,
            packets_per_s: rate(status.packets, packets),
            bytes_per_s: rate(status.bytes, bytes),
            silent_s: silent.map(|silent| silent.as_secs_f64()),
        }
    }
}

impl ServerHooks for FleetSupervisor<'_> {
    fn on_poll(&mut self, fleet: &FleetView<'_>) -> Result<Vec<(EntityId, String)>, FleetError> {
        if self.lifeline.has_ended() {
            return Err(FleetError::Interrupted);
        }
        if let Some(error) = self.unwritten.take() {
            return Err(FleetError::World(error.into()));
        }
        if fleet.has_begun {
            self.began.get_or_insert_with(Instant::now);
        }
        if Instant::now() >= self.report_at {
            self.report_at = Instant::now() + REPORT_INTERVAL;
            self.update_status(fleet);
            self.board.publish(|| metrics::fleet_metrics(&self.now, fleet));
            print_message(&LinkMessage::Fleet(self.now.clone()));
            if self.shown.is_watched() {
                self.shown.publish(&self.now, false);
            }
        }
        let member = |agent: EntityId| fleet.seats.get(&agent)?.member.clone();
        let gone = self.crew.poll(|agent| member(agent).map(|member| member.listens))?;
        if let Some((agent, reason)) = gone.first().filter(|_| !fleet.has_begun) {
            let (agent, reason) = (fleet.stage.agent_label(*agent), reason.clone());
            return Err(FleetError::Gone { agent, cycle: fleet.stage.cycle(), reason });
        }
        Ok(gone)
    }

    fn on_end(&mut self, fleet: &FleetView<'_>) {
        self.update_status(fleet);
        self.shown.publish(&self.now, true);
    }

    fn wants_frame(&self, cycle: Cycle) -> bool {
        self.shown.wants_frame(cycle)
    }

    fn on_frame(&mut self, frame: Frame) {
        self.now.cycle = frame.cycle;
        self.shown.push_frame(frame);
        self.shown.publish(&self.now, false);
    }

    fn on_packets(&mut self, packets: Vec<(EntityId, PacketRecord)>) {
        if let Some(table) = &mut self.packets
            && let Err(error) = table.add(packets)
        {
            self.unwritten = Some(error);
        }
    }
}
