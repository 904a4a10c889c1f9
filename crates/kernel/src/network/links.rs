//! Links between agents: which of them carry messages at a time, and which are in a burst of
//! losses.

use crate::distr::Bernoulli;
use crate::stream::{Purpose, Streams};
use crate::units::EntityId;

/// Steps of the chain of bursts in the shorter of its two mean times. A burst lasts whole steps: with ten of them its
/// length is near enough to exponential, and the state at a time takes about ten draws.
const STEPS_PER_MEAN: f64 = 10.0;

/// A period, in seconds after the start of the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeWindow {
    /// Its start, included.
    pub from_s: f64,
    /// Its end, excluded; may be infinite.
    pub until_s: f64,
}

/// A period in which an agent's radio is off: it neither sends nor receives, and is aware of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadioOutage {
    /// Id of the agent whose radio is off.
    pub agent: EntityId,
    /// When it is off, in simulated time.
    pub window: TimeWindow,
}

/// A period in which no message gets from one side to another. Agents on no side reach all others, and are reached
/// by all.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkPartition {
    /// Ids of the agents on each side.
    pub sides: Vec<Vec<EntityId>>,
    /// When the sides are apart, in simulated time.
    pub window: TimeWindow,
}

/// A period in which a link works in one direction only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnidirectionalLink {
    /// Id of the agent whose messages arrive.
    pub sender: EntityId,
    /// Id of the agent whose messages to the other are lost.
    pub receiver: EntityId,
    /// When one direction fails, in simulated time.
    pub window: TimeWindow,
}

/// The streams from which faults are drawn, and the purposes of the draws.
#[derive(Debug, Clone, Copy)]
pub struct FaultStreams {
    /// The streams of the run.
    pub streams: Streams,
    /// For losses, duplicates and delays of single messages.
    pub network: Purpose,
    /// For the states of links: in a burst of losses or not.
    pub burst: Purpose,
    /// For messages within a burst, each of which is lost or not.
    pub burst_loss: Purpose,
}

/// Bursts of losses (Gilbert and Elliott): each direction of each link is a Markov chain of two
/// states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GilbertElliott {
    /// Probability that a message is lost during a burst.
    pub loss: f64,
    /// Mean length of a burst in seconds.
    pub mean_burst_s: f64,
    /// Mean time in seconds from the end of a burst to the start of the next one.
    pub mean_gap_s: f64,
}

impl TimeWindow {
    /// The time from the start of the run on.
    pub const ALWAYS: Self = Self { from_s: 0.0, until_s: f64::INFINITY };

    /// Returns whether a time is within the period.
    pub fn contains(&self, at_s: f64) -> bool {
        self.from_s <= at_s && at_s < self.until_s
    }
}

impl NetworkPartition {
    /// Returns whether the partition separates two agents at a time.
    pub(super) fn is_separated(&self, [a, b]: [EntityId; 2], at_s: f64) -> bool {
        if !self.window.contains(at_s) {
            return false;
        }
        match (self.side_of(a), self.side_of(b)) {
            (Some(side_a), Some(side_b)) => side_a != side_b,
            _ => false,
        }
    }

    fn side_of(&self, agent: EntityId) -> Option<usize> {
        self.sides.iter().position(|side| side.contains(&agent))
    }
}

impl UnidirectionalLink {
    /// Returns whether the fault stops a message at a time.
    pub(super) fn is_message_blocked(
        &self,
        sender: EntityId,
        receiver: EntityId,
        at_s: f64,
    ) -> bool {
        self.window.contains(at_s) && (self.receiver, self.sender) == (sender, receiver)
    }
}

impl GilbertElliott {
    /// Returns whether a link is in a burst at a time.
    ///
    /// In each step of the chain its state is drawn anew with a certain probability, and otherwise
    /// stays the same. That is the chain with the given mean times, and its state at any time
    /// follows from the draws of a few steps before it, so no link needs a stored state.
    pub(super) fn is_in_burst(
        &self,
        streams: &FaultStreams,
        link: [EntityId; 2],
        at_s: f64,
    ) -> bool {
        let step_s = self.mean_burst_s.min(self.mean_gap_s) / STEPS_PER_MEAN;
        // The sum of the rates of leaving a burst and of leaving a gap: drawing anew with it, from the stationary
        // distribution, leaves each state at its own rate.
        let is_renewed = Bernoulli::new(step_s / self.mean_burst_s + step_s / self.mean_gap_s);
        let is_burst = Bernoulli::new(self.mean_burst_s / (self.mean_burst_s + self.mean_gap_s));
        let mut step = (at_s / step_s) as u64;
        // Back to the step in which the present state was drawn.
        loop {
            let words = streams.streams.words_for_pair(link[0], link[1], step, streams.burst, 0);
            if step == 0 || is_renewed.sample(words[0]) {
                return is_burst.sample(words[1]);
            }
            step -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Seed;

    /// 2,000 bursts of 40 links: the standard error of a mean time is 2.2 %, and five of them are
    /// allowed.
    #[test]
    fn bursts_last_and_return_as_stated() {
        let bursts = GilbertElliott { loss: 1.0, mean_burst_s: 2.0, mean_gap_s: 6.0 };
        let [network, burst, burst_loss] = [5, 6, 7].map(Purpose);
        let draws = FaultStreams { streams: Streams::new(Seed(5)), network, burst, burst_loss };
        let (step_s, steps) = (0.2, 2000);
        let (mut on, mut begun) = (0, 0);
        for receiver in 1..=40 {
            let state =
                |k: u64| bursts.is_in_burst(&draws, [0, receiver], (k as f64 + 0.5) * step_s);
            on += (0..steps).filter(|&k| state(k)).count();
            begun += (1..steps).filter(|&k| state(k) && !state(k - 1)).count();
        }
        let lasts_s = step_s * on as f64 / begun as f64;
        let every_s = step_s * (40 * steps as usize - on) as f64 / begun as f64;
        assert!((lasts_s / 2.0 - 1.0).abs() < 0.11, "{lasts_s} s");
        assert!((every_s / 6.0 - 1.0).abs() < 0.11, "{every_s} s");
    }

    #[test]
    fn a_partition_cuts_between_its_sides_and_nowhere_else() {
        let sides = vec![vec![0, 2], vec![1, 3]];
        let partition =
            NetworkPartition { sides, window: TimeWindow { from_s: 10.0, until_s: 20.0 } };
        assert!(partition.is_separated([0, 3], 10.0) && partition.is_separated([3, 0], 19.9));
        for (pair, at_s) in [([0, 2], 15.0), ([0, 4], 15.0), ([0, 3], 9.9), ([0, 3], 20.0)] {
            assert!(!partition.is_separated(pair, at_s), "{pair:?} at {at_s}");
        }
    }
}
