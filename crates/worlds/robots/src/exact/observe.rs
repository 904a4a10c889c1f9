//! The reports of a robot's beams at a pose, with their probabilities.

use super::MarkovModel;
use super::obstacle::GridPose;
use super::static_map::StaticMap;
use crate::sensor::{FREE, Reading};
use crate::world::MountedSensor;
use sidestep_error_models::ray::{Crossing, crossings, turn_crossing};
use sidestep_kernel::InputError;
use sidestep_scenario::suggestion;

/// A beam of one of the robot's sensors.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Beam {
    /// Name of the sensor.
    pub sensor: String,
    /// Number of the beam, from 0 in the order of the sensor's bearings.
    pub index: usize,
}

/// A beam with the boxes that it crosses, for every heading.
pub(super) struct MountedBeam<'a> {
    pub(super) sensor: &'a MountedSensor,
    reliable: bool,
    crossed: [Vec<Crossing>; 4],
}

impl<'a> MountedBeam<'a> {
    pub(super) fn new(model: &'a MarkovModel, beam: &Beam) -> Result<Self, InputError> {
        let sensors = &model.robot.body.sensors;
        let found = sensors.iter().find(|s| s.model.name == beam.sensor);
        let sensor = found.ok_or_else(|| unknown_sensor(&beam.sensor, sensors))?;
        let bearings = &sensor.model.bearings_deg;
        let Some(&bearing_deg) = bearings.get(beam.index) else {
            let cause = format!("sensor `{}` has no beam {}", beam.sensor, beam.index);
            let remedy = format!("count beams from 0 to {}", bearings.len() - 1);
            return Err(InputError::new("--beam", cause, remedy));
        };
        let (size, side_m) = (model.robot.size, model.building.map.box_size_m);
        let ahead = crossings(size, bearing_deg, sensor.model.range_m / side_m);
        let crossed = std::array::from_fn(|heading| {
            ahead.iter().map(|&c| turn_crossing(c, size, heading as u8)).collect()
        });
        Ok(Self { sensor, reliable: sensor.is_reliable(), crossed })
    }

    /// Returns `P(reading
    /// pose)`; readings of probability 0 are left out.
    pub(super) fn readings(&self, building: &StaticMap, pose: GridPose) -> Vec<(Reading, f64)> {
        let mut row = self.sensor.model.reading_row(self.truth(building, pose), self.reliable);
        row.retain(|reading| reading.1 > 0.0);
        row
    }

    /// Returns the beam's true reading.
    fn truth(&self, building: &StaticMap, pose: GridPose) -> Reading {
        let kind_at = |c: &Crossing| building.kind_at(pose.col + c.dx, pose.row + c.dy);
        let mut met = self.crossed[usize::from(pose.heading)].iter().map(|c| (c, kind_at(c)));
        let model = &self.sensor.model;
        met.find(|(_, kind)| *kind != FREE).map_or(model.nothing(), |(crossing, kind)| {
            let class = model.class_of(crossing.distance, building.map.box_size_m);
            self.sensor.truth(kind, class)
        })
    }
}

fn unknown_sensor(name: &str, sensors: &[MountedSensor]) -> InputError {
    let known: Vec<&str> = sensors.iter().map(|s| s.model.name.as_str()).collect();
    let remedy = suggestion(name, &known);
    InputError::new("--sensor", format!("the robot has no sensor `{name}`"), remedy)
}

/// Returns the beam of the first sensor that points most nearly ahead, if there is a sensor.
pub(super) fn forward_beam(model: &MarkovModel) -> Option<Beam> {
    let sensor = &model.robot.body.sensors.first()?.model;
    let off_ahead = |deg: f64| (deg - 360.0 * (deg / 360.0).round()).abs();
    let by_bearing =
        |a: &(usize, &f64), b: &(usize, &f64)| off_ahead(*a.1).total_cmp(&off_ahead(*b.1));
    let (index, _) = sensor.bearings_deg.iter().enumerate().min_by(by_bearing)?;
    Some(Beam { sensor: sensor.name.clone(), index })
}
