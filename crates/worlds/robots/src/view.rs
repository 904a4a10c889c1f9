//! The visible part of a building: floor, bodies, sensors' readings, and events in words.

use super::cycle_context::{CycleContext, with_cycle};
use super::effector::Side;
use super::odometry::DeadReckoning;
use super::progress::GridlockEvent;
use super::sensor::{NOTHING, Reading, SensorModel};
use super::state::{BodyState, LastContact, RobotsState};
use super::world::{BodyType, CYCLE_S, MountedSensor, Role};
use super::{Event, EventKind, RobotsEvent, RobotsWorld, Scratch};
use crate::kinds;
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::space::OccupantWord;
use sidestep_kernel::view::{
    self, Body, BodyCondition, BodyId, BodyKind, CachedIsometry2, LogEvent, LogEventKind, Pose,
    Quantity, Scan, ScanSelection, Severity, Shape,
};
use sidestep_kernel::{Cycle, EntityId, Phases};
use sidestep_map::Rect;
use std::f64::consts::FRAC_PI_2;

/// Number of cycles worth showing as trails: longer ones cover the floor.
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
            groups: self.agent_groups.clone(),
            earth: Default::default(),
            traffic: None,
        }
    }

    /// Returns the columns of recorded poses that hold the places of robots and people.
    pub(super) fn position_columns(&self) -> Vec<view::PositionTableColumns> {
        let scale_m = self.map.box_size_m;
        let [col, row] = ["col_boxes", "row_boxes"].map(|column| view::CoordinateColumn {
            column,
            scale_m,
            offset_m: 0.0,
        });
        vec![view::PositionTableColumns {
            table: "trajectories",
            kind: kinds::ROBOT,
            number: "body",
            part: None,
            axes: vec![col, row],
            plane: Some(self.map.plane),
            is_corner: true,
            heading: Some("heading"),
            interval: 1,
            history: TRAIL_CYCLES,
        }]
    }

    /// Returns all bodies by id.
    pub(super) fn visible_bodies(&self, state: &RobotsState) -> Vec<Body> {
        let builder = BodyViewBuilder::new(self);
        let ids = 0..self.bodies.len() as EntityId;
        ids.map(|id| builder.body(id, state.body(id))).collect()
    }

    /// For a single body; [`Self::visible_bodies`] computes the sines of all of them once.
    pub(super) fn visible_body(&self, id: EntityId, body: &BodyState) -> Body {
        BodyViewBuilder::new(self).body(id, body)
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
    fn pose(&self, id: EntityId, body: &BodyState, z_m: f64) -> Pose {
        BodyViewBuilder::new(self).pose(self.type_of(id), body, z_m)
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
        state.release_boxes(self);
        let ids: Vec<EntityId> = match of {
            ScanSelection::First(robots) => self.robots.iter().take(*robots).copied().collect(),
            ScanSelection::Of(bodies) => {
                let robots = bodies.iter().filter(|of| of.kind == kinds::ROBOT);
                let ids = robots.map(|of| of.number);
                // Viewers may ask for ids that this run does not have.
                ids.filter(|&id| (id as usize) < self.bodies.len()).collect()
            }
        };
        let mut scratch = self.new_scratch();
        ids.into_iter().flat_map(|id| self.scans_of(state, now, id, &mut scratch)).collect()
    }

    fn scans_of(
        &self,
        state: &RobotsState,
        now: Cycle,
        id: EntityId,
        scratch: &mut Scratch,
    ) -> Vec<Scan> {
        let body = state.body(id);
        let Role::Robot(model) = &self.type_of(id).role else { return Vec::new() };
        let true_ranges_m = with_cycle!(self, state, now, |cycle| {
            cycle.sense(model, body, scratch);
            let sensors = model.body.sensors.iter();
            sensors.map(|sensor| self.true_ranges_m(cycle, sensor, body)).collect::<Vec<_>>()
        });
        let side_m = self.side_m(id);
        let carrier = ScanCarrier { id, side_m, pose: self.pose(id, body, 0.5 * side_m) };
        let mut scans = Vec::with_capacity(model.body.sensors.len());
        let mut rest = &scratch.readings[..];
        for (sensor, true_m) in model.body.sensors.iter().zip(&true_ranges_m) {
            let (readings, others) = rest.split_at(sensor.model.bearings_deg.len());
            rest = others;
            scans.push(carrier.scan(&sensor.model, readings, true_m));
        }
        scans
    }

    /// Returns the true distance in meters from the body's boundary to the thing that each
    /// beam meets; infinite where that reads as nothing.
    fn true_ranges_m<T: OccupantWord>(
        &self,
        cycle: &CycleContext<'_, T>,
        sensor: &MountedSensor,
        body: &BodyState,
    ) -> Vec<f64> {
        let mut ranges_m = Vec::with_capacity(sensor.ends.len());
        for hit in cycle.beam_hits(sensor, body) {
            let seen = hit.filter(|(word, _)| {
                sensor.designated_observation(cycle.state.kind_of(*word)) != NOTHING
            });
            let boxes = seen.map_or(f64::INFINITY, |(_, boxes)| boxes);
            ranges_m.push(boxes * self.map.box_size_m);
        }
        ranges_m
    }

    /// Returns the poses that the robots' wheels report, given by id.
    pub(super) fn odometry_poses(&self, odometry: &[DeadReckoning]) -> Vec<(BodyId, Pose)> {
        let turns = DeadReckoning::heading_orientations();
        let mut poses = Vec::with_capacity(odometry.len());
        for (id, reckoning) in (0..).zip(odometry) {
            let pose = reckoning.pose(self.map.box_size_m, &turns);
            poses.push((BodyId::new(kinds::ROBOT, id, None), pose));
        }
        poses
    }

    /// Robots, people and doors are numbered together, so that the number alone is unique too.
    pub(super) fn body_id(&self, id: EntityId) -> BodyId {
        BodyId::new(self.visible_kind(id), id, None)
    }

    pub(super) fn view_event(&self, state: &RobotsState, event: &RobotsEvent) -> LogEvent {
        match event {
            RobotsEvent::Body(event) => self.view_body_event(event),
            RobotsEvent::Gridlock(event) => self.view_gridlock(state, event),
        }
    }

    fn view_gridlock(&self, state: &RobotsState, event: &GridlockEvent) -> LogEvent {
        let GridlockEvent { cycle, has_begun, gridlock } = event;
        let mut robots = gridlock.robots.iter().map(|&id| self.body_id(id));
        let (level, kind, words) = if *has_begun {
            let words = format!("waits in a gridlock of {gridlock}");
            (Severity::Error, LogEventKind::Gridlock, words)
        } else {
            let words = format!("is free of a gridlock of {gridlock}");
            (Severity::Info, LogEventKind::GridlockEnded, words)
        };
        let who = robots.next().unwrap_or_else(|| self.body_id(0));
        let [x_m, y_m] =
            self.middle_m(who.number, self.map_position(state.body(who.number).position()));
        LogEvent {
            cycle: *cycle,
            level,
            kind,
            who,
            with: robots.next(),
            at_m: Some([x_m, y_m, 0.0]),
            value: Some(Quantity::new(gridlock.robots.len() as f64, "")),
            words,
        }
    }

    fn view_body_event(&self, event: &Event) -> LogEvent {
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
        let [x_m, y_m] = self.middle_m(event.body, event.at);
        let at_m = Some([x_m, y_m, 0.0]);
        let who = self.body_id(event.body);
        LogEvent { cycle: event.cycle, level, kind, who, with, at_m, value: None, words }
    }
}

/// Values that all bodies of a frame have in common, computed once, so that no sine is computed for each.
struct BodyViewBuilder<'a> {
    world: &'a RobotsWorld,
    plane: CachedIsometry2,
    /// The turn of each heading, as a pose has it.
    turns: [[f64; 4]; 4],
}

impl<'a> BodyViewBuilder<'a> {
    fn new(world: &'a RobotsWorld) -> Self {
        let turns = [0, 1, 2, 3]
            .map(|heading| Pose::from_heading([0.0; 3], world.heading_rad(heading)).turn);
        Self { world, plane: world.map.plane.cached(), turns }
    }

    fn body(&self, id: EntityId, body: &BodyState) -> Body {
        let ty = self.world.type_of(id);
        let box_m = self.world.map.box_size_m;
        let kind = ty.visible_kind();
        let is_open = kind == kinds::DOOR && body.facing.get().is_open();
        // The model is a plane; heights are chosen for the picture: robots below people and walls, and an open
        // door as a threshold.
        let (width, height) = ty.size;
        let side_m = f64::from(width.min(height)) * box_m;
        let height_m = if is_open {
            0.05 * side_m
        } else if kind == kinds::ROBOT {
            0.5 * side_m
        } else {
            side_m
        };
        let size_m = [f64::from(width) * box_m, f64::from(height) * box_m, height_m];
        Body::new(kind, id, self.pose(ty, body, 0.5 * height_m), Shape::Cuboid { size_m })
            .with_condition_if(body.contact.get() != LastContact::NONE, BodyCondition::Touching)
            .with_condition_if(is_open, BodyCondition::Open)
    }

    fn pose(&self, ty: &BodyType, body: &BodyState, z_m: f64) -> Pose {
        let [x_m, y_m] = self.middle_m(ty.boxes(self.world.map_position(body.position())));
        let heading = match ty.role {
            Role::Door(_) => 0,
            _ => body.facing.get().heading(),
        };
        Pose { at_m: [x_m, y_m, z_m], turn: self.turns[usize::from(heading % 4)] }
    }

    fn middle_m(&self, Rect { col, row, width, height }: Rect) -> [f64; 2] {
        let box_m = self.world.map.box_size_m;
        let x_m = (f64::from(col) + 0.5 * f64::from(width)) * box_m;
        let y_m = (f64::from(row) + 0.5 * f64::from(height)) * box_m;
        self.plane.transform_point([x_m, y_m])
    }
}

impl BodyType {
    fn visible_kind(&self) -> BodyKind {
        match self.role {
            Role::Robot(_) => kinds::ROBOT,
            Role::Mover(_) => kinds::PERSON,
            Role::Door(_) => kinds::DOOR,
        }
    }
}

fn side_text(side: Side) -> String {
    format!("{} side", side.name())
}

/// The robot that carries a sensor.
struct ScanCarrier {
    id: EntityId,
    side_m: f64,
    pose: Pose,
}

impl ScanCarrier {
    /// Returns a sensor's readings, and the true distances of the things that its beams meet, as
    /// ranges from the middle of the robot. The model measures them from its boundary.
    fn scan(&self, sensor: &SensorModel, readings: &[Reading], true_m: &[f64]) -> Scan {
        let mut bearings_rad = Vec::with_capacity(readings.len());
        let mut ranges_m = Vec::with_capacity(readings.len());
        let mut true_ranges_m = Vec::with_capacity(readings.len());
        let beams = sensor.bearings_deg.iter().zip(readings).zip(true_m);
        for ((bearing_deg, &reading), true_m) in beams {
            let bearing_rad = bearing_deg.to_radians();
            let to_boundary_m = center_to_boundary_m(self.side_m, bearing_rad);
            bearings_rad.push(bearing_rad);
            ranges_m.push(to_boundary_m + class_middle_m(sensor, reading));
            true_ranges_m.push(to_boundary_m + true_m);
        }
        Scan {
            of: BodyId::new(kinds::ROBOT, self.id, None),
            sensor: sensor.name.clone(),
            pose: self.pose,
            ranges_m,
            true_m: true_ranges_m,
            // The boundary is farthest along a diagonal.
            range_m: sensor.range_m + 0.5 * self.side_m * std::f64::consts::SQRT_2,
            bearings_rad,
        }
    }
}

/// Returns the distance in meters from the middle of a square body to its boundary.
pub(super) fn center_to_boundary_m(side_m: f64, bearing_rad: f64) -> f64 {
    0.5 * side_m / cos(bearing_rad).abs().max(sin(bearing_rad).abs())
}

/// Returns the middle of the reported distance class in meters; infinite for nothing.
pub(super) fn class_middle_m(sensor: &SensorModel, reading: Reading) -> f64 {
    if reading.observation == NOTHING || reading.class >= sensor.beyond() {
        return f64::INFINITY;
    }
    let class = usize::from(reading.class);
    let edges_m = &sensor.distance_edges_m;
    let near_m = if class == 0 { 0.0 } else { edges_m[class - 1] };
    let far_m = edges_m.get(class).copied().unwrap_or(sensor.range_m).min(sensor.range_m);
    0.5 * (near_m + far_m)
}
