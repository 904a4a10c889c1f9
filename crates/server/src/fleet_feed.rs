//! Screens: views of fleets that fly elsewhere, for the sessions that show them.
//!
//! The thread that hears a fleet puts the newest view here and never waits; sessions take it when they can.

use crate::protocol::{BodyId, Fleet, FleetNode, Problem};
use sidestep_session::fleet::{FleetFrame, FleetScene, FleetStatus, NodeStatus};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// A fleet as heard from its server.
#[derive(Debug)]
pub struct FleetFeed {
    /// The endpoint by which it is named.
    pub(crate) endpoint: String,
    shown: Mutex<FeedSnapshot>,
}

/// The newest view, and whether it is the last.
#[derive(Debug, Clone)]
pub(crate) struct FeedSnapshot {
    /// The part that stays the same while one fleet flies.
    pub(crate) staged: Arc<FleetScene>,
    pub(crate) seen: Option<Arc<FleetFrame>>,
    pub(crate) heard: Instant,
    /// The reason why no more views come.
    pub(crate) lost: Option<Problem>,
}

impl FleetFeed {
    /// Returns a screen that shows nothing yet.
    pub fn new(endpoint: String, staged: FleetScene) -> Self {
        Self { endpoint, shown: Mutex::new(FeedSnapshot::from_scene(staged)) }
    }

    /// Begins to show another fleet at the endpoint, or the same one once more, without a view yet.
    pub fn restart(&self, staged: FleetScene) {
        *self.lock() = FeedSnapshot::from_scene(staged);
    }

    fn lock(&self) -> MutexGuard<'_, FeedSnapshot> {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Shows a view in place of the one before.
    pub fn publish(&self, seen: FleetFrame) {
        let mut shown = self.lock();
        (shown.seen, shown.heard) = (Some(Arc::new(seen)), Instant::now());
    }

    /// Notes why no more views come of a fleet that has not come to its end.
    pub fn mark_lost(&self, cause: &str, remedy: &str) {
        let mut shown = self.lock();
        if shown.seen.as_ref().is_none_or(|seen| !seen.is_over) {
            shown.lost = Some(Problem::new(self.endpoint.as_str(), cause, remedy));
        }
    }

    /// Returns the present view.
    pub(crate) fn snapshot(&self) -> FeedSnapshot {
        self.lock().clone()
    }
}

impl FeedSnapshot {
    fn from_scene(staged: FleetScene) -> Self {
        Self { staged: Arc::new(staged), seen: None, heard: Instant::now(), lost: None }
    }
}

/// Returns a fleet, last heard some seconds ago, in the words of the protocol.
pub(crate) fn to_protocol(now: &FleetStatus, silent_s: f64) -> Fleet {
    Fleet {
        has_begun: now.has_begun,
        silent_s,
        late_cycles: now.late_cycles,
        talk_p50_ms: now.talk_p50_ms,
        talk_p99_ms: now.talk_p99_ms,
        nodes: now.nodes.iter().map(|one| to_protocol_node(&now.noun, one)).collect(),
    }
}

fn to_protocol_node(noun: &str, now: &NodeStatus) -> FleetNode {
    FleetNode {
        agent: now.agent,
        body: BodyId { kind: noun.into(), number: now.number, part: now.part },
        state: now.state.clone(),
        epoch: now.epoch,
        heard: now.heard_of.clone(),
        round: now.round,
        flown: now.flown,
        late: now.late,
        lives: now.lives,
        packets_per_s: now.packets_per_s,
        bytes_per_s: now.bytes_per_s,
        silent_s: now.silent_s,
    }
}
