//! Percentiles, and distribution-free intervals of them.

use super::interval::{Interval, Z_975, binomial_cdf};
use serde::Serialize;
use sidestep_kernel::math;

/// An interval of a quantile between two order statistics.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct QuantileInterval {
    /// The two order statistics.
    pub interval: Interval,
    /// Their ranks, from 1.
    pub ranks: (usize, usize),
    /// Probability that such an interval contains the quantile: exact for continuous values, a
    /// lower bound for values with ties; at least 0.95.
    pub coverage: f64,
}

/// The largest probability that the quantile is beyond an end, on either side.
const MAX_TAIL_PROBABILITY: f64 = 0.025;

/// Above this many values the ranks are those of the normal approximation, widened outward to whole
/// ranks, because the library's incomplete beta function converges too slowly there.
const MAX_EXACT_VALUES: usize = 10_000;

/// Returns an interval of the `q`-quantile of the distribution that the values of `sorted` come
/// from, of any kind, by order statistics (Conover, Practical Nonparametric Statistics, 3.2):
/// the number of values below the quantile is binomial, so that each end misses with at most
/// 2.5 %.
///
/// `None` where `n` is too small for 95 %, see [`runs_for_quantile`], and for `q` outside (0, 1).
pub fn quantile_interval(sorted: &[f64], q: f64) -> Option<QuantileInterval> {
    let n = sorted.len();
    if !(q > 0.0 && q < 1.0) || n == 0 {
        return None;
    }
    let (low, high) = if n <= MAX_EXACT_VALUES { exact_ranks(n, q)? } else { normal_ranks(n, q)? };
    let interval = Interval { low: sorted[low - 1], high: sorted[high - 1] };
    let coverage = if n <= MAX_EXACT_VALUES {
        binomial_cdf(high - 1, n, q) - binomial_cdf(low - 1, n, q)
    } else {
        1.0 - 2.0 * MAX_TAIL_PROBABILITY
    };
    Some(QuantileInterval { interval, ranks: (low, high), coverage })
}

/// Returns the smallest number of runs for which [`quantile_interval`] has an answer: 6 for the
/// median, 72 for the 5th and 95th percentile. `None` for `q` outside (0, 1).
pub fn runs_for_quantile(q: f64) -> Option<usize> {
    if !(q > 0.0 && q < 1.0) {
        return None;
    }
    // All values are on one side of the quantile with probability inner^n, which must be small enough.
    let inner = q.max(1.0 - q);
    Some((math::ln(MAX_TAIL_PROBABILITY) / math::ln(inner)).ceil() as usize)
}

/// Returns the smallest rank from 1 on for which `condition` holds, or `n + 1`; it must then hold for all larger ranks.
fn first_rank(n: usize, condition: impl Fn(usize) -> bool) -> usize {
    let mut low = 0;
    let mut high = n + 1;
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if condition(middle) { high = middle } else { low = middle }
    }
    high
}

fn exact_ranks(n: usize, q: f64) -> Option<(usize, usize)> {
    // Fewer than `low` values are below the quantile, or at least `high` are, with at most this probability each.
    let low = first_rank(n, |rank| binomial_cdf(rank - 1, n, q) > MAX_TAIL_PROBABILITY) - 1;
    let high = first_rank(n, |rank| binomial_cdf(rank - 1, n, q) >= 1.0 - MAX_TAIL_PROBABILITY);
    (low >= 1 && high <= n).then_some((low, high))
}

fn normal_ranks(n: usize, q: f64) -> Option<(usize, usize)> {
    let n_f = n as f64;
    let spread = Z_975 * (n_f * q * (1.0 - q)).sqrt();
    let low = (n_f * q - spread).floor();
    let high = (n_f * q + spread).ceil() + 1.0;
    (low >= 1.0 && high <= n_f).then_some((low as usize, high as usize))
}

#[cfg(test)]
mod tests {
    use super::super::moments::percentile;
    use super::super::testing::assert_close;
    use super::*;
    use proptest::prelude::*;
    use sidestep_kernel::Seed;
    use sidestep_kernel::stream::{Purpose, Streams};

    fn ranks(n: usize) -> Vec<f64> {
        (1..=n).map(|i| i as f64).collect()
    }

    #[test]
    fn percentiles_interpolate_between_order_statistics() {
        let sorted = [1.0, 2.0, 4.0];
        assert_eq!(percentile(&sorted, 0.25), Some(1.5));
        assert_eq!(percentile(&sorted, 1.0), Some(4.0));
        assert_eq!(percentile(&[], 0.5), None);
    }

    #[test]
    fn the_interval_of_the_median_has_the_tabled_ranks() {
        // Ranks of the sign test's 95 % interval: Conover, Practical Nonparametric Statistics;
        // Dixon and Massey, table A-25: n = 6: 1, 10: 2, 15: 4, 20: 6, 25: 8, 50: 18, 100: 40.
        for (n, low) in
            [(6, 1), (8, 1), (9, 2), (10, 2), (15, 4), (20, 6), (25, 8), (50, 18), (100, 40)]
        {
            let found = quantile_interval(&ranks(n), 0.5).unwrap();
            assert_eq!(found.ranks, (low, n + 1 - low), "n = {n}");
        }
        // 1 - 2 * 0.5^6 and 1 - 22 * 0.5^10.
        assert_close(quantile_interval(&ranks(6), 0.5).unwrap().coverage, 0.968_75, 1e-12);
        assert_close(quantile_interval(&ranks(10), 0.5).unwrap().coverage, 0.978_515_625, 1e-12);
    }

    #[test]
    fn too_few_values_give_no_interval() {
        for (q, needed) in [(0.5, 6), (0.05, 72), (0.95, 72), (0.25, 13), (0.75, 13)] {
            assert_eq!(runs_for_quantile(q), Some(needed));
            assert!(quantile_interval(&ranks(needed), q).is_some(), "{q}");
            assert_eq!(quantile_interval(&ranks(needed - 1), q), None, "{q}");
        }
        for q in [0.0, 1.0, -1.0, f64::NAN] {
            assert_eq!((runs_for_quantile(q), quantile_interval(&ranks(100), q)), (None, None));
        }
        assert_eq!(quantile_interval(&[], 0.5), None);
    }

    #[test]
    fn approximate_ranks_continue_the_exact_ones() {
        for q in [0.05, 0.5, 0.75] {
            let (exact, normal) = (
                exact_ranks(MAX_EXACT_VALUES, q).unwrap(),
                normal_ranks(MAX_EXACT_VALUES, q).unwrap(),
            );
            assert!(exact.0.abs_diff(normal.0) <= 2 && exact.1.abs_diff(normal.1) <= 2);
        }
        assert!(quantile_interval(&ranks(100_000), 0.5).is_some());
    }

    /// 2,000 samples of 20 uniform values, fixed seed; the coverage is 0.9586 exactly, its
    /// standard error 0.0045: a right interval fails with probability below 1e-4 (4 errors).
    #[test]
    fn the_median_is_covered_as_often_as_told() {
        let (samples, n) = (2000, 20);
        let mut told = 0.0;
        let covered = (0..samples).filter(|&k| {
            let mut draws = Streams::new(Seed(11)).draws(k, 0, Purpose(0));
            let mut values: Vec<f64> = (0..n).map(|_| draws.uniform()).collect();
            values.sort_by(f64::total_cmp);
            let found = quantile_interval(&values, 0.5).unwrap();
            told = found.coverage;
            found.interval.contains(0.5)
        });
        assert_close(covered.count() as f64 / f64::from(samples), told, 4.0 * 0.0045);
        assert_close(told, 0.958_6, 1e-4);
    }

    proptest! {
        #[test]
        fn an_interval_holds_its_percentile_and_covers_what_it_must(
            mut values in prop::collection::vec(-1e6_f64..1e6, 1..200), q in 0.01_f64..0.99,
        ) {
            values.sort_by(f64::total_cmp);
            if let Some(found) = quantile_interval(&values, q) {
                prop_assert!(found.coverage >= 0.95 - 1e-12 && found.coverage <= 1.0);
                prop_assert!(found.interval.contains(percentile(&values, q).unwrap()));
            } else {
                prop_assert!(values.len() < runs_for_quantile(q).unwrap());
            }
        }
    }
}
