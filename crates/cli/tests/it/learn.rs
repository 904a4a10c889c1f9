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

/// Two sections of robots with different wheels, and a scanner, recorded to learn from.
const MIXED: &str = "format = 1\nworld = \"robots\"\ncycles = 400\nseed = 5\n[map]\nbox_size_m = 0.25\nascii = \"\"\"\nMAP\"\"\"\n\
    [[robots]]\ncount = 4\neffector = \"slick\"\nsensors = [\"lidar\"]\n[[robots]]\ncount = 2\neffector = \"nomad\"\nsensors = [\"sonar-8\"]\n\
    [record]\ncalibration = true\n\
    [effectors.slick]\nforward = [{ p = 0.6, path = \"F\" }, { p = 0.4 }]\n\
    left = [{ p = 1.0, turn = 90 }]\nright = [{ p = 1.0, turn = -90 }]\n\
    [sensors.lidar]\nbearings_deg = [-45, 0, 45, 270]\nrange_m = 4.0\nobservations = [\"nothing\", \"wall\"]\n\
    designates = { door = \"wall\", person = \"wall\", robot = \"wall\" }\ndistance_edges_m = [1.0]\n\
    beam = { hit = 0.8, short = 0.06, max = 0.09, random = 0.05, sigma_hit_m = 0.1, lambda_short_per_m = 0.5 }\n";

fn mixed_run() -> TestFolder {
    let place = TestFolder::new();
    let map = format!("{}\n", ".".repeat(40)).repeat(40);
    place.write("mixed.toml", MIXED.replace("MAP", &map));
    place.json(&["run", "mixed.toml", "--out", "r"]);
    place
}

#[test]
fn robots_of_different_effectors_are_not_one_table_and_a_run_knows_its_box() {
    let place = mixed_run();
    let refused = place.run(&["learn", "effector", "--run", "r"]);
    assert_eq!(refused.code(), 2);
    assert!(refused.err().contains("`nomad`, `slick`"), "{}", refused.err());
    assert!(refused.err().contains("--effector nomad"), "{}", refused.err());
    let to = ["--effector", "slick", "--profile", "p.toml", "--name", "w"];
    let learned = place.json(&[&["learn", "effector", "--run", "r"], &to[..]].concat());
    close(&learned["transitions"]["ahead"], &0.6.into(), 0.06);
    assert_eq!((&learned["box_m"], &learned["effector"]), (&0.25.into(), &"slick".into()));
    let scenario = "format = 1\nworld = \"robots\"\nprofiles = [\"p.toml\"]\nmap = { ascii = \".....\", box_size_m = 0.5 }\n\
        robots = { count = 1, effector = \"w\" }\n";
    place.write("other.toml", scenario);
    let checked = place.run(&["check", "other.toml"]);
    assert_eq!(checked.code(), 2);
    assert!(checked.err().contains("was learned for boxes of 0.25 m"), "{}", checked.err());
}

#[test]
fn a_profile_that_does_not_know_its_box_is_used_with_a_warning() {
    let place = TestFolder::new();
    place.write("motions.csv", MOTIONS);
    let learn = |more: &[&str]| {
        let to =
            ["learn", "effector", "--csv", "motions.csv", "--profile", "p.toml", "--name", "w"];
        place.run(&[&to[..], more].concat())
    };
    let asked = learn(&[]);
    assert_eq!(asked.code(), 0, "{}", asked.err());
    assert!(
        asked.out().contains("give the side in") && asked.out().contains("--box"),
        "{}",
        asked.out()
    );
    let scenario = "format = 1\nworld = \"robots\"\nprofiles = [\"p.toml\"]\nmap.ascii = \".....\"\n\
        robots = { count = 1, effector = \"w\" }\n";
    place.write("l.toml", scenario);
    let words = |place: &TestFolder| {
        place.run(&["run", "l.toml", "--cycles", "2"]).err().replace('\n', " ")
    };
    assert!(words(&place).contains("does not say"), "{}", words(&place));
    assert_eq!(learn(&["--box", "0.25"]).code(), 0);
    assert_eq!(words(&place), "", "boxes of 0.25 m are the default");
}

#[test]
fn too_many_damaged_rows_take_the_intervals_unless_they_are_accepted() {
    let place = TestFolder::new();
    let rows = "forward,1,0,0\n".repeat(90) + &"forward,?,0,0\n".repeat(10);
    place.write("m.csv", format!("action,ahead_boxes,left_boxes,turn_deg\n{rows}"));
    let learn = ["learn", "effector", "--csv", "m.csv", "--box", "0.25"];
    assert_eq!(place.json(&learn)["probabilities"][0]["interval"], Value::Null);
    let told = place.run(&learn).out().replace('\n', " ");
    assert!(told.contains("--max-unexplained 0.11"), "{told}");
    // The remedy works as it is given.
    let accepted = place.json(&[&learn[..], &["--max-unexplained", "0.11"]].concat());
    assert!(accepted["probabilities"][0]["interval"].is_array(), "{accepted}");
}

#[test]
fn a_run_gives_its_scanner_back_and_knows_its_shape() {
    let place = mixed_run();
    let learn = ["learn", "sensor", "--run", "r", "--sensor", "lidar", "--profile", "p.toml"];
    let learned = place.json(&[&learn[..], &["--name", "l"]].concat());
    let parameters = learned["beam"]["parameters"].as_array().expect("a list");
    for (parameter, known) in parameters.iter().zip([0.8, 0.06, 0.09, 0.05, 0.1, 0.5]) {
        let ends = [0, 1].map(|end| parameter["interval"][end].as_f64().expect("a number"));
        let half = 0.5 * (ends[1] - ends[0]);
        let value = parameter["value"].as_f64().expect("a number");
        assert!((value - known).abs() < 1.68 * half, "{parameter} for {known}");
    }
    let profile = place.read("p.toml");
    assert!(profile.contains("[sensors.l-beam]") && profile.contains("range_m = 4.0"), "{profile}");
    assert!(profile.contains("bearings_deg = [-45.0, 0.0, 45.0, -90.0]"), "{profile}");
    let other = place.run(&["learn", "sensor", "--run", "r", "--sensor", "lidar", "--edges", "2"]);
    assert!(other.err().contains("leave out --edges"), "{}", other.err());
}
