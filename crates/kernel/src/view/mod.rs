//! The visible part of a run of any world: constant scenery, and frames of single moments.
//!
//! Recordings for viewers, animations and live pages are made from this alone. A frame is
//! computed from the state on request, which never changes a run. Lengths are meters, x points
//! east, y north and z up; angles are radians, counterclockwise.

mod appearance;
mod body;
mod color;
mod earth;
mod grid_team;
mod group;
mod inspect;
mod kind;
mod log;
mod pose;
mod traffic;
mod trails;

pub use appearance::Appearance;
pub use body::{Body, BodyCondition, BodyId, Shape};
pub use color::{
    ALERT_COLOR, BODY_COLORS, Color, DOOR_COLOR, MOBILE_COLOR, UNKNOWN_COLOR, WALL_COLOR,
    body_color,
};
pub use earth::{EarthChart, EarthProjection, EarthReference};
pub use grid_team::{GridAgent, GridPlace, GridTask, GridTeam};
pub use group::{AgentGroup, AgentNumber};
pub use inspect::{Fact, FactSection, FactTable, FactValue, Inspection, Mark, MarkRole, MarkShape};
pub use kind::{BodyKind, BodyRole, KindSpec, Kinds, LegendTexts, Outline, Paint, TrailStyle};
pub use log::{EventBuffer, LogEvent, LogEventKind, Quantity, Severity};
pub use pose::{CachedIsometry2, Isometry2, Pose, Vec3};
pub use traffic::{AreaLevels, Route, TrafficPlan};
pub use trails::{CoordinateColumn, PositionTableColumns, Trail, corner_of_move};

use crate::units::Cycle;
use serde::{Deserialize, Serialize};

/// Everything that stays the same during a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scenery {
    /// The scenario's name.
    pub name: String,
    /// 2 where everything lies in a plane, else 3.
    pub dimensions: u8,
    /// Simulated seconds per cycle.
    pub cycle_s: f64,
    /// The floor, where it is known box by box.
    pub floor: Option<OccupancyGrid>,
    /// Walls, obstacles that stand still, starts and goals.
    pub bodies: Vec<Body>,
    /// Names of bodies that have their own, by kind and number.
    pub names: Vec<(BodyKind, u32, String)>,
    /// Agents that the scenario describes together, by rising number; none in worlds without groups.
    #[serde(default)]
    pub groups: Vec<AgentGroup>,
    /// Where on earth, and when, all this is.
    pub earth: EarthReference,
    /// What maps show of traffic beside bodies; none where a scene is no traffic.
    #[serde(default)]
    pub traffic: Option<TrafficPlan>,
}

/// A floor of square boxes, along the axes of its own plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OccupancyGrid {
    /// Boxes along the first axis: from west to east, where the floor is not rotated.
    pub width: u32,
    /// Boxes along the second axis: from south to north, where the floor is not rotated.
    pub height: u32,
    /// Side of a box, in meters.
    pub box_m: f64,
    /// The corner of the first box, and the rotation about it.
    pub plane: Isometry2,
    /// The content of each box, row by row from the first.
    pub boxes: Vec<Occupancy>,
}

impl OccupancyGrid {
    /// Returns the corners of the floor in the world, counterclockwise from the first box's.
    pub fn corners_m(&self) -> [[f64; 2]; 4] {
        let [x, y] = [self.width, self.height].map(|boxes| f64::from(boxes) * self.box_m);
        [[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]].map(|point| self.plane.transform_point(point))
    }
}

/// The content of a box of the floor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Occupancy {
    /// Only bodies of the frame may stand there.
    Free,
    /// A wall, which no body enters.
    Wall,
    /// Not mapped.
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
    /// The poses of bodies by wheel odometry, each relative to the body's pose when odometry was enabled; none in
    /// worlds without odometry.
    #[serde(default)]
    pub odometry: Vec<(BodyId, Pose)>,
    /// The values of joints by their encoders, which are enabled with odometry; none in worlds without arms.
    #[serde(default)]
    pub joints: Vec<JointValues>,
    /// The events since the previous frame, by time.
    pub log: Vec<LogEvent>,
    /// Number of events that were dropped because there were too many.
    pub log_left_out: u64,
}

/// The values of the joints of one arm at one moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointValues {
    /// The number of the body that the arm is.
    pub number: u32,
    /// The names of its joints, from base to tip.
    pub names: Vec<String>,
    /// Their values in the same order, rad or m.
    pub values: Vec<f64>,
}

/// The parts of a frame that are made on request, because they take time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameOptions {
    /// The bodies whose scans the frame has. All would be slow: reading a sensor for a frame costs as much as simulating
    /// it.
    pub scans: ScanSelection,
}

impl FrameOptions {
    /// A frame with bodies and events, without scans.
    pub const WITHOUT_SCANS: Self = Self::with_first_scans(0);

    /// Returns a frame with the scans of the first `bodies` of those that have sensors.
    pub const fn with_first_scans(bodies: usize) -> Self {
        Self { scans: ScanSelection::First(bodies) }
    }

    /// Returns a frame with the scans of these bodies, as far as they have sensors.
    pub fn with_scans_of(bodies: Vec<BodyId>) -> Self {
        Self { scans: ScanSelection::Of(bodies) }
    }
}

/// The bodies whose scans a frame has.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScanSelection {
    /// This number of bodies, the first ones that have sensors.
    First(usize),
    /// These, in this order; those without sensors are left out.
    Of(Vec<BodyId>),
}

/// Largest deviation in rad of a beam's bearing from equal steps: rounding errors of bearings from degrees are smaller.
const EVEN_TOLERANCE_RAD: f64 = 1e-6;
/// Step in rad of the raster for beams that are not evenly spaced: one degree, as many range finders have.
const RASTER_STEP_RAD: f64 = std::f64::consts::PI / 180.0;

/// Ranges of one sensor, all around or in a sector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// The body with the sensor: kind, number and part.
    pub of: BodyId,
    /// The sensor's name.
    pub sensor: String,
    /// The sensor's position, and the direction of its bearing 0.
    pub pose: Pose,
    /// Bearing of each beam, in radians.
    pub bearings_rad: Vec<f64>,
    /// Range of each beam in meters, from the pose; infinite where there is nothing in range.
    pub ranges_m: Vec<f64>,
    /// Range of each beam without errors; empty where the world does not give it.
    #[serde(default)]
    pub true_m: Vec<f64>,
    /// The maximum range, in meters.
    pub range_m: f64,
}

impl Scan {
    /// Returns the name of the body with the sensor, followed by the sensor's.
    pub fn name(&self) -> String {
        format!("{}/{}", self.of, self.sensor)
    }

    /// Returns the first and last bearing, and ranges at equal steps between them, as laser scans of ROS and Foxglove
    /// require. Beams that are not evenly spaced are put into a raster of degrees, in which directions without a beam
    /// have the range `no_beam`.
    pub fn resample_evenly(&self, no_beam: f64) -> (f64, f64, Vec<f64>) {
        let Self { bearings_rad, ranges_m, .. } = self;
        let (Some(&first), Some(&last)) = (bearings_rad.first(), bearings_rad.last()) else {
            return (0.0, 0.0, Vec::new());
        };
        let step_rad = (last - first) / (bearings_rad.len().max(2) - 1) as f64;
        let is_even = (0..).zip(bearings_rad).all(|(k, bearing_rad): (u32, &f64)| {
            (first + f64::from(k) * step_rad - bearing_rad).abs() < EVEN_TOLERANCE_RAD
        });
        if is_even {
            return (first, last, ranges_m.clone());
        }
        let low = bearings_rad.iter().copied().fold(f64::INFINITY, f64::min);
        let high = bearings_rad.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let index = |bearing_rad: f64| ((bearing_rad - low) / RASTER_STEP_RAD).round() as usize;
        let mut raster = vec![f64::NAN; index(high) + 1];
        for (&bearing_rad, &range_m) in bearings_rad.iter().zip(ranges_m) {
            // Of beams in one degree the nearest echo counts; the minimum with NaN is the other number.
            let nearest_m = &mut raster[index(bearing_rad)];
            *nearest_m = nearest_m.min(range_m);
        }
        for range_m in &mut raster {
            if range_m.is_nan() {
                *range_m = no_beam;
            }
        }
        (low, low + (raster.len() - 1) as f64 * RASTER_STEP_RAD, raster)
    }
}

#[cfg(test)]
mod tests {
    use super::kind::samples::ROBOT;
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn scan(bearings_rad: &[f64], ranges_m: &[f64]) -> Scan {
        Scan {
            of: BodyId::new(ROBOT, 0, None),
            sensor: "eye".into(),
            pose: Pose::from_position([0.0; 3]),
            bearings_rad: bearings_rad.to_vec(),
            ranges_m: ranges_m.to_vec(),
            true_m: Vec::new(),
            range_m: 9.0,
        }
    }

    #[test]
    fn evenly_spaced_beams_stay_as_they_are() {
        let bearings: Vec<f64> = (0..4).map(|k| f64::from(k) * FRAC_PI_2).collect();
        let (first, last, ranges) = scan(&bearings, &[1.0, 2.0, 3.0, 4.0]).resample_evenly(9.0);
        assert_eq!((first, last), (0.0, 3.0 * FRAC_PI_2));
        assert_eq!(ranges, [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(scan(&[0.5], &[1.0]).resample_evenly(9.0), (0.5, 0.5, vec![1.0]));
        assert_eq!(scan(&[], &[]).resample_evenly(9.0).2, Vec::<f64>::new());
    }

    #[test]
    fn other_beams_keep_their_direction_in_a_raster_of_degrees() {
        let bearings = [90.0, 0.0, -10.0].map(f64::to_radians);
        let (first, last, ranges) =
            scan(&bearings, &[3.0, 2.0, 1.0]).resample_evenly(f64::INFINITY);
        assert!((first + 10f64.to_radians()).abs() < 1e-12);
        assert!((last - 90f64.to_radians()).abs() < 1e-12);
        assert_eq!((ranges.len(), ranges[0], ranges[10], ranges[100]), (101, 1.0, 2.0, 3.0));
        assert_eq!(ranges.iter().filter(|r| r.is_finite()).count(), 3);
    }
}
