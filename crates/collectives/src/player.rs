//! One player: its distribution over strategies, its estimates, and its updates.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sidestep_kernel::math;

/// The minimum of a probability, above 0 so that its logarithm is finite and every strategy may return.
const MIN_PROBABILITY: f64 = 1e-9;
/// The lowest temperature, as a fraction of the magnitude of the costs: below it, costs divided by the temperature would
/// have no digits left of their differences.
const MIN_TEMPERATURE_FRACTION: f64 = 1e-12;

/// The step of a distribution toward the minimum of eq. 7.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "kind", deny_unknown_fields)]
pub enum Update {
    /// `q <- q - s q [ (E[G|x] - E_q G) / T + S(q) + ln q ]`, clipped and scaled to sum 1: a
    /// step `s` of Newton's method on the quadratic nearest to the Lagrangian.
    NearestNewton {
        /// Step size `s`, in (0, 1].
        step: f64,
    },
    /// `q <- (1 - s) q + s softmax(-E[G|x] / T)`.
    Brouwer {
        /// Step size `s`, in (0, 1].
        step: f64,
    },
}

/// The cost that a player learns from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Utility {
    /// The cost of all players, as in the paper.
    #[default]
    Joint,
    /// The part of it that the player can influence, which has less noise.
    Private,
}

/// The choice of the final strategy from the distribution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Choice {
    /// The most probable strategy; among equals the first.
    #[default]
    Argmax,
    /// A draw from the distribution, as in line 27 of the paper.
    Draw,
}

impl Choice {
    /// Returns the final strategy of a player with the distribution `q`; `u` as in [`Player::sample`].
    pub fn choose(self, q: &[f64], u: f64) -> usize {
        match self {
            Self::Draw => sample(q, u),
            Self::Argmax => {
                let mut best = 0;
                for x in 1..q.len() {
                    if q[x] > q[best] {
                        best = x;
                    }
                }
                best
            }
        }
    }
}

/// Returns the strategy that the uniform number `u` in [0, 1) selects under `q`.
fn sample(q: &[f64], u: f64) -> usize {
    let mut cumulative = 0.0;
    for (x, p) in q.iter().enumerate() {
        cumulative += p;
        if u < cumulative {
            return x;
        }
    }
    // Rounding may leave the sum of all probabilities just below `u`.
    q.len() - 1
}

/// A player of a game: all that it keeps from round to round.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Player {
    /// Probability of each strategy.
    pub q: Vec<f64>,
    /// Temperature; 0 until the first estimate gives the scale of the costs.
    pub temperature: f64,
    /// Per strategy the aged sum of its sampled costs, and the aged number of samples.
    sums: Vec<f64>,
    counts: Vec<f64>,
    expected: Vec<f64>,
}

impl Player {
    /// Creates a player with a uniform distribution and no estimates.
    pub fn new(strategies: usize) -> Self {
        Self {
            q: vec![1.0 / strategies as f64; strategies],
            temperature: 0.0,
            sums: vec![0.0; strategies],
            counts: vec![0.0; strategies],
            expected: Vec::with_capacity(strategies),
        }
    }

    /// Returns whether it is a valid player with this number of strategies: one that was received
    /// from a network may have any content.
    pub fn has_strategies(&self, strategies: usize) -> bool {
        let Self { q, temperature, sums, counts, expected } = self;
        let has_shape = [q.len(), sums.len(), counts.len()] == [strategies; 3]
            && (expected.is_empty() || expected.len() == strategies);
        // Players scale their probabilities to sum 1, so rounding errors are far below this tolerance.
        let is_distribution =
            q.iter().all(|p| (0.0..=1.0).contains(p)) && (q.iter().sum::<f64>() - 1.0).abs() < 1e-6;
        let are_counts = counts.iter().all(|count| (0.0..f64::INFINITY).contains(count));
        has_shape
            && is_distribution
            && are_counts
            && (0.0..f64::INFINITY).contains(temperature)
            && sums.iter().chain(expected).all(|number| number.is_finite())
    }

    /// Returns the strategy that the uniform number `u` in [0, 1) selects under `q`.
    pub fn sample(&self, u: f64) -> usize {
        sample(&self.q, u)
    }

    /// Returns the final strategy; `u` as in [`Player::sample`].
    pub fn choose(&self, choice: Choice, u: f64) -> usize {
        choice.choose(&self.q, u)
    }

    /// Updates the estimates from a block of samples: strategies and the cost of each. Estimates of
    /// earlier blocks weigh `ageing` times as much as before; a strategy without any sample so far
    /// gets the mean of all.
    pub fn learn(&mut self, samples: &[usize], costs: &[f64], ageing: f64) {
        self.sums.iter_mut().chain(&mut self.counts).for_each(|v| *v *= ageing);
        for (&x, &cost) in samples.iter().zip(costs) {
            self.sums[x] += cost;
            self.counts[x] += 1.0;
        }
        let mean =
            self.sums.iter().sum::<f64>() / self.counts.iter().sum::<f64>().max(MIN_PROBABILITY);
        self.expected.clear();
        for (sum, n) in self.sums.iter().zip(&self.counts) {
            self.expected.push(if *n > 0.0 { sum / n } else { mean });
        }
    }

    /// Sets `E[G | x]` to known values, which `write` fills in.
    pub fn set_expected(&mut self, write: impl FnOnce(&mut Vec<f64>)) {
        write(&mut self.expected);
    }

    /// Returns the present estimate of `E[G | x]`, up to a constant.
    pub fn expected(&self) -> &[f64] {
        &self.expected
    }

    /// Moves `q` by the present estimate and then cools by the factor `cooling`. The first
    /// temperature is the spread of the estimates. Returns the largest change of a probability.
    pub fn update(&mut self, update: Update, cooling: f64) -> f64 {
        let low = self.expected.iter().copied().fold(f64::INFINITY, f64::min);
        let high = self.expected.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let spread = high - low;
        // The spread is the natural unit of the costs: at this temperature, the worst strategy weighs 1/e of the best.
        if self.temperature == 0.0 {
            self.temperature = spread;
        }
        if spread <= 0.0 {
            // All costs are equal, so no strategy is better than another.
            return 0.0;
        }
        // With the 1, differences between costs far below 1e-12 count for nothing.
        let t = self.temperature.max(MIN_TEMPERATURE_FRACTION * (low.abs().max(high.abs()) + 1.0));
        let change = match update {
            Update::NearestNewton { step } => self.newton(step, t),
            Update::Brouwer { step } => self.brouwer(step, t, low),
        };
        self.temperature *= cooling;
        change
    }

    /// Makes a step of [`Update::NearestNewton`] at temperature `t`; returns the largest change.
    fn newton(&mut self, step: f64, t: f64) -> f64 {
        let mean: f64 = self.q.iter().zip(&self.expected).map(|(q, e)| q * e).sum();
        // The logarithms first, which the new probabilities then replace in place.
        let mut new: Vec<f64> = self.q.iter().map(|q| math::ln(*q)).collect();
        let entropy = -self.q.iter().zip(&new).map(|(q, ln)| q * ln).sum::<f64>();
        for ((new, q), expected) in new.iter_mut().zip(&self.q).zip(&self.expected) {
            let gradient = (expected - mean) / t + entropy + *new;
            *new = (q - step * q * gradient).max(MIN_PROBABILITY);
        }
        self.replace_distribution(&new)
    }

    /// Makes a step of [`Update::Brouwer`] at temperature `t`; returns the largest change.
    fn brouwer(&mut self, step: f64, t: f64, low: f64) -> f64 {
        // Relative to the lowest cost, so that the largest weight is 1 and none overflows.
        let weights: Vec<f64> = self.expected.iter().map(|e| math::exp((low - e) / t)).collect();
        let sum: f64 = weights.iter().sum();
        let mut new = Vec::with_capacity(weights.len());
        for (q, weight) in self.q.iter().zip(&weights) {
            new.push(((1.0 - step) * q + step * weight / sum).max(MIN_PROBABILITY));
        }
        self.replace_distribution(&new)
    }

    fn replace_distribution(&mut self, new: &[f64]) -> f64 {
        let sum: f64 = new.iter().sum();
        let mut change: f64 = 0.0;
        for (q, new) in self.q.iter_mut().zip(new) {
            change = change.max((new / sum - *q).abs());
            *q = new / sum;
        }
        change
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const BOTH: [Update; 2] = [Update::NearestNewton { step: 0.5 }, Update::Brouwer { step: 0.5 }];

    proptest! {
        #[test]
        fn a_distribution_stays_one_and_prefers_what_costs_less(
            costs in prop::collection::vec(-1e6f64..1e6, 2..12),
            rounds in 1usize..60,
        ) {
            for update in BOTH {
                let mut player = Player::new(costs.len());
                for _ in 0..rounds {
                    player.set_expected(|e| e.clone_from(&costs));
                    player.update(update, 0.8);
                    prop_assert!((player.q.iter().sum::<f64>() - 1.0).abs() < 1e-9);
                    prop_assert!(player.q.iter().all(|q| *q > 0.0 && q.is_finite()));
                }
                let best = player.choose(Choice::Argmax, 0.0);
                // Differences between costs are given as a share of the spread, so that is their scale.
                let scale = costs.iter().fold(0.0f64, |most, c| most.max(c.abs()));
                prop_assert!(costs.iter().all(|&c| c >= costs[best] - 1e-9 * scale));
            }
        }

        /// The Boltzmann distribution is where both rest: the minimum of eq. 7.
        #[test]
        fn without_cooling_both_updates_rest_at_the_minimum_of_the_lagrangian(
            costs in prop::collection::vec(0.0f64..3.0, 2..8),
        ) {
            rests_at_the_boltzmann_distribution(&costs);
        }
    }

    /// Checks where both updates come to rest without cooling.
    fn rests_at_the_boltzmann_distribution(costs: &[f64]) {
        let low = costs.iter().copied().fold(f64::INFINITY, f64::min);
        let spread = costs.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low;
        // Of costs above the least: costs themselves may be thousands of spreads, of exponential 0.
        let weight = |c: &f64| if spread > 0.0 { math::exp((low - c) / spread) } else { 1.0 };
        let weights: Vec<f64> = costs.iter().map(weight).collect();
        let sum: f64 = weights.iter().sum();
        for update in BOTH {
            let mut player = Player::new(costs.len());
            for _ in 0..200 {
                player.set_expected(|e| *e = costs.to_vec());
                player.update(update, 1.0);
            }
            // Rounding of the costs, in units of their spread.
            let tolerance = 1e-6 + 16.0 * f64::EPSILON * low.abs() / spread.max(f64::MIN_POSITIVE);
            for (q, w) in player.q.iter().zip(&weights) {
                assert!((q - w / sum).abs() < tolerance, "{update:?} {costs:?}: {q} {w} {sum}");
            }
        }
    }

    #[test]
    fn costs_that_hardly_differ_rest_at_the_minimum_of_the_lagrangian_too() {
        rests_at_the_boltzmann_distribution(&[2.578_001_157_835_293_3, 2.576_518_113_285_888_3]);
        rests_at_the_boltzmann_distribution(&[1e9, 1e9 + 1.0, 1e9 + 3.0]);
        rests_at_the_boltzmann_distribution(&[7.0; 4]);
    }

    #[test]
    fn old_blocks_weigh_less_and_unseen_strategies_get_the_mean() {
        let mut player = Player::new(3);
        player.learn(&[0, 0, 1], &[1.0, 3.0, 8.0], 0.5);
        assert_eq!(player.expected(), [2.0, 8.0, 4.0]);
        player.learn(&[0], &[8.0], 0.5);
        assert_eq!(player.expected(), [(2.0 + 8.0) / 2.0, 8.0, 14.0 / 2.5]);
    }

    #[test]
    fn draws_follow_the_distribution() {
        let mut player = Player::new(3);
        player.q = vec![0.25, 0.5, 0.25];
        let drawn: Vec<usize> =
            [0.0, 0.24, 0.25, 0.74, 0.75, 0.999].map(|u| player.sample(u)).into();
        assert_eq!(drawn, [0, 0, 1, 1, 2, 2]);
        assert_eq!(player.choose(Choice::Argmax, 0.9), 1);
    }
}
