//! The time after which an agent asks again.

use super::RetryPolicy;

/// The clock by which an agent waits for messages of others.
#[derive(Debug, Clone)]
pub struct RetryTimer {
    policy: RetryPolicy,
    /// Tick of the last message or request.
    waiting_since: u64,
    /// Size of the largest packet that went over its links, in bytes.
    max_packet_bytes: usize,
}

impl RetryTimer {
    /// Returns a timer that starts in tick 0.
    pub fn new(policy: RetryPolicy) -> Self {
        Self { policy, waiting_since: 0, max_packet_bytes: 0 }
    }

    /// Waits anew from a tick on, because something has come or was asked for.
    pub fn restart(&mut self, tick: u64) {
        self.waiting_since = tick;
    }

    /// Records the size of a packet: a large one takes its time on the way, and so may its answer.
    pub fn record_packet_size(&mut self, bytes: usize) {
        self.max_packet_bytes = self.max_packet_bytes.max(bytes);
    }

    /// Returns the tick in which the wait ends.
    pub fn due_tick(&self) -> u64 {
        self.waiting_since.saturating_add(self.policy.timeout_ticks(self.max_packet_bytes))
    }
}
