//! A session that watches a fleet: it shows the views that arrive, and steers nothing.

use super::page_view::PageView;
use super::{SessionExit, SessionWorker};
use crate::encode::scene;
use crate::event_store::EventStore;
use crate::fleet_feed::{FeedSnapshot, FleetFeed, to_protocol};
use crate::outbox::Outbox;
use crate::protocol::{
    Method, Problem, Reply, ReplyBody, ReplyResult, ServerNotification, SessionId, SessionState,
    SessionStatus, Speed,
};
use sidestep::kernel::Cycle;
use sidestep::kernel::view::Frame;
use sidestep_session::fleet::{FleetFrame, FleetScene};
use std::sync::Arc;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

/// Time between two looks at the screen.
const POLL_INTERVAL: Duration = Duration::from_millis(33);

/// The shortest silence that counts as one: views come that often.
const MIN_SILENCE_S: f64 = 2.0;

/// The largest number of events in an answer; a page that wants more asks again.
const MAX_EVENTS: u32 = 5000;

/// A fleet that is watched.
pub(super) struct FleetSession {
    session: SessionId,
    outbox: Arc<Outbox>,
    screen: Arc<FleetFeed>,
    /// The unchanging part of the fleet that is watched; another one may fly there later.
    staged: Arc<FleetScene>,
    viewer: PageView,
    log: EventStore,
    /// The newest frame, its number, and the events that are known.
    frame: Frame,
    number: u64,
    known_until: Cycle,
}

impl FleetSession {
    pub(super) fn new(session: SessionId, outbox: Arc<Outbox>, screen: Arc<FleetFeed>) -> Self {
        let staged = screen.snapshot().staged;
        let viewer = PageView::new(session, outbox.clone(), &staged.scenery);
        let (log, frame) = (EventStore::default(), Frame::default());
        Self { session, outbox, screen, staged, viewer, log, frame, number: 0, known_until: 0 }
    }

    /// Answers requests and shows arriving views, until the page leaves or no more views will come.
    pub(super) fn run(&mut self, desk: &SessionWorker, id: u32) {
        self.take_view();
        match desk.catch_panic(|| self.run_until_closed(desk, id)) {
            Ok(()) | Err(SessionExit::Interrupted) => {}
            Err(SessionExit::Bug(words)) => self.fail(super::internal_error(&words)),
        }
    }

    fn run_until_closed(&mut self, desk: &SessionWorker, id: u32) {
        self.reply(id, Ok(self.opened_reply()));
        loop {
            match desk.orders.recv_timeout(POLL_INTERVAL) {
                Ok((id, call)) => {
                    let answer = self.answer(call);
                    self.reply(id, answer);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            let shown = self.take_view();
            if !Arc::ptr_eq(&shown.staged, &self.staged) {
                return self.fail(self.fleet_was_replaced());
            }
            let now = Instant::now();
            if self.number > 0 {
                self.viewer.forward_frame(&self.frame, &mut self.log, now);
            }
            self.viewer.report_status(self.status(&shown), now);
            if let Some(problem) = shown.lost {
                return self.fail(problem);
            }
        }
    }

    /// Takes the view on the screen, if it is new.
    fn take_view(&mut self) -> FeedSnapshot {
        let shown = self.screen.snapshot();
        let is_same = Arc::ptr_eq(&shown.staged, &self.staged);
        let is_new = |seen: &&Arc<FleetFrame>| is_same && seen.number != self.number;
        let Some(seen) = shown.seen.as_ref().filter(is_new) else {
            return shown;
        };
        self.number = seen.number;
        // A change of the nodes alone is no news for the picture.
        if self.frame.cycle != seen.frame.cycle || self.frame.bodies.is_empty() {
            self.viewer.mark_moved();
        }
        self.frame = seen.frame.clone();
        // Its log goes back beyond the frame before.
        self.frame.log.retain(|entry| entry.cycle >= self.known_until);
        self.known_until = self.frame.cycle;
        self.log.record(&mut self.frame);
        shown
    }

    fn reply(&self, id: u32, result: Result<ReplyBody, Problem>) {
        let result = result.map_or_else(ReplyResult::Problem, ReplyResult::Answer);
        self.outbox.send_reply(&Reply { id, result });
    }

    fn opened_reply(&self) -> ReplyBody {
        let staged = &self.staged;
        let mut scene = scene(&staged.world, &staged.agent, &staged.scenery, false);
        // Tabs are distinguished by names, which scenarios need not have.
        if scene.name.is_empty() {
            scene.name.clone_from(&self.screen.endpoint);
        }
        ReplyBody::Opened {
            session: self.session,
            scene,
            status: self.status(&self.screen.snapshot()),
        }
    }

    fn answer(&mut self, call: Method) -> Result<ReplyBody, Problem> {
        match call {
            Method::Credit { frames, .. } => self.viewer.add_credit(frames),
            // A fleet has no scans.
            Method::SelectScans { .. } => {}
            Method::Events { from, until, skip, limit, .. } => {
                let skip = skip.unwrap_or(0);
                return Ok(self.log.answer(from..until, skip, limit.min(MAX_EVENTS)));
            }
            Method::Tables { .. } => return Ok(ReplyBody::Tables { names: Vec::new() }),
            _ => {
                let remedy = "steer it where it was started; what it records can be replayed";
                let place = self.screen.endpoint.as_str();
                return Err(Problem::new(place, "a fleet is only watched here", remedy));
            }
        }
        Ok(ReplyBody::Done)
    }

    fn status(&self, shown: &FeedSnapshot) -> SessionStatus {
        let seen = shown.seen.as_deref();
        let silent_s = shown.heard.elapsed().as_secs_f64();
        let silent_s = if silent_s < MIN_SILENCE_S { 0.0 } else { silent_s.floor() };
        let is_over = seen.is_some_and(|seen| seen.is_over);
        let staged = &self.staged;
        SessionStatus {
            session: self.session,
            state: if is_over { SessionState::Over } else { SessionState::Watched },
            cycle: self.frame.cycle as f64,
            cycles_planned: seen.map_or(0.0, |seen| seen.fleet.cycles as f64),
            time_s: self.frame.time_s,
            speed: Speed::Times(1.0),
            cycles_per_s: 0.0,
            seed: staged.seed.to_string(),
            digest: None,
            banner: None,
            fleet: seen.map(|seen| {
                Box::new(to_protocol(&seen.fleet, if is_over { 0.0 } else { silent_s }))
            }),
        }
    }

    fn fleet_was_replaced(&self) -> Problem {
        let place = self.screen.endpoint.as_str();
        Problem::new(place, "the fleet has ended, and another one flies here", "open it again")
    }

    /// Reports that no more views will come.
    fn fail(&mut self, problem: Problem) {
        if let Some(told) = self.viewer.last_reported() {
            let status = SessionStatus { state: SessionState::Failed, ..told };
            self.outbox.send_status(self.session, &ServerNotification::Status(status));
        }
        self.outbox
            .send_notification(&ServerNotification::Ended { session: self.session, problem });
    }
}
