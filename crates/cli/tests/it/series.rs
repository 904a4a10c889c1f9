//! Metrics over time: each row of the table `series` has the metrics of a run of so many cycles.

use crate::support::TestFolder;
use serde_json::{Value, json};
use sidestep_record::{Table, read_table};

const AIRSPACE: &str = r#"format = 1
world = "airspace"
cycles = 60
[airspace]
method = "mvp"
dt_s = 5
[airspace.generator]
kind = "superconflict"
n = 4
"#;

const CHAIN: &str = r#"format = 1
world = "chain"
cycles = 60
[[obstacles]]
at_m = [3.0, 0.3]
radius_m = 0.4
[[chains]]
connectors = 4
at_m = [0.0, 0.0]
rod_m = 0.7
robots = { radius_m = 0.2 }
[[chains.tasks]]
kind = "targets"
targets_m = [[2.5, 0.0]]
"#;

/// Records a run as the folder `r` and returns its table of metrics.
fn record(place: &TestFolder, scenario: &str, more: &[&str]) -> Table {
    place.json(&[&["run", scenario, "--out", "r", "--replace"], more].concat());
    series(place)
}

fn series(place: &TestFolder) -> Table {
    read_table(&place.path("r"), "series", ..).expect("metrics over time")
}

/// Returns the metric of a summary that a column has.
fn metric(metrics: &Value, column: &str) -> Value {
    let value = |name: &str| metrics.pointer(&format!("/{}", name.replace('.', "/"))).cloned();
    let length = || value(column.strip_suffix("_count")?)?.as_array().map(|list| json!(list.len()));
    value(column).or_else(length).unwrap_or_else(|| panic!("no metric {column}"))
}

/// Returns whether two numbers are the same, whatever their types.
fn is_same(a: &Value, b: &Value) -> bool {
    a == b || a.as_f64().is_some() && a.as_f64() == b.as_f64()
}

#[test]
fn every_row_has_the_metrics_of_a_run_of_so_many_cycles() {
    let place = TestFolder::new();
    place.write("airspace.toml", AIRSPACE);
    place.write("chain.toml", CHAIN);
    for scenario in ["s.toml", "airspace.toml", "chain.toml"] {
        let every = ["--set", "record.series_every=6", "--cycles", "60"];
        let table = record(&place, scenario, &every);
        assert_eq!(table.rows(), 10, "{scenario}");
        assert!(table.columns.len() > 10, "{scenario}");
        for row in 0..table.rows() {
            let cycles = (row + 1) * 6;
            let summary = place.json(&["run", scenario, "--cycles", &cycles.to_string()]);
            assert_eq!(table.columns[0].json(row), json!(cycles - 1));
            for (spec, values) in table.schema.columns.iter().zip(&table.columns).skip(1) {
                let expected = metric(&summary["metrics"], &spec.name);
                let found = values.json(row);
                let name = &spec.name;
                assert!(
                    is_same(&found, &expected),
                    "{scenario}, {cycles}: {name} {found} {expected}"
                );
            }
        }
    }
}

#[test]
fn rows_do_not_depend_on_the_number_of_workers() {
    let place = TestFolder::new();
    let crowd = ["--set", "robots.1.count=40", "--cycles", "1500"];
    let rows = |workers| record(&place, "s.toml", &[&crowd[..], &["--workers", workers]].concat());
    let alone = rows("1");
    assert_eq!(alone.rows(), 750, "every second cycle");
    for workers in ["2", "3"] {
        assert!(rows(workers).columns == alone.columns, "{workers} workers");
    }
}

#[test]
fn the_interval_is_in_the_manifest_and_a_resumed_run_keeps_it() {
    let place = TestFolder::new();
    let whole = record(&place, "s.toml", &[]);
    let manifest = || serde_json::from_str::<Value>(&place.read("r/run.json")).expect("JSON");
    assert_eq!(manifest()["series_every"], 3);
    assert_eq!(whole.rows(), 1000);
    let child = place.start(&["run", "s.toml", "--cycles", "3000000", "--out", "r", "--replace"]);
    crate::support::wait_for("a checkpoint", || {
        manifest()["cycles_planned"] == 3_000_000 && place.path("r/checkpoint.bin").exists()
    });
    crate::support::signal(&child, "INT");
    child.wait_with_output().expect("ended");
    let done = manifest()["cycles_done"].as_u64().expect("a number");
    let until = done + 7001;
    place.json(&["resume", "r", "--cycles", &until.to_string()]);
    assert_eq!(manifest()["series_every"], 3000);
    let cycles: Vec<_> =
        (0..series(&place).rows()).map(|row| series(&place).columns[0].json(row)).collect();
    let expected: Vec<_> = (1..=until / 3000).map(|row| json!(row * 3000 - 1)).collect();
    assert_eq!(cycles, expected);
}

#[test]
fn a_run_without_metrics_over_time_has_no_such_table() {
    let place = TestFolder::new();
    let none = ["--set", "record.series_every=0"];
    place.json(&[&["run", "s.toml", "--cycles", "50", "--out", "r"], &none[..]].concat());
    assert!(!place.path("r/series").exists());
    let manifest: Value = serde_json::from_str(&place.read("r/run.json")).expect("JSON");
    assert_eq!(manifest["series_every"], 0);
    assert_eq!(place.run(&["replay", "r"]).code(), 0);
}

#[test]
fn metrics_over_time_are_exported_verified_and_computed_again_as_other_tables_are() {
    let place = TestFolder::new();
    record(&place, "s.toml", &["--cycles", "100"]);
    place.json(&["export", "r", "--to", "csv", "--table", "series", "--out", "t.csv"]);
    let csv = place.read("t.csv");
    assert!(csv.starts_with("cycle,") && csv.lines().count() == 101, "{csv}");
    assert_eq!(place.run(&["verify", "r"]).code(), 0);
    let replayed = place.json(&["replay", "r"]);
    let rows = ["trajectories", "events", "series"]
        .map(|table| read_table(&place.path("r"), table, ..).expect("a table").rows() as u64);
    assert_eq!(replayed["compared_rows"], rows.iter().sum::<u64>(), "{replayed}");
    // A row of another run.
    let other = TestFolder::new();
    record(&other, "s.toml", &["--cycles", "100", "--seed", "8"]);
    let part = "r/series/part-000000000000000.parquet";
    std::fs::copy(other.path(part), place.path(part)).expect("copied");
    assert_ne!(place.run(&["verify", "r"]).code(), 0);
}

#[test]
fn sweeps_keep_the_metrics_that_they_are_told_and_print_their_means_over_seeds() {
    let place = TestFolder::new();
    let sweep = ["sweep", "s.toml", "--cycles", "40", "--replicate", "3"];
    let bands = |more: &[&str]| place.json(&[&sweep[..], more].concat())["bands"].clone();
    let by_default = bands(&[]);
    assert!(by_default.as_array().is_some_and(|all| all.len() > 1), "{by_default}");
    let told = bands(&["--series", "contacts,distance_m"]);
    let metrics: Vec<&Value> =
        told.as_array().expect("bands").iter().map(|b| &b["metric"]).collect();
    assert_eq!(metrics, ["contacts", "distance_m"]);
    let distance = &told[1];
    let last = |field: &str| distance[field].as_array().and_then(|all| all.last()).cloned();
    assert_eq!((last("cycle"), last("runs")), (Some(json!(40)), Some(json!(3))));
    let runs = (5..8).map(|seed: u32| {
        let seed = seed.to_string();
        let run = place.json(&["run", "s.toml", "--cycles", "40", "--seed", &seed]);
        run["metrics"]["distance_m"].as_f64().expect("a number")
    });
    let mean = runs.sum::<f64>() / 3.0;
    assert!((last("mean").and_then(|mean| mean.as_f64()).expect("a mean") - mean).abs() < 1e-9);
    let bound = |field: &str| last(field).and_then(|bound| bound.as_f64()).expect("a bound");
    assert!(bound("mean_low") <= mean && mean <= bound("mean_high"));
    assert_eq!(bands(&["--series", "none"]), json!([]));
}

#[test]
fn a_sweep_file_says_which_metrics_are_kept_and_an_unknown_one_is_refused_before_any_run() {
    let place = TestFolder::new();
    let file = |series: &str| {
        format!("format = 1\nscenario = \"s.toml\"\nreplicates = 2\n{series}\n[set]\ncycles = 30\n")
    };
    place.write("w.toml", file("series = [\"contacts\"]"));
    place.json(&["sweep", "w.toml", "--out", "w"]);
    let path = place.path("w/series.parquet");
    assert!(path.is_file());
    let told = place.json(&["sweep", "w.toml"]);
    assert_eq!(told["bands"].as_array().map(Vec::len), Some(1), "{}", told["bands"]);
    place.write("none.toml", file("series = []"));
    place.json(&["sweep", "none.toml", "--out", "none"]);
    assert!(!place.path("none/series.parquet").exists());
    place.write("wrong.toml", file("series = [\"contact\"]"));
    let refused = place.run(&["sweep", "wrong.toml", "--out", "wrong"]);
    assert_eq!((refused.code(), place.path("wrong").exists()), (2, false));
    assert!(refused.err().contains("`contact` is no metric"), "{}", refused.err());
    assert!(refused.err().contains("contacts"), "the right one is named: {}", refused.err());
    let refused = place.run(&["run", "s.toml", "--series", "contacts"]);
    assert!(refused.err().contains("it is about many runs"), "{}", refused.err());
}
