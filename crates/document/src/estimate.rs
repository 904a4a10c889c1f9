//! A mean with its uncertainty.

use super::figure::Point;
use serde::Serialize;
use sidestep_statistics::{Interval, mean, mean_interval, mean_p_value};
use std::fmt;

/// A mean over runs, its 95 % interval by Student's t, and the number of runs behind it.
///
/// Displayed as `12.3 [11.9, 12.7] n=20`; without runs as `-`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// Arithmetic mean; absent without values.
    pub mean: Option<f64>,
    /// 95 % interval of the mean; absent with fewer than two values.
    pub interval: Option<Interval>,
    /// Number of values that exist; missing ones do not count.
    pub n: usize,
    /// The interval before it was clamped to the bounds of the quantity; p-values follow from it.
    #[serde(skip)]
    unclamped: Option<Interval>,
    /// Whether it is a geometric mean, with Student's interval of the logarithms.
    #[serde(skip)]
    is_factor: bool,
}

impl Estimate {
    /// Returns the mean of those runs that have a value.
    pub fn from_values(values: impl IntoIterator<Item = Option<f64>>) -> Self {
        let values: Vec<f64> = values.into_iter().flatten().filter(|v| v.is_finite()).collect();
        let interval = mean_interval(&values);
        Self {
            mean: mean(&values),
            interval,
            n: values.len(),
            unclamped: interval,
            is_factor: false,
        }
    }

    /// Returns the geometric mean of those factors that exist and are above 0, with the interval
    /// of the mean of their logarithms: so no end of it is below 0, and the inverse of all factors
    /// has the inverse interval.
    pub fn from_factors(factors: impl IntoIterator<Item = Option<f64>>) -> Self {
        let positive = factors.into_iter().map(|factor| factor.filter(|factor| *factor > 0.0));
        let logarithms = Self::from_values(positive.map(|factor| factor.map(f64::ln)));
        let interval = logarithms
            .interval
            .map(|interval| Interval { low: interval.low.exp(), high: interval.high.exp() });
        Self {
            mean: logarithms.mean.map(f64::exp),
            interval,
            n: logarithms.n,
            unclamped: interval,
            is_factor: true,
        }
    }

    /// Returns the same estimate of a quantity that is never below `low` nor above `high`, and so neither is an end of
    /// its interval.
    #[must_use]
    pub fn clamped(self, low: f64, high: f64) -> Self {
        let interval = self
            .interval
            .map(|interval| Interval { low: interval.low.max(low), high: interval.high.min(high) });
        Self { interval, ..self }
    }

    /// Returns the mean of `a[i] - b[i]` over the pairs in which both have a value: two treatments
    /// of the same case, so that effects of the case itself cancel.
    pub fn paired_difference(a: &[Option<f64>], b: &[Option<f64>]) -> Self {
        Self::from_values(a.iter().zip(b).map(|(a, b)| Some((*a)? - (*b)?)))
    }

    /// Returns the geometric mean of `a[i] / b[i]` over the pairs in which both are above 0.
    pub fn geometric_ratio(a: &[Option<f64>], b: &[Option<f64>]) -> Self {
        Self::from_factors(a.iter().zip(b).map(|(a, b)| Some((*a)? / (*b)?)))
    }

    /// Returns the two-sided p-value of Student's test that the mean is `value`; `None` with fewer
    /// than two values.
    pub fn p_value(&self, value: f64) -> Option<f64> {
        let interval = self.unclamped?;
        if !self.is_factor {
            return Some(mean_p_value(interval, self.n, value));
        }
        // A geometric mean is never 0 or below.
        if value <= 0.0 {
            return Some(0.0);
        }
        let logarithms = Interval { low: interval.low.ln(), high: interval.high.ln() };
        Some(mean_p_value(logarithms, self.n, value.ln()))
    }

    /// Returns whether the whole interval is above `value`.
    pub fn is_above(&self, value: f64) -> bool {
        self.interval.is_some_and(|i| i.low > value)
    }

    /// Returns whether the whole interval is below `value`.
    pub fn is_below(&self, value: f64) -> bool {
        self.interval.is_some_and(|i| i.high < value)
    }

    /// Returns the mean, or 0 without values: callers have to know that there are some.
    pub fn mean_or_zero(&self) -> f64 {
        self.mean.unwrap_or(0.0)
    }

    /// Returns a point of a figure at `x`, if there is a mean.
    pub fn point(&self, x: f64) -> Option<Point> {
        let interval = self.interval.map(|i| (i.low, i.high));
        self.mean.map(|y| Point::new(x, y).with_interval(interval).with_runs(self.n))
    }
}

/// Returns a number with just enough digits.
pub fn format_short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 10.0 => format!("{value:.1}"),
        size if size >= 1.0 => format!("{value:.2}"),
        size if size >= 0.01 => format!("{value:.3}"),
        _ => format!("{value:.1e}"),
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(mean) = self.mean else { return f.write_str("-") };
        f.write_str(&format_short(mean))?;
        if let Some(Interval { low, high }) = self.interval {
            write!(f, " [{}, {}]", format_short(low), format_short(high))?;
        }
        write!(f, " n={}", self.n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_pairs_with_both_values_count() {
        let a = [Some(3.0), None, Some(8.0), Some(5.0)];
        let b = [Some(2.0), Some(9.0), Some(7.0), Some(4.0)];
        let difference = Estimate::paired_difference(&a, &b);
        assert_eq!((difference.mean, difference.n), (Some(1.0), 3));
        assert!(difference.is_above(0.5) && !difference.is_above(1.0));
        assert_eq!(
            Estimate::geometric_ratio(&[Some(1.0), Some(1.0)], &[Some(0.0), Some(2.0)]).n,
            1
        );
    }

    #[test]
    fn an_interval_of_a_share_ends_at_its_bounds_and_tests_as_before() {
        let shares = Estimate::from_values([100.0, 100.0, 90.0].map(Some));
        let within = shares.clamped(0.0, 100.0);
        assert!(shares.interval.unwrap().high > 100.0 && within.interval.unwrap().high == 100.0);
        assert_eq!(within.interval.unwrap().low, shares.interval.unwrap().low);
        assert_eq!((within.mean, within.p_value(80.0)), (shares.mean, shares.p_value(80.0)));
    }

    #[test]
    fn an_interval_of_a_ratio_is_never_negative_and_that_of_the_inverse_is_its_inverse() {
        let (a, b) = ([1.0, 40.0].map(Some), [10.0, 1.0].map(Some));
        let (there, back) = (Estimate::geometric_ratio(&a, &b), Estimate::geometric_ratio(&b, &a));
        let (i, j) = (there.interval.unwrap(), back.interval.unwrap());
        assert!(i.low > 0.0 && (there.mean.unwrap() - 2.0).abs() < 1e-12, "{there}");
        assert!((i.low * j.high - 1.0).abs() < 1e-9 && (i.high * j.low - 1.0).abs() < 1e-9);
        assert!(there.p_value(1.0) > Some(0.05) && there.p_value(0.0) == Some(0.0));
        let twice = Estimate::geometric_ratio(&[2.0, 2.2, 1.9].map(Some), &[1.0; 3].map(Some));
        assert!(twice.p_value(1.0) < Some(0.05) && twice.is_above(1.0));
        assert_eq!(Estimate::geometric_ratio(&a[..1], &b[..1]).p_value(1.0), None);
    }

    #[test]
    fn an_estimate_prints_interval_and_number_of_runs() {
        let four = Estimate::from_values([1.0, 2.0, 3.0, 4.0].map(Some));
        assert_eq!(four.to_string(), "2.50 [0.446, 4.55] n=4");
        assert_eq!(Estimate::from_values([Some(2.0)]).to_string(), "2.00 n=1");
        assert_eq!(Estimate::from_values([]).to_string(), "-");
        assert!(!Estimate::from_values([Some(2.0)]).is_above(0.0), "one run proves nothing");
    }
}
