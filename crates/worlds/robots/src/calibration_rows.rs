//! The tables that a run records to learn from: readings, ranges and motions, with what they mean.

use super::table_notes::{CYCLE_DESCRIPTION, box_notes};
use super::world::{RobotsWorld, Role};
use super::{MotionSample, RangeSample, SensorSample};
use sidestep_kernel::ports::Table;
use sidestep_kernel::{Cycle, EntityId};
use std::collections::BTreeSet;

/// Returns the notes of [`box_notes`], and the laws of the scenario on which the errors in a table depend.
fn error_notes(world: &RobotsWorld) -> Vec<(String, String)> {
    let mut about = box_notes(world);
    about.push(("regime".into(), world.regime.name().into()));
    about.push(("obstacle_rule".into(), world.obstacle_rule.name().into()));
    about
}

/// Returns the shape of each sensor, without which its classes of distance mean nothing.
fn sensor_notes(world: &RobotsWorld) -> Vec<(String, String)> {
    let mut about = Vec::new();
    let mut noted = BTreeSet::new();
    for sensor in world.sensors() {
        if !noted.insert(sensor.name.as_str()) {
            continue;
        }
        let designates = world.kinds.iter().zip(&sensor.designates).skip(1);
        let taken = designates.map(|(kind, &of)| (kind, &sensor.observations[usize::from(of)]));
        let taken = taken.filter(|(kind, observation)| kind != observation);
        let table = if sensor.beam.is_some() { "ranges" } else { "readings" };
        let notes = [
            ("table", table.to_string()),
            ("range_m", sensor.range_m.to_string()),
            ("bearings_deg", comma_list(&sensor.bearings_deg)),
            ("distance_edges_m", comma_list(&sensor.distance_edges_m)),
            ("distance_classes", sensor.distance_classes.join(",")),
            (
                "designates",
                comma_list(&taken.map(|(kind, seen)| format!("{kind}={seen}")).collect::<Vec<_>>()),
            ),
        ];
        about.extend(notes.map(|(key, note)| (format!("sensor.{}.{key}", sensor.name), note)));
    }
    about
}

fn comma_list<T: ToString>(items: &[T]) -> String {
    items.iter().map(T::to_string).collect::<Vec<_>>().join(",")
}

/// The true and the reported reading of a beam, each an observation and a class of distance.
pub(super) struct ReadingRow {
    cycle: Cycle,
    robot: EntityId,
    sensor: u16,
    /// Index of its name among those of [`ReadingLabels`].
    sensor_name: u32,
    truth: [u32; 2],
    reported: [u32; 2],
}

pub(super) fn reading_table(
    world: &RobotsWorld,
    ReadingLabels { observations, classes, sensors }: ReadingLabels,
) -> Table<ReadingRow> {
    let about = [error_notes(world), sensor_notes(world)].concat();
    Table::new("readings")
        .with_about(about)
        .u64("cycle", CYCLE_DESCRIPTION, |r: &ReadingRow| r.cycle)
        .u32("robot", "entity id", |r| r.robot)
        .u32("sensor", "number of the sensor on its robot", |r| u32::from(r.sensor))
        .label("true", "what the beam met", observations.clone(), |r| r.truth[0])
        .label("true_class", "its true distance class", classes.clone(), |r| r.truth[1])
        .label("reported", "what the sensor reported", observations, |r| r.reported[0])
        .label("reported_class", "the reported distance class", classes, |r| r.reported[1])
        .label("sensor_name", "name of the sensor in the scenario", sensors, |r| r.sensor_name)
}

/// The true and the reported range of a beam of a sensor that measures ranges.
pub(super) struct RangeRow {
    sample: RangeSample,
    sensor_name: u32,
    /// Indices of the true and the reported observation.
    seen: [u32; 2],
}

/// Returns the table of ranges; `None` where no sensor measures any.
pub(super) fn range_table(world: &RobotsWorld) -> Option<Table<RangeRow>> {
    world.sensors().find(|sensor| sensor.beam.is_some())?;
    let about = [error_notes(world), sensor_notes(world)].concat();
    let ReadingLabels { observations, sensors, .. } = ReadingLabels::from_world(world);
    let beam = "number of the beam, in the order of the sensor's bearings";
    let table = Table::new("ranges")
        .with_about(about)
        .u64("cycle", CYCLE_DESCRIPTION, |r: &RangeRow| r.sample.cycle)
        .u32("robot", "entity id", |r| r.sample.robot)
        .label("sensor_name", "name of the sensor in the scenario", sensors, |r| r.sensor_name)
        .u32("beam", beam, |r| u32::from(r.sample.beam))
        .label("true", "what the beam met", observations.clone(), |r| r.seen[0])
        .f64("true_distance_m", "distance to it, empty for nothing", |r| r.sample.true_m)
        .label("reported", "what the sensor reported", observations, |r| r.seen[1])
        .f64("reported_distance_m", "its range, empty without an echo", |r| r.sample.reported_m);
    Some(table)
}

pub(super) fn motion_table(world: &RobotsWorld) -> Table<MotionSample> {
    let action = "action tried: 0 forward, 1 left, 2 right, 3 stay, then the effector's own";
    let effectors = effector_names(world);
    let label_of_type: Vec<u32> = world
        .types
        .iter()
        .map(|ty| effector_name(&ty.role).map_or(0, |name| label_index(&effectors, name)))
        .collect();
    let of_robot: Vec<u32> =
        world.bodies.iter().map(|body| label_of_type[usize::from(body.ty)]).collect();
    let table = Table::new("motions")
        .with_about(error_notes(world))
        .u64("cycle", CYCLE_DESCRIPTION, |s: &MotionSample| s.cycle)
        .u32("robot", "entity id", |s| s.robot)
        .u32("action", action, |s| u32::from(s.action))
        .i32("ahead_boxes", "displacement ahead in the heading before", |s| s.ahead)
        .i32("left_boxes", "displacement to the left", |s| s.left)
        .i32("turn_deg", "turn made, positive to the left", |s| {
            let quarters = i32::from(s.quarter_turns);
            90 * if quarters == 3 { -1 } else { quarters }
        })
        .label("contact", "whether an obstacle cut it", ["no", "yes"], |s| u32::from(s.contact))
        .label("effector", "name of the robot's effector in the scenario", effectors, move |s| {
            of_robot[s.robot as usize]
        });
    if !world.has_delays {
        return table;
    }
    let delay = "cycles for which the action was delayed before it began; only where an effector has delays";
    table.u32("delay_cycles", delay, |s| s.delay_cycles)
}

/// Returns the names of the effectors of all robots, each once, sorted.
fn effector_names(world: &RobotsWorld) -> Vec<String> {
    let names = world.types.iter().filter_map(|ty| effector_name(&ty.role));
    names.collect::<BTreeSet<_>>().into_iter().map(String::from).collect()
}

fn effector_name(role: &Role) -> Option<&str> {
    match role {
        Role::Robot(model) => Some(&model.body.effector.name),
        Role::Mover(_) | Role::Door(_) => None,
    }
}

/// The labels of readings: observations and distance classes of all sensors, sorted, because a label is found
/// by its name.
pub(super) struct ReadingLabels {
    observations: Vec<String>,
    classes: Vec<String>,
    sensors: Vec<String>,
}

impl ReadingLabels {
    pub(super) fn from_world(world: &RobotsWorld) -> Self {
        let mut observations = Vec::new();
        let mut classes = vec!["beyond".to_string()];
        let mut sensors = Vec::new();
        for sensor in world.sensors() {
            observations.extend(sensor.observations.iter().cloned());
            classes.extend(sensor.distance_classes.iter().cloned());
            sensors.push(sensor.name.clone());
        }
        for names in [&mut observations, &mut classes, &mut sensors] {
            names.sort_unstable();
            names.dedup();
        }
        Self { observations, classes, sensors }
    }

    /// Returns the row of a sample; `None` for a body without sensors.
    pub(super) fn reading_row(
        &self,
        world: &RobotsWorld,
        sample: &SensorSample,
    ) -> Option<ReadingRow> {
        let Role::Robot(model) = &world.type_of(sample.robot).role else { return None };
        let sensor = &model.body.sensors[usize::from(sample.sensor)].model;
        Some(ReadingRow {
            cycle: sample.cycle,
            robot: sample.robot,
            sensor: sample.sensor,
            sensor_name: label_index(&self.sensors, &sensor.name),
            truth: self.indices(sensor.names_of(sample.truth)),
            reported: self.indices(sensor.names_of(sample.reported)),
        })
    }

    /// Returns the row of a range; `None` for a body without sensors.
    pub(super) fn range_row(&self, world: &RobotsWorld, sample: RangeSample) -> Option<RangeRow> {
        let Role::Robot(model) = &world.type_of(sample.robot).role else { return None };
        let sensor = &model.body.sensors[usize::from(sample.sensor)].model;
        let seen = [sample.true_m, sample.reported_m].map(|range| {
            let reading = sensor.reading_of_range(range);
            label_index(&self.observations, &sensor.observations[usize::from(reading.observation)])
        });
        Some(RangeRow { sample, sensor_name: label_index(&self.sensors, &sensor.name), seen })
    }

    /// Returns the numbers of the labels of a reading's observation and class.
    fn indices(&self, (observation, class): (&str, &str)) -> [u32; 2] {
        [label_index(&self.observations, observation), label_index(&self.classes, class)]
    }
}

fn label_index(labels: &[String], name: &str) -> u32 {
    labels.binary_search_by(|label| label.as_str().cmp(name)).unwrap_or(0) as u32
}
