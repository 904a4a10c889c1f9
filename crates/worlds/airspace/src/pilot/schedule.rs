//! The ticks in which the conversations of a cycle start and end.

use crate::agents::packet::Protocol;
use crate::decide::DecisionStrategy;
use crate::world::AirspaceWorld;
use sidestep_kernel::Cycle;
use sidestep_kernel::network::{HEADER_BYTES, Network, RetryPolicy, SIGNATURE_BYTES};

/// Patience of agents that wait for each other as long as it takes.
const NO_TIMEOUT: RetryPolicy =
    RetryPolicy { ticks: u64::MAX, bits_per_tick: f64::INFINITY, tries: 1, first_tries: 1 };

/// Part of its equal share of a cycle that the first conversation has on a radio with a budget, where it is one message of
/// each: the shield's exchange, of three larger ones, gets the rest.
const SINGLE_MESSAGE_FRACTION: f64 = 0.5;

/// Number of ticks that the conversations of a cycle have, over a network that loses messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ConversationWindows {
    decision: u64,
    exchange: u64,
}

impl ConversationWindows {
    /// Returns windows of which the first is a part of an equal share.
    pub(crate) fn new(network: &Network, decision_fraction: f64) -> Self {
        let equal = network.conversation_ticks();
        // Of a conversation of a tick nothing is left to give.
        let decision = ((equal as f64 * decision_fraction) as u64).max(1);
        Self { decision, exchange: 2 * equal - decision }
    }
}

impl AirspaceWorld {
    /// Returns the windows of the conversations of a cycle; none where the network loses nothing.
    pub(crate) fn conversation_windows(&self) -> Option<ConversationWindows> {
        Some(ConversationWindows::new(self.network.as_ref()?, self.decision_fraction()))
    }

    /// Returns the number of bytes that a proposal of the shield should take, so that plans and consent find room after it
    /// on a radio with a budget; none without one.
    pub(crate) fn max_proposal_bytes(&self) -> Option<usize> {
        let network = self.network.as_ref()?;
        let budget = network.budget?;
        let exchange_s = network.ticks_to_s(self.conversation_windows()?.exchange);
        let on_air = (budget.share_bytes_s() * exchange_s * PROPOSAL_FRACTION) as usize;
        Some(on_air.saturating_sub(HEADER_BYTES + SIGNATURE_BYTES))
    }

    /// Returns the part of an equal share of a cycle that the first conversation has.
    pub(crate) fn decision_fraction(&self) -> f64 {
        let has_budget = self.network.as_ref().is_some_and(|network| network.budget.is_some());
        if has_budget && DecisionStrategy::needs_intents_alone(self) {
            SINGLE_MESSAGE_FRACTION
        } else {
            1.0
        }
    }
}

/// Part of an exchange in which a proposal should be sent: less than the half for which others wait for it, so that a plan
/// and a list of consents, which take fewer bytes, are sent in the rest.
const PROPOSAL_FRACTION: f64 = 0.42;

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
    pub(crate) fn from_start_tick(tick: u64, windows: Option<ConversationWindows>) -> Self {
        let Some(ConversationWindows { decision, exchange }) = windows else {
            return Self {
                begins: tick,
                grouped_by: u64::MAX,
                decided_by: u64::MAX,
                shield_from: tick,
                ends: u64::MAX,
            };
        };
        Self {
            begins: tick,
            // To find the group takes part of the time for decisions.
            grouped_by: tick.saturating_add(decision / 2),
            decided_by: tick.saturating_add(decision),
            shield_from: tick.saturating_add(decision + 1),
            ends: tick.saturating_add(decision + exchange + 1),
        }
    }

    /// Returns the ticks of a cycle where all cycles follow on each other without a gap, and no second conversation starts
    /// before all have ended the first.
    pub(crate) fn for_cycle(cycle: Cycle, windows: Option<ConversationWindows>) -> Self {
        let Some(ConversationWindows { decision, exchange }) = windows else {
            // So late that the network gets there only when nothing else is due, which is when all have decided.
            return Self { shield_from: u64::MAX / 2, ..Self::from_start_tick(0, None) };
        };
        Self::from_start_tick(cycle * (decision + exchange + 2), windows)
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
