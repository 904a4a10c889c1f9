//! Mail of one party: notes, which may be lost, and letters, which are not, over one wire.

use crate::post::Post;
use crate::wire::{Party, Wire, WireError};
use crate::words::{Address, Frame, Life, Member, Word};
use sidestep::kernel::EntityId;
use std::collections::BTreeMap;
use std::hash::{BuildHasher, RandomState};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time in which no letter comes to another node before the direct link there is checked.
const SUSPECT: Duration = Duration::from_secs(2);

/// Counts of a party's mail.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Counts {
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
struct Other {
    life: Life,
    post: Post,
    /// Time at which it was heard last.
    heard: Duration,
}

impl Other {
    /// Returns the address of a letter, or of a note.
    fn address(&mut self, party: Party, number: Option<u64>) -> Address {
        Address { party, life: Some(self.life), received: self.post.received(), number }
    }
}

/// A received word.
#[derive(Debug, PartialEq)]
pub struct Heard {
    /// The sender.
    pub from: Party,
    /// The sender's life.
    pub life: Life,
    /// The word.
    pub word: Word,
}

/// A party's letters and notes to and from all others.
pub struct Mail {
    me: Party,
    life: Life,
    wire: Box<dyn Wire>,
    began: Instant,
    others: BTreeMap<Party, Other>,
    counts: Counts,
}

impl Mail {
    /// Returns the mail of a party in a new life.
    pub fn new(me: Party, wire: Box<dyn Wire>) -> Self {
        let began = Instant::now();
        let (others, counts) = (BTreeMap::new(), Counts::default());
        Self { me, life: new_life(), wire, began, others, counts }
    }

    /// Returns the party's own life.
    pub fn life(&self) -> Life {
        self.life
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Returns whether all letters to another party have come, or it was not met.
    pub fn has_delivered_to(&self, other: Party) -> bool {
        self.others.get(&other).is_none_or(|other| other.post.has_delivered())
    }

    fn now(&self) -> Duration {
        self.began.elapsed()
    }

    /// Begins to exchange letters with one life of another party. Letters that an earlier life has not
    /// taken are lost with it.
    pub fn meet(&mut self, other: Party, life: Life) {
        if self.others.get(&other).is_none_or(|known| known.life != life) {
            let (post, heard) = (Post::default(), self.now());
            self.others.insert(other, Other { life, post, heard });
        }
    }

    /// Ends the exchange with another party; letters that it has not taken are lost.
    pub fn part(&mut self, other: Party) {
        self.others.remove(&other);
    }

    /// Returns the time for which another party that was met has been silent.
    pub fn silent_for(&self, other: Party) -> Option<Duration> {
        let heard = self.others.get(&other)?.heard;
        Some(self.now().saturating_sub(heard))
    }

    /// Returns whether the direct link to another node is deaf: no letter arrives there, and its end has left
    /// questions unanswered for some time.
    pub fn is_deaf(&mut self, member: &Member, within: Duration) -> bool {
        let other = self.others.get(&Party::Node(member.agent));
        let since = other.and_then(|other| other.post.waits_since());
        since.is_some_and(|since| self.now().saturating_sub(since) > SUSPECT)
            && self.wire.is_deaf_to(member, within)
    }

    /// Closes the direct links to all other nodes, and opens them again.
    ///
    /// # Errors
    /// When an endpoint cannot be taken again: everything goes by the server then, and it can be tried once more.
    pub fn reopen(&mut self) -> Result<(), WireError> {
        self.wire.reopen()
    }

    /// Returns whether all letters to all others have come.
    pub fn has_delivered(&self) -> bool {
        self.others.values().all(|other| other.post.has_delivered())
    }

    /// Sends a word that may be lost.
    pub fn note(&mut self, to: Party, word: Word) {
        self.notes(&[to], &word);
    }

    /// Sends a word that may be lost to some parties.
    pub fn notes(&mut self, to: &[Party], word: &Word) {
        let address = |&party: &Party| match self.others.get_mut(&party) {
            Some(other) => other.address(party, None),
            None => Address { party, life: None, received: 0, number: None },
        };
        let to = to.iter().map(address).collect();
        self.fly(to, Some(word));
    }

    /// Sends a word that may be lost to one life of another party, regardless of the life with which it exchanges
    /// letters.
    pub fn reply(&mut self, to: Party, life: Life, word: Word) {
        let address = Address { party: to, life: Some(life), received: 0, number: None };
        self.fly(vec![address], Some(&word));
    }

    /// Sends a word that is repeated until it has come; lost if the other was not met.
    pub fn letter(&mut self, to: Party, word: Word) {
        self.letters(&[to], word);
    }

    /// Sends a word to some parties, to each of which it is repeated until it has come there; lost to those that were
    /// not met.
    pub fn letters(&mut self, to: &[Party], word: Word) {
        let (now, word) = (self.now(), Arc::new(word));
        let mut addresses = Vec::with_capacity(to.len());
        for &party in to {
            let Some(other) = self.others.get_mut(&party) else {
                self.drop_for("stranger");
                continue;
            };
            let number = other.post.send(word.clone(), now);
            addresses.push(other.address(party, Some(number)));
        }
        self.fly(addresses, Some(&word));
    }

    fn fly(&mut self, to: Vec<Address>, word: Option<&Word>) {
        let parties: Vec<Party> = to.iter().map(|address| address.party).collect();
        if parties.is_empty() {
            return;
        }
        let frame = Frame { from: self.me, life: self.life, to, word }.encode();
        self.counts.frames += 1;
        self.counts.bytes += frame.len() as u64;
        self.wire.send(&parties, &frame);
    }

    fn drop_for(&mut self, reason: &'static str) {
        *self.counts.dropped.entry(reason).or_default() += 1;
    }

    /// Sends the frames that are due: letters again, and acknowledgments.
    fn tend(&mut self) {
        let now = self.now();
        let is_due = |other: &Other| other.post.next_due().is_some_and(|at| at <= now);
        let due: Vec<Party> =
            self.others.iter().filter(|(_, other)| is_due(other)).map(|(&who, _)| who).collect();
        for to in due {
            let Some(other) = self.others.get_mut(&to) else { continue };
            let due = other.post.due(now);
            let address = other.address(to, None);
            self.counts.retries += due.again.len() as u64;
            for (number, word) in due.again {
                self.fly(vec![Address { number: Some(number), ..address }], Some(&word));
            }
            if due.acknowledge {
                self.fly(vec![address], None);
            }
        }
    }

    /// Makes the direct links from this node to all others, where there are any.
    ///
    /// # Errors
    /// When an endpoint cannot be taken.
    pub fn join(&mut self, me: EntityId, members: &[Member]) -> Result<(), WireError> {
        self.wire.join(me, members)
    }

    /// Returns the next word that comes within some time; none if none does. Words come in the order in which
    /// their sender has sent them, except for notes. Of parties that were not met, only notes come.
    pub fn receive(&mut self, within: Duration) -> Option<Heard> {
        let until = self.now().saturating_add(within);
        loop {
            self.tend();
            let now = self.now();
            let due = self.others.values().filter_map(|other| other.post.next_due()).min();
            let wait = due.map_or(until, |due| due.min(until)).saturating_sub(now);
            if let Some(bytes) = self.wire.receive(wait) {
                if let Some(heard) = self.hear(&bytes) {
                    return Some(heard);
                }
            } else if self.now() >= until {
                return None;
            }
        }
    }

    fn hear(&mut self, bytes: &[u8]) -> Option<Heard> {
        let frame = match Frame::decode(bytes) {
            Ok(frame) => frame,
            Err(reason) => {
                self.drop_for(reason.word());
                return None;
            }
        };
        let Frame { from, life, to, word } = frame;
        // Where all hear the frames meant for most, some frames are not meant for this party.
        let address = to.into_iter().find(|address| address.party == self.me)?;
        // It is addressed to the process that was here before, with its own numbers of letters.
        if address.life.is_some_and(|to| to != self.life) {
            self.drop_for("former-life");
            return None;
        }
        if let Err(reason) = self.note_of(from, life, &address) {
            self.drop_for(reason);
            return None;
        }
        Some(Heard { from, life, word: word? })
    }

    /// Notes the acknowledgments of a frame; an error is the reason why its word does not count.
    fn note_of(&mut self, from: Party, life: Life, address: &Address) -> Result<(), &'static str> {
        let now = self.now();
        let Some(other) = self.others.get_mut(&from).filter(|other| other.life == life) else {
            return if address.number.is_none() { Ok(()) } else { Err("stranger") };
        };
        other.heard = now;
        if address.life.is_some() {
            other.post.on_received(address.received, now);
        }
        match address.number {
            Some(number) if !other.post.takes(number, now) => Err("out-of-order"),
            _ => Ok(()),
        }
    }
}

/// Returns a number that no other life has.
fn new_life() -> Life {
    // The standard library seeds its hash maps from the system's source of randomness.
    Life(RandomState::new().hash_one(std::process::id()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::memory::Exchange;

    const SOON: Duration = Duration::from_millis(1);
    const LATER: Duration = Duration::from_secs(20);

    /// A wire that loses the first frames on the way to their last receiver.
    struct Lossy {
        wire: Box<dyn Wire>,
        lost: usize,
    }

    impl Wire for Lossy {
        fn send(&mut self, to: &[Party], frame: &[u8]) {
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

    fn mail(exchange: &Exchange, me: Party, lost: usize) -> Mail {
        Mail::new(me, Box::new(Lossy { wire: Box::new(exchange.wire(me)), lost }))
    }

    #[test]
    fn a_letter_whose_frame_is_lost_comes_all_the_same_and_a_note_does_not() {
        let exchange = Exchange::default();
        let (a, b) = (Party::Server, Party::Node(3));
        let (mut first, mut second) = (mail(&exchange, a, 2), mail(&exchange, b, 0));
        first.meet(b, second.life());
        second.meet(a, first.life());
        first.note(b, Word::Hello);
        first.letter(b, Word::End);
        assert_eq!(second.receive(SOON), None, "both frames were lost");
        std::thread::scope(|scope| {
            let sends = scope.spawn(move || {
                while !first.has_delivered() {
                    first.receive(SOON);
                }
                first.counts().retries
            });
            let heard = second.receive(LATER).expect("it is sent again");
            assert_eq!((heard.from, heard.word), (a, Word::End));
            while !sends.is_finished() {
                assert_eq!(second.receive(SOON), None, "it comes once");
            }
            assert!(sends.join().expect("no panic") >= 1);
        });
    }

    #[test]
    fn a_letter_to_several_comes_once_to_each_in_the_order_of_its_own_letters() {
        let exchange = Exchange::default();
        let [a, b, c] = [1, 2, 3].map(Party::Node);
        let mut first = mail(&exchange, a, 0);
        let mut others = [b, c].map(|party| mail(&exchange, party, 0));
        first.meet(b, others[0].life());
        first.letter(b, Word::Hello);
        first.letters(&[b, c], Word::Close(1));
        assert_eq!(first.counts().dropped["stranger"], 1, "one of them was not met");
        first.meet(c, others[1].life());
        first.wire = Box::new(Lossy { wire: Box::new(exchange.wire(a)), lost: 1 });
        first.letters(&[b, c], Word::Close(2));
        for other in &mut others {
            other.meet(a, first.life());
        }
        let mut heard = [Vec::new(), Vec::new()];
        while !first.has_delivered() {
            first.receive(SOON);
            for (other, heard) in others.iter_mut().zip(&mut heard) {
                heard.extend(other.receive(SOON).map(|heard| heard.word));
            }
        }
        assert_eq!(heard[0], [Word::Hello, Word::Close(1), Word::Close(2)]);
        assert_eq!(heard[1], [Word::Close(2)], "lost at first, and sent again");
    }

    #[test]
    fn frames_to_an_earlier_life_and_letters_of_strangers_are_dropped_and_counted() {
        let exchange = Exchange::default();
        let (a, b) = (Party::Server, Party::Node(3));
        let (mut first, mut second) = (mail(&exchange, a, 0), mail(&exchange, b, 0));
        first.meet(b, Life(17));
        first.letter(b, Word::End);
        assert_eq!(second.receive(SOON), None);
        assert_eq!(second.counts().dropped["former-life"], 1);
        let life = second.life();
        first.meet(b, life);
        first.letter(b, Word::End);
        assert_eq!(second.receive(SOON), None, "it has not met the server");
        assert_eq!(second.counts().dropped["stranger"], 1);
        exchange.wire(Party::Node(9)).send(&[b], b"something else");
        assert_eq!(second.receive(SOON), None);
        assert_eq!(second.counts().dropped["foreign"], 1);
    }
}
