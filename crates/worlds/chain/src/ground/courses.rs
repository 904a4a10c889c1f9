//! Courses of moving obstacles, as functions of time.
//!
//! Every course is a closed formula of time: nothing keeps a state, any worker computes any
//! obstacle at any moment, and a checkpoint needs only the time.

use sidestep_kernel::InputError;
use sidestep_rods::Obstacle;
use sidestep_rods::geometry::{
    Aabb, Point, distance, is_finite, lerp, norm, normalized, scaled, sub,
};

/// The course of a moving body.
#[derive(Debug, Clone, PartialEq)]
pub enum ObstaclePath<const D: usize> {
    /// Straight on without end.
    Straight {
        /// Its velocity at all times, not zero.
        velocity_m_s: Point<D>,
    },
    /// Inside a room whose sides throw it back: on each axis a triangle wave.
    Bouncing {
        /// Its velocity at time 0.
        velocity_m_s: Point<D>,
        /// The room that its whole body never leaves.
        room: Aabb<D>,
    },
    /// A tour from way point to way point. The middle of the body is at the first one at time 0.
    Patrol {
        /// Way points, at least two; neighbors lie apart.
        way_points: Vec<Point<D>>,
        /// Whether it goes from the last way point straight to the first, or back the way it came.
        closed: bool,
        /// Its speed along all legs, meters per second.
        speed_m_s: f64,
    },
}

/// A body and its course, which give its place at any time.
#[derive(Debug, Clone, PartialEq)]
pub struct MovingObstacle<const D: usize> {
    /// The body, with its place at time 0 (on a patrol: anywhere).
    body: Obstacle<D>,
    course: ObstaclePath<D>,
    bounds: Aabb<D>,
}

impl<const D: usize> MovingObstacle<D> {
    /// Returns a body on a course.
    ///
    /// # Errors
    /// When numbers are not finite, a course does not move, the body does not fit into its room or
    /// is not in it, or a patrol has fewer than two way points or two equal neighbors.
    pub fn new(body: Obstacle<D>, course: ObstaclePath<D>) -> Result<Self, InputError> {
        let mover = Self { bounds: body.bounds(), body, course };
        match mover.fault() {
            None => Ok(mover),
            Some((cause, remedy)) => {
                Err(InputError::new(format!("moving obstacle {}", mover.body.id), cause, remedy))
            }
        }
    }

    fn fault(&self) -> Option<(&'static str, &'static str)> {
        let still = ("does not move", "give it a speed, or make it a static obstacle");
        match &self.course {
            ObstaclePath::Straight { velocity_m_s } if !is_valid_velocity(velocity_m_s) => {
                Some(still)
            }
            ObstaclePath::Straight { .. } => None,
            ObstaclePath::Bouncing { velocity_m_s, .. } if !is_valid_velocity(velocity_m_s) => {
                Some(still)
            }
            ObstaclePath::Bouncing { room, .. } if !contains_box(room, &self.bounds) => {
                Some(("is not in its room", "put it inside, or make the room larger"))
            }
            ObstaclePath::Bouncing { .. } => None,
            ObstaclePath::Patrol { speed_m_s, .. }
                if !(*speed_m_s > 0.0 && speed_m_s.is_finite()) =>
            {
                Some(still)
            }
            ObstaclePath::Patrol { way_points, .. } => patrol_fault(way_points),
        }
    }

    /// Returns the obstacle at a time, with the velocity that it has from then on.
    pub fn at(&self, t_s: f64) -> Obstacle<D> {
        let (shift_m, velocity_m_s) = self.shift_and_velocity(t_s);
        Obstacle { core: self.body.core.shifted(shift_m), velocity_m_s, ..self.body }
    }

    /// Returns the shift of the body from its given place, and its velocity.
    fn shift_and_velocity(&self, t_s: f64) -> (Point<D>, Point<D>) {
        match &self.course {
            ObstaclePath::Straight { velocity_m_s } => (scaled(*velocity_m_s, t_s), *velocity_m_s),
            ObstaclePath::Bouncing { velocity_m_s, room } => {
                let mut shift_m = [0.0; D];
                let mut velocity_now_m_s = [0.0; D];
                for i in 0..D {
                    let lo_m = room.lo[i] - self.bounds.lo[i];
                    let hi_m = room.hi[i] - self.bounds.hi[i];
                    // A body may stick out by a rounding: then its room ends where it begins.
                    let limits_m = [lo_m.min(0.0), hi_m.max(0.0)];
                    (shift_m[i], velocity_now_m_s[i]) =
                        bounce_position_and_velocity(limits_m, velocity_m_s[i], t_s);
                }
                (shift_m, velocity_now_m_s)
            }
            ObstaclePath::Patrol { way_points, closed, speed_m_s } => {
                let (at, velocity_m_s) =
                    patrol_position_and_velocity(way_points, *closed, *speed_m_s, t_s);
                (sub(at, lerp(self.bounds.lo, self.bounds.hi, 0.5)), velocity_m_s)
            }
        }
    }
}

/// Returns whether a velocity is finite and not zero.
fn is_valid_velocity<const D: usize>(velocity_m_s: &Point<D>) -> bool {
    is_finite(velocity_m_s) && norm(*velocity_m_s) > 0.0
}

/// Returns whether a box holds another, apart from rounding.
fn contains_box<const D: usize>(room: &Aabb<D>, body: &Aabb<D>) -> bool {
    let slack_m = 1e-9;
    is_finite(&room.lo)
        && is_finite(&room.hi)
        && (0..D).all(|i| room.lo[i] - slack_m <= body.lo[i] && body.hi[i] <= room.hi[i] + slack_m)
}

fn patrol_fault<const D: usize>(way_points: &[Point<D>]) -> Option<(&'static str, &'static str)> {
    if way_points.len() < 2 {
        return Some(("has fewer than two way points", "give at least two"));
    }
    if !way_points.iter().all(is_finite) {
        return Some(("has a way point that is not finite", "give finite numbers"));
    }
    // A leg of no length has no direction.
    if way_points.windows(2).any(|w| w[0] == w[1]) {
        return Some(("has two equal consecutive way points", "leave one of them out"));
    }
    None
}

/// Returns the position and the velocity of a point that starts at 0 and is thrown back at `lo_m` (at most 0) and `hi_m`
/// (at least 0).
fn bounce_position_and_velocity([lo_m, hi_m]: [f64; 2], v_m_s: f64, t_s: f64) -> (f64, f64) {
    if v_m_s < 0.0 {
        // Its mirror image goes forward.
        let (x_m, v_m_s) = bounce_position_and_velocity([-hi_m, -lo_m], -v_m_s, t_s);
        return (-x_m, -v_m_s);
    }
    let span_m = hi_m - lo_m;
    if span_m <= 0.0 {
        return (0.0, 0.0);
    }
    let (x_m, forward) = shuttle_position(v_m_s * t_s - lo_m, span_m);
    (lo_m + x_m, if forward { v_m_s } else { -v_m_s })
}

/// Returns the position on a line of `length_m` after a distance of `traveled_m` to and fro on it, and whether the body
/// goes forward from there.
fn shuttle_position(traveled_m: f64, length_m: f64) -> (f64, bool) {
    let m = traveled_m.rem_euclid(2.0 * length_m);
    // The remainder may round up to the modulus itself.
    if m < length_m { (m, true) } else { ((2.0 * length_m - m).max(0.0), false) }
}

/// Returns the place on a patrol, and the velocity.
fn patrol_position_and_velocity<const D: usize>(
    way_points: &[Point<D>],
    closed: bool,
    speed_m_s: f64,
    t_s: f64,
) -> (Point<D>, Point<D>) {
    let first = closed.then_some(&way_points[0]);
    let legs = way_points.iter().zip(way_points[1..].iter().chain(first));
    let length_m: f64 = legs.clone().map(|(a, b)| distance(*a, *b)).sum();
    let (mut left_m, forward) = if closed {
        ((speed_m_s * t_s).rem_euclid(length_m), true)
    } else {
        shuttle_position(speed_m_s * t_s, length_m)
    };
    let mut at = way_points[0];
    let mut u = [0.0; D];
    for (a, b) in legs {
        let leg_m = distance(*a, *b);
        let Some(along) = normalized(sub(*b, *a)) else { continue };
        at = lerp(*a, *b, (left_m / leg_m).min(1.0));
        u = along;
        // At a way point the next leg counts when going forward, the one before when going back.
        if left_m < leg_m || (!forward && left_m <= leg_m) {
            break;
        }
        left_m -= leg_m;
    }
    (at, scaled(u, if forward { speed_m_s } else { -speed_m_s }))
}

/// All moving obstacles of a world, by id.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MovingObstacles<const D: usize>(Vec<MovingObstacle<D>>);

impl<const D: usize> MovingObstacles<D> {
    /// Returns moving obstacles, sorted by their ids.
    ///
    /// # Errors
    /// When two have the same id.
    pub fn new(mut movers: Vec<MovingObstacle<D>>) -> Result<Self, InputError> {
        movers.sort_by_key(|m| m.body.id);
        match movers.windows(2).find(|w| w[0].body.id == w[1].body.id) {
            None => Ok(Self(movers)),
            Some(w) => Err(InputError::new(
                format!("moving obstacle {}", w[0].body.id),
                "is there twice",
                "give each an id of its own",
            )),
        }
    }

    /// Returns their number; their ids may have gaps.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns all of them at a time, by id.
    pub fn at(&self, t_s: f64) -> impl Iterator<Item = Obstacle<D>> {
        self.0.iter().map(move |mover| mover.at(t_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sidestep_rods::geometry::{ConvexCore, add};

    const ROOM: Aabb<2> = Aabb { lo: [-5.0, -3.0], hi: [6.0, 4.0] };

    fn center<const D: usize>(obstacle: &Obstacle<D>) -> Point<D> {
        match obstacle.core {
            ConvexCore::Point(c) => c,
            other => panic!("{other:?} is no ball"),
        }
    }

    fn ball(at: Point<2>) -> Obstacle<2> {
        Obstacle::ball(3, at, 0.5)
    }

    fn course() -> impl Strategy<Value = ObstaclePath<2>> {
        let velocity = || prop::array::uniform2(prop_oneof![-2.0..-0.1f64, 0.1..2.0f64]);
        let points = prop::collection::vec(prop::array::uniform2(-5.0..5.0f64), 2..6);
        prop_oneof![
            velocity().prop_map(|velocity_m_s| ObstaclePath::Straight { velocity_m_s }),
            velocity().prop_map(|velocity_m_s| ObstaclePath::Bouncing { velocity_m_s, room: ROOM }),
            (points, any::<bool>(), 0.1..2.0f64).prop_map(|(way_points, closed, speed_m_s)| {
                ObstaclePath::Patrol { way_points, closed, speed_m_s }
            }),
        ]
    }

    fn speed_m_s(course: &ObstaclePath<2>) -> f64 {
        match course {
            ObstaclePath::Straight { velocity_m_s }
            | ObstaclePath::Bouncing { velocity_m_s, .. } => norm(*velocity_m_s),
            ObstaclePath::Patrol { speed_m_s, .. } => *speed_m_s,
        }
    }

    proptest! {
        #[test]
        fn nobody_leaps_or_exceeds_the_speed(
            course in course(), t_s in 0.0..1e3f64, dt_s in 1e-6..5.0f64,
        ) {
            let limit_m_s = speed_m_s(&course);
            let mover = MovingObstacle::new(ball([0.0; 2]), course).unwrap();
            let (before, after) = (mover.at(t_s), mover.at(t_s + dt_s));
            let way_m = distance(center(&before), center(&after));
            prop_assert!(way_m <= limit_m_s * dt_s + 1e-9);
            prop_assert!((norm(before.velocity_m_s) - limit_m_s).abs() < 1e-9);
            prop_assert!(before.is_moving());
        }

        #[test]
        fn the_velocity_is_the_way_that_follows(course in course(), t_s in 0.0..1e3f64) {
            let mover = MovingObstacle::new(ball([0.0; 2]), course).unwrap();
            let (now, dt_s) = (mover.at(t_s), 1e-6);
            let soon = center(&mover.at(t_s + dt_s));
            let off_m = distance(soon, add(center(&now), scaled(now.velocity_m_s, dt_s)));
            // A turn within the time is possible, and rare.
            prop_assert!(off_m < 1e-9 || off_m < 2.0 * dt_s * norm(now.velocity_m_s));
        }

        #[test]
        fn bouncing_is_what_small_steps_with_reflections_make(
            start in prop::array::uniform2(-2.4..3.4f64),
            velocity_m_s in prop::array::uniform2(-2.0..2.0f64),
        ) {
            prop_assume!(norm(velocity_m_s) > 0.1);
            let mover =
                MovingObstacle::new(ball(start), ObstaclePath::Bouncing { velocity_m_s, room: ROOM }).unwrap();
            let (mut at, mut v, dt_s) = (start, velocity_m_s, 0.01);
            for k in 1..=4000 {
                for i in 0..2 {
                    at[i] += v[i] * dt_s;
                    let (lo, hi) = (ROOM.lo[i] + 0.5, ROOM.hi[i] - 0.5);
                    if at[i] > hi {
                        (at[i], v[i]) = (2.0 * hi - at[i], -v[i]);
                    }
                    if at[i] < lo {
                        (at[i], v[i]) = (2.0 * lo - at[i], -v[i]);
                    }
                }
                let obstacle = mover.at(f64::from(k) * dt_s);
                prop_assert!(distance(center(&obstacle), at) < 1e-8);
                prop_assert!(contains_box(&ROOM, &obstacle.bounds()));
            }
        }

        #[test]
        fn a_patrol_passes_its_way_points_in_time(
            way_points in prop::collection::vec(prop::array::uniform2(-5.0..5.0f64), 2..6),
            closed in any::<bool>(),
        ) {
            let course = ObstaclePath::Patrol { way_points: way_points.clone(), closed, speed_m_s: 0.5 };
            let mover = MovingObstacle::new(ball([9.0; 2]), course).unwrap();
            let there = way_points.windows(2).map(|w| distance(w[0], w[1])).sum::<f64>();
            let last = way_points[way_points.len() - 1];
            let round_m = there + if closed { distance(last, way_points[0]) } else { there };
            let mut way_m = 0.0;
            for (k, point) in way_points.iter().enumerate() {
                way_m += if k > 0 { distance(way_points[k - 1], *point) } else { 0.0 };
                for rounds in [0.0, 3.0] {
                    let at = center(&mover.at(2.0 * (way_m + rounds * round_m)));
                    prop_assert!(distance(at, *point) < 1e-9, "way point {k}");
                }
            }
        }
    }

    #[test]
    fn a_corner_has_the_velocity_of_what_comes() {
        let way_points = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]];
        let velocity_at = |closed, t_s| {
            let course =
                ObstaclePath::Patrol { way_points: way_points.clone(), closed, speed_m_s: 1.0 };
            MovingObstacle::new(ball([0.0; 2]), course).unwrap().at(t_s).velocity_m_s
        };
        assert_eq!(velocity_at(false, 2.0), [0.0, 1.0]);
        assert_eq!(velocity_at(false, 4.0), [0.0, -1.0]);
        assert_eq!(velocity_at(false, 6.0), [-1.0, 0.0]);
        assert_eq!(velocity_at(false, 8.0), [1.0, 0.0]);
        assert!(velocity_at(true, 4.0).iter().all(|v| (v + 0.5_f64.sqrt()).abs() < 1e-12));
    }

    #[test]
    fn movers_are_told_by_id_at_any_time() {
        let mover = |id, at| {
            let course = ObstaclePath::Straight { velocity_m_s: [1.0, 0.0] };
            MovingObstacle::new(Obstacle::ball(id, at, 0.1), course).unwrap()
        };
        let movers = MovingObstacles::new(vec![mover(8, [1.0, 1.0]), mover(2, [0.0; 2])]).unwrap();
        let places: Vec<_> = movers.at(2.5).map(|o| (o.id, center(&o))).collect();
        assert_eq!(places, [(2, [2.5, 0.0]), (8, [3.5, 1.0])]);
        assert!(MovingObstacles::new(vec![mover(1, [0.0; 2]), mover(1, [1.0; 2])]).is_err());
    }

    #[test]
    fn impossible_courses_are_refused() {
        let patrol = |way_points: &[Point<2>], speed_m_s| ObstaclePath::Patrol {
            way_points: way_points.to_vec(),
            closed: true,
            speed_m_s,
        };
        let inside_out = Aabb { lo: [1.0; 2], hi: [-1.0; 2] };
        for course in [
            ObstaclePath::Straight { velocity_m_s: [0.0; 2] },
            ObstaclePath::Straight { velocity_m_s: [f64::NAN, 1.0] },
            ObstaclePath::Bouncing { velocity_m_s: [0.0; 2], room: ROOM },
            ObstaclePath::Bouncing { velocity_m_s: [1.0; 2], room: inside_out },
            ObstaclePath::Bouncing { velocity_m_s: [1.0; 2], room: ROOM.grown(-3.2) },
            patrol(&[[0.0; 2]], 1.0),
            patrol(&[[0.0; 2], [0.0; 2]], 1.0),
            patrol(&[[0.0; 2], [f64::INFINITY; 2]], 1.0),
            patrol(&[[0.0; 2], [1.0; 2]], 0.0),
        ] {
            assert!(MovingObstacle::new(ball([0.0; 2]), course.clone()).is_err(), "{course:?}");
        }
    }
}
