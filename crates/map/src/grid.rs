//! The grid itself: cells, rectangles of boxes, and the limits of every map.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_kernel::view::{Isometry2, Occupancy, OccupancyGrid};

/// The maximum number of boxes of a map. A larger number is probably a mistake (a resolution in
/// millimeters, a size in the wrong unit) and refused before memory is allocated.
pub const MAX_BOXES: u64 = 1 << 26;

/// The content of a box of a map before any body stands in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Cell {
    /// No covered pixel is occupied or unknown.
    Free,
    /// At least one covered pixel is occupied.
    Wall,
    /// None is occupied, at least one is unknown.
    Unknown,
}

/// The treatment of unmapped boxes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum UnknownPolicy {
    /// Unknown boxes are walls, because a path must not lead through unmapped space.
    #[default]
    Wall,
    /// Unknown boxes are free.
    Free,
    /// Unknown boxes stay unknown.
    Keep,
}

impl UnknownPolicy {
    /// Returns `cell` under this policy; free boxes and walls are left as they are.
    pub fn apply(self, cell: Cell) -> Cell {
        match (cell, self) {
            (Cell::Unknown, Self::Wall) => Cell::Wall,
            (Cell::Unknown, Self::Free) => Cell::Free,
            _ => cell,
        }
    }
}

/// The number of boxes of each type; the three add up to the number of boxes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CellCounts {
    /// Number of boxes where a body may stand.
    pub free: usize,
    /// Number of boxes with an occupied pixel, or one that a drawing or a generator makes a wall.
    pub wall: usize,
    /// Number of boxes that were not mapped and have no occupied pixel.
    pub unknown: usize,
}

impl CellCounts {
    /// Counts each type in one pass.
    pub fn from_cells(cells: &[Cell]) -> Self {
        let mut counts = Self::default();
        for cell in cells {
            match cell {
                Cell::Free => counts.free += 1,
                Cell::Wall => counts.wall += 1,
                Cell::Unknown => counts.unknown += 1,
            }
        }
        counts
    }
}

/// A rectangle of boxes, all of them inside its map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Rect {
    /// Westernmost column.
    pub col: u32,
    /// Southernmost row.
    pub row: u32,
    /// Boxes from west to east, at least 1.
    pub width: u32,
    /// Boxes from south to north, at least 1.
    pub height: u32,
}

impl Rect {
    /// Returns whether the box in column `col` and row `row` is inside this rectangle.
    pub fn contains(&self, col: u32, row: u32) -> bool {
        // Differences, because a sum of start and length may overflow.
        col >= self.col
            && row >= self.row
            && col - self.col < self.width
            && row - self.row < self.height
    }
}

/// A rectangle of boxes; box (0, 0) is the lower-left corner. `x` points east and `y` north, except on
/// a map with a rotated plane: there they are the axes of its image.
#[derive(Debug, Clone, PartialEq)]
pub struct GridMap {
    width: u32,
    height: u32,
    /// Side of a box in meters.
    pub box_size_m: f64,
    /// The position of the lower-left corner of box (0, 0) in the world, and the rotation about it.
    pub plane: Isometry2,
    /// Row by row from the bottom; length `width * height`.
    cells: Vec<Cell>,
}

impl GridMap {
    /// Creates a map of `width` x `height` boxes; `cells` holds them row by row from the bottom.
    /// Its lower-left corner is the origin of the world.
    ///
    /// # Panics
    /// When `cells` has another length than `width * height`.
    pub fn new(width: u32, height: u32, box_size_m: f64, cells: Vec<Cell>) -> Self {
        assert_eq!(cells.len(), width as usize * height as usize, "one cell per box");
        Self { width, height, box_size_m, plane: Isometry2::default(), cells }
    }

    /// Returns the map as the floor of a scenery.
    pub fn occupancy_grid(&self) -> OccupancyGrid {
        let occupancy = self.cells.iter().map(|cell| match cell {
            Cell::Free => Occupancy::Free,
            Cell::Wall => Occupancy::Wall,
            Cell::Unknown => Occupancy::Unknown,
        });
        OccupancyGrid {
            width: self.width,
            height: self.height,
            box_m: self.box_size_m,
            plane: self.plane,
            boxes: occupancy.collect(),
        }
    }

    /// Returns the same map with another pose in the world.
    #[must_use]
    pub fn with_plane(mut self, plane: Isometry2) -> Self {
        self.plane = plane;
        self
    }

    /// Returns the same map with `policy` applied to its unknown boxes.
    #[must_use]
    pub fn with_unknown(mut self, policy: UnknownPolicy) -> Self {
        for cell in &mut self.cells {
            *cell = policy.apply(*cell);
        }
        self
    }

    /// Boxes from west to east.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Boxes from south to north.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Returns the box in column `col` (from the west) and row `row` (from the south).
    ///
    /// # Panics
    /// When the box is outside the map.
    pub fn cell(&self, col: u32, row: u32) -> Cell {
        assert!(col < self.width, "column {col} of a map of {} columns", self.width);
        self.cells[(row as usize) * self.width as usize + col as usize]
    }

    /// Returns all boxes, row by row from the bottom.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Returns the number of boxes that are `cell`.
    pub fn count(&self, cell: Cell) -> usize {
        self.cells.iter().filter(|&&c| c == cell).count()
    }

    /// Returns the number of boxes of each type.
    pub fn counts(&self) -> CellCounts {
        CellCounts::from_cells(&self.cells)
    }
}

/// Checks `width` x `height` as the size of a map.
///
/// # Errors
/// When there is no box at all, or more than [`MAX_BOXES`].
pub fn check_box_count(
    place: impl fmt::Display,
    width: u64,
    height: u64,
) -> Result<(u32, u32), InputError> {
    let boxes = width.saturating_mul(height);
    if boxes == 0 {
        let cause = format!("a map of {width} x {height} boxes has no box");
        return Err(InputError::new(place, cause, "give the map at least one box"));
    }
    match (u32::try_from(width), u32::try_from(height)) {
        (Ok(width), Ok(height)) if boxes <= MAX_BOXES => Ok((width, height)),
        _ => Err(InputError::new(
            place,
            format!("a map of {width} x {height} boxes is more than the {MAX_BOXES} allowed"),
            "use larger boxes or a smaller map, and check the units (meters)",
        )),
    }
}

/// Checks `box_size_m` as the side of a box, in meters.
///
/// # Errors
/// When it is not a positive number of meters.
pub fn check_box_size(box_size_m: f64) -> Result<f64, InputError> {
    if box_size_m.is_finite() && box_size_m > 0.0 {
        return Ok(box_size_m);
    }
    let cause = format!("a box with a side of {box_size_m} m");
    Err(InputError::new("box_size_m", cause, "give a positive number of meters, such as 0.25"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn three_cells() -> GridMap {
        GridMap::new(3, 1, 0.5, vec![Cell::Free, Cell::Wall, Cell::Unknown])
    }

    #[test]
    fn a_policy_changes_unknown_boxes_only() {
        let cells = |policy| three_cells().with_unknown(policy).cells().to_vec();
        assert_eq!(cells(UnknownPolicy::Wall), [Cell::Free, Cell::Wall, Cell::Wall]);
        assert_eq!(cells(UnknownPolicy::Free), [Cell::Free, Cell::Wall, Cell::Free]);
        assert_eq!(cells(UnknownPolicy::Keep), [Cell::Free, Cell::Wall, Cell::Unknown]);
        assert_eq!(UnknownPolicy::default(), UnknownPolicy::Wall);
    }

    #[test]
    fn counts_tell_every_sort_of_box() {
        assert_eq!(three_cells().counts(), CellCounts { free: 1, wall: 1, unknown: 1 });
        assert_eq!(three_cells().count(Cell::Wall), 1);
    }

    #[test]
    fn a_rectangle_contains_its_boxes_and_no_other() {
        let rect = Rect { col: 2, row: 3, width: 2, height: 1 };
        assert!(rect.contains(2, 3) && rect.contains(3, 3));
        assert!(!rect.contains(1, 3) && !rect.contains(4, 3) && !rect.contains(2, 4));
    }

    #[test]
    fn empty_and_absurd_sizes_are_refused() {
        assert!(check_box_count("m", 0, 5).is_err());
        assert!(check_box_count("m", u64::MAX, 2).is_err());
        assert!(check_box_count("m", 1 << 26, 2).is_err());
        assert_eq!(check_box_count("m", 1 << 13, 1 << 13), Ok((1 << 13, 1 << 13)));
    }

    #[test]
    fn a_box_has_a_positive_side() {
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(check_box_size(wrong).is_err(), "{wrong}");
        }
        assert_eq!(check_box_size(0.25), Ok(0.25));
    }
}
