//! What the open sessions of a server keep, as they tell it.

use crate::protocol::{SessionId, StoreUsage};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Bytes of something that grows, and its bound.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct StoreBytes {
    pub(crate) used: u64,
    pub(crate) max: u64,
}

/// What a session keeps of its run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct SessionBytes {
    pub(crate) keyframes: StoreBytes,
    pub(crate) events: StoreBytes,
    pub(crate) metrics: StoreBytes,
    pub(crate) trails: StoreBytes,
}

/// What the open sessions of a server keep, as they have told it.
#[derive(Debug, Clone, Default)]
pub(crate) struct UsageRegistry(Arc<Mutex<BTreeMap<SessionId, SessionBytes>>>);

/// The place of an open session in the registry; it is given up when this is dropped.
#[derive(Debug)]
pub(crate) struct UsageEntry {
    registry: UsageRegistry,
    session: SessionId,
}

impl UsageRegistry {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<SessionId, SessionBytes>> {
        // Every change is a single call, so it is right even if a thread has panicked while it held the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a session.
    pub(crate) fn add(&self, session: SessionId) -> UsageEntry {
        self.lock().insert(session, SessionBytes::default());
        UsageEntry { registry: self.clone(), session }
    }

    /// Returns what each session keeps.
    pub(crate) fn stores(&self) -> Vec<StoreUsage> {
        let sessions = self.lock();
        let stores = sessions.iter().flat_map(|(&session, bytes)| {
            let SessionBytes { keyframes, events, metrics, trails } = *bytes;
            [
                store(Some(session), "checkpoints to seek to", keyframes),
                store(Some(session), "events", events),
                store(Some(session), "metrics over time", metrics),
                store(Some(session), "places of agents, for trails", trails),
            ]
        });
        stores.collect()
    }
}

impl UsageEntry {
    /// Records what the session keeps now.
    pub(crate) fn set(&self, bytes: SessionBytes) {
        self.registry.lock().insert(self.session, bytes);
    }
}

impl Drop for UsageEntry {
    fn drop(&mut self) {
        self.registry.lock().remove(&self.session);
    }
}

/// Returns a store as the page is told of it.
pub(crate) fn store(
    session: Option<SessionId>,
    name: &str,
    StoreBytes { used, max }: StoreBytes,
) -> StoreUsage {
    StoreUsage { session, name: name.into(), bytes: used, max_bytes: max }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_is_listed_while_it_is_open() {
        let registry = UsageRegistry::default();
        let first = registry.add(3);
        let second = registry.add(4);
        let metrics = StoreBytes { used: 5, max: 9 };
        second.set(SessionBytes { metrics, ..SessionBytes::default() });
        let told: Vec<(Option<SessionId>, u64, u64)> =
            registry.stores().iter().map(|s| (s.session, s.bytes, s.max_bytes)).collect();
        assert_eq!(told.len(), 8);
        assert_eq!(told[6], (Some(4), 5, 9));
        drop((first, second));
        assert_eq!(registry.stores(), []);
    }
}
