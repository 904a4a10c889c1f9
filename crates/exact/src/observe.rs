//! The reports of a robot's beams at a pose, with their probabilities.

use crate::model::MarkovModel;
use crate::obstacle::GridPose;
use crate::robot::SingleRobot;
use sidestep_error_models::ray::{Crossing, crossings, turn_crossing};
use sidestep_error_models::sensor::{FREE, NOTHING, Reading, SensorModel};
use sidestep_kernel::InputError;
use sidestep_scenario::suggestion;

/// A beam of one of the robot's sensors.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Beam {
    /// Name of the sensor, as in the scenario.
    pub sensor: String,
    /// Number of the beam, from 0 in the order of the sensor's bearings.
    pub index: usize,
}

/// A beam with the boxes that it crosses, for every heading.
pub(super) struct MountedBeam<'a> {
    pub(super) sensor: &'a SensorModel,
    reliable: bool,
    crossed: [Vec<Crossing>; 4],
}

impl<'a> MountedBeam<'a> {
    pub(super) fn new(model: &'a MarkovModel, beam: &Beam) -> Result<Self, InputError> {
        let robot = &model.robot;
        let sensors = &robot.sensors;
        let found = sensors.iter().find(|s| s.name == beam.sensor);
        let sensor = found.ok_or_else(|| unknown_sensor(&beam.sensor, sensors))?;
        let bearings = &sensor.bearings_deg;
        let Some(&bearing_deg) = bearings.get(beam.index) else {
            let cause = format!("sensor `{}` has no beam {}", beam.sensor, beam.index);
            let remedy = format!("count beams from 0 to {}", bearings.len() - 1);
            return Err(InputError::new("--beam", cause, remedy));
        };
        let ahead = crossings(robot.size, bearing_deg, sensor.range_m / robot.map.box_size_m);
        let crossed = std::array::from_fn(|heading| {
            ahead.iter().map(|&c| turn_crossing(c, robot.size, heading as u8)).collect()
        });
        Ok(Self { sensor, reliable: robot.has_reliable_sensors, crossed })
    }

    /// Returns `P(reading | pose)`; readings of probability 0 are left out.
    pub(super) fn readings(&self, robot: &SingleRobot, pose: GridPose) -> Vec<(Reading, f64)> {
        let (truth, true_m) = self.truth(robot, pose);
        let ranged = if self.reliable { None } else { self.sensor.ranged_row(true_m) };
        let mut row = ranged.unwrap_or_else(|| self.sensor.reading_row(truth, self.reliable));
        row.retain(|reading| reading.1 > 0.0);
        row
    }

    /// The first box along the beam that is not free decides the true reading, and its distance in meters.
    fn truth(&self, robot: &SingleRobot, pose: GridPose) -> (Reading, Option<f64>) {
        let crossed = self.crossed[usize::from(pose.heading)].iter();
        let mut met = crossed.map(|c| (c, robot.kind_at(pose.col + c.dx, pose.row + c.dy)));
        let first = met.find(|(_, kind)| *kind != FREE);
        let Some((crossing, kind)) = first else { return (self.sensor.nothing(), None) };
        match self.sensor.designates[usize::from(kind)] {
            // A kind that reads as nothing still hides what stands behind it.
            NOTHING => (self.sensor.nothing(), None),
            observation => {
                let box_m = robot.map.box_size_m;
                let class = self.sensor.class_of(crossing.distance, box_m);
                (Reading { observation, class }, Some(crossing.distance * box_m))
            }
        }
    }
}

fn unknown_sensor(name: &str, sensors: &[SensorModel]) -> InputError {
    let known: Vec<&str> = sensors.iter().map(|s| s.name.as_str()).collect();
    let remedy = suggestion(name, &known);
    InputError::new("--sensor", format!("the robot has no sensor `{name}`"), remedy)
}

/// Returns the beam of the first sensor that points most nearly ahead, if there is a sensor.
pub(super) fn forward_beam(model: &MarkovModel) -> Option<Beam> {
    let sensor = model.robot.sensors.first()?;
    let off_ahead_deg = sensor.bearings_deg.iter().map(|deg| off_ahead_deg(*deg));
    let (index, _) = off_ahead_deg.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Beam { sensor: sensor.name.clone(), index })
}

/// Returns the angle between a bearing and straight ahead, from 0 to 180 degrees.
fn off_ahead_deg(bearing_deg: f64) -> f64 {
    (bearing_deg - 360.0 * (bearing_deg / 360.0).round()).abs()
}
