//! A network of agents: its faults, its packets, and the time that agents wait for each other over it.
//!
//! ```text
//! links.rs      which links carry messages at a time, and which are in a burst of losses
//! carrier.rs    a transport with the faults of a network
//! ether.rs      the same for the packets of one agent, in a process of its own
//! packet.rs     packets: the envelope of every message
//! retry.rs      when an agent asks again for what it misses
//! agent.rs      the programs of agents, and the loop that runs several of them
//! ```
//!
//! Agents are known by their ids on the network; their meaning is up to the world.

mod agent;
mod fault_injector;
mod faulty_transport;
mod links;
mod packet;
mod retry;

use crate::math;
use crate::ports::Faults;
use crate::units::EntityId;
pub use agent::{AgentLoop, NetworkAgent, OutgoingPacket, ReplyTiming};
pub use fault_injector::FaultInjector;
pub use faulty_transport::{Distances, FaultyTransport};
pub use links::{
    FaultStreams, GilbertElliott, Partition, RadioOutage, TimeWindow, UnidirectionalLink,
};
pub use packet::{
    ConversationId, DropCounts, DropReason, HEADER_BYTES, PacketBuffer, PacketHeader, Protocol,
    digest, fingerprint, parse_packet,
};
pub use retry::RetryTimer;

/// Chance of giving up an agent that is in touch.
const FALSE_GIVE_UP_PROBABILITY: f64 = 1e-9;
/// The same for an agent that was not heard in the talk before: another miss is no worse than that one.
const FALSE_GIVE_UP_PROBABILITY_AFTER_MISS: f64 = 0.1;

/// A network that may lose, delay and repeat messages.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Probability that a message is lost on its way to a receiver.
    pub loss: f64,
    /// Probability that a message arrives twice.
    pub duplication: f64,
    /// Time in seconds that every message takes: one tick.
    pub latency_s: f64,
    /// Bits that go over each way of each link in a second, in addition to the latency.
    pub bandwidth_bit_s: f64,
    /// Largest further delay in seconds, drawn uniformly, so that messages overtake each other.
    pub max_delay_s: f64,
    /// Time in seconds without a new message after which an agent asks or sends again.
    pub patience_s: f64,
    /// Time in seconds after which a talk ends.
    pub deadline_s: f64,
    /// Distance in meters that messages reach.
    pub range_m: f64,
    /// Bursts of losses, if there are any.
    pub bursts: Option<GilbertElliott>,
    /// Agents whose radio is dead, and the times.
    pub radio_outages: Vec<RadioOutage>,
    /// Sides that do not hear each other, and the times.
    pub partitions: Vec<Partition>,
    /// Links that work one way only, and the times.
    pub unidirectional_links: Vec<UnidirectionalLink>,
}

impl Network {
    /// Returns whether an agent is silent at a time.
    pub fn is_radio_off(&self, id: EntityId, at_s: f64) -> bool {
        self.radio_outages
            .iter()
            .any(|silence| silence.agent == id && silence.window.contains(at_s))
    }

    /// Returns whether a link carries messages at a time, as far as distance does not matter.
    pub fn carries(&self, [sender, receiver]: [EntityId; 2], at_s: f64) -> bool {
        let is_cut = self.partitions.iter().any(|one| one.separates([sender, receiver], at_s));
        !is_cut && !self.unidirectional_links.iter().any(|one| one.blocks(sender, receiver, at_s))
    }

    fn ticks(&self, seconds: f64) -> u64 {
        (seconds / self.latency_s).round().max(1.0) as u64
    }

    /// Returns the time in seconds that some ticks take.
    pub fn seconds(&self, ticks: u64) -> f64 {
        ticks as f64 * self.latency_s
    }

    /// Returns the number of bits that go over a link in a tick.
    pub fn bits_per_tick(&self) -> f64 {
        self.bandwidth_bit_s * self.latency_s
    }

    /// Returns the number of ticks of a talk.
    pub fn deadline_ticks(&self) -> u64 {
        self.ticks(self.deadline_s)
    }

    /// Returns the time that an agent waits before it asks, and the number of questions.
    pub fn retry_policy(&self) -> RetryPolicy {
        let (tries, first_tries) = (
            self.max_tries(FALSE_GIVE_UP_PROBABILITY),
            self.max_tries(FALSE_GIVE_UP_PROBABILITY_AFTER_MISS),
        );
        let bits_per_tick = self.bits_per_tick();
        RetryPolicy { ticks: self.ticks(self.patience_s), bits_per_tick, tries, first_tries }
    }

    /// Returns the same for talks of many steps: an agent that has fallen silent is given up in a
    /// quarter of the time at the latest, so that enough is left to go on without it.
    pub fn short_retry_policy(&self) -> RetryPolicy {
        let most = (self.deadline_s / (4.0 * self.patience_s)).max(2.0) as u32;
        let long = self.retry_policy();
        RetryPolicy { tries: long.tries.min(most), first_tries: long.first_tries.min(most), ..long }
    }

    /// Returns the number of questions after which the chance is at most `chance` that an agent in
    /// touch has answered none: each question or its answer was lost, or fell into a burst.
    fn max_tries(&self, chance: f64) -> u32 {
        let unanswered = 1.0 - (1.0 - self.loss) * (1.0 - self.loss);
        let burst_s = self.bursts.map_or(0.0, |bursts| bursts.mean_burst_s * -math::ln(chance));
        let lost = (math::ln(chance) / math::ln(unanswered)).ceil();
        let on_way_s = 2.0 * (self.latency_s + self.max_delay_s);
        // The conversion saturates, and bursts may last longer than any talk.
        ((lost + (burst_s + on_way_s) / self.patience_s) as u32).saturating_add(1)
    }

    /// Returns the faults that a transport draws for every message.
    pub fn faults(&self) -> Faults {
        Faults {
            loss: self.loss,
            duplication: self.duplication,
            max_delay_cycles: (self.max_delay_s / self.latency_s).round() as u32,
        }
    }
}

/// The time after which an agent asks, and the number of questions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RetryPolicy {
    /// Number of ticks without a new message after which it asks.
    pub ticks: u64,
    /// Number of bits that go over a link in a tick.
    pub bits_per_tick: f64,
    /// Number of questions to another before it is given up.
    pub tries: u32,
    /// The same for an agent that was not heard in the talk before.
    pub first_tries: u32,
}

impl RetryPolicy {
    /// Returns whether agents ever ask, which they do not on a network that loses nothing.
    pub fn is_enabled(&self) -> bool {
        self.ticks < u64::MAX
    }

    /// Returns the number of ticks after which an agent asks where messages are of this size: the
    /// ticks that a message and its answer take on the way are added.
    pub fn timeout_ticks(&self, bytes: usize) -> u64 {
        let on_way = (2.0 * 8.0 * bytes as f64 / self.bits_per_tick).ceil();
        self.ticks.saturating_add(on_way as u64)
    }
}
