//! The traffic on the network of the agents.

use serde::{Deserialize, Serialize};

/// Messages and bytes that went over the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct NetworkTraffic {
    /// Number of messages, one per receiver; for a coordinator, its migrations.
    pub messages: u64,
    /// Number of messages if one could reach all.
    pub multicasts: u64,
    /// Number of bytes of the messages, in their serialized form.
    pub bytes: u64,
    /// Number of bytes if one message could reach all.
    pub multicast_bytes: u64,
    /// Number of packets that waited for earlier ones of their sender, because of the radio's budget.
    pub deferred: u64,
    /// Number of packets that were not sent, because of the radio's budget.
    pub dropped: u64,
    /// Number of ticks that the conversations took, one after the other.
    pub ticks: u64,
}

impl NetworkTraffic {
    /// Adds the counts of a conversation at another time, so that ticks add up, too.
    pub fn add(&mut self, other: Self) {
        self.messages += other.messages;
        self.multicasts += other.multicasts;
        self.bytes += other.bytes;
        self.multicast_bytes += other.multicast_bytes;
        self.deferred += other.deferred;
        self.dropped += other.dropped;
        self.ticks += other.ticks;
    }

    /// Adds the counts of the same conversation by another participant.
    pub(crate) fn add_participant_traffic(&mut self, other: Self) {
        let ticks = self.ticks.max(other.ticks);
        self.add(other);
        self.ticks = ticks;
    }

    /// Counts a message to `receivers` others.
    pub(crate) fn count_message(&mut self, receivers: usize, bytes: usize) {
        self.messages += receivers as u64;
        self.multicasts += 1;
        self.bytes += (receivers * bytes) as u64;
        self.multicast_bytes += bytes as u64;
    }
}
