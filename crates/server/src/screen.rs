//! Screens: what is heard of fleets that fly elsewhere, for the sessions that show it.
//!
//! Whoever hears a fleet puts the newest view here and never waits; sessions take it when they can.

use crate::protocol::{Fleet, Node, Problem};
use sidestep_session::fleet::{FleetNow, NodeNow, Seen, Staged};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// A fleet as it is heard.
#[derive(Debug)]
pub struct Screen {
    /// The endpoint by which it is named.
    pub(crate) endpoint: String,
    /// The part that stays as it is.
    pub(crate) staged: Staged,
    shown: Mutex<Shown>,
}

/// The newest view, and whether it is the last.
#[derive(Debug, Clone)]
pub(crate) struct Shown {
    pub(crate) seen: Option<Arc<Seen>>,
    pub(crate) heard: Instant,
    /// The reason why nothing more will be seen.
    pub(crate) lost: Option<Problem>,
}

impl Screen {
    /// Returns a screen that shows nothing yet.
    pub fn new(endpoint: String, staged: Staged) -> Self {
        let shown = Shown { seen: None, heard: Instant::now(), lost: None };
        Self { endpoint, staged, shown: Mutex::new(shown) }
    }

    fn lock(&self) -> MutexGuard<'_, Shown> {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Shows a view in the place of the one before.
    pub fn show(&self, seen: Seen) {
        let mut shown = self.lock();
        (shown.seen, shown.heard) = (Some(Arc::new(seen)), Instant::now());
    }

    /// Tells why nothing more will be seen.
    pub fn lose(&self, cause: &str, remedy: &str) {
        self.lock().lost = Some(Problem::new(self.endpoint.as_str(), cause, remedy));
    }

    /// Returns what is shown now.
    pub(crate) fn now(&self) -> Shown {
        self.lock().clone()
    }
}

/// Returns a fleet as a page is told, which was heard some seconds ago.
pub(crate) fn told(now: &FleetNow, silent_s: f64) -> Fleet {
    Fleet {
        has_begun: now.has_begun,
        silent_s,
        late_cycles: now.late_cycles,
        talk_p50_ms: now.talk_p50_ms,
        talk_p99_ms: now.talk_p99_ms,
        nodes: now.nodes.iter().map(node).collect(),
    }
}

fn node(now: &NodeNow) -> Node {
    Node {
        agent: now.agent,
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
