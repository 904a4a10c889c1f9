//! ROS 2 bags: the export equals the simulation, learning gives back the known errors, and a bag that is
//! wrong is refused with place, cause and remedy.

use crate::readers::script;
use crate::support::TestFolder;
use serde_json::{Value, json};
use sidestep_testing::has_modules;
use std::path::Path;

/// One robot in a hall where it rarely meets a wall; class edges are in meters from its border.
fn hall() -> String {
    let row = ".".repeat(60) + "\n";
    format!(
        r#"format = 1
world = "robots"
seed = 7
cycles = 6000
[map]
box_size_m = 0.5
ascii = """
{}"""
[sensors.eye]
bearings_deg = [-90, 0, 90]
range_m = 6.0
observations = ["nothing", "wall"]
designates = {{ door = "nothing", person = "nothing", robot = "nothing" }}
distance_edges_m = [2.0]
distance_classes = ["near", "far"]
[sensors.eye.confusion]
nothing = [0.98, 0.02]
wall = [0.1, 0.9]
[sensors.eye.distance_confusion]
near = [0.9, 0.1]
far = [0.25, 0.75]
beyond = [0.3, 0.7]
[effectors.wheels]
forward = [{{ p = 0.8, path = "F" }}, {{ p = 0.07 }}, {{ p = 0.05, path = "FF" }}, {{ p = 0.05, path = "FL" }}, {{ p = 0.03, path = "FR" }}]
left = [{{ p = 0.9, turn = 90 }}, {{ p = 0.1 }}]
right = [{{ p = 0.85, turn = -90 }}, {{ p = 0.1 }}, {{ p = 0.05, turn = 180 }}]
[robots]
count = 1
sensors = ["eye"]
effector = "wheels"
"#,
        row.repeat(60)
    )
}

const ODOM: [&str; 2] = ["--odom", "/robot_0/odom"];
const TRUTH: [&str; 2] = ["--truth", "/robot_0/ground_truth"];
const SCANS: [&str; 4] = ["--scan", "/robot_0/eye", "--map", "bag/map.yaml"];

/// A bag exported from a run of the hall.
fn exported(cycles: &str) -> TestFolder {
    let place = TestFolder::new();
    place.write("hall.toml", hall());
    place.json(&["run", "hall.toml", "--cycles", cycles, "--out", "r"]);
    let written = place.json(&["export", "r", "--to", "rosbag", "--out", "bag"]);
    let said = (&written["written"], &written["digest_confirmed"]);
    assert_eq!(said, (&json!(["bag"]), &json!(true)));
    place
}

/// Asserts that a learned probability is the known one, within four standard deviations by its count,
/// which is at least `least`.
fn assert_learned(report: &Value, table: &str, cell: [&str; 2], known: f64, least: f64) {
    assert_learned_in(report, table, cell, known, [least, 1.0]);
}

/// Asserts the same where an event gives several rows, which are not independent.
fn assert_learned_in(
    report: &Value,
    table: &str,
    [row, column]: [&str; 2],
    known: f64,
    [least, rows_an_event]: [f64; 2],
) {
    let all = report["probabilities"].as_array().expect("a list");
    let is_meant = |e: &&Value| e["table"] == table && e["row"] == row && e["column"] == column;
    let found = all.iter().find(is_meant).unwrap_or_else(|| panic!("{table}: {row} {column}"));
    let events = found["of"].as_f64().expect("a number") / rows_an_event;
    assert!(events >= least, "{found} rests on little");
    let p = found["probability"].as_f64().expect("a number");
    let most = 4.0 * (known * (1.0 - known) / events).sqrt();
    assert!((p - known).abs() <= most, "{table}: {row} as {column}: {p} in place of {known}");
}

#[test]
fn wheels_and_scanner_of_a_simulated_run_come_back_from_its_bag() {
    let place = exported("6000");
    let learn = ["learn", "effector", "--bag", "bag", "--box", "0.5"];
    let wheels = place.json(&[&learn[..], &ODOM, &TRUTH].concat());
    let forward = [("ahead", 0.8), ("stay", 0.07), ("ahead2", 0.05), ("ahead_left", 0.05)];
    for (outcome, p) in forward {
        assert_learned(&wheels, "moves", ["forward", outcome], p, 4500.0);
    }
    assert_learned(&wheels, "turns", ["left", "turn"], 0.9, 50.0);
    assert_learned(&wheels, "turns", ["right", "turn"], 0.85, 50.0);
    assert_eq!((&wheels["box_m"], &wheels["warnings"]), (&json!(0.5), &json!([])));
    // Ranges are measured from the middle of the robot, a quarter of a meter behind its border.
    let eye = ["--edges", "2.25", "--classes", "near,far", "--range", "6"];
    let learn = ["learn", "sensor", "--bag", "bag"];
    let eye = place.json(&[&learn[..], &TRUTH, &SCANS, &eye].concat());
    assert_learned(&eye, "confusion", ["nothing", "wall"], 0.02, 5000.0);
    assert_learned(&eye, "confusion", ["wall", "nothing"], 0.1, 500.0);
    assert_learned(&eye, "distance", ["near", "far"], 0.1, 100.0);
    assert_learned(&eye, "distance", ["far", "near"], 0.25, 100.0);
    let missed = eye["against_map"]["missed"].as_u64();
    assert_eq!(missed, eye["confusion"]["wall"]["nothing"].as_u64());
}

#[test]
fn what_is_learned_from_a_bag_is_a_profile_that_a_scenario_loads() {
    let place = exported("800");
    let to = |name| ["--profile", "p.toml", "--name", name];
    let learn = ["learn", "effector", "--bag", "bag/bag_0.mcap", "--box", "0.5"];
    place.json(&[&learn[..], &ODOM, &TRUTH, &to("wheels")].concat());
    place.json(&[&["learn", "sensor", "--bag", "bag"][..], &TRUTH, &SCANS, &to("eye")].concat());
    let profile = place.read("p.toml");
    assert!(profile.contains("bearings_deg = [-90.0, 0.0, 90.0]"), "{profile}");
    let known = hall().replace("wheels]", "known]").replace("[sensors.eye", "[sensors.known");
    let scenario = known.replace("seed = 7", "seed = 7\nprofiles = [\"p.toml\"]");
    place.write("again.toml", scenario);
    assert_eq!(place.json(&["run", "again.toml", "--cycles", "50"])["cycles"], 50);
}

#[test]
fn equal_runs_give_equal_bags_and_other_worlds_none() {
    let place = exported("60");
    place.json(&["export", "r", "--to", "rosbag", "--out", "again", "--workers", "3"]);
    let bytes = |name: &str| std::fs::read(place.path(name)).expect("read");
    assert!(bytes("bag/bag_0.mcap") == bytes("again/bag_0.mcap"));
    assert_eq!(place.read("bag/metadata.yaml"), place.read("again/metadata.yaml"));
    let refused = place.run(&["export", "r", "--to", "rosbag", "--out", "bag"]);
    assert!(refused.code() == 2 && refused.err().contains("--replace"), "{}", refused.err());
    place.json(&["export", "r", "--to", "rosbag", "--out", "bag", "--replace"]);
    let text = "format = 1\nworld = \"airspace\"\ncycles = 9\n[airspace]\nmethod = \"mvp\"\n\
                [airspace.generator]\nkind = \"superconflict\"\nn = 2\n";
    place.write("air.toml", text);
    place.json(&["run", "air.toml", "--out", "air"]);
    let refused = place.run(&["export", "air", "--to", "rosbag"]);
    assert!(refused.code() == 2 && refused.err().contains("airspace"), "{}", refused.err());
    assert!(!place.path("air-rosbag").exists());
}

#[test]
fn the_bag_of_the_examples_is_what_its_commands_make() {
    let place = TestFolder::new();
    let examples = sidestep_testing::root().join("examples");
    let building = examples.join("building.toml");
    let one = ["robots.0.count=1", "robots.1.count=0", "people.count=0"];
    let settings: Vec<&str> = one.iter().flat_map(|setting| ["--set", setting]).collect();
    let run = ["run", building.to_str().expect("text"), "--cycles", "1200", "--out", "r"];
    place.json(&[&run[..], &settings].concat());
    place.json(&["export", "r", "--to", "rosbag", "--out", "bag"]);
    for name in ["metadata.yaml", "map.yaml", "map.pgm"] {
        let bytes = |path| std::fs::read(path).expect("read");
        assert!(
            bytes(place.path("bag").join(name)) == bytes(examples.join("logs/rounds").join(name))
        );
    }
    // The packing of chunks is up to a library; their contents are not.
    let learned = |bag: &Path| {
        let bag = ["learn", "effector", "--bag", bag.to_str().expect("text"), "--box", "0.25"];
        let mut report = place.json(&[&bag[..], &ODOM, &TRUTH].concat());
        report["source"] = Value::Null;
        report
    };
    assert_eq!(learned(&place.path("bag")), learned(&examples.join("logs/rounds")));
}

#[test]
fn a_bag_that_is_wrong_is_refused_with_what_is_right() {
    let place = exported("60");
    let bytes = std::fs::read(place.path("bag/bag_0.mcap")).expect("read");
    place.write("cut.mcap", &bytes[..100]);
    place.write("old.bag", "#ROSBAG V1.2\n");
    let refused = |bag: &str, odom: &str, truth: &str, words: &[&str]| {
        let place_of = ["--odom", odom, "--truth", truth, "--profile", "p.toml"];
        let ended = place.run(&[&["learn", "effector", "--bag", bag][..], &place_of].concat());
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{}", ended.err());
        words
            .iter()
            .for_each(|word| assert!(ended.err().contains(word), "{word}: {}", ended.err()));
        assert!(!place.path("p.toml").exists());
    };
    let (odom, truth) = (ODOM[1], TRUTH[1]);
    refused(
        "bag",
        "/odom",
        truth,
        &["error: bag:", "/odom is not there", "/robot_0/odom (nav_msgs"],
    );
    refused("bag", "/robot_0/eye", truth, &["bag: /robot_0/eye", "LaserScan", "Odometry"]);
    refused("cut.mcap", odom, truth, &["cut.mcap", "nothing of the bag can be read", "cut off"]);
    refused("old.bag", odom, truth, &["old.bag", "ROS 1", "version 2.0"]);
    refused(
        "bag",
        odom,
        "/tf:map:base_link",
        &["no transforms lead from `map`", "robot_0/odom > "],
    );
    refused("bag", odom, "/tf:map:a:b", &["/tf:map:a:b: this is not a topic", "/tf:map:base_link"]);
    refused("nowhere", odom, truth, &["nowhere", "cannot be read"]);
    let ended = place.run(&["learn", "effector", "--carmen", "x.log", "--max-speed", "0"]);
    assert!(ended.code() == 2 && ended.err().contains("--max-speed: no robot moves at 0 m/s"));
    // Options that belong together.
    for args in [&["--bag", "bag"][..], &["--csv", "x.csv", "--odom", "/odom"]] {
        let ended = place.run(&[&["learn", "effector"], args].concat());
        assert_eq!(ended.code(), 2, "{args:?}");
    }
}

#[test]
fn a_bag_of_another_program_gives_its_robots_wheels_back() {
    if !has_modules("numpy, rosbags") {
        return;
    }
    let place = TestFolder::new();
    let said = script("write_bag.py", &[Path::new("wheels"), &place.path("drive")]);
    let learn = ["learn", "effector", "--bag", "drive", "--box", "0.5"];
    let wheels = place.json(&[&learn[..], &["--odom", "/odom", "--truth", "/vicon/pose"]].concat());
    for (outcome, k) in [("ahead", 0), ("stay", 1), ("ahead2", 2)] {
        let p = said["forward"][k][1].as_f64().expect("a probability");
        assert_learned(&wheels, "moves", ["forward", outcome], p, 900.0);
    }
    // A turn is several windows, which are not independent: a fourth of them counts.
    let p = said["turn"][0][1].as_f64().expect("a probability");
    for side in ["left", "right"] {
        assert_learned_in(&wheels, "turns", [side, "turn"], p, [100.0, 4.0]);
    }
}

#[test]
fn bags_of_another_program_teach_the_same_in_sqlite_packed_by_message_or_as_a_whole() {
    if !has_modules("numpy, rosbags") {
        return;
    }
    let place = TestFolder::new();
    let mut learned = Vec::new();
    for form in ["mcap", "sqlite", "file"] {
        script("write_bag.py", &[Path::new("wheels"), &place.path(form), Path::new(form)]);
        let learn = ["learn", "effector", "--bag", form, "--box", "0.5"];
        let topics = ["--odom", "/odom", "--truth", "/vicon/pose"];
        let mut report = place.json(&[&learn[..], &topics].concat());
        report["source"] = Value::Null;
        learned.push(report);
    }
    assert_eq!(learned[0]["warnings"], json!([]));
    assert!(learned.iter().all(|report| *report == learned[0]));
}

#[test]
fn a_bag_of_another_program_gives_its_scanner_back() {
    if !has_modules("numpy, rosbags") {
        return;
    }
    let place = TestFolder::new();
    let said = script("write_bag.py", &[Path::new("scanner"), &place.path("rounds")]);
    let at = ["--truth", "/tf:map:base_link", "--scan", "/scan", "--map", "room.yaml"];
    let eye = place.json(&[&["learn", "sensor", "--bag", "rounds"][..], &at].concat());
    let p = |name: &str| said[name].as_f64().expect("a probability");
    assert_learned(&eye, "confusion", ["wall", "nothing"], p("missed"), 5000.0);
    assert_learned(&eye, "confusion", ["nothing", "wall"], p("not_there"), 2000.0);
    let error_m = &eye["range_error_m"];
    assert!(error_m["sd"].as_f64().expect("a number") < 0.1, "{error_m}");
    assert_eq!(eye["warnings"], json!([]));
}

#[test]
fn another_program_reads_an_exported_bag_by_the_definitions_of_ros() {
    if !has_modules("rosbags") {
        return;
    }
    let place = exported("60");
    let said = script("read_bag.py", &[&place.path("bag")]);
    let of = |name: &str, n: u64| json!({ "type": name, "messages": n });
    let topics = json!({
        "/robot_0/odom": of("nav_msgs/msg/Odometry", 61),
        "/robot_0/ground_truth": of("geometry_msgs/msg/PoseStamped", 61),
        "/robot_0/eye": of("sensor_msgs/msg/LaserScan", 61),
        "/tf": of("tf2_msgs/msg/TFMessage", 61),
        "/tf_static": of("tf2_msgs/msg/TFMessage", 1),
    });
    assert_eq!(said["topics"], topics);
    assert_eq!(said["odometry"][0], json!([0.0, 0.0, 0.0]));
    assert_eq!(said["scans"][0][0], "robot_0/eye");
    assert_eq!(said["scans"][0][1], 3);
    let frames =
        json!([["robot_0/base_link", "robot_0/eye"], ["robot_0/odom", "robot_0/base_link"]]);
    assert_eq!(said["frames"], frames);
    // Where the robot truly was at the end is where its trajectory ends, in the middle of its box.
    place.json(&["export", "r", "--to", "csv", "--table", "trajectories", "--out", "t.csv"]);
    let text = place.read("t.csv");
    let last: Vec<&str> = text.lines().last().expect("a row").split(',').collect();
    let middle_m = |boxes: &str| (boxes.parse::<f64>().expect("a number") + 0.5) * 0.5;
    let truth = &said["truth"][last[0].parse::<usize>().expect("a cycle")];
    assert_eq!(*truth, json!([middle_m(last[2]), middle_m(last[3])]));
}
