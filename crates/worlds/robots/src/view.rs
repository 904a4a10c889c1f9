//! The visible part of a building: floor, bodies, sensors' readings, and events in words.

use super::effector::Side;
use super::odometry::Claimed;
use super::scene::with_scene;
use super::sensor::{NOTHING, Reading, SensorModel};
use super::state::{BodyCell, RobotsState};
use super::world::{MountedSensor, Role};
use super::{Event, EventKind, RobotsWorld, Scratch};
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::view::{self, Body, Condition, Entry, Kind, Level, Pose, Scan, Shape, Who};
use sidestep_kernel::{Cycle, EntityId, Phases};
use std::f64::consts::FRAC_PI_2;

/// Length of a cycle in seconds for pictures; the model itself has no time but cycles.
pub(super) const CYCLE_S: f64 = 1.0;
/// Number of cycles worth showing as trails: longer ways cover the floor.
const WORTH_CYCLES: Cycle = 400;

impl RobotsWorld {
    /// Returns the building without bodies.
    pub(super) fn scenery(&self, name: &str) -> view::Scenery {
        view::Scenery {
            name: name.into(),
            dimensions: 2,
            cycle_s: CYCLE_S,
            floor: Some(self.map.floor()),
            bodies: Vec::new(),
            names: Vec::new(),
        }
    }

    /// Returns how recorded poses give the places of robots and people.
    pub(super) fn place_rows(&self) -> Vec<view::PlaceRows> {
        let scale_m = self.map.box_size_m;
        let axis = |column| view::Axis { column, scale_m, offset_m: 0.0 };
        vec![view::PlaceRows {
            table: "trajectories",
            kind: Kind::Robot,
            number: "body",
            part: None,
            axes: vec![axis("col_boxes"), axis("row_boxes")],
            plane: Some(self.map.plane),
            is_corner: true,
            ahead: Some("heading"),
            every: 1,
            worth: WORTH_CYCLES,
        }]
    }

    /// Returns all bodies by id.
    pub(super) fn visible_bodies(&self, state: &RobotsState) -> Vec<Body> {
        let ids = 0..self.bodies.len() as EntityId;
        ids.map(|id| self.visible_body(id, state.body(id))).collect()
    }

    fn visible_body(&self, id: EntityId, cell: &BodyCell) -> Body {
        let kind = self.visible_kind(id);
        let is_open = kind == Kind::Door && cell.facing.get() == 1;
        // Heights are made up, because the model is a plane.
        let side_m = self.side_m(id);
        let height_m = match kind {
            Kind::Door if is_open => 0.05 * side_m,
            Kind::Robot => 0.5 * side_m,
            _ => side_m,
        };
        let (size, box_m) = (self.type_of(id).size, self.map.box_size_m);
        let size_m = [f64::from(size.0) * box_m, f64::from(size.1) * box_m, height_m];
        let pose = self.pose(id, cell, 0.5 * height_m);
        Body::new(kind, id, pose, Shape::Cuboid { size_m })
            .when(cell.contact.get() != 0, Condition::Touching)
            .when(is_open, Condition::Open)
    }

    fn visible_kind(&self, id: EntityId) -> Kind {
        match self.type_of(id).role {
            Role::Robot(_) => Kind::Robot,
            Role::Mover(_) => Kind::Person,
            Role::Door(_) => Kind::Door,
        }
    }

    /// Returns the shorter side of a body in meters.
    fn side_m(&self, id: EntityId) -> f64 {
        let (width, height) = self.type_of(id).size;
        f64::from(width.min(height)) * self.map.box_size_m
    }

    /// Returns the middle of a body at a height, and its heading.
    fn pose(&self, id: EntityId, cell: &BodyCell, z_m: f64) -> Pose {
        let [x_m, y_m] = self.middle_m(id, self.map_position(cell.at()));
        let facing = match self.type_of(id).role {
            Role::Door(_) => 0,
            _ => cell.facing.get(),
        };
        Pose::heading([x_m, y_m, z_m], self.heading_rad(facing))
    }

    /// Returns the middle in the world of a body whose lower-left box is `at`.
    pub(super) fn middle_m(&self, id: EntityId, (col, row): (u32, u32)) -> [f64; 2] {
        let (width, height) = self.type_of(id).size;
        let middle =
            |at: u32, size: u32| (f64::from(at) + 0.5 * f64::from(size)) * self.map.box_size_m;
        self.map.plane.place([middle(col, width), middle(row, height)])
    }

    /// Returns the direction in the world of a heading, which is along the axes of the map.
    pub(super) fn heading_rad(&self, facing: u8) -> f64 {
        self.map.plane.yaw_rad + f64::from(facing) * FRAC_PI_2
    }

    /// Returns the readings that the first robots are about to perceive.
    pub(super) fn scans(&self, state: &RobotsState, now: Cycle, robots: usize) -> Vec<Scan> {
        let mut scratch = self.scratch();
        let shown = self.robots.iter().take(robots);
        shown.flat_map(|&id| self.scans_of(state, now, id, &mut scratch)).collect()
    }

    fn scans_of(
        &self,
        state: &RobotsState,
        now: Cycle,
        id: EntityId,
        scratch: &mut Scratch,
    ) -> Vec<Scan> {
        let (cell, ty) = (state.body(id), self.type_of(id));
        let Role::Robot(model) = &ty.role else { return Vec::new() };
        with_scene!(self, state, now, |scene| scene.sense(model, cell, scratch));
        let pose = self.pose(id, cell, 0.5 * self.side_m(id));
        let mut readings = &scratch.readings[..];
        let scan = |sensor: &MountedSensor| {
            let (own, others) = readings.split_at(sensor.model.bearings_deg.len());
            readings = others;
            scan(&sensor.model, own, self.side_m(id), id, pose)
        };
        model.body.sensors.iter().map(scan).collect()
    }

    /// Returns the poses that the robots' wheels claim, given by id.
    pub(super) fn claimed_poses(&self, claimed: &[Claimed]) -> Vec<(Who, Pose)> {
        let of = |(id, claimed): (EntityId, &Claimed)| {
            ((Kind::Robot, id, None), claimed.pose(self.map.box_size_m))
        };
        (0..).zip(claimed).map(of).collect()
    }

    /// Returns an event in words.
    pub(super) fn entry(&self, event: &Event) -> Entry {
        let (level, words) = match event.event {
            EventKind::Contact { kind, side } => {
                let what = &self.kinds[usize::from(kind)];
                (Level::Warning, format!("touches a {what} with its {}", side_in_words(side)))
            }
            EventKind::Opened => (Level::Info, "opens".into()),
            EventKind::Closed => (Level::Info, "closes".into()),
        };
        let who = format!("{}/{}", self.visible_kind(event.body), event.body);
        Entry { cycle: event.cycle, level, who, words }
    }
}

fn side_in_words(side: Side) -> String {
    format!("{} side", side.name())
}

/// Returns a sensor's readings as ranges from the middle of its robot.
fn scan(
    sensor: &SensorModel,
    readings: &[Reading],
    side_m: f64,
    robot: EntityId,
    pose: Pose,
) -> Scan {
    let bearings_rad: Vec<f64> = sensor.bearings_deg.iter().map(|deg| deg.to_radians()).collect();
    let range_m = |(&reading, &bearing_rad): (&Reading, &f64)| {
        let to_boundary_m = 0.5 * side_m / cos(bearing_rad).abs().max(sin(bearing_rad).abs());
        to_boundary_m + beyond_boundary_m(sensor, reading)
    };
    Scan {
        of: (Kind::Robot, robot, None),
        sensor: sensor.name.clone(),
        pose,
        ranges_m: readings.iter().zip(&bearings_rad).map(range_m).collect(),
        range_m: sensor.range_m + 0.5 * side_m * std::f64::consts::SQRT_2,
        bearings_rad,
    }
}

/// Returns the middle of the reported distance class in meters; infinite for nothing.
fn beyond_boundary_m(sensor: &SensorModel, reading: Reading) -> f64 {
    if reading.observation == NOTHING || reading.class >= sensor.beyond() {
        return f64::INFINITY;
    }
    let (class, edges_m) = (usize::from(reading.class), &sensor.distance_edges_m);
    let near_m = if class == 0 { 0.0 } else { edges_m[class - 1] };
    let far_m = edges_m.get(class).copied().unwrap_or(sensor.range_m).min(sensor.range_m);
    0.5 * (near_m + far_m)
}
