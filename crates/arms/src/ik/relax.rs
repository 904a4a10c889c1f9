//! Relaxation to a posture that meets all constraints, by alternating projections as in position-based
//! dynamics: every part that violates a constraint is pushed out of it, and then the nearest posture
//! with rods within their limits and the tip at the target is taken ([`dls`]), which moves all other
//! parts along. Pushes go a little farther than necessary, so that the second projection does not undo
//! them; the result is checked without these margins.

use super::constraints::{ConstraintChecker, OwnPair, bend_rad};
use super::limb::{self, Limb};
use super::{ChainIkGoal, dls, follow_beyond};
use sidestep_kernel::math;
use sidestep_rods::Veto;
use sidestep_rods::geometry::{
    NearestPoints, Point, add, add_scaled, between_segments, distance, dot, norm, normalized,
    perpendicular, scaled, sub, unit_x,
};
use std::f64::consts::PI;

/// Largest number of rounds before relaxation is given up.
const MAX_ROUNDS: usize = 400;
/// Rounds without a new best before relaxation is given up.
const MAX_IDLE_ROUNDS: usize = 60;
/// Fraction of the least violation so far below which a round is a new best: smaller gains may be the slow drift of a
/// posture that never gets free.
const IMPROVEMENT: f64 = 0.98;
/// Extra distance by which bodies are pushed, as a fraction of the longest rod.
const MARGIN: f64 = 1e-3;
/// Margin below its limit to which a bend is pushed.
const BEND_MARGIN_RAD: f64 = 2e-3;
/// Length of a push as a fraction of the depth; more than 1 (over-relaxation), because the projection to
/// whole rods undoes some of it.
const PUSH_FACTOR: f64 = 1.3;

/// Least displacement of a rod's nearest point per unit of push.
const MIN_RESPONSE: f64 = 1e-3;

pub(super) struct RelaxResult<const D: usize> {
    pub(super) rounds: usize,
    /// The objection to the best posture; `None` if it is good.
    pub(super) veto: Option<Veto<D>>,
}

/// Changes `points` from a start to a good posture, or returns the objection to the best one.
pub(super) fn relax<const D: usize>(
    checker: &ConstraintChecker<D>,
    limb: &mut Limb<D>,
    points: &mut [Point<D>],
    goal: &ChainIkGoal<D>,
) -> RelaxResult<D> {
    let longest_m = checker.chain.rods().iter().map(|r| r.max_m).fold(0.0, f64::max);
    let home = points[goal.base];
    let mut pusher =
        ConstraintProjector { checker, goal, margin_m: MARGIN * longest_m, violation_m: 0.0 };
    let mut best_m = f64::INFINITY;
    let mut best_round = 0;
    let mut veto = None;
    for round in 0..MAX_ROUNDS {
        limb.read(checker.chain, points, goal.base, goal.k);
        let target = sub(goal.target, home);
        let Limb { spans, vectors } = limb;
        // Half the tolerance: the rest is for rounding in the points that are laid out from the
        // vectors.
        let (_, left_m) = dls::solve(vectors, spans, target, 0.5 * goal.tolerance_m);
        lay_out(limb, points, checker, goal);
        veto = checker.find_veto(points, goal.k);
        if (veto.is_none() && left_m <= goal.tolerance_m) || round - best_round > MAX_IDLE_ROUNDS {
            return RelaxResult { rounds: round + 1, veto };
        }
        pusher.push(points);
        if pusher.violation_m < IMPROVEMENT * best_m {
            best_m = pusher.violation_m;
            best_round = round;
        }
    }
    RelaxResult { rounds: MAX_ROUNDS, veto }
}

fn lay_out<const D: usize>(
    limb: &Limb<D>,
    points: &mut [Point<D>],
    checker: &ConstraintChecker<D>,
    goal: &ChainIkGoal<D>,
) {
    let mut at = points[goal.base];
    for (i, v) in limb::connector_indices(goal.base, goal.k).skip(1).zip(&limb.vectors) {
        at = add(at, *v);
        points[i] = at;
    }
    follow_beyond(points, checker.chain, goal);
}

/// A rod that is pushed, or one connector, given twice.
#[derive(Clone, Copy)]
struct PushedRod<const D: usize> {
    ends: [usize; 2],
    /// Its place before the round: the direction of a push is across it where the nearest points
    /// coincide.
    before: [Point<D>; 2],
}

/// A round of pushes that move parts out of obstacles and bends.
struct ConstraintProjector<'a, const D: usize> {
    checker: &'a ConstraintChecker<'a, D>,
    goal: &'a ChainIkGoal<D>,
    margin_m: f64,
    /// The sum of all violations in a round, in meters.
    violation_m: f64,
}

impl<const D: usize> ConstraintProjector<'_, D> {
    fn push(&mut self, points: &mut [Point<D>]) {
        self.violation_m = 0.0;
        for i in 1..points.len() - 1 {
            self.unbend(points, i);
        }
        for i in 0..points.len() - 1 {
            self.push_out_of_obstacles(points, i);
            if self.checker.self_collision {
                self.push_apart(points, i);
            }
        }
    }

    /// Returns the weight with which a connector yields, the inverse mass of position-based dynamics: 0 for
    /// the tip, the base and what lies behind it, 1 for all others.
    fn inverse_mass(&self, i: usize) -> f64 {
        let ChainIkGoal { k, base, .. } = *self.goal;
        let is_before_base = if k > base { i <= base } else { i >= base };
        if is_before_base || i == k { 0.0 } else { 1.0 }
    }

    /// Moves the neighbors of a connector apart until its bend is within its limit.
    fn unbend(&mut self, points: &mut [Point<D>], i: usize) {
        let limit_rad = self.checker.chain.connectors()[i].max_bend_rad;
        if limit_rad >= PI || bend_rad(points, i) <= limit_rad {
            return;
        }
        // A limit that is smaller than the margin must not become negative.
        let allowed_rad = (limit_rad - BEND_MARGIN_RAD).max(0.5 * limit_rad);
        let a = distance(points[i - 1], points[i]);
        let b = distance(points[i], points[i + 1]);
        // The law of cosines: the distance of the neighbors at the allowed bend.
        let chord_m = (a * a + b * b + 2.0 * a * b * math::cos(allowed_rad)).max(0.0).sqrt();
        let between = sub(points[i + 1], points[i - 1]);
        let u = normalized(between).unwrap_or(perpendicular(
            normalized(sub(points[i], points[i - 1])).unwrap_or([1.0; D]),
        ));
        let weights = [self.inverse_mass(i - 1), self.inverse_mass(i + 1)];
        let missing_m = chord_m - norm(between);
        self.violation_m += missing_m.max(0.0);
        let sum = weights[0] + weights[1];
        if sum > 0.0 {
            points[i - 1] =
                add_scaled(points[i - 1], u, -PUSH_FACTOR * missing_m * weights[0] / sum);
            points[i + 1] =
                add_scaled(points[i + 1], u, PUSH_FACTOR * missing_m * weights[1] / sum);
        }
    }

    fn push_out_of_obstacles(&mut self, points: &mut [Point<D>], i: usize) {
        let checker = self.checker;
        let margin_m = self.margin_m;
        let rods = checker.chain.rods();
        let connectors = checker.chain.connectors();
        let before = [points[i], points[i + 1]];
        checker.visit_near(&before, i, margin_m, |o| {
            let nearest = o.core.nearest_to_segment([points[i], points[i + 1]]);
            let rod = PushedRod { ends: [i, i + 1], before };
            self.shift_rod(points, rod, &nearest, o.radius_m + rods[i].radius_m);
            for j in [i, i + 1] {
                let nearest = o.core.nearest_to_point(points[j]);
                let keep_m = o.radius_m + connectors[j].radius_m;
                self.shift_rod(points, PushedRod { ends: [j, j], before }, &nearest, keep_m);
            }
        });
    }

    fn push_apart(&mut self, points: &mut [Point<D>], i: usize) {
        let checker = self.checker;
        let snapshot = points.to_owned();
        for OwnPair { ends: [a, b], at, keep_m } in checker.own_pairs(&snapshot, i, self.margin_m) {
            let nearest = between_segments(at[0], at[1]);
            self.shift_rod(points, PushedRod { ends: a, before: at[0] }, &nearest, keep_m);
            let back =
                NearestPoints { on_body: nearest.on_core, on_core: nearest.on_body, ..nearest };
            self.shift_rod(points, PushedRod { ends: b, before: at[1] }, &back, keep_m);
        }
    }

    /// Moves a rod so that its nearest point keeps its distance.
    fn shift_rod(
        &mut self,
        points: &mut [Point<D>],
        PushedRod { ends: [i, j], before }: PushedRod<D>,
        nearest: &NearestPoints<D>,
        keep_m: f64,
    ) {
        let depth_m = keep_m + self.margin_m - nearest.distance_m;
        if depth_m <= 0.0 {
            return;
        }
        let away =
            normalized(sub(nearest.on_body, nearest.on_core)).unwrap_or_else(|| across_rod(before));
        let fraction =
            if i == j { 0.0 } else { fraction_along(nearest.on_body, [points[i], points[j]]) };
        let weights = [self.inverse_mass(i) * (1.0 - fraction), self.inverse_mass(j) * fraction];
        // The displacement of the nearest point per unit of push; near an end that may not move, a push
        // would swing the other one far away.
        let square = weights[0] * (1.0 - fraction) + weights[1] * fraction;
        // A part in the margin alone is pushed too, but violates nothing.
        if nearest.distance_m < keep_m {
            self.violation_m += depth_m;
        }
        if square > MIN_RESPONSE {
            points[i] = add_scaled(points[i], away, PUSH_FACTOR * depth_m * weights[0] / square);
            if j != i {
                points[j] =
                    add_scaled(points[j], away, PUSH_FACTOR * depth_m * weights[1] / square);
            }
        }
    }
}

fn across_rod<const D: usize>(rod: [Point<D>; 2]) -> Point<D> {
    perpendicular(normalized(sub(rod[1], rod[0])).unwrap_or(unit_x()))
}

/// Returns the position of a point along a segment, in [0, 1].
fn fraction_along<const D: usize>(p: Point<D>, [a, b]: [Point<D>; 2]) -> f64 {
    let d = sub(b, a);
    let square = dot(d, d);
    if square > 0.0 { (dot(sub(p, a), scaled(d, 1.0 / square))).clamp(0.0, 1.0) } else { 0.0 }
}
