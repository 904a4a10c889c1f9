//! Promise: the rows of a profile are distributions, and adding to one leaves the rest of its text as it is.

use super::*;
use crate::effector::{EffectorOptions, from_csv as effector_from};
use crate::sensor::{SensorOptions, from_csv as sensor_from};

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

fn sensor_model() -> LearnedSensor {
    let folder = tempfile::tempdir().unwrap();
    sensor_from(&file(&folder, READINGS), &SensorOptions::default()).unwrap()
}

fn effector_model() -> LearnedEffector {
    let folder = tempfile::tempdir().unwrap();
    effector_from(&file(&folder, MOTIONS), &EffectorOptions::default()).unwrap()
}

fn both() -> String {
    let text = with_sensor("p.toml", &empty("small"), "eye", &sensor_model()).unwrap();
    with_effector("p.toml", &text, "wheels", &effector_model()).unwrap()
}

#[test]
fn every_row_of_the_text_sums_to_one() {
    let parsed: toml::Table = both().parse().unwrap();
    let eye = &parsed["sensors"]["eye"];
    let by_class = eye["confusion_by_class"].as_table().unwrap().values();
    for rows in by_class.chain([&eye["confusion"], &eye["distance_confusion"]]) {
        for (name, row) in rows.as_table().unwrap() {
            let sum: f64 = row.as_array().unwrap().iter().map(|p| p.as_float().unwrap()).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{name}: {sum}");
        }
    }
    for action in ["forward", "left", "right", "stay"] {
        let transitions = parsed["effectors"]["wheels"][action].as_array().unwrap();
        let sum: f64 = transitions.iter().map(|t| t["p"].as_float().unwrap()).sum();
        assert!((sum - 1.0).abs() < 1e-9, "{action}: {sum}");
    }
}

#[test]
fn adding_leaves_comments_and_other_sections_alone_and_replaces_its_own() {
    let text = "# mine\nformat = 1\nprofile = \"p\" # name\n\n[sensors.old] # keep\na = 1\n";
    let once = with_sensor("p.toml", text, "eye", &sensor_model()).unwrap();
    assert!(once.starts_with(text), "{once}");
    let mut changed = sensor_model();
    changed.profile.range_m = 1.25;
    let twice = with_sensor("p.toml", &once, "eye", &changed).unwrap();
    assert!(twice.starts_with(text));
    assert_eq!(twice.matches("[sensors.eye]").count(), 1);
    assert!(twice.contains("range_m = 1.25") && !twice.contains("range_m = 6.5"));
    let with_wheels = with_effector("p.toml", &twice, "wheels", &effector_model()).unwrap();
    assert!(with_wheels.starts_with(&twice));
}

#[test]
fn text_that_is_no_profile_is_refused() {
    let add = |text: &str, name: &str| with_sensor("p.toml", text, name, &sensor_model());
    assert_eq!(add("format = 1\nx = [", "eye").unwrap_err().line_and_column().unwrap().0, 2);
    assert!(add("", "eye").unwrap_err().remedy().contains("format = 1"));
    assert!(add("format = 2\nprofile = \"p\"\n", "eye").is_err());
    assert!(add("format = 1\nprofile = \"p\"\nsensors = 3\n", "eye").is_err());
    assert!(add(&empty("p"), " ").is_err());
}

#[test]
fn names_that_toml_must_quote_are_quoted() {
    let text = with_sensor("p.toml", &empty("a \"b\""), "front eye", &sensor_model()).unwrap();
    let parsed: toml::Table = text.parse().unwrap();
    assert_eq!(parsed["profile"].as_str(), Some("a \"b\""));
    assert!(parsed["sensors"].get("front eye").is_some());
}
