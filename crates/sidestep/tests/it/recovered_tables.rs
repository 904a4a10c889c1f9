//! Promise: when a run with known tables is simulated and recorded, learning from the recording
//! gives back the tables within the stated error.

use sidestep::import::table::CsvTable;
use sidestep::kernel::Simulation;
use sidestep::kernel::ports::{ColumnSpec, MemoryRecorder, TableSchema};
use sidestep::learn::Estimate;
use sidestep::learn::effector::{self, EffectorOptions};
use sidestep::learn::sensor::{self, SensorOptions};
use sidestep::scenario::Source;
use sidestep::statistics::chi_square_p_value;
use sidestep::worlds::robots::robots_run;
use std::collections::BTreeMap;

const CYCLES: u64 = 4000;

/// Twelve robots in an open hall, with the sensor and effector that are known here.
fn scenario() -> Source {
    let row = ".".repeat(80) + "\n";
    let text = format!(
        r#"
format = 1
world = "robots"
seed = 7
[map]
ascii = """
{}"""
box_size_m = 0.5
[record]
trajectories = false
events = false
calibration = true
[sensors.eye]
bearings_deg = [-30, 0, 30]
range_m = 6.0
observations = ["nothing", "wall", "robot"]
designates = {{ door = "nothing", person = "nothing" }}
distance_edges_m = [2.0]
distance_classes = ["near", "far"]
[sensors.eye.confusion]
nothing = [0.98, 0.015, 0.005]
wall = [0.10, 0.85, 0.05]
robot = [0.15, 0.05, 0.80]
[sensors.eye.distance_confusion]
near = [0.9, 0.1]
far = [0.25, 0.75]
beyond = [0.3, 0.7]
[effectors.wheels]
forward = [{{ p = 0.8, path = "F" }}, {{ p = 0.07, path = "" }}, {{ p = 0.05, path = "FF" }}, {{ p = 0.05, path = "FL" }}, {{ p = 0.03, path = "FR" }}]
left = [{{ p = 0.9, turn = 90 }}, {{ p = 0.1 }}]
right = [{{ p = 0.85, turn = -90 }}, {{ p = 0.1 }}, {{ p = 0.05, turn = 180 }}]
[robots]
count = 12
sensors = ["eye"]
effector = "wheels"
"#,
        row.repeat(80)
    );
    Source::new("scenario.toml", text, "")
}

/// Runs the scenario and writes the table `name` that it recorded as CSV.
fn recorded(name: &str) -> CsvTable {
    let mut run = robots_run(&scenario(), 2).unwrap();
    run.start_recording();
    let schemas = run.schemas();
    let mut recorder = MemoryRecorder::new(&schemas);
    while run.cycle() < CYCLES {
        run.advance(CYCLES - run.cycle());
        run.record(&mut recorder).unwrap();
    }
    let schema = schemas.iter().find(|schema| schema.name == name).unwrap();
    CsvTable::parse(&name, &as_csv(&recorder, schema)).unwrap()
}

/// A recorded table as CSV, labels written out.
fn as_csv(recorder: &MemoryRecorder, schema: &TableSchema) -> String {
    let names: Vec<&str> = schema.columns.iter().map(|column| column.name.as_str()).collect();
    let mut csv = names.join(",") + "\n";
    for row in 0..recorder.row_count(&schema.name) {
        let values = |column: &ColumnSpec| recorder.column(&schema.name, &column.name).unwrap();
        let field = |column: &ColumnSpec| column.text(values(column), row);
        let fields: Vec<String> = schema.columns.iter().map(field).collect();
        csv += &(fields.join(",") + "\n");
    }
    csv
}

/// Asserts that the known probabilities of (row, column) are found: each within an interval's
/// width, and each row as near as chance brings it in 999 of 1000 runs. (Of twenty intervals at 95
/// % one may miss, so it cannot be expected that all contain the truth.)
fn assert_recovered(estimates: &[Estimate], table: &str, known: &[(&str, &str, f64)]) {
    let mut rows: BTreeMap<&str, (f64, usize)> = BTreeMap::new();
    for (row, column, p) in known {
        let found = estimates
            .iter()
            .find(|e| e.table == table && e.row == *row && e.column == *column)
            .unwrap_or_else(|| panic!("{row} {column} was not learned"));
        let interval = found.interval.expect("nothing was left out");
        let width = interval.high - interval.low;
        assert!((found.probability - p).abs() < width, "{found:?} instead of {p}");
        let (expected, fit) = (found.of * p, rows.entry(row).or_default());
        fit.0 += (found.count - expected) * (found.count - expected) / expected;
        fit.1 += 1;
    }
    for (row, (chi_square, columns)) in rows {
        let p_value = chi_square_p_value(chi_square, columns - 1);
        assert!(p_value > 0.001, "{row}: chi-square {chi_square}, p = {p_value}");
    }
}

#[test]
fn the_sensor_of_a_simulated_run_is_recovered() {
    let options = SensorOptions {
        distance_edges_m: vec![2.0],
        distance_classes: ["near", "far"].map(String::from).to_vec(),
        ..Default::default()
    };
    let learned = sensor::learn_csv(&recorded("readings"), &options).unwrap();
    let confusion = [
        ("nothing", "nothing", 0.98),
        ("nothing", "wall", 0.015),
        ("nothing", "robot", 0.005),
        ("wall", "nothing", 0.10),
        ("wall", "wall", 0.85),
        ("wall", "robot", 0.05),
        ("robot", "nothing", 0.15),
        ("robot", "wall", 0.05),
        ("robot", "robot", 0.80),
    ];
    assert_recovered(&learned.report.probabilities, "confusion", &confusion);
    let distance =
        [("near", "near", 0.9), ("near", "far", 0.1), ("far", "near", 0.25), ("far", "far", 0.75)];
    assert_recovered(&learned.report.probabilities, "distance", &distance);
    let beyond = &learned.profile.distance_confusion[2];
    assert!((beyond.probabilities[0] - 0.3).abs() < 0.03, "{beyond:?}");
    assert!(learned.report.hold_out.iter().all(|fit| fit.p_value > 0.001));
}

#[test]
fn the_effector_of_a_simulated_run_is_recovered() {
    let learned = effector::learn_csv(&recorded("motions"), &EffectorOptions::default()).unwrap();
    let known = [
        ("forward", "F", 0.8),
        ("forward", "stay", 0.07),
        ("forward", "FF", 0.05),
        ("forward", "FL", 0.05),
        ("forward", "FR", 0.03),
        ("left", "turn 90", 0.9),
        ("left", "stay", 0.1),
        ("right", "turn -90", 0.85),
        ("right", "stay", 0.1),
        ("right", "turn 180", 0.05),
    ];
    assert_recovered(&learned.report.probabilities, "actions", &known);
    assert_eq!(learned.profile.assumed, Vec::<String>::new());
}
