//! Promise: a profile holds the learned numbers in the form that a scenario loads.

use sidestep::kernel::InputError;
use sidestep::learn::EstimateOptions;
use sidestep::learn::effector::{self, EffectorOptions};
use sidestep::learn::profile::{empty, with_effector, with_sensor};
use sidestep::learn::sensor::{self, SensorOptions};
use sidestep::scenario::Source;
use sidestep::worlds::robots::scenario::{Behaviours, Compiled, StorageOrder};
use sidestep::worlds::robots::world::Role;

const READINGS: &str = "true,reported,true_distance_m,reported_distance_m\n\
    robot,robot,1.0,1.2\nrobot,nothing,2.0,\nrobot,robot,3.4,1.6\nnothing,robot,,1.0\n\
    nothing,nothing,,\nwall,wall,6,6\n";
const MOTIONS: &str = "action,ahead_boxes,left_boxes,turn_deg\n\
    forward,1,0,0\nforward,1.1,0.2,0\nleft,0,0,85\nright,0,0,-90\nstay,0,0,0\n";

fn file(folder: &tempfile::TempDir, text: &str) -> std::path::PathBuf {
    let path = folder.path().join("log.csv");
    std::fs::write(&path, text).unwrap();
    path
}

fn sensor_model() -> sensor::LearnedSensor {
    let folder = tempfile::tempdir().unwrap();
    sensor::from_csv(&file(&folder, READINGS), &SensorOptions::default()).unwrap()
}

fn effector_model() -> effector::LearnedEffector {
    let folder = tempfile::tempdir().unwrap();
    effector::from_csv(&file(&folder, MOTIONS), &EffectorOptions::default()).unwrap()
}

fn both() -> String {
    let text = with_sensor("p.toml", &empty("small"), "eye", &sensor_model()).unwrap();
    with_effector("p.toml", &text, "wheels", &effector_model()).unwrap()
}

/// Loads a scenario with one robot that has the named sensor and effector.
fn loads(profile: &str, sensor: &str, effector: &str) -> Result<Compiled, InputError> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("p.toml"), profile).unwrap();
    let text = format!(
        "format = 1\nworld = \"robots\"\nprofiles = [\"p.toml\"]\n\
         [map]\nascii = \"\"\"\n.....\n.....\n.....\n\"\"\"\nbox_size_m = 0.25\n\
         [robots]\ncount = 1\nsensors = [\"{sensor}\"]\neffector = \"{effector}\"\n"
    );
    let source = Source::new("scenario.toml", text, folder.path());
    Compiled::new(&source, &Behaviours::new(), StorageOrder::ById)
}

#[test]
fn a_scenario_loads_what_was_learned() {
    let compiled = loads(&both(), "eye", "wheels").unwrap();
    let sensor = compiled.world.sensors().next().unwrap().clone();
    let profile = sensor_model().profile;
    assert_eq!(sensor.observations, ["nothing", "robot", "wall"]);
    for (index, row) in profile.confusion.iter().enumerate() {
        let beyond = &sensor.confusion[profile.distance_classes.len()][index];
        let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-9;
        assert!(beyond.iter().zip(&row.probabilities).all(close), "{row:?}");
    }
}

/// Without a scenario, a library's user gets the same tables to the bit.
#[test]
fn the_models_of_what_was_learned_are_those_that_a_scenario_loads() {
    let compiled = loads(&both(), "eye", "wheels").unwrap();
    let world = &compiled.world;
    let Role::Robot(robot) = &world.type_of(world.robots()[0]).role else {
        panic!("the first body is a robot")
    };
    let sensor = sensor_model().profile.model("eye", &world.kinds);
    assert_eq!(sensor, robot.body.sensors[0].model);
    let wheels = effector_model().profile.model("wheels");
    assert_eq!(wheels, robot.body.effector);
}

#[test]
fn a_camera_from_mrclam_loads_with_its_wheels() {
    let Some(folder) = sidestep_testing::shared_data("logs/mrclam7") else { return };
    let folder = folder.as_path();
    let camera = sensor::from_mrclam(folder, None, &SensorOptions::default()).unwrap();
    let options = EstimateOptions::default();
    let wheels = effector::from_mrclam(folder, 0.25, None, &options).unwrap();
    let text = with_sensor("p.toml", &empty("mrclam7"), "camera", &camera).unwrap();
    let text = with_effector("p.toml", &text, "create", &wheels).unwrap();
    loads(&text, "camera", "create").unwrap();
    let parsed: toml::Table = text.parse().unwrap();
    let forward = parsed["effectors"]["create"]["forward"].as_array().unwrap();
    assert_eq!(forward[0]["path"].as_str(), Some("F"));
    assert!((forward[0]["p"].as_float().unwrap() - 0.877).abs() < 0.003);
    assert!(text.contains("interval = "));
}
