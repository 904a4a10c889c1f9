//! The network of the agents, in memory: what may go wrong on it, and what it has carried.
//!
//! Time on it goes by in ticks: a message takes one, or more when it is delayed. Every draw
//! depends on who sends to whom in which tick, never on the order in which agents are looked at.

use super::super::world::purpose;
use super::link::{Agent, Endpoint, Outgoing, Patience};
use serde::{Deserialize, Serialize};
use sidestep_kernel::ports::{Envelope, Faults, MemoryTransport, Transport};
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{Cycle, EntityId, math};

/// What went over the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Traffic {
    /// Messages, one per receiver; of a coordinator, its migrations.
    pub messages: u64,
    /// Messages if one could reach all.
    pub multicasts: u64,
    /// Bytes of the messages, in their serialized form.
    pub bytes: u64,
    /// Bytes if one message could reach all.
    pub multicast_bytes: u64,
}

impl Traffic {
    /// Adds other traffic.
    pub fn add(&mut self, other: Self) {
        self.messages += other.messages;
        self.multicasts += other.multicasts;
        self.bytes += other.bytes;
        self.multicast_bytes += other.multicast_bytes;
    }

    /// Counts a message to `receivers` others.
    pub(super) fn count(&mut self, receivers: usize, bytes: usize) {
        self.messages += receivers as u64;
        self.multicasts += 1;
        self.bytes += (receivers * bytes) as u64;
        self.multicast_bytes += bytes as u64;
    }
}

/// A network that is not to be relied on.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Probability that a message is lost on its way to a receiver.
    pub loss: f64,
    /// Probability that it arrives twice.
    pub duplication: f64,
    /// Time that every message takes: one tick.
    pub latency_s: f64,
    /// Further delay at most, drawn uniformly: messages overtake each other.
    pub max_delay_s: f64,
    /// An agent that has heard nothing new for so long asks those it waits for.
    pub patience_s: f64,
    /// An optimization ends after this, and so does what the shield exchanges after it.
    pub deadline_s: f64,
    /// Whose radio is dead, and when.
    pub silences: Vec<Silence>,
}

/// An airplane whose radio is dead for a while: it sends nothing, it hears nothing, and it knows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Silence {
    /// Its id.
    pub airplane: EntityId,
    /// From when on, seconds after the start.
    #[serde(default)]
    pub from_s: f64,
    /// Until when; for ever, if not said.
    #[serde(default = "for_ever")]
    pub until_s: f64,
}

fn for_ever() -> f64 {
    f64::INFINITY
}

impl Network {
    /// Whether an airplane is silent at a time.
    pub fn is_silent(&self, id: EntityId, at_s: f64) -> bool {
        let now = |s: &&Silence| s.from_s <= at_s && at_s < s.until_s;
        self.silences.iter().filter(now).any(|s| s.airplane == id)
    }

    fn ticks(&self, seconds: f64) -> u64 {
        (seconds / self.latency_s).round().max(1.0) as u64
    }

    pub(super) fn deadline_ticks(&self) -> u64 {
        self.ticks(self.deadline_s)
    }

    /// How long and how often somebody is asked: whoever is silent is given up in a quarter of
    /// the time, so that enough is left to go on without it.
    pub(super) fn patience(&self) -> Patience {
        let tries = (self.deadline_s / (4.0 * self.patience_s)).clamp(2.0, 12.0) as u32;
        Patience { ticks: self.ticks(self.patience_s), tries }
    }

    /// Talks in a row without a word from somebody after which its radio is taken to be dead:
    /// at least three, and so many that the chance is below 1e-12 that all it has said was lost,
    /// and all questions to it or the answers.
    pub(super) fn silent_after(&self) -> u32 {
        const CHANCE: f64 = 1e-12;
        let unanswered = 1.0 - (1.0 - self.loss) * (1.0 - self.loss);
        let tries = f64::from(self.patience().tries);
        // In the first of these talks all questions are asked, and one in each later one.
        let first = math::ln(self.loss) + tries * math::ln(unanswered);
        let later = math::ln(self.loss * unanswered);
        let talks = 1.0 + ((math::ln(CHANCE) - first) / later).ceil().max(0.0);
        // Without losses the logarithms are infinite, and three talks are enough.
        if talks.is_finite() { (talks as u32).max(3) } else { 3 }
    }

    pub(super) fn faults(&self) -> Faults {
        Faults {
            loss: self.loss,
            duplication: self.duplication,
            max_delay_cycles: (self.max_delay_s / self.latency_s).round() as u32,
        }
    }
}

/// What agents talk about in a `dt`, one after the other: each has ticks of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Topic {
    /// What to do.
    Optimization,
    /// Whether that is safe.
    Shield,
}

/// A network for one talk of a group.
#[derive(Debug, Clone, Copy)]
pub(super) struct Talk<'a> {
    /// `None`: it loses nothing, and agents wait for each other as long as it takes.
    pub(super) network: Option<&'a Network>,
    pub(super) streams: Streams,
    pub(super) topic: Topic,
    pub(super) now: Cycle,
    pub(super) at_s: f64,
}

impl Talk<'_> {
    /// The tick in which the talk begins, and the one in which it ends at the latest.
    pub(super) fn ticks(&self) -> (u64, u64) {
        let Some(network) = self.network else { return (0, u64::MAX) };
        let long = network.deadline_ticks();
        let talk = 2 * self.now + self.topic as u64;
        (talk * (long + 1), talk * (long + 1) + long)
    }

    pub(super) fn is_silent(&self, id: EntityId) -> bool {
        self.network.is_some_and(|network| network.is_silent(id, self.at_s))
    }
}

/// How a talk has ended for one agent.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ended<O> {
    /// What it has come to, if anything.
    pub(super) outcome: Option<O>,
    /// The others, by place, of whom it has heard nothing in spite of asking.
    pub(super) unheard: Vec<usize>,
    /// Whether time was up before it was done.
    pub(super) late: bool,
}

/// Lets agents talk until all are done or time is up; `ids[i]` is whose agent `agents[i]` is.
pub(super) fn run<A: Agent>(
    talk: &Talk<'_>,
    ids: &[EntityId],
    agents: Vec<A>,
) -> (Vec<Ended<A::Outcome>>, Traffic) {
    let (begin, end) = talk.ticks();
    let faults = talk.network.map(Network::faults).unwrap_or_default();
    let for_ever = Patience { ticks: u64::MAX, tries: 1 };
    let patience = talk.network.map_or(for_ever, Network::patience);
    let mut post = Post {
        ids,
        silent: ids.iter().map(|&id| talk.is_silent(id)).collect(),
        transport: MemoryTransport::new(talk.streams, purpose::NETWORK, faults),
        traffic: Traffic::default(),
        sent: vec![0; ids.len()],
        tick: begin,
    };
    let mut endpoints: Vec<Endpoint<A>> = Vec::with_capacity(agents.len());
    for (i, agent) in agents.into_iter().enumerate() {
        let (endpoint, said) = Endpoint::new(agent, (i, ids.len()), patience, begin);
        endpoints.push(endpoint);
        post.send(i, said);
    }
    for i in (0..ids.len()).filter(|&i| post.silent[i]) {
        // It knows that nobody hears it.
        endpoints[i].is_alone();
    }
    while !endpoints.iter().all(Endpoint::is_done) {
        let timers = endpoints.iter().filter_map(Endpoint::next_timer);
        let next = timers.chain(post.transport.next_arrival()).min().unwrap_or(end);
        if next >= end {
            break;
        }
        post.tick = next;
        for (i, endpoint) in endpoints.iter_mut().enumerate() {
            for envelope in post.transport.receive(ids[i], next) {
                let from = ids.binary_search(&envelope.sender).expect("a member of the group");
                let said = endpoint.on_packet(from, &envelope.payload, next);
                post.send(i, said);
            }
            let said = endpoint.on_timer(next);
            post.send(i, said);
        }
    }
    (endpoints.into_iter().map(Endpoint::end).collect(), post.traffic)
}

/// Hands packets to the network, and counts them.
struct Post<'a> {
    ids: &'a [EntityId],
    silent: Vec<bool>,
    transport: MemoryTransport,
    traffic: Traffic,
    /// Packets sent so far, by place: what tells those of one tick apart.
    sent: Vec<u32>,
    tick: u64,
}

impl Post<'_> {
    fn send(&mut self, from: usize, said: Vec<Outgoing>) {
        for Outgoing { to, payload } in said {
            if self.silent[from] {
                continue;
            }
            let receivers = match to {
                Some(place) => place..place + 1,
                None => 0..self.ids.len(),
            };
            let n = if to.is_some() { 1 } else { self.ids.len() - 1 };
            self.traffic.count(n, payload.len());
            for place in receivers.filter(|&place| place != from) {
                if !self.silent[place] {
                    self.transport.send(Envelope {
                        cycle: self.tick,
                        sender: self.ids[from],
                        sequence: self.sent[from],
                        receiver: self.ids[place],
                        payload: payload.clone(),
                    });
                }
            }
            self.sent[from] += 1;
        }
    }
}
