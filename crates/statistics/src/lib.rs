#![deny(clippy::disallowed_methods)]
//! Intervals, moments and tests that qualify every reported number.
//!
//! Intervals are two-sided at 95 % unless a function says otherwise. The bootstrap draws from the
//! kernel's streams, so it always gives the same ends for the same values; nothing else here draws
//! random numbers. Sums run in the order of the values and are compensated, so that huge and tiny
//! magnitudes keep their digits.
//!
//! ```text
//! moments.rs     mean, standard deviation, Moments; Sample: the values of a metric
//! interval.rs    intervals of proportions (Wilson, Clopper and Pearson) and of means (Student)
//! quantile.rs    percentiles, and their intervals by order statistics
//! bootstrap.rs   BCa intervals of the mean and of any other statistic
//! paired.rs      two treatments of the same cases: differences, ratios, signs, p-values, Holm
//! rank.rs        rank correlation of two quantities
//! least_squares.rs  linear models fitted to measurements
//! stopping.rs    how many runs are enough
//! ```
//!
//! # Which interval to trust when
//!
//! | the question | use | trust it | do not |
//! |---|---|---|---|
//! | how often does it happen (a proportion of runs) | [`wilson`] | from the first run on; its coverage is 95 % on average over proportions | where coverage must never fall below 95 %: [`clopper_pearson`] |
//! | mean of a roughly symmetric metric | [`mean_interval`] | from 5 runs on; exact for normal values at any n >= 2 | with a long tail and fewer than 50 runs: it is too low on the side of the tail |
//! | mean of a skewed metric | [`Bootstrap::mean`] | from some 20 runs on; it extends further on the side of the tail | below 10 runs: a tail that no run shows is not in it, and it is too narrow |
//! | a typical run (median), a bad run (95th percentile) | [`quantile_interval`] | always, for any distribution; it reports its exact coverage | it is absent below 6 runs (median) or 72 runs (5th, 95th): no interval would have the coverage |
//! | is A better than B | [`Pairs`]: run both on the same seeds | the interval of the difference; `k of n pairs` needs no assumption | the two separate intervals: their overlap says nothing about pairs |
//! | by which factor does A differ from B | [`Pairs::ratio`] (Fieller) | with a baseline mean that is well away from 0 | a ratio to a mean that may be 0: it is absent |
//! | are two quantities related | [`rank_correlation`] | from some 10 pairs on; it detects any monotonic relation | for a rise that becomes a fall: it may be 0 |
//! | which of many variants differ | [`holm`] on the p-values | the adjusted ones | the smallest of twenty raw p-values |
//!
//! Where Student's interval and the bootstrap's differ much, the values are skewed and n is small:
//! trust neither to its last digit, and run more. All of them assume independent runs, which
//! runs of different seeds are; robots of one run are not. Constant values give Student's interval no
//! width: by the rule of three (Hanley and Lippman-Hand 1983), `n` equal values only show that at
//! most about `3 / n` of all runs differ.
//!
//! A number that is not finite does not count as a value: [`Sample`] counts it as missing instead.

mod bootstrap;
mod interval;
pub mod least_squares;
mod moments;
mod paired;
mod quantile;
mod rank;
mod stopping;

pub use bootstrap::Bootstrap;
pub use interval::{
    Interval, clopper_pearson, mean_interval, mean_p_value, paired_difference, proportion_p_value,
    runs_for_half_width, wilson,
};
pub use moments::{Moments, Sample, mean, percentile, sample_sd};
pub use paired::{Pairs, holm};
pub use quantile::{QuantileInterval, quantile_interval, runs_for_quantile};
pub use rank::{Correlation, rank_correlation};
pub use stopping::{StopDecision, StopReason, StoppingRule};

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Returns the probability of a chi-square statistic at least this large if the model holds.
///
/// Without degrees of freedom nothing can deviate, and it returns 1.
pub fn chi_square_p_value(statistic: f64, degrees_of_freedom: usize) -> f64 {
    if degrees_of_freedom == 0 {
        return 1.0;
    }
    let distribution = ChiSquared::new(degrees_of_freedom as f64).expect("positive freedom");
    distribution.sf(statistic.max(0.0))
}

#[cfg(test)]
pub(crate) mod testing {
    /// Fails unless `a` is within `tolerance` of `b`.
    pub(crate) fn assert_close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance, "{a} is not {b}");
    }
}

#[cfg(test)]
mod tests {
    use super::testing::assert_close;
    use super::*;

    #[test]
    fn chi_square_tails_match_the_tables() {
        assert_close(chi_square_p_value(3.841_459, 1), 0.05, 1e-7);
        assert_close(chi_square_p_value(18.307_038, 10), 0.05, 1e-7);
        assert_close(chi_square_p_value(1000.0, 2), 0.0, 1e-100);
        assert_eq!(chi_square_p_value(5.0, 0), 1.0);
    }
}
