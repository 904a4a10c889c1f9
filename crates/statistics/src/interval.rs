//! Intervals of proportions and of means.

use super::moments::{mean, sample_sd};
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF, StudentsT};
use statrs::function::beta::checked_beta_reg;

/// The 0.975 quantile of the standard normal distribution.
pub(super) const Z_975: f64 = 1.959_963_984_540_054;

/// A closed interval; written as `[low, high]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(into = "[f64; 2]")]
pub struct Interval {
    /// Lower end, which belongs to the interval.
    pub low: f64,
    /// Upper end, which belongs to the interval.
    pub high: f64,
}

impl Interval {
    /// Returns whether `value` lies inside or on an end.
    pub fn contains(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// Half the distance between its ends.
    pub fn half_width(&self) -> f64 {
        0.5 * self.high - 0.5 * self.low
    }

    pub(super) fn from_center(center: f64, half_width: f64) -> Self {
        Self { low: center - half_width, high: center + half_width }
    }
}

impl From<Interval> for [f64; 2] {
    fn from(interval: Interval) -> Self {
        [interval.low, interval.high]
    }
}

/// Returns Wilson's 95 % score interval for a probability after `successes` in `n` trials.
///
/// `successes` may be fractional: the sum of `n` weights from 0 to 1. A weight varies at most as
/// much as a coin of the same mean, so the interval is then wider than necessary, never too narrow.
/// Without trials it is all of [0, 1].
pub fn wilson(successes: f64, n: f64) -> Interval {
    if n <= 0.0 {
        return Interval { low: 0.0, high: 1.0 };
    }
    let z2 = Z_975 * Z_975;
    let p = (successes / n).clamp(0.0, 1.0);
    let center = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let spread = (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    let half_width = Z_975 * spread / (1.0 + z2 / n);
    // At p = 0 and p = 1 the end is exactly p, and rounding must not push it past.
    Interval {
        low: if p == 0.0 { 0.0 } else { (center - half_width).max(0.0) },
        high: if p == 1.0 { 1.0 } else { (center + half_width).min(1.0) },
    }
}

/// Returns Clopper and Pearson's exact 95 % interval for a probability after `successes` in `n`
/// trials.
///
/// Never covers less than 95 %; wider than [`wilson`]. Without trials it is all of [0, 1].
///
/// # Panics
/// When `successes` exceeds `n`.
pub fn clopper_pearson(successes: u64, n: u64) -> Interval {
    assert!(successes <= n, "more successes than trials");
    let k = successes as f64;
    let n = n as f64;
    // Quantiles of the binomial's tails are quantiles of beta distributions.
    Interval {
        low: if k > 0.0 { beta_quantile(k, n - k + 1.0, 0.025) } else { 0.0 },
        high: if k < n { beta_quantile(k + 1.0, n - k, 0.975) } else { 1.0 },
    }
}

fn beta_quantile(a: f64, b: f64, p: f64) -> f64 {
    Beta::new(a, b).expect("positive shapes").inverse_cdf(p)
}

/// Returns the two-sided p-value of the exact binomial test that a probability is `probability`, inside
/// (0, 1), after `successes` in `n` trials.
///
/// Below 0.05 where the interval of [`clopper_pearson`] excludes `probability`.
pub fn proportion_p_value(successes: u64, n: u64, probability: f64) -> f64 {
    let k = successes as usize;
    let n = n as usize;
    let at_least = if k == 0 { 1.0 } else { 1.0 - binomial_cdf(k - 1, n, probability) };
    (2.0 * binomial_cdf(k, n, probability).min(at_least)).min(1.0)
}

/// Returns the two-sided p-value of Student's test that a mean is `value`, from the 95 % interval
/// that [`mean_interval`] gives for `n` values.
///
/// Below 0.05 where the interval excludes `value`. An interval without width says that all values
/// are equal: then 1 if they are `value`, and 0 otherwise.
pub fn mean_p_value(interval: Interval, n: usize, value: f64) -> f64 {
    let half_width = interval.half_width();
    let freedom = n.max(2) - 1;
    let deviation = (0.5 * interval.low + 0.5 * interval.high - value).abs();
    if half_width == 0.0 || deviation == 0.0 {
        return f64::from(deviation == 0.0);
    }
    student_p_value(deviation / half_width * student_t(freedom), freedom).unwrap_or(1.0)
}

/// Returns the probability that Student's t is at least this far from 0; `None` if `t` is no number.
pub(super) fn student_p_value(t: f64, freedom: usize) -> Option<f64> {
    let freedom = freedom as f64;
    let x = freedom / (freedom + t * t);
    checked_beta_reg(0.5 * freedom, 0.5, x).ok().filter(|p| p.is_finite())
}

/// Returns the 0.975 quantile of Student's t with this many degrees of freedom, at least 1.
///
/// From 100 on by its expansion around the normal's (Abramowitz and Stegun 26.7.5), which is
/// accurate to 1e-9 there; the library's inverse stops too early and is 7e-6 off at 100,000.
pub(super) fn student_t(freedom: usize) -> f64 {
    let n = freedom.max(1) as f64;
    if freedom < 100 {
        return StudentsT::new(0.0, 1.0, n).expect("positive freedom").inverse_cdf(0.975);
    }
    let z = Z_975;
    let z2 = z * z;
    let terms = [
        (z2 + 1.0) / 4.0,
        ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0,
        (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0,
        ((((79.0 * z2 + 776.0) * z2 + 1482.0) * z2 - 1920.0) * z2 - 945.0) / 92_160.0,
    ];
    z * (1.0 + terms.iter().rev().fold(0.0, |rest, term| (rest + term) / n))
}

/// Returns Student's 95 % interval for the mean of independent, roughly normal values.
///
/// `None` for fewer than two values, and where some value is not finite. An end past the largest
/// number is infinite.
pub fn mean_interval(values: &[f64]) -> Option<Interval> {
    if !values.iter().all(|v| v.is_finite()) {
        return None;
    }
    let center = mean(values)?;
    let sd = sample_sd(values)?;
    let t = student_t(values.len() - 1);
    Some(Interval::from_center(center, t * (sd / (values.len() as f64).sqrt())))
}

/// Returns Student's 95 % interval for the mean of `a[i] - b[i]`: two treatments of the same cases.
///
/// `None` for fewer than two pairs.
///
/// # Panics
/// When the slices differ in length.
pub fn paired_difference(a: &[f64], b: &[f64]) -> Option<Interval> {
    assert_eq!(a.len(), b.len(), "pairs");
    let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    mean_interval(&differences)
}

/// Returns the smallest number of runs with a mean that is expected to have an interval of at
/// most `half_width` to either side, if runs vary by `sd`:
/// `t(n - 1) * sd / sqrt(n) <= half_width`.
///
/// An expectation, not a guarantee: `sd` is itself estimated, and at this number about half of
/// all samples are a little wider. `None` where no number of runs (below 2^53) is enough.
pub fn runs_for_half_width(sd: f64, half_width: f64) -> Option<u64> {
    if !(sd >= 0.0 && sd.is_finite() && half_width >= 0.0) {
        return None;
    }
    let is_enough = |n: u64| student_t(n as usize - 1) * sd <= half_width * (n as f64).sqrt();
    // Doubling, and bisection between the last two, because t depends on the number that is sought.
    let mut high = 2_u64;
    while !is_enough(high) {
        high = high.checked_mul(2).filter(|n| *n < 1 << 53)?;
    }
    let mut low = high / 2;
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if is_enough(middle) { high = middle } else { low = middle }
    }
    Some(high)
}

/// Returns the probability of at most `k` successes in `n` trials of probability `q`.
pub(super) fn binomial_cdf(k: usize, n: usize, q: f64) -> f64 {
    if k >= n {
        return 1.0;
    }
    checked_beta_reg((n - k) as f64, k as f64 + 1.0, 1.0 - q).expect("q is in (0, 1)")
}

#[cfg(test)]
mod tests {
    use super::super::testing::assert_close;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn wilson_gives_the_published_interval() {
        // R: prop.test(c(81), 263, correct = FALSE); Newcombe 1998, table I.
        let interval = wilson(81.0, 263.0);
        assert_close(interval.low, 0.2553, 5e-5);
        assert_close(interval.high, 0.3662, 5e-5);
        let none = wilson(0.0, 20.0);
        assert_eq!(none.low, 0.0);
        assert_close(none.high, 0.1611, 5e-5);
        assert_eq!(wilson(20.0, 20.0).high, 1.0);
        assert_eq!(wilson(0.0, 0.0), Interval { low: 0.0, high: 1.0 });
    }

    #[test]
    fn clopper_pearson_gives_the_published_interval() {
        // Newcombe 1998, table I, method 5.
        let interval = clopper_pearson(81, 263);
        assert_close(interval.low, 0.2527, 5e-5);
        assert_close(interval.high, 0.3676, 5e-5);
        let none = clopper_pearson(0, 20);
        assert_eq!(none.low, 0.0);
        assert_close(none.high, 0.1684, 5e-5);
        let all = clopper_pearson(20, 20);
        assert_close(all.low, 0.8316, 5e-5);
        assert_eq!((all.high, clopper_pearson(0, 0).high), (1.0, 1.0));
    }

    #[test]
    fn students_quantiles_are_those_of_the_tables() {
        // Abramowitz and Stegun, table 26.10; R: qt(0.975, c(1, 2, 4, 9, 29, 120)).
        let table = [
            (1, 12.706_205),
            (2, 4.302_653),
            (4, 2.776_445),
            (9, 2.262_157),
            (29, 2.045_230),
            (120, 1.979_930),
        ];
        table.iter().for_each(|&(freedom, t)| assert_close(student_t(freedom), t, 1e-6));
        // The library's inverse and the expansion meet: R gives qt(0.975, 99:100).
        assert_close(student_t(99), 1.984_216_95, 2e-8);
        assert_close(student_t(100), 1.983_971_52, 2e-8);
        assert_close(student_t(100_000), 1.959_987_71, 1e-8);
        assert_close(student_t(usize::MAX), Z_975, 1e-12);
    }

    #[test]
    fn the_mean_of_five_values_has_students_interval() {
        // t(4, 0.975) = 2.776445; sd = sqrt(2.5).
        let interval = mean_interval(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        assert_close(interval.high - 3.0, 2.776_445 * (2.5_f64 / 5.0).sqrt(), 1e-6);
        assert_close(3.0 - interval.low, interval.high - 3.0, 1e-12);
        assert_eq!(mean_interval(&[1.0]), None);
        assert_eq!(mean_interval(&[2.0, 2.0]), Some(Interval { low: 2.0, high: 2.0 }));
        assert_eq!(mean_interval(&[0.1; 7]), Some(Interval { low: 0.1, high: 0.1 }));
        assert_eq!(mean_interval(&[1.0, f64::NAN, 2.0]), None);
        assert_eq!(mean_interval(&[1.0, f64::INFINITY]), None);
        let huge = mean_interval(&[f64::MAX, -f64::MAX]).unwrap();
        assert_eq!((huge.low, huge.high), (f64::NEG_INFINITY, f64::INFINITY));
    }

    #[test]
    fn a_constant_difference_between_pairs_is_certain() {
        let interval = paired_difference(&[3.0, 8.0, 5.0], &[2.0, 7.0, 4.0]).unwrap();
        assert_eq!(interval, Interval { low: 1.0, high: 1.0 });
    }

    #[test]
    fn the_number_of_runs_for_a_half_width_is_the_smallest() {
        // t(17, 0.975) = 2.109816, / sqrt(18) = 0.4973; t(16) / sqrt(17) = 0.5142.
        assert_eq!(runs_for_half_width(1.0, 0.5), Some(18));
        assert_eq!(runs_for_half_width(0.0, 0.0), Some(2));
        assert_eq!(runs_for_half_width(1.0, 0.0), None);
        assert_eq!(runs_for_half_width(f64::NAN, 1.0), None);
        assert_eq!(runs_for_half_width(1.0, f64::NAN), None);
        assert_eq!(runs_for_half_width(1.0, 0.01).unwrap(), 38_418);
    }

    #[test]
    fn p_values_from_an_interval_are_those_of_the_test() {
        // R: t.test(c(1, 2, 3, 4, 5), mu = 1): 0.04742; binom.test(8, 10, 0.5): 0.1094.
        let interval = mean_interval(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        assert_close(mean_p_value(interval, 5, 1.0), 0.047_421, 1e-6);
        assert_close(mean_p_value(interval, 5, 3.0), 1.0, 0.0);
        assert_close(proportion_p_value(8, 10, 0.5), 0.109_375, 1e-9);
        assert_close(proportion_p_value(0, 10, 0.5), 2.0 / 1024.0, 1e-9);
        let sure = Interval { low: 2.0, high: 2.0 };
        assert_eq!([1.0, 2.0].map(|value| mean_p_value(sure, 7, value)), [0.0, 1.0]);
    }

    #[test]
    fn an_interval_is_written_as_a_pair() {
        let written = serde_json::to_string(&Interval { low: 0.25, high: 0.5 }).unwrap();
        assert_eq!(written, "[0.25,0.5]");
    }

    proptest! {
        #[test]
        fn students_interval_holds_the_mean_and_never_panics(
            values in prop::collection::vec(prop::num::f64::ANY, 0..12),
        ) {
            if let Some(interval) = mean_interval(&values) {
                prop_assert!(interval.contains(mean(&values).unwrap()));
            }
        }

        #[test]
        fn a_p_value_below_a_twentieth_is_an_interval_that_excludes(
            values in prop::collection::vec(-2.0_f64..3.0, 2..12),
            (hits, n) in (1_u64..40).prop_flat_map(|n| (0..=n, Just(n))),
            share in 0.01_f64..0.99,
        ) {
            let interval = mean_interval(&values).unwrap();
            let p = mean_p_value(interval, values.len(), 0.0);
            prop_assert!((p - 0.05).abs() < 1e-6 || (p > 0.05) == interval.contains(0.0), "{p}");
            let p = proportion_p_value(hits, n, share);
            let excluded = !clopper_pearson(hits, n).contains(share);
            prop_assert!((p - 0.05).abs() < 1e-6 || (p < 0.05) == excluded, "{p}");
        }

        #[test]
        fn one_run_less_would_not_do(sd in 0.01_f64..100.0, half_width in 0.05_f64..100.0) {
            let n = runs_for_half_width(sd, half_width).unwrap();
            let width = |n: u64| student_t(n as usize - 1) * sd / (n as f64).sqrt();
            prop_assert!(width(n) <= half_width * (1.0 + 1e-12));
            prop_assert!(n == 2 || width(n - 1) > half_width * (1.0 - 1e-12));
        }
    }
}
