//! Mail of one party: notes, which may be lost, and letters, which are not, over one wire.

use crate::arq::ArqLink;
use crate::protocol::{Frame, Incarnation, Member, Message, Recipient};
use crate::wire::{Peer, Wire, WireError};
use sidestep::kernel::EntityId;
use std::collections::BTreeMap;
use std::hash::{BuildHasher, RandomState};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time in which no letter comes to another node before the direct link there is checked.
const LINK_CHECK_TIMEOUT: Duration = Duration::from_secs(2);

/// Counts of a party's mail.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MessengerStats {
    /// Frames sent.
    pub frames: u64,
    /// Bytes of these frames.
    pub bytes: u64,
    /// Letters that were sent again.
    pub retries: u64,
    /// Frames that were dropped, by reason.
    pub dropped: BTreeMap<&'static str, u64>,
}

/// Another party, in its present life.
#[derive(Debug)]
struct PeerState {
    life: Incarnation,
    post: ArqLink,
    /// Time at which it was heard last.
    heard: Duration,
}

impl PeerState {
    /// Returns the address of a letter, or of a note.
    fn recipient(&mut self, party: Peer, number: Option<u64>) -> Recipient {
        Recipient {
            party,
            life: Some(self.life),
            received: self.post.take_cumulative_ack(),
            number,
        }
    }
}

/// A received word.
#[derive(Debug, PartialEq)]
pub struct Received {
    /// The sender.
    pub from: Peer,
    /// The sender's life.
    pub life: Incarnation,
    /// The word.
    pub word: Message,
}

/// A party's letters and notes to and from all others.
pub struct Messenger {
    me: Peer,
    life: Incarnation,
    wire: Box<dyn Wire>,
    began: Instant,
    others: BTreeMap<Peer, PeerState>,
    counts: MessengerStats,
}

impl Messenger {
    /// Returns the mail of a party in a new life.
    pub fn new(me: Peer, wire: Box<dyn Wire>) -> Self {
        let began = Instant::now();
        let (others, counts) = (BTreeMap::new(), MessengerStats::default());
        Self { me, life: new_incarnation(), wire, began, others, counts }
    }

    /// Returns the party's own life.
    pub fn incarnation(&self) -> Incarnation {
        self.life
    }

    /// Returns the counts so far.
    pub fn stats(&self) -> &MessengerStats {
        &self.counts
    }

    /// Returns whether all letters to another party have come, or it was not met.
    pub fn has_delivered_to(&self, other: Peer) -> bool {
        self.others.get(&other).is_none_or(|other| other.post.has_delivered())
    }

    fn now(&self) -> Duration {
        self.began.elapsed()
    }

    /// Begins to exchange letters with one life of another party. Letters that an earlier life has not
    /// taken are lost with it.
    pub fn connect(&mut self, other: Peer, life: Incarnation) {
        if self.others.get(&other).is_none_or(|known| known.life != life) {
            let (post, heard) = (ArqLink::default(), self.now());
            self.others.insert(other, PeerState { life, post, heard });
        }
    }

    /// Ends the exchange with another party; letters that it has not taken are lost.
    pub fn disconnect(&mut self, other: Peer) {
        self.others.remove(&other);
    }

    /// Returns the time for which another party that was met has been silent.
    pub fn silent_for(&self, other: Peer) -> Option<Duration> {
        let heard = self.others.get(&other)?.heard;
        Some(self.now().saturating_sub(heard))
    }

    /// Returns whether the direct link to another node is deaf: no letter arrives there, and its end has left
    /// questions unanswered for some time.
    pub fn is_half_open(&mut self, member: &Member, within: Duration) -> bool {
        let other = self.others.get(&Peer::Node(member.agent));
        let since = other.and_then(|other| other.post.unacked_since());
        since.is_some_and(|since| self.now().saturating_sub(since) > LINK_CHECK_TIMEOUT)
            && self.wire.is_half_open(member, within)
    }

    /// Closes the direct links to all other nodes, and opens them again.
    ///
    /// # Errors
    /// When an endpoint cannot be taken again: everything goes by the server then, and it can be tried once more.
    pub fn reopen_links(&mut self) -> Result<(), WireError> {
        self.wire.reopen_links()
    }

    /// Returns whether all letters to all others have come.
    pub fn has_delivered(&self) -> bool {
        self.others.values().all(|other| other.post.has_delivered())
    }

    /// Sends a word that may be lost.
    pub fn send_best_effort(&mut self, to: Peer, word: Message) {
        self.multicast_best_effort(&[to], &word);
    }

    /// Sends a word that may be lost to some parties.
    pub fn multicast_best_effort(&mut self, to: &[Peer], word: &Message) {
        let address = |&party: &Peer| match self.others.get_mut(&party) {
            Some(other) => other.recipient(party, None),
            None => Recipient { party, life: None, received: 0, number: None },
        };
        let to = to.iter().map(address).collect();
        self.transmit(to, Some(word));
    }

    /// Sends a word that may be lost to one life of another party, regardless of the life with which it exchanges
    /// letters.
    pub fn reply(&mut self, to: Peer, life: Incarnation, word: Message) {
        let address = Recipient { party: to, life: Some(life), received: 0, number: None };
        self.transmit(vec![address], Some(&word));
    }

    /// Sends a word that is repeated until it has come; lost if the other was not met.
    pub fn send_reliable(&mut self, to: Peer, word: Message) {
        self.multicast_reliable(&[to], word);
    }

    /// Sends a word to some parties, to each of which it is repeated until it has come there; lost to those that were
    /// not met.
    pub fn multicast_reliable(&mut self, to: &[Peer], word: Message) {
        let (now, word) = (self.now(), Arc::new(word));
        let mut addresses = Vec::with_capacity(to.len());
        for &party in to {
            let Some(other) = self.others.get_mut(&party) else {
                self.count_drop("stranger");
                continue;
            };
            let number = other.post.send(word.clone(), now);
            addresses.push(other.recipient(party, Some(number)));
        }
        self.transmit(addresses, Some(&word));
    }

    fn transmit(&mut self, to: Vec<Recipient>, word: Option<&Message>) {
        let parties: Vec<Peer> = to.iter().map(|address| address.party).collect();
        if parties.is_empty() {
            return;
        }
        let frame = Frame { from: self.me, life: self.life, to, word }.encode();
        self.counts.frames += 1;
        self.counts.bytes += frame.len() as u64;
        self.wire.send(&parties, &frame);
    }

    fn count_drop(&mut self, reason: &'static str) {
        *self.counts.dropped.entry(reason).or_default() += 1;
    }

    /// Sends the frames that are due: letters again, and acknowledgments.
    fn send_due(&mut self) {
        let now = self.now();
        let is_due = |other: &PeerState| other.post.next_due().is_some_and(|at| at <= now);
        let due: Vec<Peer> =
            self.others.iter().filter(|(_, other)| is_due(other)).map(|(&who, _)| who).collect();
        for to in due {
            let Some(other) = self.others.get_mut(&to) else { continue };
            let due = other.post.take_due(now);
            let address = other.recipient(to, None);
            self.counts.retries += due.again.len() as u64;
            for (number, word) in due.again {
                self.transmit(vec![Recipient { number: Some(number), ..address }], Some(&word));
            }
            if due.acknowledge {
                self.transmit(vec![address], None);
            }
        }
    }

    /// Makes the direct links from this node to all others, where there are any.
    ///
    /// # Errors
    /// When an endpoint cannot be taken.
    pub fn connect_mesh(&mut self, me: EntityId, members: &[Member]) -> Result<(), WireError> {
        self.wire.connect_mesh(me, members)
    }

    /// Returns the next word that comes within some time; none if none does. Words come in the order in which
    /// their sender has sent them, except for notes. Of parties that were not met, only notes come.
    pub fn receive(&mut self, within: Duration) -> Option<Received> {
        let until = self.now().saturating_add(within);
        loop {
            self.send_due();
            let now = self.now();
            let due = self.others.values().filter_map(|other| other.post.next_due()).min();
            let wait = due.map_or(until, |due| due.min(until)).saturating_sub(now);
            if let Some(bytes) = self.wire.receive(wait) {
                if let Some(heard) = self.decode_frame(&bytes) {
                    return Some(heard);
                }
            } else if self.now() >= until {
                return None;
            }
        }
    }

    fn decode_frame(&mut self, bytes: &[u8]) -> Option<Received> {
        let frame = match Frame::decode(bytes) {
            Ok(frame) => frame,
            Err(reason) => {
                self.count_drop(reason.name());
                return None;
            }
        };
        let Frame { from, life, to, word } = frame;
        // Where all hear the frames meant for most, some frames are not meant for this party.
        let address = to.into_iter().find(|address| address.party == self.me)?;
        // It is addressed to the process that was here before, with its own numbers of letters.
        if address.life.is_some_and(|to| to != self.life) {
            self.count_drop("former-life");
            return None;
        }
        if let Err(reason) = self.record_acks(from, life, &address) {
            self.count_drop(reason);
            return None;
        }
        Some(Received { from, life, word: word? })
    }

    /// Notes the acknowledgments of a frame; an error is the reason why its word does not count.
    fn record_acks(
        &mut self,
        from: Peer,
        life: Incarnation,
        address: &Recipient,
    ) -> Result<(), &'static str> {
        let now = self.now();
        let Some(other) = self.others.get_mut(&from).filter(|other| other.life == life) else {
            return if address.number.is_none() { Ok(()) } else { Err("stranger") };
        };
        other.heard = now;
        if address.life.is_some() {
            other.post.on_ack(address.received, now);
        }
        match address.number {
            Some(number) if !other.post.accept(number, now) => Err("out-of-order"),
            _ => Ok(()),
        }
    }
}

/// Returns a number that no other life has.
fn new_incarnation() -> Incarnation {
    // The standard library seeds its hash maps from the system's source of randomness.
    Incarnation(RandomState::new().hash_one(std::process::id()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::memory::MemoryHub;

    const SOON: Duration = Duration::from_millis(1);
    const LATER: Duration = Duration::from_secs(20);

    /// A wire that loses the first frames on the way to their last receiver.
    struct Lossy {
        wire: Box<dyn Wire>,
        lost: usize,
    }

    impl Wire for Lossy {
        fn send(&mut self, to: &[Peer], frame: &[u8]) {
            match self.lost {
                0 => self.wire.send(to, frame),
                _ => {
                    self.lost -= 1;
                    self.wire.send(&to[..to.len() - 1], frame);
                }
            }
        }

        fn receive(&mut self, within: Duration) -> Option<Vec<u8>> {
            self.wire.receive(within)
        }
    }

    fn mail(exchange: &MemoryHub, me: Peer, lost: usize) -> Messenger {
        Messenger::new(me, Box::new(Lossy { wire: Box::new(exchange.wire(me)), lost }))
    }

    #[test]
    fn a_letter_whose_frame_is_lost_comes_all_the_same_and_a_note_does_not() {
        let exchange = MemoryHub::default();
        let (a, b) = (Peer::Server, Peer::Node(3));
        let (mut first, mut second) = (mail(&exchange, a, 2), mail(&exchange, b, 0));
        first.connect(b, second.incarnation());
        second.connect(a, first.incarnation());
        first.send_best_effort(b, Message::Hello);
        first.send_reliable(b, Message::End);
        assert_eq!(second.receive(SOON), None, "both frames were lost");
        std::thread::scope(|scope| {
            let sends = scope.spawn(move || {
                while !first.has_delivered() {
                    first.receive(SOON);
                }
                first.stats().retries
            });
            let heard = second.receive(LATER).expect("it is sent again");
            assert_eq!((heard.from, heard.word), (a, Message::End));
            while !sends.is_finished() {
                assert_eq!(second.receive(SOON), None, "it comes once");
            }
            assert!(sends.join().expect("no panic") >= 1);
        });
    }

    #[test]
    fn a_letter_to_several_comes_once_to_each_in_the_order_of_its_own_letters() {
        let exchange = MemoryHub::default();
        let [a, b, c] = [1, 2, 3].map(Peer::Node);
        let mut first = mail(&exchange, a, 0);
        let mut others = [b, c].map(|party| mail(&exchange, party, 0));
        first.connect(b, others[0].incarnation());
        first.send_reliable(b, Message::Hello);
        first.multicast_reliable(&[b, c], Message::Close(1));
        assert_eq!(first.stats().dropped["stranger"], 1, "one of them was not met");
        first.connect(c, others[1].incarnation());
        first.wire = Box::new(Lossy { wire: Box::new(exchange.wire(a)), lost: 1 });
        first.multicast_reliable(&[b, c], Message::Close(2));
        for other in &mut others {
            other.connect(a, first.incarnation());
        }
        let mut heard = [Vec::new(), Vec::new()];
        while !first.has_delivered() {
            first.receive(SOON);
            for (other, heard) in others.iter_mut().zip(&mut heard) {
                heard.extend(other.receive(SOON).map(|heard| heard.word));
            }
        }
        assert_eq!(heard[0], [Message::Hello, Message::Close(1), Message::Close(2)]);
        assert_eq!(heard[1], [Message::Close(2)], "lost at first, and sent again");
    }

    #[test]
    fn frames_to_an_earlier_life_and_letters_of_strangers_are_dropped_and_counted() {
        let exchange = MemoryHub::default();
        let (a, b) = (Peer::Server, Peer::Node(3));
        let (mut first, mut second) = (mail(&exchange, a, 0), mail(&exchange, b, 0));
        first.connect(b, Incarnation(17));
        first.send_reliable(b, Message::End);
        assert_eq!(second.receive(SOON), None);
        assert_eq!(second.stats().dropped["former-life"], 1);
        let life = second.incarnation();
        first.connect(b, life);
        first.send_reliable(b, Message::End);
        assert_eq!(second.receive(SOON), None, "it has not met the server");
        assert_eq!(second.stats().dropped["stranger"], 1);
        exchange.wire(Peer::Node(9)).send(&[b], b"something else");
        assert_eq!(second.receive(SOON), None);
        assert_eq!(second.stats().dropped["foreign"], 1);
    }
}
