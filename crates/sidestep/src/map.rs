//! A map as the program sees it: square boxes that are free, wall or unknown.

use serde::{Deserialize, Serialize};

/// What a box of a map is before any body stands in it.
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

/// A rectangle of boxes. `x` runs east, `y` north; box (0, 0) is the lower-left corner.
#[derive(Debug, Clone, PartialEq)]
pub struct GridMap {
    width: u32,
    height: u32,
    /// Side of a box in metres.
    pub box_size_m: f64,
    /// World position of the lower-left corner of box (0, 0), in metres.
    pub origin_m: [f64; 2],
    /// Row by row from the bottom; length `width * height`.
    cells: Vec<Cell>,
}

impl GridMap {
    /// A map of `width` x `height` boxes; `cells` holds them row by row from the bottom.
    ///
    /// # Panics
    /// When `cells` has another length than `width * height`.
    pub fn new(width: u32, height: u32, box_size_m: f64, cells: Vec<Cell>) -> Self {
        assert_eq!(cells.len(), width as usize * height as usize, "one cell per box");
        Self { width, height, box_size_m, origin_m: [0.0, 0.0], cells }
    }

    /// Boxes from west to east.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Boxes from south to north.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The box in column `col` (from the west) and row `row` (from the south).
    pub fn cell(&self, col: u32, row: u32) -> Cell {
        self.cells[(row as usize) * self.width as usize + col as usize]
    }

    /// All boxes, row by row from the bottom.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Number of boxes that are `cell`.
    pub fn count(&self, cell: Cell) -> usize {
        self.cells.iter().filter(|&&c| c == cell).count()
    }
}
