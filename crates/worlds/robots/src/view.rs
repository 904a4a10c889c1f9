//! The visible part of a building: floor, bodies, sensors' readings, and events in words.

use super::effector::Side;
use super::odometry::Claimed;
use super::scene::{Scene, with_scene};
use super::sensor::{NOTHING, Reading, SensorModel};
use super::state::{BodyCell, LastContact, RobotsState};
use super::world::{BodyType, MountedSensor, Role};
use super::{Event, EventKind, RobotsWorld, Scratch};
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::space::BoxWord;
use sidestep_kernel::view::{
    self, Body, Condition, Entry, Happening, Kind, Level, Pose, Scan, Scans, Shape, TurnedPlane,
    Who,
};
use sidestep_kernel::{Cycle, EntityId, Phases};
use sidestep_map::Rect;
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
        let eye = Eye::new(self);
        let ids = 0..self.bodies.len() as EntityId;
        ids.map(|id| eye.body(id, state.body(id))).collect()
    }

    /// Returns one body.
    pub(super) fn visible_body(&self, id: EntityId, cell: &BodyCell) -> Body {
        Eye::new(self).body(id, cell)
    }

    pub(super) fn visible_kind(&self, id: EntityId) -> Kind {
        self.type_of(id).visible_kind()
    }

    /// Returns the shorter side of a body in meters.
    pub(super) fn side_m(&self, id: EntityId) -> f64 {
        let (width, height) = self.type_of(id).size;
        f64::from(width.min(height)) * self.map.box_size_m
    }

    /// Returns the middle of a body at a height, and its heading.
    fn pose(&self, id: EntityId, cell: &BodyCell, z_m: f64) -> Pose {
        Eye::new(self).pose(self.type_of(id), cell, z_m)
    }

    /// Returns the middle in the world of a body that has its lower-left box at `at`.
    pub(super) fn middle_m(&self, id: EntityId, at: (u32, u32)) -> [f64; 2] {
        Eye::new(self).middle_m(self.type_of(id).boxes(at))
    }

    /// Returns the direction in the world of a heading, which is along the axes of the map.
    pub(super) fn heading_rad(&self, heading: u8) -> f64 {
        self.map.plane.yaw_rad + f64::from(heading) * FRAC_PI_2
    }

    /// Returns the readings that some robots are about to perceive.
    pub(super) fn scans(&self, state: &RobotsState, now: Cycle, of: &Scans) -> Vec<Scan> {
        let mut scratch = self.scratch();
        let mut scans = |&id: &EntityId| self.scans_of(state, now, id, &mut scratch);
        match of {
            Scans::First(robots) => self.robots.iter().take(*robots).flat_map(scans).collect(),
            Scans::Of(bodies) => {
                let is_there = |id: &EntityId| (*id as usize) < self.bodies.len();
                let asked = bodies.iter().filter(|of| of.kind == Kind::Robot);
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
            sensors.map(|sensor| self.true_m(scene, sensor, cell)).collect::<Vec<_>>()
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
    fn true_m<T: BoxWord>(
        &self,
        scene: &Scene<'_, T>,
        sensor: &MountedSensor,
        cell: &BodyCell,
    ) -> Vec<f64> {
        let far_m = |met: Option<(T, f64)>| {
            let is_seen = |word| sensor.designates(scene.state.kind_of(word)) != NOTHING;
            let met = met.filter(|(word, _)| is_seen(*word));
            met.map_or(f64::INFINITY, |(_, boxes)| boxes * self.map.box_size_m)
        };
        scene.met(sensor, cell).into_iter().map(far_m).collect()
    }

    /// Returns the poses that the robots' wheels claim, given by id.
    pub(super) fn claimed_poses(&self, claimed: &[Claimed]) -> Vec<(Who, Pose)> {
        let turns = Claimed::turns();
        let of = |(id, claimed): (EntityId, &Claimed)| {
            (Who::new(Kind::Robot, id, None), claimed.pose(self.map.box_size_m, &turns))
        };
        (0..).zip(claimed).map(of).collect()
    }

    /// Returns which body one is.
    pub(super) fn who(&self, id: EntityId) -> Who {
        Who::new(self.visible_kind(id), id, None)
    }

    /// Returns an event in words.
    pub(super) fn entry(&self, event: &Event) -> Entry {
        let mut with = None;
        let (level, kind, words) = match event.event {
            EventKind::Contact { kind, side, with: other } => {
                with = other.map(|id| self.who(id));
                let what = &self.kinds[usize::from(kind)];
                let words = format!("touches a {what} with its {}", side_in_words(side));
                (Level::Warning, Happening::Contact, words)
            }
            EventKind::Opened => (Level::Info, Happening::DoorOpened, "opens".into()),
            EventKind::Closed => (Level::Info, Happening::DoorClosed, "closes".into()),
        };
        let ([x_m, y_m], who) = (self.middle_m(event.body, event.at), self.who(event.body));
        let at_m = Some([x_m, y_m, 0.0]);
        Entry { cycle: event.cycle, level, kind, who, with, at_m, value: None, words }
    }
}

/// Values that many bodies have in common when they are looked at: no sine is computed for each.
struct Eye<'a> {
    world: &'a RobotsWorld,
    plane: TurnedPlane,
    /// The turn of each heading.
    turns: [[f64; 4]; 4],
}

impl<'a> Eye<'a> {
    fn new(world: &'a RobotsWorld) -> Self {
        let turn = |heading| Pose::heading([0.0; 3], world.heading_rad(heading)).turn;
        Self { world, plane: world.map.plane.turned(), turns: [0, 1, 2, 3].map(turn) }
    }

    fn body(&self, id: EntityId, cell: &BodyCell) -> Body {
        let (ty, box_m) = (self.world.type_of(id), self.world.map.box_size_m);
        let kind = ty.visible_kind();
        let is_open = kind == Kind::Door && cell.facing.get().is_open();
        // Heights are made up, because the model is a plane.
        let (width, height) = ty.size;
        let side_m = f64::from(width.min(height)) * box_m;
        let height_m = match kind {
            Kind::Door if is_open => 0.05 * side_m,
            Kind::Robot => 0.5 * side_m,
            _ => side_m,
        };
        let size_m = [f64::from(width) * box_m, f64::from(height) * box_m, height_m];
        Body::new(kind, id, self.pose(ty, cell, 0.5 * height_m), Shape::Cuboid { size_m })
            .when(cell.contact.get() != LastContact::NONE, Condition::Touching)
            .when(is_open, Condition::Open)
    }

    fn pose(&self, ty: &BodyType, cell: &BodyCell, z_m: f64) -> Pose {
        let [x_m, y_m] = self.middle_m(ty.boxes(self.world.map_position(cell.at())));
        let heading = match ty.role {
            Role::Door(_) => 0,
            _ => cell.facing.get().heading(),
        };
        Pose { at_m: [x_m, y_m, z_m], turn: self.turns[usize::from(heading % 4)] }
    }

    fn middle_m(&self, Rect { col, row, width, height }: Rect) -> [f64; 2] {
        let box_m = self.world.map.box_size_m;
        let middle = |at: u32, size: u32| (f64::from(at) + 0.5 * f64::from(size)) * box_m;
        self.plane.place([middle(col, width), middle(row, height)])
    }
}

impl BodyType {
    fn visible_kind(&self) -> Kind {
        match self.role {
            Role::Robot(_) => Kind::Robot,
            Role::Mover(_) => Kind::Person,
            Role::Door(_) => Kind::Door,
        }
    }
}

fn side_in_words(side: Side) -> String {
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
        to_boundary_m(side_m, bearing_rad) + beyond_boundary_m(sensor, reading)
    };
    let true_m = true_m.iter().zip(&bearings_rad);
    let true_m = true_m.map(|(far_m, bearing_rad)| to_boundary_m(side_m, *bearing_rad) + far_m);
    Scan {
        of: Who::new(Kind::Robot, robot, None),
        sensor: sensor.name.clone(),
        pose,
        ranges_m: readings.iter().zip(&bearings_rad).map(range_m).collect(),
        true_m: true_m.collect(),
        range_m: sensor.range_m + 0.5 * side_m * std::f64::consts::SQRT_2,
        bearings_rad,
    }
}

/// Returns the way in meters from the middle of a square body to its boundary.
pub(super) fn to_boundary_m(side_m: f64, bearing_rad: f64) -> f64 {
    0.5 * side_m / cos(bearing_rad).abs().max(sin(bearing_rad).abs())
}

/// Returns the middle of the reported distance class in meters; infinite for nothing.
pub(super) fn beyond_boundary_m(sensor: &SensorModel, reading: Reading) -> f64 {
    if reading.observation == NOTHING || reading.class >= sensor.beyond() {
        return f64::INFINITY;
    }
    let (class, edges_m) = (usize::from(reading.class), &sensor.distance_edges_m);
    let near_m = if class == 0 { 0.0 } else { edges_m[class - 1] };
    let far_m = edges_m.get(class).copied().unwrap_or(sensor.range_m).min(sensor.range_m);
    0.5 * (near_m + far_m)
}
