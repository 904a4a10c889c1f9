//! The recorder of a flight without a server: it only listens.
//!
//! It submits the controls that nodes report to a run of its own, which is recorded and can be computed again. An airplane
//! whose control it does not know stays on its fallback there. So the recording is what was flown as long as nothing that
//! was flown is unknown; reports that differ from its own state are counted. A control counts once its airplane has
//! reported that it flies it.

use super::channel::{FlightChannel, ReceivedContent};
use super::message::{FlightContent, FlightReport, Presence, Standing};
use super::node::{DECISION_P50_MS, DECISION_P99_MS};
use super::time::{FlightTime, WallClock};
use crate::agent::SerializedControls;
use crate::hosted_run::HostedRun;
use crate::protocol::{Incarnation, NodeStatusReport};
use crate::wire::PeerId;
use sidestep::kernel::{Cycle, EntityId, Simulation};
use sidestep::worlds::airspace::AirspaceRun;
use sidestep_session::Error;
use sidestep_session::fleet::{FleetStatus, NodeStatus};
use std::any::Any;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Time between two looks whether the process has to end, and whether nodes have ended.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Time between two reports of the flight's state.
const REPORT_INTERVAL: Duration = Duration::from_millis(500);

/// Cycles for which the recorder waits for a report, and the shortest such time: links that are broken are open again by then.
const PATIENCE_CYCLES: f64 = 3.0;
const MIN_PATIENCE_S: f64 = 5.0;

/// The same for a node of which it has heard nothing since: it may be started again, and tell what it has flown before.
const MIN_PATIENCE_WITH_SILENT_S: f64 = 20.0;

/// Time between the moment when all are ready and the cycle before the first: the start has to reach all.
const START_DELAY_S: f64 = 1.0;

/// Time between two messages that say when the flight starts.
const START_INTERVAL: Duration = Duration::from_millis(100);

/// Silence of a node after which the table shows it.
const SILENCE_TIMEOUT: Duration = Duration::from_secs(2);

/// The hooks of a recorder: processes that it has started, and the one that has started it.
pub trait RecorderHooks {
    /// Looks after the processes.
    ///
    /// # Errors
    /// When the recorder has to end.
    fn poll(&mut self, start_s: Option<f64>) -> Result<(), Error>;

    /// Reports the state of the flight.
    fn report(&mut self, status: &FleetStatus);
}

/// What is known of one node.
#[derive(Debug, Default)]
struct NodeRecord {
    incarnation: Option<Incarnation>,
    lives: u64,
    heard_at: Option<Instant>,
    presence: Option<Presence>,
    status: NodeStatusReport,
    held: bool,
    flown: u64,
    missing: u64,
    differing: u64,
}

/// A recorder of a flight.
pub struct FlightRecorder<'a> {
    channel: FlightChannel,
    run: HostedRun,
    hooks: &'a mut dyn RecorderHooks,
    clock: WallClock,
    time: FlightTime,
    /// Whether the start is still to be set here.
    sets_start: bool,
    /// Seconds of the scenario before the start in which vehicles fly to their first poses.
    run_up_s: f64,
    nodes: Vec<NodeRecord>,
    /// Reports by the cycle at whose start they are, and airplane.
    reports: BTreeMap<Cycle, BTreeMap<EntityId, FlightReport>>,
    report_at: Instant,
    start_at: Instant,
    invalid: u64,
}

impl<'a> FlightRecorder<'a> {
    /// Returns a recorder of a run at its start; without `start_s` in `time` it is set here, once all are ready.
    pub fn new(
        channel: FlightChannel,
        run: HostedRun,
        time: FlightTime,
        hooks: &'a mut dyn RecorderHooks,
    ) -> Self {
        let airplanes = run.all_agents().count();
        Self {
            clock: channel.clock(),
            channel,
            run,
            hooks,
            sets_start: !time.start_s.is_finite(),
            time,
            run_up_s: 0.0,
            nodes: (0..airplanes).map(|_| NodeRecord::default()).collect(),
            reports: BTreeMap::new(),
            report_at: Instant::now(),
            start_at: Instant::now(),
            invalid: 0,
        }
    }

    /// Returns the recorder with a time, in seconds of the scenario, that vehicles have for their run-up to the start.
    #[must_use]
    pub fn with_run_up(self, run_up_s: f64) -> Self {
        Self { run_up_s, ..self }
    }

    /// Listens to the end of the flight.
    ///
    /// # Errors
    /// When a cycle cannot be recorded, or the hooks say so.
    pub fn listen(&mut self) -> Result<(), Error> {
        if !self.sets_start {
            self.channel.set_start(self.time.start_s);
        }
        while !self.run.is_over() {
            self.hooks.poll(self.time.start_s.is_finite().then_some(self.time.start_s))?;
            self.set_start_if_ready();
            if let Some(received) = self.channel.receive(POLL_INTERVAL) {
                self.on_message(received);
            }
            while self.is_cycle_complete() && !self.run.is_over() {
                self.advance()?;
            }
            self.report_if_due();
        }
        Ok(())
    }

    /// Returns the state of the flight, and the run.
    pub fn finish(self) -> (FleetStatus, HostedRun) {
        (self.status(), self.run)
    }

    /// Sets the start once all are ready, and says it until cycle 0 has begun.
    fn set_start_if_ready(&mut self) {
        let now_s = self.clock.now_s();
        let are_ready = self
            .nodes
            .iter()
            .all(|node| node.presence.as_ref().is_some_and(|presence| presence.is_ready));
        if self.sets_start && are_ready {
            self.sets_start = false;
            // The cycle before the first one decides that, and vehicles set out before it.
            let before_s = self.time.dt_s.max(self.run_up_s) / self.time.speed;
            self.time.start_s = now_s + START_DELAY_S + before_s;
            self.channel.set_start(self.time.start_s);
        }
        let is_told = self.time.start_s.is_finite() && now_s < self.time.start_s;
        if is_told && self.start_at <= Instant::now() {
            self.start_at = Instant::now() + START_INTERVAL;
            let all: Vec<PeerId> = self.run.all_agents().map(PeerId::Node).collect();
            self.channel.send(&all, FlightContent::Start);
        }
    }

    fn on_message(&mut self, received: ReceivedContent) {
        let ReceivedContent { from, incarnation, content, .. } = received;
        let PeerId::Node(agent) = from else { return };
        let Some(node) = self.nodes.get_mut(agent as usize) else { return };
        node.heard_at = Some(Instant::now());
        if node.incarnation != Some(incarnation) {
            node.incarnation = Some(incarnation);
            node.lives += 1;
        }
        match content {
            FlightContent::Presence(presence) => node.presence = Some(presence),
            FlightContent::Status(status) => node.status = status,
            FlightContent::Report(report) if report.report.id == agent => {
                node.held = matches!(report.standing, Standing::Held(_));
                // A report comes several times, and is the same each time.
                let cycle = report.report.cycle;
                if cycle >= self.run.cycle() {
                    self.reports.entry(cycle).or_default().entry(agent).or_insert(*report);
                }
                self.channel.send(&[PeerId::Node(agent)], FlightContent::Received(cycle));
            }
            // All else is not for a recorder.
            _ => {}
        }
    }

    /// Returns whether the present cycle can be computed: all have said what they fly in it, or there was time enough.
    fn is_cycle_complete(&self) -> bool {
        let ends_s = self.time.cycle_at_s(self.run.cycle() as i64, 1.0);
        let waited_s = self.clock.now_s() - ends_s;
        let patience_s = (PATIENCE_CYCLES * self.time.dt_s / self.time.speed).max(MIN_PATIENCE_S);
        let mut flying = self.run.all_agents().filter(|&agent| !self.has_ended(agent));
        flying.all(|agent| match self.next_report(agent) {
            Some(cycle) if cycle == self.run.cycle() + 1 => true,
            // It reports one after the other, so the one before is lost.
            Some(_) => waited_s >= patience_s,
            None => waited_s >= patience_s.max(MIN_PATIENCE_WITH_SILENT_S),
        })
    }

    /// Returns the cycle of the earliest report of an airplane that is still to be recorded.
    fn next_report(&self, agent: EntityId) -> Option<Cycle> {
        let ahead = self.reports.range(self.run.cycle() + 1..);
        ahead.into_iter().find(|(_, all)| all.contains_key(&agent)).map(|(&cycle, _)| cycle)
    }

    fn airspace(&self) -> Option<&AirspaceRun> {
        let run: &dyn Any = self.run.simulation();
        run.downcast_ref()
    }

    fn has_ended(&self, agent: EntityId) -> bool {
        let airplanes = self.airspace().map(|run| &run.state().airplanes);
        airplanes.is_some_and(|airplanes| !airplanes[agent as usize].is_unfinished())
    }

    /// Computes the present cycle with what was reported.
    fn advance(&mut self) -> Result<(), Error> {
        let cycle = self.run.cycle();
        let reports = self.reports.remove(&(cycle + 1)).unwrap_or_default();
        let flying: Vec<EntityId> =
            self.run.all_agents().filter(|&agent| !self.has_ended(agent)).collect();
        let mut controls = SerializedControls::new();
        for agent in flying {
            let control = reports.get(&agent).and_then(|report| report.control.clone());
            let node = &mut self.nodes[agent as usize];
            match control {
                Some(control) => {
                    node.flown += 1;
                    controls.push((agent, control));
                }
                None => node.missing += 1,
            }
        }
        self.run.accept_controls(&[], controls, &[]);
        let invalid = self.run.advance()?;
        self.invalid += invalid.len() as u64;
        for one in &invalid {
            tracing::warn!(agent = one.agent, reason = one.reason, "a control is invalid");
        }
        self.compare(&reports);
        Ok(())
    }

    /// Counts the reports that differ from the recorded state.
    fn compare(&mut self, reports: &BTreeMap<EntityId, FlightReport>) {
        let Some(run) = self.airspace() else { return };
        let snapshot = run.state().snapshot(run.cycle());
        for (&agent, report) in reports {
            if snapshot.airplanes[agent as usize] != report.report.part {
                self.nodes[agent as usize].differing += 1;
            }
        }
    }

    fn report_if_due(&mut self) {
        if self.report_at <= Instant::now() {
            self.report_at = Instant::now() + REPORT_INTERVAL;
            let status = self.status();
            self.hooks.report(&status);
        }
    }

    fn status(&self) -> FleetStatus {
        let has_begun = self.time.start_s.is_finite() && self.clock.now_s() >= self.time.start_s;
        let flown_s = if has_begun { self.clock.now_s() - self.time.start_s } else { 0.0 };
        let nodes: Vec<NodeStatus> =
            self.run.all_agents().map(|agent| self.node_status(agent)).collect();
        let absent = nodes.iter().filter(|node| !has_begun && node.process.is_none());
        FleetStatus {
            cycle: self.run.cycle(),
            cycles: self.run.simulation().config().cycles,
            has_begun,
            late_cycles: self.invalid,
            flown_s,
            talk_p50_ms: self.slowest_ms(DECISION_P50_MS),
            talk_p99_ms: self.slowest_ms(DECISION_P99_MS),
            noun: self.run.world().name(0).noun.into(),
            waits_for: absent.map(|node| node.name.clone()).collect(),
            nodes,
            ..FleetStatus::default()
        }
    }

    /// Returns the largest of some times of all nodes, in milliseconds.
    fn slowest_ms(&self, name: &str) -> Option<f64> {
        let counts = self.nodes.iter().flat_map(|node| &node.status.dropped);
        let times = counts.filter(|(counted, _)| counted == name).map(|(_, ms)| *ms as f64);
        times.reduce(f64::max)
    }

    fn node_status(&self, agent: EntityId) -> NodeStatus {
        let node = &self.nodes[agent as usize];
        let silent = node.heard_at.map(|at| at.elapsed());
        let state = match silent {
            None => "awaited",
            Some(silent) if silent > SILENCE_TIMEOUT => "silent",
            Some(_) if node.held => "held",
            Some(_) => &node.status.activity,
        };
        let name = self.run.world().name(agent);
        NodeStatus {
            agent,
            name: name.to_string(),
            number: name.number,
            part: name.part,
            state: state.into(),
            process: node.presence.as_ref().map(|presence| presence.process),
            heard: node.status.heard.len(),
            heard_of: node.status.heard.clone(),
            flown: node.flown,
            late: node.missing,
            lives: node.lives,
            packets: node.status.packets,
            bytes: node.status.bytes,
            silent_s: silent.map(|silent| silent.as_secs_f64()),
            differing: node.differing,
            counts: node.status.dropped.clone(),
            ..NodeStatus::default()
        }
    }
}
