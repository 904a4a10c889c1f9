//! A network in memory, in lockstep, that counts what it carries.

use super::Decided;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

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

/// An agent as a state machine: messages in, messages to all others out.
pub(super) trait Agent {
    /// What it sends and receives.
    type Message: Serialize + DeserializeOwned;

    /// What it says before it has heard anything.
    fn start(&mut self) -> Vec<Self::Message>;

    /// Takes a message of agent `from`, and says what it has to say to all others then.
    fn on_message(&mut self, from: usize, message: Self::Message) -> Vec<Self::Message>;

    /// What it has decided, when it has.
    fn decided(&self) -> Option<Decided>;
}

/// Runs agents until all have decided.
///
/// # Panics
/// When they fall silent undecided, which is a bug on a network that loses nothing.
pub(super) fn run<A: Agent>(mut agents: Vec<A>) -> (Vec<Decided>, Traffic) {
    let mut traffic = Traffic::default();
    let mut sent: Vec<(usize, Vec<u8>)> = Vec::new();
    for (i, agent) in agents.iter_mut().enumerate() {
        post(i, agent.start(), &mut sent);
    }
    while !sent.is_empty() {
        let mut next = Vec::new();
        for (from, bytes) in std::mem::take(&mut sent) {
            traffic.count(agents.len() - 1, bytes.len());
            for (i, agent) in agents.iter_mut().enumerate().filter(|(i, _)| *i != from) {
                // Each reads for itself, as it would on a network: that is part of its time.
                let message = postcard::from_bytes(&bytes).expect("what was sent can be read");
                post(i, agent.on_message(from, message), &mut next);
            }
        }
        sent = next;
    }
    let decided = agents.iter().map(|a| a.decided().expect("everybody decides")).collect();
    (decided, traffic)
}

fn post<M: Serialize>(from: usize, messages: Vec<M>, sent: &mut Vec<(usize, Vec<u8>)>) {
    sent.extend(messages.iter().map(|m| (from, bytes_of(m))));
}

/// A message as it goes over the wire.
pub(super) fn bytes_of<M: Serialize>(message: &M) -> Vec<u8> {
    postcard::to_stdvec(message).expect("messages are plain data")
}
