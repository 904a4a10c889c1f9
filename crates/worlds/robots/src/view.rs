//! The visible part of a building: floor, bodies, sensors' readings, and events in words.

use super::cycle_context::{CycleContext, with_scene};
use super::effector::Side;
use super::odometry::DeadReckoning;
use super::sensor::{NOTHING, Reading, SensorModel};
use super::state::{BodyState, LastContact, RobotsState};
use super::world::{BodyType, MountedSensor, Role};
use super::{Event, EventKind, RobotsWorld, Scratch};
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::space::BoxWord;
use sidestep_kernel::view::{
    self, Body, BodyId, BodyKind, CachedIsometry2, Condition, LogEvent, LogEventKind, Pose, Scan,
    ScanSelection, Severity, Shape,
};
use sidestep_kernel::{Cycle, EntityId, Phases};
use sidestep_map::Rect;
use std::f64::consts::FRAC_PI_2;

/// Length of a cycle in seconds for pictures; the model itself has no time but cycles.
pub(super) const CYCLE_S: f64 = 1.0;
/// Number of cycles worth showing as trails: longer ways cover the floor.
const TRAIL_CYCLES: Cycle = 400;

impl RobotsWorld {
    /// Returns the building without bodies.
    pub(super) fn scenery(&self, name: &str) -> view::Scenery {
        view::Scenery {
            name: name.into(),
            dimensions: 2,
            cycle_s: CYCLE_S,
            floor: Some(self.map.occupancy_grid()),
            bodies: Vec::new(),
            names: Vec::new(),
        }
    }

    /// Returns how recorded poses give the places of robots and people.
    pub(super) fn position_columns(&self) -> Vec<view::PositionColumns> {
        let scale_m = self.map.box_size_m;
        let axis = |column| view::Axis { column, scale_m, offset_m: 0.0 };
        vec![view::PositionColumns {
            table: "trajectories",
            kind: BodyKind::Robot,
            number: "body",
            part: None,
            axes: vec![axis("col_boxes"), axis("row_boxes")],
            plane: Some(self.map.plane),
            is_corner: true,
            heading: Some("heading"),
            interval: 1,
            history: TRAIL_CYCLES,
        }]
    }

    /// Returns all bodies by id.
    pub(super) fn visible_bodies(&self, state: &RobotsState) -> Vec<Body> {
        let eye = BodyViewBuilder::new(self);
        let ids = 0..self.bodies.len() as EntityId;
        ids.map(|id| eye.body(id, state.body(id))).collect()
    }

    /// Returns one body.
    pub(super) fn visible_body(&self, id: EntityId, cell: &BodyState) -> Body {
        BodyViewBuilder::new(self).body(id, cell)
    }

    pub(super) fn visible_kind(&self, id: EntityId) -> BodyKind {
        self.type_of(id).visible_kind()
    }

    /// Returns the shorter side of a body in meters.
    pub(super) fn side_m(&self, id: EntityId) -> f64 {
        let (width, height) = self.type_of(id).size;
        f64::from(width.min(height)) * self.map.box_size_m
    }

    /// Returns the middle of a body at a height, and its heading.
    fn pose(&self, id: EntityId, cell: &BodyState, z_m: f64) -> Pose {
        BodyViewBuilder::new(self).pose(self.type_of(id), cell, z_m)
    }

    /// Returns the middle in the world of a body that has its lower-left box at `at`.
    pub(super) fn middle_m(&self, id: EntityId, at: (u32, u32)) -> [f64; 2] {
        BodyViewBuilder::new(self).middle_m(self.type_of(id).boxes(at))
    }

    /// Returns the direction in the world of a heading, which is along the axes of the map.
    pub(super) fn heading_rad(&self, heading: u8) -> f64 {
        self.map.plane.yaw_rad + f64::from(heading) * FRAC_PI_2
    }

    /// Returns the readings that some robots are about to perceive.
    pub(super) fn scans(&self, state: &RobotsState, now: Cycle, of: &ScanSelection) -> Vec<Scan> {
        let mut scratch = self.scratch();
        let mut scans = |&id: &EntityId| self.scans_of(state, now, id, &mut scratch);
        match of {
            ScanSelection::First(robots) => {
                self.robots.iter().take(*robots).flat_map(scans).collect()
            }
            ScanSelection::Of(bodies) => {
                let is_there = |id: &EntityId| (*id as usize) < self.bodies.len();
                let asked = bodies.iter().filter(|of| of.kind == BodyKind::Robot);
                asked.map(|of| of.number).filter(is_there).flat_map(|id| scans(&id)).collect()
            }
        }
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
        let truths = with_scene!(self, state, now, |scene| {
            scene.sense(model, cell, scratch);
            let sensors = model.body.sensors.iter();
            sensors.map(|sensor| self.true_ranges_m(scene, sensor, cell)).collect::<Vec<_>>()
        });
        let pose = self.pose(id, cell, 0.5 * self.side_m(id));
        let mut readings = &scratch.readings[..];
        let scan = |(sensor, true_m): (&MountedSensor, Vec<f64>)| {
            let (own, others) = readings.split_at(sensor.model.bearings_deg.len());
            readings = others;
            scan(&sensor.model, own, &true_m, self.side_m(id), id, pose)
        };
        model.body.sensors.iter().zip(truths).map(scan).collect()
    }

    /// Returns the true distance in meters from the body's boundary to the thing that each
    /// beam meets; infinite where that reads as nothing.
    fn true_ranges_m<T: BoxWord>(
        &self,
        scene: &CycleContext<'_, T>,
        sensor: &MountedSensor,
        cell: &BodyState,
    ) -> Vec<f64> {
        let far_m = |met: Option<(T, f64)>| {
            let is_seen =
                |word| sensor.designated_observation(scene.state.kind_of(word)) != NOTHING;
            let met = met.filter(|(word, _)| is_seen(*word));
            met.map_or(f64::INFINITY, |(_, boxes)| boxes * self.map.box_size_m)
        };
        scene.beam_hits(sensor, cell).into_iter().map(far_m).collect()
    }

    /// Returns the poses that the robots' wheels claim, given by id.
    pub(super) fn odometry_poses(&self, claimed: &[DeadReckoning]) -> Vec<(BodyId, Pose)> {
        let turns = DeadReckoning::heading_orientations();
        let of = |(id, claimed): (EntityId, &DeadReckoning)| {
            (BodyId::new(BodyKind::Robot, id, None), claimed.pose(self.map.box_size_m, &turns))
        };
        (0..).zip(claimed).map(of).collect()
    }

    /// Returns which body one is.
    pub(super) fn body_id(&self, id: EntityId) -> BodyId {
        BodyId::new(self.visible_kind(id), id, None)
    }

    /// Returns an event in words.
    pub(super) fn view_event(&self, event: &Event) -> LogEvent {
        let mut with = None;
        let (level, kind, words) = match event.event {
            EventKind::Contact { kind, side, with: other } => {
                with = other.map(|id| self.body_id(id));
                let what = &self.kinds[usize::from(kind)];
                let words = format!("touches a {what} with its {}", side_text(side));
                (Severity::Warning, LogEventKind::Contact, words)
            }
            EventKind::DoorOpened => (Severity::Info, LogEventKind::DoorOpened, "opens".into()),
            EventKind::DoorClosed => (Severity::Info, LogEventKind::DoorClosed, "closes".into()),
        };
        let ([x_m, y_m], who) = (self.middle_m(event.body, event.at), self.body_id(event.body));
        let at_m = Some([x_m, y_m, 0.0]);
        LogEvent { cycle: event.cycle, level, kind, who, with, at_m, value: None, words }
    }
}

/// Values that many bodies have in common when they are looked at: no sine is computed for each.
struct BodyViewBuilder<'a> {
    world: &'a RobotsWorld,
    plane: CachedIsometry2,
    /// The turn of each heading.
    turns: [[f64; 4]; 4],
}

impl<'a> BodyViewBuilder<'a> {
    fn new(world: &'a RobotsWorld) -> Self {
        let turn = |heading| Pose::from_heading([0.0; 3], world.heading_rad(heading)).turn;
        Self { world, plane: world.map.plane.cached(), turns: [0, 1, 2, 3].map(turn) }
    }

    fn body(&self, id: EntityId, cell: &BodyState) -> Body {
        let (ty, box_m) = (self.world.type_of(id), self.world.map.box_size_m);
        let kind = ty.visible_kind();
        let is_open = kind == BodyKind::Door && cell.facing.get().is_open();
        // Heights are made up, because the model is a plane.
        let (width, height) = ty.size;
        let side_m = f64::from(width.min(height)) * box_m;
        let height_m = match kind {
            BodyKind::Door if is_open => 0.05 * side_m,
            BodyKind::Robot => 0.5 * side_m,
            _ => side_m,
        };
        let size_m = [f64::from(width) * box_m, f64::from(height) * box_m, height_m];
        Body::new(kind, id, self.pose(ty, cell, 0.5 * height_m), Shape::Cuboid { size_m })
            .with_state_if(cell.contact.get() != LastContact::NONE, Condition::Touching)
            .with_state_if(is_open, Condition::Open)
    }

    fn pose(&self, ty: &BodyType, cell: &BodyState, z_m: f64) -> Pose {
        let [x_m, y_m] = self.middle_m(ty.boxes(self.world.map_position(cell.position())));
        let heading = match ty.role {
            Role::Door(_) => 0,
            _ => cell.facing.get().heading(),
        };
        Pose { at_m: [x_m, y_m, z_m], turn: self.turns[usize::from(heading % 4)] }
    }

    fn middle_m(&self, Rect { col, row, width, height }: Rect) -> [f64; 2] {
        let box_m = self.world.map.box_size_m;
        let middle = |at: u32, size: u32| (f64::from(at) + 0.5 * f64::from(size)) * box_m;
        self.plane.transform_point([middle(col, width), middle(row, height)])
    }
}

impl BodyType {
    fn visible_kind(&self) -> BodyKind {
        match self.role {
            Role::Robot(_) => BodyKind::Robot,
            Role::Mover(_) => BodyKind::Person,
            Role::Door(_) => BodyKind::Door,
        }
    }
}

fn side_text(side: Side) -> String {
    format!("{} side", side.name())
}

/// Returns a sensor's readings, and the true distances of the things that its beams meet, as
/// ranges from the middle of its robot.
fn scan(
    sensor: &SensorModel,
    readings: &[Reading],
    true_m: &[f64],
    side_m: f64,
    robot: EntityId,
    pose: Pose,
) -> Scan {
    let bearings_rad: Vec<f64> = sensor.bearings_deg.iter().map(|deg| deg.to_radians()).collect();
    let range_m = |(&reading, &bearing_rad): (&Reading, &f64)| {
        center_to_boundary_m(side_m, bearing_rad) + class_middle_m(sensor, reading)
    };
    let true_m = true_m.iter().zip(&bearings_rad);
    let true_m =
        true_m.map(|(far_m, bearing_rad)| center_to_boundary_m(side_m, *bearing_rad) + far_m);
    Scan {
        of: BodyId::new(BodyKind::Robot, robot, None),
        sensor: sensor.name.clone(),
        pose,
        ranges_m: readings.iter().zip(&bearings_rad).map(range_m).collect(),
        true_m: true_m.collect(),
        range_m: sensor.range_m + 0.5 * side_m * std::f64::consts::SQRT_2,
        bearings_rad,
    }
}

/// Returns the way in meters from the middle of a square body to its boundary.
pub(super) fn center_to_boundary_m(side_m: f64, bearing_rad: f64) -> f64 {
    0.5 * side_m / cos(bearing_rad).abs().max(sin(bearing_rad).abs())
}

/// Returns the middle of the reported distance class in meters; infinite for nothing.
pub(super) fn class_middle_m(sensor: &SensorModel, reading: Reading) -> f64 {
    if reading.observation == NOTHING || reading.class >= sensor.beyond() {
        return f64::INFINITY;
    }
    let (class, edges_m) = (usize::from(reading.class), &sensor.distance_edges_m);
    let near_m = if class == 0 { 0.0 } else { edges_m[class - 1] };
    let far_m = edges_m.get(class).copied().unwrap_or(sensor.range_m).min(sensor.range_m);
    0.5 * (near_m + far_m)
}
