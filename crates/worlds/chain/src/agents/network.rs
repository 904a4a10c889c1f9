//! The network of the agents: its faults, and the traffic on it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sidestep_kernel::ports::Faults;
use sidestep_kernel::{EntityId, math};

/// Chance of giving up a neighbor that is in touch.
const GIVEN_UP: f64 = 1e-9;
/// The same for one that was not heard in the cycle before: a miss is no worse than that one was.
const MISSED: f64 = 0.1;

/// Messages and bytes that went over the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Traffic {
    /// Number of packets.
    pub messages: u64,
    /// Number of their bytes, in their serialized form.
    pub bytes: u64,
    /// Number of packets that came and were dropped, because they could not be read or made no sense.
    pub dropped: u64,
}

impl Traffic {
    /// Counts a packet.
    pub(super) fn count(&mut self, bytes: usize) {
        self.messages += 1;
        self.bytes += bytes as u64;
    }
}

/// A while in which a connector's radio is dead: it sends nothing, hears nothing, and knows it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Silence {
    /// Number of the connector in its chain.
    pub(crate) connector: u32,
    /// Number of the chain.
    #[serde(default)]
    pub(crate) chain: EntityId,
    /// Start of the silence, in seconds after the start of the run.
    #[serde(default)]
    pub(crate) from_s: f64,
    /// End of the silence, in seconds after the start of the run; infinite unless given.
    #[serde(default = "for_ever")]
    pub(crate) until_s: f64,
}

/// A while in which a link between two neighbors works one way only.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct OneWay {
    /// Number of the connector that is heard by the other.
    pub(crate) sender: u32,
    /// Number of its neighbor, whose messages do not reach it.
    pub(crate) receiver: u32,
    /// Number of the chain.
    #[serde(default)]
    pub(crate) chain: EntityId,
    /// Start of that while, in seconds after the start of the run.
    #[serde(default)]
    pub(crate) from_s: f64,
    /// End of that while, in seconds after the start of the run; infinite unless given.
    #[serde(default = "for_ever")]
    pub(crate) until_s: f64,
}

fn for_ever() -> f64 {
    f64::INFINITY
}

/// A network that may lose, delay and repeat messages.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Network {
    /// Probability that a packet is lost on its way.
    pub(crate) loss: f64,
    /// Probability that a packet arrives twice.
    pub(crate) duplication: f64,
    /// Time in seconds that every packet takes: one tick.
    pub(crate) latency_s: f64,
    /// Largest further delay in seconds, drawn uniformly, so that packets overtake each other.
    pub(crate) max_delay_s: f64,
    /// Time in seconds without an answer after which an agent sends again.
    pub(crate) patience_s: f64,
    /// Time in seconds after which the talk of a cycle ends.
    pub(crate) deadline_s: f64,
    /// Connectors whose radio is dead, and the times.
    pub(crate) silences: Vec<Silence>,
    /// Links that work one way only, and the times.
    pub(crate) one_ways: Vec<OneWay>,
}

impl Network {
    /// Whether a connector is silent at a time.
    pub(crate) fn is_silent(&self, chain: EntityId, connector: u32, at_s: f64) -> bool {
        self.silences.iter().any(|one| {
            (one.chain, one.connector) == (chain, connector)
                && (one.from_s..one.until_s).contains(&at_s)
        })
    }

    /// Whether a packet from one connector of a chain gets to another at a time.
    pub(crate) fn carries(&self, chain: EntityId, [sender, receiver]: [u32; 2], at_s: f64) -> bool {
        !self.one_ways.iter().any(|one| {
            (one.chain, one.receiver, one.sender) == (chain, sender, receiver)
                && (one.from_s..one.until_s).contains(&at_s)
        })
    }

    fn ticks(&self, seconds: f64) -> u64 {
        (seconds / self.latency_s).round().max(1.0) as u64
    }

    /// Returns the number of ticks of a cycle's talk.
    pub(crate) fn deadline_ticks(&self) -> u64 {
        self.ticks(self.deadline_s)
    }

    /// Returns the most ticks that a packet takes.
    pub(crate) fn longest_ticks(&self) -> u64 {
        1 + u64::from(self.faults().max_delay_cycles)
    }

    /// Returns how long an agent waits before it sends again, and how often it does.
    pub(crate) fn patience(&self) -> Patience {
        let (tries, first_tries) = (self.tries(GIVEN_UP), self.tries(MISSED));
        Patience { ticks: self.ticks(self.patience_s), tries, first_tries }
    }

    /// Returns the number of repetitions after which the chance is at most `chance` that one that is
    /// in touch has not answered any: each or its answer was lost.
    fn tries(&self, chance: f64) -> u32 {
        let unanswered = 1.0 - (1.0 - self.loss) * (1.0 - self.loss);
        let lost = (math::ln(chance) / math::ln(unanswered)).ceil();
        let on_way_s = 2.0 * (self.latency_s + self.max_delay_s);
        // The conversion saturates.
        ((lost + on_way_s / self.patience_s) as u32).saturating_add(1)
    }

    pub(crate) fn faults(&self) -> Faults {
        Faults {
            loss: self.loss,
            duplication: self.duplication,
            max_delay_cycles: (self.max_delay_s / self.latency_s).round() as u32,
        }
    }
}

/// The time after which an agent sends again, and how often.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Patience {
    /// Number of ticks without an answer after which it sends again.
    pub(crate) ticks: u64,
    /// Number of repetitions until a neighbor counts as lost.
    pub(crate) tries: u32,
    /// The same for one that was lost in the cycle before.
    pub(crate) first_tries: u32,
}
