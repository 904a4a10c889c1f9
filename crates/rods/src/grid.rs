//! A uniform grid that finds the boxes nearby: the broad phase of collision detection.

use super::geometry::{Aabb, Point};

/// Boxes, and for every cell the list of the boxes that meet it. The lists lie one after the other in one vector, so
/// that a new grid allocates nothing once its vectors are large enough.
#[derive(Debug, Clone, Default)]
pub struct SpatialGrid<const D: usize> {
    cells: CellLayout<D>,
    /// Start of the list of every cell in `entries`, and the end of the last one.
    starts: Vec<u32>,
    entries: Vec<u32>,
    bounds: Vec<Aabb<D>>,
    /// The lowest cell of every box.
    first: Vec<CellIndex<D>>,
}

/// Largest mean number of entries per box; beyond it the grid gets coarser, so that a few large boxes among
/// many small ones do not fill the memory. With 64 the lists take at most 256 bytes a box, a few times the box itself;
/// cells of half the mean box need about 9 entries a box in the plane and 27 in space, so that only very unequal
/// boxes reach the bound. The value was not tuned.
const MAX_ENTRIES_PER_BOX: usize = 64;
/// Largest number of cells per box, so that a few boxes far apart do not fill it either.
const MAX_CELLS_PER_BOX: usize = 64;
/// Side of a cell as a fraction of the mean extent of a box: most boxes then meet few cells.
const CELL_PER_BOX: f64 = 0.5;
/// Side of a cell as a fraction of the reach of queries: a query then visits a few cells along each axis.
const CELL_PER_REACH: f64 = 0.7;
/// Least side of a cell as a fraction of the whole extent: the number of cells along an axis stays far below the range of
/// its type.
const MIN_CELL_FRACTION: f64 = 1e-4;
/// Least side of a cell, meters, for boxes without extent and queries without reach.
const MIN_CELL_M: f64 = 1e-6;
/// Factor by which cells grow until they are few enough.
const GROWTH: f64 = 1.5;

impl<const D: usize> SpatialGrid<D> {
    /// Builds the grid anew, in the memory it has. Queries measure about `reach_m`, which determines
    /// the size of the cells, never the result.
    pub fn rebuild(&mut self, bounds: impl Iterator<Item = Aabb<D>>, reach_m: f64) {
        self.bounds.clear();
        self.bounds.extend(bounds);
        if !self.bounds.is_empty() {
            self.cells = CellLayout::from_boxes(&self.bounds, reach_m);
            self.fill();
        }
    }

    /// Lists the boxes of every cell by counting sort: `starts` holds the counts first, then the
    /// next write positions, and in the end the start of each list.
    ///
    /// `starts` is two longer than the number of cells, and shifted: while the lists are written the element after a
    /// cell's own is its write position, which ends as the start of the next list.
    fn fill(&mut self) {
        let Self { cells, starts, entries, bounds, first } = self;
        first.clear();
        first.extend(bounds.iter().map(|b| cells.cell_at(b.lo)));
        let n_cells = cells.len();
        starts.clear();
        starts.resize(n_cells + 2, 0);
        for b in &*bounds {
            cells.for_each(cells.cell_range(b), |_, index| starts[index + 2] += 1);
        }
        for k in 0..n_cells {
            starts[k + 2] += starts[k + 1];
        }
        entries.clear();
        entries.resize(starts[n_cells + 1] as usize, 0);
        for (k, b) in (0u32..).zip(&*bounds) {
            cells.for_each(cells.cell_range(b), |_, index| {
                entries[starts[index + 1] as usize] = k;
                starts[index + 1] += 1;
            });
        }
    }

    /// Visits every box that meets `near`, each once.
    #[inline]
    pub fn visit(&self, near: &Aabb<D>, mut visit_one: impl FnMut(usize)) {
        if self.bounds.is_empty() {
            return;
        }
        let range = self.cells.cell_range(near);
        self.cells.for_each(range, |cell, index| {
            let from = self.starts[index] as usize;
            let to = self.starts[index + 1] as usize;
            for &k in &self.entries[from..to] {
                let k = k as usize;
                // A box in several cells is reported only in the first cell that it shares with the
                // query.
                let is_first = (0..D).all(|i| cell[i] == self.first[k][i].max(range[0][i]));
                if is_first && self.bounds[k].intersects(near) {
                    visit_one(k);
                }
            }
        });
    }
}

/// Returns the longest side of a box, meters.
fn extent_m<const D: usize>(b: &Aabb<D>) -> f64 {
    (0..D).map(|i| b.hi[i] - b.lo[i]).fold(0.0, f64::max)
}

/// A cell's number along every axis.
type CellIndex<const D: usize> = [u32; D];

/// The division of space into cells. Everything outside belongs to the nearest cell.
#[derive(Debug, Clone, Copy)]
struct CellLayout<const D: usize> {
    origin: Point<D>,
    per_m: f64,
    n: CellIndex<D>,
}

impl<const D: usize> Default for CellLayout<D> {
    fn default() -> Self {
        Self { origin: [0.0; D], per_m: 1.0, n: [1; D] }
    }
}

impl<const D: usize> CellLayout<D> {
    /// Chooses cells for boxes, of which there is at least one, and queries of about `reach_m`.
    fn from_boxes(bounds: &[Aabb<D>], reach_m: f64) -> Self {
        let n = bounds.len();
        let around = bounds.iter().fold(Aabb::empty(), |all, b| all.joined(b));
        let mean_m = bounds.iter().map(extent_m).sum::<f64>() / n as f64;
        let mut cell_m = (CELL_PER_BOX * mean_m)
            .max(CELL_PER_REACH * reach_m)
            .max(extent_m(&around) * MIN_CELL_FRACTION)
            .max(MIN_CELL_M);
        loop {
            let cells = Self::from_bounds(&around, cell_m);
            if cells.len() <= MAX_CELLS_PER_BOX * (n + 1)
                && cells.count_cells_of_boxes(bounds) <= MAX_ENTRIES_PER_BOX * (n + 1)
            {
                return cells;
            }
            cell_m *= GROWTH;
        }
    }

    /// Returns the cells of a side that cover a box.
    fn from_bounds(around: &Aabb<D>, cell_m: f64) -> Self {
        let per_m = 1.0 / cell_m;
        let n = std::array::from_fn(|i| ((around.hi[i] - around.lo[i]) * per_m) as u32 + 1);
        Self { origin: around.lo, per_m, n }
    }

    /// Returns the number of cells that boxes meet, summed over the boxes.
    fn count_cells_of_boxes(&self, bounds: &[Aabb<D>]) -> usize {
        bounds.iter().map(|b| self.count_cells(b)).sum()
    }

    fn len(&self) -> usize {
        self.n.iter().map(|&n| n as usize).product()
    }

    fn count_cells(&self, b: &Aabb<D>) -> usize {
        let [lo, hi] = self.cell_range(b);
        (0..D).map(|i| (hi[i] - lo[i]) as usize + 1).product()
    }

    #[inline]
    fn cell_at(&self, p: Point<D>) -> CellIndex<D> {
        // The cast saturates, so anything below the grid falls into its first cell.
        std::array::from_fn(|i| (((p[i] - self.origin[i]) * self.per_m) as u32).min(self.n[i] - 1))
    }

    /// Returns the lowest and the highest cell that a box meets.
    #[inline]
    fn cell_range(&self, b: &Aabb<D>) -> [CellIndex<D>; 2] {
        [self.cell_at(b.lo), self.cell_at(b.hi)]
    }

    #[inline]
    fn index(&self, cell: CellIndex<D>) -> usize {
        (0..D).rev().fold(0, |index, i| index * self.n[i] as usize + cell[i] as usize)
    }

    /// Visits the cells of a block, and their indices, in the order of the indices.
    #[inline]
    fn for_each(
        &self,
        [lo, hi]: [CellIndex<D>; 2],
        mut visit_one: impl FnMut(CellIndex<D>, usize),
    ) {
        let mut cell = lo;
        loop {
            visit_one(cell, self.index(cell));
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
}
