//! The senders that an agent has heard lately, and counts of the packets that it has dropped.

use sidestep::kernel::EntityId;
use sidestep::kernel::network::{DropCounts, DropReason};
use std::collections::BTreeSet;

/// The senders that an agent has heard in this cycle and in the one before.
#[derive(Debug, Default)]
pub(crate) struct RecentSenders {
    current: BTreeSet<EntityId>,
    previous: BTreeSet<EntityId>,
}

impl RecentSenders {
    /// Starts a cycle, and forgets those of the cycle before the last.
    pub(crate) fn start_cycle(&mut self) {
        self.previous = std::mem::take(&mut self.current);
    }

    /// Records the sender of a received packet.
    pub(crate) fn record(&mut self, from: EntityId) {
        self.current.insert(from);
    }

    /// Returns the senders heard in this cycle, or in the one before if there are none yet: a table that is read at any
    /// moment would else show empty cells at the start of each cycle.
    pub(crate) fn senders(&self) -> Vec<EntityId> {
        let senders = if self.current.is_empty() { &self.previous } else { &self.current };
        senders.iter().copied().collect()
    }
}

/// Returns the names of the reasons for which packets were dropped, with their counts.
pub(crate) fn drop_counts(dropped: &DropCounts) -> Vec<(String, u64)> {
    let counts =
        DropReason::ALL.iter().map(|&reason| (reason.name().to_string(), dropped.get(reason)));
    counts.filter(|(_, count)| *count > 0).collect()
}
