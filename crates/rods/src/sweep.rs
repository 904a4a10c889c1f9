//! Continuous collision detection of one rod: whether it passes through a solid between two positions
//! that are both clear.
//!
//! Both ends go straight from their old to their new place. In the plane the test is exact: the rod
//! passes a core only where its moving end crosses it, or where an end of the core crosses the rod.
//! In space a rod may go around anything, so only its distance counts: it is never nearer to the core
//! than half of the distance that it must keep at rest. [`find_tunneling`](super::find_tunneling) describes the
//! guarantees of that and their limits.

use super::geometry::{
    ConvexCore, Point, add, add_scaled, are_segments_surely_apart, cross_2d,
    distance_of_segments_m, dot, lerp, norm, scaled, segments_cross, sub,
};

/// A moving rod: master and slave, before and after.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RodSweep<const D: usize> {
    /// The rod before: master, slave.
    pub from: [Point<D>; 2],
    /// The rod after.
    pub to: [Point<D>; 2],
}

/// Fraction of the distance at rest that a rod keeps on its path in space. Any value above 0 rules out
/// tunneling; the whole distance would forbid turns past an obstacle that the rod may touch.
const KEPT_FRACTION: f64 = 0.5;
/// Steps of conservative advancement before a path counts as blocked. They get short only where the rod passes at
/// hardly more than the distance that it keeps; a veto there is safe.
const MAX_ADVANCES: usize = 64;

impl<const D: usize> RodSweep<D> {
    /// Returns the longest distance that any point of the rod moves, meters.
    pub(super) fn max_travel_m(&self) -> f64 {
        // The distance of a point is a convex function of its place on the rod, so the farthest is an end.
        let master = sub(self.to[0], self.from[0]);
        let slave = sub(self.to[1], self.from[1]);
        dot(master, master).max(dot(slave, slave)).sqrt()
    }

    /// Returns whether the rod passes no point of the core on its path; in space, whether it stays half as
    /// far away as `keep_m`, the distance that it must keep at rest.
    pub fn is_clear(&self, core: &ConvexCore<D>, keep_m: f64) -> bool {
        let travel_m = self.max_travel_m();
        core.is_clear_of_segment(self.to, Self::safe_distance_m(travel_m, keep_m))
            || self.is_path_clear(core, keep_m, travel_m)
    }

    /// Returns the distance at the end of a move, in meters, from which on a rod whose points move
    /// at most `travel_m` is surely clear of a core: no point was nearer than its end distance less
    /// its travel.
    pub(super) fn safe_distance_m(travel_m: f64, keep_m: f64) -> f64 {
        travel_m + Self::kept_m(keep_m) + TOUCH_M
    }

    fn kept_m(keep_m: f64) -> f64 {
        if D == 2 { 0.0 } else { KEPT_FRACTION * keep_m }
    }

    /// Returns whether the path is clear, without a check of its end.
    pub(super) fn is_path_clear(&self, core: &ConvexCore<D>, keep_m: f64, travel_m: f64) -> bool {
        match core {
            ConvexCore::Point(c) if D == 2 => !self.is_crossed_by(*c),
            ConvexCore::Segment([a, b]) if D == 2 => {
                !self.crosses([*a, *b]) && !self.is_crossed_by(*a) && !self.is_crossed_by(*b)
            }
            ConvexCore::Cuboid(cuboid) if D == 2 => {
                cuboid.edges_2d().iter().all(|e| !self.crosses(*e) && !self.is_crossed_by(e[0]))
            }
            _ => self.stays_away(core, Self::kept_m(keep_m), travel_m),
        }
    }

    fn crosses(&self, wall: [Point<D>; 2]) -> bool {
        segments_cross([self.from[1], self.to[1]], wall)
    }

    /// Returns whether a plane point lies on the rod at some time, by the roots of a parabola.
    fn is_crossed_by(&self, p: Point<D>) -> bool {
        // At time t the master is at m + t dm and the rod is r + t dr; p is on its line where their
        // cross product is zero.
        let m = sub(self.from[0], p);
        let r = sub(self.from[1], self.from[0]);
        let dm = sub(self.to[0], self.from[0]);
        let dr = sub(sub(self.to[1], self.to[0]), r);
        let a = cross_2d(dr, dm);
        let b = cross_2d(r, dm) + cross_2d(dr, m);
        let c = cross_2d(r, m);
        roots(a, b, c).into_iter().flatten().any(|time| {
            (0.0..=1.0).contains(&time) && {
                let rod = add_scaled(r, dr, time);
                let to_p = sub([0.0; D], add_scaled(m, dm, time));
                (0.0..=dot(rod, rod)).contains(&dot(to_p, rod))
            }
        })
    }

    /// Conservative advancement: each step is as long as the clearance allows at the highest speed of
    /// any point, so nothing is skipped however the ends move.
    fn stays_away(&self, core: &ConvexCore<D>, kept_m: f64, travel_m: f64) -> bool {
        let mut time = 0.0;
        for _ in 0..MAX_ADVANCES {
            let rod = [0, 1].map(|end| lerp(self.from[end], self.to[end], time));
            let clearance_m = core.nearest_to_segment(rod).distance_m - kept_m;
            if clearance_m <= 0.0 {
                return false;
            }
            time += clearance_m.max(TOUCH_M) / travel_m;
            if time >= 1.0 {
                return true;
            }
        }
        false
    }
}

/// Distance below which bodies touch, meters.
const TOUCH_M: f64 = 1e-12;

/// Two parts of a chain that move at once; a connector is a rod without length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RodPairSweep<const D: usize> {
    pub(super) one: RodSweep<D>,
    pub(super) other: RodSweep<D>,
}

impl<const D: usize> RodPairSweep<D> {
    /// Returns whether the parts never come nearer to each other on their way than half of the distance that they keep
    /// at rest, or half of that from which they start. So they never pass through each other, and parts that start
    /// too near can get apart; only where their core lines cross at the start, every way is allowed.
    pub(super) fn is_clear(&self, separation_m: f64) -> bool {
        let travel_m = self.max_approach_m();
        // The usual case: what is asked for below of the sum of both distances, each of them has a half of. The distance
        // kept is this one, or less.
        let enough_m = KEPT_FRACTION * separation_m + TOUCH_M + 0.5 * travel_m;
        if are_segments_surely_apart(self.one.from, self.other.from, enough_m)
            && are_segments_surely_apart(self.one.to, self.other.to, enough_m)
        {
            return true;
        }
        let start_m = self.distance_m(0.0);
        if start_m < TOUCH_M {
            return true;
        }
        let kept_m = KEPT_FRACTION * separation_m.min(start_m);
        let end_m = self.distance_m(1.0);
        // The two come nearer by their travel at most, from the start on and backward from the end.
        if start_m + end_m - travel_m >= 2.0 * (kept_m + TOUCH_M) {
            return true;
        }
        let mut time = 0.0;
        let mut clearance_m = start_m - kept_m;
        for _ in 0..MAX_ADVANCES {
            time += clearance_m.max(TOUCH_M) / travel_m;
            if time >= 1.0 {
                return end_m >= kept_m;
            }
            clearance_m = self.distance_m(time) - kept_m;
            if clearance_m <= 0.0 {
                return false;
            }
        }
        false
    }

    fn distance_m(&self, time: f64) -> f64 {
        let [one, other] = [&self.one, &self.other]
            .map(|sweep| [0, 1].map(|end| lerp(sweep.from[end], sweep.to[end], time)));
        distance_of_segments_m(one, other)
    }

    /// Returns a bound on the distance by which the parts approach each other, meters. What both move alike does not
    /// count: most of the motion of neighbors along a chain.
    fn max_approach_m(&self) -> f64 {
        let moves = [&self.one, &self.other]
            .map(|sweep| [0, 1].map(|end| sub(sweep.to[end], sweep.from[end])));
        let sum = add(add(moves[0][0], moves[0][1]), add(moves[1][0], moves[1][1]));
        let mean = scaled(sum, 0.25);
        let longest_m = |ends: [Point<D>; 2]| {
            ends.map(|by| norm(sub(by, mean))).into_iter().fold(0.0, f64::max)
        };
        longest_m(moves[0]) + longest_m(moves[1])
    }
}

/// Returns the real roots of `a x^2 + b x + c`; none if it is zero everywhere.
#[inline]
fn roots(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    if a == 0.0 {
        return [(b != 0.0).then(|| -c / b), None];
    }
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return [None; 2];
    }
    // This sum has no cancellation; the other root follows from the product of both.
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    [Some(q / a), (q != 0.0).then(|| c / q)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns whether a rod crosses a wall at one of many times between.
    fn sampled(sweep: &RodSweep<2>, wall: [Point<2>; 2]) -> bool {
        (0..=4000).any(|k| {
            let rod = [0, 1].map(|e| lerp(sweep.from[e], sweep.to[e], f64::from(k) / 4000.0));
            segments_cross(rod, wall)
        })
    }

    fn point() -> impl Strategy<Value = Point<2>> {
        prop::array::uniform2(-1.0..1.0f64)
    }

    proptest! {
        #[test]
        fn what_crosses_at_some_time_is_found(
            from in [point(), point()], to in [point(), point()], wall in [point(), point()],
        ) {
            let sweep = RodSweep { from, to };
            // The master's own way was checked when the master was a slave.
            let master_crosses = segments_cross([from[0], to[0]], wall);
            let starts_crossing = segments_cross(from, wall);
            prop_assume!(!master_crosses && !starts_crossing);
            if sampled(&sweep, wall) {
                prop_assert!(!sweep.is_clear(&ConvexCore::Segment(wall), 0.0));
            }
        }

        #[test]
        fn what_is_clear_in_space_stays_away(
            from in [prop::array::uniform3(-1.0..1.0f64), prop::array::uniform3(-1.0..1.0f64)],
            by in [prop::array::uniform3(-0.3..0.3f64), prop::array::uniform3(-0.3..0.3f64)],
            center in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let to = [0, 1].map(|e| super::super::geometry::add(from[e], by[e]));
            let (sweep, core) = (RodSweep { from, to }, ConvexCore::Point(center));
            if sweep.is_clear(&core, 0.2) {
                for k in 0..=100 {
                    let rod = [0, 1].map(|e| lerp(from[e], to[e], f64::from(k) / 100.0));
                    prop_assert!(core.nearest_to_segment(rod).distance_m >= 0.1 - 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_rod_that_turns_over_the_end_of_a_wall_is_caught() {
        let sweep = RodSweep { from: [[0.0, 0.0], [1.0, 0.5]], to: [[0.0, 0.0], [1.0, -0.5]] };
        assert!(!sweep.is_clear(&ConvexCore::Segment([[0.5, 0.0], [0.7, 0.0]]), 0.0));
        assert!(sweep.is_clear(&ConvexCore::Segment([[1.5, 0.0], [1.7, 0.0]]), 0.0));
    }
}
