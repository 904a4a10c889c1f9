//! A mean with its uncertainty.

use super::figure::Point;
use serde::Serialize;
use sidestep_statistics::{Interval, mean, mean_interval};
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
    /// Number of values.
    pub n: usize,
}

impl Estimate {
    /// Returns the mean of those runs that have a value.
    pub fn of(values: impl IntoIterator<Item = Option<f64>>) -> Self {
        let values: Vec<f64> = values.into_iter().flatten().filter(|v| v.is_finite()).collect();
        Self { mean: mean(&values), interval: mean_interval(&values), n: values.len() }
    }

    /// Returns the mean of `a[i] - b[i]` over the pairs in which both have a value: two treatments
    /// of the same case, so that effects of the case itself cancel.
    pub fn paired(a: &[Option<f64>], b: &[Option<f64>]) -> Self {
        Self::of(a.iter().zip(b).map(|(a, b)| Some((*a)? - (*b)?)))
    }

    /// Returns the mean of `a[i] / b[i]` over the pairs in which both have a value and `b` is not
    /// 0.
    pub fn ratio(a: &[Option<f64>], b: &[Option<f64>]) -> Self {
        let quotient = |(a, b): (&Option<f64>, &Option<f64>)| Some((*a)? / (*b)?);
        Self::of(a.iter().zip(b).map(quotient))
    }

    /// Whether the whole interval lies above `value`.
    pub fn is_above(&self, value: f64) -> bool {
        self.interval.is_some_and(|i| i.low > value)
    }

    /// Whether the whole interval lies below `value`.
    pub fn is_below(&self, value: f64) -> bool {
        self.interval.is_some_and(|i| i.high < value)
    }

    /// Returns the mean, or 0 without values; for figures.
    pub fn or_zero(&self) -> f64 {
        self.mean.unwrap_or(0.0)
    }

    /// Returns a point of a figure at `x`, if there is a mean.
    pub fn point(&self, x: f64) -> Option<Point> {
        let interval = self.interval.map(|i| (i.low, i.high));
        self.mean.map(|y| Point::new(x, y).with_interval(interval).of_runs(self.n))
    }
}

/// Returns a number with just enough digits.
pub fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        a if a >= 100.0 => format!("{value:.0}"),
        a if a >= 10.0 => format!("{value:.1}"),
        a if a >= 1.0 => format!("{value:.2}"),
        a if a >= 0.01 => format!("{value:.3}"),
        _ => format!("{value:.1e}"),
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(mean) = self.mean else { return f.write_str("-") };
        f.write_str(&short(mean))?;
        if let Some(Interval { low, high }) = self.interval {
            write!(f, " [{}, {}]", short(low), short(high))?;
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
        let difference = Estimate::paired(&a, &b);
        assert_eq!((difference.mean, difference.n), (Some(1.0), 3));
        assert!(difference.is_above(0.5) && !difference.is_above(1.0));
        assert_eq!(Estimate::ratio(&[Some(1.0), Some(1.0)], &[Some(0.0), Some(2.0)]).n, 1);
    }

    #[test]
    fn an_estimate_prints_interval_and_number_of_runs() {
        let four = Estimate::of([1.0, 2.0, 3.0, 4.0].map(Some));
        assert_eq!(four.to_string(), "2.50 [0.446, 4.55] n=4");
        assert_eq!(Estimate::of([Some(2.0)]).to_string(), "2.00 n=1");
        assert_eq!(Estimate::of([]).to_string(), "-");
        assert!(!Estimate::of([Some(2.0)]).is_above(0.0), "one run proves nothing");
    }
}
