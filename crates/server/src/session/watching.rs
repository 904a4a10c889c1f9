//! A session that watches a fleet: it shows the views that arrive, and steers nothing.

use super::viewer::Viewer;
use super::{Broken, Desk};
use crate::chronicle::Chronicle;
use crate::encode::scene;
use crate::outbox::Outbox;
use crate::protocol::{
    Answer, Call, Notice, Outcome, Problem, Reply, SessionId, Speed, State, Status,
};
use crate::screen::{Screen, Shown, told};
use sidestep::kernel::Cycle;
use sidestep::kernel::view::Frame;
use sidestep_session::fleet::{Seen, Staged};
use std::sync::Arc;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

/// Time between two looks at the screen.
const LOOK: Duration = Duration::from_millis(33);

/// The shortest silence that counts as one: views come that often.
const SILENCE_S: f64 = 2.0;

/// The largest number of events in an answer; a page that wants more asks again.
const MOST_EVENTS: u32 = 5000;

/// A fleet that is watched.
pub(super) struct Watching {
    session: SessionId,
    outbox: Arc<Outbox>,
    screen: Arc<Screen>,
    /// The unchanging part of the fleet that is watched; another one may fly there later.
    staged: Arc<Staged>,
    viewer: Viewer,
    log: Chronicle,
    /// The newest frame, its number, and the events that are known.
    frame: Frame,
    number: u64,
    known_until: Cycle,
}

impl Watching {
    pub(super) fn new(session: SessionId, outbox: Arc<Outbox>, screen: Arc<Screen>) -> Self {
        let staged = screen.now().staged;
        let viewer = Viewer::new(session, outbox.clone(), &staged.scenery);
        let (log, frame) = (Chronicle::default(), Frame::default());
        Self { session, outbox, screen, staged, viewer, log, frame, number: 0, known_until: 0 }
    }

    /// Answers requests and shows arriving views, until the page leaves or no more views will come.
    pub(super) fn work(&mut self, desk: &Desk, id: u32) {
        self.look();
        match desk.guarded(|| self.attend(desk, id)) {
            Ok(()) | Err(Broken::Unwanted) => {}
            Err(Broken::Bug(words)) => self.fail(super::bug(&words)),
        }
    }

    fn attend(&mut self, desk: &Desk, id: u32) {
        self.reply(id, Ok(self.opened()));
        loop {
            match desk.orders.recv_timeout(LOOK) {
                Ok((id, call)) => {
                    let answer = self.answer(call);
                    self.reply(id, answer);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            let shown = self.look();
            if !Arc::ptr_eq(&shown.staged, &self.staged) {
                return self.fail(self.succeeded());
            }
            let now = Instant::now();
            if self.number > 0 {
                self.viewer.pass_on(&self.frame, &mut self.log, now);
            }
            self.viewer.tell(self.status(&shown), now);
            if let Some(problem) = shown.lost {
                return self.fail(problem);
            }
        }
    }

    /// Takes the view on the screen, if it is new.
    fn look(&mut self) -> Shown {
        let shown = self.screen.now();
        let is_same = Arc::ptr_eq(&shown.staged, &self.staged);
        let is_new = |seen: &&Arc<Seen>| is_same && seen.number != self.number;
        let Some(seen) = shown.seen.as_ref().filter(is_new) else {
            return shown;
        };
        self.number = seen.number;
        // A change of the nodes alone is no news for the picture.
        if self.frame.cycle != seen.frame.cycle || self.frame.bodies.is_empty() {
            self.viewer.moved();
        }
        self.frame = seen.frame.clone();
        // Its log goes back beyond the frame before.
        self.frame.log.retain(|entry| entry.cycle >= self.known_until);
        self.known_until = self.frame.cycle;
        self.log.note(&mut self.frame);
        shown
    }

    fn reply(&self, id: u32, result: Result<Answer, Problem>) {
        let result = result.map_or_else(Outcome::Problem, Outcome::Answer);
        self.outbox.reply(&Reply { id, result });
    }

    fn opened(&self) -> Answer {
        let staged = &self.staged;
        let mut scene = scene(&staged.world, &staged.agent, &staged.scenery, false);
        // Tabs are distinguished by names, which scenarios need not have.
        if scene.name.is_empty() {
            scene.name.clone_from(&self.screen.endpoint);
        }
        Answer::Opened { session: self.session, scene, status: self.status(&self.screen.now()) }
    }

    fn answer(&mut self, call: Call) -> Result<Answer, Problem> {
        match call {
            Call::Credit { frames, .. } => self.viewer.grant(frames),
            // A fleet has no scans.
            Call::Look { .. } => {}
            Call::Events { from, until, skip, most, .. } => {
                let skip = skip.unwrap_or(0);
                return Ok(self.log.answer(from..until, skip, most.min(MOST_EVENTS)));
            }
            Call::Tables { .. } => return Ok(Answer::Tables { names: Vec::new() }),
            _ => {
                let remedy = "steer it where it was started; what it records can be replayed";
                let place = self.screen.endpoint.as_str();
                return Err(Problem::new(place, "a fleet is only watched here", remedy));
            }
        }
        Ok(Answer::Done)
    }

    fn status(&self, shown: &Shown) -> Status {
        let seen = shown.seen.as_deref();
        let silent_s = shown.heard.elapsed().as_secs_f64();
        let silent_s = if silent_s < SILENCE_S { 0.0 } else { silent_s.floor() };
        let is_over = seen.is_some_and(|seen| seen.is_over);
        let staged = &self.staged;
        Status {
            session: self.session,
            state: if is_over { State::Over } else { State::Watched },
            cycle: self.frame.cycle as f64,
            cycles_planned: seen.map_or(0.0, |seen| seen.fleet.cycles as f64),
            time_s: self.frame.time_s,
            speed: Speed::Times(1.0),
            cycles_per_s: 0.0,
            seed: staged.seed.to_string(),
            digest: None,
            banner: None,
            fleet: seen
                .map(|seen| Box::new(told(&seen.fleet, if is_over { 0.0 } else { silent_s }))),
        }
    }

    fn succeeded(&self) -> Problem {
        let place = self.screen.endpoint.as_str();
        Problem::new(place, "the fleet has ended, and another one flies here", "open it again")
    }

    /// Reports that no more views will come.
    fn fail(&mut self, problem: Problem) {
        if let Some(told) = self.viewer.last_told() {
            let status = Status { state: State::Failed, ..told };
            self.outbox.status(self.session, &Notice::Status(status));
        }
        self.outbox.notice(&Notice::Ended { session: self.session, problem });
    }
}
