//! A map as the program sees it: square boxes that are free, wall or unknown.
//!
//! Axes are those of ROS `map_server`: `x` (columns) runs east, `y` (rows) north, box (0, 0)
//! is the lower-left corner. Every importer turns its file into this one type.

mod grid;

mod components;
mod text;

pub use components::Components;
pub use grid::{Cell, CellCounts, GridMap, MAX_BOXES, Rect, UnknownPolicy};
pub(crate) use grid::{check_box_count, check_box_size};
