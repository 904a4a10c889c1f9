//! The readings of the scenario's sensors by the ranges of a scanner.
//!
//! A beam of the simulator starts at the center of the body, and meets boxes. So an echo is told as that box on the beam
//! whose near side is nearest to it: small errors of the range and of the pose leave the reading as it is. What is met
//! cannot be told by a range, so the map tells it: a wall where the map has one, else a robot.

use super::grid::{BodyGrid, Pose2};
use super::scan::{Echo, RangeScan};
use crate::agents::RobotPercept;
use crate::decide::Contact;
use crate::sensor::{NOTHING, Reading, SensorModel, WALL};
use crate::world::RobotsWorld;
use sidestep_error_models::ray::{Crossing, crossings, reaches, turn_crossing};
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::{Cycle, EntityId};
use sidestep_planners::GridPose;
use std::sync::Arc;

/// Boxes beyond the range of a sensor that are looked at, so that an echo behind the last box in range is none.
const BOXES_BEYOND: f64 = 2.0;

/// The beam of a sensor.
#[derive(Debug, Clone)]
struct Beam {
    /// Relative to the heading.
    bearing_rad: f64,
    /// From the center of the body to its boundary along the beam, in boxes.
    exit_boxes: f64,
    /// The boxes that it crosses for a body that heads east, nearest first.
    crossings: Vec<Crossing>,
}

impl Beam {
    fn new(bearing_deg: f64, size: u32, range_boxes: f64) -> Self {
        let bearing_rad = bearing_deg.to_radians();
        let steepness = cos(bearing_rad).abs().max(sin(bearing_rad).abs());
        Self {
            bearing_rad,
            exit_boxes: f64::from(size) / 2.0 / steepness,
            crossings: crossings(size, bearing_deg, range_boxes + BOXES_BEYOND),
        }
    }
}

/// A sensor of the scenario, and its beams.
#[derive(Debug, Clone)]
struct SensorBeams {
    model: SensorModel,
    beams: Vec<Beam>,
}

/// What a robot perceives beside its scan.
#[derive(Debug, Clone, Copy)]
pub struct RobotSituation {
    /// The number of its decision, from 0.
    pub cycle: Cycle,
    /// Its boxes and its heading.
    pub at: GridPose,
    /// Its pose in the frame of the map.
    pub pose: Pose2,
    /// What stopped its last action.
    pub contact: Option<Contact>,
    /// The words of its memory.
    pub memory: [u32; 4],
}

/// Makes percepts of a robot.
#[derive(Debug, Clone)]
pub struct PerceptBuilder {
    grid: BodyGrid,
    id: EntityId,
    /// The kind of what the map does not have.
    robot_kind: u8,
    sensors: Vec<SensorBeams>,
}

impl PerceptBuilder {
    /// Returns the builder of a robot; none for another body.
    pub fn new(world: &Arc<RobotsWorld>, id: EntityId) -> Option<Self> {
        let grid = BodyGrid::new(world, id)?;
        let model = world.robot_model(id)?;
        let mut sensors = Vec::new();
        for mounted in &model.body.sensors {
            let model = mounted.model.clone();
            let range_boxes = model.range_m / grid.box_m();
            let bearings_deg = model.bearings_deg.iter();
            let beams =
                bearings_deg.map(|&deg| Beam::new(deg, grid.side_boxes(), range_boxes)).collect();
            sensors.push(SensorBeams { model, beams });
        }
        Some(Self { grid, id, robot_kind: world.type_of(id).kind, sensors })
    }

    /// Returns the number of beams that a scanner does not see: they report nothing, always.
    pub fn blind_beams(&self, scan: &RangeScan) -> usize {
        let beams = self.sensors.iter().flat_map(|sensor| &sensor.beams);
        beams.filter(|beam| !scan.looks_toward(beam.bearing_rad)).count()
    }

    /// Returns the percept of a robot without what it hears of others.
    pub fn percept(&self, situation: &RobotSituation, scan: &RangeScan) -> RobotPercept {
        let mut readings = Vec::new();
        for sensor in &self.sensors {
            let own = sensor.beams.iter();
            readings.extend(own.map(|beam| self.reading(sensor, beam, situation, scan)));
        }
        RobotPercept {
            id: self.id,
            cycle: situation.cycle,
            readings,
            contact: situation.contact,
            at: (situation.at.col, situation.at.row),
            heading: situation.at.heading,
            heard: Vec::new(),
            memory: situation.memory,
        }
    }

    fn reading(
        &self,
        sensor: &SensorBeams,
        beam: &Beam,
        situation: &RobotSituation,
        scan: &RangeScan,
    ) -> Reading {
        let model = &sensor.model;
        let center = self.grid.center(situation.at);
        let along_rad = center.yaw_rad + beam.bearing_rad;
        let Some(Echo::At(point_m)) = scan.echo_toward(along_rad - situation.pose.yaw_rad) else {
            return model.nothing();
        };
        // The body is somewhere in its boxes, and turned a little: the echo counts from their center.
        let [x_m, y_m] = situation.pose.transform_point(point_m);
        let along_m =
            (x_m - center.at_m[0]) * cos(along_rad) + (y_m - center.at_m[1]) * sin(along_rad);
        let measured = along_m / self.grid.box_m() - beam.exit_boxes;
        let Some((distance, is_wall)) = self.box_met(beam, situation.at, measured) else {
            return model.nothing();
        };
        let kind = if is_wall { WALL } else { self.robot_kind };
        let observation = model.designates[usize::from(kind)];
        if observation == NOTHING || reaches(distance, model.range_m / self.grid.box_m()) {
            return model.nothing();
        }
        Reading { observation, class: model.class_of(distance, self.grid.box_m()) }
    }

    /// Returns the distance in boxes of the box on a beam that is nearest to a measured one, and whether it is a wall.
    /// Nothing is behind the first wall.
    fn box_met(&self, beam: &Beam, at: GridPose, measured: f64) -> Option<(f64, bool)> {
        let mut nearest: Option<(f64, bool)> = None;
        for &crossing in &beam.crossings {
            let turned = turn_crossing(crossing, self.grid.side_boxes(), at.heading);
            let col = i64::from(at.col) + i64::from(turned.dx);
            let row = i64::from(at.row) + i64::from(turned.dy);
            let is_wall = !self.grid.is_free_box(col, row);
            let error = |distance: f64| (distance - measured).abs();
            // At the same distance the wall: a beam through a corner.
            if nearest.is_none_or(|(distance, _)| error(crossing.distance) <= error(distance)) {
                nearest = Some((crossing.distance, is_wall));
            }
            if is_wall {
                break;
            }
        }
        nearest
    }
}
