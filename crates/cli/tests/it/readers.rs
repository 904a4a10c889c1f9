//! Other people's programs read our files: `mcap`, `pyarrow` and `polars` of Python. The
//! interpreter is that of SIDESTEP_PYTHON, else `python3`; where it or its modules are not here
//! these tests are skipped, unless SIDESTEP_REQUIRE names `python`.

use crate::support::TestFolder;
use serde_json::{Value, json};
use sidestep_testing::{has_modules, python};
use std::path::Path;
use std::process::Command;

/// Chains of a few connectors that wander among moving balls.
const CHAIN: &str = r#"format = 1
world = "chain"
name = "wanderers"
seed = 3
cycles = 60
[chain]
dt_s = 0.05
[[fields]]
lo_m = [-4.0, -4.0]
hi_m = [4.0, 4.0]
n = 6
radius_m = [0.1, 0.3]
speed_m_s = [0.2, 0.6]
[[chains]]
connectors = 8
at_m = [2.0, 0.0]
rod_m = [0.3, 0.4]
radius_m = 0.08
[[chains.tasks]]
kind = "wander"
speed_m_s = 0.4
within_m = [[-3.0, -3.0], [3.0, 3.0]]
"#;

/// Six airplanes that fly to where another one comes from.
const AIRSPACE: &str = r#"format = 1
world = "airspace"
name = "six"
seed = 3
cycles = 80
[airspace]
method = "mvp"
[airspace.generator]
kind = "superconflict"
n = 6
"#;

/// The output of a script.
pub(crate) fn script(name: &str, args: &[&Path]) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python").join(name);
    let output = Command::new(python()).arg(path).args(args).output().expect("python starts");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}: {error}");
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

/// Runs a scenario, recorded in both ways, and reads the recording for viewers.
fn recorded(place: &TestFolder, scenario: &str, more: &[&str]) -> (Value, Value) {
    place.write("any.toml", scenario);
    let run = place.json(&["run", "any.toml", "--out", "r", "--mcap", "r.mcap"]);
    let (recording, table) = (place.path("r.mcap"), place.path("r/trajectories"));
    let mut args = vec![recording.as_path(), table.as_path()];
    args.extend(more.iter().map(Path::new));
    (run, script("read_mcap.py", &args))
}

/// Properties of the recording of any world.
fn check(run: &Value, read: &Value, cycles: u64) {
    let metadata = &read["metadata"];
    assert_eq!(metadata["digest"], run["digest"]);
    assert_eq!(metadata["cycles_done"], run["cycles"].to_string());
    assert_eq!((&metadata["status"], &metadata["format"]), (&json!("complete"), &json!("1.1")));
    assert_eq!(metadata["program_version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(metadata["frames"], (cycles + 1).to_string());
    assert_eq!(metadata["seed"], run["seed"].to_string());
    let frames: Vec<u64> = (0..=cycles).collect();
    assert_eq!(read["cycles"], json!(frames), "a frame for the start of each cycle, and the end");
    for (topic, schema) in [("/scene", "SceneUpdate"), ("/tf", "FrameTransforms")] {
        let expected = json!({ "schema": format!("foxglove.{schema}"), "messages": cycles + 1 });
        assert_eq!(read["topics"][topic], expected);
    }
    assert_eq!(read["topics"]["/scenery"]["messages"], 1);
    let counted: u64 = read["topics"]
        .as_object()
        .expect("topics")
        .values()
        .map(|topic| topic["messages"].as_u64().expect("a number"))
        .sum();
    assert_eq!(read["messages"], counted, "all messages decode");
    assert!(read["scenario"].as_str().is_some_and(|text| text.contains("world = ")));
}

const FOR_MCAP: &str = "mcap.reader, mcap_protobuf.decoder, pyarrow.parquet";

#[test]
fn the_mcap_library_reads_robots_where_the_table_has_them() {
    if !has_modules(FOR_MCAP) {
        return;
    }
    let place = TestFolder::new();
    let scenario = crate::support::SCENARIO.replace("cycles = 3000", "cycles = 200");
    // Robots 0 and 1 have two boxes a side, robot 2 one.
    let (run, read) = recorded(&place, &scenario, &["0.25", r#"{"0": 2, "1": 2, "2": 1}"#]);
    check(&run, &read, 200);
    assert_eq!(read["compared"], 200 * 3, "people are no agents");
    assert_eq!(read["pose_counts"], json!({ "/poses/robot": [3] }));
    assert_eq!(read["topics"]["/map"]["cells"], 24 * 8);
    assert_eq!(read["topics"]["/scan/robot/0/sonar-8"]["messages"], 201);
    assert_eq!(read["entities"], 5, "three robots, a person and a door");
    let events = place.json(&["run", "any.toml"])["metrics"]["contacts"].clone();
    let warnings = read["levels"]["3"].as_u64().unwrap_or(0);
    assert_eq!(json!(warnings), events, "every contact is told as a warning");
}

#[test]
fn the_mcap_library_reads_robots_on_a_turned_map_where_the_world_has_them() {
    if !has_modules(FOR_MCAP) {
        return;
    }
    let place = TestFolder::new();
    let scenario = crate::turned_maps::on_a_map(&place, 30.0, 100);
    let (_, read) = recorded(&place, &scenario, &["0.25", r#"{"0": 2, "1": 2, "2": 1}"#]);
    assert_eq!(read["compared"], 100 * 3);
    let yaw_rad = read["topics"]["/map"]["plane"][2].as_f64().expect("a number");
    assert!((yaw_rad.to_degrees() - 30.0).abs() < 1e-9, "{yaw_rad}");
}

#[test]
fn the_mcap_library_reads_chains_where_the_table_has_them() {
    if !has_modules(FOR_MCAP) {
        return;
    }
    let place = TestFolder::new();
    let (run, read) = recorded(&place, CHAIN, &[]);
    check(&run, &read, 60);
    assert_eq!((&read["compared"], &read["rows"]), (&json!(60 * 8), &json!(60 * 8)));
    assert_eq!(read["pose_counts"], json!({ "/poses/connector": [8] }));
}

#[test]
fn the_mcap_library_reads_airplanes_where_the_table_has_them() {
    if !has_modules(FOR_MCAP) {
        return;
    }
    let place = TestFolder::new();
    let (run, read) = recorded(&place, AIRSPACE, &[]);
    check(&run, &read, run["cycles"].as_u64().expect("a number"));
    assert_eq!(read["compared"], read["rows"]);
    assert_eq!(read["topics"]["/poses/airplane"]["schema"], "foxglove.PosesInFrame");
}

/// Airplanes in a wind that climb, change their speed, follow a recorded way, come in later, and
/// lose separation.
const TRAFFIC: &str = r#"format = 1
world = "airspace"
name = "traffic"
cycles = 90
[airspace]
method = "none"
shield = "off"
wind_m_s = [4.0, -3.0]
replay_until_s = inf
[airspace.generator]
kind = "superconflict"
n = 6
radius_m = 3000.0
[[airplanes]]
at_m = [-2000.0, 100.0]
heading_deg = 10.0
way_points_m = [[2500.0, 0.0]]
orders = [
    { at_s = 20.0, speed_m_s = 45.0 },
    { at_s = 30.0, altitude_m = 350.0, climb_m_s = 3.3 },
    { at_s = 60.0, heading_deg = 200.0 },
    { at_s = 120.0, leaves = true },
]
[[airplanes]]
track = [[3.3, -2500.0, -900.0, 0.0], [61.7, 0.0, 0.0, 200.0], [150.0, 3000.0, 500.0, 0.0]]
[[airplanes]]
at_m = [0.0, 700.0]
heading_deg = 180.0
way_points_m = [[-3000.0, 700.0]]
appears_s = 40.0
"#;

#[test]
fn the_rows_of_a_run_give_its_separation_to_another_program() {
    if !has_modules("numpy, pyarrow.parquet") {
        return;
    }
    let place = TestFolder::new();
    place.write("any.toml", TRAFFIC);
    let run = place.json(&["run", "any.toml", "--out", "r"]);
    let table = place.path("r/trajectories");
    let read = script("separation.py", &[&table, Path::new("500"), Path::new("299.999999")]);
    let summary: Value = serde_json::from_str(&place.read("r/summary.json")).expect("JSON");
    let told = summary["per_pair"].as_array().expect("pairs");
    let lost = |pair: &&Value| pair["losses"] != 0;
    assert!(told.iter().filter(lost).count() >= 3, "{told:?}");
    for pair in told {
        let same = |one: &&Value| one["airplanes"] == pair["airplanes"];
        let found = read["pairs"].as_array().and_then(|all| all.iter().find(same)).expect("rows");
        let differ = |key: &str| {
            (pair[key].as_f64().expect("told") - found[key].as_f64().expect("found")).abs()
        };
        assert!(differ("nearest_m") < 1e-3, "{pair} {found}");
        assert!(differ("lost_s") < 0.05 && pair["losses"] == found["losses"], "{pair} {found}");
    }
    // The last row of an airplane is the place where its flight has ended, which takes no time.
    let arrived = run["metrics"]["arrived"].as_u64().zip(run["metrics"]["left"].as_u64());
    let ends = read["ends"].as_object().expect("airplanes").values();
    let ended = ends.filter(|end| end[2] == 0.0).count() as u64;
    assert_eq!(Some(ended), arrived.map(|(arrived, left)| arrived + left), "{run}");
    assert!(ended >= 8 && read["joints"].as_u64().is_some_and(|joints| joints > 300), "{read}");
}

#[test]
fn pyarrow_and_polars_read_tables_and_their_exports_alike() {
    if !has_modules("polars, pyarrow.parquet") {
        return;
    }
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--out", "r"]);
    place.json(&["export", "r", "--to", "parquet"]);
    place.json(&["export", "r", "--to", "csv"]);
    let read = script(
        "read_tables.py",
        &[
            &place.path("r/trajectories"),
            &place.path("r-parquet/trajectories.parquet"),
            &place.path("r-csv/trajectories.csv"),
        ],
    );
    assert_eq!(read["rows"], 3000 * 4);
    assert_eq!(read["rows_per_body"], json!([3000, 3000, 3000, 3000]));
    assert_eq!(read["last_cycles"], json!([2999, 2999, 2999, 2999]));
    let types = json!({
        "cycle": "uint64", "body": "uint32", "col_boxes": "uint32", "row_boxes": "uint32",
        "heading": "string",
    });
    assert_eq!(read["types"], types);
    let keys = &read["keys"];
    assert_eq!((&keys["sidestep.seed"], &keys["sidestep.format"]), (&json!("5"), &json!("1.1")));
    assert_eq!(keys["sidestep.scenario"], place.read("r/scenario.toml"));
    assert_eq!(keys["sidestep.next_cycle"], "end");
}
