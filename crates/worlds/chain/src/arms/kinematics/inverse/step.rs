//! A damped step of the joints inside their limits.

use super::super::serial::SerialChain;
use super::rows::Errors;

/// The range of each variable.
pub(super) struct Bounds {
    pub(super) ranges: Vec<[f64; 2]>,
}

impl Bounds {
    /// No limits.
    pub(super) const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    /// Returns bounds without limits.
    pub(super) fn none(chain: &SerialChain) -> Self {
        Self { ranges: vec![Self::ANY; chain.variables.len()] }
    }

    /// Returns the limits of all joints: those that mimic another narrow its range.
    pub(super) fn of(chain: &SerialChain) -> Self {
        let own =
            chain.variables.iter().map(|v| v.limits.map_or(Self::ANY, |l| [l.lower, l.upper]));
        let mut ranges: Vec<_> = own.collect();
        for joint in &chain.joints {
            let drive = joint.drive;
            if let Some(limits) = joint.limits.filter(|_| drive.multiplier != 0.0) {
                let value = |limit: f64| (limit - drive.offset) / drive.multiplier;
                let (a, b) = (value(limits.lower), value(limits.upper));
                let [lower, upper] = &mut ranges[drive.variable];
                (*lower, *upper) = (lower.max(a.min(b)), upper.min(a.max(b)));
            }
        }
        Self { ranges }
    }

    /// Clamps values to their ranges; if ranges contradict each other the lower end counts.
    pub(super) fn clamp(&self, values: &mut [f64]) {
        for (value, [lower, upper]) in values.iter_mut().zip(&self.ranges) {
            *value = value.min(*upper).max(*lower);
        }
    }

    /// Returns the first variable outside its range: name, value and range.
    pub(super) fn first_outside(
        &self,
        chain: &SerialChain,
        values: &[f64],
    ) -> Option<(String, f64, f64, f64)> {
        let all = chain.variables.iter().zip(values).zip(&self.ranges);
        all.map(|((v, &value), &[lower, upper])| (v.name.clone(), value, lower, upper))
            .find(|(_, value, lower, upper)| value < lower || value > upper)
    }

    /// Returns `values` after one damped step toward smaller errors. A variable that would leave
    /// its range stops at its end, and the others do without it.
    pub(super) fn step(&self, values: &[f64], errors: &Errors, damping: f64) -> Vec<f64> {
        let mut moved = vec![0.0; values.len()];
        let mut is_free = vec![true; values.len()];
        let mut wanted = errors.wanted.clone();
        loop {
            let moves = least_squares(errors, &wanted, &is_free, damping);
            let stops = |i: usize| {
                let [lower, upper] = self.ranges[i];
                let to = values[i] + moves[i];
                (is_free[i] && (to < lower || to > upper)).then(|| (i, to.min(upper).max(lower)))
            };
            let stopped: Vec<(usize, f64)> = (0..values.len()).filter_map(stops).collect();
            for &(i, at) in &stopped {
                is_free[i] = false;
                moved[i] = at - values[i];
                for (wanted, row) in wanted.iter_mut().zip(&errors.rows) {
                    *wanted -= row[i] * moved[i];
                }
            }
            if stopped.is_empty() {
                let all = values.iter().zip(&moved).zip(moves.iter().zip(&is_free));
                return all
                    .map(|((v, m), (free, is_free))| v + if *is_free { *free } else { *m })
                    .collect();
            }
        }
    }
}

/// Returns the least moves of the free variables that produce the wanted changes, damped:
/// `J^T (J J^T + damping)^-1 wanted`. `J J^T` has only a few rows, one for each error.
fn least_squares(errors: &Errors, wanted: &[f64], is_free: &[bool], damping: f64) -> Vec<f64> {
    let rows = &errors.rows;
    let product = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).zip(is_free).filter(|(_, free)| **free).map(|((x, y), _)| x * y).sum()
    };
    let mut matrix: Vec<Vec<f64>> =
        rows.iter().map(|a| rows.iter().map(|b| product(a, b)).collect()).collect();
    let mean = (0..rows.len()).map(|i| matrix[i][i]).sum::<f64>() / rows.len() as f64;
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] += (damping * mean).max(f64::MIN_POSITIVE.sqrt());
    }
    let y = cholesky_solve(&mut matrix, wanted);
    let change = |i: usize| -> f64 { rows.iter().zip(&y).map(|(row, y)| row[i] * y).sum() };
    is_free.iter().enumerate().map(|(i, free)| if *free { change(i) } else { 0.0 }).collect()
}

/// Solves a symmetric, positive definite system, overwriting its matrix.
fn cholesky_solve(matrix: &mut [Vec<f64>], right: &[f64]) -> Vec<f64> {
    let n = right.len();
    let mut x = right.to_vec();
    for i in 0..n {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| matrix[i][k] * matrix[j][k]).sum();
            let left = matrix[i][j] - known;
            matrix[i][j] =
                if i == j { left.max(f64::MIN_POSITIVE).sqrt() } else { left / matrix[j][j] };
        }
        let known: f64 = (0..i).map(|k| matrix[i][k] * x[k]).sum();
        x[i] = (x[i] - known) / matrix[i][i];
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| matrix[k][i] * x[k]).sum();
        x[i] = (x[i] - known) / matrix[i][i];
    }
    x
}
