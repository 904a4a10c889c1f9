//! What can be seen of a run, whatever its world: scenery that stays, and frames that come and go.
//!
//! Recordings for viewers, films and live pages draw from this and nothing else. A frame is
//! computed from the state when somebody asks; looking never changes a run. Lengths are meters,
//! x runs east, y north and z up; angles are radians, counter-clockwise.

mod appearance;
mod body;
mod log;
mod pose;
mod trails;

pub use appearance::{ALERT, Appearance, COLORS, Color, DOOR, MOBILE, UNKNOWN, WALL, color_of};
pub use body::{Body, Condition, Kind, Shape, Who};
pub use log::{Entry, Level, Log};
pub use pose::{Place, Pose};
pub use trails::{Axis, PlaceRows, Trail, corner};

use crate::units::Cycle;
use serde::{Deserialize, Serialize};

/// What stays as it is during a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scenery {
    /// The scenario's name.
    pub name: String,
    /// 2 where all lies in a plane, else 3.
    pub dimensions: u8,
    /// Seconds that a cycle stands for.
    pub cycle_s: f64,
    /// The floor, where it is known box by box.
    pub floor: Option<Floor>,
    /// Walls, obstacles that stand still, places to go to.
    pub bodies: Vec<Body>,
    /// Names of things that have one of their own, by kind and number.
    pub names: Vec<(Kind, u32, String)>,
}

/// A floor of square boxes along the axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Floor {
    /// Boxes from west to east.
    pub width: u32,
    /// Boxes from south to north.
    pub height: u32,
    /// Side of a box.
    pub box_m: f64,
    /// The lower-left corner of the first box.
    pub origin_m: [f64; 2],
    /// What is in each box, row by row from the south.
    pub boxes: Vec<Occupancy>,
}

/// What a box of the floor is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Occupancy {
    /// Nothing stands there.
    Free,
    /// A wall.
    Wall,
    /// Nobody has seen it.
    Unknown,
}

/// The present moment.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Cycles done: this is how things are at the beginning of this cycle.
    pub cycle: Cycle,
    /// Simulated seconds since the start.
    pub time_s: f64,
    /// Everything that can move, in an order that stays.
    pub bodies: Vec<Body>,
    /// What sensors see just now.
    pub scans: Vec<Scan>,
    /// What happened since the frame before, by time.
    pub log: Vec<Entry>,
    /// Entries that were left out because there were too many.
    pub log_left_out: u64,
}

/// How much a frame is to hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Look {
    /// Scans of at most so many bodies; reading sensors costs as much as simulating them.
    pub scanning_bodies: usize,
}

impl Look {
    /// Bodies and events.
    pub const BODIES: Self = Self { scanning_bodies: 0 };
}

/// Ranges all around, or in a part of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// Whose: kind, number and part of a body of the frame.
    pub of: Who,
    /// The sensor's name.
    pub sensor: String,
    /// Where the sensor is and where its bearing 0 looks.
    pub pose: Pose,
    /// Bearing of each beam.
    pub bearings_rad: Vec<f64>,
    /// How far each sees, from the pose; infinite where there is nothing in range.
    pub ranges_m: Vec<f64>,
    /// The farthest that it can see.
    pub range_m: f64,
}

impl Scan {
    /// The name of the body with the sensor, then the sensor's.
    pub fn name(&self) -> String {
        let (kind, number, part) = self.of;
        let of = match part {
            Some(part) => format!("{kind}/{number}/{part}"),
            None => format!("{kind}/{number}"),
        };
        format!("{of}/{}", self.sensor)
    }
}
