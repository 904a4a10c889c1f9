//! The packets that an agent has heard, and those that it has dropped.

use sidestep::kernel::EntityId;
use sidestep::kernel::network::{DropCounts, DropReason};
use std::collections::BTreeSet;

/// The senders that an agent has heard in a cycle, and in the one before.
#[derive(Debug, Default)]
pub(crate) struct RecentSenders {
    now: BTreeSet<EntityId>,
    before: BTreeSet<EntityId>,
}

impl RecentSenders {
    /// Begins a cycle.
    pub(crate) fn start_cycle(&mut self) {
        self.before = std::mem::take(&mut self.now);
    }

    /// Notes that a packet has come.
    pub(crate) fn record(&mut self, from: EntityId) {
        self.now.insert(from);
    }

    /// Returns the senders heard in this cycle, or in the one before if it has just begun.
    pub(crate) fn senders(&self) -> Vec<EntityId> {
        let heard = if self.now.is_empty() { &self.before } else { &self.now };
        heard.iter().copied().collect()
    }
}

/// Returns counts of dropped packets by reason.
pub(crate) fn drop_counts(refused: &DropCounts) -> Vec<(String, u64)> {
    let counts = DropReason::ALL.iter().map(|&why| (why.name().to_string(), refused.get(why)));
    counts.filter(|(_, count)| *count > 0).collect()
}
