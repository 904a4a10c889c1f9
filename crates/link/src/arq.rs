//! Reliable delivery to one other peer: messages are numbered, acknowledged, retransmitted and accepted in order.
//!
//! A receiver that misses one drops those after it, and the sender retransmits all of them (go-back-N). Selective
//! repeat would spare retransmissions, but needs a reorder buffer; frames are lost only where a link breaks or a queue
//! is full, so they are rare.
//!
//! A state machine without a clock: callers pass the time, measured from any fixed start, so that tests need not sleep.

use crate::protocol::Message;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// Time to the first retransmission of a message. It is longer than [`ACK_DELAY`] and a round trip, so that without
/// losses nothing is sent twice.
const MIN_RETRANSMIT_DELAY: Duration = Duration::from_millis(200);

/// Maximum time between two transmissions of a message: with exponential backoff alone a link that was down for a
/// minute could stay silent for another minute after it is back.
const MAX_RETRANSMIT_DELAY: Duration = Duration::from_secs(2);

/// Time after which a message is acknowledged by a frame of its own, unless another frame to its sender has carried the
/// acknowledgment by then. Most messages are answered sooner, so most acknowledgments cost no frame.
const ACK_DELAY: Duration = Duration::from_millis(40);

/// Maximum number of messages that are retransmitted at once: all of a long backlog would fill the very queue that has
/// dropped them.
const MAX_RETRANSMIT_BURST: usize = 16;

/// Both directions of the reliable messages between this peer and another one.
#[derive(Debug)]
pub(crate) struct ArqLink {
    /// Messages that the other end has not acknowledged, from the oldest on. A message to several peers is shared by
    /// their links.
    unacked: VecDeque<Arc<Message>>,
    /// Sequence number of the oldest of them.
    oldest: u64,
    /// Time at which it became the oldest.
    oldest_since: Option<Duration>,
    /// Time at which they are retransmitted.
    retransmit_at: Option<Duration>,
    /// Delay of the next retransmission; it doubles each time and is reset by an acknowledgment.
    retransmit_delay: Duration,
    /// Sequence number below which all messages were sent since a loss was last noticed: the receiver drops those after
    /// it, even if they have been sent before.
    resent_below: u64,
    /// Sequence number of the next message to be accepted from the other end.
    next_received: u64,
    /// Time at which received messages are acknowledged by a frame of its own.
    acknowledge_at: Option<Duration>,
}

impl Default for ArqLink {
    fn default() -> Self {
        Self {
            unacked: VecDeque::new(),
            oldest: 0,
            oldest_since: None,
            retransmit_at: None,
            retransmit_delay: MIN_RETRANSMIT_DELAY,
            resent_below: 0,
            next_received: 0,
            acknowledge_at: None,
        }
    }
}

/// What has to be sent to the other end now.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct DueRetransmissions {
    /// Messages to retransmit, with their sequence numbers.
    pub(crate) retransmissions: Vec<(u64, Arc<Message>)>,
    /// Whether an acknowledgment is due in a frame of its own.
    pub(crate) acknowledge: bool,
}

impl ArqLink {
    /// Keeps a message until it is acknowledged, and returns its sequence number.
    pub(crate) fn push_unacked(&mut self, message: Arc<Message>, now: Duration) -> u64 {
        let sequence = self.next_sequence();
        self.unacked.push_back(message);
        self.oldest_since.get_or_insert(now);
        self.retransmit_at.get_or_insert(now + self.retransmit_delay);
        if self.resent_below == sequence {
            self.resent_below += 1;
        }
        sequence
    }

    fn next_sequence(&self) -> u64 {
        self.oldest + self.unacked.len() as u64
    }

    /// Returns the cumulative acknowledgment for the next frame to the other end; no frame of its own is due for it then.
    pub(crate) fn take_outgoing_ack(&mut self) -> u64 {
        self.acknowledge_at = None;
        self.next_received
    }

    /// Accepts a message if it is the next one in order, and returns whether it is.
    pub(crate) fn accept_in_order(&mut self, sequence: u64, now: Duration) -> bool {
        let is_next = sequence == self.next_received;
        if is_next {
            self.next_received += 1;
        }
        // A duplicate is acknowledged, too: the acknowledgment of the first one may be lost.
        self.acknowledge_at.get_or_insert(now + ACK_DELAY);
        is_next
    }

    /// Records that the other end has received all messages below a sequence number.
    pub(crate) fn on_ack(&mut self, sequence: u64, now: Duration) {
        // A number beyond all that was sent comes from a faulty peer, and must not panic here.
        let newly_acked = sequence.saturating_sub(self.oldest).min(self.unacked.len() as u64);
        if newly_acked == 0 {
            return;
        }
        self.unacked.drain(..newly_acked as usize);
        self.oldest += newly_acked;
        self.retransmit_delay = MIN_RETRANSMIT_DELAY;
        self.resent_below = self.resent_below.max(self.oldest);
        self.oldest_since = (!self.unacked.is_empty()).then_some(now);
        // Of a backlog that is sent again, the next part follows at once.
        let is_next_due = self.resent_below == self.oldest;
        let delay = if is_next_due { Duration::ZERO } else { self.retransmit_delay };
        self.retransmit_at = self.oldest_since.map(|since| since + delay);
    }

    /// Retransmits at once, as soon as the other end is heard again after a long silence.
    pub(crate) fn hasten(&mut self, now: Duration) {
        self.retransmit_delay = MIN_RETRANSMIT_DELAY;
        self.retransmit_at = self.retransmit_at.map(|_| now);
    }

    /// Returns what is due by now, and sets the time of the next retransmission.
    pub(crate) fn take_due_retransmissions(&mut self, now: Duration) -> DueRetransmissions {
        let mut due = DueRetransmissions::default();
        if self.retransmit_at.is_some_and(|at| at <= now) {
            let sequence = (self.oldest..).zip(&self.unacked).take(MAX_RETRANSMIT_BURST);
            due.retransmissions =
                sequence.map(|(sequence, message)| (sequence, message.clone())).collect();
            self.resent_below = self.oldest + due.retransmissions.len() as u64;
            self.retransmit_delay = (2 * self.retransmit_delay).min(MAX_RETRANSMIT_DELAY);
            self.retransmit_at = Some(now + self.retransmit_delay);
        }
        if self.acknowledge_at.is_some_and(|at| at <= now) {
            self.acknowledge_at = None;
            // Retransmissions carry the acknowledgment, too.
            due.acknowledge = due.retransmissions.is_empty();
        }
        due
    }

    /// Returns the time since which no message was acknowledged although some are unacknowledged.
    pub(crate) fn unacked_since(&self) -> Option<Duration> {
        self.oldest_since
    }

    /// Returns the time at which frames are due next.
    pub(crate) fn next_send_time(&self) -> Option<Duration> {
        self.retransmit_at.into_iter().chain(self.acknowledge_at).min()
    }

    /// Returns whether received messages have yet to be acknowledged.
    pub(crate) fn owes_ack(&self) -> bool {
        self.acknowledge_at.is_some()
    }

    /// Returns whether all messages were acknowledged.
    pub(crate) fn has_delivered(&self) -> bool {
        self.unacked.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const STEP: Duration = Duration::from_millis(10);

    fn message(sequence: u64) -> Arc<Message> {
        Arc::new(Message::Close(sequence))
    }

    /// A frame in transit: its cumulative acknowledgment, and a numbered message.
    type InTransit = (u64, Option<(u64, Arc<Message>)>);

    /// The two ends of a link, and the frames in transit.
    struct Pair {
        links: [ArqLink; 2],
        in_transit: Vec<(usize, InTransit)>,
        now: Duration,
        accepted: Vec<Arc<Message>>,
    }

    impl Pair {
        fn new() -> Self {
            let links = [ArqLink::default(), ArqLink::default()];
            Self { links, in_transit: Vec::new(), now: Duration::ZERO, accepted: Vec::new() }
        }

        fn transmit(&mut self, from: usize, message: Option<(u64, Arc<Message>)>) {
            let ack = self.links[from].take_outgoing_ack();
            self.in_transit.push((1 - from, (ack, message)));
        }

        fn arrive(&mut self, (to, (ack, message)): (usize, InTransit)) {
            self.links[to].on_ack(ack, self.now);
            if let Some((sequence, message)) = message
                && self.links[to].accept_in_order(sequence, self.now)
            {
                self.accepted.push(message);
            }
        }

        fn step(&mut self) {
            self.now += STEP;
            for from in 0..2 {
                let due = self.links[from].take_due_retransmissions(self.now);
                let acknowledges = due.acknowledge;
                due.retransmissions
                    .into_iter()
                    .for_each(|message| self.transmit(from, Some(message)));
                if acknowledges {
                    self.transmit(from, None);
                }
            }
        }
    }

    proptest! {
        /// With frames lost, duplicated and reordered, until the network is well again.
        #[test]
        fn all_messages_arrive_once_and_in_order(
            count in 1u64..40, faults in prop::collection::vec((0u8..4, any::<prop::sample::Index>()), 0..200),
        ) {
            let mut pair = Pair::new();
            for sequence in 0..count {
                let assigned = pair.links[0].push_unacked(message(sequence), pair.now);
                prop_assert_eq!(assigned, sequence);
                pair.transmit(0, Some((sequence, message(sequence))));
            }
            for (fault, which) in faults {
                pair.step();
                if pair.in_transit.is_empty() {
                    continue;
                }
                let frame = pair.in_transit.swap_remove(which.index(pair.in_transit.len()));
                match fault {
                    0 => {}
                    1 => {
                        pair.arrive(frame.clone());
                        pair.arrive(frame);
                    }
                    _ => pair.arrive(frame),
                }
            }
            let mut steps = 0;
            while !pair.links[0].has_delivered() {
                steps += 1;
                prop_assert!(steps < 10_000, "it never comes to an end");
                pair.step();
                for frame in std::mem::take(&mut pair.in_transit) {
                    pair.arrive(frame);
                }
            }
            let all: Vec<Arc<Message>> = (0..count).map(message).collect();
            prop_assert_eq!(pair.accepted, all);
        }
    }

    #[test]
    fn a_message_is_retransmitted_less_and_less_often_until_it_is_acknowledged() {
        let mut link = ArqLink::default();
        link.push_unacked(message(0), Duration::ZERO);
        let mut times = Vec::new();
        while times.len() < 6 {
            let at = link.next_send_time().expect("it waits");
            assert_eq!(link.take_due_retransmissions(at).retransmissions, [(0, message(0))]);
            times.push(at.as_millis());
        }
        assert_eq!(times, [200, 600, 1400, 3000, 5000, 7000]);
        link.on_ack(1, Duration::from_secs(8));
        assert!(link.has_delivered() && link.next_send_time().is_none());
    }

    /// The other end acknowledges at once what arrives, and the backlog of a broken link arrives without a further wait.
    #[test]
    fn a_backlog_is_sent_again_as_fast_as_it_is_acknowledged_and_nothing_else_is_sent_twice() {
        let (mut from, mut to) = (ArqLink::default(), ArqLink::default());
        let backlog = 5 * MAX_RETRANSMIT_BURST as u64;
        for sequence in 0..backlog {
            from.push_unacked(message(sequence), Duration::ZERO);
        }
        let mut now = Duration::from_secs(9);
        from.hasten(now);
        let mut transmissions = 0;
        for step in 0..100 {
            for (sequence, _) in from.take_due_retransmissions(now).retransmissions {
                transmissions += 1;
                assert!(to.accept_in_order(sequence, now), "{sequence} is sent twice");
            }
            if step % 2 == 0 {
                let sequence = from.push_unacked(message(step), now);
                // After all of the backlog it arrives at its first transmission.
                to.accept_in_order(sequence, now);
            }
            now += STEP;
            from.on_ack(to.take_outgoing_ack(), now);
        }
        assert!(from.has_delivered());
        assert!(transmissions < backlog + 10, "{transmissions}");
    }

    #[test]
    fn a_number_that_was_never_sent_is_no_harm() {
        let mut link = ArqLink::default();
        link.push_unacked(message(0), Duration::ZERO);
        link.on_ack(u64::MAX, Duration::ZERO);
        assert!(link.has_delivered());
        assert_eq!(link.push_unacked(message(1), Duration::ZERO), 1);
    }

    #[test]
    fn it_is_known_since_when_no_message_was_acknowledged() {
        let at = Duration::from_secs;
        let (mut link, message) = (ArqLink::default(), Arc::new(Message::Hello));
        assert_eq!(link.unacked_since(), None);
        for second in 1..4 {
            link.push_unacked(message.clone(), at(second));
        }
        assert_eq!(link.unacked_since(), Some(at(1)));
        link.on_ack(2, at(8));
        assert_eq!(link.unacked_since(), Some(at(8)), "two are acknowledged then");
        link.on_ack(2, at(9));
        assert_eq!(link.unacked_since(), Some(at(8)), "none has been since");
        link.on_ack(3, at(10));
        assert_eq!(link.unacked_since(), None);
    }
}
