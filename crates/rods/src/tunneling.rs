//! Continuous collision detection between two states of a chain and of its surroundings: tunneling
//! through obstacles.
//!
//! A request guarantees that in every sub-step both ends of a rod go straight from their old to
//! their new place while obstacles stand still, and that no rod and no connector passes through the
//! core of an obstacle or of the chain's own parts. So nothing tunnels through static obstacles,
//! however thin.
//!
//! Moving obstacles move between requests, when a world advances them. One that is fast and thin
//! may jump over a rod and touch it neither before nor after: a ball only if it moves at once by
//! more than twice its radius and the rod's together. A caller that advances obstacles that fast calls
//! [`find_tunneling`], which checks the motion relative to each of them.

use super::chain::Chain;
use super::geometry::{Aabb, Point, add, norm, scaled};
use super::obstacle::Obstacles;
use super::sweep::RodSweep;

/// A rod that passed through an obstacle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TunneledRod {
    /// Index of the rod, that at connector 0 being 0.
    pub rod: usize,
    /// The obstacle's id.
    pub obstacle: u32,
}

/// Returns the first rod that passed through an obstacle, while the chain went straight from
/// `before` to its present place, and every moving obstacle along its velocity for `dt_s` seconds
/// to its present place. Of several obstacles it reports the one with the lowest id.
///
/// `before` has one point for every connector.
pub fn find_tunneling<const D: usize>(
    chain: &Chain<D>,
    before: &[Point<D>],
    obstacles: &Obstacles<D>,
    dt_s: f64,
) -> Option<TunneledRod> {
    let speeds_m_s = obstacles.moving().iter().map(|o| norm(o.velocity_m_s));
    let furthest_m = dt_s * speeds_m_s.fold(0.0, f64::max);
    let after = chain.points();
    (0..chain.rods().len().min(before.len().saturating_sub(1))).find_map(|rod| {
        let from = [before[rod], before[rod + 1]];
        let to = [after[rod], after[rod + 1]];
        let radius_m = chain.rods()[rod].radius_m;
        let near =
            Aabb::from_points(&[from[0], from[1], to[0], to[1]]).grown(radius_m + furthest_m);
        let mut hit: Option<u32> = None;
        obstacles.visit(&near, |o| {
            // In the frame of a moving obstacle, the rod started elsewhere.
            let by = scaled(o.velocity_m_s, dt_s);
            let sweep = RodSweep { from: from.map(|p| add(p, by)), to };
            let is_first = hit.is_none_or(|id| o.id < id);
            if is_first && !sweep.is_clear(&o.core, o.radius_m + radius_m) {
                hit = Some(o.id);
            }
        });
        hit.map(|obstacle| TunneledRod { rod, obstacle })
    })
}

/// Error of a gap by rounding, meters.
const ROUNDING_M: f64 = 1e-12;

/// Returns the obstacle that a capsule would pass through, or penetrate deeper than before, when both its
/// ends move straight from one place to another; of several the one with the lowest id. A ball is a
/// capsule of no length.
pub fn blocking_obstacle<const D: usize>(
    RodSweep { from, to }: RodSweep<D>,
    radius_m: f64,
    obstacles: &Obstacles<D>,
) -> Option<u32> {
    let is_ball = from[0] == from[1] && to[0] == to[1];
    let near = Aabb::from_points(&[from[0], from[1], to[0], to[1]]).grown(radius_m);
    let mut hit: Option<u32> = None;
    obstacles.visit(&near, |o| {
        let keep_m = o.radius_m + radius_m;
        let gap_before_m = o.core.nearest_to_segment(from).distance_m - keep_m;
        // A part that starts inside may get out; only deeper it must not go.
        let least_m = gap_before_m.min(0.0) - ROUNDING_M;
        let is_blocked = if is_ball {
            // The path of a ball is itself a capsule, so one distance is exact.
            o.core.nearest_to_segment([from[0], to[0]]).distance_m - keep_m < least_m
        } else {
            o.core.nearest_to_segment(to).distance_m - keep_m < least_m
                || !RodSweep { from, to }.is_clear(&o.core, keep_m)
        };
        if is_blocked && hit.is_none_or(|id| o.id < id) {
            hit = Some(o.id);
        }
    });
    hit
}

#[cfg(test)]
mod tests {
    use super::super::chain::{Connector, Rod};
    use super::super::geometry::{ConvexCore, distance, lerp};
    use super::super::obstacle::Obstacle;
    use super::*;
    use proptest::prelude::*;

    fn rod_at<const D: usize>(ends: [Point<D>; 2]) -> Chain<D> {
        let rod = Rod::with_fixed_length(distance(ends[0], ends[1]), 0.001);
        Chain::new(ends.to_vec(), vec![Connector::free(0.01); 2], vec![rod]).unwrap()
    }

    #[test]
    fn a_fast_ball_that_jumps_over_a_resting_rod_is_reported() {
        let chain = rod_at([[0.0, 0.0], [1.0, 0.0]]);
        let ball =
            |x: f64| Obstacle { velocity_m_s: [0.0, 10.0], ..Obstacle::ball(7, [x, -0.5], 0.01) };
        for (x, expected) in [(0.5, Some(TunneledRod { rod: 0, obstacle: 7 })), (1.5, None)] {
            let mut obstacles = Obstacles::new(vec![ball(x)], 1.0).unwrap();
            obstacles.advance(0.1);
            assert_eq!(find_tunneling(&chain, chain.points(), &obstacles, 0.1), expected);
        }
    }

    #[test]
    fn a_rod_that_goes_with_a_ball_is_not_passed() {
        let before = [[0.0, 0.0], [1.0, 0.0]];
        let chain = rod_at(before.map(|[x, y]| [x, y + 1.0]));
        let ball = Obstacle { velocity_m_s: [0.0, 10.0], ..Obstacle::ball(7, [0.5, -0.5], 0.01) };
        let mut obstacles = Obstacles::new(vec![ball], 1.0).unwrap();
        obstacles.advance(0.1);
        assert_eq!(find_tunneling(&chain, &before, &obstacles, 0.1), None);
    }

    fn point() -> impl Strategy<Value = Point<2>> {
        prop::array::uniform2(-1.0..1.0f64)
    }

    proptest! {
        #[test]
        fn a_rod_that_crosses_a_moving_point_is_reported(
            before in [point(), point()], after in [point(), point()],
            from in point(), velocity_m_s in point(),
        ) {
            prop_assume!(distance(after[0], after[1]) > 0.1);
            let ball = Obstacle { velocity_m_s, ..Obstacle::ball(1, from, 0.0) };
            let mut obstacles = Obstacles::new(vec![ball], 1.0).unwrap();
            obstacles.advance(1.0);
            let is_reported = find_tunneling(&rod_at(after), &before, &obstacles, 1.0).is_some();
            // Tests many times: a point that crosses comes nearer than any gap between them.
            let apart_m = |k: i32| {
                let time = f64::from(k) / 2000.0;
                let rod = [0, 1].map(|end| lerp(before[end], after[end], time));
                let at = add(from, scaled(velocity_m_s, time));
                ConvexCore::Point(at).nearest_to_segment(rod).distance_m
            };
            let least_m = (0..=2000).map(apart_m).fold(f64::INFINITY, f64::min);
            prop_assert!(least_m < 5e-3 || !is_reported, "{least_m}");
            prop_assert!(least_m > 1e-9 || is_reported, "{least_m}");
        }
    }
}
