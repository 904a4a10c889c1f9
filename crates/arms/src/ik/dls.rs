//! Damped least squares without a matrix: the nearest posture whose tip is at the target.
//!
//! Of all rod vectors `v'` within their lengths whose sum is the target `t`, the wanted ones have the
//! least sum of `|v' - v|^2`, where `v` are the present ones. With one multiplier `y` for the sum,
//! every rod can be solved alone: `v'` is the vector within the rod's lengths that is nearest to
//! `v + y`. It remains to find the `y` in 2 or 3 dimensions with `sum v'(y) = t`, and that is the
//! gradient of a convex function: damped Newton steps get there from anywhere, each in O(n). Its matrix
//! is the `J J^T` of damped least squares, and, as in that method, the damping falls by 0.3 after a
//! step that helped; one that did not is shortened. In contrast to damped least squares, the
//! posture is not linearized anew at every step, so steps need no limit, and rods of variable length
//! are no special case.
//!
//! If the convex function has its least value at a kink (`v + y = 0` for some rod: it might turn
//! anywhere), steps stop helping; then the posture reached becomes the new `v`, and the answer is
//! the nearest to that. A limb that is almost straight, and might buckle to any side, is bowed
//! first if it has far to go.

use super::limb::RodLengthRange;
use sidestep_rods::geometry::{
    Point, add, add_scaled, norm, normalized, perpendicular, scaled, sub, unit_x,
};

/// Newton steps with hardly any gain before the posture becomes the new reference: at a kink they no longer help.
const MAX_POOR_STEPS: usize = 3;
/// Largest fraction of the error that a good step leaves; Newton's method leaves far less once it converges.
const GOOD_STEP_FRACTION: f64 = 0.5;
/// New references before the search is given up.
const MAX_REFERENCES: usize = 32;
/// Number of references after which the limb is bowed anew, in case it is in line with the target.
const BOW_INTERVAL: usize = 6;
/// The first damping, as a fraction of the mean of the matrix's diagonal. With this and the next value the tip needs about
/// 7 steps for any number of rods, to targets within 0.9 of the reach.
const INITIAL_DAMPING: f64 = 1e-3;
/// Factor of the damping after a step that helped.
const DAMPING_DECREASE: f64 = 0.3;
/// Least fraction to which a step that did not help is shortened: a parabola through two errors that differ much would end
/// the search in a step of nearly no length.
const MIN_STEP_FRACTION: f64 = 0.1;
/// Fraction of the greatest length beyond which a limb is straight, and may buckle to any side.
const STRAIGHT_FRACTION: f64 = 0.9;
/// Distance to go, as a fraction of the greatest length, from which on a straight limb is bowed first. A nearer target is
/// reached by a small change of the posture, which a bow would spoil.
const FAR_FRACTION: f64 = 0.03;
/// Least pivot of the decomposition as a fraction of the mean of the diagonal: where rounding leaves a pivot below it, the
/// step in its direction stays finite.
const MIN_PIVOT: f64 = 1e-14;

/// The posture to start from, the lengths of its rods, and the target of its tip.
#[derive(Clone, Copy)]
struct TipProblem<'a, const D: usize> {
    vectors: &'a [Point<D>],
    spans: &'a [RodLengthRange],
    target: Point<D>,
}

/// The tip's position for a multiplier.
struct TipError<const D: usize> {
    /// The remaining vector to the target.
    error: Point<D>,
    error_m: f64,
    /// The derivative of the tip by the multiplier: the lower half of a symmetric matrix.
    slope: [[f64; D]; D],
}

/// Brings the sum of `vectors` to `target`. Returns the number of steps and the remaining error;
/// the vectors are then within their lengths.
pub(super) fn solve<const D: usize>(
    vectors: &mut [Point<D>],
    spans: &[RodLengthRange],
    target: Point<D>,
    tolerance_m: f64,
) -> (usize, f64) {
    let longest_m: f64 = spans.iter().map(|s| s.max_m).sum();
    let mut steps = 0;
    let mut error_m = f64::INFINITY;
    for reference in 0..MAX_REFERENCES {
        let mut start = TipProblem { vectors, spans, target }.tip_position([0.0; D]);
        let is_straight = norm(sub(target, start.error)) > STRAIGHT_FRACTION * longest_m
            && start.error_m > FAR_FRACTION * longest_m;
        // In the middle of each interval, so that a limb has had some references to converge without a bow.
        let is_stuck = reference % BOW_INTERVAL == BOW_INTERVAL / 2;
        if is_stuck || (reference == 0 && is_straight) {
            bend_to_arc(vectors, target);
            start = TipProblem { vectors, spans, target }.tip_position([0.0; D]);
        }
        let problem = TipProblem { vectors, spans, target };
        let (y, left_m) = problem.solve_multiplier(start, tolerance_m, &mut steps);
        adopt(vectors, spans, y);
        error_m = left_m;
        if error_m <= tolerance_m {
            break;
        }
    }
    (steps, error_m)
}

impl<const D: usize> TipProblem<'_, D> {
    /// Applies Newton's method to the multiplier; returns it and the remaining error.
    fn solve_multiplier(
        &self,
        start: TipError<D>,
        tolerance_m: f64,
        steps: &mut usize,
    ) -> (Point<D>, f64) {
        let mut y = [0.0; D];
        let mut at = start;
        let mut damping = INITIAL_DAMPING;
        let mut step = solve_damped(&at.slope, at.error, damping);
        let mut poor_steps = 0;
        while at.error_m > tolerance_m && poor_steps < MAX_POOR_STEPS {
            *steps += 1;
            let next_y = add(y, step);
            let next = self.tip_position(next_y);
            poor_steps += usize::from(next.error_m > GOOD_STEP_FRACTION * at.error_m);
            if next.error_m < at.error_m {
                y = next_y;
                at = next;
                damping *= DAMPING_DECREASE;
                step = solve_damped(&at.slope, at.error, damping);
            } else {
                // Backtracking line search: the minimum of a parabola through both errors.
                let before2 = at.error_m * at.error_m;
                let after2 = next.error_m * next.error_m;
                step = scaled(step, (before2 / (before2 + after2)).max(MIN_STEP_FRACTION));
            }
        }
        (y, at.error_m)
    }

    #[inline]
    fn tip_position(&self, y: Point<D>) -> TipError<D> {
        let mut tip = [0.0; D];
        let mut slope = [[0.0; D]; D];
        for (v, span) in self.vectors.iter().zip(self.spans) {
            let w = add(*v, y);
            let r = norm(w).max(f64::MIN_POSITIVE);
            let length_m = span.clamp_m(r);
            let per_m = 1.0 / r;
            let u = scaled(w, per_m);
            tip = add_scaled(tip, u, length_m);
            // A rod within its limits follows in every direction, one at a limit only across itself.
            let across = length_m * per_m;
            let lengthwise = if span.min_m < r && r < span.max_m { 1.0 } else { 0.0 };
            for i in 0..D {
                for j in 0..=i {
                    slope[i][j] += (lengthwise - across) * u[i] * u[j];
                }
                slope[i][i] += across;
            }
        }
        let error = sub(self.target, tip);
        TipError { error, error_m: norm(error), slope }
    }
}

/// Solves `(slope + damping) x = error` by Cholesky decomposition.
#[inline]
fn solve_damped<const D: usize>(slope: &[[f64; D]; D], error: Point<D>, damping: f64) -> Point<D> {
    let mean = (0..D).map(|i| slope[i][i]).sum::<f64>() / D as f64;
    let floor = f64::MIN_POSITIVE.sqrt().max(MIN_PIVOT * mean);
    let mut l = *slope;
    let mut x = error;
    for i in 0..D {
        l[i][i] += damping * mean;
        for j in 0..=i {
            for k in 0..j {
                l[i][j] -= l[i][k] * l[j][k];
            }
            l[i][j] = if i == j { l[i][i].max(floor).sqrt() } else { l[i][j] / l[j][j] };
        }
        for k in 0..i {
            x[i] -= l[i][k] * x[k];
        }
        x[i] /= l[i][i];
    }
    for i in (0..D).rev() {
        for k in i + 1..D {
            x[i] -= l[k][i] * x[k];
        }
        x[i] /= l[i][i];
    }
    x
}

/// Makes the rods of a multiplier the vectors; a rod at a kink has no direction and keeps its own.
fn adopt<const D: usize>(vectors: &mut [Point<D>], spans: &[RodLengthRange], y: Point<D>) {
    for (v, span) in vectors.iter_mut().zip(spans) {
        let w = add(*v, y);
        let r = norm(w);
        let u = if r > 0.0 { scaled(w, 1.0 / r) } else { normalized(*v).unwrap_or(unit_x()) };
        *v = scaled(u, span.clamp_m(r));
    }
}

/// Bends the limb to an arc, to the side given by `perpendicular`.
pub(super) fn bend_to_arc<const D: usize>(vectors: &mut [Point<D>], target: Point<D>) {
    let total = vectors.iter().fold([0.0; D], |sum, v| add(sum, *v));
    let side = perpendicular(normalized(total).or(normalized(target)).unwrap_or(unit_x()));
    let n = vectors.len() as f64;
    for (i, v) in vectors.iter_mut().enumerate() {
        // From 1 at the base to -1 at the tip: rods alike lean to both sides equally, and the tip
        // stays.
        let lean = 1.0 - (2 * i + 1) as f64 / n;
        *v = add_scaled(*v, side, lean * norm(*v));
    }
}
