//! Promise: the tables learned from a recorded run are those that the run was made with.
//! Simulate with known tables, record, write CSV, learn, write a profile, load it, and
//! compare.

use sidestep::kernel::Simulation;
use sidestep::kernel::ports::{ColumnSpec, ColumnValues, MemoryRecorder, TableSchema};
use sidestep::learn::effector::{self, EffectorOptions};
use sidestep::learn::sensor::SensorOptions;
use sidestep::learn::{Estimate, profile, sensor};
use sidestep::scenario::Source;
use sidestep::worlds::robots::exact::markov_model;
use sidestep::worlds::robots::robots_run;
use sidestep::worlds::robots::scenario::{Behaviours, Compiled, StorageOrder};
use std::path::Path;

const SENSOR: &str = r#"
[sensors.eye]
bearings_deg = [0, 120, 240]
range_m = 3.0
observations = ["nothing", "robot", "wall"]
designates = { door = "nothing", person = "nothing" }
distance_edges_m = [1.0]
distance_classes = ["near", "far"]
[sensors.eye.confusion]
nothing = [0.96, 0.01, 0.03]
robot = [0.15, 0.80, 0.05]
wall = [0.10, 0.05, 0.85]
[sensors.eye.distance_confusion]
near = [0.90, 0.10]
far = [0.25, 0.75]
beyond = [0.30, 0.70]
"#;

const EFFECTOR: &str = r#"
[effectors.wheels]
forward = [{ p = 0.80, path = "F" }, { p = 0.07 }, { p = 0.05, path = "FF" }, { p = 0.05, path = "FL" }, { p = 0.03, path = "FR" }]
left = [{ p = 0.90, turn = 90 }, { p = 0.10 }]
right = [{ p = 0.85, turn = -90 }, { p = 0.10 }, { p = 0.05, turn = 180 }]
"#;

/// 400 halls of 29 x 29 boxes with a robot in the middle of each: after a few actions none
/// has come near a wall, so that no outcome is cut and left out by the learner.
fn halls() -> Source {
    let halls = 20;
    let hall = format!("{}\n", (".".repeat(29) + "#").repeat(halls)).repeat(29);
    let map = format!("{hall}{}\n", "#".repeat(30 * halls)).repeat(halls);
    let places: Vec<String> = (0..halls * halls)
        .map(|k| format!("[{}, {}]", 30 * (k % halls) + 14, 30 * (k / halls) + 15))
        .collect();
    let text = format!(
        "format = 1\nworld = \"robots\"\nseed = 3\n\
         record = {{ trajectories = false, events = false, calibration = true }}\n\
         [map]\nbox_size_m = 0.25\nascii = \"\"\"\n{map}\"\"\"\n\
         [robots]\nat = [{}]\neffector = \"wheels\"\n\
         behaviour = {{ kind = \"random\" }}\n{EFFECTOR}",
        places.join(", ")
    );
    Source::new("halls.toml", text, "")
}

/// Runs and writes the table `name` as CSV into `folder`.
fn record(source: &Source, cycles: u64, name: &str, folder: &Path) -> std::path::PathBuf {
    let mut run = robots_run(source, 2).unwrap_or_else(|e| panic!("{e}"));
    run.start_recording();
    let schemas = run.schemas();
    let mut recorder = MemoryRecorder::new(&schemas);
    run.advance(cycles);
    run.record(&mut recorder).expect("memory takes everything");
    let schema = schemas.iter().find(|s| s.name == name).expect("calibration is on");
    let path = folder.join(format!("{name}.csv"));
    std::fs::write(&path, as_csv(&recorder, schema)).expect("a temporary file");
    path
}

fn as_csv(recorder: &MemoryRecorder, schema: &TableSchema) -> String {
    let names: Vec<&str> = schema.columns.iter().map(|c| c.name.as_str()).collect();
    let columns: Vec<(&ColumnSpec, &ColumnValues)> = schema
        .columns
        .iter()
        .map(|c| (c, recorder.column(&schema.name, &c.name).expect("a column of the schema")))
        .collect();
    let line = |row| columns.iter().map(|(c, v)| c.text(v, row)).collect::<Vec<_>>().join(",");
    let rows: Vec<String> = (0..recorder.row_count(&schema.name)).map(line).collect();
    format!("{}\n{}\n", names.join(","), rows.join("\n"))
}

/// Quantile of the normal distribution for two-sided intervals of 99.9 %.
const Z: f64 = 3.2905;

/// Fails when a known probability lies outside Wilson's 99.9 % interval of its count.
fn assert_recovered(estimates: &[Estimate], table: &str, known: &[(&str, &str, f64)]) {
    for (row, column, p) in known {
        let found = estimates
            .iter()
            .find(|e| e.table == table && e.row == *row && e.column == *column)
            .unwrap_or_else(|| panic!("{table}: {row} {column} was not learned"));
        let z2_n = Z * Z / found.of;
        let center = (found.probability + 0.5 * z2_n) / (1.0 + z2_n);
        let variance = found.probability * (1.0 - found.probability) / found.of;
        let half = Z * (variance + 0.25 * z2_n / found.of).sqrt() / (1.0 + z2_n);
        assert!((p - center).abs() <= half, "{found:?} instead of {p}");
        assert!(found.of > 3000.0, "{found:?} rests on little");
    }
}

#[test]
fn an_effector_comes_back_from_the_log_of_its_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let csv = record(&halls(), 40, "motions", folder.path());
    let learned = effector::from_csv(&csv, &EffectorOptions::default()).unwrap();
    assert!(learned.report.rejected.is_empty(), "{:?}", learned.report.rejected);
    let known = [
        ("forward", "F", 0.80),
        ("forward", "stay", 0.07),
        ("forward", "FF", 0.05),
        ("forward", "FL", 0.05),
        ("forward", "FR", 0.03),
        ("left", "turn 90", 0.90),
        ("left", "stay", 0.10),
        ("right", "turn -90", 0.85),
        ("right", "stay", 0.10),
        ("right", "turn 180", 0.05),
    ];
    assert_recovered(&learned.report.probabilities, "actions", &known);
    assert!(learned.report.hold_out.iter().all(|fit| fit.p_value > 1e-3));

    // The profile is loaded as it was learned.
    let text = profile::with_effector("p", &profile::empty("halls"), "wheels", &learned).unwrap();
    std::fs::write(folder.path().join("learned.toml"), text).expect("a temporary file");
    let scenario = "format = 1\nworld = \"robots\"\nprofiles = [\"learned.toml\"]\n[map]\n\
                    ascii = \"\"\"\n.....\n\"\"\"\n[robots]\nat = [[1, 0, 0]]\neffector = \"wheels\"\n";
    let loaded = Source::new("loaded.toml", scenario, folder.path());
    let compiled = Compiled::new(&loaded, &Behaviours::new(), StorageOrder::ById);
    let model = markov_model(&compiled.unwrap_or_else(|e| panic!("{e}"))).unwrap();
    let forward = learned.profile.action("forward").expect("learned");
    let slip = forward.iter().find(|t| t.path == "FF").expect("two boxes ahead").p;
    let ahead = model.outcome_distribution(model.poses()[0], 0);
    let two_ahead = ahead.iter().find(|(o, _)| o.pose.col == 3).expect("a slip").1;
    assert!((two_ahead - slip).abs() < 1e-12, "{two_ahead} for {slip}");
}

/// A hall in which robots with known delays go about.
fn delayed() -> Source {
    let map = format!("{}\n", ".".repeat(60)).repeat(60);
    let text = format!(
        "format = 1\nworld = \"robots\"\nseed = 9\n\
         record = {{ trajectories = false, events = false, calibration = true }}\n\
         [map]\nbox_size_m = 0.25\nascii = \"\"\"\n{map}\"\"\"\n\
         [robots]\ncount = 100\neffector = \"wheels\"\nbehaviour = {{ kind = \"random\" }}\n{EFFECTOR}\n\
         [effectors.wheels.delays]\np = 0.1\nmin = 1\nmax = 4\n"
    );
    Source::new("delayed.toml", text, "")
}

#[test]
fn delays_come_back_from_the_log_of_their_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let csv = record(&delayed(), 600, "motions", folder.path());
    let learned = effector::from_csv(&csv, &EffectorOptions::default()).unwrap();
    let known = [("delays", "action", "delayed", 0.1)];
    let lengths = ["1", "2", "3", "4"].map(|cycles| ("delay_cycles", "delayed", cycles, 0.25));
    for (table, row, column, p) in known.into_iter().chain(lengths) {
        assert_recovered(&learned.report.probabilities, table, &[(row, column, p)]);
    }
    let delays = learned.report.delays.expect("the log has pauses");
    // Independent pauses: within 3.3 standard errors.
    let limit = Z / (delays.pairs as f64).sqrt();
    assert!(delays.autocorrelation.expect("pauses differ").abs() < limit, "{delays:?}");

    // The profile that was learned delays robots as often.
    let text = profile::with_effector("p", &profile::empty("halls"), "wheels", &learned).unwrap();
    std::fs::write(folder.path().join("learned.toml"), text).expect("a temporary file");
    let own = delayed().text.split("[effectors").next().expect("a text").to_string();
    let loaded = own.replace("seed = 9\n", "seed = 10\nprofiles = [\"learned.toml\"]\n");
    let source = Source::new("loaded.toml", loaded, folder.path());
    let mut run = robots_run(&source, 2).unwrap_or_else(|e| panic!("{e}"));
    run.advance(600);
    let total = run.metrics().total;
    // 2.5 cycles in each tenth action.
    let per_action = total.delayed_cycles as f64 / total.actions as f64;
    assert!((per_action - 0.25).abs() < 0.02, "{per_action} cycles an action");
    assert_eq!(total.actions + total.delayed_cycles, 100 * 600);
}

#[test]
fn a_sensor_comes_back_from_the_log_of_its_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let csv = record(&crowd(), 300, "readings", folder.path());
    let options = SensorOptions {
        distance_edges_m: vec![1.0],
        distance_classes: ["near", "far"].map(String::from).to_vec(),
        ..SensorOptions::default()
    };
    let learned = sensor::from_csv(&csv, &options).unwrap();
    let confusion = [
        ("nothing", "nothing", 0.96),
        ("nothing", "robot", 0.01),
        ("nothing", "wall", 0.03),
        ("robot", "nothing", 0.15),
        ("robot", "robot", 0.80),
        ("robot", "wall", 0.05),
        ("wall", "nothing", 0.10),
        ("wall", "robot", 0.05),
        ("wall", "wall", 0.85),
    ];
    assert_recovered(&learned.report.probabilities, "confusion", &confusion);
    let distance = [
        ("near", "near", 0.90),
        ("near", "far", 0.10),
        ("far", "near", 0.25),
        ("far", "far", 0.75),
    ];
    assert_recovered(&learned.report.probabilities, "distance", &distance);
    let beyond = &learned.profile.distance_confusion[2].probabilities;
    assert!((beyond[0] - 0.30).abs() < 0.05, "{beyond:?}");
}

/// Many robots in one hall with pillars, that meet each other and walls at all distances.
fn crowd() -> Source {
    let row = |pillar: bool| {
        let period = if pillar { ".........#" } else { ".........." };
        period.repeat(6) + "\n"
    };
    let map: String = (0..60).map(|r| row(r % 10 == 5)).collect();
    let text = format!(
        "format = 1\nworld = \"robots\"\nseed = 3\n\
         record = {{ trajectories = false, events = false, calibration = true }}\n\
         [map]\nbox_size_m = 0.25\nascii = \"\"\"\n{map}\"\"\"\n\
         [robots]\ncount = 120\neffector = \"wheels\"\nsensors = [\"eye\"]\n{SENSOR}{EFFECTOR}"
    );
    Source::new("crowd.toml", text, "")
}

const LIDAR: &str = r#"
[sensors.lidar]
bearings_deg = [-90, -45, 0, 45, 90, 135, 180, 225]
range_m = 6.0
observations = ["nothing", "wall"]
designates = { door = "wall", person = "wall", robot = "wall" }
distance_edges_m = [1.0, 3.0]
beam = { hit = 0.80, short = 0.07, max = 0.08, random = 0.05, sigma_hit_m = 0.08, lambda_short_per_m = 0.6 }
"#;

/// Robots with a scanner that errs by the beam model, in a hall with pillars.
fn scanners() -> Source {
    let row = |pillar: bool| if pillar { ".........#" } else { ".........." }.repeat(5) + "\n";
    let map: String = (0..50).map(|r| row(r % 10 == 5)).collect();
    let text = format!(
        "format = 1\nworld = \"robots\"\nseed = 8\n\
         record = {{ trajectories = false, events = false, calibration = true }}\n\
         [map]\nbox_size_m = 0.25\nascii = \"\"\"\n{map}\"\"\"\n\
         [robots]\ncount = 20\nsensors = [\"lidar\"]\neffector = \"wheels\"\n{LIDAR}{EFFECTOR}"
    );
    Source::new("scanners.toml", text, "")
}

#[test]
fn the_beam_model_of_a_scanner_comes_back_from_the_log_of_its_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let csv = record(&scanners(), 120, "ranges", folder.path());
    let options = SensorOptions {
        distance_edges_m: vec![1.0, 3.0],
        range_m: 6.0,
        bearings_deg: vec![-90.0, 0.0, 90.0],
        beam: true,
        ..SensorOptions::default()
    };
    let learned = sensor::from_csv(&csv, &options).unwrap();
    let fit = learned.report.beam.as_ref().expect("asked for");
    assert!(fit.has_converged && fit.scans == 20 * 120, "{fit}");
    let known = [0.80, 0.07, 0.08, 0.05, 0.08, 0.6];
    let mut outside = 0;
    for (parameter, known) in fit.parameters.iter().zip(known) {
        let interval = parameter.interval.expect("there are many ranges");
        // 99.9 % intervals are 1.68 times as wide.
        let off = (parameter.value - known).abs();
        assert!(off < 1.68 * interval.half_width(), "{parameter:?} for {known}");
        outside += u32::from(!interval.contains(known));
    }
    assert!(outside <= 1, "{fit}");

    // The profile has both sensors, and a robot may have either.
    let text = profile::with_sensor("p", &profile::empty("hall"), "lidar", &learned).unwrap();
    std::fs::write(folder.path().join("learned.toml"), text).expect("a temporary file");
    let scenario = "format = 1\nworld = \"robots\"\nprofiles = [\"learned.toml\"]\n[map]\n\
                    ascii = \"\"\"\n.....\n\"\"\"\n[robots]\nat = [[1, 0, 0]]\n\
                    sensors = [\"lidar\", \"lidar-beam\"]\n";
    let loaded = Source::new("loaded.toml", scenario, folder.path());
    let compiled = Compiled::new(&loaded, &Behaviours::new(), StorageOrder::ById);
    let compiled = compiled.unwrap_or_else(|e| panic!("{e}"));
    let beams: Vec<_> = compiled.world.sensors().map(|sensor| sensor.beam).collect();
    let sigma_m = beams[1].expect("the beam model").sigma_hit_m;
    assert!(beams[0].is_none() && (sigma_m - fit.model.sigma_hit_m).abs() < 1e-8);
}

#[test]
fn a_scanner_reports_the_same_for_any_number_of_workers() {
    let digest = |workers: usize| {
        let mut run = robots_run(&scanners(), workers).unwrap_or_else(|e| panic!("{e}"));
        run.advance(60);
        run.digest()
    };
    assert_eq!(digest(1), digest(3));
}
