//! Messages between agents, in lockstep with the cycle.
//!
//! An agent sends envelopes in one cycle and receives those that reached it in a later one, sorted
//! by (cycle, sender, sequence), so that the order of arrival never matters (promise D2). The
//! in-memory version can lose, delay and duplicate messages, all drawn from the run's streams.

use crate::distr::Bernoulli;
use crate::stream::{Purpose, Streams};
use crate::units::{Cycle, EntityId};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One message. Its first three fields come first because receivers sort messages by them.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Envelope {
    /// Cycle in which it was sent.
    pub cycle: Cycle,
    /// Id of the agent that sends it.
    pub sender: EntityId,
    /// Number of the message among the sender's in that cycle.
    pub sequence: u32,
    /// The one receiver: a message to several is sent to each.
    pub receiver: EntityId,
    /// The content, serialized.
    pub payload: Vec<u8>,
}

/// Delivers envelopes, none of them in the cycle of sending.
pub trait Transport {
    /// Sends a message, which may be received from the next cycle on.
    fn send(&mut self, envelope: Envelope);

    /// Returns the messages that have reached `receiver` by cycle `now` and were not received
    /// before, sorted.
    fn receive(&mut self, receiver: EntityId, now: Cycle) -> Vec<Envelope>;

    /// Returns the first cycle in which a message in transit arrives; `None` if there is none, or
    /// if the transport cannot know, as one between processes cannot.
    fn next_arrival(&self) -> Option<Cycle>;
}

/// The faults of a network; the default is a network without any.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NetworkFaults {
    /// Probability that a message is lost.
    pub loss: f64,
    /// Probability that a message arrives twice.
    pub duplication: f64,
    /// The maximum of additional cycles that a message takes, beyond 1; drawn uniformly.
    pub max_delay_cycles: u32,
}

impl Default for NetworkFaults {
    fn default() -> Self {
        Self { loss: 0.0, duplication: 0.0, max_delay_cycles: 0 }
    }
}

/// The in-memory transport, which counts the messages it carries.
#[derive(Debug)]
pub struct MemoryTransport {
    streams: Streams,
    purpose: Purpose,
    faults: NetworkFaults,
    /// Envelopes by receiver, then by the cycle of arrival.
    waiting: BTreeMap<(EntityId, Cycle), Vec<Envelope>>,
    /// Messages sent so far, lost ones included.
    pub messages: u64,
    /// Bytes of their payloads, without headers.
    pub bytes: u64,
}

impl MemoryTransport {
    /// Creates an empty network with these faults, drawn for `purpose`.
    pub fn new(streams: Streams, purpose: Purpose, faults: NetworkFaults) -> Self {
        Self { streams, purpose, faults, waiting: BTreeMap::new(), messages: 0, bytes: 0 }
    }

    fn schedule_arrival(&mut self, envelope: Envelope, delay_word: u32) {
        let choices = u64::from(self.faults.max_delay_cycles) + 1;
        // The high half of the product is uniform in `0..choices`, without a division.
        let delay_cycles = (u64::from(delay_word) * choices) >> 32;
        let arrival = (envelope.receiver, envelope.cycle + 1 + delay_cycles);
        self.waiting.entry(arrival).or_default().push(envelope);
    }
}

impl Transport for MemoryTransport {
    fn send(&mut self, envelope: Envelope) {
        self.messages += 1;
        self.bytes += envelope.payload.len() as u64;
        let Envelope { cycle, sender, sequence, receiver, .. } = envelope;
        let words = self.streams.words_for_pair(sender, receiver, cycle, self.purpose, sequence);
        if Bernoulli::new(self.faults.loss).sample(words[0]) {
            return;
        }
        if Bernoulli::new(self.faults.duplication).sample(words[1]) {
            // The duplicate has a delay of its own.
            self.schedule_arrival(envelope.clone(), words[3]);
        }
        self.schedule_arrival(envelope, words[2]);
    }

    fn receive(&mut self, receiver: EntityId, now: Cycle) -> Vec<Envelope> {
        let due: Vec<_> =
            self.waiting.range((receiver, 0)..=(receiver, now)).map(|(&key, _)| key).collect();
        let mut arrived: Vec<_> =
            due.iter().flat_map(|key| self.waiting.remove(key).unwrap_or_default()).collect();
        arrived.sort_unstable();
        arrived
    }

    fn next_arrival(&self) -> Option<Cycle> {
        self.waiting.keys().map(|&(_, arrival)| arrival).min()
    }
}

/// Checks the guarantees of a faultless [`Transport`].
///
/// # Panics
/// When a guarantee is broken.
pub fn check_conformance(transport: &mut impl Transport) {
    let envelope = |cycle, sender, sequence, receiver| Envelope {
        cycle,
        sender,
        sequence,
        receiver,
        payload: vec![sequence as u8; 3],
    };
    for (sender, sequence) in [(2, 1), (2, 0), (1, 0), (3, 0)] {
        transport.send(envelope(5, sender, sequence, 9));
    }
    transport.send(envelope(5, 1, 1, 8));
    assert_eq!(transport.receive(9, 5), [], "nothing arrives in the cycle of sending");
    assert!(transport.next_arrival().is_none_or(|at| at == 6), "if it knows, it is right");
    let expected =
        [envelope(5, 1, 0, 9), envelope(5, 2, 0, 9), envelope(5, 2, 1, 9), envelope(5, 3, 0, 9)];
    assert_eq!(transport.receive(9, 6), expected, "sorted by (cycle, sender, sequence)");
    assert_eq!(transport.receive(9, 7), [], "each message is received once");
    assert_eq!(transport.receive(8, 9), [envelope(5, 1, 1, 8)], "messages wait");
    assert_eq!(transport.next_arrival(), None, "everything was received");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Seed;

    fn network(faults: NetworkFaults) -> MemoryTransport {
        MemoryTransport::new(Streams::new(Seed(1)), Purpose(9), faults)
    }

    #[test]
    fn the_memory_transport_conforms_and_counts() {
        let mut transport = network(NetworkFaults::default());
        check_conformance(&mut transport);
        assert_eq!((transport.messages, transport.bytes), (5, 15));
        let payload = Vec::new();
        transport.send(Envelope { cycle: 7, sender: 1, sequence: 0, receiver: 2, payload });
        assert_eq!(transport.next_arrival(), Some(8));
    }

    #[test]
    fn faults_happen_as_often_as_stated() {
        let n = 10_000;
        let mut transport =
            network(NetworkFaults { loss: 0.1, duplication: 0.05, max_delay_cycles: 3 });
        for sequence in 0..n {
            let payload = Vec::new();
            transport.send(Envelope { cycle: 0, sender: 1, sequence, receiver: 2, payload });
        }
        let by_cycle: Vec<usize> = (1..=5).map(|t| transport.receive(2, t).len()).collect();
        let arrived: usize = by_cycle.iter().sum();
        // Expected 0.9 * 1.05 * n = 9450; five standard deviations are about 190.
        assert!((9260..=9640).contains(&arrived), "{arrived} arrived");
        assert!(by_cycle[..4].iter().all(|&k| (2200..2550).contains(&k)), "{by_cycle:?}");
        assert_eq!(by_cycle[4], 0);
    }
}
