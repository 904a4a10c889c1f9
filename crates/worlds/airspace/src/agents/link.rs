//! Talking over a network that loses, delays, doubles and reorders messages.
//!
//! Every agent sends all its messages to all the others of its group. An [`Endpoint`] numbers its
//! agent's messages and keeps them; an endpoint that misses one asks for it again. One that does
//! not answer, although asked so often that it can hardly be alive and in touch, or until the time
//! for this step is up, is given up for this talk: the agent goes on with its knowledge of it. One
//! that was not heard in the talk before is asked less often. So nobody waits for ever, and a loss
//! costs time instead of agreement.
//!
//! Endpoints and agents are state machines without a clock or a network of their own: the tick and
//! the [`Transport`] are handed in.

use super::network::{Patience, Traffic};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sidestep_kernel::EntityId;
use sidestep_kernel::ports::{Envelope, Transport};
use std::collections::BTreeSet;
use std::sync::Arc;

/// An agent as a state machine: messages in, messages to all others out. Others are known by their
/// place in the group.
pub trait Agent {
    /// Type of the messages that it sends and receives.
    type Message: Serialize + DeserializeOwned;
    /// Type of its outcome.
    type Outcome;

    /// Returns its messages before it has heard anything.
    fn start(&mut self) -> Vec<Self::Message>;

    /// Takes a message of agent `from`, and returns its own messages in response. Messages come in
    /// any order, each once.
    fn on_message(&mut self, from: usize, message: Self::Message) -> Vec<Self::Message>;

    /// Returns the places of those whose messages it needs in order to go on.
    fn awaits(&self) -> Vec<usize>;

    /// Returns whether an answer of agent `other` can be expected.
    fn expects(&self, _other: usize) -> bool {
        true
    }

    /// Returns the part of the talk, from 0 to 1, after which it goes on without those that it
    /// waits for now.
    fn waits_until(&self) -> f64 {
        1.0
    }

    /// Goes on without agent `other`, from which nothing more will come. The other is settled if it
    /// has ended regularly, rather than fallen silent.
    fn without(&mut self, other: usize, is_settled: bool) -> Vec<Self::Message>;

    /// Ends because time is up, with the best outcome from what it knows.
    fn at_deadline(&mut self);

    /// Returns its outcome, if it has one.
    fn outcome(&self) -> Option<Self::Outcome>;
}

/// A packet on the wire.
#[derive(Debug, Serialize, Deserialize)]
enum Packet<M> {
    /// A message, with its number among the sender's.
    Said(u32, M),
    /// "Send again all your messages from this number on."
    Ask(u32),
    /// "I have not sent more than that yet."
    Wait,
    /// "I have not sent more than that, and shall not."
    Done,
}

/// A packet on its way out, to one other or to all.
#[derive(Debug)]
struct Outgoing {
    to: Option<usize>,
    payload: Vec<u8>,
}

/// Settings of an endpoint.
#[derive(Debug, Clone)]
pub struct Radio {
    /// Ids of the group, rising.
    pub group: Arc<[EntityId]>,
    /// Place of its airplane in the group.
    pub me: usize,
    /// The time that it waits for others.
    pub patience: Patience,
    /// Number of ticks after which the talk ends.
    pub ticks: u64,
    /// Whether the radio is dead: it sends nothing, hears nothing, and knows it.
    pub is_silent: bool,
}

/// An agent with all that makes its messages arrive.
#[derive(Debug)]
pub struct Endpoint<A> {
    agent: A,
    radio: Radio,
    /// Its messages so far, serialized, by number.
    said: Vec<Vec<u8>>,
    others: Vec<Other>,
    began: u64,
    quiet_since: u64,
    /// Size of the largest packet that it has sent or heard, in bytes.
    largest: usize,
    late: bool,
    /// Number of packets sent so far, which distinguishes those of one tick.
    sent: u32,
    traffic: Traffic,
}

/// An endpoint's knowledge of another one.
#[derive(Debug, Clone, Default)]
struct Other {
    /// All messages below this number have come.
    next: u32,
    /// Later messages that have come out of order.
    early: BTreeSet<u32>,
    unanswered: u32,
    /// Whether anything has come from it in this talk.
    is_there: bool,
    gone: bool,
    unheard: bool,
}

impl Other {
    /// Returns whether a number is new.
    fn takes(&mut self, number: u32) -> bool {
        let is_new = number >= self.next && self.early.insert(number);
        while self.early.remove(&self.next) {
            self.next += 1;
        }
        is_new
    }
}

/// Returns a packet in the form in which it travels.
pub(crate) fn bytes_of<M: Serialize>(message: &M) -> Vec<u8> {
    postcard::to_stdvec(message).expect("messages are plain data")
}

/// The end of a talk for one agent.
#[derive(Debug, Clone, PartialEq)]
pub struct Ended<O> {
    /// Its outcome, if it has one.
    pub outcome: Option<O>,
    /// The others, by place, that it has not heard in spite of asking.
    pub unheard: Vec<usize>,
    /// Whether time was up before it was done.
    pub late: bool,
}

impl<A: Agent> Endpoint<A> {
    /// Returns an endpoint whose agent has not sent anything yet.
    pub fn new(agent: A, radio: Radio) -> Self {
        let others = vec![Other::default(); radio.group.len()];
        Self {
            agent,
            radio,
            said: Vec::new(),
            others,
            began: 0,
            quiet_since: 0,
            largest: 0,
            late: false,
            sent: 0,
            traffic: Traffic::default(),
        }
    }

    /// Sends the messages that the agent has before it hears anything.
    pub fn start(&mut self, transport: &mut dyn Transport, tick: u64) {
        (self.began, self.quiet_since) = (tick, tick);
        let first = self.agent.start();
        let said = self.say(first);
        if self.radio.is_silent {
            self.is_alone();
        }
        self.send(transport, tick, said);
    }

    /// Takes the packets that have arrived by a tick, and sends the agent's responses.
    pub fn step(&mut self, transport: &mut dyn Transport, tick: u64) {
        for envelope in transport.receive(self.radio.group[self.radio.me], tick) {
            let sender = self.radio.group.binary_search(&envelope.sender);
            // Senders outside the group are ignored.
            let Some(from) = sender.ok().filter(|_| !self.radio.is_silent) else { continue };
            let said = self.on_packet(from, &envelope.payload, tick);
            self.send(transport, tick, said);
        }
        let said = self.on_timer(tick);
        self.send(transport, tick, said);
    }

    /// Hands packets to the network, and counts them.
    fn send(&mut self, transport: &mut dyn Transport, tick: u64, said: Vec<Outgoing>) {
        let Radio { group, me, is_silent, .. } = &self.radio;
        for Outgoing { to, payload } in said.into_iter().filter(|_| !is_silent) {
            let receivers: Vec<usize> = match to {
                Some(place) => vec![place],
                None => (0..group.len()).filter(|place| place != me).collect(),
            };
            self.traffic.count(receivers.len(), payload.len());
            self.largest = self.largest.max(payload.len());
            for place in receivers {
                transport.send(Envelope {
                    cycle: tick,
                    sender: group[*me],
                    sequence: self.sent,
                    receiver: group[place],
                    payload: payload.clone(),
                });
            }
            self.sent += 1;
        }
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

    /// Takes a packet. One that cannot be read counts as lost.
    fn on_packet(&mut self, from: usize, bytes: &[u8], tick: u64) -> Vec<Outgoing> {
        let Ok(packet) = postcard::from_bytes::<Packet<A::Message>>(bytes) else {
            return Vec::new();
        };
        (self.others[from].unanswered, self.others[from].is_there) = (0, true);
        self.largest = self.largest.max(bytes.len());
        match packet {
            Packet::Said(number, message) if self.others[from].takes(number) => {
                self.quiet_since = tick;
                let said = self.agent.on_message(from, message);
                self.say(said)
            }
            Packet::Said(..) | Packet::Wait => Vec::new(),
            Packet::Ask(number) => self.answer(from, number),
            // This answers a question for missing messages, so all of them have come.
            Packet::Done => self.go_on_without(from, true),
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

    fn go_on_without(&mut self, other: usize, is_settled: bool) -> Vec<Outgoing> {
        if self.others[other].gone {
            return Vec::new();
        }
        self.others[other].gone = true;
        let said = self.agent.without(other, is_settled);
        self.say(said)
    }

    /// Asks those that it waits for, if it has waited long enough, and gives up those that never
    /// answer.
    fn on_timer(&mut self, tick: u64) -> Vec<Outgoing> {
        if self.next_timer().is_none_or(|due| due > tick) {
            return Vec::new();
        }
        self.quiet_since = tick;
        let mut out = Vec::new();
        let waited = (tick - self.began) as f64;
        let has_time = waited < self.agent.waits_until() * self.radio.ticks as f64;
        for j in self.agent.awaits() {
            let Patience { tries, first_tries, .. } = self.radio.patience;
            let is_expected = self.others[j].is_there || self.agent.expects(j);
            let tries = if is_expected { tries } else { first_tries };
            let other = &mut self.others[j];
            if other.unanswered < tries && has_time {
                other.unanswered += 1;
                let payload = bytes_of(&Packet::<A::Message>::Ask(other.next));
                out.push(Outgoing { to: Some(j), payload });
            } else {
                other.unheard = true;
                out.extend(self.go_on_without(j, false));
            }
        }
        out
    }

    /// Returns the tick in which its patience ends.
    pub fn next_timer(&self) -> Option<u64> {
        let ticks = self.radio.patience.ticks_for(self.largest);
        (!self.is_done()).then(|| self.quiet_since.saturating_add(ticks))
    }

    /// Ends the talk of an airplane that nobody hears and that hears nobody.
    fn is_alone(&mut self) {
        let me = self.radio.me;
        for j in (0..self.others.len()).filter(|&j| j != me) {
            self.others[j].unheard = true;
            self.go_on_without(j, false);
        }
    }

    /// Returns whether its agent has ended.
    pub fn is_done(&self) -> bool {
        self.agent.outcome().is_some()
    }

    /// Returns the count of its messages so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// Returns the end of the talk.
    pub fn end(mut self) -> Ended<A::Outcome> {
        if !self.is_done() {
            self.late = true;
            self.agent.at_deadline();
        }
        let unheard = (0..self.others.len()).filter(|&j| self.others[j].unheard).collect();
        Ended { outcome: self.agent.outcome(), unheard, late: self.late }
    }
}
