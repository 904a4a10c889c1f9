//! `learn`: counts equal those of an independent program, profiles are usable.

use crate::support::TestFolder;
use serde_json::Value;
use std::path::PathBuf;

/// A file of the shared data; `None` where they are not.
fn shared(path: &str) -> Option<PathBuf> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    let path = PathBuf::from(root).join(path);
    if !path.exists() {
        sidestep_testing::skip("../shared/data is not here");
        return None;
    }
    Some(path)
}

fn expected(name: &str) -> Value {
    let path = shared(&format!("expected/{name}")).expect("beside the logs");
    serde_json::from_str(&std::fs::read_to_string(path).expect("read")).expect("JSON")
}

fn close(a: &Value, b: &Value, tolerance: f64) {
    let (x, y) = (a.as_f64().expect("a number"), b.as_f64().expect("a number"));
    assert!((x - y).abs() <= tolerance, "{x} against {y}");
}

/// One row of a matrix of counts.
fn row(counts: &Value, index: usize) -> Vec<u64> {
    let row = counts[index].as_array().expect("a row");
    row.iter().map(|c| c.as_u64().expect("a count")).collect()
}

#[test]
fn a_sensor_from_mrclam_has_the_expected_counts() {
    let Some(folder) = shared("logs/mrclam7") else { return };
    let folder = folder.to_str().expect("text");
    let learned = TestFolder::new().json(&["learn", "sensor", "--mrclam", folder]);
    let expected = expected("mrclam7_dev_sensor.json");
    for key in ["correct", "distance_counts", "distance3_counts"] {
        assert_eq!(learned[key], expected[key], "{key}");
    }
    assert_eq!(learned["skipped"], expected["skipped"]["observer_no_gt"]);
    let (labels, counts) = (&expected["labels"], &expected["confusion_counts"]);
    let total: u64 = (0..20).flat_map(|i| row(counts, i)).sum();
    assert_eq!(learned["sightings"], total);
    for (i, truth) in labels.as_array().expect("a list").iter().take(20).enumerate() {
        for (observed, count) in labels.as_array().expect("a list").iter().zip(row(counts, i)) {
            let observed = observed.as_str().filter(|o| o.starts_with('S')).unwrap_or("UNKNOWN");
            let cell = &learned["confusion"][truth.as_str().expect("text")][observed];
            assert_eq!(cell.as_u64().unwrap_or(0), count, "{truth} as {observed}");
        }
    }
    assert_eq!(learned["distance_edges_m"], serde_json::json!([0.0, 1.5, 2.5, 3.5, 4.5, 5.5]));
}

#[test]
fn an_effector_from_mrclam_has_the_expected_transitions() {
    let Some(folder) = shared("logs/mrclam7") else { return };
    let folder = folder.to_str().expect("text");
    let place = TestFolder::new();
    let learned = place.json(&["learn", "effector", "--mrclam", folder, "--box", "0.1"]);
    let expected = &expected("mrclam7_dev_effector.json")["forward_0.1"];
    assert_eq!(learned["events"], expected["n"]);
    for key in ["stay", "ahead", "ahead2", "ahead_left", "ahead_right", "other"] {
        let paper = &expected["phase_averaged_paper"][key.to_uppercase()];
        close(&learned["transitions"][key], paper, 0.002);
    }
    for key in ["ahead_boxes", "left_boxes"] {
        close(&learned["moments"][key]["mean"], &expected[key]["mean"], 0.001);
        close(&learned["moments"][key]["sd"], &expected[key]["sd"], 0.001);
    }
}

#[test]
fn an_effector_from_carmen_has_the_expected_slip() {
    let Some(log) = shared("logs/carmen/intel-corrected.log.gz") else { return };
    let learned =
        TestFolder::new().json(&["learn", "effector", "--carmen", log.to_str().expect("text")]);
    let expected = expected("carmen_intel_dev.json");
    assert_eq!(learned["events"], expected["forward_one_box"]["n"]);
    close(&learned["lateral_slip_sd"], &expected["lateral_slip_ratio"]["sd"], 0.001);
    assert_eq!(learned["warnings"].as_array().map(Vec::len), Some(0));
}

const READINGS: &str = "true,reported,true_distance_m,reported_distance_m\n\
    robot,robot,1.0,1.2\nrobot,nothing,2.0,\nwall,wall,6,6\nnothing,nothing,,\nnothing,wall,,2\n";
const MOTIONS: &str = "action,ahead_boxes,left_boxes,turn_deg\n\
    forward,1,0,0\nforward,1,0,0\nforward,0,0,0\nleft,0,0,90\nright,0,0,-90\n";

#[test]
fn one_profile_takes_sensor_and_effector_and_a_scenario_loads_it() {
    let place = TestFolder::new();
    place.write("readings.csv", READINGS);
    place.write("motions.csv", MOTIONS);
    let to = ["--profile", "p.toml", "--name"];
    let learn = |what: &str, csv: &str, name: &str| {
        place.json(&[&["learn", what, "--csv", csv][..], &to, &[name]].concat())
    };
    learn("sensor", "readings.csv", "eye");
    learn("effector", "motions.csv", "wheels");
    place.write("l.toml", "format = 1\nworld = \"robots\"\ncycles = 100\nprofiles = [\"p.toml\"]\n[map]\nascii = \"\"\"\n.....\n.....\n.....\n\"\"\"\n[robots]\ncount = 2\nsensors = [\"eye\"]\neffector = \"wheels\"\n");
    assert_eq!(place.json(&["run", "l.toml"])["cycles"], 100);
}

#[test]
fn a_name_that_stands_in_the_profile_is_told_to_be_replaced_and_quiet_says_nothing_else() {
    let place = TestFolder::new();
    place.write("readings.csv", READINGS);
    place.write("motions.csv", MOTIONS);
    let learn = |what: &str, csv: &str| {
        let to = ["--profile", "new/p.toml", "--name", "eye", "-q"];
        let ended = place.run(&[&["learn", what, "--csv", csv][..], &to].concat());
        assert_eq!(ended.code(), 0, "{}", ended.err());
        ended.out()
    };
    assert_eq!(learn("sensor", "readings.csv"), "Added `eye` to new/p.toml\n");
    // An effector may be called as a sensor is.
    assert_eq!(learn("effector", "motions.csv"), "Added `eye` to new/p.toml\n");
    assert_eq!(learn("sensor", "readings.csv"), "Replaced `eye` in new/p.toml\n");
}

#[test]
fn a_wrong_log_or_profile_writes_nothing() {
    let place = TestFolder::new();
    place.write("readings.csv", READINGS);
    place.write("bad.csv", "action,ahead_boxes,left_boxes,turn_deg\nforward,x,0,0\n");
    place.write("no.toml", "seed = 1\n");
    let refused = |args: &[&str], reason: &str| {
        let ended = place.run(args);
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{}", ended.err());
        assert!(ended.err().contains(reason), "{}", ended.err());
    };
    refused(&["learn", "effector", "--csv", "bad.csv", "--profile", "p.toml"], "bad.csv:2:");
    refused(&["learn", "sensor", "--mrclam", "nowhere", "--profile", "p.toml"], "nowhere");
    refused(&["learn", "sensor", "--csv", "readings.csv", "--profile", "no.toml"], "no.toml");
    refused(&["learn", "sensor", "--csv", "readings.csv", "--alpha", "-1"], "alpha");
    assert_eq!(place.names(), ["bad.csv", "no.toml", "readings.csv", "s.toml"]);
    assert_eq!(place.read("no.toml"), "seed = 1\n");
}

/// A hall in which robots rarely meet a wall, so that few moves are cut.
fn hall() -> String {
    let row = format!("{}\n", ".".repeat(80));
    format!(
        "format = 1\nworld = \"robots\"\ncycles = 6000\n[map]\nascii = \"\"\"\n{}\"\"\"\n\
         [robots]\ncount = 3\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n\
         [record]\ncalibration = true\n",
        row.repeat(80)
    )
}

#[test]
fn what_a_calibrated_run_records_gives_its_tables_back() {
    let place = TestFolder::new();
    place.write("hall.toml", hall());
    place.json(&["run", "hall.toml", "--out", "r"]);
    let wheels = place.json(&["learn", "effector", "--run", "r"]);
    close(&wheels["transitions"]["ahead"], &0.88.into(), 0.015);
    let edges = ["--edges", "0.3,1.5", "--classes", "near,medium,far"];
    let eye = place.json(&[&["learn", "sensor", "--run", "r"], &edges[..]].concat());
    let nothing = &eye["confusion"]["nothing"];
    let reported = nothing.as_object().expect("counts").values().filter_map(Value::as_f64);
    close(
        &(nothing["nothing"].as_f64().expect("a count") / reported.sum::<f64>()).into(),
        &0.97.into(),
        0.01,
    );
}

#[test]
fn a_run_without_calibration_says_how_to_record_it() {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--cycles", "50", "--out", "plain"]);
    let refused = place.run(&["learn", "effector", "--run", "plain"]);
    assert_eq!(refused.code(), 2);
    assert!(refused.err().contains("record.calibration=true"), "{}", refused.err());
}
