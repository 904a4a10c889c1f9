//! Mean, spread and percentiles, summed so that extreme magnitudes do no harm.

use serde::Serialize;

/// The values of a metric over runs: the finite ones, in the order of the runs, and the number of
/// runs without one.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Sample {
    /// The finite values, in the order of the runs.
    pub values: Vec<f64>,
    /// Number of runs without a value, or with one that is infinite or not a number.
    pub missing: usize,
    /// Number of runs among these with a value that is infinite or not a number.
    pub not_finite: usize,
}

impl Sample {
    /// Creates the sample of these runs, one item each; `None` for a run without a value.
    pub fn from_runs(runs: impl IntoIterator<Item = Option<f64>>) -> Self {
        let mut sample = Self::default();
        for value in runs {
            match value {
                Some(value) if value.is_finite() => sample.values.push(value),
                Some(_) => {
                    sample.missing += 1;
                    sample.not_finite += 1;
                }
                None => sample.missing += 1,
            }
        }
        sample
    }

    /// Returns the values from the smallest to the largest.
    pub fn sorted(&self) -> Vec<f64> {
        let mut sorted = self.values.clone();
        sorted.sort_by(f64::total_cmp);
        sorted
    }
}

/// Returns a power of two near the largest magnitude: a value divided by it can be squared and
/// summed without overflow, and loses no digit by the division.
fn scale(values: &[f64]) -> f64 {
    power_of_two(largest_magnitude(values))
}

/// Returns the power of two at or below a magnitude; 1 where there is none.
fn power_of_two(largest: f64) -> f64 {
    // Its exponent alone.
    let power = f64::from_bits(largest.to_bits() & 0x7ff0_0000_0000_0000);
    if power > 0.0 && power.is_finite() { power } else { 1.0 }
}

/// Returns Neumaier's compensated sum: the error does not grow with the number of terms.
pub(super) fn sum(terms: impl IntoIterator<Item = f64>) -> f64 {
    let mut total = 0.0_f64;
    let mut lost = 0.0;
    for term in terms {
        let next = total + term;
        lost +=
            if total.abs() >= term.abs() { (total - next) + term } else { (term - next) + total };
        total = next;
    }
    // Past the range of numbers the compensation is not a number either.
    if lost.is_finite() { total + lost } else { total }
}

/// Returns whether all values are equal; true without values.
pub(super) fn is_constant(values: &[f64]) -> bool {
    values.windows(2).all(|pair| pair[0] == pair[1])
}

/// The part of the largest magnitude up to which a spread is rounding: sums in another order, or of turned positions,
/// differ by less, and no effect that runs can show is as small.
pub(super) const TIE_FRACTION: f64 = 1e-9;

/// Returns whether all values are equal but for rounding: their standard deviation is at most 1e-9 of the largest
/// magnitude. True for fewer than two values.
pub fn is_tied(values: &[f64]) -> bool {
    let sd = sample_sd(values).unwrap_or(0.0);
    sd <= TIE_FRACTION * largest_magnitude(values)
}

/// Returns whether all values of a measured quantity are equal but for rounding. Whole numbers are none: a count may be
/// the same in a few runs by chance.
pub fn is_tied_measure(values: &[f64]) -> bool {
    is_tied(values) && values.iter().any(|value| value.fract() != 0.0)
}

/// Returns the largest magnitude of some values; 0 without any.
pub(super) fn largest_magnitude(values: &[f64]) -> f64 {
    values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()))
}

/// Returns the arithmetic mean; `None` without values. For equal values it is that value, to the
/// bit.
pub fn mean(values: &[f64]) -> Option<f64> {
    let first = *values.first()?;
    if is_constant(values) {
        return Some(first);
    }
    let scale = scale(values);
    Some(sum(values.iter().map(|v| v / scale)) / values.len() as f64 * scale)
}

/// Returns the standard deviation of a sample (divisor `n - 1`); `None` for fewer than two values.
/// For equal values it is exactly 0.
pub fn sample_sd(values: &[f64]) -> Option<f64> {
    let (squares, scale) = sum_of_squares(values)?;
    (values.len() > 1).then(|| (squares / (values.len() - 1) as f64).sqrt() * scale)
}

/// Returns the sum of squared deviations from the mean in units of `scale * scale`, and that scale;
/// `None` without values.
fn sum_of_squares(values: &[f64]) -> Option<(f64, f64)> {
    sum_of_squares_about(mean(values)?, values)
}

/// Returns the same by the mean `center`, which millions of values need only once.
fn sum_of_squares_about(center: f64, values: &[f64]) -> Option<(f64, f64)> {
    if is_constant(values) {
        return values.first().map(|_| (0.0, 1.0));
    }
    // Halves, because the difference of two values may exceed the largest number.
    let deviations = || values.iter().map(|v| 0.5 * v - 0.5 * center);
    let scale = power_of_two(deviations().fold(0.0, |largest, d| d.abs().max(largest)));
    let squares = sum(deviations().map(|d| (d / scale) * (d / scale)));
    // The error that the rounding of the mean adds to all deviations, which Chan's corrected two-pass algorithm takes off.
    let error = sum(deviations().map(|d| d / scale));
    Some(((squares - error * error / values.len() as f64).max(0.0) * 4.0, scale))
}

/// The value below which a fraction `q` of `sorted` is, between two order statistics by
/// linear interpolation (type 7 of Hyndman and Fan); `None` without values.
pub fn percentile(sorted: &[f64], q: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let position = q.clamp(0.0, 1.0) * last as f64;
    let below = position.floor() as usize;
    let above = (below + 1).min(last);
    Some(sorted[below] + (position - below as f64) * (sorted[above] - sorted[below]))
}

/// Size, mean, spread and percentiles of a set of measurements, in their unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Moments {
    /// Number of values, at least 1.
    pub n: usize,
    /// Arithmetic mean.
    pub mean: f64,
    /// Standard deviation of exactly these values (divisor `n`).
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
    /// Returns the moments of `values`; `None` without values.
    pub fn from_values(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let sorted = sorted(values);
        let mean = mean(&sorted)?;
        let (squares, scale) = sum_of_squares_about(mean, &sorted)?;
        Some(Self {
            n: sorted.len(),
            mean,
            sd: (squares / sorted.len() as f64).sqrt() * scale,
            p01: percentile(&sorted, 0.01)?,
            p05: percentile(&sorted, 0.05)?,
            p50: percentile(&sorted, 0.50)?,
            p95: percentile(&sorted, 0.95)?,
            p99: percentile(&sorted, 0.99)?,
        })
    }
}

/// Returns values in the order of [`f64::total_cmp`], sorted as integers: these are compared in fewer steps, and the
/// list is used again without memory beside it.
fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut keys: Vec<i64> = values.into_iter().map(|value| value.to_bits() as i64).collect();
    keys.iter_mut().for_each(|key| *key = in_order(*key));
    keys.sort_unstable();
    keys.into_iter().map(|key| f64::from_bits(in_order(key) as u64)).collect()
}

/// Turns the bits of a number into an integer that is ordered like it, and back: those of numbers below 0 fall where the
/// numbers rise.
fn in_order(bits: i64) -> i64 {
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

#[cfg(test)]
mod tests {
    use super::super::testing::assert_close;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn values_are_sorted_like_numbers() {
        let mut values =
            vec![3.5, -0.0, 0.0, -2.0, f64::INFINITY, -1e-300, 1e-300, f64::NEG_INFINITY];
        let found = sorted(values.clone());
        values.sort_by(f64::total_cmp);
        let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&found), bits(&values));
    }

    #[test]
    fn moments_have_their_divisors() {
        let moments = Moments::from_values([4.0, 1.0, 2.0]).unwrap();
        assert_eq!((moments.n, moments.p50), (3, 2.0));
        assert_close(moments.sd, (14.0_f64 / 9.0).sqrt(), 1e-12);
        assert_close(sample_sd(&[4.0, 1.0, 2.0]).unwrap(), (7.0_f64 / 3.0).sqrt(), 1e-12);
        assert!(Moments::from_values([]).is_none());
        assert_eq!((mean(&[]), sample_sd(&[1.0])), (None, None));
    }

    /// NIST Statistical Reference Datasets, NumAcc3 and NumAcc4 (univariate, certified values):
    /// 1000000.2 and 10000000.2, then 500 pairs of .1 and .3 beyond them; mean as the first
    /// value, sd 0.1.
    #[test]
    fn the_certified_values_of_nist_are_met() {
        for base in [1_000_000.0, 10_000_000.0] {
            let mut values = vec![base + 0.2];
            (0..500).for_each(|_| values.extend([base + 0.1, base + 0.3]));
            assert_close(mean(&values).unwrap(), base + 0.2, 2e-9);
            assert_close(sample_sd(&values).unwrap(), 0.1, 1e-8);
        }
    }

    #[test]
    fn huge_and_tiny_magnitudes_keep_their_digits() {
        assert_eq!(mean(&[1e16, 1.0, -1e16]), Some(1.0 / 3.0));
        assert_eq!(mean(&[f64::MAX, f64::MAX, -f64::MAX]), Some(f64::MAX / 3.0));
        for unit in [1e-300, 1.0, 1e300] {
            let values = [1.0 * unit, 2.0 * unit, 4.0 * unit];
            assert_close(mean(&values).unwrap() / unit, 7.0 / 3.0, 1e-15 * 3.0);
            assert_close(sample_sd(&values).unwrap() / unit, (7.0_f64 / 3.0).sqrt(), 1e-15 * 3.0);
        }
    }

    #[test]
    fn what_is_no_finite_number_is_counted_as_missing() {
        let runs = [Some(1.0), None, Some(f64::NAN), Some(f64::INFINITY), Some(3.0)];
        let sample = Sample::from_runs(runs);
        assert_eq!(
            (sample.values.as_slice(), sample.missing, sample.not_finite),
            (&[1.0, 3.0][..], 3, 2)
        );
        assert_eq!(Sample::from_runs([Some(2.0), Some(-1.0)]).sorted(), [-1.0, 2.0]);
    }

    proptest! {
        #[test]
        fn no_values_make_the_moments_panic(values in prop::collection::vec(prop::num::f64::ANY, 0..20)) {
            let _ = (mean(&values), sample_sd(&values), Moments::from_values(values.iter().copied()));
            let sample = Sample::from_runs(values.iter().map(|v| Some(*v)));
            if let Some(mean) = mean(&sample.values) {
                prop_assert!(mean.is_finite());
                prop_assert!(sample_sd(&sample.values).is_none_or(|sd| sd >= 0.0));
            }
        }

        #[test]
        fn the_mean_lies_between_the_extremes_and_equal_values_have_no_spread(
            value in -1e9_f64..1e9, more in prop::collection::vec(-1e9_f64..1e9, 1..30), n in 1_usize..40,
        ) {
            let equal = vec![value; n];
            prop_assert_eq!(mean(&equal), Some(value));
            prop_assert!(n < 2 || sample_sd(&equal) == Some(0.0));
            let sorted = Sample::from_runs(more.iter().map(|v| Some(*v))).sorted();
            let mean = mean(&more).unwrap();
            prop_assert!(sorted[0] <= mean && mean <= sorted[sorted.len() - 1]);
        }
    }
}
