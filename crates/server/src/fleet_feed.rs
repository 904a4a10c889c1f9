//! Feeds: views of fleets in other processes, for the sessions that show them.
//!
//! The thread that receives the views of a fleet puts the newest one here and never waits; sessions take it when they can.

use crate::protocol::{BodyId, Fleet, FleetNode, Problem};
use sidestep_session::fleet::{FleetFrame, FleetScene, FleetStatus, NodeStatus};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// The views of a fleet, as received from its server.
#[derive(Debug)]
pub struct FleetFeed {
    /// The endpoint of the fleet's server.
    pub(crate) endpoint: String,
    snapshot: Mutex<FeedSnapshot>,
}

/// The newest view, and whether it is the last.
#[derive(Debug, Clone)]
pub(crate) struct FeedSnapshot {
    /// The part that stays the same while one fleet runs.
    pub(crate) scene: Arc<FleetScene>,
    pub(crate) view: Option<Arc<FleetFrame>>,
    /// The time of the last view.
    pub(crate) last_heard: Instant,
    /// The reason why no more views arrive.
    pub(crate) lost: Option<Problem>,
}

impl FleetFeed {
    /// Returns a feed without a view.
    pub fn new(endpoint: String, scene: FleetScene) -> Self {
        Self { endpoint, snapshot: Mutex::new(FeedSnapshot::from_scene(scene)) }
    }

    /// Switches to another fleet at the endpoint, or to a new start of the same one, without a view yet.
    pub fn restart(&self, scene: FleetScene) {
        *self.lock() = FeedSnapshot::from_scene(scene);
    }

    fn lock(&self) -> MutexGuard<'_, FeedSnapshot> {
        self.snapshot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Replaces the view.
    pub fn replace_view(&self, view: FleetFrame) {
        let mut snapshot = self.lock();
        snapshot.view = Some(Arc::new(view));
        snapshot.last_heard = Instant::now();
    }

    /// Records why no more views of a running fleet arrive.
    pub fn mark_disconnected(&self, cause: &str, remedy: &str) {
        let mut snapshot = self.lock();
        if snapshot.view.as_ref().is_none_or(|view| !view.is_over) {
            snapshot.lost = Some(Problem::new(self.endpoint.as_str(), cause, remedy));
        }
    }

    /// Returns the newest view, and takes nothing away: several sessions may show one fleet.
    pub(crate) fn snapshot(&self) -> FeedSnapshot {
        self.lock().clone()
    }
}

impl FeedSnapshot {
    fn from_scene(scene: FleetScene) -> Self {
        Self { scene: Arc::new(scene), view: None, last_heard: Instant::now(), lost: None }
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
