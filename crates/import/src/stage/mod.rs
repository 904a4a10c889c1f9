//! Worlds of the Stage simulator: `.world` files and the files that they include.
//!
//! ```text
//! files.rs        paths -> the text of all files
//! parse.rs        text -> items: include, define, models, properties
//! definitions.rs  a model -> all that it inherits, in the world's units
//! bitmap.rs       an image -> a floor plan
//! unused.rs       properties -> what is said of those that are not read
//! read.rs         items -> a world: floor plans, boxes, robots
//! ```
//!
//! The models that are read are obstacles and robots: a model with a `bitmap` is a floor plan, one
//! that descends from `position` a robot, every other one that descends from `model` a box of its
//! `size` (its `block` shapes are not used), unless neither a robot can hit it
//! (`obstacle_return 0`) nor a ranger detect it (`ranger_return` below 0). Models within models are
//! placed in the frame of their parents; those of a robot belong to it. Pixels of a bitmap whose first channel is 127
//! or less are solid, and their bounding box is stretched to the model's size, as in Stage (`polys_from_image_file`,
//! `BlockGroup::CalcSize`). A name stands for its definition at the place where it is used, the first of several
//! definitions holds, `unit_length` and `unit_angle` hold for the whole world, and paths are relative to the world's
//! folder. Everything else is named in [`World::report`].
//!
//! Lengths are meters, angles radians (degrees in the files, unless they say otherwise).

mod bitmap;
mod definitions;
mod files;
mod parse;
mod read;
#[cfg(test)]
mod tests;
mod unused;

use std::path::Path;

use crate::{ImportReport, extension};
use sidestep_kernel::InputError;

/// The maximum size of a file, in bytes.
pub const MAX_WORLD_BYTES: u64 = 1 << 24;

/// The content of a world.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct World {
    /// Bitmaps with their size and pose, in the order of the file.
    pub floor_plans: Vec<FloorPlan>,
    /// Boxes that are obstacles.
    pub boxes: Vec<BoxObstacle>,
    /// Robots.
    pub robots: Vec<Robot>,
    /// What of the files was not taken as it stood.
    pub report: ImportReport,
}

/// Position and heading of a model; `yaw_rad` is counterclockwise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose2 {
    /// Coordinate to the east, in meters.
    pub x_m: f64,
    /// Coordinate to the north, in meters.
    pub y_m: f64,
    /// Angle counterclockwise from east, in radians.
    pub yaw_rad: f64,
}

/// A bitmap that lies on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct FloorPlan {
    /// Its name; may be empty.
    pub name: String,
    /// Number of pixels in a row, from the first solid one to the last.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Whether each pixel is an obstacle, row by row from the bottom.
    pub solid: Vec<bool>,
    /// Its extent along rows and columns in meters; pixels need not be square.
    pub size_m: [f64; 2],
    /// The pose of its center.
    pub pose: Pose2,
    /// Whether it has a wall all around.
    pub has_boundary: bool,
}

/// A box.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxObstacle {
    /// Its name; may be empty.
    pub name: String,
    /// The pose of its center.
    pub pose: Pose2,
    /// Its extent along its own axes, in meters.
    pub size_m: [f64; 2],
}

/// A robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Its name; may be empty.
    pub name: String,
    /// The name of its model.
    pub kind: String,
    /// The initial pose of the point about which it rotates.
    pub pose: Pose2,
    /// Extent of its body in meters, lengthwise and sideways.
    pub size_m: [f64; 2],
    /// Radius in meters of the smallest disc around [`Self::pose`] that contains its body.
    pub radius_m: f64,
}

/// Reads a world, with all included files and its bitmaps. Their paths are relative to the folder of the world, or to
/// that of the file that names them.
///
/// # Errors
/// When the extension is neither `.world` nor `.inc` (included files may have another), a file
/// cannot be read, lies outside of the folder above the world's, includes itself, or has invalid syntax or values, with
/// file, line and column; when there are more than 1000 files, 100,000 models, or 64 levels of models within models.
pub fn load(path: &Path) -> Result<World, InputError> {
    extension::check(path, "a world of Stage", &["world", "inc"])?;
    read::world(path)
}
