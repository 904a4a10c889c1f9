//! Obstacles: what they are, and which of them are near.
//!
//! Obstacles that stand still lie in a uniform grid; those that move are a list. A query names a
//! box and visits every obstacle whose own box meets it exactly once, without allocating (slide
//! P3: proximity is sensed locally).

use super::geometry::{self, Bounds, Core, Point, add, scaled};
use sidestep_kernel::InputError;

/// Something in the way: all points within a radius of a convex core.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle<const D: usize> {
    /// Its name in vetoes. Several may share one, as the walls of a room do.
    pub id: u32,
    /// Its inner part.
    pub core: Core<D>,
    /// How far it reaches beyond its core; 0 for a thin wall.
    pub radius_m: f64,
    /// Where it goes; zero for obstacles that stand still.
    pub velocity_m_s: Point<D>,
}

impl<const D: usize> Obstacle<D> {
    /// An obstacle that stands still.
    pub fn still(id: u32, core: Core<D>, radius_m: f64) -> Self {
        Self { id, core, radius_m, velocity_m_s: [0.0; D] }
    }

    /// A disc or a sphere that stands still.
    pub fn ball(id: u32, center: Point<D>, radius_m: f64) -> Self {
        Self::still(id, Core::Point(center), radius_m)
    }

    /// A thin wall or a capsule that stands still.
    pub fn capsule(id: u32, ends: [Point<D>; 2], radius_m: f64) -> Self {
        Self::still(id, Core::Segment(ends), radius_m)
    }

    /// Whether it moves.
    pub fn is_moving(&self) -> bool {
        self.velocity_m_s.iter().any(|&v| v != 0.0)
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds<D> {
        self.core.bounds().grown(self.radius_m)
    }

    fn check(&self) -> Result<(), InputError> {
        let wrong = |cause: String, remedy: &str| {
            Err(InputError::new(format!("obstacle {}", self.id), cause, remedy))
        };
        if !self.core.is_finite() || !geometry::is_finite(&self.velocity_m_s) {
            return wrong(
                "has a coordinate that is no finite number".into(),
                "give finite numbers",
            );
        }
        if !(0.0..=MAX_EXTENT_M).contains(&self.radius_m) {
            return wrong(format!("has radius {} m", self.radius_m), "give 0 to 1e7 m");
        }
        let box_ = self.bounds();
        if box_.lo.iter().chain(&box_.hi).any(|x| x.abs() > MAX_EXTENT_M) {
            return wrong("lies further than 1e7 m from the origin".into(), "move it nearer");
        }
        Ok(())
    }
}

/// The walls of a plane polygon, all with one id. Its inside is guarded by them: who starts
/// outside never gets in.
pub fn outline(id: u32, corners: &[Point<2>], radius_m: f64) -> Vec<Obstacle<2>> {
    let wall =
        |k: usize| Obstacle::capsule(id, [corners[k], corners[(k + 1) % corners.len()]], radius_m);
    (0..corners.len()).map(wall).collect()
}

/// Beyond this, rounding is no longer small against the tolerances.
const MAX_EXTENT_M: f64 = 1e7;

/// All obstacles of a world.
#[derive(Debug, Clone)]
pub struct Obstacles<const D: usize> {
    still: Vec<Obstacle<D>>,
    grid: Grid<D>,
    moving: Vec<Obstacle<D>>,
}

impl<const D: usize> Default for Obstacles<D> {
    fn default() -> Self {
        Self { still: Vec::new(), grid: Grid::build(&[], 1.0), moving: Vec::new() }
    }
}

impl<const D: usize> Obstacles<D> {
    /// Obstacles for chains whose longest rod, with its ends, measures about `reach_m`; that
    /// sets the cells of the grid, never the result.
    ///
    /// # Errors
    /// A number that is not finite, a negative radius, an obstacle further than 1e7 m away.
    pub fn new(mut all: Vec<Obstacle<D>>, reach_m: f64) -> Result<Self, InputError> {
        all.iter().try_for_each(Obstacle::check)?;
        all.sort_by_key(|o| o.id);
        let (moving, still): (Vec<_>, Vec<_>) = all.into_iter().partition(Obstacle::is_moving);
        let bounds: Vec<_> = still.iter().map(Obstacle::bounds).collect();
        let grid = Grid::build(&bounds, reach_m);
        Ok(Self { still, grid, moving })
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.still.is_empty() && self.moving.is_empty()
    }

    /// Those that stand still, by id.
    pub fn still(&self) -> &[Obstacle<D>] {
        &self.still
    }

    /// Those that move, by id.
    pub fn moving(&self) -> &[Obstacle<D>] {
        &self.moving
    }

    /// Gives one of [`Self::moving`] a new place or velocity.
    pub fn moving_mut(&mut self) -> &mut [Obstacle<D>] {
        &mut self.moving
    }

    /// Moves those that move along their velocities.
    pub fn advance(&mut self, dt_s: f64) {
        for obstacle in &mut self.moving {
            obstacle.core = obstacle.core.shifted(scaled(obstacle.velocity_m_s, dt_s));
        }
    }

    /// Visits every obstacle whose box meets `near`, each once.
    #[inline]
    pub fn visit<'a>(&'a self, near: &Bounds<D>, mut look: impl FnMut(&'a Obstacle<D>)) {
        self.grid.visit(near, |k| look(&self.still[k]));
        for obstacle in self.moving.iter().filter(|o| o.bounds().meets(near)) {
            look(obstacle);
        }
    }

    /// The least distance of a ball's surface from the obstacles within `look_m`; `look_m` where
    /// nothing is as near.
    pub fn clearance_m(&self, [p, q]: [Point<D>; 2], radius_m: f64, look_m: f64) -> f64 {
        let mut least_m = look_m;
        self.visit(&Bounds::of(&[p, q]).grown(radius_m + look_m), |o| {
            let apart_m = o.core.nearest_to_segment([p, q]).distance_m - o.radius_m - radius_m;
            least_m = least_m.min(apart_m);
        });
        least_m
    }
}

/// A uniform grid over boxes; every cell lists the boxes that meet it.
#[derive(Debug, Clone)]
struct Grid<const D: usize> {
    origin: Point<D>,
    per_m: f64,
    cells: [usize; D],
    starts: Vec<u32>,
    entries: Vec<u32>,
    bounds: Vec<Bounds<D>>,
    /// The lowest cell of every box.
    first: Vec<[usize; D]>,
}

/// The grid gets coarser until a box has at most this many entries on average.
const ENTRIES_PER_BOX: usize = 64;
const CELLS_PER_BOX: usize = 64;

impl<const D: usize> Grid<D> {
    fn build(bounds: &[Bounds<D>], reach_m: f64) -> Self {
        let around = bounds.iter().fold(Bounds::nothing(), |all, b| all.joined(b));
        let mut grid = Self {
            origin: if bounds.is_empty() { [0.0; D] } else { around.lo },
            per_m: 1.0,
            cells: [if bounds.is_empty() { 0 } else { 1 }; D],
            starts: vec![0],
            entries: Vec::new(),
            bounds: bounds.to_vec(),
            first: Vec::new(),
        };
        if !bounds.is_empty() {
            grid.choose_cells(&around, reach_m);
            grid.fill();
        }
        grid
    }

    fn choose_cells(&mut self, around: &Bounds<D>, reach_m: f64) {
        let extent = |b: &Bounds<D>| (0..D).map(|i| b.hi[i] - b.lo[i]).fold(0.0, f64::max);
        let mean_m = self.bounds.iter().map(extent).sum::<f64>() / self.bounds.len() as f64;
        let mut cell_m = (0.5 * mean_m).max(0.7 * reach_m).max(extent(around) * 1e-4).max(1e-6);
        loop {
            self.per_m = 1.0 / cell_m;
            self.cells =
                std::array::from_fn(|i| ((around.hi[i] - around.lo[i]) * self.per_m) as usize + 1);
            let n_cells = self.cells.iter().product::<usize>();
            let n = self.bounds.len();
            if n_cells <= CELLS_PER_BOX * n + 4096 && self.n_entries() <= ENTRIES_PER_BOX * n + 64 {
                return;
            }
            cell_m *= 1.5;
        }
    }

    fn n_entries(&self) -> usize {
        let count = |b: &Bounds<D>| {
            let (lo, hi) = (self.cell_of(b.lo), self.cell_of(b.hi));
            (0..D).map(|i| hi[i] - lo[i] + 1).product::<usize>()
        };
        self.bounds.iter().map(count).sum()
    }

    #[inline]
    fn cell_of(&self, p: Point<D>) -> [usize; D] {
        // A float cast saturates: what lies below the grid is in its first cell.
        std::array::from_fn(|i| {
            (((p[i] - self.origin[i]) * self.per_m) as usize).min(self.cells[i] - 1)
        })
    }

    #[inline]
    fn index(&self, cell: [usize; D]) -> usize {
        (0..D).rev().fold(0, |index, i| index * self.cells[i] + cell[i])
    }

    fn fill(&mut self) {
        let n_cells: usize = self.cells.iter().product();
        self.first = self.bounds.iter().map(|b| self.cell_of(b.lo)).collect();
        let mut counts = vec![0u32; n_cells + 1];
        let range = |b: &Bounds<D>| (self.cell_of(b.lo), self.cell_of(b.hi));
        for b in &self.bounds {
            let (lo, hi) = range(b);
            for_cells(lo, hi, |cell| counts[self.index(cell) + 1] += 1);
        }
        for k in 0..n_cells {
            counts[k + 1] += counts[k];
        }
        let mut next = counts.clone();
        let mut entries = vec![0u32; counts[n_cells] as usize];
        for (k, b) in self.bounds.iter().enumerate() {
            let (lo, hi) = range(b);
            for_cells(lo, hi, |cell| {
                let slot = &mut next[self.index(cell)];
                entries[*slot as usize] = k as u32;
                *slot += 1;
            });
        }
        (self.starts, self.entries) = (counts, entries);
    }

    #[inline]
    fn visit(&self, near: &Bounds<D>, mut look: impl FnMut(usize)) {
        if self.bounds.is_empty() {
            return;
        }
        let (lo, hi) = (self.cell_of(near.lo), self.cell_of(near.hi));
        for_cells(lo, hi, |cell| {
            let index = self.index(cell);
            let (from, to) = (self.starts[index] as usize, self.starts[index + 1] as usize);
            for &k in &self.entries[from..to] {
                let k = k as usize;
                // A box in several cells is told in the first that both share.
                let first = (0..D).all(|i| cell[i] == self.first[k][i].max(lo[i]));
                if first && self.bounds[k].meets(near) {
                    look(k);
                }
            }
        });
    }
}

/// Visits the cells of a block in the order of their indices.
#[inline]
fn for_cells<const D: usize>(lo: [usize; D], hi: [usize; D], mut look: impl FnMut([usize; D])) {
    let mut cell = lo;
    loop {
        look(cell);
        let mut axis = 0;
        while cell[axis] == hi[axis] {
            cell[axis] = lo[axis];
            axis += 1;
            if axis == D {
                return;
            }
        }
        cell[axis] += 1;
    }
}

/// The box around a segment and where it was before.
#[inline]
pub(super) fn swept<const D: usize>(points: [Point<D>; 4], by_m: f64) -> Bounds<D> {
    Bounds::of(&points).grown(by_m)
}

/// A box of `half_m` around a point.
#[inline]
pub(super) fn around<const D: usize>(at: Point<D>, half_m: f64) -> Bounds<D> {
    Bounds { lo: add(at, [-half_m; D]), hi: add(at, [half_m; D]) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_query_visits_exactly_what_is_near(
            balls in prop::collection::vec((prop::array::uniform2(-9.0..9.0f64), 0.0..2.0f64), 0..60),
            at in prop::array::uniform2(-12.0..12.0f64),
            half_m in 0.0..4.0f64,
            reach_m in 0.01..5.0f64,
        ) {
            let all: Vec<_> =
                (0u32..).zip(&balls).map(|(id, (c, r))| Obstacle::ball(id, *c, *r)).collect();
            let near = around(at, half_m);
            let expected: Vec<u32> =
                all.iter().filter(|o| o.bounds().meets(&near)).map(|o| o.id).collect();
            let mut seen = Vec::new();
            Obstacles::new(all, reach_m).unwrap().visit(&near, |o| seen.push(o.id));
            seen.sort_unstable();
            prop_assert_eq!(seen, expected);
        }
    }

    #[test]
    fn obstacles_that_move_are_found_where_they_are() {
        let ball = Obstacle { velocity_m_s: [1.0, 0.0], ..Obstacle::ball(7, [0.0, 0.0], 0.5) };
        let mut obstacles = Obstacles::new(vec![ball], 1.0).unwrap();
        obstacles.advance(3.0);
        let mut seen = Vec::new();
        obstacles.visit(&around([3.4, 0.0], 0.1), |o| seen.push(o.id));
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
