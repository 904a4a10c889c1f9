//! The visible part of a run, whatever its world: constant scenery, and frames of single moments.
//!
//! Recordings for viewers, films and live pages draw from this and nothing else. A frame is
//! computed from the state on request; looking never changes a run. Lengths are meters, x runs
//! east, y north and z up; angles are radians, counterclockwise.

mod appearance;
mod body;
mod log;
mod pose;
mod trails;

pub use appearance::{ALERT, Appearance, COLORS, Color, DOOR, MOBILE, UNKNOWN, WALL, color_of};
pub use body::{Body, Condition, Kind, Shape, Who};
pub use log::{Entry, Level, Log};
pub use pose::{Place, Plane, Pose};
pub use trails::{Axis, PlaceRows, Trail, corner};

use crate::units::Cycle;
use serde::{Deserialize, Serialize};

/// Everything that stays as it is during a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scenery {
    /// The scenario's name.
    pub name: String,
    /// 2 where everything lies in a plane, else 3.
    pub dimensions: u8,
    /// Simulated seconds per cycle.
    pub cycle_s: f64,
    /// The floor, where it is known box by box.
    pub floor: Option<Floor>,
    /// Walls, obstacles that stand still, starts and goals.
    pub bodies: Vec<Body>,
    /// Names of bodies that have their own, by kind and number.
    pub names: Vec<(Kind, u32, String)>,
}

/// A floor of square boxes, along the axes of its own plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Floor {
    /// Boxes along the first axis: from west to east, where the floor is not turned.
    pub width: u32,
    /// Boxes along the second axis: from south to north, where the floor is not turned.
    pub height: u32,
    /// Side of a box, in meters.
    pub box_m: f64,
    /// The corner of the first box, and the turn about it.
    pub plane: Plane,
    /// The content of each box, row by row from the first.
    pub boxes: Vec<Occupancy>,
}

impl Floor {
    /// Returns the corners of the floor in the world, counterclockwise from the first box's.
    pub fn corners_m(&self) -> [[f64; 2]; 4] {
        let [x, y] = [self.width, self.height].map(|boxes| f64::from(boxes) * self.box_m);
        [[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]].map(|point| self.plane.place(point))
    }
}

/// The content of a box of the floor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Occupancy {
    /// Nothing stands there.
    Free,
    /// A wall.
    Wall,
    /// Nobody has mapped it.
    Unknown,
}

/// The bodies, scans and events of one moment.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Cycles done: the frame shows the start of this cycle.
    pub cycle: Cycle,
    /// Simulated seconds since the start.
    pub time_s: f64,
    /// Everything that can move, in an order that is the same in all frames.
    pub bodies: Vec<Body>,
    /// The present readings of sensors.
    pub scans: Vec<Scan>,
    /// The events since the frame before, by time.
    pub log: Vec<Entry>,
    /// Entries that were left out because there were too many.
    pub log_left_out: u64,
}

/// The options of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Look {
    /// The maximum number of bodies with scans; reading sensors costs as much as simulating them.
    pub scanning_bodies: usize,
}

impl Look {
    /// A frame with bodies and events, without scans.
    pub const BODIES: Self = Self { scanning_bodies: 0 };
}

/// Ranges of one sensor, all around or in a sector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// The body with the sensor: kind, number and part.
    pub of: Who,
    /// The sensor's name.
    pub sensor: String,
    /// The sensor's position, and the direction of its bearing 0.
    pub pose: Pose,
    /// Bearing of each beam, in radians.
    pub bearings_rad: Vec<f64>,
    /// Range of each beam in meters, from the pose; infinite where there is nothing in range.
    pub ranges_m: Vec<f64>,
    /// The maximum range, in meters.
    pub range_m: f64,
}

impl Scan {
    /// Returns the name of the body with the sensor, followed by the sensor's.
    pub fn name(&self) -> String {
        let (kind, number, part) = self.of;
        let of = match part {
            Some(part) => format!("{kind}/{number}/{part}"),
            None => format!("{kind}/{number}"),
        };
        format!("{of}/{}", self.sensor)
    }
}
