//! The network of the agents: its faults, and the traffic on it.

mod links;

pub use links::{Bursts, OneWay, Partition, Silence};
use serde::{Deserialize, Serialize};
use sidestep_kernel::ports::Faults;
use sidestep_kernel::{EntityId, math};

/// Messages and bytes that went over the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Traffic {
    /// Number of messages, one per receiver; for a coordinator, its migrations.
    pub messages: u64,
    /// Number of messages if one could reach all.
    pub multicasts: u64,
    /// Number of bytes of the messages, in their serialized form.
    pub bytes: u64,
    /// Number of bytes if one message could reach all.
    pub multicast_bytes: u64,
}

impl Traffic {
    /// Adds the counts of other traffic.
    pub fn add(&mut self, other: Self) {
        self.messages += other.messages;
        self.multicasts += other.multicasts;
        self.bytes += other.bytes;
        self.multicast_bytes += other.multicast_bytes;
    }

    /// Counts a message to `receivers` others.
    pub(crate) fn count(&mut self, receivers: usize, bytes: usize) {
        self.messages += receivers as u64;
        self.multicasts += 1;
        self.bytes += (receivers * bytes) as u64;
        self.multicast_bytes += bytes as u64;
    }
}

/// A network that may lose, delay and repeat messages.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Probability that a message is lost on its way to a receiver.
    pub loss: f64,
    /// Probability that a message arrives twice.
    pub duplication: f64,
    /// Time in seconds that every message takes: one tick.
    pub latency_s: f64,
    /// Largest further delay in seconds, drawn uniformly, so that messages overtake each other.
    pub max_delay_s: f64,
    /// Time in seconds without a new message after which an agent asks those it waits for.
    pub patience_s: f64,
    /// Time in seconds after which an optimization ends; the same for the shield's exchange after
    /// it.
    pub deadline_s: f64,
    /// Distance in meters that messages reach.
    pub range_m: f64,
    /// Bursts of losses, if there are any.
    pub bursts: Option<Bursts>,
    /// Airplanes whose radio is dead, and the times.
    pub silences: Vec<Silence>,
    /// Sides that do not hear each other, and the times.
    pub partitions: Vec<Partition>,
    /// Links that work one way only, and the times.
    pub one_ways: Vec<OneWay>,
}

impl Network {
    /// Returns whether an airplane is silent at a time.
    pub fn is_silent(&self, id: EntityId, at_s: f64) -> bool {
        self.silences.iter().any(|silence| silence.airplane == id && silence.is_on(at_s))
    }

    /// Returns whether a link carries messages at a time, as far as distance does not matter.
    pub(crate) fn carries(&self, [sender, receiver]: [EntityId; 2], at_s: f64) -> bool {
        let is_cut = self.partitions.iter().any(|one| one.cuts([sender, receiver], at_s));
        !is_cut && !self.one_ways.iter().any(|one| one.stops(sender, receiver, at_s))
    }

    fn ticks(&self, seconds: f64) -> u64 {
        (seconds / self.latency_s).round().max(1.0) as u64
    }

    pub(crate) fn deadline_ticks(&self) -> u64 {
        self.ticks(self.deadline_s)
    }

    /// Returns how long and how often an agent asks another: a silent one is given up in a quarter
    /// of the time, so that enough is left to go on without it.
    pub(crate) fn patience(&self) -> Patience {
        let tries = (self.deadline_s / (4.0 * self.patience_s)).clamp(2.0, 12.0) as u32;
        Patience { ticks: self.ticks(self.patience_s), tries }
    }

    /// Returns the number of talks in a row without a message from an airplane after which its
    /// radio is taken to be dead: at least three, and enough that the chance is below 1e-12 that
    /// all its messages were lost, together with all questions to it or the answers.
    pub(crate) fn silent_after(&self) -> u32 {
        const CHANCE: f64 = 1e-12;
        let unanswered = 1.0 - (1.0 - self.loss) * (1.0 - self.loss);
        let tries = f64::from(self.patience().tries);
        // In the first of these talks all questions are asked, in each later one a single question.
        let first = math::ln(self.loss) + tries * math::ln(unanswered);
        let later = math::ln(self.loss * unanswered);
        let talks = 1.0 + ((math::ln(CHANCE) - first) / later).ceil().max(0.0);
        // Without losses the logarithms are infinite, and three talks are enough.
        if talks.is_finite() { (talks as u32).max(3) } else { 3 }
    }

    pub(crate) fn faults(&self) -> Faults {
        Faults {
            loss: self.loss,
            duplication: self.duplication,
            max_delay_cycles: (self.max_delay_s / self.latency_s).round() as u32,
        }
    }
}

/// The time after which an endpoint asks, and the number of questions.
#[derive(Debug, Clone, Copy)]
pub struct Patience {
    /// Number of ticks without a new message after which it asks.
    pub ticks: u64,
    /// Number of questions to another before it is given up.
    pub tries: u32,
}
