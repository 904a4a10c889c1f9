//! The free boxes of a grid, one bit per box.

use crate::{Cell, GridMap};

/// Number of columns of a [`FreeWindow`]: the bits of a word.
pub const FREE_WINDOW_COLUMNS: usize = 32;

/// The set of boxes of a grid where a body may stand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FreeSpace {
    width: u32,
    height: u32,
    /// Bit `index % 64` of word `index / 64` with `index = row * width + col`.
    bits: Vec<u64>,
}

impl FreeSpace {
    /// Creates the set of boxes of a `width` x `height` grid for which `is_free(col, row)` holds.
    pub fn new(width: u32, height: u32, mut is_free: impl FnMut(u32, u32) -> bool) -> Self {
        let mut space = Self::empty(width, height);
        for row in 0..height {
            for col in 0..width {
                if is_free(col, row) {
                    space.insert(col, row);
                }
            }
        }
        space
    }

    /// Creates the set of free boxes of `map`, without unknown boxes (see
    /// [`GridMap::with_unknown`]).
    pub fn from_map(map: &GridMap) -> Self {
        Self::new(map.width(), map.height(), |col, row| map.cell(col, row) == Cell::Free)
    }

    /// Number of columns of the grid.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Number of rows of the grid.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Returns whether the box is free; a box outside the grid is not.
    pub fn is_free(&self, col: u32, row: u32) -> bool {
        col < self.width && row < self.height && self.contains(self.index(col, row))
    }

    /// Returns the part of 32 columns and `ROWS` rows whose lower-left box is in this column and row. It may reach beyond
    /// the grid, where no box is free.
    #[inline]
    pub fn window<const ROWS: usize>(&self, west: i32, south: i32) -> FreeWindow<ROWS> {
        let mut window = FreeWindow { rows: [0; ROWS] };
        let first = west.max(0);
        // At most 32, or less than 1 where none of these columns is in the grid.
        let count = (i64::from(west) + FREE_WINDOW_COLUMNS as i64).min(i64::from(self.width))
            - i64::from(first);
        if count < 1 {
            return window;
        }
        for (bits, row) in window.rows.iter_mut().zip(south..) {
            // A number below zero becomes one beyond every grid.
            if (row as u32) < self.height {
                let index = self.index(first as u32, row as u32);
                *bits = self.bits_from(index, count as u32) << (first - west);
            }
        }
        window
    }

    /// Returns `count` bits from an index on; all of these boxes must be inside the grid, and at most 32.
    fn bits_from(&self, index: usize, count: u32) -> u32 {
        let word = index / 64;
        let shift = index % 64;
        let mut bits = self.bits[word] >> shift;
        // In two steps, because 64 bits cannot be shifted by 64.
        if let Some(next) = self.bits.get(word + 1) {
            bits |= next << 1 << (63 - shift);
        }
        (bits & ((1 << count) - 1)) as u32
    }

    /// Returns the anchors of a body of `size` x `size` boxes: the boxes that can be the lower-left
    /// one of a square that is free as a whole. A step from one anchor to the next sweeps free
    /// boxes only.
    ///
    /// # Panics
    /// When `size` is 0.
    #[must_use]
    pub fn anchors(&self, size: u32) -> Self {
        assert!(size > 0, "a body covers at least one box");
        // Every free box is the anchor of a body of one box.
        if size == 1 {
            return self.clone();
        }
        let mut anchors = Self::empty(self.width, self.height);
        // Dynamic programming: the largest free square with its lower-left box here is one box larger than the
        // smallest of those above, to the east, and above to the east. The sides of one row are kept, from the
        // east edge on those of the present row, and beyond it those of the row above; with one column more, for
        // the east edge.
        let mut sides = vec![0; self.width as usize + 1];
        for row in (0..self.height).rev() {
            // The side above to the east, which the pass to the west has already overwritten.
            let mut above_east = 0;
            for col in (0..self.width).rev() {
                let index = col as usize;
                let smallest = sides[index].min(sides[index + 1]).min(above_east);
                above_east = sides[index];
                sides[index] = if self.is_free(col, row) { smallest + 1 } else { 0 };
                if sides[index] >= size {
                    anchors.insert(col, row);
                }
            }
        }
        anchors
    }

    fn empty(width: u32, height: u32) -> Self {
        let boxes = width as usize * height as usize;
        Self { width, height, bits: vec![0; boxes.div_ceil(64)] }
    }

    /// Returns the index of a box in row-major order; the box must be inside the grid.
    pub(super) fn index(&self, col: u32, row: u32) -> usize {
        row as usize * self.width as usize + col as usize
    }

    /// Number of boxes of the grid.
    pub(super) fn len(&self) -> usize {
        self.width as usize * self.height as usize
    }

    pub(super) fn contains(&self, index: usize) -> bool {
        self.bits[index / 64] >> (index % 64) & 1 == 1
    }

    fn insert(&mut self, col: u32, row: u32) {
        let index = self.index(col, row);
        self.bits[index / 64] |= 1 << (index % 64);
    }
}

/// A square part of a [`FreeSpace`], for what looks at each of its boxes many times. Columns and rows are counted from its
/// lower-left box.
#[derive(Debug, Clone)]
pub struct FreeWindow<const ROWS: usize> {
    /// A bit for each column.
    rows: [u32; ROWS],
}

impl<const ROWS: usize> FreeWindow<ROWS> {
    /// Returns what [`FreeSpace::is_free`] does.
    ///
    /// # Panics
    /// Outside of the window.
    #[inline]
    pub fn is_free(&self, col: usize, row: usize) -> bool {
        self.rows[row] >> col & 1 == 1
    }

    /// Returns the free boxes of a row, a bit each from the west.
    ///
    /// # Panics
    /// Outside of the window.
    #[inline]
    pub fn row(&self, row: usize) -> u32 {
        self.rows[row]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn boxes_outside_the_grid_are_not_free() {
        let space = FreeSpace::new(3, 2, |_, _| true);
        assert!(space.is_free(2, 1));
        assert!(!space.is_free(3, 0) && !space.is_free(0, 2) && !space.is_free(u32::MAX, 0));
    }

    #[test]
    fn only_free_boxes_of_a_map_are_free() {
        let map = GridMap::new(3, 1, 1.0, vec![Cell::Free, Cell::Wall, Cell::Unknown]);
        let space = FreeSpace::from_map(&map);
        assert_eq!([0, 1, 2].map(|col| space.is_free(col, 0)), [true, false, false]);
    }

    proptest! {
        #[test]
        fn a_window_has_the_free_boxes_of_its_place_and_none_beyond_the_grid(
            width in 1u32..90, height in 1u32..40, west in -40i32..95, south in -40i32..45,
            walls in any::<[u128; 2]>(),
        ) {
            let is_wall = |col: u32, row: u32| {
                let index = row * width + col;
                walls[0].rotate_right(index) & walls[1].rotate_right(index / 3) & 1 == 1
            };
            let space = FreeSpace::new(width, height, |col, row| !is_wall(col, row));
            let window = space.window::<20>(west, south);
            for (row, at_row) in (south..).take(20).enumerate() {
                for (col, at_col) in (west..).take(FREE_WINDOW_COLUMNS).enumerate() {
                    let is_free = space.is_free(at_col as u32, at_row as u32);
                    prop_assert_eq!(window.is_free(col, row), is_free, "{} {}", at_col, at_row);
                    prop_assert_eq!(window.row(row) >> col & 1 == 1, is_free);
                }
            }
        }

        #[test]
        fn an_anchor_is_a_box_whose_whole_square_is_free(
            width in 1u32..12, height in 1u32..12, size in 1u32..5, walls in any::<[u128; 2]>(),
        ) {
            let is_wall = |col: u32, row: u32| {
                let index = row * width + col;
                // Three of four boxes are free, so that squares of every size occur.
                walls[0].rotate_right(index) & 1 == 1 && walls[1].rotate_right(index) & 1 == 1
            };
            let space = FreeSpace::new(width, height, |col, row| !is_wall(col, row));
            let anchors = space.anchors(size);
            for (col, row) in (0..width).flat_map(|col| (0..height).map(move |row| (col, row))) {
                let square = (0..size).flat_map(|x| (0..size).map(move |y| (col + x, row + y)));
                let is_anchor = square.clone().all(|(x, y)| space.is_free(x, y));
                prop_assert_eq!(anchors.is_free(col, row), is_anchor);
            }
        }
    }
}
