//! Intervals, moments and tests with which every reported number is qualified.
//!
//! Intervals are two-sided at 95 % unless a function says otherwise. Nothing here draws
//! random numbers.

use serde::Serialize;
use statrs::distribution::{Beta, ChiSquared, ContinuousCDF, StudentsT};

/// The 0.975 quantile of the standard normal distribution.
const Z_975: f64 = 1.959_963_984_540_054;

/// A closed interval; written as `[low, high]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(into = "[f64; 2]")]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Whether `value` lies inside or on an end.
    pub fn contains(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    fn around(center: f64, half_width: f64) -> Self {
        Self { low: center - half_width, high: center + half_width }
    }
}

impl From<Interval> for [f64; 2] {
    fn from(interval: Interval) -> Self {
        [interval.low, interval.high]
    }
}

/// Wilson's 95 % score interval for a probability after `successes` in `n` trials.
///
/// `successes` may be fractional: the sum of `n` weights from 0 to 1. A weight varies at most
/// as much as a coin of the same mean, so the interval is then wider than it need be, never
/// too narrow. No trials: all of [0, 1].
pub fn wilson(successes: f64, n: f64) -> Interval {
    if n <= 0.0 {
        return Interval { low: 0.0, high: 1.0 };
    }
    let z2 = Z_975 * Z_975;
    let p = (successes / n).clamp(0.0, 1.0);
    let center = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let spread = (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    let half_width = Z_975 * spread / (1.0 + z2 / n);
    // At p = 0 and p = 1 the end is exactly p; rounding must not push it past.
    Interval {
        low: if p == 0.0 { 0.0 } else { (center - half_width).max(0.0) },
        high: if p == 1.0 { 1.0 } else { (center + half_width).min(1.0) },
    }
}

/// Clopper and Pearson's exact 95 % interval for a probability after `successes` in `n` trials.
///
/// Never covers less than 95 %; wider than [`wilson`]. No trials: all of [0, 1].
///
/// # Panics
/// When `successes` exceeds `n`.
pub fn clopper_pearson(successes: u64, n: u64) -> Interval {
    assert!(successes <= n, "more successes than trials");
    let (k, n) = (successes as f64, n as f64);
    let quantile =
        |a: f64, b: f64, p: f64| Beta::new(a, b).expect("positive shapes").inverse_cdf(p);
    Interval {
        low: if k > 0.0 { quantile(k, n - k + 1.0, 0.025) } else { 0.0 },
        high: if k < n { quantile(k + 1.0, n - k, 0.975) } else { 1.0 },
    }
}

/// Arithmetic mean; `None` of nothing.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Standard deviation of a sample (divisor `n - 1`); `None` of fewer than two values.
pub fn sample_sd(values: &[f64]) -> Option<f64> {
    let center = mean(values)?;
    let squares: f64 = values.iter().map(|v| (v - center) * (v - center)).sum();
    (values.len() > 1).then(|| (squares / (values.len() - 1) as f64).sqrt())
}

/// Student's 95 % interval for the mean of independent, roughly normal values.
///
/// `None` of fewer than two values.
pub fn mean_interval(values: &[f64]) -> Option<Interval> {
    let n = values.len() as f64;
    let (center, sd) = (mean(values)?, sample_sd(values)?);
    let t = StudentsT::new(0.0, 1.0, n - 1.0).expect("positive freedom").inverse_cdf(0.975);
    Some(Interval::around(center, t * sd / n.sqrt()))
}

/// Student's 95 % interval for the mean of `a[i] - b[i]`: two treatments of the same cases.
///
/// `None` of fewer than two pairs.
///
/// # Panics
/// When the slices differ in length.
pub fn paired_difference(a: &[f64], b: &[f64]) -> Option<Interval> {
    assert_eq!(a.len(), b.len(), "pairs");
    let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    mean_interval(&differences)
}

/// The value below which a fraction `q` of `sorted` lies, between two order statistics by
/// linear interpolation (type 7 of Hyndman and Fan); `None` of nothing.
pub fn percentile(sorted: &[f64], q: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let position = q.clamp(0.0, 1.0) * last as f64;
    let below = position.floor() as usize;
    let above = (below + 1).min(last);
    Some(sorted[below] + (position - below as f64) * (sorted[above] - sorted[below]))
}

/// Probability of a chi-square statistic at least this large when the model holds.
///
/// Without freedom nothing can deviate: 1.
pub fn chi_square_p(statistic: f64, degrees_of_freedom: usize) -> f64 {
    if degrees_of_freedom == 0 {
        return 1.0;
    }
    let law = ChiSquared::new(degrees_of_freedom as f64).expect("positive freedom");
    law.sf(statistic.max(0.0))
}

/// Size, mean, spread and percentiles of a set of measurements, in their unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Moments {
    /// Number of values.
    pub n: usize,
    /// Arithmetic mean.
    pub mean: f64,
    /// Standard deviation of the sample; 0 of a single value.
    pub sd: f64,
    /// 1st percentile.
    pub p01: f64,
    /// 5th percentile.
    pub p05: f64,
    /// Median.
    pub p50: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
}

impl Moments {
    /// The moments of `values`; `None` of nothing.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        Some(Self {
            n: sorted.len(),
            mean: mean(&sorted)?,
            sd: sample_sd(&sorted).unwrap_or(0.0),
            p01: percentile(&sorted, 0.01)?,
            p05: percentile(&sorted, 0.05)?,
            p50: percentile(&sorted, 0.50)?,
            p95: percentile(&sorted, 0.95)?,
            p99: percentile(&sorted, 0.99)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance, "{a} is not {b}");
    }

    #[test]
    fn wilson_gives_the_published_interval() {
        // R: prop.test(c(81), 263, correct = FALSE); Newcombe 1998, table I.
        let interval = wilson(81.0, 263.0);
        close(interval.low, 0.2553, 5e-5);
        close(interval.high, 0.3662, 5e-5);
        let none = wilson(0.0, 20.0);
        assert_eq!(none.low, 0.0);
        close(none.high, 0.1611, 5e-5);
        assert_eq!(wilson(20.0, 20.0).high, 1.0);
        assert_eq!(wilson(0.0, 0.0), Interval { low: 0.0, high: 1.0 });
    }

    #[test]
    fn clopper_pearson_gives_the_published_interval() {
        // Newcombe 1998, table I, method 5.
        let interval = clopper_pearson(81, 263);
        close(interval.low, 0.2527, 5e-5);
        close(interval.high, 0.3676, 5e-5);
        let none = clopper_pearson(0, 20);
        assert_eq!(none.low, 0.0);
        close(none.high, 0.1684, 5e-5);
        let all = clopper_pearson(20, 20);
        close(all.low, 0.8316, 5e-5);
        assert_eq!((all.high, clopper_pearson(0, 0).high), (1.0, 1.0));
    }

    #[test]
    fn the_mean_of_five_values_has_students_interval() {
        // t(4, 0.975) = 2.776445; sd = sqrt(2.5).
        let interval = mean_interval(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        close(interval.high - 3.0, 2.776_445 * (2.5_f64 / 5.0).sqrt(), 1e-6);
        close(3.0 - interval.low, interval.high - 3.0, 1e-12);
        assert_eq!(mean_interval(&[1.0]), None);
        assert_eq!(mean_interval(&[2.0, 2.0]), Some(Interval { low: 2.0, high: 2.0 }));
    }

    #[test]
    fn a_constant_difference_between_pairs_is_certain() {
        let interval = paired_difference(&[3.0, 8.0, 5.0], &[2.0, 7.0, 4.0]).unwrap();
        assert_eq!(interval, Interval { low: 1.0, high: 1.0 });
    }

    #[test]
    fn chi_square_tails_match_the_tables() {
        close(chi_square_p(3.841_459, 1), 0.05, 1e-7);
        close(chi_square_p(18.307_038, 10), 0.05, 1e-7);
        close(chi_square_p(1000.0, 2), 0.0, 1e-100);
        assert_eq!(chi_square_p(5.0, 0), 1.0);
    }

    #[test]
    fn percentiles_interpolate_between_order_statistics() {
        let sorted = [1.0, 2.0, 4.0];
        assert_eq!(percentile(&sorted, 0.25), Some(1.5));
        assert_eq!(percentile(&sorted, 1.0), Some(4.0));
        assert_eq!(percentile(&[], 0.5), None);
        let moments = Moments::of([4.0, 1.0, 2.0]).unwrap();
        assert_eq!((moments.n, moments.p50), (3, 2.0));
        close(moments.sd, (7.0_f64 / 3.0).sqrt(), 1e-12);
        assert!(Moments::of([]).is_none());
    }

    #[test]
    fn an_interval_is_written_as_a_pair() {
        let written = serde_json::to_string(&Interval { low: 0.25, high: 0.5 }).unwrap();
        assert_eq!(written, "[0.25,0.5]");
    }
}
