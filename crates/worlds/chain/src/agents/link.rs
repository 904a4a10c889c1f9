//! Messages between two neighbors over a network that loses, delays, doubles and reorders packets:
//! each arrives once, and in the order in which they were sent.
//!
//! Messages are numbered, and kept until the neighbor has confirmed them. Those not confirmed in time
//! are sent again; a neighbor that does not confirm anything, although sent to so often that it can
//! hardly be alive and in touch, counts as lost, until something comes from it.

use serde::{Deserialize, Serialize};
use sidestep_kernel::network::{RetryPolicy, RetryTimer};
use std::collections::{BTreeMap, VecDeque};

/// Most messages that are kept because an earlier one is missing: a neighbor that numbers its messages at will must not
/// fill the memory.
const MAX_EARLY_MESSAGES: u32 = 256;
/// Most messages that wait for a confirmation: far more than honest agents ever cause. A neighbor that
/// makes an agent say more is no longer answered in the cycle.
const MAX_UNCONFIRMED_MESSAGES: usize = 4096;

/// One end of a link, for the time of a cycle.
#[derive(Debug, Clone)]
pub(super) struct NeighborLink<M> {
    /// None where nothing is ever lost: then nothing is confirmed or sent again either.
    retry: Option<RetryTimer>,
    /// Repetitions until the neighbor counts as lost.
    tries: u32,
    /// Messages that are not confirmed, the first of which has the number `first`.
    said: VecDeque<M>,
    first: u32,
    /// Number of them that have been sent.
    sent: usize,
    /// Number of the next message to come, and those that came before their time.
    next: u32,
    early: BTreeMap<u32, M>,
    /// Whether to confirm the messages received, and whether to send everything again.
    owes: bool,
    again: bool,
    /// Number of repetitions since something came.
    unanswered: u32,
    is_lost: bool,
    /// Whether anything has come in this cycle.
    is_heard: bool,
}

/// Messages on their way, with a confirmation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct MessageBatch<M> {
    /// Number of its first message.
    pub(super) first: u32,
    /// Number of the first message of the other that has not come yet.
    pub(super) next: u32,
    /// Those numbered from `first` on, in order; none where it only confirms.
    pub(super) messages: Vec<M>,
}

impl<M: Clone> NeighborLink<M> {
    /// Returns a link over which nothing has gone yet. A neighbor that was lost in the cycle before is
    /// given up sooner.
    pub(super) fn new(patience: Option<RetryPolicy>, was_lost: bool) -> Self {
        let tries = patience.map_or(0, |p| if was_lost { p.first_tries } else { p.tries });
        Self {
            retry: patience.map(RetryTimer::new),
            tries,
            said: VecDeque::new(),
            first: 0,
            sent: 0,
            next: 0,
            early: BTreeMap::new(),
            owes: false,
            again: false,
            unanswered: 0,
            is_lost: false,
            is_heard: false,
        }
    }

    /// Queues a message for the next parcel, unless too many wait already.
    pub(super) fn push(&mut self, message: M) {
        if self.said.len() < MAX_UNCONFIRMED_MESSAGES {
            self.said.push_back(message);
        }
    }

    /// Takes a parcel; returns the messages that are new, in order.
    pub(super) fn receive(&mut self, parcel: MessageBatch<M>) -> Vec<M> {
        self.is_heard = true;
        self.is_lost = false;
        self.unanswered = 0;
        let confirmed = (parcel.next.saturating_sub(self.first) as usize).min(self.sent);
        self.said.drain(..confirmed);
        self.first += confirmed as u32;
        self.sent -= confirmed;
        self.owes |= !parcel.messages.is_empty();
        let numbered = parcel.messages.into_iter().enumerate();
        for (k, message) in numbered.take(MAX_EARLY_MESSAGES as usize) {
            let number = parcel.first.saturating_add(k as u32);
            if number >= self.next && number - self.next < MAX_EARLY_MESSAGES {
                self.early.entry(number).or_insert(message);
            }
        }
        let mut new = Vec::new();
        while let Some(message) = self.early.remove(&self.next) {
            self.next += 1;
            new.push(message);
        }
        new
    }

    /// Returns the tick in which its patience ends; none while it waits for nothing.
    pub(super) fn next_retry(&self) -> Option<u64> {
        let retry = self.retry.as_ref()?;
        (self.sent > 0 && !self.is_lost).then(|| retry.due_tick())
    }

    /// Records the size of a packet that goes over it.
    pub(super) fn record_packet(&mut self, bytes: usize) {
        if let Some(retry) = &mut self.retry {
            retry.record_packet_size(bytes);
        }
    }

    /// Looks at the clock; returns whether the neighbor is lost from now on.
    pub(super) fn on_timer(&mut self, tick: u64) -> bool {
        if self.next_retry().is_none_or(|due| due > tick) {
            return false;
        }
        self.is_lost = self.unanswered >= self.tries;
        self.again = !self.is_lost;
        self.unanswered += 1;
        self.is_lost
    }

    /// Returns the parcel that is to be sent now, if there is anything to say or to confirm.
    pub(super) fn next_message_batch(&mut self, tick: u64) -> Option<MessageBatch<M>> {
        // All that are unconfirmed, because the neighbor may lack any of them.
        let from = if self.again { 0 } else { self.sent };
        let confirms = self.owes && self.retry.is_some();
        if from == self.said.len() && !confirms {
            return None;
        }
        let messages: Vec<M> = self.said.range(from..).cloned().collect();
        let parcel = MessageBatch { first: self.first + from as u32, next: self.next, messages };
        if let Some(retry) = &mut self.retry
            && (self.again || self.sent == 0)
        {
            retry.restart(tick);
        }
        self.owes = false;
        self.again = false;
        self.sent = self.said.len();
        // Where nothing gets lost, sent is received.
        if self.retry.is_none() {
            self.first += self.said.len() as u32;
            self.said.clear();
            self.sent = 0;
        }
        Some(parcel)
    }

    /// Returns whether everything has arrived, or the neighbor is lost.
    pub(super) fn is_quiet(&self) -> bool {
        self.is_lost || self.said.is_empty()
    }

    /// Returns whether anything has come from the neighbor in this cycle.
    pub(super) fn has_heard_neighbor(&self) -> bool {
        self.is_heard
    }
}
