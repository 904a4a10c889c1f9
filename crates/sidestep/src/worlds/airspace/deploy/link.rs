//! What an agent needs to talk over a network that loses, delays, doubles and reorders messages.
//!
//! Every agent says all it says to all the others of its group. An [`Endpoint`] numbers what its
//! agent says and keeps it; whoever misses something asks for it again. One that does not answer
//! although it was asked [`TRIES`] times is given up for this talk: the agent goes on with what
//! it knows of it. So nobody waits for ever, and a loss costs time instead of agreement.
//!
//! Endpoints and agents are state machines without input or output of their own.

use super::network::Ended;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// How often somebody is asked before it is given up.
const TRIES: u32 = 8;

/// An agent as a state machine: messages in, messages to all others out. Others are known by
/// their place in the group.
pub(super) trait Agent {
    /// What it sends and receives.
    type Message: Serialize + DeserializeOwned;
    /// What it comes to.
    type Outcome;

    /// What it says before it has heard anything.
    fn start(&mut self) -> Vec<Self::Message>;

    /// Takes a message of agent `from`, and says what it has to say then. Messages come in any
    /// order, each once.
    fn on_message(&mut self, from: usize, message: Self::Message) -> Vec<Self::Message>;

    /// Whose messages it needs in order to go on.
    fn awaits(&self) -> Vec<usize>;

    /// Nothing more will come of agent `other`: goes on with what is known of it.
    fn without(&mut self, other: usize) -> Vec<Self::Message>;

    /// Time is up: makes the best of what it knows.
    fn at_deadline(&mut self);

    /// What it has come to, when it has.
    fn outcome(&self) -> Option<Self::Outcome>;
}

/// What goes over the wire.
#[derive(Debug, Serialize, Deserialize)]
enum Packet<M> {
    /// The message of this number of the sender's.
    Said(u32, M),
    /// "Say again whatever you have said from this number on."
    Ask(u32),
    /// "I have said no more than that yet."
    Wait,
    /// "I have said no more than that, and shall not."
    Done,
}

/// A packet on its way out, to one other or to all.
#[derive(Debug)]
pub(super) struct Outgoing {
    pub(super) to: Option<usize>,
    pub(super) payload: Vec<u8>,
}

/// An agent with all that makes its messages arrive.
#[derive(Debug)]
pub(super) struct Endpoint<A> {
    agent: A,
    me: usize,
    /// What it has said, serialized, by number.
    said: Vec<Vec<u8>>,
    others: Vec<Other>,
    /// Ticks without anything new after which it asks.
    patience: u64,
    quiet_since: u64,
    late: bool,
}

/// What an endpoint knows of another one.
#[derive(Debug, Clone, Default)]
struct Other {
    /// All messages below this number have come,
    next: u32,
    /// and these.
    early: BTreeSet<u32>,
    unanswered: u32,
    gone: bool,
    unheard: bool,
}

impl Other {
    /// Whether a number is new.
    fn takes(&mut self, number: u32) -> bool {
        let is_new = number >= self.next && self.early.insert(number);
        while self.early.remove(&self.next) {
            self.next += 1;
        }
        is_new
    }
}

/// A packet as it goes over the wire.
pub(super) fn bytes_of<M: Serialize>(message: &M) -> Vec<u8> {
    postcard::to_stdvec(message).expect("messages are plain data")
}

impl<A: Agent> Endpoint<A> {
    /// The endpoint of agent `me` of a group, and its first packets.
    pub(super) fn new(
        mut agent: A,
        (me, group): (usize, usize),
        patience: u64,
        tick: u64,
    ) -> (Self, Vec<Outgoing>) {
        let first = agent.start();
        let others = vec![Other::default(); group];
        let mut endpoint =
            Self { agent, me, said: Vec::new(), others, patience, quiet_since: tick, late: false };
        let said = endpoint.say(first);
        (endpoint, said)
    }

    fn say(&mut self, messages: Vec<A::Message>) -> Vec<Outgoing> {
        let mut out = Vec::with_capacity(messages.len());
        for message in messages {
            let payload = bytes_of(&Packet::Said(self.said.len() as u32, message));
            self.said.push(payload.clone());
            out.push(Outgoing { to: None, payload });
        }
        out
    }

    /// Takes a packet. One that cannot be read is as good as lost.
    pub(super) fn on_packet(&mut self, from: usize, bytes: &[u8], tick: u64) -> Vec<Outgoing> {
        let Ok(packet) = postcard::from_bytes::<Packet<A::Message>>(bytes) else {
            return Vec::new();
        };
        self.others[from].unanswered = 0;
        match packet {
            Packet::Said(number, message) if self.others[from].takes(number) => {
                self.quiet_since = tick;
                let said = self.agent.on_message(from, message);
                self.say(said)
            }
            Packet::Said(..) | Packet::Wait => Vec::new(),
            Packet::Ask(number) => self.answer(from, number),
            // Whoever says so was asked for what had not come: all of it has come.
            Packet::Done => self.go_on_without(from),
        }
    }

    fn answer(&self, to: usize, from_number: u32) -> Vec<Outgoing> {
        let missing = self.said.get(from_number as usize..).unwrap_or_default();
        let again = |payload: &Vec<u8>| Outgoing { to: Some(to), payload: payload.clone() };
        if !missing.is_empty() {
            return missing.iter().map(again).collect();
        }
        let nothing = if self.is_done() { Packet::<A::Message>::Done } else { Packet::Wait };
        vec![again(&bytes_of(&nothing))]
    }

    fn go_on_without(&mut self, other: usize) -> Vec<Outgoing> {
        if self.others[other].gone {
            return Vec::new();
        }
        self.others[other].gone = true;
        let said = self.agent.without(other);
        self.say(said)
    }

    /// Asks whom it waits for, if it has waited long enough, and gives up who never answers.
    pub(super) fn on_timer(&mut self, tick: u64) -> Vec<Outgoing> {
        if self.next_timer().is_none_or(|due| due > tick) {
            return Vec::new();
        }
        self.quiet_since = tick;
        let mut out = Vec::new();
        for j in self.agent.awaits() {
            let other = &mut self.others[j];
            if other.unanswered < TRIES {
                other.unanswered += 1;
                let payload = bytes_of(&Packet::<A::Message>::Ask(other.next));
                out.push(Outgoing { to: Some(j), payload });
            } else {
                other.unheard = true;
                out.extend(self.go_on_without(j));
            }
        }
        out
    }

    /// The tick in which its patience ends.
    pub(super) fn next_timer(&self) -> Option<u64> {
        (!self.is_done()).then(|| self.quiet_since.saturating_add(self.patience))
    }

    /// Nobody hears it, and it hears nobody.
    pub(super) fn is_alone(&mut self) {
        let me = self.me;
        for j in (0..self.others.len()).filter(|&j| j != me) {
            self.others[j].unheard = true;
            self.go_on_without(j);
        }
    }

    pub(super) fn is_done(&self) -> bool {
        self.agent.outcome().is_some()
    }

    /// The end of the talk.
    pub(super) fn end(mut self) -> Ended<A::Outcome> {
        if !self.is_done() {
            self.late = true;
            self.agent.at_deadline();
        }
        let unheard = (0..self.others.len()).filter(|&j| self.others[j].unheard).collect();
        Ended { outcome: self.agent.outcome(), unheard, late: self.late }
    }
}
