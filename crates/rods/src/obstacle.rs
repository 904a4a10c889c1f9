//! Obstacles, and the search for those nearby.
//!
//! Static obstacles lie in a uniform grid, which copies share; moving ones are a list, with a grid
//! of its own if they are many. A query is a box and visits every obstacle whose own box meets it
//! exactly once, without allocating (slide P3: proximity is sensed locally).

use super::geometry::{self, Aabb, ConvexCore, Point, add, scaled};
use super::grid::SpatialGrid;
use sidestep_kernel::InputError;
use std::any::Any;
use std::sync::Arc;

/// An obstacle: all points within a radius of a convex core.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle<const D: usize> {
    /// Its id in vetoes. Several obstacles may share one, as the walls of a room do.
    pub id: u32,
    /// Its shape without the radius.
    pub core: ConvexCore<D>,
    /// Its reach beyond its core, meters; 0 for a thin wall.
    pub radius_m: f64,
    /// Its velocity; zero for static obstacles.
    pub velocity_m_s: Point<D>,
}

impl<const D: usize> Obstacle<D> {
    /// Returns a static obstacle.
    pub fn new_static(id: u32, core: ConvexCore<D>, radius_m: f64) -> Self {
        Self { id, core, radius_m, velocity_m_s: [0.0; D] }
    }

    /// Returns a static disc or sphere.
    pub fn ball(id: u32, center: Point<D>, radius_m: f64) -> Self {
        Self::new_static(id, ConvexCore::Point(center), radius_m)
    }

    /// Returns a static thin wall or capsule.
    pub fn capsule(id: u32, ends: [Point<D>; 2], radius_m: f64) -> Self {
        Self::new_static(id, ConvexCore::Segment(ends), radius_m)
    }

    /// Returns whether it has a velocity; the grid of static obstacles leaves it out then.
    pub fn is_moving(&self) -> bool {
        self.velocity_m_s.iter().any(|&v| v != 0.0)
    }

    /// Returns the box around it, its radius included.
    #[inline]
    pub fn bounds(&self) -> Aabb<D> {
        self.core.bounds().grown(self.radius_m)
    }

    /// Returns whether it is in the range of coordinates. One that moves on without end leaves it.
    pub fn is_in_range(&self) -> bool {
        self.check().is_ok()
    }

    /// Refuses numbers that are not finite or out of range.
    pub fn check(&self) -> Result<(), InputError> {
        let place = format!("obstacle {}", self.id);
        if !self.core.is_finite() || !geometry::is_finite(&self.velocity_m_s) {
            let cause = "has a coordinate that is no finite number";
            return Err(InputError::new(place, cause, "give finite numbers"));
        }
        if !(0.0..=MAX_EXTENT_M).contains(&self.radius_m) {
            let cause = format!("has radius {} m", self.radius_m);
            return Err(InputError::new(place, cause, "give 0 to 1e7 m"));
        }
        let bounds = self.bounds();
        if bounds.lo.iter().chain(&bounds.hi).any(|x| x.abs() > MAX_EXTENT_M) {
            let cause = "lies further than 1e7 m from the origin";
            return Err(InputError::new(place, cause, "move it nearer"));
        }
        Ok(())
    }
}

/// Returns the walls of a plane polygon, all with one id. They guard its inside: a chain that
/// starts outside never gets in.
pub fn outline_walls(id: u32, corners: &[Point<2>], radius_m: f64) -> Vec<Obstacle<2>> {
    let walls = (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]]);
    walls.map(|ends| Obstacle::capsule(id, ends, radius_m)).collect()
}

/// Largest coordinate: beyond it, rounding is no longer small against the tolerances. It is ten times that of
/// connectors, so that an obstacle around a whole world may reach beyond its parts.
const MAX_EXTENT_M: f64 = 1e7;

/// All obstacles of a world. A copy shares the static ones with the original and has its own moving
/// ones, so every worker may have a copy.
#[derive(Debug, Clone, Default)]
pub struct Obstacles<const D: usize> {
    still: Arc<StillObstacles<D>>,
    moving: Vec<Obstacle<D>>,
    /// Index of the moving ones, if they are many.
    moving_grid: SpatialGrid<D>,
    reach_m: f64,
}

#[derive(Debug, Default)]
struct StillObstacles<const D: usize> {
    all: Vec<Obstacle<D>>,
    grid: SpatialGrid<D>,
}

/// Number of moving obstacles up to which a linear scan is taken for faster than a grid, which is built anew whenever
/// they move. No result depends on it.
const MAX_LINEAR_SCAN: usize = 12;

impl<const D: usize> Obstacles<D> {
    /// Returns the same obstacles for a world in the plane; none if `D` is not 2.
    pub fn as_planar(&self) -> Option<&Obstacles<2>> {
        (self as &dyn Any).downcast_ref()
    }

    /// Returns obstacles for chains whose longest rod, with its ends, measures about `reach_m`;
    /// that determines the cells of the grid, never the result.
    ///
    /// # Errors
    /// When a number is not finite, a radius is negative, or an obstacle is farther than 1e7 m
    /// away.
    pub fn new(mut all: Vec<Obstacle<D>>, reach_m: f64) -> Result<Self, InputError> {
        all.iter().try_for_each(Obstacle::check)?;
        all.sort_by_key(|o| o.id);
        let (moving, still): (Vec<_>, Vec<_>) = all.into_iter().partition(Obstacle::is_moving);
        let mut grid = SpatialGrid::default();
        grid.rebuild(still.iter().map(Obstacle::bounds), reach_m);
        let still = Arc::new(StillObstacles { all: still, grid });
        let mut obstacles = Self { still, moving, moving_grid: SpatialGrid::default(), reach_m };
        obstacles.index_moving();
        Ok(obstacles)
    }

    /// Returns whether there are none, neither static nor moving.
    pub fn is_empty(&self) -> bool {
        self.still.all.is_empty() && self.moving.is_empty()
    }

    /// Returns the static obstacles, by id.
    pub fn still(&self) -> &[Obstacle<D>] {
        &self.still.all
    }

    /// Returns the moving obstacles, by id, also those that [`Self::replace_moving`] gave no velocity.
    pub fn moving(&self) -> &[Obstacle<D>] {
        &self.moving
    }

    /// Replaces the moving obstacles, in the memory they have. Their velocities may be zero,
    /// because parts of other chains rest at times.
    ///
    /// # Errors
    /// As [`Self::new`]; then nothing has changed.
    pub fn replace_moving(&mut self, moving: &[Obstacle<D>]) -> Result<(), InputError> {
        moving.iter().try_for_each(Obstacle::check)?;
        self.moving.clear();
        self.moving.extend_from_slice(moving);
        if !self.moving.is_sorted_by_key(|o| o.id) {
            self.moving.sort_by_key(|o| o.id);
        }
        self.index_moving();
        Ok(())
    }

    /// Moves the moving obstacles along their velocities.
    pub fn advance(&mut self, dt_s: f64) {
        for obstacle in &mut self.moving {
            obstacle.core = obstacle.core.shifted(scaled(obstacle.velocity_m_s, dt_s));
        }
        self.index_moving();
    }

    fn index_moving(&mut self) {
        if self.moving.len() > MAX_LINEAR_SCAN {
            self.moving_grid.rebuild(self.moving.iter().map(Obstacle::bounds), self.reach_m);
        }
    }

    /// Visits every obstacle whose box meets `near`, each once: the static ones first, in an order
    /// that depends only on the obstacles and the box.
    #[inline]
    pub fn visit<'a>(&'a self, near: &Aabb<D>, mut visit_one: impl FnMut(&'a Obstacle<D>)) {
        self.still.grid.visit(near, |k| visit_one(&self.still.all[k]));
        if self.moving.len() > MAX_LINEAR_SCAN {
            return self.moving_grid.visit(near, |k| visit_one(&self.moving[k]));
        }
        for obstacle in self.moving.iter().filter(|o| o.bounds().intersects(near)) {
            visit_one(obstacle);
        }
    }

    /// Returns the obstacle with the lowest id among those that a capsule overlaps.
    pub fn first_overlapping_id(&self, [p, q]: [Point<D>; 2], radius_m: f64) -> Option<u32> {
        let mut first: Option<u32> = None;
        // A negative radius asks for overlaps that are deeper than it.
        self.visit(&Aabb::from_points(&[p, q]).grown(radius_m.max(0.0)), |o| {
            let apart_m = o.core.nearest_to_segment([p, q]).distance_m - o.radius_m - radius_m;
            if apart_m < 0.0 && first.is_none_or(|id| o.id < id) {
                first = Some(o.id);
            }
        });
        first
    }

    /// Returns the least distance of a capsule's surface from the obstacles within `look_m`;
    /// `look_m` if none is as near.
    pub fn clearance_m(&self, [p, q]: [Point<D>; 2], radius_m: f64, look_m: f64) -> f64 {
        let mut least_m = look_m;
        self.visit(&Aabb::from_points(&[p, q]).grown(radius_m + look_m), |o| {
            let apart_m = o.core.nearest_to_segment([p, q]).distance_m - o.radius_m - radius_m;
            least_m = least_m.min(apart_m);
        });
        least_m
    }
}

/// Returns the box around a segment and its earlier place.
#[inline]
pub(super) fn swept_bounds<const D: usize>(points: [Point<D>; 4], by_m: f64) -> Aabb<D> {
    Aabb::from_points(&points).grown(by_m)
}

/// Returns the box of a query around a point, `half_m` to every side.
#[inline]
pub fn bounds_around<const D: usize>(at: Point<D>, half_m: f64) -> Aabb<D> {
    Aabb { lo: add(at, [-half_m; D]), hi: add(at, [half_m; D]) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Ball = ([f64; 2], f64);

    fn balls() -> impl Strategy<Value = Vec<Ball>> {
        let ball = (prop::array::uniform2(-9.0..9.0f64), 0.0..2.0f64);
        prop::collection::vec(ball, 0..60)
    }

    fn named(balls: &[Ball], from: u32) -> Vec<Obstacle<2>> {
        (from..).zip(balls).map(|(id, (c, r))| Obstacle::ball(id, *c, *r)).collect()
    }

    fn seen(obstacles: &Obstacles<2>, near: &Aabb<2>) -> Vec<u32> {
        let mut seen = Vec::new();
        obstacles.visit(near, |o| seen.push(o.id));
        seen.sort_unstable();
        seen
    }

    proptest! {
        #[test]
        fn a_query_visits_exactly_what_is_near(
            still in balls(),
            moving in balls(),
            by in prop::array::uniform2(-9.0..9.0f64),
            at in prop::array::uniform2(-12.0..12.0f64),
            half_m in 0.0..4.0f64,
            reach_m in 0.01..5.0f64,
        ) {
            let (still, moving) = (named(&still, 0), named(&moving, 100));
            let moving: Vec<_> =
                moving.into_iter().map(|o| Obstacle { velocity_m_s: by, ..o }).collect();
            let near = bounds_around(at, half_m);
            let expected = |moving: &[Obstacle<2>]| -> Vec<u32> {
                let near_by = |o: &&Obstacle<2>| o.bounds().intersects(&near);
                still.iter().chain(moving).filter(near_by).map(|o| o.id).collect()
            };
            let mut obstacles = Obstacles::new(still.clone(), reach_m).unwrap();
            let copy = obstacles.clone();
            obstacles.replace_moving(&moving).unwrap();
            prop_assert_eq!(seen(&obstacles, &near), expected(&moving));
            obstacles.advance(0.5);
            prop_assert_eq!(seen(&obstacles, &near), expected(obstacles.moving()));
            prop_assert_eq!(seen(&copy, &near), expected(&[]));
            obstacles.replace_moving(&moving[..moving.len() / 4]).unwrap();
            prop_assert_eq!(seen(&obstacles, &near), expected(&moving[..moving.len() / 4]));
        }

        #[test]
        fn those_that_move_are_visited_in_an_order_that_follows_from_their_names(
            moving in balls(), from in 0usize..60, half_m in 0.0..9.0f64,
        ) {
            let moving = named(&moving, 0);
            let mut other_order = moving.clone();
            other_order.rotate_left(from.min(moving.len()));
            let order = |moving: &[Obstacle<2>]| {
                let mut obstacles = Obstacles::default();
                obstacles.replace_moving(moving).unwrap();
                let mut seen = Vec::new();
                obstacles.visit(&bounds_around([0.0; 2], half_m), |o| seen.push(o.id));
                seen
            };
            prop_assert_eq!(order(&moving), order(&other_order));
        }
    }

    #[test]
    fn copies_share_what_stands_still() {
        let obstacles = Obstacles::new(named(&[([0.0; 2], 1.0); 9], 0), 1.0).unwrap();
        assert!(std::ptr::eq(obstacles.still(), obstacles.clone().still()));
    }

    #[test]
    fn wrong_moving_obstacles_change_nothing() {
        let mut obstacles = Obstacles::<2>::default();
        obstacles.replace_moving(&[Obstacle::ball(1, [0.0; 2], 1.0)]).unwrap();
        assert!(obstacles.replace_moving(&[Obstacle::ball(2, [f64::NAN; 2], 1.0)]).is_err());
        assert_eq!(obstacles.moving()[0].id, 1);
    }

    #[test]
    fn obstacles_that_move_are_found_where_they_are() {
        let ball = Obstacle { velocity_m_s: [1.0, 0.0], ..Obstacle::ball(7, [0.0, 0.0], 0.5) };
        let mut obstacles = Obstacles::new(vec![ball], 1.0).unwrap();
        obstacles.advance(3.0);
        let mut seen = Vec::new();
        obstacles.visit(&bounds_around([3.4, 0.0], 0.1), |o| seen.push(o.id));
        assert_eq!(seen, [7]);
    }

    #[test]
    fn wrong_numbers_are_named() {
        let error = Obstacles::new(vec![Obstacle::ball(3, [f64::NAN, 0.0], 1.0)], 1.0).unwrap_err();
        assert_eq!(error.place(), "obstacle 3");
        assert!(Obstacles::new(vec![Obstacle::ball(3, [0.0, 0.0], -1.0)], 1.0).is_err());
        assert!(Obstacles::new(vec![Obstacle::ball(3, [1e300, 0.0], 1.0)], 1.0).is_err());
    }
}
