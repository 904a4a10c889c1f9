//! Ways through simple postures: a chain that is caught in its own body unfolds, turns, and curls up at the target.
//!
//! Both ends of a path are retracted to simple postures, which are straight, or convex between two fixed ends; between
//! those there is a way. The motion from the target's posture is followed backward.

use super::space::ChainConfigurationSpace;
use super::{ChainPosture, ConfigurationSpace};
use sidestep_kernel::math;
use sidestep_rods::geometry::{
    Point, add, add_scaled, angle_between_rad, distance, dot, normalized, perpendicular, scaled,
    sub, unit_x,
};

/// Steps in which a chain unbends: in each its rods turn by a tenth of all its bends, little enough to go straight from
/// one posture to the next.
const UNBEND_STEPS: usize = 10;
/// Steps of unfolding after which a chain tries to unbend: a try costs as much as about ten of them.
const UNFOLD_STEPS: usize = 10;
/// Move of all connectors in so many steps, as a fraction of the longest rod, below which a chain between two ends has
/// unfolded.
const MIN_MOVE_FRACTION: f64 = 0.05;

/// Returns postures after the first one, on a way to one of the goals through simple postures, if there is one. A chain
/// between two ends is led from a simple posture to the target, if it can be.
pub(super) fn find_simple_path<const D: usize>(
    space: &ChainConfigurationSpace<'_, D>,
    trail: &[ChainPosture<D>],
    goals: &[ChainPosture<D>],
    target: Point<D>,
) -> Option<Vec<ChainPosture<D>>> {
    let present = space.present_posture();
    let simple = trail.last().unwrap_or(&present);
    if space.far_end().is_some()
        && let Some(led) = space.lead_postures(simple, target)
    {
        return Some([trail, &led].concat());
    }
    for goal in goals {
        let mut back = space.retraction(goal);
        let simple_goal = back.last().unwrap_or(goal);
        let Some(between) = space.turning_path(simple, simple_goal) else { continue };
        back.pop();
        back.reverse();
        let mut path = trail.to_vec();
        path.extend(between);
        path.extend(back);
        path.push(goal.clone());
        return Some(path);
    }
    None
}

impl<const D: usize> ChainConfigurationSpace<'_, D> {
    /// Returns postures from a free one to a simple one, each with a free straight path from the one before. If the chain
    /// stays caught, the last one is not simple.
    pub(super) fn retraction(&self, from: &ChainPosture<D>) -> Vec<ChainPosture<D>> {
        if self.far_end().is_some() {
            let mut count = 0;
            let mut before = from.clone();
            return self.unfolding_postures(from, |at| {
                count += 1;
                if count % UNFOLD_STEPS != 0 {
                    return false;
                }
                let has_come_to_rest =
                    self.distance_m(&before, at) < MIN_MOVE_FRACTION * self.longest_rod_m();
                before.clone_from(at);
                has_come_to_rest
            });
        }
        if let Some(path) = self.unbending_path(from) {
            return path;
        }
        let mut count = 0;
        let mut unbending = None;
        let mut path = self.unfolding_postures(from, |at| {
            count += 1;
            unbending = if count % UNFOLD_STEPS == 0 { self.unbending_path(at) } else { None };
            unbending.is_some()
        });
        path.extend(unbending.into_iter().flatten());
        path
    }

    /// Returns postures on the way from a posture to a straight one, all bends by the same share at once, if that way is
    /// free.
    fn unbending_path(&self, from: &ChainPosture<D>) -> Option<Vec<ChainPosture<D>>> {
        let shares = (0..UNBEND_STEPS).rev().map(|step| step as f64 / UNBEND_STEPS as f64);
        let mut path: Vec<ChainPosture<D>> = Vec::new();
        for share in shares {
            let next = self.unbend_posture(from, share);
            if !self.is_path_free(path.last().unwrap_or(from), &next) {
                return None;
            }
            path.push(next);
        }
        Some(path)
    }

    /// Returns postures after one simple posture up to another, turning, if that way is free: straight, or to one side
    /// first.
    fn turning_path(
        &self,
        from: &ChainPosture<D>,
        to: &ChainPosture<D>,
    ) -> Option<Vec<ChainPosture<D>>> {
        if self.is_path_free(from, to) {
            return Some(vec![to.clone()]);
        }
        let vias = self.simple_postures(from);
        let is_way = |via: &ChainPosture<D>| {
            self.is_free(via) && self.is_path_free(from, via) && self.is_path_free(via, to)
        };
        vias.into_iter().find(is_way).map(|via| vec![via, to.clone()])
    }

    /// Returns simple postures beside another one: straight ones across it, or pairs of arcs between two fixed ends.
    pub(super) fn simple_postures(&self, beside: &ChainPosture<D>) -> Vec<ChainPosture<D>> {
        let root_at = beside[self.root()];
        if let Some(end) = self.far_end() {
            let middle = scaled(add(root_at, beside[end]), 0.5);
            let mut postures = self.two_arc_postures(middle, end);
            postures.extend(self.two_arc_postures(beside[self.initiator()], end));
            return postures;
        }
        let across = perpendicular(self.lead_direction(beside));
        [across, scaled(across, -1.0)].map(|u| self.straight_posture(root_at, u)).to_vec()
    }

    /// Returns a posture with only a share of each of its bends, about the same root and first rods.
    fn unbend_posture(&self, from: &ChainPosture<D>, share: f64) -> ChainPosture<D> {
        let mut posture = from.clone();
        for limb in self.limbs() {
            let direction =
                |pair: &[usize]| normalized(sub(from[pair[1]], from[pair[0]])).unwrap_or(unit_x());
            // What the bends so far have turned the rest of the limb by, as the images of the axes.
            let mut turned: [Point<D>; D] =
                std::array::from_fn(|axis| std::array::from_fn(|i| f64::from(u8::from(i == axis))));
            let mut before: Option<Point<D>> = None;
            for pair in limb.windows(2) {
                let was = direction(pair);
                let kept = before.map_or(was, |before| part_of_turn(before, was, share));
                let u = normalized(image(&turned, kept)).unwrap_or(unit_x());
                let was_turned = image(&turned, was);
                turned = turned.map(|axis| rotated(axis, was_turned, u));
                before = Some(was);
                let length_m = distance(from[pair[0]], from[pair[1]]);
                posture[pair[1]] = add_scaled(posture[pair[0]], u, length_m);
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
