//! The network of the agents: what may go wrong on it, and what it has carried.

use serde::{Deserialize, Serialize};
use sidestep_kernel::ports::Faults;
use sidestep_kernel::{EntityId, math};

/// Messages and bytes that went over the network.
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
    pub(crate) fn count(&mut self, receivers: usize, bytes: usize) {
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
    /// Airplanes whose radio is dead, and times.
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

    pub(crate) fn deadline_ticks(&self) -> u64 {
        self.ticks(self.deadline_s)
    }

    /// How long and how often somebody is asked: whoever is silent is given up in a quarter of
    /// the time, so that enough is left to go on without it.
    pub(crate) fn patience(&self) -> Patience {
        let tries = (self.deadline_s / (4.0 * self.patience_s)).clamp(2.0, 12.0) as u32;
        Patience { ticks: self.ticks(self.patience_s), tries }
    }

    /// Talks in a row without a word from somebody after which its radio is taken to be dead:
    /// at least three, and so many that the chance is below 1e-12 that all it has said was lost,
    /// and all questions to it or the answers.
    pub(crate) fn silent_after(&self) -> u32 {
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

    pub(crate) fn faults(&self) -> Faults {
        Faults {
            loss: self.loss,
            duplication: self.duplication,
            max_delay_cycles: (self.max_delay_s / self.latency_s).round() as u32,
        }
    }
}

/// Time after which an endpoint asks, and how often.
#[derive(Debug, Clone, Copy)]
pub struct Patience {
    /// Ticks without anything new after which it asks.
    pub ticks: u64,
    /// Questions to somebody before it is given up.
    pub tries: u32,
}
