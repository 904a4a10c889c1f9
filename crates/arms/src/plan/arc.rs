//! Simple postures of a chain: straight ones, and arcs that end at a target.
//!
//! A chain that is caught in its own body gets out of it by uncurling, and to a target by curling up again: from any
//! straight posture every arc can be reached without the chain meeting itself. So they are worth a try before any
//! random postures.

use super::space::ChainConfigurationSpace;
use super::{ChainPosture, ConfigurationSpace, PlanningQuery};
use sidestep_kernel::math;
use sidestep_rods::Mobility;
use sidestep_rods::geometry::{
    Point, add, add_scaled, angle_between_rad, distance, dot, lerp, norm, normalized,
    perpendicular, scaled, sub, unit_x,
};
use std::f64::consts::TAU;

/// Distances of the root from the target, in lengths of the chain between them, of which arcs are tried: from gentle
/// ones, which meet nothing of themselves, to half circles and more.
const ARC_REACHES: [f64; 4] = [0.9, 0.7, 0.4, 0.15];
/// Steps in which a chain uncurls: in each its rods turn by a tenth of all its bends, little enough to go straight from
/// one posture to the next.
const UNCURL_STEPS: usize = 10;
/// Bisections that find the bend of an arc, and the place of the root: to less than rounding.
const BISECTIONS: usize = 60;

impl<const D: usize> ChainConfigurationSpace<'_, D> {
    /// Returns postures at the target: arcs to both sides, from several places of the root, the gentlest first. Some
    /// may be in obstacles, or in the chain itself.
    pub(super) fn arc_postures(&self, query: &PlanningQuery<D>) -> Vec<ChainPosture<D>> {
        let mut postures = Vec::new();
        for root_at in self.root_places(query) {
            let across = perpendicular(normalized(sub(query.target, root_at)).unwrap_or(unit_x()));
            for side in [1.0, -1.0] {
                postures.extend(self.arc_posture(root_at, query.target, scaled(across, side)));
            }
        }
        postures
    }

    /// Returns postures on the way to a straight one, and straight ones: the chain as it uncurls about its root, all
    /// bends by the same share at once; then straight, across that direction to either side, and toward the target.
    pub(super) fn uncurling_postures(&self, query: &PlanningQuery<D>) -> Vec<ChainPosture<D>> {
        let shares = (0..UNCURL_STEPS).rev().map(|step| step as f64 / UNCURL_STEPS as f64);
        let mut postures: Vec<_> = shares.map(|share| self.unbent_posture(share)).collect();
        let root_at = self.chain().points()[self.root()];
        let first = self.lead_direction();
        let across = perpendicular(first);
        let toward = normalized(sub(query.target, root_at)).unwrap_or(first);
        for u in [across, scaled(across, -1.0), toward] {
            postures.push(self.bent_posture(root_at, [u, perpendicular(u)], 0.0));
        }
        postures
    }

    /// Returns the direction of the first rod toward the initiator.
    fn lead_direction(&self) -> Point<D> {
        let points = self.chain().points();
        let next = if self.initiator() > self.root() { self.root() + 1 } else { self.root() - 1 };
        normalized(sub(points[next], points[self.root()])).unwrap_or(unit_x())
    }

    /// Returns the present posture with only a share of each bend, about the same root and first rods.
    fn unbent_posture(&self, share: f64) -> ChainPosture<D> {
        let points = self.chain().points();
        let mut posture = self.present_posture();
        for limb in self.limbs() {
            let direction = |pair: &[usize]| {
                normalized(sub(points[pair[1]], points[pair[0]])).unwrap_or(unit_x())
            };
            // What the bends so far have turned the rest of the limb by, as the images of the axes.
            let mut turned: [Point<D>; D] =
                std::array::from_fn(|axis| std::array::from_fn(|i| f64::from(u8::from(i == axis))));
            let mut before: Option<Point<D>> = None;
            for pair in limb.windows(2) {
                let was = direction(pair);
                let kept = before.map_or(was, |before| part_of_turn(before, was, share));
                let u = normalized(image(&turned, kept)).unwrap_or(unit_x());
                let from = image(&turned, was);
                turned = turned.map(|axis| rotated(axis, from, u));
                before = Some(was);
                let length_m = distance(points[pair[0]], points[pair[1]]);
                posture[pair[1]] = add_scaled(posture[pair[0]], u, length_m);
            }
        }
        posture
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
        let rods = self.rods_to_initiator();
        let chord_m = distance(root_at, target);
        let arc_chord_m = |bend_rad: f64| {
            let ends = rods.iter().enumerate().fold([0.0; 2], |[x, y], (j, length_m)| {
                let direction_rad = j as f64 * bend_rad;
                [x + length_m * math::cos(direction_rad), y + length_m * math::sin(direction_rad)]
            });
            (norm(ends), ends)
        };
        if arc_chord_m(0.0).0 < chord_m {
            return None;
        }
        let [mut straight_rad, mut bent_rad] = [0.0, TAU / rods.len().max(2) as f64];
        for _ in 0..BISECTIONS {
            let middle_rad = 0.5 * (straight_rad + bent_rad);
            if arc_chord_m(middle_rad).0 > chord_m {
                straight_rad = middle_rad;
            } else {
                bent_rad = middle_rad;
            }
        }
        let (_, [x, y]) = arc_chord_m(bent_rad);
        let toward = normalized(sub(target, root_at)).unwrap_or(unit_x());
        // The first rod points beside the chord by the angle under which the arc's end is seen from it.
        let beside_rad = math::atan2(y, x);
        let c = math::cos(beside_rad);
        let s = math::sin(beside_rad);
        let first = add(scaled(toward, c), scaled(across, -s));
        let second = add(scaled(toward, s), scaled(across, c));
        Some(self.bent_posture(root_at, [first, second], bent_rad))
    }

    /// Returns a posture whose rods from the root to the initiator bend by the same angle at each connector, from the
    /// first direction toward the second; all other rods go straight on.
    fn bent_posture(
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

/// Returns the direction at a share of the turn from one unit vector to another.
fn part_of_turn<const D: usize>(from: Point<D>, to: Point<D>, share: f64) -> Point<D> {
    let turn_rad = share * angle_between_rad(from, to);
    let across = normalized(add_scaled(to, from, -dot(from, to))).unwrap_or(perpendicular(from));
    add(scaled(from, math::cos(turn_rad)), scaled(across, math::sin(turn_rad)))
}

/// Returns the image of a vector under a linear map, which is given by the images of the axes.
fn image<const D: usize>(axes: &[Point<D>; D], v: Point<D>) -> Point<D> {
    (0..D).fold([0.0; D], |sum, axis| add_scaled(sum, axes[axis], v[axis]))
}

/// Turns a vector by the rotation that takes one unit vector to another in their plane.
fn rotated<const D: usize>(v: Point<D>, from: Point<D>, to: Point<D>) -> Point<D> {
    let middle = add(from, to);
    // Opposite vectors have no plane of their own; a chain does not bend by half a turn.
    let scale = 1.0 / (1.0 + dot(from, to)).max(f64::MIN_POSITIVE);
    let off_middle = add_scaled(v, middle, -scale * dot(middle, v));
    add_scaled(off_middle, to, 2.0 * dot(from, v))
}
