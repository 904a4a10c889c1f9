//! Remarks on a valid scenario: the things that will surprise its author. `sidestep check` shows them.

use super::scenario::Compiled;
use super::sensor::NOTHING;
use super::world::{MountedSensor, RobotsWorld, Role};
use sidestep_scenario::Remark;
use std::collections::BTreeMap;

/// The first kind that a beam can meet: 0 is `free`.
const WALL: usize = 1;

/// Returns the remarks, warnings first.
pub(super) fn remarks(compiled: &Compiled) -> Vec<Remark> {
    let mut remarks = compiled.remarks.clone();
    for sensor in mounted_sensors(&compiled.world) {
        remarks.extend(unseen_kinds(&compiled.world, sensor));
        remarks.extend(unused_classes(sensor));
    }
    // Stable, because among equals the order of the scenario stays.
    remarks.sort_by_key(|remark| remark.severity);
    remarks
}

/// Returns the sensors in use, each once.
fn mounted_sensors(world: &RobotsWorld) -> impl Iterator<Item = &MountedSensor> {
    let sensors = world.types.iter().flat_map(|ty| match &ty.role {
        Role::Robot(model) => model.body.sensors.as_slice(),
        _ => &[],
    });
    let by_name: BTreeMap<&str, &MountedSensor> =
        sensors.map(|sensor| (sensor.model.name.as_str(), sensor)).collect();
    by_name.into_values()
}

/// Returns a note on the kinds that a sensor reads as nothing.
fn unseen_kinds(world: &RobotsWorld, sensor: &MountedSensor) -> Option<Remark> {
    let bodies = world.bodies.iter().map(|body| usize::from(world.type_of(body.id).kind));
    let mut is_met = vec![false; world.kinds.len()];
    bodies.chain([WALL]).for_each(|kind| is_met[kind] = true);
    let model = &sensor.model;
    let unseen = (WALL..world.kinds.len()).filter(|&k| is_met[k] && model.designates[k] == NOTHING);
    let names: Vec<&str> = unseen.map(|k| world.kinds[k].as_str()).collect();
    (!names.is_empty()).then(|| {
        let names = names.join(", ");
        let words = format!("it does not see {names}, nor anything that is hidden behind");
        Remark::note(format!("sensors.{}", model.name), words)
    })
}

/// Returns a note on the distance classes in which no box ever is.
fn unused_classes(sensor: &MountedSensor) -> Option<Remark> {
    let model = &sensor.model;
    // The classes are the same at every heading.
    let mut is_used = vec![false; model.distance_classes.len()];
    for class in sensor.boxes[0].iter().flat_map(|chunk| chunk.classes) {
        is_used[usize::from(class)] = true;
    }
    let classes = model.distance_classes.iter().zip(is_used);
    let names: Vec<&str> =
        classes.filter(|(_, is_used)| !is_used).map(|(name, _)| name.as_str()).collect();
    (!names.is_empty()).then(|| {
        let words = format!(
            "no box within its range of {} m is ever at the distance class {}: see \
             distance_edges_m and map.box_size_m",
            model.range_m,
            names.join(", "),
        );
        Remark::note(format!("sensors.{}", model.name), words)
    })
}
