//! Agents: the programs aboard the connectors of a chain, each with its own data.
//!
//! An agent knows its own connector, what its two neighbors tell it, and what its own sensors see
//! ([`Sight`]). It is a state machine without a clock, a socket or a thread: packets and ticks in,
//! packets out, and at the end of a cycle what its connector does ([`Control`]).
//!
//! ```text
//! sight.rs, control.rs     in and out of a cycle
//! connector.rs             the agent: one connector, its links, and the part it plays
//!   follow.rs, lead.rs     as a slave of a master; as the initiator of one motion
//!   climb.rs               as a leader, by the ladder of `motion::replan`
//!   clock.rs               time, packets on their way out, and the end of a cycle
//! link.rs                  makes messages between two neighbors arrive, once and in order
//! message.rs               the messages, and the checks of what comes over the network
//! network.rs               a network's faults, and the traffic on it
//! ```
//!
//! A motion is a wave. Its initiator asks one neighbor, which asks the next, until one need not
//! move or the chain ends; consent or a veto comes back the same way. Then it asks the other one.
//! So it prepares sub-step after sub-step, and nobody moves. Once all have consented it says
//! "go", after a veto "stay". Who has consented and hears neither goes if its master goes: it feels
//! the rod. So a vetoed motion leaves every connector where it was, whatever is lost.

mod climb;
mod clock;
mod connector;
mod control;
mod follow;
mod lead;
mod link;
mod message;
pub(crate) mod network;
mod sight;

pub use connector::{ConnectorAgent, Outgoing};
pub use control::{Control, Ended, Goes, Led};
pub use network::Traffic;
pub use sight::{Role, Seen, Sight, Wish};

use serde::{Deserialize, Serialize};

/// One of the two directions along a chain, and the neighbor there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Side {
    /// Toward connector 0.
    Below,
    /// Toward the last connector.
    Above,
}

impl Side {
    /// Both sides.
    pub(crate) const ALL: [Self; 2] = [Self::Below, Self::Above];

    /// Returns the opposite direction.
    pub(crate) fn other(self) -> Self {
        match self {
            Self::Below => Self::Above,
            Self::Above => Self::Below,
        }
    }

    /// Returns the neighbor there of connector `k` of `n`, if there is one.
    pub(crate) fn of(self, k: u32, n: u32) -> Option<u32> {
        match self {
            Self::Below => k.checked_sub(1),
            Self::Above => (k + 1 < n).then_some(k + 1),
        }
    }

    /// Whether connector `other` is on this side of connector `k`.
    pub(crate) fn has(self, other: u32, k: u32) -> bool {
        match self {
            Self::Below => other < k,
            Self::Above => other > k,
        }
    }
}

/// What belongs to the neighbor below, and what to the one above.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Both<T> {
    below: T,
    above: T,
}

impl<T> Both<T> {
    /// Returns something for each side.
    pub(crate) fn of(mut make: impl FnMut(Side) -> T) -> Self {
        Self { below: make(Side::Below), above: make(Side::Above) }
    }

    /// Visits both.
    pub(crate) fn each(&mut self, mut visit: impl FnMut(Side, &mut T)) {
        visit(Side::Below, &mut self.below);
        visit(Side::Above, &mut self.above);
    }
}

impl<T> std::ops::Index<Side> for Both<T> {
    type Output = T;

    fn index(&self, side: Side) -> &T {
        match side {
            Side::Below => &self.below,
            Side::Above => &self.above,
        }
    }
}

impl<T> std::ops::IndexMut<Side> for Both<T> {
    fn index_mut(&mut self, side: Side) -> &mut T {
        match side {
            Side::Below => &mut self.below,
            Side::Above => &mut self.above,
        }
    }
}
