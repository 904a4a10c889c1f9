//! A run that is played: its next steps, and its answers.

mod viewers;
mod way;

use super::inspect::inspection;
use super::memory::Memory;
use super::pace::{Pace, Rate};
use super::save::Wish;
use super::scout::Scout;
use super::showing::Showing;
use super::stage::Stage;
use super::viewer::{MOST_SCANNING, Viewer};
use crate::SPEEDS;
use crate::encode::scene;
use crate::outbox::Outbox;
use crate::protocol::{
    Answer, Call, Notice, Outcome, Problem, Reply, SessionId, Speed, State, Status,
};
use sidestep::kernel::view::Scenery;
use sidestep::kernel::{Cycle, Interrupt};
use sidestep_session::Beat;
use std::sync::Arc;
use std::time::{Duration, Instant};
use way::Errand;

/// The largest number of events in an answer; a page that wants more asks again.
const MOST_EVENTS: u32 = 5000;

/// A run that is played.
pub(super) struct Player {
    session: SessionId,
    outbox: Arc<Outbox>,
    interrupt: Interrupt,
    pub(super) stage: Stage,
    scenery: Scenery,
    viewer: Viewer,
    showing: Showing,
    memory: Memory,
    scout: Option<Scout>,
    state: State,
    speed: Speed,
    beat: Option<Beat>,
    errand: Option<Errand>,
    /// The request now being taken.
    taken: Option<u32>,
    pace: Pace,
    rate: Rate,
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
        stage: Stage,
    ) -> Result<Self, Problem> {
        let scenery = stage.run.scenery();
        let mut player = Self {
            session,
            viewer: Viewer::new(session, outbox.clone(), &scenery),
            showing: Showing::new(stage.showcase(), session),
            outbox,
            interrupt,
            memory: Memory::of(stage.run.as_ref(), stage.meanings(), stage.budget()),
            scout: None,
            state: State::Paused,
            speed: Speed::Times(1.0),
            beat: None,
            errand: None,
            taken: None,
            pace: Pace::default(),
            rate: Rate::default(),
            digest: None,
            verdict: None,
            stage,
            scenery,
        };
        player.begin();
        player.show_anew()?;
        Ok(player)
    }

    /// Prepares a run that is at its start.
    fn begin(&mut self) {
        self.stage.run.heed(self.interrupt.clone());
        self.stage.run.watch();
        if self.showing.is_possible() {
            self.memory.log.keep_for_viewers();
        }
        self.scout =
            self.stage.again().map(|run| Scout::new(run, self.stage.until, self.interrupt.clone()));
        self.stand();
    }

    fn restart(&mut self, seed: Option<u64>, text: Option<String>) -> Result<Answer, Problem> {
        let is_other = text.is_some();
        self.stage.restart(seed, text)?;
        self.scenery = self.stage.run.scenery();
        self.viewer.restart(&self.scenery);
        self.memory =
            Memory::of(self.stage.run.as_ref(), self.stage.meanings(), self.stage.budget());
        (self.digest, self.pace, self.rate) = (None, Pace::default(), Rate::default());
        self.begin();
        // The same scenario only goes back to its start.
        if is_other {
            self.show_anew()?;
        }
        Ok(self.opened())
    }

    /// Returns the answer to the page that has opened the session.
    pub(super) fn opened(&mut self) -> Answer {
        let (run, is_recording) = (&self.stage.run, self.stage.recorded.is_some());
        let scene = scene(run.world(), run.agent(), &self.scenery, is_recording);
        Answer::Opened { session: self.session, scene, status: self.status(Instant::now()) }
    }

    fn cycle(&self) -> Cycle {
        self.stage.run.cycle()
    }

    fn is_at_end(&self) -> bool {
        self.cycle() >= self.stage.until || self.stage.run.is_over()
    }

    /// Answers a request, now or on arrival.
    pub(super) fn take(&mut self, id: u32, call: Call) {
        self.taken = Some(id);
        if let Some(result) = self.answer(id, call) {
            self.reply(id, result);
        }
        self.taken = None;
    }

    fn reply(&self, id: u32, result: Result<Answer, Problem>) {
        let result = result.map_or_else(Outcome::Problem, Outcome::Answer);
        self.outbox.reply(&Reply { id, result });
    }

    /// Returns the answer to a request; `None` if it is given later.
    fn answer(&mut self, id: u32, call: Call) -> Option<Result<Answer, Problem>> {
        Some(match call {
            Call::Play { speed, .. } => self.play(speed),
            Call::Pause { .. } => {
                self.give_up("the run was paused");
                self.stand();
                Ok(Answer::Done)
            }
            Call::Step { cycles, .. } => {
                self.step(id, cycles);
                return None;
            }
            Call::Seek { cycle, .. } => {
                self.go(Some(id), cycle, None);
                return None;
            }
            Call::Restart { seed, text, .. } => {
                self.give_up("the run was started anew");
                let result = self.restart(seed, text);
                if result.is_err() && self.state == State::Seeking {
                    self.stand();
                }
                result
            }
            other => self.told(other),
        })
    }

    /// Answers a request that does not move the run.
    fn told(&mut self, call: Call) -> Result<Answer, Problem> {
        let run = self.stage.run.as_mut();
        match call {
            Call::Look { scans_of, .. } if scans_of.len() > MOST_SCANNING => {
                let cause = format!("scans of at most {MOST_SCANNING} bodies are shown");
                Err(Problem::new("look", cause, "name fewer"))
            }
            Call::Look { scans_of, .. } => {
                self.viewer.look(scans_of);
                Ok(Answer::Done)
            }
            Call::Credit { frames, .. } => {
                self.viewer.grant(frames);
                Ok(Answer::Done)
            }
            Call::Inspect { who, .. } => inspection(run, &who).map(Answer::Inspection),
            Call::Metrics { from, .. } => Ok(self.memory.samples.answer(from)),
            Call::Events { from, until, skip, most, .. } => {
                self.viewer.drain(run, &mut self.memory.log, Instant::now());
                Ok(self.memory.log.answer(from..until, skip.unwrap_or(0), most.min(MOST_EVENTS)))
            }
            Call::Source { .. } => {
                let source = &self.stage.source;
                let (place, text) = (source.place.clone(), source.text.clone());
                Ok(Answer::Source { place, text, read_only: self.stage.is_fixed() })
            }
            Call::Save { text, to, base, over, .. } => {
                self.stage.save(text, to, Wish { base, over })
            }
            Call::Tables { .. } => self.stage.tables().map(|names| Answer::Tables { names }),
            _ => Err(Problem::new("request", "it is not for a session", "report this as a bug")),
        }
    }

    fn play(&mut self, speed: Speed) -> Result<Answer, Problem> {
        if let Speed::Times(times) = speed
            && !SPEEDS.contains(&times)
        {
            let cause = format!("{times} times is no speed");
            return Err(Problem::new("play", cause, "give 0.1 to 100, or `fastest`"));
        }
        self.give_up("the run was played");
        self.speed = speed;
        self.beat = match speed {
            Speed::Fastest => None,
            Speed::Times(times) => {
                Some(Beat::new(times / self.scenery.cycle_s, Instant::now(), self.cycle()))
            }
        };
        match self.is_at_end() {
            true => self.stand(),
            false => self.state = State::Playing,
        }
        Ok(Answer::Done)
    }

    /// Stops where the run is.
    fn stand(&mut self) {
        let is_at_end = self.is_at_end();
        self.state = if is_at_end { State::Over } else { State::Paused };
        self.errand = None;
        self.rate = Rate::default();
        self.viewer.refresh();
        let cycle = self.cycle();
        self.memory.note_stand(self.stage.run.as_ref());
        if self.digest.as_ref().is_none_or(|(of, _)| *of != cycle) {
            self.digest = Some((cycle, self.stage.run.digest().to_string()));
        }
        self.verdict = self.stage.verdict(self.stage.run.as_ref()).or(self.verdict.take());
    }

    /// Does the work that is due, for some milliseconds at most. Returns the time until there is more, unless a
    /// request comes; `None` for forever.
    pub(super) fn turn(&mut self) -> Option<Duration> {
        let now = Instant::now();
        self.memory.keyframes.fit();
        match (self.state, self.errand) {
            (State::Playing, _) => {
                let cycle = self.cycle();
                let beat = self.beat.as_mut();
                let target = beat.map_or(self.stage.until, |beat| beat.target(now, cycle));
                self.slice(target.min(self.stage.until));
            }
            (State::Seeking, Some(Errand { target, .. })) => self.slice(target),
            _ => {}
        }
        self.arrive();
        let now = Instant::now();
        self.viewer.attend(self.stage.run.as_mut(), &mut self.memory.log, now);
        let status = self.status(now);
        self.viewer.tell(status.clone(), now);
        self.attend_viewers(now);
        let is_free = self.work_due(now).is_none_or(|due| due > now);
        if is_free && self.scout() {
            return Some(Duration::ZERO);
        }
        let status_due = self.status_due(&status);
        let due = [self.work_due(now), self.viewer.frame_due(), status_due, self.showing.due()];
        let next = due.into_iter().flatten().min()?;
        Some(next.saturating_duration_since(Instant::now()))
    }

    fn work_due(&self, now: Instant) -> Option<Instant> {
        match (self.state, &self.beat) {
            (State::Playing, Some(beat)) => Some(beat.next(self.cycle())),
            (State::Playing | State::Seeking, _) => Some(now),
            _ => None,
        }
    }

    fn status_due(&self, status: &Status) -> Option<Instant> {
        self.viewer.has_to_tell(status).then(|| self.viewer.status_due())
    }

    /// Stops where the seek or the run ends.
    fn arrive(&mut self) {
        let is_there = self.errand.is_some_and(|errand| self.cycle() >= errand.target);
        let is_on_the_way = matches!(self.state, State::Playing | State::Seeking);
        if is_on_the_way && (is_there || self.is_at_end()) {
            let errand = self.errand;
            self.stand();
            if let Some(id) = errand.and_then(|errand| errand.id) {
                self.reply(id, Ok(Answer::Done));
            }
            if let Some(speed) = errand.and_then(|errand| errand.then) {
                // Speeds of viewers are in bounds.
                let _ = self.play(speed);
            }
        }
    }

    /// Goes on for some milliseconds, but not beyond the target cycle.
    fn slice(&mut self, target: Cycle) {
        let asked = self.pace.cycles().min(target.saturating_sub(self.cycle()));
        if asked == 0 || self.stage.run.is_over() {
            return;
        }
        let started = Instant::now();
        let done = self.stage.run.advance(asked);
        let took = started.elapsed();
        self.pace.note(done, took);
        self.rate.note(Instant::now(), done);
        self.viewer.moved();
        self.digest = None;
        self.memory.note(self.stage.run.as_ref(), took);
    }

    /// Computes ahead when there is nothing else to do; returns whether there was anything to compute ahead.
    fn scout(&mut self) -> bool {
        let Some(scout) = &mut self.scout else { return false };
        if let Some(run) = scout.slice(&mut self.memory) {
            self.verdict = self.stage.verdict(run).or(self.verdict.take());
            self.scout = None;
        }
        true
    }

    fn status(&mut self, now: Instant) -> Status {
        let cycle = self.cycle();
        let is_still = matches!(self.state, State::Paused | State::Over);
        let has_digest = is_still && self.stage.is_computed();
        let digest = self.digest.as_ref().filter(|(of, _)| has_digest && *of == cycle);
        let banner = self.stage.recorded.as_ref().map(|_| {
            let later = || "Computed again; the digest is compared at the end.".into();
            self.verdict.clone().unwrap_or_else(later)
        });
        Status {
            session: self.session,
            state: self.state,
            cycle: cycle as f64,
            cycles_planned: self.stage.until as f64,
            time_s: cycle as f64 * self.scenery.cycle_s,
            speed: self.speed,
            cycles_per_s: if is_still { 0.0 } else { self.rate.per_s(now) },
            seed: self.stage.run.plan().seed.to_string(),
            digest: digest.map(|(_, digest)| digest.clone()),
            banner,
            fleet: None,
        }
    }

    /// Reports that the session ends here; the run is no longer touched.
    pub(super) fn fail(&mut self, problem: Problem) {
        let errand = self.errand.and_then(|errand| errand.id);
        self.give_up("the session has ended");
        // The request that met the bug waits for an answer, too.
        if let Some(id) = self.taken.take().filter(|id| Some(*id) != errand) {
            self.reply(id, Err(problem.clone()));
        }
        if let Some(told) = self.viewer.last_told() {
            self.outbox
                .status(self.session, &Notice::Status(Status { state: State::Failed, ..told }));
        }
        self.outbox.notice(&Notice::Ended { session: self.session, problem });
    }
}
