//! Rank correlation.

use crate::interval::Z_975;
use crate::{Interval, mean};
use serde::Serialize;
use sidestep_kernel::math;

/// A correlation with its 95 % confidence interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Correlation {
    /// Spearman's coefficient, from -1 (orders are opposite) to 1 (orders agree).
    pub value: f64,
    /// Its interval, by Fisher's transformation with the variance of Bonett and Wright (2000); absent
    /// with fewer than four pairs, or where the order is perfect.
    pub interval: Option<Interval>,
}

/// Returns Spearman's rank correlation of pairs; `None` where one of both is constant.
pub fn rank_correlation(pairs: &[(f64, f64)]) -> Option<Correlation> {
    let (x, y): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    let x = deviations(&ranks(&x))?;
    let y = deviations(&ranks(&y))?;
    let xy = sum_of_products(&x, &y);
    let xx = sum_of_products(&x, &x);
    let yy = sum_of_products(&y, &y);
    let value = xy / (xx * yy).sqrt();
    if !value.is_finite() {
        return None;
    }
    Some(Correlation { value, interval: fisher_interval(value, pairs.len()) })
}

/// Returns the differences of values from their mean.
fn deviations(values: &[f64]) -> Option<Vec<f64>> {
    let mean = mean(values)?;
    Some(values.iter().map(|value| value - mean).collect())
}

fn sum_of_products(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(a, b)| a * b).sum()
}

/// Returns the interval of a correlation of `n` pairs, which is symmetric in z = artanh(r).
fn fisher_interval(correlation: f64, n: usize) -> Option<Interval> {
    if n <= 3 || correlation.abs() >= 1.0 {
        return None;
    }
    let variance = (1.0 + 0.5 * correlation * correlation) / (n as f64 - 3.0);
    let half_width = Z_975 * variance.sqrt();
    let z = 0.5 * math::ln((1.0 + correlation) / (1.0 - correlation));
    Some(Interval { low: tanh(z - half_width), high: tanh(z + half_width) })
}

/// By `exp`, because [`math`] has no hyperbolic functions.
fn tanh(z: f64) -> f64 {
    1.0 - 2.0 / (math::exp(2.0 * z) + 1.0)
}

/// Returns the ranks of values from 1 on; equal values share the mean of their ranks.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut lower = 0;
    for group in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let rank = lower as f64 + 0.5 * (group.len() as f64 + 1.0);
        group.iter().for_each(|k| ranks[*k] = rank);
        lower += group.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::assert_close;

    #[test]
    fn ranks_count_and_not_distances() {
        let squares: Vec<(f64, f64)> =
            (0..9_i32).map(|k| (f64::from(k), f64::from(k * k))).collect();
        assert_eq!(rank_correlation(&squares), Some(Correlation { value: 1.0, interval: None }));
        assert_eq!(rank_correlation(&[(1.0, 2.0), (2.0, 2.0)]), None, "one of both is constant");
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0]), [3.5, 1.0, 3.5, 2.0]);
    }

    #[test]
    fn the_correlation_of_a_textbook_is_found() {
        // Ranks with squared differences of 194 in all, of 10 pairs: 1 - 6 * 194 / 990.
        let iq = [86.0, 97.0, 99.0, 100.0, 101.0, 103.0, 106.0, 110.0, 112.0, 113.0];
        let hours = [2.0, 20.0, 28.0, 27.0, 50.0, 29.0, 7.0, 17.0, 6.0, 12.0];
        let pairs: Vec<(f64, f64)> = iq.into_iter().zip(hours).collect();
        let found = rank_correlation(&pairs).expect("a correlation");
        assert_close(found.value, 1.0 - 6.0 * 194.0 / 990.0, 1e-12);
        let interval = found.interval.expect("of ten pairs");
        assert!(interval.contains(0.0) && interval.contains(found.value), "{interval:?}");
    }
}
