//! The ticks in which the conversations of a cycle start and end.

use crate::agents::packet::Protocol;
use sidestep_kernel::Cycle;
use sidestep_kernel::network::{Network, RetryPolicy};

/// Patience of agents that wait for each other as long as it takes.
const NO_TIMEOUT: RetryPolicy =
    RetryPolicy { ticks: u64::MAX, bits_per_tick: f64::INFINITY, tries: 1, first_tries: 1 };

/// The ticks of a cycle's conversations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ConversationSchedule {
    /// Start of the first one.
    pub(crate) begins: u64,
    /// Latest end of the conversation that finds the group, where there is one.
    pub(crate) grouped_by: u64,
    /// Latest end of the conversation about the actions that each proposes.
    pub(crate) decided_by: u64,
    /// Start of the shield's exchange, unless the first conversation takes longer.
    pub(crate) shield_from: u64,
    /// Its latest end.
    pub(crate) ends: u64,
}

impl ConversationSchedule {
    /// Returns the ticks of conversations that start in a tick: over a network that loses messages each has its time;
    /// over one that loses nothing the second follows on the first, and each takes as long as it takes.
    pub(crate) fn from_start_tick(tick: u64, network: Option<&Network>) -> Self {
        let Some(network) = network else {
            return Self {
                begins: tick,
                grouped_by: u64::MAX,
                decided_by: u64::MAX,
                shield_from: tick,
                ends: u64::MAX,
            };
        };
        let long = network.conversation_ticks();
        Self {
            begins: tick,
            // To find the group takes part of the time for decisions.
            grouped_by: tick.saturating_add(long / 2),
            decided_by: tick.saturating_add(long),
            shield_from: tick.saturating_add(long + 1),
            ends: tick.saturating_add(2 * long + 1),
        }
    }

    /// Returns the ticks of a cycle where all cycles follow on each other without a gap, and no second conversation starts
    /// before all have ended the first.
    pub(crate) fn for_cycle(cycle: Cycle, network: Option<&Network>) -> Self {
        let Some(network) = network else {
            // So late that the network gets there only when nothing else is due, which is when all have decided.
            return Self { shield_from: u64::MAX / 2, ..Self::from_start_tick(0, None) };
        };
        Self::from_start_tick(2 * cycle * (network.conversation_ticks() + 1), Some(network))
    }

    /// Returns the first and the last tick of a conversation that starts in `tick`.
    pub(crate) fn conversation_tick_range(&self, topic: Protocol, tick: u64) -> (u64, u64) {
        match topic {
            Protocol::Group => (tick, self.grouped_by),
            Protocol::Decision => (tick, self.decided_by),
            Protocol::Shield => (tick.max(self.shield_from), self.ends),
        }
    }
}

/// Returns how agents that do not answer are asked again.
pub(crate) fn retry_policy(network: Option<&Network>, topic: Protocol) -> RetryPolicy {
    network.map_or(NO_TIMEOUT, |network| match topic {
        Protocol::Group | Protocol::Decision => network.long_conversation_retry_policy(),
        Protocol::Shield => network.retry_policy(),
    })
}
