//! A fleet: the server of a world as a process, with the nodes that it starts.

use super::crew::Crew;
use super::lifeline::Lifeline;
use super::metrics;
use super::node::wrong_endpoint;
use super::packets::Packets;
use super::scenario::Scenario;
use super::shown::{self, Shown};
use super::told::tell;
use crate::deployed::Deployed;
use crate::mail::Mail;
use crate::server::{Attendant, Broken, Look, SILENT, Seat, Server, Terms};
use crate::stage::Stage;
use crate::wire::Party;
use crate::wire::endpoint::{WireError, hold};
use crate::wire::window::Window;
use crate::wire::zenoh::ZenohWire;
use crate::words::{Clock, Logged, Topology, Welcome};
use sidestep::kernel::ports::RecordError;
use sidestep::kernel::view::Frame;
use sidestep::kernel::{Cycle, EntityId, Simulation};
use sidestep_session::fleet::{Common, FleetJob, FleetNow, NodeJob, NodeNow, Staged, Told};
use sidestep_session::{Error, Journey, Keep, Watcher};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Time between two reports.
const REPORT: Duration = Duration::from_millis(500);

/// Flies a fleet to its end.
///
/// # Errors
/// When anything is wrong with the job, a node is gone in lockstep, or results cannot be stored.
pub(super) fn fly(job: &FleetJob, lifeline: &Lifeline) -> Result<(), Error> {
    let scenario = Scenario::read(&job.common.flown)?;
    let fingerprint = scenario.fingerprint()?;
    let overrides = scenario.needs(job.clock, job.out.is_some());
    let scenario = scenario.with(&overrides)?;
    let listen = endpoints(&job.listen).map_err(wrong_endpoint)?;
    let wire = ZenohWire::server(&listen, job.common.tls.as_ref()).map_err(wrong_endpoint)?;
    let told = metrics::Board::open(job.common.metrics.as_deref())?;
    let keep = Keep { folder: job.out.as_deref(), mcap: None, replace: job.replace };
    let journey = Journey::start(scenario.compiled.as_ref(), &scenario.source, 1, keep, None)?;
    tell(&Told::Listens(listen.clone()));
    let scene = shown::scene(&staged(journey.simulation()));
    let shown = Shown::new(Window::open(&wire, scene).map_err(wrong_endpoint)?);
    let mail = Mail::new(Party::Server, Box::new(wire));
    let welcome =
        Welcome { clock: job.clock, topology: job.topology, overrides, logs_packets: job.packets };
    let terms = Terms {
        scenario: fingerprint,
        build: sidestep_session::build().into(),
        welcome,
        lease: Duration::from_secs_f64(job.common.lease_s),
        has_faults: scenario.world.has_faults(),
    };
    let jobs = node_jobs(job, &listen, scenario.world.as_ref());
    let restarts = job.clock != Clock::Lockstep || scenario.world.waits_for_lost();
    let crew = Crew::start(jobs, restarts)?;
    let mut stage = Stage::new(journey, scenario.world, &Watched);
    let plan = stage.run().plan().clone();
    let mut captain = Captain::new(crew, lifeline, plan.cycles, told, shown);
    captain.packets = packets(job, &scenario.source.text, plan.seed)?;
    let (flown, _) = Server::new(mail, &mut stage, &mut captain, terms).run();
    captain.crew.end();
    let flown = flown.and_then(|()| captain.finish_packets());
    let Captain { now, shown, .. } = captain;
    let done = finish(stage.into_journey(), flown, now);
    shown.linger();
    done
}

/// Returns the unchanging part of a run that is watched.
fn staged(run: &dyn Simulation) -> Staged {
    Staged {
        build: sidestep_session::build().into(),
        world: run.world().into(),
        agent: run.agent().into(),
        seed: run.plan().seed,
        scenery: run.scenery(),
    }
}

/// Begins the table of all packets, if it is wanted.
fn packets(job: &FleetJob, text: &str, seed: u64) -> Result<Option<Packets>, RecordError> {
    let folder = job.out.as_ref().filter(|_| job.packets);
    folder.map(|folder| Packets::begin(folder, text, seed)).transpose()
}

/// Returns the endpoints at which the server listens, each with a port.
fn endpoints(listen: &[String]) -> Result<Vec<String>, WireError> {
    // The ports are free again when the list is complete, and taken right away.
    let held = listen.iter().map(|endpoint| hold(endpoint)).collect::<Result<Vec<_>, _>>()?;
    Ok(held.into_iter().map(|held| held.endpoint).collect())
}

/// Returns the jobs of the nodes that are started here, by their agents' ids.
fn node_jobs(
    job: &FleetJob,
    connect: &[String],
    world: &dyn Deployed,
) -> BTreeMap<EntityId, NodeJob> {
    let any = match job.topology {
        // As with the server's own: these nodes are on its machine.
        Topology::Mesh => vec![any_port(&connect[0])],
        Topology::Star => Vec::new(),
    };
    let one = |agent| {
        let job = NodeJob {
            common: Common { metrics: None, ..job.common.clone() },
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

fn any_port(endpoint: &str) -> String {
    let host = endpoint.rsplit_once(':').map_or(endpoint, |(host, _)| host);
    format!("{host}:0")
}

/// Stores and tells the results.
fn finish(journey: Journey, flown: Result<(), Broken>, fleet: FleetNow) -> Result<(), Error> {
    if let Err(Broken::World(error)) = flown {
        // A record that failed before would fail again.
        return Err(error);
    }
    let summary = journey.finish(&Watched)?;
    let (folder, outcome) = (summary.folder.clone(), summary.outcome.clone());
    let summary = serde_json::to_value(&summary).expect("summaries are plain data");
    tell(&Told::Ended { summary, outcome, fleet });
    match flown {
        Ok(()) => Ok(()),
        Err(Broken::Stopped) => Err(Error::Interrupted),
        Err(Broken::World(error)) => Err(error),
        Err(gone @ Broken::Gone { .. }) => {
            let remedy = match folder {
                Some(folder) => {
                    format!("go on without nodes: sidestep resume {}", folder.display())
                }
                None => "start the fleet again; with --out DIR it could be resumed".into(),
            };
            Err(Error::stopped(gone.to_string(), remedy))
        }
    }
}

/// The program as a watcher of the run, which goes on cycle by cycle: the attendant of the fleet decides when to
/// stop.
struct Watched;

impl Watcher for Watched {
    fn warn(&self, error: &Error) {
        tracing::warn!("{error}");
    }
}

/// The attendant of the fleet: looks after nodes, and tells the fleet's state.
struct Captain<'a> {
    crew: Crew,
    lifeline: &'a Lifeline,
    cycles: u64,
    board: metrics::Board,
    shown: Shown,
    report_at: Instant,
    /// Time at which all nodes had joined.
    began: Option<Instant>,
    now: FleetNow,
    /// Packets and bytes of each node at the last report, and its time.
    before: BTreeMap<EntityId, (u64, u64)>,
    reported: Instant,
    /// The table of all packets, if it is wanted.
    packets: Option<Packets>,
    /// The reason why it cannot be written.
    unwritten: Option<RecordError>,
}

impl<'a> Captain<'a> {
    fn new(
        crew: Crew,
        lifeline: &'a Lifeline,
        cycles: u64,
        board: metrics::Board,
        shown: Shown,
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
            now: FleetNow { cycles, ..FleetNow::default() },
            before: BTreeMap::new(),
            reported: now,
            packets: None,
            unwritten: None,
        }
    }

    /// Completes the table of packets.
    fn finish_packets(&mut self) -> Result<(), Broken> {
        let finished = self.packets.take().map_or(Ok(()), Packets::finish);
        let stored = self.unwritten.take().map_or(finished, Err);
        stored.map_err(|e| Broken::World(e.into()))
    }

    fn look(&mut self, fleet: &Look<'_>) {
        let passed_s = self.reported.elapsed().as_secs_f64().max(1e-3);
        self.reported = Instant::now();
        let nodes =
            fleet.seats.iter().map(|(&agent, seat)| self.node(fleet, agent, seat, passed_s));
        let nodes = nodes.collect();
        let world = fleet.stage.world();
        let quantile_ms = |q: f64| fleet.tally.talked.quantile(q).map(|s| 1e3 * s);
        self.now = FleetNow {
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
    fn node(&mut self, fleet: &Look<'_>, agent: EntityId, seat: &Seat, passed_s: f64) -> NodeNow {
        let status = &seat.status;
        let before = self.before.insert(agent, (status.packets, status.bytes));
        let (packets, bytes) = before.unwrap_or_default();
        let rate = |now: u64, before: u64| now.saturating_sub(before) as f64 / passed_s;
        let silent = fleet.mail.silent_for(Party::Node(agent));
        let state = match &seat.member {
            None => "awaited",
            Some(_) if seat.is_gone => "gone",
            Some(_) if silent.is_some_and(|silent| silent > SILENT) => "silent",
            Some(_) if !fleet.has_begun => "joined",
            Some(_) if seat.control.is_some() => "done",
            Some(_) => &status.doing,
        };
        let name = fleet.stage.world().name(agent);
        let (number, part) = name.body();
        NodeNow {
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

impl Attendant for Captain<'_> {
    fn attend(&mut self, fleet: &Look<'_>) -> Result<Vec<(EntityId, String)>, Broken> {
        if self.lifeline.has_ended() {
            return Err(Broken::Stopped);
        }
        if let Some(error) = self.unwritten.take() {
            return Err(Broken::World(error.into()));
        }
        if fleet.has_begun {
            self.began.get_or_insert_with(Instant::now);
        }
        if Instant::now() >= self.report_at {
            self.report_at = Instant::now() + REPORT;
            self.look(fleet);
            self.board.show(|| metrics::of_fleet(&self.now, fleet));
            tell(&Told::Fleet(self.now.clone()));
            if self.shown.is_watched() {
                self.shown.show(&self.now, false);
            }
        }
        let member = |agent: EntityId| fleet.seats.get(&agent)?.member.clone();
        let gone = self.crew.look(|agent| member(agent).map(|member| member.listens))?;
        if let Some((agent, reason)) = gone.first().filter(|_| !fleet.has_begun) {
            let (agent, reason) = (fleet.stage.called(*agent), reason.clone());
            return Err(Broken::Gone { agent, cycle: fleet.stage.cycle(), reason });
        }
        Ok(gone)
    }

    fn look_back(&mut self, fleet: &Look<'_>) {
        self.look(fleet);
        self.shown.show(&self.now, true);
    }

    fn wants_frame(&self, cycle: Cycle) -> bool {
        self.shown.wants_frame(cycle)
    }

    fn take_frame(&mut self, frame: Frame) {
        self.now.cycle = frame.cycle;
        self.shown.take(frame);
        self.shown.show(&self.now, false);
    }

    fn take_packets(&mut self, packets: Vec<(EntityId, Logged)>) {
        if let Some(table) = &mut self.packets
            && let Err(error) = table.add(packets)
        {
            self.unwritten = Some(error);
        }
    }
}
