//! The traffic on the network of the agents.

use serde::{Deserialize, Serialize};

/// Messages and bytes that went over the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct NetworkTraffic {
    /// Number of packets.
    pub messages: u64,
    /// Number of their bytes, in their serialized form.
    pub bytes: u64,
    /// Number of packets that came and were dropped, because they could not be read or made no sense.
    pub dropped: u64,
}

impl NetworkTraffic {
    pub(super) fn count_message(&mut self, bytes: usize) {
        self.messages += 1;
        self.bytes += bytes as u64;
    }
}
