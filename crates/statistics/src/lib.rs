#![deny(clippy::disallowed_methods)]
#![doc = include_str!("../README.md")]

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
pub use moments::{Moments, Sample, is_tied, is_tied_measure, mean, percentile, sample_sd};
pub use paired::{MIN_TEST_PAIRS, Pairs, holm};
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
