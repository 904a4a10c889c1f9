//! Obstacles at random places, from the seed alone.

use super::courses::{MovingObstacle, ObstaclePath};
use super::purposes;
use sidestep_kernel::stream::{Draws, Streams};
use sidestep_kernel::{InputError, Seed};
use sidestep_rods::geometry::{Aabb, ConvexCore, Point, add_scaled, is_finite, normalized};
use sidestep_rods::{Obstacle, Obstacles};
use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// Largest number of obstacles; more are taken as a mistake.
const MAX_OBSTACLES: f64 = 1e7;
/// Attempts to find a place for an obstacle before the search fails: enough where one place in a hundred is free.
const MAX_ATTEMPTS: u64 = 1000;

/// Balls, or capsules in all directions, spread evenly over a box.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RandomObstacleField<const D: usize> {
    /// Region of their middles.
    pub(crate) room: Aabb<D>,
    /// Their total size, as a part of the room's. They may overlap, and those that would come too
    /// near to `keep_clear` are left out, so they cover less.
    pub(crate) part: f64,
    /// Radius of each, meters.
    pub(crate) radius_m: f64,
    /// Length of a capsule's core, meters; 0 for balls.
    pub(crate) length_m: f64,
    /// Bodies that they keep away from: the places where chains start.
    pub(crate) keep_clear: Vec<ConvexCore<D>>,
    /// Distance that their surfaces keep from these, meters.
    pub(crate) keep_m: f64,
}

impl<const D: usize> RandomObstacleField<D> {
    /// Returns the obstacles, numbered from `first_id`; gaps in the numbers are those left out.
    ///
    /// # Errors
    /// When a room, part or size is not finite or not positive, or there are over ten million
    /// obstacles.
    pub(crate) fn generate_obstacles(
        &self,
        seed: Seed,
        first_id: u32,
    ) -> Result<Vec<Obstacle<D>>, InputError> {
        let n = self.obstacle_count()?;
        let streams = Streams::new(seed);
        let clear = KeepClearIndex::new(&self.keep_clear, self.keep_m, self.length_m)?;
        let mut obstacles = Vec::new();
        for k in 0..n {
            let ends = self.random_core_ends(&mut streams.draws(k, 0, purposes::STILL));
            if clear.is_clear(ends, self.radius_m) {
                let core = if ends[0] == ends[1] {
                    ConvexCore::Point(ends[0])
                } else {
                    ConvexCore::Segment(ends)
                };
                obstacles.push(Obstacle::new_static(first_id + k, core, self.radius_m));
            }
        }
        Ok(obstacles)
    }

    /// Returns the ends of a core somewhere in the room.
    fn random_core_ends(&self, draws: &mut Draws) -> [Point<D>; 2] {
        let middle = random_point(draws, &self.room);
        let u = random_direction(draws);
        [-0.5, 0.5].map(|k| add_scaled(middle, u, k * self.length_m))
    }

    fn obstacle_count(&self) -> Result<u32, InputError> {
        let extent_m: Point<D> = std::array::from_fn(|i| self.room.hi[i] - self.room.lo[i]);
        let n = self.part * extent_m.iter().product::<f64>() / self.obstacle_size();
        let is_room = extent_m.iter().all(|m| *m > 0.0) && is_finite(&self.room.lo);
        let is_body = self.radius_m > 0.0 && self.length_m >= 0.0 && self.part >= 0.0;
        if is_room && is_body && self.keep_m.is_finite() && n <= MAX_OBSTACLES {
            return Ok(n as u32);
        }
        Err(InputError::new(
            "field",
            format!(
                "{n} obstacles of radius {} m and length {} m for {} of its room",
                self.radius_m, self.length_m, self.part
            ),
            "give a room, a fill_fraction from 0 on and a positive radius that make at most 1e7 obstacles",
        ))
    }

    /// Returns the area or volume of one obstacle.
    fn obstacle_size(&self) -> f64 {
        let r = self.radius_m;
        match D {
            2 => PI * r * r + 2.0 * r * self.length_m,
            _ => 4.0 / 3.0 * PI * r * r * r + PI * r * r * self.length_m,
        }
    }
}

/// Balls that go straight on, and are thrown back at the sides of a room.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BouncingBallField<const D: usize> {
    /// The room that they never leave.
    pub(crate) room: Aabb<D>,
    pub(crate) n: u32,
    /// Their radii, evenly spread.
    pub(crate) radius_m: RangeInclusive<f64>,
    /// Their speeds, evenly spread.
    pub(crate) speed_m_s: RangeInclusive<f64>,
    /// Bodies that they keep away from at time 0.
    pub(crate) keep_clear: Vec<ConvexCore<D>>,
    /// Distance that their surfaces keep from these at time 0, meters.
    pub(crate) keep_m: f64,
}

impl<const D: usize> BouncingBallField<D> {
    /// Returns the obstacles, numbered from `first_id`.
    ///
    /// # Errors
    /// When a room is too small for them, or has no place away from `keep_clear`; when sizes or
    /// speeds are not finite and positive.
    pub(crate) fn generate(
        &self,
        seed: Seed,
        first_id: u32,
    ) -> Result<Vec<MovingObstacle<D>>, InputError> {
        if f64::from(self.n) > MAX_OBSTACLES {
            let cause = format!("{} moving obstacles", self.n);
            return Err(InputError::new("crowd", cause, "give at most 1e7"));
        }
        let streams = Streams::new(seed);
        let clear = KeepClearIndex::new(&self.keep_clear, self.keep_m, *self.radius_m.end())?;
        (0..self.n).map(|k| self.place_one(&streams, &clear, k, first_id + k)).collect()
    }

    fn place_one(
        &self,
        streams: &Streams,
        clear: &KeepClearIndex<D>,
        k: u32,
        id: u32,
    ) -> Result<MovingObstacle<D>, InputError> {
        for attempt in 0..MAX_ATTEMPTS {
            let mut draws = streams.draws(k, attempt, purposes::MOVING);
            let radius_m = uniform(&mut draws, &self.radius_m);
            let speed_m_s = uniform(&mut draws, &self.speed_m_s);
            let velocity_m_s = random_direction::<D>(&mut draws).map(|u| u * speed_m_s);
            let places = self.room.grown(-radius_m);
            if !(radius_m > 0.0 && (0..D).all(|i| places.lo[i] <= places.hi[i])) {
                let cause = format!("a ball of radius {radius_m} m does not fit into the room");
                return Err(InputError::new("crowd", cause, "make the room larger"));
            }
            let at = random_point(&mut draws, &places);
            if clear.is_clear([at; 2], radius_m) {
                let ball = Obstacle::ball(id, at, radius_m);
                return MovingObstacle::new(
                    ball,
                    ObstaclePath::Bouncing { velocity_m_s, room: self.room },
                );
            }
        }
        Err(InputError::new(
            "crowd",
            format!("found no place for moving obstacle {id} in {MAX_ATTEMPTS} attempts"),
            "make the room larger, or keep less of it clear",
        ))
    }
}

/// Bodies that are kept clear, by place.
struct KeepClearIndex<const D: usize> {
    bodies: Obstacles<D>,
    keep_m: f64,
}

/// Room around a query, meters, so that no rounding leaves out a body exactly as far away as allowed.
const ROUNDING_M: f64 = 1e-6;

impl<const D: usize> KeepClearIndex<D> {
    /// Returns bodies from which obstacles of about `size_m` keep a distance.
    fn new(bodies: &[ConvexCore<D>], keep_m: f64, size_m: f64) -> Result<Self, InputError> {
        let bodies =
            (0..).zip(bodies).map(|(k, core)| Obstacle::new_static(k, *core, 0.0)).collect();
        // Determines the cells of a grid, never the result, so that any length will do where none is given. No cell is
        // smaller than 1 mm, or points would make cells of no size.
        let reach_m = size_m + 2.0 * keep_m;
        let reach_m = if reach_m.is_finite() { reach_m.max(1e-3) } else { 1.0 };
        Ok(Self { bodies: Obstacles::new(bodies, reach_m)?, keep_m })
    }

    /// Returns whether a capsule between `ends` stays away from all of them.
    fn is_clear(&self, ends: [Point<D>; 2], radius_m: f64) -> bool {
        let reach_m = radius_m + self.keep_m;
        let mut is_away = reach_m.is_finite();
        self.bodies.visit(&Aabb::from_points(&ends).grown(reach_m + ROUNDING_M), |body| {
            is_away &= body.core.nearest_to_segment(ends).distance_m > reach_m;
        });
        is_away
    }
}

fn uniform(draws: &mut Draws, range: &RangeInclusive<f64>) -> f64 {
    range.start() + (range.end() - range.start()) * draws.uniform()
}

fn random_point<const D: usize>(draws: &mut Draws, room: &Aabb<D>) -> Point<D> {
    std::array::from_fn(|i| uniform(draws, &(room.lo[i]..=room.hi[i])))
}

/// Returns a unit vector, all directions equally likely: a point in the unit ball, scaled. A point near the center,
/// whose direction is the least precise, is drawn anew.
fn random_direction<const D: usize>(draws: &mut Draws) -> Point<D> {
    loop {
        let p: Point<D> = std::array::from_fn(|_| 2.0 * draws.uniform() - 1.0);
        let squared: f64 = p.iter().map(|x| x * x).sum();
        if let Some(u) = normalized(p).filter(|_| (0.01..=1.0).contains(&squared)) {
            return u;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_rods::geometry::norm;

    fn field<const D: usize>(part: f64, length_m: f64) -> RandomObstacleField<D> {
        let mut tail = [0.0; D];
        tail[0] = -3.0;
        RandomObstacleField {
            room: Aabb { lo: [-4.0; D], hi: [4.0; D] },
            part,
            radius_m: 0.3,
            length_m,
            keep_clear: vec![ConvexCore::Segment([[0.0; D], tail])],
            keep_m: 0.2,
        }
    }

    fn check<const D: usize>(length_m: f64) {
        let field = field::<D>(0.2, length_m);
        let found = field.generate_obstacles(Seed(3), 5).unwrap();
        assert!(found.len() > 10 && found.len() < field.obstacle_count().unwrap() as usize);
        for o in &found {
            let ends = match o.core {
                ConvexCore::Point(c) => [c; 2],
                ConvexCore::Segment(ends) => ends,
                other => panic!("{other:?}"),
            };
            assert!(
                (norm(std::array::from_fn::<_, D, _>(|i| ends[1][i] - ends[0][i])) - length_m)
                    .abs()
                    < 1e-12
            );
            assert!(field.keep_clear[0].nearest_to_segment(ends).distance_m > 0.5);
        }
        assert_eq!(found, field.generate_obstacles(Seed(3), 5).unwrap());
        assert_ne!(found, field.generate_obstacles(Seed(4), 5).unwrap());
    }

    #[test]
    fn fields_keep_away_from_what_is_kept_clear() {
        check::<2>(0.0);
        check::<2>(0.7);
        check::<3>(0.0);
        check::<3>(0.7);
    }

    #[test]
    fn a_field_has_the_size_it_is_asked_for() {
        let field = RandomObstacleField { keep_clear: Vec::new(), ..field::<3>(0.3, 0.5) };
        let one = 4.0 / 3.0 * PI * 0.027 + PI * 0.09 * 0.5;
        let size = field.generate_obstacles(Seed(1), 0).unwrap().len() as f64 * one;
        assert!((size / 512.0 - 0.3).abs() < 0.001, "{size}");
    }

    #[test]
    fn a_crowd_stays_in_its_room_with_the_sizes_and_speeds_it_is_given() {
        let crowd = BouncingBallField {
            room: Aabb { lo: [-3.0, -2.0], hi: [3.0, 2.0] },
            n: 40,
            radius_m: 0.2..=0.5,
            speed_m_s: 0.25..=2.0,
            keep_clear: vec![ConvexCore::Point([0.0; 2])],
            keep_m: 0.5,
        };
        for mover in crowd.generate(Seed(9), 100).unwrap() {
            let start = mover.at(0.0);
            assert!(start.id >= 100 && (0.2..=0.5).contains(&start.radius_m));
            assert!(start.core.nearest_to_point([0.0; 2]).distance_m > start.radius_m + 0.5);
            for t_s in [0.0, 7.3, 1e4] {
                let now = mover.at(t_s);
                let (speed_m_s, at) = (norm(now.velocity_m_s), now.bounds());
                assert!((0.25 - 1e-12..=2.0 + 1e-12).contains(&speed_m_s));
                assert!((0..2).all(|i| at.lo[i] > crowd.room.lo[i] - 1e-9));
                assert!((0..2).all(|i| at.hi[i] < crowd.room.hi[i] + 1e-9));
            }
        }
        let cramped = BouncingBallField { keep_m: 9.0, ..crowd.clone() };
        assert!(cramped.generate(Seed(9), 0).is_err());
        let too_large = BouncingBallField { radius_m: 2.5..=3.0, ..crowd };
        assert!(too_large.generate(Seed(9), 0).is_err());
    }

    #[test]
    fn impossible_fields_are_refused() {
        for wrong in [
            RandomObstacleField { part: f64::NAN, ..field::<2>(0.1, 0.0) },
            RandomObstacleField { part: -1.0, ..field(0.1, 0.0) },
            RandomObstacleField { radius_m: 0.0, ..field(0.1, 0.0) },
            RandomObstacleField { radius_m: 1e-9, ..field(0.1, 0.0) },
            RandomObstacleField { length_m: -1.0, ..field(0.1, 0.0) },
            RandomObstacleField { room: Aabb { lo: [1.0; 2], hi: [0.0; 2] }, ..field(0.1, 0.0) },
        ] {
            assert!(wrong.generate_obstacles(Seed(1), 0).is_err(), "{wrong:?}");
        }
    }
}
