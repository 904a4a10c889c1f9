//! The packets that an agent has heard, and those that it has dropped.

use sidestep::kernel::EntityId;
use sidestep::kernel::network::{Refusal, Refused};
use std::collections::BTreeSet;

/// The senders that an agent has heard in a cycle, and in the one before.
#[derive(Debug, Default)]
pub(crate) struct Heard {
    now: BTreeSet<EntityId>,
    before: BTreeSet<EntityId>,
}

impl Heard {
    /// Begins a cycle.
    pub(crate) fn begin(&mut self) {
        self.before = std::mem::take(&mut self.now);
    }

    /// Notes that a packet has come.
    pub(crate) fn note(&mut self, from: EntityId) {
        self.now.insert(from);
    }

    /// Returns the senders heard in this cycle, or in the one before if it has just begun.
    pub(crate) fn all(&self) -> Vec<EntityId> {
        let heard = if self.now.is_empty() { &self.before } else { &self.now };
        heard.iter().copied().collect()
    }
}

/// Returns counts of dropped packets by reason.
pub(crate) fn dropped(refused: &Refused) -> Vec<(String, u64)> {
    let counts = Refusal::ALL.iter().map(|&why| (why.name().to_string(), refused.of(why)));
    counts.filter(|(_, count)| *count > 0).collect()
}
