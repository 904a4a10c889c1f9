//! Fisher's information about a beam model, and the standard deviations that follow from it.

use std::collections::BTreeMap;

/// Number of parameters: four weights, of which one follows from the others, noise and rate.
const PARAMETERS: usize = 6;
/// With fewer scans the variance between them is not known well.
const MIN_SCANS: usize = 30;

type Vector = [f64; PARAMETERS];
type Matrix = [Vector; PARAMETERS];

/// The derivatives of the log-likelihood of one reading.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scores {
    /// By the weight of each part.
    pub(crate) weights: [f64; 4],
    /// By the noise of hits.
    pub(crate) sigma: f64,
    /// By the rate of short readings.
    pub(crate) lambda: f64,
}

/// Sums of products of scores, of single readings and of scans.
pub(crate) struct Information {
    /// Whether each parameter is estimated: the others are taken as known.
    is_free: [bool; PARAMETERS],
    /// The part with a weight that follows from those of the others.
    reference: usize,
    readings: u64,
    products: Matrix,
    by_scan: BTreeMap<u32, Vector>,
}

impl Information {
    /// Returns no information yet about a model in which only some parts have enough readings.
    pub(crate) fn new(has_readings: [bool; 4]) -> Self {
        let [hit, short, max, random] = has_readings;
        let reference = has_readings.iter().position(|has| *has).unwrap_or(0);
        let mut is_free = [hit, short, max, random, hit, short];
        is_free[reference] = false;
        Self {
            is_free,
            reference,
            readings: 0,
            products: Matrix::default(),
            by_scan: BTreeMap::new(),
        }
    }

    pub(crate) fn add(&mut self, scan: u32, scores: &Scores) {
        let reference = scores.weights[self.reference];
        let [hit, short, max, random] = scores.weights.map(|score| score - reference);
        let mut vector = [hit, short, max, random, scores.sigma, scores.lambda];
        vector.iter_mut().zip(self.is_free).for_each(|(score, is_free)| {
            if !is_free {
                *score = 0.0;
            }
        });
        add_product(&mut self.products, &vector);
        let of_scan = self.by_scan.entry(scan).or_default();
        of_scan.iter_mut().zip(vector).for_each(|(sum, score)| *sum += score);
        self.readings += 1;
    }

    /// Returns the standard deviation of each parameter; `None` where there is no information about it.
    pub(crate) fn standard_deviations(&self) -> [Option<f64>; PARAMETERS] {
        let Some(inverse) = inverse(&self.products, self.is_free) else {
            return [None; PARAMETERS];
        };
        let scans = self.by_scan.len();
        let covariance = if scans >= MIN_SCANS && (scans as u64) < self.readings {
            let mut between = Matrix::default();
            self.by_scan.values().for_each(|scores| add_product(&mut between, scores));
            let correction = scans as f64 / (scans as f64 - 1.0);
            scaled(&product(&product(&inverse, &between), &inverse), correction)
        } else {
            inverse
        };
        let mut deviations: [Option<f64>; PARAMETERS] =
            std::array::from_fn(|k| self.is_free[k].then(|| covariance[k][k].max(0.0).sqrt()));
        let variance: f64 = covariance[..4].iter().flat_map(|row| &row[..4]).sum();
        deviations[self.reference] = Some(variance.max(0.0).sqrt());
        deviations
    }
}

fn add_product(sum: &mut Matrix, vector: &Vector) {
    for (row, a) in sum.iter_mut().zip(vector) {
        row.iter_mut().zip(vector).for_each(|(cell, b)| *cell += a * b);
    }
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..PARAMETERS).map(|k| a[i][k] * b[k][j]).sum())
    })
}

fn scaled(a: &Matrix, factor: f64) -> Matrix {
    a.map(|row| row.map(|cell| cell * factor))
}

/// Returns the inverse over the free parameters, 0 elsewhere, by elimination; `None` where it has none.
fn inverse(of: &Matrix, is_free: [bool; PARAMETERS]) -> Option<Matrix> {
    let mut left = *of;
    let mut right = Matrix::default();
    for k in 0..PARAMETERS {
        right[k][k] = 1.0;
        if !is_free[k] {
            left[k][k] = 1.0;
        }
    }
    for k in 0..PARAMETERS {
        let pivot =
            (k..PARAMETERS).max_by(|a, b| left[*a][k].abs().total_cmp(&left[*b][k].abs()))?;
        left.swap(k, pivot);
        right.swap(k, pivot);
        let by = left[k][k];
        if by.abs() < f64::MIN_POSITIVE.sqrt() {
            return None;
        }
        for cells in [&mut left[k], &mut right[k]] {
            cells.iter_mut().for_each(|cell| *cell /= by);
        }
        for row in (0..PARAMETERS).filter(|row| *row != k) {
            let factor = left[row][k];
            for column in 0..PARAMETERS {
                left[row][column] -= factor * left[k][column];
                right[row][column] -= factor * right[k][column];
            }
        }
    }
    for k in (0..PARAMETERS).filter(|k| !is_free[*k]) {
        right[k] = Vector::default();
    }
    Some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inverse_undoes_its_matrix_on_what_is_free() {
        let is_free = [false, true, true, false, true, true];
        let mut matrix = Matrix::default();
        for (k, scores) in
            [[0.0, 2.0, 1.0, 0.0, 0.5, 0.1], [0.0, 1.0, 3.0, 0.0, 0.2, 0.9]].iter().enumerate()
        {
            add_product(&mut matrix, scores);
            matrix[4 + k][4 + k] += 3.0;
        }
        let one = product(&inverse(&matrix, is_free).unwrap(), &matrix);
        for i in 0..PARAMETERS {
            for j in 0..PARAMETERS {
                let expected = if i == j && is_free[i] { 1.0 } else { 0.0 };
                assert!((one[i][j] - expected).abs() < 1e-9, "{one:?}");
            }
        }
        assert_eq!(inverse(&Matrix::default(), [true; PARAMETERS]), None);
    }
}
