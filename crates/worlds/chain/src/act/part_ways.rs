//! Ways of scattered parts around the obstacles between them and the places where they are joined again.

use super::ChainContext;
use crate::state::{ChainBodyState, flatten, unflatten};
use sidestep_arms::plan::{ConfigurationSpace, plan_path};
use sidestep_kernel::stream::Draws;
use sidestep_rods::geometry::{Point, distance, lerp};
use sidestep_rods::{Obstacles, RodSweep, TOLERANCE_M, blocking_obstacle};

/// Least ratio of the room in which a way is searched to the radius of the part: a part that lies beside its goal, but
/// behind a wall, may have to go far.
const MIN_SPREAD_RADII: f64 = 20.0;
/// Sizes of the room in which a way is searched, each twice the one before: a wall may be 64 times as long as the straight
/// way.
const ROOM_SIZES: u32 = 7;

/// Random places that searches for ways try, those of all parts of a chain together and those of one part: all ways are
/// planned in one cycle.
const MAX_CHAIN_SAMPLES: usize = 40_000;
const MAX_PART_SAMPLES: usize = 2_000;

/// Plans the ways of all scattered connectors, and of the stubs beside them, whose straight way to their goals is blocked by
/// one of these obstacles. Where no way is found the part keeps to the straight one, and waits where it is blocked.
pub(super) fn plan_part_ways<const D: usize>(
    body: &mut ChainBodyState<D>,
    obstacles: &Obstacles<D>,
    draws: &mut Draws,
) {
    let Some(scattered) = &mut body.scattered else { return };
    let goals: Vec<Point<D>> = unflatten(&scattered.goals_m);
    let chain = &body.chain;
    let mut ways = Vec::with_capacity(scattered.way_count());
    let max_samples = MAX_PART_SAMPLES.min(MAX_CHAIN_SAMPLES / scattered.way_count());
    let with_ways = scattered.first as usize - 1..=scattered.last as usize + 1;
    for k in with_ways {
        let space = PartSpace {
            obstacles,
            radius_m: chain.connectors()[k].radius_m,
            from: chain.points()[k],
            goal: goals[k],
            max_samples,
        };
        let mut way = space.way_points(draws).unwrap_or_default();
        // The goal itself is where the parts go anyway.
        way.pop();
        ways.push(flatten(&way));
    }
    // A chain whose parts all go straight has nothing to keep.
    if ways.iter().all(Vec::is_empty) {
        ways.clear();
    }
    scattered.way_points_m = ways;
}

/// Draws for the places of a chain's parts and their ways in this cycle.
pub(super) fn gather_draws<const D: usize>(context: ChainContext<'_, D>) -> Draws {
    context.random_draws(crate::world::purpose::GATHER)
}

/// The places that the middle of a part may take.
struct PartSpace<'a, const D: usize> {
    obstacles: &'a Obstacles<D>,
    radius_m: f64,
    from: Point<D>,
    goal: Point<D>,
    max_samples: usize,
}

impl<const D: usize> PartSpace<'_, D> {
    /// Returns the way points after the present place, the goal at the end; none if there is no way, or no need of one.
    fn way_points(&self, draws: &mut Draws) -> Option<Vec<Point<D>>> {
        let is_blocked = !self.is_path_free(&self.from, &self.goal);
        // A goal inside of an obstacle has no way to it: a search would only take time.
        if is_blocked && self.is_free(&self.goal) {
            return plan_path(self, self.goal, draws);
        }
        None
    }
}

impl<const D: usize> ConfigurationSpace for PartSpace<'_, D> {
    type Posture = Point<D>;

    fn max_samples(&self) -> usize {
        self.max_samples
    }

    fn present_posture(&self) -> Point<D> {
        self.from
    }

    fn length_m(&self) -> f64 {
        distance(self.from, self.goal).max(MIN_SPREAD_RADII * self.radius_m)
    }

    fn distance_m(&self, a: &Point<D>, b: &Point<D>) -> f64 {
        distance(*a, *b)
    }

    fn squared_distance(&self, a: &Point<D>, b: &Point<D>) -> f64 {
        let d = distance(*a, *b);
        d * d
    }

    fn interpolate(&self, a: &Point<D>, b: &Point<D>, fraction: f64) -> Point<D> {
        // Strides that reach beyond the other posture end at it.
        lerp(*a, *b, fraction.min(1.0))
    }

    fn is_free(&self, at: &Point<D>) -> bool {
        // A part that only touches an obstacle is not in it.
        self.obstacles.first_overlapping_id([*at; 2], self.radius_m - TOLERANCE_M).is_none()
    }

    fn is_path_free(&self, a: &Point<D>, b: &Point<D>) -> bool {
        let sweep = RodSweep { from: [*a; 2], to: [*b; 2] };
        blocking_obstacle(sweep, self.radius_m, self.obstacles).is_none()
    }

    fn sample(&self, draws: &mut Draws) -> Point<D> {
        let scale = f64::from(1_u32 << draws.uniform_below(ROOM_SIZES));
        let spread_m = 0.5 * scale * self.length_m();
        let middle = lerp(self.from, self.goal, draws.uniform());
        middle.map(|x| x + spread_m * (2.0 * draws.uniform() - 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_rods::Obstacle;

    #[test]
    fn a_stride_that_reaches_beyond_a_posture_ends_at_it() {
        let ball = Obstacles::new(vec![Obstacle::ball(0, [1.0, 0.0], 0.5)], 1.0).expect("a ball");
        let space = PartSpace {
            obstacles: &ball,
            radius_m: 0.05,
            from: [0.0; 2],
            goal: [2.0, 0.0],
            max_samples: 1,
        };
        assert_eq!(space.interpolate(&[0.0; 2], &[0.3, 0.1], 1.7), [0.3, 0.1]);
        assert_eq!(space.interpolate(&[0.0; 2], &[0.3, 0.1], 0.5), [0.15, 0.05]);
    }
}
