//! The lengths of all rods at once.
//!
//! The rods of a chain depend only on their neighbors, so the equations for the corrections of all
//! lengths are a band of three, solved in time linear in the rods. One by one, corrections would
//! need as many passes as there are rods to get from one end of the chain to the other.

use super::posture::TrialPosture;
use sidestep_rods::Rod;
use sidestep_rods::geometry::{Point, add_scaled, dot, norm, sub};

/// Brings rods back within their limits; owns its buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct RodLengthProjector<const D: usize> {
    /// Direction of each rod that is at a limit or beyond; zero for others.
    directions: Vec<Point<D>>,
    /// Main diagonal, then pivots; side diagonal toward the rod before; lengths beyond the limits.
    diagonal: Vec<f64>,
    side: Vec<f64>,
    beyond_m: Vec<f64>,
    /// Corrections made so far.
    pub(super) corrections: u64,
}

/// Fraction of a rod's play that is left free at either limit, so that rounding does not carry a rod beyond it.
const MARGIN_FRACTION: f64 = 0.25;
/// Most of it, meters.
const MAX_MARGIN_M: f64 = 1e-7;
/// Distance from a limit at which a rod counts as being there, meters: its neighbors' corrections may push it beyond.
const AT_LIMIT_M: f64 = 1e-6;
/// Keeps the equations solvable if a straight chain is held at both ends.
const DAMPING: f64 = 1e-9;
/// Corrections of a restoration at most. They are steps of Newton's method: near the limits each squares the error, so that
/// more gain nothing.
const MAX_CORRECTIONS: usize = 8;
/// Error at which a restoration ends, meters: a thousandth of the tolerance of lengths.
const ERROR_TOLERANCE_M: f64 = 1e-12;

impl<const D: usize> RodLengthProjector<D> {
    /// Corrects until all lengths are within their limits, if they get there.
    pub(super) fn restore_lengths(&mut self, posture: &mut TrialPosture<'_, D>, rods: &[Rod]) {
        for _ in 0..MAX_CORRECTIONS {
            if self.correct(posture, rods) <= ERROR_TOLERANCE_M {
                break;
            }
        }
    }

    /// Makes one correction of all lengths; returns the greatest error before it, meters.
    pub(super) fn correct(&mut self, posture: &mut TrialPosture<'_, D>, rods: &[Rod]) -> f64 {
        self.corrections += 1;
        let worst_m = self.measure(posture, rods);
        if worst_m > ERROR_TOLERANCE_M {
            self.assemble_equations(posture);
            self.eliminate();
            self.apply_corrections(posture);
        }
        worst_m
    }

    fn measure(&mut self, posture: &TrialPosture<'_, D>, rods: &[Rod]) -> f64 {
        self.directions.clear();
        self.beyond_m.clear();
        let mut worst_m = 0.0_f64;
        for (i, rod) in rods.iter().enumerate() {
            let along = sub(posture.points[i + 1], posture.points[i]);
            let length_m = norm(along);
            let spare_m = MAX_MARGIN_M.min(MARGIN_FRACTION * (rod.max_m - rod.min_m));
            let low_m = rod.min_m + spare_m;
            let high_m = rod.max_m - spare_m;
            let beyond_m = length_m - length_m.clamp(low_m, high_m);
            let is_free = length_m > low_m + AT_LIMIT_M && length_m < high_m - AT_LIMIT_M;
            let counts = !is_free && length_m > 0.0;
            self.directions.push(if counts { along.map(|x| x / length_m) } else { [0.0; D] });
            self.beyond_m.push(if counts { beyond_m } else { 0.0 });
            worst_m = worst_m.max(beyond_m.abs());
        }
        worst_m
    }

    fn assemble_equations(&mut self, posture: &TrialPosture<'_, D>) {
        self.diagonal.clear();
        self.side.clear();
        for (i, u) in self.directions.iter().enumerate() {
            let ease = dot(*u, *u) * (posture.inverse_mass[i] + posture.inverse_mass[i + 1]);
            // A rod that is free, or held at both ends, has the equation "no correction".
            self.diagonal.push(if ease > 0.0 { ease + DAMPING } else { 1.0 });
            let before = i.checked_sub(1).map_or([0.0; D], |b| self.directions[b]);
            self.side.push(-posture.inverse_mass[i] * dot(before, *u));
        }
    }

    /// Solves the equations; the solution replaces the errors.
    fn eliminate(&mut self) {
        let Self { diagonal, side, beyond_m, .. } = self;
        for i in 1..diagonal.len() {
            let factor = side[i] / diagonal[i - 1];
            diagonal[i] -= factor * side[i];
            beyond_m[i] -= factor * beyond_m[i - 1];
        }
        for i in (0..diagonal.len()).rev() {
            let after = if i + 1 < diagonal.len() { side[i + 1] * beyond_m[i + 1] } else { 0.0 };
            beyond_m[i] = (beyond_m[i] - after) / diagonal[i];
        }
    }

    fn apply_corrections(&self, posture: &mut TrialPosture<'_, D>) {
        for (i, (u, by_m)) in self.directions.iter().zip(&self.beyond_m).enumerate() {
            let ease = [posture.inverse_mass[i], posture.inverse_mass[i + 1]];
            posture.points[i] = add_scaled(posture.points[i], *u, ease[0] * by_m);
            posture.points[i + 1] = add_scaled(posture.points[i + 1], *u, -ease[1] * by_m);
        }
    }
}
