//! Letters between two parties: numbered, acknowledged, repeated until they have come, and taken in order.
//!
//! A receiver that misses one drops those after it, and the sender repeats all of them (go back N). That is simple,
//! and rare: frames are lost only where a link breaks or a queue is full.
//!
//! A state machine without a clock: the time is handed in, from any fixed start.

use crate::protocol::Message;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// Time after which a letter is first sent again.
const MIN_RETRANSMIT_DELAY: Duration = Duration::from_millis(200);

/// Longest time between two transmissions of a letter.
const MAX_RETRANSMIT_DELAY: Duration = Duration::from_secs(2);

/// Time after which a letter is acknowledged, if no other frame to its sender has done so by then.
const ACK_DELAY: Duration = Duration::from_millis(40);

/// Most letters that are sent again at once.
const MAX_RETRANSMIT_BURST: usize = 16;

/// The letters from and to one other party.
#[derive(Debug)]
pub(crate) struct ArqLink {
    /// Letters that the other may not have, from the oldest on. They may be shared with other posts.
    waiting: VecDeque<Arc<Message>>,
    /// Number of the oldest of them.
    oldest: u64,
    /// Time at which it became the oldest.
    oldest_since: Option<Duration>,
    /// Time at which they are sent again.
    again_at: Option<Duration>,
    wait: Duration,
    /// Number of the next letter of the other.
    next: u64,
    /// Time at which the receipt of the other's letters is acknowledged.
    acknowledge_at: Option<Duration>,
}

impl Default for ArqLink {
    fn default() -> Self {
        Self {
            waiting: VecDeque::new(),
            oldest: 0,
            oldest_since: None,
            again_at: None,
            wait: MIN_RETRANSMIT_DELAY,
            next: 0,
            acknowledge_at: None,
        }
    }
}

/// Frames that are due.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct DueFrames {
    /// Letters that are sent again, with their numbers.
    pub(crate) again: Vec<(u64, Arc<Message>)>,
    /// Whether receipts are sent to the other in a frame of their own.
    pub(crate) acknowledge: bool,
}

impl ArqLink {
    /// Keeps a letter until it is acknowledged, and returns its number.
    pub(crate) fn send(&mut self, word: Arc<Message>, now: Duration) -> u64 {
        self.waiting.push_back(word);
        self.oldest_since.get_or_insert(now);
        self.again_at.get_or_insert(now + self.wait);
        self.oldest + self.waiting.len() as u64 - 1
    }

    /// Returns the number up to which all letters of the other have come: every frame to it contains that number.
    pub(crate) fn take_cumulative_ack(&mut self) -> u64 {
        self.acknowledge_at = None;
        self.next
    }

    /// Returns whether a letter of the other is the next one: then it is taken.
    pub(crate) fn accept(&mut self, number: u64, now: Duration) -> bool {
        let is_next = number == self.next;
        self.next += u64::from(is_next);
        // A repeated one, too: the other does not know yet that it came.
        self.acknowledge_at.get_or_insert(now + ACK_DELAY);
        is_next
    }

    /// Notes that the other has received all letters below a number.
    pub(crate) fn on_ack(&mut self, number: u64, now: Duration) {
        let new = number.saturating_sub(self.oldest).min(self.waiting.len() as u64);
        if new == 0 {
            return;
        }
        self.waiting.drain(..new as usize);
        self.oldest += new;
        self.wait = MIN_RETRANSMIT_DELAY;
        self.oldest_since = (!self.waiting.is_empty()).then_some(now);
        self.again_at = self.oldest_since.map(|since| since + self.wait);
    }

    /// Returns the frames that are due.
    pub(crate) fn take_due(&mut self, now: Duration) -> DueFrames {
        let mut due = DueFrames::default();
        if self.again_at.is_some_and(|at| at <= now) {
            let numbered = (self.oldest..).zip(&self.waiting).take(MAX_RETRANSMIT_BURST);
            due.again = numbered.map(|(number, word)| (number, word.clone())).collect();
            self.wait = (2 * self.wait).min(MAX_RETRANSMIT_DELAY);
            self.again_at = Some(now + self.wait);
        }
        if self.acknowledge_at.is_some_and(|at| at <= now) {
            self.acknowledge_at = None;
            // Letters acknowledge, too.
            due.acknowledge = due.again.is_empty();
        }
        due
    }

    /// Returns the time since which no letter has arrived although some are waiting; none where all have arrived.
    pub(crate) fn unacked_since(&self) -> Option<Duration> {
        self.oldest_since
    }

    /// Returns the time at which frames are due next.
    pub(crate) fn next_due(&self) -> Option<Duration> {
        self.again_at.into_iter().chain(self.acknowledge_at).min()
    }

    /// Returns whether all letters have arrived.
    pub(crate) fn has_delivered(&self) -> bool {
        self.waiting.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const STEP: Duration = Duration::from_millis(10);

    fn letter(number: u64) -> Arc<Message> {
        Arc::new(Message::Close(number))
    }

    /// A frame from one post to another: the number up to which letters have come, and a letter.
    type Flying = (u64, Option<(u64, Arc<Message>)>);

    /// Two posts and the frames between them.
    struct Pair {
        posts: [ArqLink; 2],
        flying: Vec<(usize, Flying)>,
        now: Duration,
        taken: Vec<Arc<Message>>,
    }

    impl Pair {
        fn new() -> Self {
            let posts = [ArqLink::default(), ArqLink::default()];
            Self { posts, flying: Vec::new(), now: Duration::ZERO, taken: Vec::new() }
        }

        fn fly(&mut self, from: usize, letter: Option<(u64, Arc<Message>)>) {
            let received = self.posts[from].take_cumulative_ack();
            self.flying.push((1 - from, (received, letter)));
        }

        fn arrive(&mut self, (to, (received, letter)): (usize, Flying)) {
            self.posts[to].on_ack(received, self.now);
            if let Some((number, word)) = letter
                && self.posts[to].accept(number, self.now)
            {
                self.taken.push(word);
            }
        }

        fn step(&mut self) {
            self.now += STEP;
            for from in 0..2 {
                let due = self.posts[from].take_due(self.now);
                let is_told = due.acknowledge;
                due.again.into_iter().for_each(|letter| self.fly(from, Some(letter)));
                if is_told {
                    self.fly(from, None);
                }
            }
        }
    }

    proptest! {
        /// With frames lost, doubled and overtaken, until the network is well again.
        #[test]
        fn all_letters_come_once_and_in_order(
            count in 1u64..40, faults in prop::collection::vec((0u8..4, any::<prop::sample::Index>()), 0..200),
        ) {
            let mut pair = Pair::new();
            for number in 0..count {
                let numbered = pair.posts[0].send(letter(number), pair.now);
                prop_assert_eq!(numbered, number);
                pair.fly(0, Some((number, letter(number))));
            }
            for (fault, which) in faults {
                pair.step();
                if pair.flying.is_empty() {
                    continue;
                }
                let frame = pair.flying.swap_remove(which.index(pair.flying.len()));
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
            while !pair.posts[0].has_delivered() {
                steps += 1;
                prop_assert!(steps < 10_000, "it never comes to an end");
                pair.step();
                for frame in std::mem::take(&mut pair.flying) {
                    pair.arrive(frame);
                }
            }
            let all: Vec<Arc<Message>> = (0..count).map(letter).collect();
            prop_assert_eq!(pair.taken, all);
        }
    }

    #[test]
    fn a_letter_is_repeated_less_and_less_often_and_a_word_of_the_other_ends_that() {
        let mut post = ArqLink::default();
        post.send(letter(0), Duration::ZERO);
        let mut times = Vec::new();
        while times.len() < 6 {
            let at = post.next_due().expect("it waits");
            assert_eq!(post.take_due(at).again, [(0, letter(0))]);
            times.push(at.as_millis());
        }
        assert_eq!(times, [200, 600, 1400, 3000, 5000, 7000]);
        post.on_ack(1, Duration::from_secs(8));
        assert!(post.has_delivered() && post.next_due().is_none());
    }

    #[test]
    fn a_number_that_was_never_sent_is_no_harm() {
        let mut post = ArqLink::default();
        post.send(letter(0), Duration::ZERO);
        post.on_ack(u64::MAX, Duration::ZERO);
        assert!(post.has_delivered());
        assert_eq!(post.send(letter(1), Duration::ZERO), 1);
    }

    #[test]
    fn it_is_known_since_when_no_letter_has_come() {
        let at = Duration::from_secs;
        let (mut post, word) = (ArqLink::default(), Arc::new(Message::Hello));
        assert_eq!(post.unacked_since(), None);
        for second in 1..4 {
            post.send(word.clone(), at(second));
        }
        assert_eq!(post.unacked_since(), Some(at(1)));
        post.on_ack(2, at(8));
        assert_eq!(post.unacked_since(), Some(at(8)), "two have come then");
        post.on_ack(2, at(9));
        assert_eq!(post.unacked_since(), Some(at(8)), "none has since");
        post.on_ack(3, at(10));
        assert_eq!(post.unacked_since(), None);
    }
}
