//! Unfolding: a chain that is caught in its own body gets out of it as its parts push each other apart.
//!
//! The rods of a chain repel each other, and the posture goes down the slope of that energy. In the plane no chain is
//! caught for good: a repulsion that grows without limit near a contact straightens it, or makes it convex if it is
//! held at both ends. Source: Cantarella, Demaine, Iben and O'Brien, "An energy-driven approach to linkage
//! unfolding", SoCG 2004.

use super::space::ChainConfigurationSpace;
use super::{ChainPosture, ConfigurationSpace};
use sidestep_kernel::interrupt;
use sidestep_rods::ChainPart;
use sidestep_rods::geometry::{
    Point, add_scaled, between_segments, distance, dot, move_toward, norm, normalized, scaled, sub,
    unit_x,
};

/// Steps at most.
const MAX_STEPS: usize = 3_000;
/// Pairs of rods in all steps of an unfolding at most: as many as those of the most steps of 64 rods.
const MAX_EFFORT: usize = MAX_STEPS * 64 * 64;
/// Longest and shortest step of a connector, as fractions of the longest rod: a step that is not free, or leads uphill, is
/// halved, and one that is free is longer next time.
const MAX_STEP_FRACTION: f64 = 0.5;
const MIN_STEP_FRACTION: f64 = 1e-5;
/// Longest step of an initiator that is led, as a fraction of the longest rod.
const LED_STEP: f64 = 0.1;
/// Growth of steps that succeed.
const STEP_GROWTH: f64 = 1.5;
/// Gap that is added to that of two parts, as a fraction of the longest rod: parts that touch repel each other strongly,
/// and not so much more than all others that nothing else moves.
const SOFTNESS: f64 = 0.05;

/// Two parts that repel each other: the connectors at their ends, with the shares of their force.
struct Repulsion<const D: usize> {
    energy: f64,
    force: Point<D>,
    levers: [(usize, f64); 4],
}

impl<const D: usize> ChainConfigurationSpace<'_, D> {
    /// Returns postures that unfold a free one, each with a free straight path from the one before, until `is_enough`
    /// says of a posture that it will do. The last one may be caught all the same.
    pub(super) fn unfolding_postures(
        &self,
        from: &ChainPosture<D>,
        mut is_enough: impl FnMut(&ChainPosture<D>) -> bool,
    ) -> Vec<ChainPosture<D>> {
        let rod_m = self.longest_rod_m();
        let mut postures = Vec::new();
        let mut at = from.clone();
        let mut step_m = MAX_STEP_FRACTION * rod_m;
        let rods = self.chain().rods().len().max(1);
        let steps = MAX_STEPS.min(MAX_EFFORT / (rods * rods));
        for _ in 0..steps {
            interrupt::check();
            let (energy, forces) = self.repulsion(&at);
            let mut moved = None;
            while moved.is_none() && step_m >= MIN_STEP_FRACTION * rod_m {
                moved = self
                    .push_posture(&at, &forces, step_m)
                    .filter(|next| self.repulsion(next).0 < energy && self.is_path_free(&at, next));
                if moved.is_none() {
                    step_m *= 0.5;
                }
            }
            let Some(next) = moved else { break };
            step_m = (STEP_GROWTH * step_m).min(MAX_STEP_FRACTION * rod_m);
            at = next;
            postures.push(at.clone());
            if is_enough(&at) {
                break;
            }
        }
        postures
    }

    /// Returns the energy of all pairs of rods that share no connector, and the forces on the connectors.
    fn repulsion(&self, points: &[Point<D>]) -> (f64, Vec<Point<D>>) {
        let rods = self.chain().rods().len();
        let mut energy = 0.0;
        let mut forces = vec![[0.0; D]; points.len()];
        for one in 0..rods {
            for other in one + 1..rods {
                let pair = self.pair_repulsion(points, [one, other]);
                energy += pair.energy;
                for (k, share) in pair.levers {
                    forces[k] = add_scaled(forces[k], pair.force, share);
                }
            }
        }
        (energy, forces)
    }

    /// Returns the repulsion of two rods; of those that share a connector only the far ends repel each other.
    fn pair_repulsion(&self, points: &[Point<D>], [one, other]: [usize; 2]) -> Repulsion<D> {
        let parts = if other == one + 1 {
            [ChainPart::Connector(one), ChainPart::Connector(other + 1)]
        } else {
            [ChainPart::Rod(one), ChainPart::Rod(other)]
        };
        let [first, second] = parts.map(|part| [part.connector(), part.last_connector()]);
        let nearest = between_segments(parts[0].ends(points), parts[1].ends(points));
        // Connectors are thicker than rods, and keep them apart where they are.
        let keep_m = self.contact_m(parts);
        let gap_m = nearest.distance_m - keep_m;
        let soft_m = gap_m.max(0.0) + SOFTNESS * self.longest_rod_m();
        let away = normalized(sub(nearest.on_body, nearest.on_core)).unwrap_or(unit_x());
        let shares = |ends: [usize; 2], at: Point<D>, sign: f64| {
            let along = sub(points[ends[1]], points[ends[0]]);
            let squared = dot(along, along);
            let fraction =
                if squared > 0.0 { dot(sub(at, points[ends[0]]), along) / squared } else { 0.0 };
            [(ends[0], sign * (1.0 - fraction)), (ends[1], sign * fraction)]
        };
        let [a, b] = shares(first, nearest.on_body, 1.0);
        let [c, d] = shares(second, nearest.on_core, -1.0);
        Repulsion {
            energy: 1.0 / soft_m,
            force: scaled(away, 1.0 / (soft_m * soft_m)),
            levers: [a, b, c, d],
        }
    }

    /// Returns the distance at which two parts touch with the connectors at their ends, meters.
    fn contact_m(&self, parts: [ChainPart; 2]) -> f64 {
        let connectors = self.chain().connectors();
        let radius_m = |part: ChainPart| {
            connectors[part.connector()].radius_m.max(connectors[part.last_connector()].radius_m)
        };
        radius_m(parts[0]) + radius_m(parts[1])
    }

    /// Returns the posture after a step in which no connector moves farther than `step_m`, if there is one.
    fn push_posture(
        &self,
        at: &ChainPosture<D>,
        forces: &[Point<D>],
        step_m: f64,
    ) -> Option<ChainPosture<D>> {
        let far_end = self.far_end();
        if far_end.is_some() {
            self.shifted_posture(at, forces, step_m)
        } else {
            self.turned_posture(at, forces, step_m)
        }
    }

    /// Returns the posture of an open chain after a step: each rod turns as the forces on all that it carries turn it, so that
    /// long parts swing as fast as short ones.
    fn turned_posture(
        &self,
        at: &ChainPosture<D>,
        forces: &[Point<D>],
        step_m: f64,
    ) -> Option<ChainPosture<D>> {
        let mut turns = vec![[0.0; D]; at.len()];
        for limb in self.limbs() {
            let mut carried = [0.0; D];
            for pair in limb.windows(2).rev() {
                carried = add_scaled(carried, forces[pair[1]], 1.0);
                let along = sub(at[pair[1]], at[pair[0]]);
                turns[pair[1]] =
                    add_scaled(carried, along, -dot(carried, along) / dot(along, along));
            }
        }
        let turned = |scale: f64| {
            let mut posture = at.clone();
            for pair in self.limbs().flat_map(|limb| limb.windows(2)) {
                let along = sub(at[pair[1]], at[pair[0]]);
                let u = normalized(add_scaled(along, turns[pair[1]], scale)).unwrap_or(unit_x());
                posture[pair[1]] = add_scaled(posture[pair[0]], u, norm(along));
            }
            posture
        };
        let widest = turns.iter().map(|turn| norm(*turn)).fold(0.0, f64::max);
        if widest == 0.0 {
            return None;
        }
        // A first guess of the scale, and a correction by what it does to the connector that goes farthest.
        let scale = step_m / widest;
        let moved_m = self.distance_m(at, &turned(scale));
        Some(turned(scale * (step_m / moved_m).min(1.0)))
    }

    /// Returns the posture of a chain between two ends after a step: its connectors go down the slope as far as the rods let
    /// them.
    fn shifted_posture(
        &self,
        at: &ChainPosture<D>,
        forces: &[Point<D>],
        step_m: f64,
    ) -> Option<ChainPosture<D>> {
        let end = self.far_end()?;
        let inner = self.root() + 1..end;
        let strongest = forces[inner.clone()].iter().map(|force| norm(*force)).fold(0.0, f64::max);
        if strongest == 0.0 {
            return None;
        }
        let mut posture = at.clone();
        for k in inner {
            posture[k] = add_scaled(posture[k], forces[k], step_m / strongest);
        }
        self.settle_posture(posture, None)
    }

    /// Returns postures of a chain between two ends on the way of its initiator straight to a place, each with a free straight
    /// path from the one before, while all other parts keep away from each other; none if it does not get there.
    pub(super) fn lead_postures(
        &self,
        from: &ChainPosture<D>,
        place: Point<D>,
    ) -> Option<Vec<ChainPosture<D>>> {
        let k = self.initiator();
        let rod_m = self.longest_rod_m();
        let longest_m = LED_STEP * rod_m;
        let mut step_m = longest_m;
        let mut postures = Vec::new();
        let mut at = from.clone();
        for _ in 0..MAX_STEPS {
            interrupt::check();
            if at[k] == place {
                return Some(postures);
            }
            let (_, forces) = self.repulsion(&at);
            let next = self.lead_posture(&at, &forces, move_toward(at[k], place, step_m));
            match next.filter(|next| self.is_path_free(&at, next)) {
                Some(next) => {
                    step_m = (STEP_GROWTH * step_m).min(longest_m);
                    at = next;
                    postures.push(at.clone());
                }
                None => step_m *= 0.5,
            }
            if step_m < MIN_STEP_FRACTION * rod_m {
                return None;
            }
        }
        None
    }

    /// Returns the posture with the initiator at a place, and all others pushed apart by as much.
    fn lead_posture(
        &self,
        at: &ChainPosture<D>,
        forces: &[Point<D>],
        place: Point<D>,
    ) -> Option<ChainPosture<D>> {
        let k = self.initiator();
        let inner = self.root() + 1..self.far_end()?;
        let strongest = forces[inner.clone()].iter().map(|force| norm(*force)).fold(0.0, f64::max);
        let scale = distance(at[k], place) / strongest.max(f64::MIN_POSITIVE);
        let mut posture = at.clone();
        for i in inner {
            posture[i] = add_scaled(posture[i], forces[i], scale);
        }
        posture[k] = place;
        self.settle_posture(posture, Some(k))
    }
}
