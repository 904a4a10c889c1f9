//! Worlds of the Stage simulator: `.world` files and what they include.
//!
//! ```text
//! parse.rs   text -> items: include, define, models, properties
//! read.rs    items -> a world: floor plans, boxes, robots
//! ```
//!
//! Read are the models that stand in the way and the robots: a model with a `bitmap` is a floor
//! plan, one that descends from `position` a robot, every other one that descends from `model` a
//! box of its `size` (its `block` shapes are not used), unless neither a robot can hit it
//! (`obstacle_return 0`) nor a ranger see it (`ranger_return` below 0). Models in models stand
//! where their parents say; those of a robot are its own. What a bitmap shows is stretched to the
//! model's size; pixels of brightness 127 and less are solid, as in Stage. Everything else is
//! counted in [`World::not_used`].
//!
//! Lengths are meters, angles radians (degrees in the files).

mod parse;
mod read;
#[cfg(test)]
mod tests;

use std::path::Path;

use sidestep_kernel::InputError;

/// The longest file that is read, in bytes.
pub const MAX_WORLD_BYTES: u64 = 1 << 24;

/// What a world holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct World {
    /// Bitmaps with their size and place, in the order of the file.
    pub floor_plans: Vec<FloorPlan>,
    /// Boxes in the way.
    pub boxes: Vec<Body>,
    /// Robots.
    pub robots: Vec<Robot>,
    /// Properties and kinds of models that were passed over, by name, and how often.
    pub not_used: Vec<(String, usize)>,
}

/// Where a model is, and how it is turned: `yaw_rad` counter-clockwise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose {
    /// East.
    pub x_m: f64,
    /// North.
    pub y_m: f64,
    /// Counter-clockwise from east.
    pub yaw_rad: f64,
}

/// A bitmap that lies on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct FloorPlan {
    /// Its name; may be empty.
    pub name: String,
    /// Pixels along a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row by row from the bottom: whether a pixel is in the way.
    pub solid: Vec<bool>,
    /// Its extent along rows and across; pixels may be longer than wide.
    pub size_m: [f64; 2],
    /// Its middle.
    pub pose: Pose,
    /// Whether it has a wall all around.
    pub has_boundary: bool,
}

/// A box.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Its name; may be empty.
    pub name: String,
    /// Its middle.
    pub pose: Pose,
    /// Its extent along its own axes.
    pub size_m: [f64; 2],
}

/// A robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Its name; may be empty.
    pub name: String,
    /// The name of its model.
    pub kind: String,
    /// Where it starts: the point about which it turns.
    pub pose: Pose,
    /// Extent of its body, ahead and across.
    pub size_m: [f64; 2],
    /// Radius of the least disc around [`Self::pose`] that holds its body.
    pub radius_m: f64,
}

/// Reads a world, with all that it includes and its bitmaps; their paths are relative to the file
/// that names them.
///
/// # Errors
/// Files that cannot be read, wrong syntax, wrong values: with file, line and column. Files that
/// include themselves; more than 1000 files, 100,000 models, or 64 models in each other.
pub fn load(path: &Path) -> Result<World, InputError> {
    read::world(path)
}
