//! Damped steps of the joints inside their limits.

use super::super::serial::SerialChain;

/// Lowest and highest value of each variable, rad or m.
#[derive(Debug)]
pub(super) struct JointRanges {
    pub(super) ranges: Vec<[f64; 2]>,
}

impl JointRanges {
    /// Both ends of a joint that turns or slides without end.
    pub(super) const UNLIMITED: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    /// Returns ranges for goals that ignore limits.
    pub(super) fn unlimited(chain: &SerialChain) -> Self {
        Self { ranges: vec![Self::UNLIMITED; chain.variables.len()] }
    }

    /// Returns the limits of all joints: those that mimic another narrow its range.
    pub(super) fn from_chain(chain: &SerialChain) -> Self {
        let own = chain
            .variables
            .iter()
            .map(|v| v.limits.map_or(Self::UNLIMITED, |l| [l.lower, l.upper]));
        let mut ranges: Vec<_> = own.collect();
        for joint in &chain.joints {
            let drive = joint.drive;
            if let Some(limits) = joint.limits.filter(|_| drive.multiplier != 0.0) {
                let a = (limits.lower - drive.offset) / drive.multiplier;
                let b = (limits.upper - drive.offset) / drive.multiplier;
                let [lower, upper] = &mut ranges[drive.variable];
                *lower = lower.max(a.min(b));
                *upper = upper.min(a.max(b));
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
}

/// The matrices of a step, kept so that steps allocate nothing.
#[derive(Default)]
pub(super) struct IkStepper {
    /// The Jacobian: rows of an entry for each variable, one row after the other.
    pub(super) rows: Vec<f64>,
    is_free: Vec<bool>,
    wanted: Vec<f64>,
    moves: Vec<f64>,
    matrix: Vec<f64>,
    y: Vec<f64>,
}

/// The posture that a step starts from, and its aim.
#[derive(Clone, Copy)]
pub(super) struct IkStepInput<'a> {
    pub(super) values: &'a [f64],
    pub(super) wanted: &'a [f64],
    /// Damping as a fraction of the mean of the matrix's diagonal.
    pub(super) damping: f64,
    pub(super) bounds: &'a JointRanges,
}

impl IkStepper {
    /// Puts the values after one damped step toward the wanted changes into `next`. A
    /// variable that would leave its range stops at its end, and the others do without it.
    pub(super) fn step(&mut self, input: IkStepInput<'_>, next: &mut Vec<f64>) {
        let IkStepInput { values, wanted, damping, bounds } = input;
        let n = values.len();
        next.clear();
        next.extend_from_slice(values);
        if n == 0 {
            return;
        }
        self.is_free.clear();
        self.is_free.resize(n, true);
        self.wanted.clear();
        self.wanted.extend_from_slice(wanted);
        while self.least_squares(n, damping) && self.clamp_step(values, bounds, next) {}
        for ((next, moves), is_free) in next.iter_mut().zip(&self.moves).zip(&self.is_free) {
            if *is_free {
                *next += moves;
            }
        }
    }

    /// Puts the variables that would leave their ranges at their ends, subtracts the resulting changes
    /// from the wanted ones, and returns whether there were any.
    fn clamp_step(&mut self, values: &[f64], bounds: &JointRanges, next: &mut [f64]) -> bool {
        let n = values.len();
        let mut any = false;
        for (i, &[lower, upper]) in bounds.ranges.iter().enumerate() {
            let to = values[i] + self.moves[i];
            if !self.is_free[i] || (to >= lower && to <= upper) {
                continue;
            }
            any = true;
            self.is_free[i] = false;
            next[i] = to.min(upper).max(lower);
            for (wanted, row) in self.wanted.iter_mut().zip(self.rows.chunks_exact(n)) {
                *wanted -= row[i] * (next[i] - values[i]);
            }
        }
        any
    }

    /// Computes the least moves of the free variables that produce the wanted changes, damped:
    /// `J^T (J J^T + damping)^-1 wanted`. `J J^T` has only a few rows, one for each error. Returns
    /// whether any variable is free.
    fn least_squares(&mut self, n: usize, damping: f64) -> bool {
        let Self { rows, is_free, wanted, moves, matrix, y } = self;
        let m = wanted.len();
        matrix.clear();
        matrix.resize(m * m, 0.0);
        let mut trace = 0.0;
        for (i, a) in rows.chunks_exact(n).enumerate() {
            for (j, b) in rows.chunks_exact(n).enumerate().take(i + 1) {
                let products = a.iter().zip(b).zip(is_free.iter());
                let of_free = products.map(|((x, y), free)| if *free { x * y } else { 0.0 });
                matrix[i * m + j] = of_free.sum();
            }
            trace += matrix[i * m + i];
        }
        // Never 0, so that joints that cannot move the tip still give a finite step.
        let added = (damping * trace / m as f64).max(f64::MIN_POSITIVE.sqrt());
        (0..m).for_each(|i| matrix[i * m + i] += added);
        y.clear();
        y.extend_from_slice(wanted);
        cholesky_solve(matrix, y);
        moves.clear();
        moves.resize(n, 0.0);
        for (row, y) in rows.chunks_exact(n).zip(y.iter()) {
            moves.iter_mut().zip(row).for_each(|(moves, slope)| *moves += slope * y);
        }
        is_free.contains(&true)
    }
}

/// Solves a symmetric, positive definite system, of which the lower half is read; overwrites its
/// matrix, and its right side with the solution.
fn cholesky_solve(matrix: &mut [f64], x: &mut [f64]) {
    let n = x.len();
    for i in 0..n {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| matrix[i * n + k] * matrix[j * n + k]).sum();
            let left = matrix[i * n + j] - known;
            matrix[i * n + j] =
                if i == j { left.max(f64::MIN_POSITIVE).sqrt() } else { left / matrix[j * n + j] };
        }
        let known: f64 = (0..i).map(|k| matrix[i * n + k] * x[k]).sum();
        x[i] = (x[i] - known) / matrix[i * n + i];
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| matrix[k * n + i] * x[k]).sum();
        x[i] = (x[i] - known) / matrix[i * n + i];
    }
}
