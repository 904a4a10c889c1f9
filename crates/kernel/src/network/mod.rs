//! A network of agents: its faults, its packets, and the timeouts and retries of its agents.
//!
//! ```text
//! links.rs              which links carry messages at a time, and which are in a burst of losses
//! faulty_transport.rs   a transport with the faults of a network
//! fault_injector.rs     the same for the packets of one agent, in a process of its own
//! packet.rs             packets: the envelope of every message
//! radio.rs              the budget of a radio channel that all share
//! retry.rs              when an agent asks again for what it misses
//! agent.rs              the programs of agents, and the loop that runs several of them
//! ```
//!
//! The network identifies agents by ids alone; worlds give them a meaning.

mod agent;
mod fault_injector;
mod faulty_transport;
mod links;
mod packet;
mod radio;
mod retry;

use crate::math;
use crate::ports::NetworkFaults;
use crate::units::EntityId;
pub use agent::{AgentLoop, NetworkAgent, OutgoingPacket, ReplyBatching};
pub use fault_injector::FaultInjector;
pub use faulty_transport::{DistanceLookup, FaultyTransport};
pub use links::{
    FaultStreams, GilbertElliott, NetworkPartition, RadioOutage, TimeWindow, UnidirectionalLink,
};
pub use packet::{
    ConversationId, ConversationTopic, DropCounts, DropReason, HEADER_BYTES, PacketBuffer,
    PacketHeader, digest_pieces, fingerprint, parse_packet,
};
pub use radio::{PacketAdmission, PacketOutbox, RadioBudget, SIGNATURE_BYTES};
pub use retry::RetryTimer;

/// Probability of giving up an agent that can be reached: one in a billion conversations.
const FALSE_GIVE_UP_PROBABILITY: f64 = 1e-9;
/// The same for an agent that did not answer in the conversation before. It is probably gone, and waiting for it in
/// every conversation would cost the others their time; another miss is no worse than the first.
const FALSE_GIVE_UP_PROBABILITY_AFTER_MISS: f64 = 0.1;
/// The divisor of a conversation's time that gives the longest wait for a silent agent, in conversations of many steps.
const WAITS_PER_CONVERSATION: f64 = 4.0;

/// A network that may lose, delay and repeat messages.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Probability that a message is lost.
    pub loss: f64,
    /// Probability that a message arrives twice.
    pub duplication: f64,
    /// Time in seconds that every message takes: one tick.
    pub latency_s: f64,
    /// Bits per second in each direction of each link; their time comes on top of the latency.
    pub bandwidth_bit_s: f64,
    /// Bytes that the radio channel of all agents carries, if it is limited.
    pub budget: Option<RadioBudget>,
    /// Largest further delay in seconds, drawn uniformly, so that messages overtake each other.
    pub max_delay_s: f64,
    /// Time in seconds without a new message after which an agent asks or sends again.
    pub patience_s: f64,
    /// Time in seconds after which a conversation ends.
    pub deadline_s: f64,
    /// Largest distance in meters between sender and receiver.
    pub range_m: f64,
    /// Bursts of losses, if there are any.
    pub bursts: Option<GilbertElliott>,
    /// Agents whose radio is off, and the periods.
    pub radio_outages: Vec<RadioOutage>,
    /// Sides that do not reach each other, and the periods.
    pub partitions: Vec<NetworkPartition>,
    /// Links that work in one direction only, and the periods.
    pub unidirectional_links: Vec<UnidirectionalLink>,
}

impl Network {
    /// Returns whether an agent's radio is off at a time.
    pub fn is_radio_off(&self, id: EntityId, at_s: f64) -> bool {
        self.radio_outages.iter().any(|outage| outage.agent == id && outage.window.contains(at_s))
    }

    /// Returns whether a link carries messages at a time, regardless of its length.
    pub fn can_carry(&self, [sender, receiver]: [EntityId; 2], at_s: f64) -> bool {
        let is_cut = self
            .partitions
            .iter()
            .any(|partition| partition.is_separated([sender, receiver], at_s));
        !is_cut
            && !self
                .unidirectional_links
                .iter()
                .any(|link| link.is_message_blocked(sender, receiver, at_s))
    }

    fn s_to_ticks(&self, seconds: f64) -> u64 {
        (seconds / self.latency_s).round().max(1.0) as u64
    }

    /// Returns the time in seconds that some ticks take.
    pub fn ticks_to_s(&self, ticks: u64) -> f64 {
        ticks as f64 * self.latency_s
    }

    /// Returns the number of bits that a link carries in a tick.
    pub fn bits_per_tick(&self) -> f64 {
        self.bandwidth_bit_s * self.latency_s
    }

    /// Returns the number of bits that an agent sends in a tick at most: as many as a link carries, and no more than its
    /// share of the radio's budget.
    fn sender_bits_per_tick(&self) -> f64 {
        let share_bytes_s = self.budget.map_or(f64::INFINITY, |budget| budget.share_bytes_s());
        self.bits_per_tick().min(8.0 * share_bytes_s * self.latency_s)
    }

    /// Returns the number of ticks of a conversation.
    pub fn conversation_ticks(&self) -> u64 {
        self.s_to_ticks(self.deadline_s)
    }

    /// Returns the time that an agent waits before it asks again, and the number of its requests.
    pub fn retry_policy(&self) -> RetryPolicy {
        RetryPolicy {
            ticks: self.s_to_ticks(self.patience_s),
            bits_per_tick: self.sender_bits_per_tick(),
            tries: self.max_tries(FALSE_GIVE_UP_PROBABILITY),
            first_tries: self.max_tries(FALSE_GIVE_UP_PROBABILITY_AFTER_MISS),
        }
    }

    /// Returns the policy for conversations of many steps: a silent agent is given up in a
    /// quarter of the time at the latest, so that enough is left to go on without it.
    pub fn long_conversation_retry_policy(&self) -> RetryPolicy {
        // At least two requests, because one alone may be lost on any network.
        let max_tries =
            (self.deadline_s / (WAITS_PER_CONVERSATION * self.patience_s)).max(2.0) as u32;
        let policy = self.retry_policy();
        RetryPolicy {
            tries: policy.tries.min(max_tries),
            first_tries: policy.first_tries.min(max_tries),
            ..policy
        }
    }

    /// Returns the number of requests after which the probability is at most `p` that an agent that can be reached
    /// has answered none: each request or its answer was lost, or fell into a burst.
    fn max_tries(&self, p: f64) -> u32 {
        let unanswered = 1.0 - (1.0 - self.loss) * (1.0 - self.loss);
        // Lengths of bursts are exponentially distributed: one is longer than this with probability `p`.
        let burst_s = self.bursts.map_or(0.0, |bursts| bursts.mean_burst_s * -math::ln(p));
        let lost = (math::ln(p) / math::ln(unanswered)).ceil();
        let round_trip_s = 2.0 * (self.latency_s + self.max_delay_s);
        // The conversion saturates, and bursts may last longer than any conversation.
        ((lost + (burst_s + round_trip_s) / self.patience_s) as u32).saturating_add(1)
    }

    /// Returns the faults that a transport draws for every message.
    pub fn faults(&self) -> NetworkFaults {
        NetworkFaults {
            loss: self.loss,
            duplication: self.duplication,
            max_delay_cycles: (self.max_delay_s / self.latency_s).round() as u32,
        }
    }
}

/// The time after which an agent asks again, and the number of its requests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RetryPolicy {
    /// Number of ticks without a new message after which it asks.
    pub ticks: u64,
    /// Number of bits that a link carries in a tick.
    pub bits_per_tick: f64,
    /// Number of requests to another agent before it is given up.
    pub tries: u32,
    /// The same for an agent that did not answer in the conversation before.
    pub first_tries: u32,
}

impl RetryPolicy {
    /// Returns whether agents ever ask again, which they do not on a network that loses nothing.
    pub fn is_enabled(&self) -> bool {
        self.ticks < u64::MAX
    }

    /// Returns the number of ticks after which an agent asks again where messages are of this size: sending a message
    /// and its answer takes some of them.
    pub fn timeout_ticks(&self, bytes: usize) -> u64 {
        let transmission_ticks = (2.0 * 8.0 * bytes as f64 / self.bits_per_tick).ceil();
        self.ticks.saturating_add(transmission_ticks as u64)
    }
}
