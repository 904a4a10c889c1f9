//! Everything visible: the static scene, the table of moving bodies, and the text of frames.

use super::{BodyId, SessionId, Traffic};
use serde::Serialize;

/// The scene, which stays the same.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Scene {
    /// The scenario's name; may be empty.
    pub name: String,
    /// The world's name.
    pub world: String,
    /// The noun for an agent, e.g. `robot`.
    pub agent: String,
    /// 2 where everything lies in a plane, else 3.
    pub dimensions: u8,
    /// Simulated seconds per cycle.
    pub cycle_s: f64,
    /// The floor, where it is known box by box.
    pub floor: Option<OccupancyGrid>,
    /// Walls, obstacles at rest, starts and goals.
    pub bodies: Vec<StaticBody>,
    /// Agents that the scenario describes together.
    pub groups: Vec<SceneGroup>,
    /// The names of all bodies that have some, also of those that are not there yet, or gone.
    pub names: Vec<BodyName>,
    /// Whether a recorded run is computed again.
    pub is_recording: bool,
    /// What a plan view shows of traffic; none where the scene is no traffic.
    pub traffic: Option<Traffic>,
}

/// The name of a body, which all its parts share.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct BodyName {
    /// Its kind.
    pub kind: String,
    /// Its number among the bodies of its kind.
    pub number: u32,
    /// Its name.
    pub name: String,
}

/// Agents that the scenario describes together, such as couriers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SceneGroup {
    /// Their name.
    pub name: String,
    /// Their kind.
    pub kind: String,
    /// The number of the first of them.
    pub first: u32,
    /// How many they are; their numbers follow each other.
    pub count: u32,
}

/// A floor of square boxes, along the axes of its own plane.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct OccupancyGrid {
    /// Boxes along the first axis.
    pub width: u32,
    /// Boxes along the second axis.
    pub height: u32,
    /// Side of a box, in meters.
    pub box_m: f64,
    /// The corner of the first box.
    pub origin_m: [f64; 2],
    /// The turn about that corner.
    pub yaw_rad: f64,
    /// Runs of equal boxes, row by row from the first: `[code, count, code, count, ...]`; 0 free, 1 wall, 2 unknown.
    pub runs: Vec<u32>,
}

/// A body that never moves.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct StaticBody {
    /// The body.
    pub id: BodyId,
    /// Its own name, if it has one.
    pub name: Option<String>,
    /// Its place, in meters.
    pub at_m: [f64; 3],
    /// Its orientation: a unit quaternion x, y, z, w.
    pub orientation: [f64; 4],
    /// Its shape.
    pub shape: Shape,
    /// Its appearance.
    pub appearance: Appearance,
}

/// The shape of a body, around its pose.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "type", rename_all = "lowercase")]
pub enum Shape {
    /// A box.
    Cuboid {
        /// Its extent along its axes, in meters.
        size_m: [f64; 3],
    },
    /// An upright cylinder.
    Cylinder {
        /// Its radius, in meters.
        radius_m: f64,
        /// Its extent along its third axis, in meters.
        height_m: f64,
    },
    /// A ball.
    Sphere {
        /// Its radius, in meters.
        radius_m: f64,
    },
    /// A polyline; its points are in the frame of the world, regardless of the pose.
    Line {
        /// Its points, in meters; none for moving bodies, because the frames have them.
        points_m: Vec<[f64; 3]>,
        /// Its thickness in meters; 0 for the thinnest line that can be drawn.
        thickness_m: f64,
    },
    /// An arrowhead along its first axis.
    Dart {
        /// Length from tail to tip, in meters.
        length_m: f64,
        /// Width, in meters.
        width_m: f64,
    },
}

/// The appearance of a body, apart from its shape. Colors per condition come from the one table of the kernel.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Appearance {
    /// Red, green and blue.
    pub color: [u8; 3],
    /// Opacity, from 0 (fully transparent) to 1 (opaque).
    pub opacity: f64,
    /// Seen from above, higher layers cover lower ones.
    pub layer: u8,
}

/// Bodies that move, in columns: body i is `kinds[kind[i]]`, `number[i]`, `part[i]` (-1: none), `shapes[shape[i]]`,
/// `appearances[appearance[i]]`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct BodyTable {
    /// The session.
    pub session: SessionId,
    /// Its number, to which frames refer.
    pub id: u32,
    /// The names of kinds.
    pub kinds: Vec<String>,
    /// The kind of each body.
    pub kind: Vec<u8>,
    /// The number of each body among those of its kind.
    pub number: Vec<u32>,
    /// The part that each body is.
    pub part: Vec<i32>,
    /// Shapes; of a line without its points, which are in the frames.
    pub shapes: Vec<Shape>,
    /// The shape of each body.
    pub shape: Vec<u32>,
    /// Appearances, each for the five conditions.
    pub appearances: Vec<[Appearance; 5]>,
    /// The appearance of each body.
    pub appearance: Vec<u16>,
    /// Names of the bodies that have one: index of the body, name.
    pub names: Vec<(u32, String)>,
    /// The bodies that are agents, which can be inspected.
    pub is_agent: Vec<bool>,
}

/// The text at the end of a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct FrameText {
    /// The scans of the selected bodies.
    pub scans: Vec<Scan>,
    /// The last events since the frame before.
    pub events: Vec<RunEvent>,
    /// Number of events since the frame before that are not here.
    pub events_left_out: u64,
}

/// Ranges of one sensor.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Scan {
    /// The body with the sensor.
    pub body: BodyId,
    /// The sensor's name.
    pub sensor: String,
    /// The sensor's place, in meters.
    pub at_m: [f64; 3],
    /// The direction of its bearing 0: a unit quaternion x, y, z, w.
    pub orientation: [f64; 4],
    /// Bearing of each beam, in radians.
    pub bearings_rad: Vec<f64>,
    /// Range of each beam in meters, as reported; null: nothing in range.
    pub ranges_m: Vec<Option<f64>>,
    /// The true range of each beam in meters; empty where the world does not give it.
    pub true_m: Vec<Option<f64>>,
    /// The maximum range, in meters.
    pub range_m: f64,
}

/// An event of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct RunEvent {
    /// The cycle in which it happened.
    pub cycle: f64,
    /// `info`, `warning` or `error`.
    pub level: String,
    /// A word of the fixed vocabulary of events, e.g. `contact`, `veto`, `trip`; empty where the world gives none.
    pub kind: String,
    /// The body concerned.
    pub body: Option<BodyId>,
    /// The other body or thing that took part, if any.
    pub other: Option<BodyId>,
    /// Its place, in meters.
    pub at_m: Option<[f64; 3]>,
    /// Its value, if it has one.
    pub value: Option<f64>,
    /// The value's unit; may be empty.
    pub unit: String,
    /// The event as text.
    pub text: String,
}
