//! The program of a node in a flight without a server.
//!
//! ```text
//!        T_c-1                                                              T_c
//!          │ report for cycle c │ wait for the others' │ conversations │ offer │
//!          └────────────────────┴──── (a share) ───────┴───────────────┴───────┘
//! ```
//!
//! All of this happens while the vehicle flies cycle `c - 1`, one before the one that is decided.

use super::board::{FlightBoard, GuardReport};
use super::channel::{FlightChannel, ReceivedContent};
use super::journal::FlightJournal;
use super::message::{FlightContent, FlightReport, Presence, RecallAnswer, Standing};
use super::time::{FlightTime, WallClock, wait_until};
use crate::plant::aircraft::TrafficReport;
use crate::protocol::{AgentPacket, NodeStatusReport};
use crate::server::histogram::Histogram;
use crate::wire::PeerId;
use sidestep::kernel::network::NetworkAgent;
use sidestep::kernel::{Cycle, EntityId};
use sidestep::worlds::airspace::pilot::{AirplaneControl, Percept, Pilot};
use sidestep::worlds::airspace::replica::{Replica, TimeShares};
use sidestep_session::fleet::FlightStatus;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest time without looking whether the process has to end.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// Time between two presences before the start.
const PRESENCE_INTERVAL: Duration = Duration::from_millis(100);

/// Time between two reports of a node's state.
const STATUS_INTERVAL: Duration = Duration::from_millis(500);

/// Part of the time for reports after which a report is sent again; each further time takes twice as long.
const FIRST_REPEAT_SHARE: f64 = 0.125;

/// Share of a cycle before its end at which conversations are given up, so that their result can still be handed over.
const HAND_OVER_SHARE: f64 = 0.05;

/// Cycles of the fallback behind the one that is decided, beyond the patience of the guard.
const SPARE_CYCLES: usize = 2;

/// Cycles for which a node goes on to report after the end of the flight, so that the last reports arrive.
const FAREWELL_CYCLES: u64 = 2;

/// The names of the times in milliseconds within which half of the controls, and 99 of 100, were handed over.
pub const DECISION_P50_MS: &str = "decision-p50-ms";
/// See [`DECISION_P50_MS`].
pub const DECISION_P99_MS: &str = "decision-p99-ms";

/// Most reports that are sent again to a recorder that has not received them.
const MAX_UNRECORDED: usize = 64;

/// Most packets that are kept for a conversation that has not begun here.
const MAX_EARLY_PACKETS: usize = 10_000;

/// First number of the addresses by which vehicles are shown the others: those of 24 bits that belong to no state.
const FIRST_ADDRESS: u32 = 0xF0_0000;

/// The end of a node before its flight's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FlightError {
    /// It was asked to end.
    #[error("it was asked to end")]
    Interrupted,
    /// Not all were there at the start.
    #[error("the flight has not begun: {0}")]
    NotAllThere(String),
    /// It was started again, and cannot know what it has reported last.
    #[error(
        "cycle 0 has begun already, and it is not known what this airplane has reported last: {0}"
    )]
    NotRemembered(String),
}

/// What a node works with.
pub struct FlightParts {
    /// What it knows of all.
    pub replica: Replica,
    /// Its program.
    pub pilot: Pilot,
    /// Its messages to and from others.
    pub channel: FlightChannel,
    /// What it shares with its guard.
    pub board: Arc<FlightBoard>,
    /// Where it keeps what it reports, if it does.
    pub journal: Option<FlightJournal>,
}

/// Settings of a node.
#[derive(Debug, Clone, Copy)]
pub struct FlightSettings {
    /// When cycle 0 begins, in seconds since 1970; none if the recorder says so.
    pub start_s: Option<f64>,
    /// Seconds of the scenario in a second.
    pub speed: f64,
    /// Number of cycles of the flight.
    pub cycles: Cycle,
    /// Silence in seconds after which the guard acts: the reference reaches farther.
    pub patience_s: f64,
    /// Silence in seconds before the start after which another one is no longer taken to be there.
    pub lease_s: f64,
}

/// A listener to the state of a node.
type StatusListener<'a> = Box<dyn FnMut(&FlightStatus) + 'a>;

/// The program of a node.
pub struct FlightNode<'a> {
    id: EntityId,
    parts: FlightParts,
    settings: FlightSettings,
    clock: WallClock,
    time: FlightTime,
    has_to_end: &'a dyn Fn() -> bool,
    on_status: StatusListener<'a>,
    others: Vec<EntityId>,
    /// When each other one said before the start that it is there.
    present: BTreeMap<EntityId, Instant>,
    /// The last report of each other one.
    last_reports: BTreeMap<EntityId, FlightReport>,
    /// Reports of cycles to come.
    early_reports: BTreeMap<(Cycle, EntityId), FlightReport>,
    early_packets: Vec<(EntityId, AgentPacket)>,
    /// Its own report of the present cycle, and when it is sent again.
    own_report: Option<FlightReport>,
    repeat_at_s: f64,
    repeat_after_s: f64,
    /// Reports that the recorder has not received yet, if there is one that answers.
    unrecorded: BTreeMap<Cycle, FlightReport>,
    is_recorded: bool,
    /// The answers of others to the question what it has reported last.
    recalled: BTreeMap<EntityId, RecallAnswer>,
    /// The first cycle on which it may agree with others.
    talks_from: Cycle,
    /// The conversation of the present cycle, if there is one: its first tick, and when that was.
    talk: Option<(u64, Instant)>,
    report_at: Instant,
    state: &'static str,
    status: NodeStatusReport,
    heard: BTreeSet<EntityId>,
    counts: BTreeMap<&'static str, u64>,
    max_behind_s: f64,
    /// Times from the beginning of a cycle until the control of the next one is handed over.
    decision_time: Histogram,
}

impl<'a> FlightNode<'a> {
    /// Returns a node that has not begun.
    pub fn new(
        id: EntityId,
        parts: FlightParts,
        settings: FlightSettings,
        has_to_end: &'a dyn Fn() -> bool,
        on_status: impl FnMut(&FlightStatus) + 'a,
    ) -> Self {
        let airplanes = parts.replica.world().airplanes.len() as EntityId;
        let clock = parts.channel.clock();
        let dt_s = parts.replica.world().timing.dt_s;
        let FlightSettings { start_s, speed, .. } = settings;
        Self {
            id,
            clock,
            time: FlightTime { start_s: start_s.unwrap_or(f64::INFINITY), speed, dt_s },
            parts,
            settings,
            has_to_end,
            on_status: Box::new(on_status),
            others: (0..airplanes).filter(|&other| other != id).collect(),
            present: BTreeMap::new(),
            last_reports: BTreeMap::new(),
            early_reports: BTreeMap::new(),
            early_packets: Vec::new(),
            own_report: None,
            repeat_at_s: f64::INFINITY,
            repeat_after_s: 0.0,
            unrecorded: BTreeMap::new(),
            is_recorded: false,
            recalled: BTreeMap::new(),
            talks_from: 0,
            talk: None,
            report_at: Instant::now(),
            state: "waits",
            status: NodeStatusReport::default(),
            heard: BTreeSet::new(),
            counts: BTreeMap::new(),
            max_behind_s: 0.0,
            decision_time: Histogram::default(),
        }
    }

    /// Flies to the end of the flight. Returns the state at the end.
    ///
    /// # Errors
    /// When it is asked to end, or the flight does not begin.
    pub fn run(mut self) -> Result<FlightStatus, FlightError> {
        let flown = self.fly();
        self.tell_status(true);
        flown.map(|()| self.flight_status())
    }

    fn fly(&mut self) -> Result<(), FlightError> {
        let now_s = self.clock.now_s();
        // Too late to begin with the others: this process was started again.
        if self.settings.start_s.is_some() && now_s >= self.time.cycle_at_s(-1, 0.0) {
            self.resume()?;
        } else {
            self.put_reference();
            self.gather()?;
        }
        loop {
            self.begin_cycle();
            if self.is_over() {
                return self.say_goodbye();
            }
            let cycle = self.parts.replica.cycle();
            let ends_s = self.time.cycle_at_s(cycle as i64, 0.0);
            let control = self.decide(cycle)?;
            let flown = control.filter(|control| self.offer(cycle, control));
            self.listen_until(ends_s, |_| false)?;
            self.end_cycle(flown);
        }
    }

    /// Returns whether there is nothing left to decide, for anyone.
    fn is_over(&self) -> bool {
        let replica = &self.parts.replica;
        let mut all = (0..=self.others.len()).map(|id| id as EntityId);
        replica.cycle() >= self.settings.cycles || all.all(|id| replica.has_ended(id))
    }

    /// Puts up the reference of the present state, on the fallback.
    fn put_reference(&mut self) {
        let reference = self.parts.replica.reference(None, self.reference_cycles());
        self.parts.board.put_reference(reference);
    }

    /// Number of cycles of a reference: the guard has more of it than it waits for its program.
    fn reference_cycles(&self) -> usize {
        let patience = self.settings.patience_s * self.settings.speed / self.time.dt_s;
        // A patience of days would make a reference of days.
        (patience.ceil() as usize).min(1000) + SPARE_CYCLES
    }

    /// Waits until all are there and cycle 0 can be decided.
    fn gather(&mut self) -> Result<(), FlightError> {
        if self.settings.start_s.is_some() {
            self.announce_start();
        }
        let mut present_at = Instant::now();
        loop {
            if (self.has_to_end)() {
                return Err(FlightError::Interrupted);
            }
            self.parts.board.beat();
            if present_at <= Instant::now() {
                present_at = Instant::now() + PRESENCE_INTERVAL;
                self.send_presence();
            }
            self.tell_status(false);
            let begins_s = self.time.cycle_at_s(-1, 0.0);
            if self.clock.now_s() >= begins_s {
                return self.check_all_are_there();
            }
            let wait = wait_until(&self.clock, begins_s).min(PRESENCE_INTERVAL);
            self.receive(wait);
        }
    }

    fn announce_start(&mut self) {
        self.parts.channel.set_start(self.time.start_s);
        self.parts.board.set_time(self.time);
    }

    fn send_presence(&mut self) {
        let is_ready = self.parts.board.guard().is_at_reference && self.absent().is_empty();
        let presence = Presence { is_ready, process: std::process::id() };
        let to = self.all_peers();
        self.parts.channel.send(&to, FlightContent::Presence(presence));
    }

    /// Returns all others, and the recorder.
    fn all_peers(&self) -> Vec<PeerId> {
        let nodes = self.others.iter().map(|&other| PeerId::Node(other));
        nodes.chain([PeerId::Server]).collect()
    }

    /// Returns the others that are not there.
    fn absent(&self) -> Vec<EntityId> {
        let lease_s = self.settings.lease_s;
        let is_there = |id: &EntityId| {
            self.present.get(id).is_some_and(|at| at.elapsed().as_secs_f64() < lease_s)
        };
        self.others.iter().copied().filter(|id| !is_there(id)).collect()
    }

    /// Checks that all are there, and the own vehicle is at the start: nobody flies into a sky of which it knows nothing.
    fn check_all_are_there(&self) -> Result<(), FlightError> {
        let absent = self.absent();
        if !absent.is_empty() {
            let ids: Vec<String> = absent.iter().map(EntityId::to_string).collect();
            let reason = format!("airplanes {} were not heard", ids.join(", "));
            return Err(FlightError::NotAllThere(reason));
        }
        let GuardReport { is_at_reference, deviation_m, .. } = self.parts.board.guard();
        if !is_at_reference {
            let place =
                deviation_m.map_or("unknown".to_string(), |it_m| format!("{it_m:.1} m off"));
            let reason =
                format!("the vehicle is not at its start, or not led by its node: {place}");
            return Err(FlightError::NotAllThere(reason));
        }
        Ok(())
    }

    /// Takes up the flight again: goes on along the fallback that it has reported last.
    fn resume(&mut self) -> Result<(), FlightError> {
        self.state = "returns";
        self.parts.channel.set_start(self.time.start_s);
        let journal = self.parts.journal.as_ref();
        let last = match journal.and_then(|journal| journal.load(self.time.start_s)) {
            Some(last) => last,
            None => self.recall()?,
        };
        let replica = &mut self.parts.replica;
        let resumed = replica.resume(&last.report);
        resumed.map_err(|_| FlightError::NotRemembered("the last report is impossible".into()))?;
        // The recorder may not have it, if the process before ended while it was sent.
        self.unrecorded.insert(last.report.cycle, last.clone());
        let now_s = self.clock.now_s();
        let flown = self.time.cycle_at(now_s).unwrap_or(0);
        // The process before may have agreed with others on the cycle that is decided now.
        self.talks_from = flown + 2;
        while self.parts.replica.cycle() < flown {
            self.parts.replica.advance(None);
        }
        // From now on the guard leads and judges: before, nobody could say where the vehicle is to be.
        self.put_reference();
        self.announce_start();
        // What is decided is one cycle ahead of what is flown.
        if self.parts.replica.cycle() == flown && self.time.scenario_s(now_s) >= 0.0 {
            self.parts.replica.advance(None);
        }
        if last.report.cycle == self.parts.replica.cycle() {
            // The same report again, with the control that is flown until then.
            self.own_report = Some(last);
        }
        self.count("returns");
        Ok(())
    }

    /// Asks all others what it has reported last, and returns the newest that anyone has heard.
    ///
    /// Each of those that fly has to answer: one of them may have agreed with a fallback of which no other has heard.
    fn recall(&mut self) -> Result<FlightReport, FlightError> {
        let mut ask_at = Instant::now();
        loop {
            let silent = self.others_without_answer();
            if silent.is_empty() {
                let answers = std::mem::take(&mut self.recalled);
                let reports = answers.into_values().map(|answer| answer.report);
                let newest = reports.max_by_key(|report| report.report.cycle);
                return newest.ok_or_else(|| FlightError::NotRemembered("it flies alone".into()));
            }
            let flown = self.time.cycle_at(self.clock.now_s()).unwrap_or(0);
            if flown >= self.settings.cycles {
                let ids: Vec<String> = silent.iter().map(EntityId::to_string).collect();
                let reason = format!("airplanes {} have not answered", ids.join(", "));
                return Err(FlightError::NotRemembered(reason));
            }
            if (self.has_to_end)() {
                return Err(FlightError::Interrupted);
            }
            self.parts.board.beat();
            if ask_at <= Instant::now() {
                ask_at = Instant::now() + PRESENCE_INTERVAL;
                self.send_presence();
                let to: Vec<PeerId> = silent.into_iter().map(PeerId::Node).collect();
                self.parts.channel.send(&to, FlightContent::Recall);
            }
            self.tell_status(false);
            self.receive(PRESENCE_INTERVAL);
        }
    }

    /// Returns those that still fly, and have not said what they remember.
    fn others_without_answer(&self) -> Vec<EntityId> {
        let has_ended =
            |id: &EntityId| self.recalled.values().any(|answer| answer.ended.contains(id));
        let others = self.others.iter().copied();
        others.filter(|id| !self.recalled.contains_key(id) && !has_ended(id)).collect()
    }

    /// Sends the report for the cycle that is decided, and takes those that came early.
    fn begin_cycle(&mut self) {
        let cycle = self.parts.replica.cycle();
        let tick = self.first_tick();
        self.parts.channel.start_cycle(cycle, tick);
        self.talk = None;
        self.heard.clear();
        self.status.cycle = cycle;
        let standing = self.standing();
        let control = self.own_report.take().and_then(|report| report.control);
        let report = self.parts.replica.report();
        let report = FlightReport { report, control, standing };
        self.keep(&report);
        self.unrecorded.insert(cycle, report.clone());
        while self.unrecorded.len() > MAX_UNRECORDED
            || !self.is_recorded && self.unrecorded.len() > 2
        {
            self.unrecorded.pop_first();
        }
        self.own_report = Some(report);
        let cycle_s = self.time.dt_s / self.settings.speed;
        self.repeat_after_s = FIRST_REPEAT_SHARE * TimeShares::DEFAULT.reports * cycle_s;
        self.repeat_at_s = f64::NEG_INFINITY;
        self.send_report_if_due();
        let later = self.early_reports.split_off(&(cycle + 1, 0));
        let due = std::mem::replace(&mut self.early_reports, later);
        for (_, report) in due {
            self.on_report(report);
        }
    }

    /// Writes a report down before anybody can hear it.
    fn keep(&mut self, report: &FlightReport) {
        let Some(journal) = &self.parts.journal else { return };
        if let Err(error) = journal.store(self.time.start_s, report) {
            tracing::warn!(%error, "the journal cannot be written: a node that is started again asks the others");
            self.count("journal-errors");
        }
    }

    fn first_tick(&self) -> u64 {
        let replica = &self.parts.replica;
        replica.world().conversation_times(replica.cycle())[0].0
    }

    fn standing(&self) -> Standing {
        let guard = self.parts.board.guard();
        match guard.held {
            Some(_) => Standing::Held(guard.measured.map(|state| state.pose.at)),
            None => Standing::Leads,
        }
    }

    /// Sends the present report, if it is time to. To the recorder it goes by the real network alone, which is not on the
    /// radio.
    fn send_report_if_due(&mut self) {
        let now_s = self.clock.now_s();
        let Some(report) = self.own_report.as_ref().filter(|_| now_s >= self.repeat_at_s) else {
            return;
        };
        let content = FlightContent::Report(Box::new(report.clone()));
        self.repeat_at_s = now_s + self.repeat_after_s;
        self.repeat_after_s *= 2.0;
        // A link that breaks loses what was sent before the other end noticed.
        for unrecorded in self.unrecorded.values() {
            let content = FlightContent::Report(Box::new(unrecorded.clone()));
            self.parts.channel.send(&[PeerId::Server], content);
        }
        if !self.parts.replica.is_radio_off() {
            self.parts.channel.broadcast(&self.others, content);
        }
    }

    /// Decides what is flown in a cycle; nothing if the flight has ended, or the vehicle was handed over.
    fn decide(&mut self, cycle: Cycle) -> Result<Option<AirplaneControl>, FlightError> {
        let guard = self.parts.board.guard();
        if self.parts.replica.has_ended(self.id) {
            self.state = "arrived";
            return Ok(None);
        }
        if guard.held.is_some() {
            self.state = "held";
            return Ok(None);
        }
        self.state = "reports";
        let before = cycle as i64 - 1;
        let reports_until_s = self.time.cycle_at_s(before, TimeShares::DEFAULT.reports);
        self.listen_until(reports_until_s, |node| node.parts.replica.missing().is_empty())?;
        let missing = self.parts.replica.missing();
        let talk_until_s = self.time.cycle_at_s(before, 1.0 - HAND_OVER_SHARE);
        if !missing.is_empty() || self.clock.now_s() >= talk_until_s {
            self.count(if missing.is_empty() { "late-cycles" } else { "unheard-cycles" });
            self.state = "orbits";
            return Ok(Some(self.parts.pilot.stay_on_fallback(cycle, &missing)));
        }
        if cycle < self.talks_from {
            self.count("quiet-cycles");
            self.state = "orbits";
            return Ok(Some(self.parts.pilot.stay_on_fallback(cycle, &[])));
        }
        let percept = self.parts.replica.percept();
        // What others report is checked; what follows from it cannot make the pilot fail.
        let is_sound = |percept: &Percept| percept.check(self.parts.replica.world()).is_ok();
        let Some(percept) = percept.filter(is_sound) else {
            self.count("impossible-percepts");
            self.state = "orbits";
            return Ok(Some(self.parts.pilot.stay_on_fallback(cycle, &[])));
        };
        self.state = "talks";
        let tick = self.first_tick();
        self.talk = Some((tick, Instant::now()));
        self.parts.pilot.start(percept, tick);
        for (from, packet) in std::mem::take(&mut self.early_packets) {
            self.on_packet(from, &packet);
        }
        self.listen_until(talk_until_s, |node| node.parts.pilot.is_done())?;
        match self.parts.pilot.control().filter(|control| control.cycle == cycle) {
            Some(control) => Ok(Some(control)),
            None => {
                self.count("late-controls");
                self.state = "orbits";
                Ok(Some(self.parts.pilot.stay_on_fallback(cycle, &[])))
            }
        }
    }

    /// Offers a control to the guard. Returns whether it is flown.
    fn offer(&mut self, cycle: Cycle, control: &AirplaneControl) -> bool {
        let reference = self.parts.replica.reference(Some(control), self.reference_cycles());
        let now_s = self.clock.now_s();
        let is_flown = self.parts.board.offer(cycle, reference, now_s);
        if is_flown {
            let began_s = self.time.cycle_at_s(cycle as i64 - 1, 0.0);
            let taken = Duration::try_from_secs_f64(now_s - began_s).unwrap_or_default();
            self.decision_time.record(taken);
        } else {
            self.count("refused-controls");
        }
        is_flown
    }

    /// Ends a cycle: what was handed over is flown from now on.
    fn end_cycle(&mut self, flown: Option<AirplaneControl>) {
        if let Some(report) = &mut self.own_report {
            let bytes = flown.as_ref().map(postcard::to_stdvec);
            report.control = bytes.and_then(Result::ok);
        }
        if flown.is_some() {
            self.count("controls");
        }
        self.parts.replica.advance(flown);
        self.show_traffic();
    }

    /// Shows the vehicle where the others are.
    fn show_traffic(&mut self) {
        let mut traffic = Vec::new();
        for (&id, report) in &self.last_reports {
            if report.report.has_ended() {
                continue;
            }
            let world = self.parts.replica.world();
            traffic.push(TrafficReport {
                address: FIRST_ADDRESS + id,
                pose: report.report.part.pose,
                altitude_m: report.report.part.altitude_m,
                ground_speed_m_s: world.airplanes[id as usize].model.v_m_s,
            });
        }
        self.parts.board.put_traffic(traffic);
    }

    /// Reports for some more cycles, because others may not have heard the last report.
    fn say_goodbye(&mut self) -> Result<(), FlightError> {
        self.state = "done";
        let cycle = self.parts.replica.cycle() + FAREWELL_CYCLES;
        self.listen_until(self.time.cycle_at_s(cycle as i64 - 1, 0.0), |_| false)
    }

    /// Does everything that is due until a time, or until something holds.
    fn listen_until(
        &mut self,
        until_s: f64,
        holds: impl Fn(&Self) -> bool,
    ) -> Result<(), FlightError> {
        loop {
            if (self.has_to_end)() {
                return Err(FlightError::Interrupted);
            }
            self.parts.board.beat();
            self.send_report_if_due();
            self.advance_talk();
            self.tell_status(false);
            if self.clock.now_s() >= until_s || holds(self) {
                return Ok(());
            }
            self.receive(self.max_wait(until_s));
        }
    }

    /// Returns the time for which nothing happens unless a message comes.
    fn max_wait(&self, until_s: f64) -> Duration {
        let until = wait_until(&self.clock, until_s.min(self.repeat_at_s));
        let timer = self.talk.zip(self.parts.pilot.next_timer());
        let timer = timer.map(|((first, began), tick)| {
            let ticks = tick.saturating_sub(first) as f64;
            let due = Duration::try_from_secs_f64(ticks * self.tick_s()).unwrap_or(Duration::MAX);
            due.saturating_sub(began.elapsed())
        });
        until.min(timer.unwrap_or(Duration::MAX)).min(POLL_INTERVAL)
    }

    /// Duration of a tick in seconds of real time.
    fn tick_s(&self) -> f64 {
        let network = self.parts.replica.world().network.as_ref();
        network.map_or(1e-3, |network| network.ticks_to_s(1)) / self.settings.speed
    }

    /// Returns the present tick of the conversations.
    fn current_tick(&self) -> Option<u64> {
        let (first, began) = self.talk?;
        // A millionth of a tick more, so that a wait for a tick ends with the tick reached in spite of rounding.
        Some(first + (began.elapsed().as_secs_f64() / self.tick_s() + 1e-6) as u64)
    }

    /// Does what is due in the conversations, and sends the packets that follow.
    fn advance_talk(&mut self) {
        let Some(tick) = self.current_tick() else { return };
        self.parts.pilot.on_timer(tick);
        self.send_packets(tick);
    }

    fn send_packets(&mut self, tick: u64) {
        let cycle = self.parts.replica.cycle();
        let mut by_receivers: BTreeMap<Vec<EntityId>, Vec<AgentPacket>> = BTreeMap::new();
        for packet in self.parts.pilot.take_packets() {
            let agent_packet = AgentPacket {
                cycle,
                departs: tick,
                sequence: packet.sequence,
                arrives: tick + 1,
                payload: packet.payload.to_vec(),
            };
            by_receivers.entry(packet.to.to_vec()).or_default().push(agent_packet);
        }
        if self.parts.replica.is_radio_off() {
            return;
        }
        for (to, packets) in by_receivers {
            self.status.packets += (packets.len() * to.len()) as u64;
            self.parts.channel.broadcast(&to, FlightContent::Packets(packets));
        }
    }

    /// Receives what comes within some time.
    fn receive(&mut self, within: Duration) {
        let Some(received) = self.parts.channel.receive(within) else { return };
        self.on_message(received);
        // Where much has come, one step answers all of it.
        for _ in 0..100 {
            let Some(received) = self.parts.channel.receive(Duration::ZERO) else { return };
            self.on_message(received);
        }
    }

    fn on_message(&mut self, received: ReceivedContent) {
        let ReceivedContent { from, start_s, is_in_time, content, .. } = received;
        if let Some(behind_s) = self.parts.channel.behind_s(from) {
            self.max_behind_s = self.max_behind_s.max(behind_s.abs());
        }
        let from = match from {
            PeerId::Server => {
                self.on_recorder(&content, start_s);
                return;
            }
            PeerId::Node(from) => from,
        };
        if !self.others.contains(&from) {
            self.count("strangers");
            return;
        }
        match content {
            FlightContent::Presence(_) => {
                self.present.insert(from, Instant::now());
            }
            FlightContent::Recall => self.on_recall(from),
            FlightContent::Recalled(answer) => self.on_recalled(from, *answer),
            // A dead radio hears nothing.
            _ if self.parts.replica.is_radio_off() => {}
            FlightContent::Report(report) if report.report.id != from => self.count("forged"),
            // Where the other one is at which time, nobody can tell.
            FlightContent::Report(_) if !is_in_time => self.count("clock-reports"),
            FlightContent::Report(report) => self.on_report(*report),
            FlightContent::Packets(packets) => {
                packets.iter().for_each(|packet| self.on_packet(from, packet));
            }
            FlightContent::Start | FlightContent::Status(_) | FlightContent::Received(_) => {
                self.count("strangers");
            }
        }
    }

    /// Takes the start, where the recorder says it, and what it has received.
    fn on_recorder(&mut self, content: &FlightContent, start_s: Option<f64>) {
        if let FlightContent::Received(cycle) = content {
            self.is_recorded = true;
            self.unrecorded.remove(cycle);
        }
        let is_awaited = self.settings.start_s.is_none() && !self.time.start_s.is_finite();
        if let (FlightContent::Start, Some(start_s), true) = (content, start_s, is_awaited)
            && start_s.is_finite()
        {
            self.time.start_s = start_s;
            self.announce_start();
        }
    }

    /// Answers what another one has reported last. One that was started again, and has not heard it since, does not know what
    /// it has heard before, so it does not answer.
    fn on_recall(&mut self, from: EntityId) {
        let Some(report) = self.last_reports.get(&from) else { return };
        let replica = &self.parts.replica;
        let ended = self.others.iter().copied().filter(|&other| replica.has_ended(other)).collect();
        let answer = RecallAnswer { report: report.clone(), ended };
        self.parts.channel.send(&[PeerId::Node(from)], FlightContent::Recalled(Box::new(answer)));
    }

    fn on_recalled(&mut self, from: EntityId, answer: RecallAnswer) {
        if answer.report.report.id == self.id {
            self.recalled.insert(from, answer);
        }
    }

    fn on_report(&mut self, report: FlightReport) {
        let id = report.report.id;
        let cycle = self.parts.replica.cycle();
        let is_newer = self
            .last_reports
            .get(&id)
            .is_none_or(|known| report.report.cycle >= known.report.cycle);
        if report.report.cycle > cycle {
            // Of the next cycle only: clocks differ by less than one.
            if report.report.cycle == cycle + 1 {
                self.early_reports.insert((cycle + 1, id), report);
            }
            return;
        }
        if report.report.cycle < cycle {
            return;
        }
        let accepted = match report.standing {
            Standing::Leads => self.parts.replica.accept_report(&report.report),
            // It is somewhere, and nobody knows where it will be: it counts as missing.
            Standing::Held(Some(at)) => self.parts.replica.note_position(id, at),
            Standing::Held(None) => Ok(()),
        };
        if accepted.is_err() {
            self.count("impossible-reports");
            return;
        }
        self.heard.insert(id);
        if is_newer {
            self.last_reports.insert(id, report);
        }
    }

    fn on_packet(&mut self, from: EntityId, packet: &AgentPacket) {
        let cycle = self.parts.replica.cycle();
        match self.current_tick() {
            Some(tick) if packet.cycle == cycle => {
                self.parts.pilot.on_packet(from, &packet.payload, tick);
            }
            // Others may have begun their conversations before this one, or the next cycle.
            _ if packet.cycle >= cycle && self.early_packets.len() < MAX_EARLY_PACKETS => {
                self.early_packets.push((from, packet.clone()));
            }
            // Of a cycle that is over.
            _ => self.count("late-packets"),
        }
    }

    fn count(&mut self, name: &'static str) {
        *self.counts.entry(name).or_default() += 1;
    }

    /// Tells the recorder, and whoever has started this process, the state of the node.
    fn tell_status(&mut self, is_last: bool) {
        let now = Instant::now();
        let is_due = now >= self.report_at || is_last;
        if !is_due {
            return;
        }
        self.report_at = now + STATUS_INTERVAL;
        let status = self.flight_status();
        self.parts.board.take_events();
        let (_, bytes) = self.parts.channel.sent();
        self.status.bytes = bytes;
        self.status.activity = self.state.into();
        self.status.heard = self.heard.iter().copied().collect();
        self.status.dropped.clone_from(&status.counts);
        let content = FlightContent::Status(self.status.clone());
        self.parts.channel.send(&[PeerId::Server], content);
        (self.on_status)(&status);
    }

    /// Returns the time in milliseconds within which a share of the controls was handed over.
    fn decision_ms(&self, share: f64) -> u64 {
        self.decision_time.quantile(share).map_or(0, |within_s| (1e3 * within_s).round() as u64)
    }

    fn flight_status(&self) -> FlightStatus {
        let guard = self.parts.board.guard();
        let own = self.counts.iter().map(|(&name, &count)| (name.to_string(), count));
        let dropped = self.parts.pilot.drop_counts();
        let packets = crate::recent_senders::drop_counts(&dropped);
        let seen = self.parts.board.seen_traffic();
        let clock_ms = (1e3 * self.max_behind_s).round();
        let further = [
            ("seen-traffic".to_string(), seen),
            // The conversion saturates.
            ("clock-difference-ms".to_string(), clock_ms as u64),
            ("handed-over".to_string(), u64::from(guard.held.is_some())),
            (DECISION_P50_MS.to_string(), self.decision_ms(0.5)),
            (DECISION_P99_MS.to_string(), self.decision_ms(0.99)),
        ];
        let all = own.chain(self.parts.channel.counts()).chain(packets).chain(guard.counts);
        let mut counts: Vec<(String, u64)> = all.chain(further).collect();
        counts.retain(|(_, count)| *count > 0);
        counts.sort();
        FlightStatus {
            cycle: self.parts.replica.cycle().saturating_sub(1),
            state: guard.held.as_ref().map_or(self.state, |_| "held").into(),
            deviation_m: guard.deviation_m,
            max_deviation_m: guard.max_deviation_m,
            events: guard.events,
            counts,
        }
    }
}
