//! What can be seen of a run, whatever its world: scenery that stays, and frames that come and go.
//!
//! Recordings for viewers, films and live pages draw from this and nothing else. A frame is
//! computed from the state when somebody asks; looking never changes a run. Lengths are meters,
//! x runs east, y north and z up; angles are radians, counter-clockwise.

use crate::units::Cycle;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A place in space; worlds of the plane have height 0.
pub type Place = [f64; 3];

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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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

/// Something that can be seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// What it is.
    pub kind: Kind,
    /// Which one of its kind.
    pub number: u32,
    /// Which part of it, of things that have parts.
    pub part: Option<u32>,
    /// Where it is and where it looks.
    pub pose: Pose,
    /// What it looks like.
    pub shape: Shape,
    /// How it is.
    pub state: Condition,
}

impl Body {
    /// A body without parts, in order.
    pub fn new(kind: Kind, number: u32, pose: Pose, shape: Shape) -> Self {
        Self { kind, number, part: None, pose, shape, state: Condition::Plain }
    }

    /// The same as a part of a larger thing.
    #[must_use]
    pub fn part(self, part: u32) -> Self {
        Self { part: Some(part), ..self }
    }

    /// The same in another condition, if `is_so`.
    #[must_use]
    pub fn when(self, is_so: bool, state: Condition) -> Self {
        if is_so { Self { state, ..self } } else { self }
    }

    /// A name that it keeps during the run, such as `robot/3` or `connector/0/7`.
    pub fn name(&self) -> String {
        match self.part {
            Some(part) => format!("{}/{}/{part}", self.kind, self.number),
            None => format!("{}/{}", self.kind, self.number),
        }
    }
}

/// Kinds of things.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A robot.
    Robot,
    /// A person, or something else that walks about.
    Person,
    /// A door.
    Door,
    /// A joint of a chain.
    Connector,
    /// The rods of a chain.
    Rods,
    /// An airplane.
    Airplane,
    /// What is to be kept free around an airplane.
    Zone,
    /// Something in the way.
    Obstacle,
    /// A place to go to.
    Goal,
}

impl Kind {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Robot => "robot",
            Self::Person => "person",
            Self::Door => "door",
            Self::Connector => "connector",
            Self::Rods => "rods",
            Self::Airplane => "airplane",
            Self::Zone => "zone",
            Self::Obstacle => "obstacle",
            Self::Goal => "goal",
        }
    }

    /// Whether it acts: what a table of trajectories is about.
    pub fn is_agent(self) -> bool {
        matches!(self, Self::Robot | Self::Connector | Self::Airplane)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// How a body is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Condition {
    /// Nothing special.
    Plain,
    /// Open, of doors.
    Open,
    /// Touches something, or is too near to somebody.
    Touching,
    /// Does not work any more.
    Failed,
}

/// Position and orientation of a body's middle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Where it is.
    pub at_m: Place,
    /// How it is turned: a unit quaternion x, y, z, w.
    pub turn: [f64; 4],
}

impl Pose {
    /// Somewhere, looking along x.
    pub fn at(at_m: Place) -> Self {
        Self { at_m, turn: [0.0, 0.0, 0.0, 1.0] }
    }

    /// Somewhere, turned about the upright axis.
    pub fn heading(at_m: Place, heading_rad: f64) -> Self {
        let half = 0.5 * heading_rad;
        Self { at_m, turn: [0.0, 0.0, crate::math::sin(half), crate::math::cos(half)] }
    }

    /// Somewhere, with these unit vectors, at right angles to each other and right-handed, as its
    /// axes.
    pub fn axes(at_m: Place, axes: [Place; 3]) -> Self {
        // Entry [row][column] of the rotation is axes[column][row].
        let m = |row: usize, column: usize| axes[column][row];
        let trace = m(0, 0) + m(1, 1) + m(2, 2);
        // The largest of the four components is computed first: the others divide by it.
        let largest = (0..3).max_by(|&a, &b| m(a, a).total_cmp(&m(b, b))).unwrap_or(0);
        let turn = if trace > m(largest, largest) {
            let w4 = 2.0 * (1.0 + trace).max(0.0).sqrt();
            let part = |i: usize, j: usize| (m(i, j) - m(j, i)) / w4;
            [part(2, 1), part(0, 2), part(1, 0), 0.25 * w4]
        } else {
            let (i, j, k) = (largest, (largest + 1) % 3, (largest + 2) % 3);
            let r4 = 2.0 * (1.0 + m(i, i) - m(j, j) - m(k, k)).max(0.0).sqrt();
            let mut turn = [0.0; 4];
            turn[i] = 0.25 * r4;
            turn[j] = (m(i, j) + m(j, i)) / r4;
            turn[k] = (m(i, k) + m(k, i)) / r4;
            turn[3] = (m(k, j) - m(j, k)) / r4;
            turn
        };
        Self { at_m, turn }
    }

    /// A vector of the body in the world.
    pub fn turned(&self, [x, y, z]: Place) -> Place {
        let [qx, qy, qz, w] = self.turn;
        // v + 2 q x (q x v + w v)
        let t = [2.0 * (qy * z - qz * y), 2.0 * (qz * x - qx * z), 2.0 * (qx * y - qy * x)];
        [
            x + w * t[0] + qy * t[2] - qz * t[1],
            y + w * t[1] + qz * t[0] - qx * t[2],
            z + w * t[2] + qx * t[1] - qy * t[0],
        ]
    }

    /// A point of the body in the world.
    pub fn place(&self, of_body: Place) -> Place {
        let turned = self.turned(of_body);
        std::array::from_fn(|i| self.at_m[i] + turned[i])
    }
}

/// What a body looks like, around its pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "type")]
pub enum Shape {
    /// A box.
    Cuboid {
        /// Its extent along its axes.
        size_m: Place,
    },
    /// An upright cylinder.
    Cylinder {
        /// Its radius.
        radius_m: f64,
        /// Its extent along its third axis.
        height_m: f64,
    },
    /// A ball.
    Sphere {
        /// Its radius.
        radius_m: f64,
    },
    /// A line from point to point; the points are those of the world, whatever the pose.
    Line {
        /// Its points.
        points_m: Vec<Place>,
        /// How thick it is; 0 for as thin as can be drawn.
        thickness_m: f64,
    },
    /// An arrowhead along its first axis.
    Dart {
        /// From tail to tip.
        length_m: f64,
        /// Across.
        width_m: f64,
    },
}

/// Ranges all around, or in a part of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// Whose: kind, number and part of a body of the frame.
    pub of: (Kind, u32, Option<u32>),
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

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// The cycle in which it happened.
    pub cycle: Cycle,
    /// How bad it is.
    pub level: Level,
    /// To whom: the name of a body.
    pub who: String,
    /// What, in words.
    pub words: String,
}

/// How bad something is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// As it should be.
    Info,
    /// Worth a look.
    Warning,
    /// What the run is meant to avoid.
    Error,
}

/// Events kept for the next frame, up to a number; later ones are counted.
#[derive(Debug, Clone)]
pub struct Log<E> {
    events: Vec<E>,
    left_out: u64,
    /// Whether anybody watches.
    pub is_kept: bool,
}

/// More events than this between two frames are only counted.
const MOST_EVENTS: usize = 10_000;

impl<E> Default for Log<E> {
    fn default() -> Self {
        Self { events: Vec::new(), left_out: 0, is_kept: false }
    }
}

impl<E> Log<E> {
    /// Keeps an event, if anybody watches.
    pub fn push(&mut self, event: E) {
        if !self.is_kept {
            return;
        }
        match self.events.len() < MOST_EVENTS {
            true => self.events.push(event),
            false => self.left_out += 1,
        }
    }

    /// All events since the last call, and how many were left out.
    pub fn take(&mut self) -> (Vec<E>, u64) {
        (std::mem::take(&mut self.events), std::mem::take(&mut self.left_out))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{cos, sin};
    use proptest::prelude::*;

    fn near(a: Place, b: Place) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    fn cross(a: Place, b: Place) -> Place {
        std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            a[j] * b[k] - a[k] * b[j]
        })
    }

    proptest! {
        #[test]
        fn a_pose_of_axes_turns_the_axes_of_the_world_into_them(
            yaw in -3.2..3.2f64, pitch in -1.6..1.6f64, roll in -3.2..3.2f64,
        ) {
            let x = [cos(yaw) * cos(pitch), sin(yaw) * cos(pitch), sin(pitch)];
            let level = [-sin(yaw), cos(yaw), 0.0];
            let up = cross(x, level);
            let y: Place = std::array::from_fn(|i| cos(roll) * level[i] + sin(roll) * up[i]);
            let z = cross(x, y);
            let pose = Pose::axes([1.0, 2.0, 3.0], [x, y, z]);
            let length: f64 = pose.turn.iter().map(|q| q * q).sum();
            prop_assert!((length - 1.0).abs() < 1e-9);
            for (axis, to) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().zip([x, y, z]) {
                prop_assert!(near(pose.turned(axis), to), "{axis:?}: {:?} {to:?}", pose.turned(axis));
            }
        }
    }

    #[test]
    fn a_heading_turns_to_the_left() {
        let pose = Pose::heading([1.0, 1.0, 0.0], 0.5 * std::f64::consts::PI);
        assert!(near(pose.place([2.0, 0.0, 0.0]), [1.0, 3.0, 0.0]));
    }

    #[test]
    fn a_log_keeps_nothing_unless_somebody_watches_and_counts_what_is_too_much() {
        let mut log = Log::default();
        log.push(1);
        assert_eq!(log.take(), (vec![], 0));
        log.is_kept = true;
        (0..MOST_EVENTS + 3).for_each(|k| log.push(k));
        let (kept, left_out) = log.take();
        assert_eq!((kept.len(), left_out), (MOST_EVENTS, 3));
        assert_eq!(log.take(), (vec![], 0));
    }

    #[test]
    fn names_tell_kind_number_and_part() {
        let ball = Shape::Sphere { radius_m: 1.0 };
        let body = Body::new(Kind::Connector, 2, Pose::at([0.0; 3]), ball);
        assert_eq!(body.name(), "connector/2");
        assert_eq!(body.part(7).name(), "connector/2/7");
    }
}
