//! A run in which robots wait for each other in a circle says so: in its summary, its events and its metrics over time.

use crate::support::{TestFolder, signal, wait_for};
use serde_json::{Value, json};
use sidestep_record::read_table;

/// Six robots in a lane that is as wide as they are, three from each side.
const JAM: &str = r#"format = 1
world = "robots"
cycles = 2000
regime = "reliable"
map = { ascii = """
........................................
........................................
""" }
[[robots]]
at = [[2, 0, 0], [5, 0, 0], [8, 0, 0]]
size = 2
sensors = ["sonar-ring"]
behaviour = { kind = "shuttle", a = [0, 0, 2, 2], b = [38, 0, 2, 2] }
[[robots]]
at = [[30, 0, 2], [33, 0, 2], [36, 0, 2]]
size = 2
sensors = ["sonar-ring"]
behaviour = { kind = "shuttle", a = [38, 0, 2, 2], b = [0, 0, 2, 2] }
[record]
checkpoint_every = 150
"#;

fn jam() -> TestFolder {
    let place = TestFolder::new();
    place.write("jam.toml", JAM);
    place
}

/// Returns the rows of a table as JSON.
fn rows(place: &TestFolder, folder: &str, table: &str) -> Vec<Value> {
    let table = read_table(&place.path(folder), table, ..).expect("a table");
    let columns = table.schema.columns.iter().zip(&table.columns);
    let columns: Vec<_> = columns.collect();
    let row = |row| {
        let cells =
            columns.iter().map(|(spec, values)| (spec.name.clone(), json!(spec.text(values, row))));
        Value::Object(cells.collect())
    };
    (0..table.rows()).map(row).collect()
}

#[test]
fn a_gridlock_is_in_the_summary_in_the_events_and_in_the_metrics_over_time() {
    let place = jam();
    let summary = place.json(&["run", "jam.toml", "--out", "r"]);
    let found = summary["metrics"]["first_gridlock_cycle"].as_u64().expect("a gridlock");
    let events = rows(&place, "r", "events");
    let told: Vec<_> = events.iter().filter(|row| row["event"] == "gridlock").collect();
    assert_eq!(told.len() as u64, summary["metrics"]["gridlocks"], "{told:?}");
    let first = told[0];
    assert_eq!(first["cycle"], (found - 1).to_string());
    let since: u64 = first["since_cycle"].as_str().expect("text").parse().expect("a number");
    assert!((since + 200..since + 500).contains(&found), "{found}, since {since}");
    assert!(first["robots"].as_str().is_some_and(|robots| robots.contains(' ')), "{first}");
    for row in rows(&place, "r", "series") {
        let cycle: u64 = row["cycle"].as_str().expect("text").parse().expect("a number");
        // A row of cycle n is of the state after it, when n + 1 are done.
        assert_eq!(row["gridlocks"] != "0", cycle + 1 >= found, "cycle {cycle}");
    }
    let text = place.run(&["run", "jam.toml"]).out();
    assert!(text.contains("the first one found after cycle"), "{text}");
}

#[test]
fn a_gridlock_does_not_depend_on_workers() {
    let place = jam();
    let alone = place.json(&["run", "jam.toml", "--workers", "1"]);
    for workers in ["2", "3"] {
        let other = place.json(&["run", "jam.toml", "--workers", workers]);
        assert_eq!(other["metrics"], alone["metrics"], "{workers} workers");
    }
}

#[test]
fn a_run_that_is_interrupted_goes_on_with_its_gridlock() {
    let place = jam();
    let long = ["--cycles", "3000000", "--set", "record.series_every=1000"];
    let child = place.start(&[&["run", "jam.toml", "--out", "r"], &long[..]].concat());
    wait_for("a checkpoint", || place.path("r/checkpoint.bin").exists());
    signal(&child, "INT");
    child.wait_with_output().expect("ended");
    let manifest: Value = serde_json::from_str(&place.read("r/run.json")).expect("JSON");
    let done = manifest["cycles_done"].as_u64().expect("a number");
    let until = (done + 2000).to_string();
    let resumed = place.json(&["resume", "r", "--cycles", &until]);
    let whole = place.json(&["run", "jam.toml", "--cycles", &until]);
    assert_eq!(resumed["metrics"], whole["metrics"]);
}

#[test]
fn a_scenario_may_end_its_runs_by_a_gridlock_and_they_say_so() {
    let place = jam();
    let stop = ["--set", "stop.gridlock=true"];
    let summary = place.json(&[&["run", "jam.toml", "--out", "r"], &stop[..]].concat());
    assert_eq!(summary["status"], "complete");
    assert!(summary["cycles"].as_u64() < Some(900), "{}", summary["cycles"]);
    let reason = summary["end_reason"].as_str().expect("a reason");
    assert!(reason.starts_with("a gridlock of "), "{reason}");
    let text = place.run(&[&["run", "jam.toml"], &stop[..]].concat()).out();
    assert!(text.contains("of 2 000, ended by a gridlock of"), "{text}");
    assert_eq!(place.run(&["replay", "r"]).code(), 0);
    assert_eq!(place.run(&["verify", "r"]).code(), 0);
    let whole = place.json(&["run", "jam.toml"]);
    assert_eq!((&whole["cycles"], &whole["end_reason"]), (&json!(2000), &Value::Null));
}
