//! Simple postures of a chain: straight ones, and arcs that end at a target.
//!
//! From any straight posture every arc can be reached without the chain meeting itself. A chain between two fixed ends
//! reaches a target by two arcs, one from each end.

use super::space::ChainConfigurationSpace;
use super::{ChainPosture, ConfigurationSpace, PlanningQuery};
use sidestep_kernel::math;
use sidestep_rods::Mobility;
use sidestep_rods::geometry::{
    Point, add, add_scaled, distance, lerp, norm, normalized, perpendicular, scaled, sub, unit_x,
};
use std::f64::consts::TAU;

/// Distances of the root from the target, in lengths of the chain between them, of which arcs are tried: from gentle
/// ones, which meet nothing of themselves, to half circles and more.
const ARC_REACHES: [f64; 4] = [0.9, 0.7, 0.4, 0.15];
/// Bisections that find the bend of an arc, and the place of the root: to less than rounding.
const BISECTIONS: usize = 60;

impl<const D: usize> ChainConfigurationSpace<'_, D> {
    /// Returns postures at the target: arcs to both sides, from several places of the root, the gentlest first. Some
    /// may be in obstacles, or in the chain itself.
    pub(super) fn arc_postures(&self, query: &PlanningQuery<D>) -> Vec<ChainPosture<D>> {
        if let Some(end) = self.far_end() {
            return self.two_arc_postures(query.target, end);
        }
        let mut postures = Vec::new();
        for root_at in self.root_places(query) {
            let across = perpendicular(normalized(sub(query.target, root_at)).unwrap_or(unit_x()));
            for side in [1.0, -1.0] {
                postures.extend(self.arc_posture(root_at, query.target, scaled(across, side)));
            }
        }
        postures
    }

    /// Returns postures of a chain between two fixed ends whose initiator is at a place: an arc from each end to there, to all
    /// sides.
    pub(super) fn two_arc_postures(&self, place: Point<D>, end: usize) -> Vec<ChainPosture<D>> {
        let limb: Vec<usize> = (self.root()..=end).collect();
        let [before, after] = [self.root()..=self.initiator(), self.initiator()..=end]
            .map(|part| self.mean_lengths_m(part));
        let root_at = self.chain().points()[self.root()];
        let end_at = self.chain().points()[end];
        let mut postures = Vec::new();
        for side in sides(sub(place, root_at)) {
            let Some(first) = Arc::between([root_at, place], side, &before) else { continue };
            for other_side in sides(sub(end_at, place)) {
                let Some(second) = Arc::between([place, end_at], other_side, &after) else {
                    continue;
                };
                let mut posture = self.present_posture();
                let ends = first.rod_ends(&before).into_iter().chain(second.rod_ends(&after));
                for (k, at) in limb[1..].iter().zip(ends) {
                    posture[*k] = at;
                }
                // Rounding of the arcs, which end beside the other fixed end.
                postures.extend(self.closed_posture(posture));
            }
        }
        postures
    }

    /// Returns a posture whose rods all have one direction, from a place of the root; behind the root they go on.
    pub(super) fn straight_posture(&self, root_at: Point<D>, u: Point<D>) -> ChainPosture<D> {
        self.bend_posture(root_at, [u, perpendicular(u)], 0.0)
    }

    /// Returns the direction of the first rod of a posture toward the initiator.
    pub(super) fn lead_direction(&self, posture: &ChainPosture<D>) -> Point<D> {
        let next = if self.initiator() > self.root() { self.root() + 1 } else { self.root() - 1 };
        normalized(sub(posture[next], posture[self.root()])).unwrap_or(unit_x())
    }

    /// Returns places of the root from which arcs are tried.
    fn root_places(&self, query: &PlanningQuery<D>) -> Vec<Point<D>> {
        let present = self.chain().points()[self.root()];
        if self.is_root_still() {
            return vec![present];
        }
        let mobility = self.chain().connectors()[self.root()].mobility;
        let nearest = match mobility {
            Mobility::Free => query.target,
            _ => mobility.project(query.target, present),
        };
        let length_m = self.length_between(query.k);
        let far_m = |at: Point<D>| distance(at, query.target);
        let mut places = Vec::new();
        for reach in ARC_REACHES {
            let wanted_m = reach * length_m;
            if far_m(nearest) >= wanted_m {
                places.push(nearest);
                continue;
            }
            if far_m(present) <= wanted_m {
                places.push(present);
                continue;
            }
            // The places that a root may have are convex, so all between these two are allowed.
            let [mut far, mut near] = [0.0, 1.0];
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (far + near);
                if far_m(lerp(present, nearest, middle)) > wanted_m {
                    far = middle;
                } else {
                    near = middle;
                }
            }
            places.push(lerp(present, nearest, near));
        }
        places.dedup();
        places
    }

    /// Returns the arc from the root to a target, bent to one side; none if the rods do not reach.
    fn arc_posture(
        &self,
        root_at: Point<D>,
        target: Point<D>,
        across: Point<D>,
    ) -> Option<ChainPosture<D>> {
        let arc = Arc::between([root_at, target], across, &self.rods_to_initiator())?;
        Some(self.bend_posture(root_at, arc.axes, arc.bend_rad))
    }

    /// Returns a posture whose rods from the root to the initiator bend by the same angle at each connector, from the
    /// first direction toward the second; all other rods go straight on.
    fn bend_posture(
        &self,
        root_at: Point<D>,
        [first, second]: [Point<D>; 2],
        bend_rad: f64,
    ) -> ChainPosture<D> {
        let mut posture = self.moved_root(root_at);
        let lead_rods = self.rods_to_initiator().len();
        for limb in self.limbs() {
            let leads = limb.contains(&self.initiator());
            for (j, pair) in limb.windows(2).enumerate() {
                let turns = if leads { j.min(lead_rods.saturating_sub(1)) } else { 0 };
                let direction_rad = turns as f64 * bend_rad;
                let c = math::cos(direction_rad);
                let s = math::sin(direction_rad);
                let ahead = add(scaled(first, c), scaled(second, s));
                let u = if leads { ahead } else { scaled(first, -1.0) };
                posture[pair[1]] =
                    add_scaled(posture[pair[0]], u, self.mean_length_m(pair[0], pair[1]));
            }
        }
        posture
    }
}

/// Rods that bend by the same angle at each connector.
struct Arc<const D: usize> {
    from: Point<D>,
    /// The direction of the first rod, and that across it toward which the next ones turn.
    axes: [Point<D>; 2],
    bend_rad: f64,
}

impl<const D: usize> Arc<D> {
    /// Returns the arc of rods from one place to another, which bulges away from a direction across; none if the rods do not
    /// reach.
    fn between([from, to]: [Point<D>; 2], across: Point<D>, lengths_m: &[f64]) -> Option<Self> {
        let chord_m = distance(from, to);
        let arc_chord_m = |bend_rad: f64| {
            let ends = lengths_m.iter().enumerate().fold([0.0; 2], |[x, y], (j, length_m)| {
                let direction_rad = j as f64 * bend_rad;
                [x + length_m * math::cos(direction_rad), y + length_m * math::sin(direction_rad)]
            });
            (norm(ends), ends)
        };
        if arc_chord_m(0.0).0 < chord_m {
            return None;
        }
        let [mut straight_rad, mut bent_rad] = [0.0, TAU / lengths_m.len().max(2) as f64];
        for _ in 0..BISECTIONS {
            let middle_rad = 0.5 * (straight_rad + bent_rad);
            if arc_chord_m(middle_rad).0 > chord_m {
                straight_rad = middle_rad;
            } else {
                bent_rad = middle_rad;
            }
        }
        let (_, [x, y]) = arc_chord_m(bent_rad);
        let toward = normalized(sub(to, from)).unwrap_or(unit_x());
        // The first rod points beside the chord by the angle under which the arc's end is seen from it.
        let beside_rad = math::atan2(y, x);
        let c = math::cos(beside_rad);
        let s = math::sin(beside_rad);
        let first = add(scaled(toward, c), scaled(across, -s));
        let second = add(scaled(toward, s), scaled(across, c));
        Some(Self { from, axes: [first, second], bend_rad: bent_rad })
    }

    /// Returns the ends of its rods.
    fn rod_ends(&self, lengths_m: &[f64]) -> Vec<Point<D>> {
        let mut at = self.from;
        let rods = lengths_m.iter().enumerate();
        rods.map(|(j, length_m)| {
            let direction_rad = j as f64 * self.bend_rad;
            let u = add(
                scaled(self.axes[0], math::cos(direction_rad)),
                scaled(self.axes[1], math::sin(direction_rad)),
            );
            at = add_scaled(at, u, *length_m);
            at
        })
        .collect()
    }
}

/// Returns directions across another: to both sides in the plane, and four in space.
fn sides<const D: usize>(along: Point<D>) -> Vec<Point<D>> {
    let u = normalized(along).unwrap_or(unit_x());
    let mut sides = Vec::new();
    let first = perpendicular(u);
    sides.extend([first, scaled(first, -1.0)]);
    if D == 3 {
        let second: Point<D> = std::array::from_fn(|i| {
            let [j, k] = [(i + 1) % D, (i + 2) % D];
            u[j] * first[k] - u[k] * first[j]
        });
        sides.extend([second, scaled(second, -1.0)]);
    }
    sides
}
