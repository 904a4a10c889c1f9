//! Distributions that turn words of a [`crate::stream`] into outcomes, with integer
//! thresholds, so that a draw is the same on every machine.

use crate::math;
use crate::stream::Draws;

/// The largest deviation of a row's sum from 1: probabilities that people write have a few decimals, such as three
/// times 0.333333.
pub const ROW_TOLERANCE: f64 = 1e-6;

/// A reason why a row is not a probability distribution.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum DistributionError {
    /// No outcome at all.
    #[error("the row is empty")]
    Empty,
    /// A probability outside [0, 1] or not a number.
    #[error("entry {index} is {value}, not a probability between 0 and 1")]
    NotAProbability {
        /// Position in the row, from 1.
        index: usize,
        /// Its value, which may be NaN.
        value: f64,
    },
    /// The row does not sum to 1 (promise L2).
    #[error("the row sums to {}, {} 1 by {}", round_to_micro(*.sum), if *.sum < 1.0 { "short of" } else { "above" }, round_to_micro((.sum - 1.0).abs()))]
    Sum {
        /// Its sum, farther from 1 than [`ROW_TOLERANCE`].
        sum: f64,
    },
}

/// Rounds to six digits after the decimal point: further digits of a sum are rounding errors.
fn round_to_micro(value: f64) -> f64 {
    (1e6 * value).round() / 1e6
}

/// Checks that `row` is a probability distribution (promise L2).
///
/// # Errors
/// When it is empty, has an entry outside [0, 1], or does not sum to 1 within
/// [`ROW_TOLERANCE`].
pub fn check_probability_row(row: &[f64]) -> Result<(), DistributionError> {
    if row.is_empty() {
        return Err(DistributionError::Empty);
    }
    for (i, &value) in row.iter().enumerate() {
        if !(0.0..=1.0).contains(&value) {
            return Err(DistributionError::NotAProbability { index: i + 1, value });
        }
    }
    let sum: f64 = row.iter().sum();
    if (sum - 1.0).abs() > ROW_TOLERANCE { Err(DistributionError::Sum { sum }) } else { Ok(()) }
}

/// A probability as a threshold: an event happens when a word is below it.
///
/// 1 is represented exactly (the event always happens), everything else within 2^-32.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bernoulli(u64);

impl Bernoulli {
    /// Returns the chance `p`, clamped to [0, 1].
    pub fn new(p: f64) -> Self {
        Self((p.clamp(0.0, 1.0) * (1u64 << 32) as f64).round() as u64)
    }

    /// Returns whether the event happens for the uniform word `u`.
    #[inline]
    pub fn sample(self, u: u32) -> bool {
        u64::from(u) < self.0
    }
}

/// A finite distribution over `0..n`, drawn with one word.
/// Outcome `i` has probability `row[i]` within 2^-32; outcomes of probability 0 are never drawn.
/// Outcomes are compared in their order, so a likely outcome should come first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Categorical {
    /// Outcome of each threshold; the last one is taken when no threshold is above the word.
    outcomes: Vec<u16>,
    /// Cumulative probability times 2^32, strictly increasing, one fewer than outcomes.
    thresholds: Vec<u32>,
}

impl Categorical {
    /// Creates the distribution with these probabilities.
    ///
    /// # Errors
    /// See [`check_probability_row`].
    pub fn new(row: &[f64]) -> Result<Self, DistributionError> {
        check_probability_row(row)?;
        let sum: f64 = row.iter().sum();
        let mut outcomes = Vec::new();
        let mut thresholds = Vec::new();
        let mut cumulative = 0.0;
        for (i, &p) in row.iter().enumerate() {
            cumulative += p / sum;
            let threshold = (cumulative * (1u64 << 32) as f64).round() as u64;
            let previous = thresholds.last().map_or(0, |&t| u64::from(t));
            // An outcome with a threshold not above the previous one could never be drawn.
            if p == 0.0 || threshold <= previous {
                continue;
            }
            outcomes.push(i as u16);
            match u32::try_from(threshold) {
                Ok(t) => thresholds.push(t),
                // The threshold is 2^32, above every word: later outcomes could never be drawn.
                Err(_) => break,
            }
        }
        // The last outcome needs no threshold. It has one where rounding left the sum short of 1: the words above it
        // then belong to the last outcome too.
        thresholds.truncate(outcomes.len().saturating_sub(1));
        Ok(Self { outcomes, thresholds })
    }

    /// Returns the outcome for the uniform word `u`.
    #[inline]
    pub fn sample(&self, u: u32) -> usize {
        let mut i = 0;
        while i < self.thresholds.len() && u >= self.thresholds[i] {
            i += 1;
        }
        usize::from(self.outcomes[i])
    }
}

/// Draws a standard normal value (Box-Muller) from two 64-bit draws.
pub fn normal(draws: &mut Draws) -> f64 {
    // 1 - u is in (0, 1], where the logarithm is finite; u itself may be 0.
    let radius = (-2.0 * math::ln(1.0 - draws.uniform())).sqrt();
    radius * math::cos(std::f64::consts::TAU * draws.uniform())
}

/// Returns two independent standard normal values (Box-Muller) from the four words of one draw.
pub fn normal_pair(words: [u32; 4]) -> [f64; 2] {
    // 53 bits of each two words, as `Draws::uniform` has them.
    let uniform = |low: u32, high: u32| {
        let bits = (u64::from(low) | u64::from(high) << 32) >> 11;
        bits as f64 * (1.0 / (1u64 << 53) as f64)
    };
    let radius = (-2.0 * math::ln(1.0 - uniform(words[0], words[1]))).sqrt();
    let angle_rad = std::f64::consts::TAU * uniform(words[2], words[3]);
    [radius * math::cos(angle_rad), radius * math::sin(angle_rad)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::{Purpose, Streams};
    use crate::units::Seed;
    use proptest::prelude::*;

    #[test]
    fn a_row_that_does_not_sum_to_one_says_by_how_much() {
        let error = check_probability_row(&[0.5, 0.45]).expect_err("0.95 is not 1");
        assert_eq!(error.to_string(), "the row sums to 0.95, short of 1 by 0.05");
        let error = check_probability_row(&[0.5, 0.75]).expect_err("1.25 is not 1");
        assert_eq!(error.to_string(), "the row sums to 1.25, above 1 by 0.25");
        let error = check_probability_row(&[0.05, 0.6, 0.05]).expect_err("0.7 is not 1");
        assert_eq!(error.to_string(), "the row sums to 0.7, short of 1 by 0.3");
        assert_eq!(check_probability_row(&[]), Err(DistributionError::Empty));
        assert!(matches!(
            check_probability_row(&[1.5]),
            Err(DistributionError::NotAProbability { index: 1, .. })
        ));
        assert!(matches!(
            check_probability_row(&[f64::NAN]),
            Err(DistributionError::NotAProbability { .. })
        ));
    }

    #[test]
    fn certain_and_impossible_are_exact() {
        let certain = Categorical::new(&[0.0, 1.0, 0.0]).expect("a row");
        assert_eq!([certain.sample(0), certain.sample(u32::MAX)], [1, 1]);
        assert!(Bernoulli::new(1.0).sample(u32::MAX));
        assert!(!Bernoulli::new(0.0).sample(0));
    }

    proptest! {
        #[test]
        fn the_share_of_words_of_an_outcome_is_its_probability(weights in prop::collection::vec(0u32..1000, 1..12)) {
            let sum: u32 = weights.iter().sum();
            prop_assume!(sum > 0);
            let row: Vec<f64> = weights.iter().map(|&w| f64::from(w) / f64::from(sum)).collect();
            let distribution = Categorical::new(&row).expect("normalized");
            let mut counts = vec![0u32; row.len()];
            let n = 1u32 << 12;
            for i in 0..n {
                counts[distribution.sample(i << 20 | 1 << 19)] += 1;
            }
            for (p, c) in row.iter().zip(&counts) {
                prop_assert!((p - f64::from(*c) / f64::from(n)).abs() <= 1.0 / f64::from(n) + 1e-9);
                prop_assert!(*p > 0.0 || *c == 0);
            }
        }
    }

    const GOLDEN: &str = "[1, 2, 2, 0, 1, 2, 0, 1] [7, 2, 3, 3, 6, 2, 9, 4] \
                          [bfdb726fa5b1d888, bfec0290ca53273e]";

    #[test]
    fn golden_values_of_every_distribution() {
        let streams = Streams::new(Seed(42));
        let mut draws = streams.draws(1, 2, Purpose(3));
        let row = Categorical::new(&[0.1, 0.2, 0.3, 0.4]).expect("a row");
        let drawn: Vec<usize> = (0..8).map(|_| row.sample(draws.next_u32())).collect();
        let below: Vec<u32> = (0..8).map(|_| draws.uniform_below(10)).collect();
        let normals: Vec<u64> = (0..2).map(|_| normal(&mut draws).to_bits()).collect();
        assert_eq!(format!("{drawn:?} {below:?} {normals:x?}"), GOLDEN);
    }

    #[test]
    fn normals_have_mean_zero_and_variance_one() {
        let mut draws = Streams::new(Seed(9)).draws(0, 0, Purpose(0));
        let xs: Vec<f64> = (0..20_000).map(|_| normal(&mut draws)).collect();
        let mean = xs.iter().sum::<f64>() / 2e4;
        let variance = xs.iter().map(|x| x * x).sum::<f64>() / 2e4;
        // Four standard errors, fixed seed.
        assert!(mean.abs() < 4.0 / 2e4f64.sqrt());
        assert!((variance - 1.0).abs() < 4.0 * (2.0f64 / 2e4).sqrt());
    }

    #[test]
    fn pairs_of_normals_have_mean_zero_variance_one_and_no_correlation() {
        let streams = Streams::new(Seed(9));
        let pairs: Vec<[f64; 2]> =
            (0..20_000).map(|k| normal_pair(streams.block(0, k, Purpose(0), 0))).collect();
        let mean_of = |value: fn(&[f64; 2]) -> f64| pairs.iter().map(value).sum::<f64>() / 2e4;
        // Four standard errors, fixed seed.
        let tolerance = 4.0 / 2e4f64.sqrt();
        assert!(mean_of(|pair| pair[0]).abs() < tolerance);
        assert!(mean_of(|pair| pair[1]).abs() < tolerance);
        assert!(mean_of(|pair| pair[0] * pair[1]).abs() < tolerance);
        for variance in [mean_of(|pair| pair[0] * pair[0]), mean_of(|pair| pair[1] * pair[1])] {
            assert!((variance - 1.0).abs() < 4.0 * (2.0f64 / 2e4).sqrt());
        }
    }
}
