//! A run that is played: the work that is due, and the replies to requests.

mod seek;
mod viewers;

use super::ahead_run::AheadRun;
use super::foxglove::FoxgloveLease;
use super::history::{ComputedCycles, RunHistory};
use super::inspect::inspection;
use super::open_run::OpenRun;
use super::pace::{CycleRate, CyclesPerSlice};
use super::page_publisher::{MAX_SCANNED_BODIES, SessionUpdatePublisher};
use super::save::SaveOptions;
use crate::SPEED_RANGE;
use crate::agent_metrics::AgentMetrics;
use crate::encode::{requested_body, scene};
use crate::event_search::EventQuery;
use crate::outbox::Outbox;
use crate::protocol::{
    BodyId, Problem, Reply, ReplyBody, ReplyResult, RunMethod, ServerNotification, SessionId,
    SessionState, SessionStatus, Speed,
};
use crate::usage_registry::UsageEntry;
use seek::Seek;
use sidestep_kernel::view::Scenery;
use sidestep_kernel::{Cycle, Interrupt};
use sidestep_session::Pacer;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Maximum number of events in a reply; a page that wants more repeats its request.
const MAX_EVENTS: u32 = 5000;

/// A run that is played.
pub(super) struct Player {
    session: SessionId,
    outbox: Arc<Outbox>,
    interrupt: Interrupt,
    pub(super) open_run: OpenRun,
    scenery: Scenery,
    publisher: SessionUpdatePublisher,
    foxglove: FoxgloveLease,
    history: RunHistory,
    /// The second computation of a recording, until it is at its end.
    prefetcher: Option<AheadRun>,
    state: SessionState,
    speed: Speed,
    /// The pacer of a run that is played at a speed; none where it is played as fast as possible.
    pacer: Option<Pacer>,
    seek: Option<Seek>,
    /// The request that is being answered.
    request_in_progress: Option<u32>,
    slice: CyclesPerSlice,
    rate: CycleRate,
    /// Digest of the state at its cycle: computed once for each pause, because it reads the whole state.
    digest: Option<(Cycle, String)>,
    /// The result of comparing a recording with its digest.
    verdict: Option<String>,
    usage: UsageEntry,
}

impl Player {
    pub(super) fn new(
        session: SessionId,
        outbox: Arc<Outbox>,
        interrupt: Interrupt,
        open_run: OpenRun,
    ) -> Result<Self, Problem> {
        let mut open_run = open_run;
        let scenery = open_run.run.scenery();
        let history = RunHistory::from_run(&mut open_run)?;
        let mut player = Self {
            session,
            publisher: SessionUpdatePublisher::new(session, outbox.clone(), &scenery),
            foxglove: FoxgloveLease::new(open_run.foxglove_host(), session),
            outbox,
            interrupt,
            history,
            prefetcher: None,
            state: SessionState::Paused,
            speed: Speed::Times(1.0),
            pacer: None,
            seek: None,
            request_in_progress: None,
            slice: CyclesPerSlice::default(),
            rate: CycleRate::default(),
            digest: None,
            verdict: None,
            usage: open_run.usage().add(session),
            open_run,
            scenery,
        };
        player.attach_run();
        player.restart_viewers()?;
        Ok(player)
    }

    /// Prepares a run that is at its start.
    fn attach_run(&mut self) {
        self.open_run.run.set_interrupt(self.interrupt.clone());
        self.open_run.run.enable_events();
        if self.foxglove.is_enabled() {
            self.history.log.enable_viewer_events();
        }
        self.prefetcher = self
            .open_run
            .start_prefetch_replay()
            .map(|run| AheadRun::new(run, self.open_run.until, self.interrupt.clone()))
            .map(|ahead| ahead.with_series(self.history.metrics.interval()));
        self.pause();
    }

    fn restart(&mut self, seed: Option<u64>, text: Option<String>) -> Result<ReplyBody, Problem> {
        let is_new_scenario = text.is_some();
        self.open_run.restart(seed, text)?;
        self.scenery = self.open_run.run.scenery();
        self.publisher.restart(&self.scenery);
        self.history = RunHistory::from_run(&mut self.open_run)?;
        self.digest = None;
        self.slice = CyclesPerSlice::default();
        self.rate = CycleRate::default();
        self.attach_run();
        // A server for viewers serves one scenario, at any of its cycles.
        if is_new_scenario {
            self.restart_viewers()?;
        }
        Ok(self.opened_reply())
    }

    /// Returns the answer to the page that has opened the session.
    pub(super) fn opened_reply(&mut self) -> ReplyBody {
        let run = &self.open_run.run;
        let is_recording = self.open_run.recorded.is_some();
        let scene = scene(run.world_name(), run.agent_noun(), &self.scenery, is_recording);
        ReplyBody::Opened { session: self.session, scene, status: self.status(Instant::now()) }
    }

    fn cycle(&self) -> Cycle {
        self.open_run.run.cycle()
    }

    fn is_at_end(&self) -> bool {
        self.cycle() >= self.open_run.until || self.open_run.run.is_over()
    }

    /// Answers a request, now or on arrival.
    pub(super) fn on_request(&mut self, id: u32, call: RunMethod) {
        self.request_in_progress = Some(id);
        if let Some(result) = self.answer(id, call) {
            self.send_reply(id, result);
        }
        self.request_in_progress = None;
    }

    fn send_reply(&self, id: u32, result: Result<ReplyBody, Problem>) {
        let result = result.map_or_else(ReplyResult::Problem, ReplyResult::Answer);
        self.outbox.send_reply(&Reply { id, result });
    }

    /// Returns the answer to a request; `None` if it is given later.
    fn answer(&mut self, id: u32, call: RunMethod) -> Option<Result<ReplyBody, Problem>> {
        Some(match call {
            RunMethod::Play { speed } => self.play(speed),
            RunMethod::Pause {} => {
                self.cancel_seek("the run was paused");
                self.pause();
                Ok(ReplyBody::Done)
            }
            RunMethod::Step { cycles } => {
                self.step(id, cycles);
                return None;
            }
            RunMethod::Seek { cycle } => {
                self.start_seek(Some(id), cycle, None);
                return None;
            }
            RunMethod::Restart { seed, text } => {
                self.cancel_seek("the run was restarted");
                let result = self.restart(seed, text);
                if result.is_err() && self.state == SessionState::Seeking {
                    self.pause();
                }
                result
            }
            RunMethod::SelectScans { bodies } => self.select_scans(bodies),
            RunMethod::Credit { frames } => {
                self.publisher.add_credit(frames);
                Ok(ReplyBody::Done)
            }
            RunMethod::Inspect { body } => {
                let kinds = self.open_run.kinds();
                inspection(self.open_run.run.as_ref(), &body, &kinds).map(ReplyBody::Inspection)
            }
            RunMethod::Metrics { from } => {
                let is_advancing =
                    matches!(self.state, SessionState::Playing | SessionState::Seeking);
                let run = self.open_run.run.as_ref();
                Ok(self.history.metrics.metrics_reply(run, from, is_advancing))
            }
            RunMethod::AgentMetrics { metric } => {
                let words = self.open_run.metric_words();
                AgentMetrics::from_run(self.open_run.run.as_ref()).reply(metric.as_deref(), words)
            }
            RunMethod::FindEvents { text, kinds, skip, limit } => {
                let run = self.open_run.run.as_mut();
                self.publisher.record_events(run, &mut self.history.log, Instant::now());
                let query = EventQuery { text: &text, kinds: kinds.as_deref(), skip, limit };
                Ok(query.reply(&self.history.log, &self.scenery))
            }
            RunMethod::Events { from, until, skip, limit } => {
                let run = self.open_run.run.as_mut();
                self.publisher.record_events(run, &mut self.history.log, Instant::now());
                let limit = limit.min(MAX_EVENTS);
                Ok(self.history.log.events_reply(from..until, skip.unwrap_or(0), limit))
            }
            RunMethod::Trails { until, bodies } => {
                Ok(self.history.trails.trails_reply(until, &bodies))
            }
            RunMethod::Source {} => Ok(self.source_reply()),
            RunMethod::Tables {} => {
                self.open_run.table_names().map(|names| ReplyBody::Tables { names })
            }
            RunMethod::Save { text, to, base, overwrite } => {
                self.open_run.save(text, to, SaveOptions { base, overwrite })
            }
        })
    }

    fn source_reply(&self) -> ReplyBody {
        let source = &self.open_run.source;
        ReplyBody::Source {
            place: source.place.clone(),
            text: source.text.clone(),
            read_only: self.open_run.is_read_only(),
        }
    }

    fn select_scans(&mut self, bodies: Vec<BodyId>) -> Result<ReplyBody, Problem> {
        if bodies.len() > MAX_SCANNED_BODIES {
            let cause = format!("scans of at most {MAX_SCANNED_BODIES} bodies are shown");
            return Err(Problem::new("select-scans", cause, "select fewer"));
        }
        let kinds = self.open_run.kinds();
        let known = bodies.iter().filter_map(|of| requested_body(of, &kinds)).collect();
        self.publisher.set_scanned_bodies(known);
        Ok(ReplyBody::Done)
    }

    fn play(&mut self, speed: Speed) -> Result<ReplyBody, Problem> {
        if let Speed::Times(times) = speed
            && !SPEED_RANGE.contains(&times)
        {
            let cause = format!("{times} times is no speed");
            return Err(Problem::new("play", cause, "give 0.1 to 100, or `fastest`"));
        }
        self.cancel_seek("the run was played");
        self.speed = speed;
        self.pacer = match speed {
            Speed::Fastest => None,
            Speed::Times(times) => {
                Some(Pacer::new(times / self.scenery.cycle_s, Instant::now(), self.cycle()))
            }
        };
        if self.is_at_end() {
            self.pause();
        } else {
            self.state = SessionState::Playing;
        }
        Ok(ReplyBody::Done)
    }

    /// Pauses at the present cycle, whose digest is then on display.
    fn pause(&mut self) {
        let is_at_end = self.is_at_end();
        self.state = if is_at_end { SessionState::Over } else { SessionState::Paused };
        self.seek = None;
        self.rate = CycleRate::default();
        self.publisher.request_frame();
        let cycle = self.cycle();
        if self.digest.as_ref().is_none_or(|(digest_cycle, _)| *digest_cycle != cycle) {
            self.digest = Some((cycle, self.open_run.run.digest().to_string()));
        }
        self.verdict =
            self.open_run.replay_verdict(self.open_run.run.as_ref()).or(self.verdict.take());
    }

    /// Does the work that is due, for some milliseconds at most. Returns the time until there is more, unless a
    /// request comes; `None` for forever.
    pub(super) fn run_due_work(&mut self) -> Option<Duration> {
        let now = Instant::now();
        // Each time, because another session may have started since, and wants its share.
        self.history.keyframes.shrink_to_budget();
        self.usage.set(self.history.bytes());
        match (self.state, self.seek) {
            (SessionState::Playing, _) => {
                let cycle = self.cycle();
                let until = self.open_run.until;
                let target = self.pacer.as_mut().map_or(until, |pacer| pacer.target(now, cycle));
                self.advance_slice(target.min(until));
            }
            (SessionState::Seeking, Some(Seek { target, .. })) => self.advance_slice(target),
            _ => {}
        }
        self.stop_at_target();
        let now = Instant::now();
        self.publisher.send_due_frame(self.open_run.run.as_mut(), &mut self.history.log, now);
        let status = self.status(now);
        self.publisher.report_status(status.clone(), now);
        self.update_viewers(now);
        let is_idle = self.next_work_due(now).is_none_or(|due| due > now);
        if is_idle && self.compute_ahead() {
            return Some(Duration::ZERO);
        }
        let status_due = self.status_due(&status);
        let due = [
            self.next_work_due(now),
            self.publisher.frame_due(),
            status_due,
            self.foxglove.next_update(),
        ];
        let next = due.into_iter().flatten().min()?;
        Some(next.saturating_duration_since(Instant::now()))
    }

    fn next_work_due(&self, now: Instant) -> Option<Instant> {
        match (self.state, &self.pacer) {
            (SessionState::Playing, Some(pacer)) => Some(pacer.next_due(self.cycle())),
            (SessionState::Playing | SessionState::Seeking, _) => Some(now),
            _ => None,
        }
    }

    fn status_due(&self, status: &SessionStatus) -> Option<Instant> {
        self.publisher.is_new_status(status).then(|| self.publisher.status_due_time())
    }

    /// Pauses where the seek or the run ends.
    fn stop_at_target(&mut self) {
        let is_advancing = matches!(self.state, SessionState::Playing | SessionState::Seeking);
        let is_at_target = self.seek.is_some_and(|seek| self.cycle() >= seek.target);
        if !is_advancing || !(is_at_target || self.is_at_end()) {
            return;
        }
        let seek = self.seek;
        self.pause();
        let Some(Seek { id, then, .. }) = seek else { return };
        if let Some(id) = id {
            self.send_reply(id, Ok(ReplyBody::Done));
        }
        if let Some(speed) = then {
            // Only viewers continue after a seek, and their speeds are in range.
            let _ = self.play(speed);
        }
    }

    /// Advances for some milliseconds, but not beyond the target cycle.
    fn advance_slice(&mut self, target: Cycle) {
        let until_sample = self.history.trails.cycles_until_due(self.cycle());
        let left = target.saturating_sub(self.cycle());
        let cycles = self.slice.cycles().min(left).min(until_sample);
        if cycles == 0 || self.open_run.run.is_over() {
            return;
        }
        let started = Instant::now();
        let done = self.open_run.run.advance(cycles);
        let computing_time = started.elapsed();
        self.slice.adapt_cycles_per_slice(done, computing_time);
        self.rate.record(Instant::now(), done);
        self.publisher.mark_cycle_changed();
        self.digest = None;
        let computed = ComputedCycles { count: done, computing_time, is_played: true };
        self.history.record(self.open_run.run.as_mut(), &computed);
    }

    /// Computes a recording ahead for some milliseconds; returns whether there was anything left to compute.
    fn compute_ahead(&mut self) -> bool {
        let Some(prefetcher) = &mut self.prefetcher else { return false };
        if let Some(run) = prefetcher.advance_slice(&mut self.history) {
            self.verdict = self.open_run.replay_verdict(run).or(self.verdict.take());
            self.prefetcher = None;
        }
        true
    }

    fn status(&mut self, now: Instant) -> SessionStatus {
        let cycle = self.cycle();
        let is_paused = matches!(self.state, SessionState::Paused | SessionState::Over);
        let has_digest = is_paused && self.open_run.is_simulated();
        let digest = self.digest.as_ref().filter(|(of, _)| has_digest && *of == cycle);
        let banner = self.open_run.recorded.as_ref().map(|_| {
            self.verdict
                .clone()
                .unwrap_or_else(|| "Computed again; the digest is compared at the end.".into())
        });
        SessionStatus {
            session: self.session,
            state: self.state,
            cycle: cycle as f64,
            cycles_planned: self.open_run.until as f64,
            time_s: cycle as f64 * self.scenery.cycle_s,
            speed: self.speed,
            cycles_per_s: if is_paused { 0.0 } else { self.rate.per_s(now) },
            seed: self.open_run.run.config().seed.to_string(),
            digest: digest.map(|(_, digest)| digest.clone()),
            banner,
            fleet: None,
        }
    }

    /// Reports that the session ends here; the run is no longer touched.
    pub(super) fn fail(&mut self, problem: Problem) {
        let seek_request = self.seek.and_then(|seek| seek.id);
        self.cancel_seek("the session has ended");
        // The request that ran into the bug waits for a reply, too, unless it is the seek.
        let request = self.request_in_progress.take();
        if let Some(id) = request.filter(|id| Some(*id) != seek_request) {
            self.send_reply(id, Err(problem.clone()));
        }
        if let Some(last) = self.publisher.last_reported() {
            self.outbox.send_status(
                self.session,
                &ServerNotification::Status(SessionStatus { state: SessionState::Failed, ..last }),
            );
        }
        self.outbox
            .send_notification(&ServerNotification::Ended { session: self.session, problem });
    }
}
