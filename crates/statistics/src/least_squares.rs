//! Linear models fitted by least squares, with intervals for their coefficients.

use crate::Interval;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// A fitted model `y = sum of coefficient * x`; a constant is a column of ones.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fit {
    /// One coefficient per column, in the unit of `y` per unit of that column.
    pub coefficients: Vec<f64>,
    /// 95 % intervals of the coefficients by Student's t; absent without degrees of freedom.
    pub intervals: Option<Vec<Interval>>,
    /// Coefficient of determination: the share of the variance of `y` that is explained.
    pub r_squared: f64,
    /// Number of observations.
    pub n: usize,
}

/// A pivot below this share of its column's square means that the column is a combination of others, so its coefficient
/// cannot be determined: rounding errors of a dependent column are smaller, by several digits.
const MIN_PIVOT_FRACTION: f64 = 1e-10;

impl Fit {
    /// Fits `y` (`n`) to the rows of `x` (`n` x `k`).
    ///
    /// `None` when there are fewer rows than columns, or the columns depend on each other.
    ///
    /// # Panics
    /// When the rows differ in length or in number from `y`.
    pub fn new(x: &[Vec<f64>], y: &[f64]) -> Option<Self> {
        assert_eq!(x.len(), y.len(), "one row per observation");
        let n = y.len();
        let k = x.first()?.len();
        // Columns are scaled to length 1, because the condition of the system must not depend on
        // units.
        let lengths: Vec<f64> = (0..k).map(|j| dot(x, j, j).sqrt()).collect();
        if n < k || lengths.contains(&0.0) {
            return None;
        }
        // The normal equations: gram * coefficients = moments.
        let gram: Vec<Vec<f64>> = (0..k)
            .map(|i| (0..k).map(|j| dot(x, i, j) / (lengths[i] * lengths[j])).collect())
            .collect();
        let inverse = invert(gram)?;
        let moments: Vec<f64> = (0..k)
            .map(|j| x.iter().zip(y).map(|(row, y)| row[j] * y).sum::<f64>() / lengths[j])
            .collect();
        let coefficients: Vec<f64> = (0..k)
            .map(|i| inverse[i].iter().zip(&moments).map(|(a, b)| a * b).sum::<f64>() / lengths[i])
            .collect();
        let spreads: Vec<f64> = (0..k).map(|j| inverse[j][j].sqrt() / lengths[j]).collect();
        let residual = residual_sum_of_squares(x, y, &coefficients);
        let intervals = intervals(&coefficients, residual, n, &spreads);
        // Where all `y` are equal there is no variance to explain: the minimum only prevents a division by 0.
        let r_squared = 1.0 - residual / total_sum_of_squares(y).max(f64::MIN_POSITIVE);
        Some(Self { coefficients, intervals, r_squared, n })
    }

    /// Returns the value of `y` that the model gives for a row, with as many values as there are coefficients.
    pub fn predict(&self, row: &[f64]) -> f64 {
        self.coefficients.iter().zip(row).map(|(c, x)| c * x).sum()
    }
}

fn dot(x: &[Vec<f64>], i: usize, j: usize) -> f64 {
    x.iter().map(|row| row[i] * row[j]).sum()
}

fn residual_sum_of_squares(x: &[Vec<f64>], y: &[f64], coefficients: &[f64]) -> f64 {
    x.iter()
        .zip(y)
        .map(|(row, y)| {
            let prediction = row.iter().zip(coefficients).map(|(x, c)| x * c).sum::<f64>();
            (y - prediction) * (y - prediction)
        })
        .sum()
}

fn total_sum_of_squares(y: &[f64]) -> f64 {
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    y.iter().map(|v| (v - mean) * (v - mean)).sum()
}

/// Returns the intervals of the coefficients; `spreads` are their standard errors for residuals of variance 1.
fn intervals(
    coefficients: &[f64],
    residual: f64,
    n: usize,
    spreads: &[f64],
) -> Option<Vec<Interval>> {
    let freedom = n.checked_sub(coefficients.len()).filter(|&f| f > 0)? as f64;
    let t = StudentsT::new(0.0, 1.0, freedom).ok()?.inverse_cdf(0.975);
    let intervals = coefficients.iter().zip(spreads).map(|(&coefficient, spread)| {
        let half_width = t * (residual / freedom).sqrt() * spread;
        Interval { low: coefficient - half_width, high: coefficient + half_width }
    });
    Some(intervals.collect())
}

/// Returns the inverse of a symmetric positive matrix with ones on its diagonal, by Gauss and
/// Jordan.
fn invert(mut a: Vec<Vec<f64>>) -> Option<Vec<Vec<f64>>> {
    let k = a.len();
    // Without exchanges of rows: the pivots of a positive matrix are positive.
    for pivot in 0..k {
        let divisor = a[pivot][pivot];
        if divisor < MIN_PIVOT_FRACTION {
            return None;
        }
        // In place: the column of the identity takes the place of the column it removes.
        a[pivot][pivot] = 1.0;
        a[pivot].iter_mut().for_each(|v| *v /= divisor);
        let row = a[pivot].clone();
        for (_, other) in a.iter_mut().enumerate().filter(|(i, _)| *i != pivot) {
            let factor = std::mem::take(&mut other[pivot]);
            other.iter_mut().zip(&row).for_each(|(v, r)| *v -= factor * r);
        }
    }
    Some(a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_kernel::Seed;
    use sidestep_kernel::distr::normal;
    use sidestep_kernel::stream::{Purpose, Streams};

    fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance, "{a} is not {b}");
    }

    #[test]
    fn a_line_through_known_points_has_the_textbook_figures() {
        // Draper and Smith style example: x = 1..5, y = 2, 4, 5, 4, 5.
        let x: Vec<Vec<f64>> = (1..=5).map(|i| vec![1.0, f64::from(i)]).collect();
        let fit = Fit::new(&x, &[2.0, 4.0, 5.0, 4.0, 5.0]).unwrap();
        close(fit.coefficients[0], 2.2, 1e-12);
        close(fit.coefficients[1], 0.6, 1e-12);
        close(fit.r_squared, 0.6, 1e-12);
        // Standard error of the slope sqrt(0.8 / 10), t(3, 0.975) = 3.182446.
        close(fit.intervals.unwrap()[1].high - 0.6, 3.182_446 * 0.08_f64.sqrt(), 1e-6);
        close(Fit::new(&x, &[3.0; 5]).unwrap().predict(&[1.0, 9.0]), 3.0, 1e-12);
    }

    #[test]
    fn known_parameters_are_recovered_from_noise_within_their_intervals() {
        let truth = [2e-7, 5e-8, 3e2];
        let mut draws = Streams::new(Seed(1)).draws(0, 0, Purpose(0));
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for i in 0..200 {
            let row = vec![100.0 + f64::from(i), f64::from(i * i % 37), 1e-9 * f64::from(i % 11)];
            y.push(
                truth.iter().zip(&row).map(|(t, r)| t * r).sum::<f64>() + 1e-6 * normal(&mut draws),
            );
            x.push(row);
        }
        let fit = Fit::new(&x, &y).unwrap();
        for (interval, truth) in fit.intervals.unwrap().iter().zip(truth) {
            assert!(interval.contains(truth), "{truth} is outside {interval:?}");
            assert!(interval.high - interval.low < 0.5 * truth);
        }
        assert!(fit.r_squared > 0.9);
    }

    #[test]
    fn what_cannot_be_told_apart_is_not_fitted() {
        let doubled: Vec<Vec<f64>> = (1..9).map(|i| vec![f64::from(i), f64::from(2 * i)]).collect();
        assert!(Fit::new(&doubled, &[1.0; 8]).is_none());
        assert!(Fit::new(&[vec![1.0, 2.0]], &[1.0]).is_none());
        assert!(Fit::new(&[vec![0.0], vec![0.0]], &[1.0, 1.0]).is_none());
        assert!(Fit::new(&[], &[]).is_none());
    }
}
