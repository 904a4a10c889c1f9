//! A session that watches a fleet: it shows the views that arrive, and controls nothing.

use super::page_publisher::SessionUpdatePublisher;
use super::{SessionExit, SessionWorker};
use crate::encode::scene;
use crate::event_search::EventQuery;
use crate::event_store::EventStore;
use crate::fleet_feed::{FeedSnapshot, FleetFeed, to_protocol};
use crate::outbox::Outbox;
use crate::protocol::{
    Problem, Reply, ReplyBody, ReplyResult, RunMethod, ServerNotification, SessionId, SessionState,
    SessionStatus, Speed,
};
use crate::trail_history::TrailHistory;
use crate::usage_registry::{SessionBytes, UsageEntry};
use sidestep_kernel::Cycle;
use sidestep_kernel::view::Frame;
use sidestep_session::fleet::FleetScene;
use std::sync::Arc;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

/// Time between two polls of the feed: that of a frame.
const POLL_INTERVAL: Duration = Duration::from_millis(33);

/// Minimum time in seconds without a view that counts as silence: views normally arrive several times as often.
const MIN_SILENCE_S: f64 = 2.0;

/// Maximum number of events in a reply; a page that wants more repeats its request.
const MAX_EVENTS: u32 = 5000;

/// A fleet that is watched.
pub(super) struct FleetSession {
    session: SessionId,
    outbox: Arc<Outbox>,
    feed: Arc<FleetFeed>,
    /// The unchanging part of the fleet that is watched; another fleet may start at the endpoint later.
    fleet_scene: Arc<FleetScene>,
    publisher: SessionUpdatePublisher,
    log: EventStore,
    trails: TrailHistory,
    /// The newest frame.
    frame: Frame,
    /// The number of the newest view; 0 before the first.
    number: u64,
    /// The cycle before which all events are known.
    known_until: Cycle,
    usage: UsageEntry,
}

impl FleetSession {
    pub(super) fn new(
        session: SessionId,
        outbox: Arc<Outbox>,
        feed: Arc<FleetFeed>,
        usage: UsageEntry,
    ) -> Self {
        let fleet_scene = feed.snapshot().scene;
        let publisher = SessionUpdatePublisher::new(session, outbox.clone(), &fleet_scene.scenery);
        Self {
            session,
            outbox,
            feed,
            fleet_scene,
            publisher,
            log: EventStore::default(),
            trails: TrailHistory::default(),
            frame: Frame::default(),
            number: 0,
            known_until: 0,
            usage,
        }
    }

    /// Answers requests and shows the views that arrive, until the page leaves or no more views will arrive.
    pub(super) fn run(&mut self, worker: &SessionWorker, id: u32) {
        self.update_from_feed();
        match worker.catch_panic(|| self.run_until_closed(worker, id)) {
            Ok(()) | Err(SessionExit::Interrupted) => {}
            Err(SessionExit::Bug(message)) => self.report_failure(super::internal_error(&message)),
        }
    }

    fn run_until_closed(&mut self, worker: &SessionWorker, id: u32) {
        self.send_reply(id, Ok(self.opened_reply()));
        loop {
            match worker.requests.recv_timeout(POLL_INTERVAL) {
                Ok((id, call)) => {
                    let answer = self.answer(call);
                    self.send_reply(id, answer);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            let snapshot = self.update_from_feed();
            if !Arc::ptr_eq(&snapshot.scene, &self.fleet_scene) {
                return self.report_failure(self.fleet_was_replaced());
            }
            let now = Instant::now();
            if self.number > 0 {
                self.publisher.forward_frame(&self.frame, &mut self.log, now);
            }
            self.publisher.report_status(self.status(&snapshot), now);
            if let Some(problem) = snapshot.lost {
                return self.report_failure(problem);
            }
        }
    }

    /// Takes the view of the feed, if it is new.
    fn update_from_feed(&mut self) -> FeedSnapshot {
        let snapshot = self.feed.snapshot();
        let is_same_fleet = Arc::ptr_eq(&snapshot.scene, &self.fleet_scene);
        let Some(view) = &snapshot.view else { return snapshot };
        if !is_same_fleet || view.number == self.number {
            return snapshot;
        }
        self.number = view.number;
        // Where only the state of nodes has changed, the page needs no frame.
        if self.frame.cycle != view.frame.cycle || self.frame.bodies.is_empty() {
            self.publisher.mark_cycle_changed();
        }
        self.frame = view.frame.clone();
        // The log of a view has the last events of the run, many of which came with an earlier view.
        self.frame.log.retain(|entry| entry.cycle >= self.known_until);
        self.known_until = self.frame.cycle;
        self.log.record(&mut self.frame);
        if self.trails.is_due(self.frame.cycle) {
            self.trails.push(&self.frame, Duration::ZERO);
        }
        self.usage.set(SessionBytes { events: self.log.bytes(), ..SessionBytes::default() });
        snapshot
    }

    fn send_reply(&self, id: u32, result: Result<ReplyBody, Problem>) {
        let result = result.map_or_else(ReplyResult::Problem, ReplyResult::Answer);
        self.outbox.send_reply(&Reply { id, result });
    }

    fn opened_reply(&self) -> ReplyBody {
        let FleetScene { world, agent, scenery, .. } = &*self.fleet_scene;
        let mut scene = scene(world, agent, scenery, false);
        // The page distinguishes its tabs by names, which scenarios need not have.
        if scene.name.is_empty() {
            scene.name.clone_from(&self.feed.endpoint);
        }
        ReplyBody::Opened {
            session: self.session,
            scene,
            status: self.status(&self.feed.snapshot()),
        }
    }

    fn answer(&mut self, call: RunMethod) -> Result<ReplyBody, Problem> {
        match call {
            RunMethod::Credit { frames } => {
                self.publisher.add_credit(frames);
                Ok(ReplyBody::Done)
            }
            // A fleet has no scans, but the page selects bodies of every session.
            RunMethod::SelectScans { bodies: _ } => Ok(ReplyBody::Done),
            RunMethod::Events { from, until, skip, limit } => {
                Ok(self.log.events_reply(from..until, skip.unwrap_or(0), limit.min(MAX_EVENTS)))
            }
            RunMethod::FindEvents { text, kinds, skip, limit } => {
                let query = EventQuery { text: &text, kinds: kinds.as_deref(), skip, limit };
                Ok(query.reply(&self.log, &self.fleet_scene.scenery))
            }
            // A fleet's metrics are those of its nodes: there is none to color its agents by.
            RunMethod::AgentMetrics { metric: None } => {
                let cycle = self.frame.cycle as f64;
                Ok(ReplyBody::AgentMetrics { names: Vec::new(), cycle, values: Vec::new() })
            }
            RunMethod::Trails { until, bodies } => Ok(self.trails.trails_reply(until, &bodies)),
            RunMethod::Tables {} => Ok(ReplyBody::Tables { names: Vec::new() }),
            RunMethod::Play { .. }
            | RunMethod::Pause {}
            | RunMethod::Step { .. }
            | RunMethod::Seek { .. }
            | RunMethod::Restart { .. }
            | RunMethod::Inspect { .. }
            | RunMethod::Metrics { .. }
            | RunMethod::AgentMetrics { metric: Some(_) }
            | RunMethod::Source {}
            | RunMethod::Save { .. } => {
                let remedy = "control it where it was started; its recording can be replayed";
                let place = self.feed.endpoint.as_str();
                Err(Problem::new(place, "a fleet is only watched here", remedy))
            }
        }
    }

    fn status(&self, snapshot: &FeedSnapshot) -> SessionStatus {
        let view = snapshot.view.as_deref();
        let silent_s = snapshot.last_heard.elapsed().as_secs_f64();
        let silent_s = if silent_s < MIN_SILENCE_S { 0.0 } else { silent_s.floor() };
        let is_over = view.is_some_and(|view| view.is_over);
        SessionStatus {
            session: self.session,
            state: if is_over { SessionState::Over } else { SessionState::Watched },
            cycle: self.frame.cycle as f64,
            cycles_planned: view.map_or(0.0, |view| view.fleet.cycles as f64),
            time_s: self.frame.time_s,
            speed: Speed::Times(1.0),
            cycles_per_s: 0.0,
            seed: self.fleet_scene.seed.to_string(),
            digest: None,
            banner: None,
            fleet: view.map(|view| {
                Box::new(to_protocol(&view.fleet, if is_over { 0.0 } else { silent_s }))
            }),
        }
    }

    fn fleet_was_replaced(&self) -> Problem {
        let place = self.feed.endpoint.as_str();
        Problem::new(place, "the fleet has ended, and another one flies here", "open it again")
    }

    /// Reports that no more views will arrive.
    fn report_failure(&mut self, problem: Problem) {
        if let Some(last) = self.publisher.last_reported() {
            let status = SessionStatus { state: SessionState::Failed, ..last };
            self.outbox.send_status(self.session, &ServerNotification::Status(status));
        }
        self.outbox
            .send_notification(&ServerNotification::Ended { session: self.session, problem });
    }
}
