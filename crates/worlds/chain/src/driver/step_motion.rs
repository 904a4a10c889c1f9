//! The motion of a connector or a rod within one cycle.

use sidestep_kernel::math::{cos, sin};
use sidestep_rods::geometry::{
    Point, add, add_scaled, angle_between_rad, distance, lerp, move_toward, norm, normalized,
    perpendicular, perpendicular_component, scaled, sub, unit_x,
};
use sidestep_rods::{Chain, RequestedMotion};

/// One request of a cycle: the moving part, its start and its destination.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StepMotion<const D: usize> {
    /// The connector, or the first of a rod's two.
    pub(crate) first: usize,
    is_rod: bool,
    /// Their positions; a connector stands for both.
    from: [Point<D>; 2],
    /// Their positions at the end of the cycle, as wanted.
    pub(crate) to: [Point<D>; 2],
}

impl<const D: usize> StepMotion<D> {
    /// Returns the part of a motion that takes one cycle: nothing goes farther than `step_m`.
    pub(crate) fn new(chain: &Chain<D>, motion: &RequestedMotion<D>, step_m: f64) -> Self {
        let points = chain.points();
        match *motion {
            RequestedMotion::Connector { k, to } => {
                let to = move_toward(points[k], to, step_m);
                Self { first: k, is_rod: false, from: [points[k]; 2], to: [to; 2] }
            }
            RequestedMotion::Rod { i, to } => {
                let from = [points[i], points[i + 1]];
                let travel_m = max_travel_m(from, to);
                let part = if travel_m <= step_m { 1.0 } else { step_m / travel_m };
                Self { first: i, is_rod: true, from, to: interpolate(from, to, part) }
            }
        }
    }

    /// Returns a fraction of the motion; all of it ends at the target bit for bit.
    pub(crate) fn partial_motion(&self, part: f64) -> RequestedMotion<D> {
        let Self { first, from, to, .. } = *self;
        if self.is_rod {
            return RequestedMotion::Rod { i: first, to: interpolate(from, to, part) };
        }
        let to = if part >= 1.0 { to[0] } else { lerp(from[0], to[0], part) };
        RequestedMotion::Connector { k: first, to }
    }

    /// Returns the distance that both ends together travel, meters.
    pub(crate) fn length_m(&self) -> f64 {
        distance(self.from[0], self.to[0]) + distance(self.from[1], self.to[1])
    }

    /// Returns the fraction of the motion that a chain has made, from 0 to 1.
    pub(crate) fn done_fraction(&self, chain: &Chain<D>) -> f64 {
        let points = chain.points();
        let second = self.first + usize::from(self.is_rod);
        let left_m =
            distance(points[self.first], self.to[0]) + distance(points[second], self.to[1]);
        let length_m = self.length_m();
        if length_m > 0.0 { (1.0 - left_m / length_m).clamp(0.0, 1.0) } else { 1.0 }
    }
}

/// Returns a bound on the distance that either end of a rod travels from two positions to two others: its
/// middle moves straight, it turns evenly about it, and its length changes evenly.
fn max_travel_m<const D: usize>(from: [Point<D>; 2], to: [Point<D>; 2]) -> f64 {
    let was = sub(from[1], from[0]);
    let will = sub(to[1], to[0]);
    let was_m = norm(was);
    let will_m = norm(will);
    distance(middle(from), middle(to))
        + 0.5 * (was_m.max(will_m) * angle_between_rad(was, will) + (will_m - was_m).abs())
}

/// Returns the ends of a rod after a fraction of that motion. In between it is never shorter or longer than at both
/// ends of the motion, as it would be if its ends moved straight.
fn interpolate<const D: usize>(from: [Point<D>; 2], to: [Point<D>; 2], part: f64) -> [Point<D>; 2] {
    if part >= 1.0 {
        return to;
    }
    let was = sub(from[1], from[0]);
    let will = sub(to[1], to[0]);
    let u = normalized(was).or(normalized(will)).unwrap_or(unit_x());
    let aside = normalized(perpendicular_component(will, u)).unwrap_or(perpendicular(u));
    let turn_rad = part * angle_between_rad(was, will);
    let direction = add_scaled(scaled(u, cos(turn_rad)), aside, sin(turn_rad));
    let half = scaled(direction, 0.5 * (norm(was) + part * (norm(will) - norm(was))));
    let at = lerp(middle(from), middle(to), part);
    [sub(at, half), add(at, half)]
}

fn middle<const D: usize>([a, b]: [Point<D>; 2]) -> Point<D> {
    lerp(a, b, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_rods::{Connector, Rod};

    /// Goes on errands of at most `step_m` until the rod is there; returns how many that took.
    fn carried<const D: usize>(start: [Point<D>; 2], to: [Point<D>; 2], step_m: f64) -> usize {
        let rod = Rod::with_fixed_length(distance(start[0], start[1]), 0.01);
        let mut chain =
            Chain::new(start.to_vec(), vec![Connector::free(0.02); 2], vec![rod]).expect("a chain");
        for n in 0..1000 {
            let errand = StepMotion::new(&chain, &RequestedMotion::Rod { i: 0, to }, step_m);
            if errand.length_m() == 0.0 {
                return n;
            }
            let points = chain.points_mut();
            for (at, next) in points.iter_mut().zip(errand.to) {
                assert!(distance(*at, next) <= step_m * (1.0 + 1e-12));
                *at = next;
            }
            assert!(chain.max_rod_violation_m() < 1e-12);
        }
        panic!("it never gets there")
    }

    #[test]
    fn a_rod_gets_anywhere_at_its_length_and_no_end_is_faster_than_it_may_be() {
        let start = [[0.0, 0.0], [1.0, 0.0]];
        assert_eq!(carried(start, [[0.004, 0.0], [1.004, 0.0]], 0.01), 1);
        assert_eq!(carried(start, [[1.0, 0.0], [2.0, 0.0]], 0.01), 100);
        // Half a turn about its middle: each end goes pi / 2.
        assert!((157..=159).contains(&carried(start, [[1.0, 0.0], [0.0, 0.0]], 0.01)));
        let to = [[0.3, 0.1, -0.4], [0.3, 1.1, -0.4]];
        carried([[0.0; 3], [0.0, 0.0, 1.0]], to, 0.02);
    }

    #[test]
    fn the_share_that_is_done_is_that_of_both_ends() {
        let rod = Rod { min_m: 0.5, max_m: 1.5, radius_m: 0.01 };
        let points = vec![[0.0, 0.0], [1.0, 0.0]];
        let mut chain = Chain::new(points, vec![Connector::free(0.02); 2], vec![rod]).unwrap();
        let to = [[0.0, 0.1], [1.0, 0.1]];
        let errand = StepMotion::new(&chain, &RequestedMotion::Rod { i: 0, to }, 1.0);
        assert_eq!(errand.done_fraction(&chain), 0.0);
        chain.points_mut()[0] = to[0];
        assert!((errand.done_fraction(&chain) - 0.5).abs() < 1e-12);
        chain.points_mut()[1] = to[1];
        assert_eq!(errand.done_fraction(&chain), 1.0);
    }
}
