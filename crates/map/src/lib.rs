#![deny(clippy::disallowed_methods)]
//! Floors of square boxes that are free, wall or unknown, and paths on them.
//!
//! Axes are those of ROS `map_server`: `x` (columns) points east, `y` (rows) north, box (0, 0)
//! is the lower-left corner. Every importer converts its file into this one type.

mod components;
mod grid;
pub mod office;
pub mod planning;
mod text;

pub use components::Components;
pub use grid::{
    Cell, CellCounts, GridMap, MAX_BOXES, Rect, UnknownPolicy, check_box_count, check_box_size,
};
