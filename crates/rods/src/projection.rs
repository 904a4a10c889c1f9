//! The least motion of a chain whose connector goes to a target: all parts move at once, rods keep their limits, and
//! connectors that are held stay where they may be.
//!
//! The rods of a chain depend only on their neighbors, so the equations for the corrections of all lengths are a band
//! of three, and a step of Newton's method takes time linear in the rods. Unlike passes from one end of the chain to
//! the other it does not care how many connectors are held, and moves no joint farther than it must. Parts that come
//! too near each other are pushed apart between the steps, as in position-based dynamics.

use super::chain::{Chain, Connector, Mobility};
use super::geometry::{
    Aabb, Point, add_scaled, between_segments, dot, norm, normalized, perpendicular, scaled, sub,
    unit_x,
};
use super::own_body::{ChainPart, part_pairs};
use super::rod_bvh::RodBvh;

/// Steps of Newton's method at most. Near the limits each squares the error; more are needed only where a connector is
/// caught at the end of its rail or at a side of its box.
const MAX_STEPS: usize = 24;
/// Error of a length at which it counts as corrected, meters: a hundredth of the tolerance of lengths.
const ERROR_TOLERANCE_M: f64 = 1e-11;
/// Keeps the equations solvable if a straight chain is held at both ends.
const DAMPING: f64 = 1e-9;
/// Rounds of pushes apart, at most. Parts that are still too near after so many are caught between others.
const MAX_PUSHES: usize = 12;
/// Distance beyond that to be kept to which parts are pushed, as a fraction of it: the correction of the lengths takes
/// some back.
const PUSH_MARGIN: f64 = 0.01;
/// Response of a part to a push below which it counts as held, because the division by it would throw it about.
const MIN_RESPONSE: f64 = 1e-6;
/// Distance by which connectors are moved off a straight line, as a fraction of the longest rod: enough for the
/// equations to be far from singular, and less than the thickness of most rods.
const BUCKLE: f64 = 1e-3;
/// Longest correction of a connector in one step, as a fraction of the longest rod: a longer one leads to another
/// posture, which is no motion.
const MAX_CORRECTION: f64 = 0.5;

/// The reason for which there is no posture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ProjectionFailure {
    /// The rods do not reach, or only in another posture.
    Lengths,
    /// Parts of the chain are in each other's way.
    OwnBody,
}

/// Projects postures onto the constraints of a chain; owns its buffers.
#[derive(Debug, Clone, Default)]
pub struct ConstraintProjector<const D: usize> {
    /// Direction of each rod that is out of its limits, or of a fixed length; zero for others.
    directions: Vec<Point<D>>,
    /// Main diagonal, then pivots; side diagonal toward the rod before; errors of the lengths, then the solution.
    diagonal: Vec<f64>,
    side: Vec<f64>,
    errors_m: Vec<f64>,
    /// For each connector whether it is at an end of its rail, or at a side of its box along each axis.
    at_limit: Vec<[bool; D]>,
    tree: RodBvh<D>,
}

/// The chain before the motion, and the connector that leads it, if one does.
#[derive(Clone, Copy)]
struct ProjectionContext<'a, const D: usize> {
    chain: &'a Chain<D>,
    k: Option<usize>,
}

impl<const D: usize> ProjectionContext<'_, D> {
    fn connector(&self, i: usize) -> &Connector<D> {
        &self.chain.connectors()[i]
    }

    /// Returns the part of a push that moves connector `i`.
    #[inline]
    fn free_part(&self, i: usize, push: Point<D>, at_limit: [bool; D]) -> Point<D> {
        let connector = self.connector(i);
        if self.k == Some(i) || connector.is_still() {
            return [0.0; D];
        }
        match connector.mobility {
            Mobility::Fixed => [0.0; D],
            Mobility::Free => push,
            Mobility::OnSegment(_) if at_limit[0] => [0.0; D],
            Mobility::OnSegment([a, b]) => {
                let along = normalized(sub(b, a)).unwrap_or([0.0; D]);
                scaled(along, dot(along, push))
            }
            Mobility::OnPlane { normal, .. } => add_scaled(push, normal, -dot(normal, push)),
            Mobility::InBox { .. } => {
                std::array::from_fn(|axis| if at_limit[axis] { 0.0 } else { push[axis] })
            }
        }
    }
}

impl<const D: usize> ConstraintProjector<D> {
    /// Changes `points`, where connector `k` is at its target and all others where they were, to a posture near by that
    /// keeps rods and mobilities and, if `is_solid`, the distances of the chain's own parts.
    pub(super) fn project(
        &mut self,
        chain: &Chain<D>,
        points: &mut [Point<D>],
        k: usize,
        is_solid: bool,
    ) -> Result<(), ProjectionFailure> {
        let context = ProjectionContext { chain, k: Some(k) };
        let target = points[k];
        let settled = self.settle(context, points, is_solid);
        if settled != Err(ProjectionFailure::Lengths) {
            return settled;
        }
        // Along a straight chain all corrections point the same way, and it cannot be shortened by them; a little off
        // the line it buckles.
        let off_m = BUCKLE * chain.max_rod_m();
        for side in [1.0, -1.0] {
            points.copy_from_slice(chain.points());
            points[k] = target;
            for i in 1..points.len().saturating_sub(1) {
                let along = sub(chain.points()[i + 1], chain.points()[i - 1]);
                let across = perpendicular(normalized(along).unwrap_or(unit_x()));
                let by = context.free_part(i, scaled(across, side * off_m), [false; D]);
                points[i] = add_scaled(points[i], by, 1.0);
            }
            if self.settle(context, points, is_solid).is_ok() {
                return Ok(());
            }
        }
        settled
    }

    /// Changes `points` to a posture near by in which rods have allowed lengths and, if `is_solid`, the chain's own parts
    /// keep their distances, while connector `pinned` and those that are still stay where they are given; returns whether
    /// there is one.
    ///
    /// `points` has one point for every connector.
    pub fn correct_posture(
        &mut self,
        chain: &Chain<D>,
        points: &mut [Point<D>],
        pinned: Option<usize>,
        is_solid: bool,
    ) -> bool {
        self.settle(ProjectionContext { chain, k: pinned }, points, is_solid).is_ok()
    }

    /// Corrects lengths and pushes parts apart in turn, until both are as they should be.
    fn settle(
        &mut self,
        context: ProjectionContext<'_, D>,
        points: &mut [Point<D>],
        is_solid: bool,
    ) -> Result<(), ProjectionFailure> {
        self.at_limit.clear();
        self.at_limit.resize(points.len(), [false; D]);
        for _ in 0..MAX_PUSHES {
            if !self.correct_lengths(context, points) {
                return Err(ProjectionFailure::Lengths);
            }
            if !is_solid || !self.push_apart(context, points) {
                return Ok(());
            }
        }
        Err(ProjectionFailure::OwnBody)
    }

    fn correct_lengths(
        &mut self,
        context: ProjectionContext<'_, D>,
        points: &mut [Point<D>],
    ) -> bool {
        let max_correction_m = MAX_CORRECTION * context.chain.max_rod_m();
        for _ in 0..MAX_STEPS {
            if self.measure(context, points) <= ERROR_TOLERANCE_M {
                return true;
            }
            self.assemble_equations(context);
            self.eliminate();
            if self.apply_corrections(context, points) > max_correction_m {
                return false;
            }
        }
        self.measure(context, points) <= ERROR_TOLERANCE_M
    }

    /// Measures directions and errors of the rods; returns the greatest error, meters.
    fn measure(&mut self, context: ProjectionContext<'_, D>, points: &[Point<D>]) -> f64 {
        self.directions.clear();
        self.errors_m.clear();
        let mut worst_m = 0.0_f64;
        for (ends, rod) in points.windows(2).zip(context.chain.rods()) {
            let along = sub(ends[1], ends[0]);
            let length_m = norm(along);
            let error_m = length_m - length_m.clamp(rod.min_m, rod.max_m);
            let counts = (error_m != 0.0 || rod.min_m == rod.max_m) && length_m > 0.0;
            self.directions.push(if counts { scaled(along, 1.0 / length_m) } else { [0.0; D] });
            self.errors_m.push(if counts { error_m } else { 0.0 });
            worst_m = worst_m.max(error_m.abs());
        }
        worst_m
    }

    fn assemble_equations(&mut self, context: ProjectionContext<'_, D>) {
        self.diagonal.clear();
        self.side.clear();
        for (i, u) in self.directions.iter().enumerate() {
            let inner = context.free_part(i, *u, self.at_limit[i]);
            let outer = context.free_part(i + 1, *u, self.at_limit[i + 1]);
            let response = dot(inner, *u) + dot(outer, *u);
            // A rod within its limits, or held at both ends, has the equation "no correction".
            self.diagonal.push(if response > 0.0 { response + DAMPING } else { 1.0 });
            let before = i.checked_sub(1).map_or([0.0; D], |before| self.directions[before]);
            self.side.push(-dot(inner, before));
        }
    }

    /// Solves the equations; the solution replaces the errors.
    fn eliminate(&mut self) {
        let Self { diagonal, side, errors_m, .. } = self;
        for i in 1..diagonal.len() {
            let factor = side[i] / diagonal[i - 1];
            diagonal[i] -= factor * side[i];
            errors_m[i] -= factor * errors_m[i - 1];
        }
        for i in (0..diagonal.len()).rev() {
            let after = if i + 1 < diagonal.len() { side[i + 1] * errors_m[i + 1] } else { 0.0 };
            errors_m[i] = (errors_m[i] - after) / diagonal[i];
        }
    }

    /// Moves the connectors by the solution; returns the longest correction, meters.
    fn apply_corrections(
        &mut self,
        context: ProjectionContext<'_, D>,
        points: &mut [Point<D>],
    ) -> f64 {
        let mut longest_m = 0.0_f64;
        for i in 0..points.len() {
            let mut push = [0.0; D];
            if let Some(u) = self.directions.get(i) {
                push = add_scaled(push, *u, self.errors_m[i]);
            }
            if let Some(before) = i.checked_sub(1) {
                push = add_scaled(push, self.directions[before], -self.errors_m[before]);
            }
            let by = context.free_part(i, push, self.at_limit[i]);
            points[i] = add_scaled(points[i], by, 1.0);
            longest_m = longest_m.max(norm(by));
            self.keep_mobility(context, i, points);
        }
        longest_m
    }

    /// Puts a connector back where its mobility allows it to be, and remembers the limit at which it is.
    fn keep_mobility(
        &mut self,
        context: ProjectionContext<'_, D>,
        i: usize,
        points: &mut [Point<D>],
    ) {
        let connector = context.connector(i);
        if context.k == Some(i) || connector.is_still() || connector.mobility == Mobility::Free {
            return;
        }
        let wanted = points[i];
        points[i] = connector.mobility.project(wanted, context.chain.points()[i]);
        match connector.mobility {
            Mobility::OnSegment(ends) if ends.contains(&points[i]) => self.at_limit[i][0] = true,
            Mobility::InBox { .. } => {
                for axis in 0..D {
                    self.at_limit[i][axis] |= points[i][axis] != wanted[axis];
                }
            }
            _ => {}
        }
    }

    /// Pushes parts apart that are nearer than they may be; returns whether there were any.
    fn push_apart(&mut self, context: ProjectionContext<'_, D>, points: &mut [Point<D>]) -> bool {
        let chain = context.chain;
        let rods = chain.rods().len();
        let bounds = |points: &[Point<D>], rod: usize| -> Aabb<D> {
            chain.rod_bounds(rod, [points[rod], points[rod + 1]], 0.0)
        };
        let mut tree = std::mem::take(&mut self.tree);
        tree.refit((0..rods).map(|rod| bounds(points, rod)));
        let mut has_pushed = false;
        for rod in 0..rods {
            let near = bounds(points, rod);
            tree.visit(&near, |other| {
                if other >= rod {
                    for parts in part_pairs(rod, other, rods) {
                        has_pushed |= self.push_pair_apart(context, points, parts);
                    }
                }
            });
        }
        self.tree = tree;
        has_pushed
    }

    fn push_pair_apart(
        &self,
        context: ProjectionContext<'_, D>,
        points: &mut [Point<D>],
        [one, other]: [ChainPart; 2],
    ) -> bool {
        let chain = context.chain;
        let Some(separation_m) = chain.min_separation_m(one, other) else { return false };
        let nearest = between_segments(one.ends(points), other.ends(points));
        if nearest.distance_m >= separation_m {
            return false;
        }
        let depth_m = separation_m * (1.0 + PUSH_MARGIN) - nearest.distance_m;
        // Parts that cross are pushed back to the side from which they came.
        let was = between_segments(one.ends(chain.points()), other.ends(chain.points()));
        let away = normalized(sub(nearest.on_body, nearest.on_core))
            .or(normalized(sub(was.on_body, was.on_core)))
            .unwrap_or_else(|| perpendicular(unit_x()));
        let levers = [(one, nearest.on_body, 1.0), (other, nearest.on_core, -1.0)].map(
            |(part, at, sign)| part_levers(points, part, at).map(|(k, lever)| (k, sign * lever)),
        );
        let response: f64 = levers
            .iter()
            .flatten()
            .map(|(k, lever)| {
                lever * lever * dot(context.free_part(*k, away, self.at_limit[*k]), away)
            })
            .sum();
        if response > MIN_RESPONSE {
            for (k, lever) in levers.into_iter().flatten() {
                let by = context.free_part(k, away, self.at_limit[k]);
                points[k] = add_scaled(points[k], by, depth_m * lever / response);
            }
        }
        true
    }
}

/// Returns the connectors of a part with their shares in a point of it; a connector has one, given twice.
fn part_levers<const D: usize>(
    points: &[Point<D>],
    part: ChainPart,
    at: Point<D>,
) -> [(usize, f64); 2] {
    let [low, high] = [part.connector(), part.last_connector()];
    if low == high {
        return [(low, 1.0), (high, 0.0)];
    }
    let along = sub(points[high], points[low]);
    let fraction = (dot(sub(at, points[low]), along) / dot(along, along)).clamp(0.0, 1.0);
    [(low, 1.0 - fraction), (high, fraction)]
}
