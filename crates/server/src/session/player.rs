//! A run that is played: its next steps, and its answers.

mod seek;
mod viewers;

use super::foxglove::FoxgloveLease;
use super::history::RunHistory;
use super::inspect::inspection;
use super::open_run::OpenRun;
use super::pace::{CycleRate, SliceSize};
use super::page_view::{MAX_SCANNED_BODIES, PageView};
use super::prefetcher::Prefetcher;
use super::save::SaveOptions;
use crate::SPEED_RANGE;
use crate::encode::scene;
use crate::outbox::Outbox;
use crate::protocol::{
    Method, Problem, Reply, ReplyBody, ReplyResult, ServerNotification, SessionId, SessionState,
    SessionStatus, Speed,
};
use seek::Seek;
use sidestep::kernel::view::Scenery;
use sidestep::kernel::{Cycle, Interrupt};
use sidestep_session::Pacer;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The largest number of events in an answer; a page that wants more asks again.
const MAX_EVENTS: u32 = 5000;

/// A run that is played.
pub(super) struct Player {
    session: SessionId,
    outbox: Arc<Outbox>,
    interrupt: Interrupt,
    pub(super) stage: OpenRun,
    scenery: Scenery,
    viewer: PageView,
    showing: FoxgloveLease,
    memory: RunHistory,
    scout: Option<Prefetcher>,
    state: SessionState,
    speed: Speed,
    beat: Option<Pacer>,
    errand: Option<Seek>,
    /// The request now being taken.
    taken: Option<u32>,
    pace: SliceSize,
    rate: CycleRate,
    /// Digest of the state, and its cycle.
    digest: Option<(Cycle, String)>,
    /// The result of comparing a recording with its digest.
    verdict: Option<String>,
}

impl Player {
    pub(super) fn new(
        session: SessionId,
        outbox: Arc<Outbox>,
        interrupt: Interrupt,
        stage: OpenRun,
    ) -> Result<Self, Problem> {
        let scenery = stage.run.scenery();
        let mut player = Self {
            session,
            viewer: PageView::new(session, outbox.clone(), &scenery),
            showing: FoxgloveLease::new(stage.foxglove_host(), session),
            outbox,
            interrupt,
            memory: RunHistory::from_run(stage.run.as_ref(), stage.metric_infos(), stage.budget()),
            scout: None,
            state: SessionState::Paused,
            speed: Speed::Times(1.0),
            beat: None,
            errand: None,
            taken: None,
            pace: SliceSize::default(),
            rate: CycleRate::default(),
            digest: None,
            verdict: None,
            stage,
            scenery,
        };
        player.prepare();
        player.restart_viewers()?;
        Ok(player)
    }

    /// Prepares a run that is at its start.
    fn prepare(&mut self) {
        self.stage.run.set_interrupt(self.interrupt.clone());
        self.stage.run.enable_events();
        if self.showing.is_enabled() {
            self.memory.log.enable_viewers();
        }
        self.scout = self
            .stage
            .recorded_run_again()
            .map(|run| Prefetcher::new(run, self.stage.until, self.interrupt.clone()));
        self.pause();
    }

    fn restart(&mut self, seed: Option<u64>, text: Option<String>) -> Result<ReplyBody, Problem> {
        let is_other = text.is_some();
        self.stage.restart(seed, text)?;
        self.scenery = self.stage.run.scenery();
        self.viewer.restart(&self.scenery);
        self.memory = RunHistory::from_run(
            self.stage.run.as_ref(),
            self.stage.metric_infos(),
            self.stage.budget(),
        );
        (self.digest, self.pace, self.rate) = (None, SliceSize::default(), CycleRate::default());
        self.prepare();
        // The same scenario only goes back to its start.
        if is_other {
            self.restart_viewers()?;
        }
        Ok(self.opened_reply())
    }

    /// Returns the answer to the page that has opened the session.
    pub(super) fn opened_reply(&mut self) -> ReplyBody {
        let (run, is_recording) = (&self.stage.run, self.stage.recorded.is_some());
        let scene = scene(run.world(), run.agent(), &self.scenery, is_recording);
        ReplyBody::Opened { session: self.session, scene, status: self.status(Instant::now()) }
    }

    fn cycle(&self) -> Cycle {
        self.stage.run.cycle()
    }

    fn is_at_end(&self) -> bool {
        self.cycle() >= self.stage.until || self.stage.run.is_over()
    }

    /// Answers a request, now or on arrival.
    pub(super) fn on_request(&mut self, id: u32, call: Method) {
        self.taken = Some(id);
        if let Some(result) = self.answer(id, call) {
            self.reply(id, result);
        }
        self.taken = None;
    }

    fn reply(&self, id: u32, result: Result<ReplyBody, Problem>) {
        let result = result.map_or_else(ReplyResult::Problem, ReplyResult::Answer);
        self.outbox.send_reply(&Reply { id, result });
    }

    /// Returns the answer to a request; `None` if it is given later.
    fn answer(&mut self, id: u32, call: Method) -> Option<Result<ReplyBody, Problem>> {
        Some(match call {
            Method::Play { speed, .. } => self.play(speed),
            Method::Pause { .. } => {
                self.cancel_seek("the run was paused");
                self.pause();
                Ok(ReplyBody::Done)
            }
            Method::Step { cycles, .. } => {
                self.step(id, cycles);
                return None;
            }
            Method::Seek { cycle, .. } => {
                self.seek(Some(id), cycle, None);
                return None;
            }
            Method::Restart { seed, text, .. } => {
                self.cancel_seek("the run was started anew");
                let result = self.restart(seed, text);
                if result.is_err() && self.state == SessionState::Seeking {
                    self.pause();
                }
                result
            }
            other => self.answer_query(other),
        })
    }

    /// Answers a request that does not move the run.
    fn answer_query(&mut self, call: Method) -> Result<ReplyBody, Problem> {
        let run = self.stage.run.as_mut();
        match call {
            Method::SelectScans { bodies, .. } if bodies.len() > MAX_SCANNED_BODIES => {
                let cause = format!("scans of at most {MAX_SCANNED_BODIES} bodies are shown");
                Err(Problem::new("select-scans", cause, "select fewer"))
            }
            Method::SelectScans { bodies, .. } => {
                self.viewer.set_scanned_bodies(bodies);
                Ok(ReplyBody::Done)
            }
            Method::Credit { frames, .. } => {
                self.viewer.add_credit(frames);
                Ok(ReplyBody::Done)
            }
            Method::Inspect { body, .. } => inspection(run, &body).map(ReplyBody::Inspection),
            Method::Metrics { from, .. } => Ok(self.memory.samples.answer(from)),
            Method::Events { from, until, skip, limit, .. } => {
                self.viewer.drain(run, &mut self.memory.log, Instant::now());
                Ok(self.memory.log.answer(from..until, skip.unwrap_or(0), limit.min(MAX_EVENTS)))
            }
            Method::Source { .. } => {
                let source = &self.stage.source;
                let (place, text) = (source.place.clone(), source.text.clone());
                Ok(ReplyBody::Source { place, text, read_only: self.stage.is_read_only() })
            }
            Method::Save { text, to, base, overwrite, .. } => {
                self.stage.save(text, to, SaveOptions { base, overwrite })
            }
            Method::Tables { .. } => self.stage.tables().map(|names| ReplyBody::Tables { names }),
            _ => Err(Problem::new("request", "it is not for a session", "report this as a bug")),
        }
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
        self.beat = match speed {
            Speed::Fastest => None,
            Speed::Times(times) => {
                Some(Pacer::new(times / self.scenery.cycle_s, Instant::now(), self.cycle()))
            }
        };
        match self.is_at_end() {
            true => self.pause(),
            false => self.state = SessionState::Playing,
        }
        Ok(ReplyBody::Done)
    }

    /// Stops where the run is.
    fn pause(&mut self) {
        let is_at_end = self.is_at_end();
        self.state = if is_at_end { SessionState::Over } else { SessionState::Paused };
        self.errand = None;
        self.rate = CycleRate::default();
        self.viewer.refresh();
        let cycle = self.cycle();
        self.memory.record_pause(self.stage.run.as_ref());
        if self.digest.as_ref().is_none_or(|(of, _)| *of != cycle) {
            self.digest = Some((cycle, self.stage.run.digest().to_string()));
        }
        self.verdict = self.stage.verdict(self.stage.run.as_ref()).or(self.verdict.take());
    }

    /// Does the work that is due, for some milliseconds at most. Returns the time until there is more, unless a
    /// request comes; `None` for forever.
    pub(super) fn poll(&mut self) -> Option<Duration> {
        let now = Instant::now();
        self.memory.keyframes.shrink_to_budget();
        match (self.state, self.errand) {
            (SessionState::Playing, _) => {
                let cycle = self.cycle();
                let beat = self.beat.as_mut();
                let target = beat.map_or(self.stage.until, |beat| beat.target(now, cycle));
                self.advance_slice(target.min(self.stage.until));
            }
            (SessionState::Seeking, Some(Seek { target, .. })) => self.advance_slice(target),
            _ => {}
        }
        self.stop_at_target();
        let now = Instant::now();
        self.viewer.send_due_frame(self.stage.run.as_mut(), &mut self.memory.log, now);
        let status = self.status(now);
        self.viewer.report_status(status.clone(), now);
        self.update_viewers(now);
        let is_free = self.work_due(now).is_none_or(|due| due > now);
        if is_free && self.prefetch() {
            return Some(Duration::ZERO);
        }
        let status_due = self.status_due(&status);
        let due =
            [self.work_due(now), self.viewer.frame_due(), status_due, self.showing.next_update()];
        let next = due.into_iter().flatten().min()?;
        Some(next.saturating_duration_since(Instant::now()))
    }

    fn work_due(&self, now: Instant) -> Option<Instant> {
        match (self.state, &self.beat) {
            (SessionState::Playing, Some(beat)) => Some(beat.next_due(self.cycle())),
            (SessionState::Playing | SessionState::Seeking, _) => Some(now),
            _ => None,
        }
    }

    fn status_due(&self, status: &SessionStatus) -> Option<Instant> {
        self.viewer.needs_report(status).then(|| self.viewer.status_due())
    }

    /// Stops where the seek or the run ends.
    fn stop_at_target(&mut self) {
        let is_there = self.errand.is_some_and(|errand| self.cycle() >= errand.target);
        let is_on_the_way = matches!(self.state, SessionState::Playing | SessionState::Seeking);
        if is_on_the_way && (is_there || self.is_at_end()) {
            let errand = self.errand;
            self.pause();
            if let Some(id) = errand.and_then(|errand| errand.id) {
                self.reply(id, Ok(ReplyBody::Done));
            }
            if let Some(speed) = errand.and_then(|errand| errand.then) {
                // Speeds of viewers are in bounds.
                let _ = self.play(speed);
            }
        }
    }

    /// Goes on for some milliseconds, but not beyond the target cycle.
    fn advance_slice(&mut self, target: Cycle) {
        let asked = self.pace.cycles().min(target.saturating_sub(self.cycle()));
        if asked == 0 || self.stage.run.is_over() {
            return;
        }
        let started = Instant::now();
        let done = self.stage.run.advance(asked);
        let took = started.elapsed();
        self.pace.adapt(done, took);
        self.rate.record(Instant::now(), done);
        self.viewer.mark_moved();
        self.digest = None;
        self.memory.record(self.stage.run.as_ref(), took);
    }

    /// Computes ahead when there is nothing else to do; returns whether there was anything to compute ahead.
    fn prefetch(&mut self) -> bool {
        let Some(scout) = &mut self.scout else { return false };
        if let Some(run) = scout.advance_slice(&mut self.memory) {
            self.verdict = self.stage.verdict(run).or(self.verdict.take());
            self.scout = None;
        }
        true
    }

    fn status(&mut self, now: Instant) -> SessionStatus {
        let cycle = self.cycle();
        let is_still = matches!(self.state, SessionState::Paused | SessionState::Over);
        let has_digest = is_still && self.stage.is_computed();
        let digest = self.digest.as_ref().filter(|(of, _)| has_digest && *of == cycle);
        let banner = self.stage.recorded.as_ref().map(|_| {
            let later = || "Computed again; the digest is compared at the end.".into();
            self.verdict.clone().unwrap_or_else(later)
        });
        SessionStatus {
            session: self.session,
            state: self.state,
            cycle: cycle as f64,
            cycles_planned: self.stage.until as f64,
            time_s: cycle as f64 * self.scenery.cycle_s,
            speed: self.speed,
            cycles_per_s: if is_still { 0.0 } else { self.rate.per_s(now) },
            seed: self.stage.run.config().seed.to_string(),
            digest: digest.map(|(_, digest)| digest.clone()),
            banner,
            fleet: None,
        }
    }

    /// Reports that the session ends here; the run is no longer touched.
    pub(super) fn fail(&mut self, problem: Problem) {
        let errand = self.errand.and_then(|errand| errand.id);
        self.cancel_seek("the session has ended");
        // The request that met the bug waits for an answer, too.
        if let Some(id) = self.taken.take().filter(|id| Some(*id) != errand) {
            self.reply(id, Err(problem.clone()));
        }
        if let Some(told) = self.viewer.last_reported() {
            self.outbox.send_status(
                self.session,
                &ServerNotification::Status(SessionStatus { state: SessionState::Failed, ..told }),
            );
        }
        self.outbox
            .send_notification(&ServerNotification::Ended { session: self.session, problem });
    }
}
