//! Promise: the exported POMDP is a valid file of Cassandra's format, with rows that sum to
//! 1 to the last printed digit, and it agrees with the simulator.

use super::tiles::{Tiles, assert_fits};
use sidestep::exact::{Beam, MarkovModel, PomdpOptions};
use sidestep::kernel::Simulation;
use sidestep::kernel::ports::{ColumnValues, MemoryRecorder};
use sidestep::worlds::robots::exact::markov_model;
use sidestep::worlds::robots::scenario::{Behaviours, Compiled, StorageOrder};
use std::collections::BTreeMap;

/// Probabilities in the file have at most 12 decimals.
const UNIT: u64 = 1_000_000_000_000;

/// A file, read back by the words of its lines.
#[derive(Debug, Default)]
struct File {
    states: Vec<String>,
    actions: Vec<String>,
    observations: Vec<String>,
    start: String,
    discount: f64,
    /// Successors and their probabilities in units, by (action, state).
    transitions: BTreeMap<(String, String), BTreeMap<String, u64>>,
    /// Observations and their probabilities in units, by state.
    readings: BTreeMap<String, BTreeMap<String, u64>>,
    /// Rewards by successor.
    rewards: BTreeMap<String, f64>,
}

impl File {
    fn read(text: &str) -> Self {
        let mut file = Self::default();
        for line in text.lines().filter(|l| !l.is_empty() && !l.starts_with('#')) {
            let (key, rest) = line.split_once(':').expect("key: value");
            let list = || rest.split_whitespace().map(String::from).collect::<Vec<_>>();
            match key {
                "discount" => file.discount = rest.trim().parse().expect("a number"),
                "values" => assert_eq!(rest.trim(), "reward"),
                "states" => file.states = list(),
                "actions" => file.actions = list(),
                "observations" => file.observations = list(),
                "start" => file.start = rest.trim().into(),
                "T" | "O" | "R" => file.entry(key, &list()),
                _ => panic!("unknown key {key}"),
            }
        }
        file
    }

    fn entry(&mut self, key: &str, words: &[String]) {
        let fields: Vec<&str> = words.iter().map(String::as_str).collect();
        match (key, &fields[..]) {
            ("T", [action, ":", from, ":", to, p]) => {
                assert!(self.actions.iter().any(|a| a == action) && self.is_state(from));
                assert!(self.is_state(to));
                let row = self.transitions.entry((action.to_string(), from.to_string()));
                assert!(row.or_default().insert(to.to_string(), units(p)).is_none());
            }
            ("O", ["*", ":", state, ":", observation, p]) => {
                assert!(self.is_state(state) && self.observations.iter().any(|o| o == observation));
                let row = self.readings.entry(state.to_string()).or_default();
                assert!(row.insert(observation.to_string(), units(p)).is_none());
            }
            ("R", ["*", ":", "*", ":", "*", ":", "*", "0"]) => {}
            ("R", ["*", ":", "*", ":", to, ":", "*", reward]) => {
                assert!(self.is_state(to));
                self.rewards.insert(to.to_string(), reward.parse().expect("a number"));
            }
            _ => panic!("no entry of the format: {words:?}"),
        }
    }

    fn is_state(&self, name: &str) -> bool {
        self.states.iter().any(|s| s == name)
    }
}

/// A decimal in units of the twelfth decimal, read digit by digit.
fn units(decimal: &str) -> u64 {
    let (whole, rest) = decimal.split_once('.').unwrap_or((decimal, ""));
    assert!(rest.len() <= 12, "{decimal}");
    whole.parse::<u64>().expect("digits") * UNIT
        + format!("{rest:0<12}").parse::<u64>().expect("digits")
}

const EYE: &str = r#"
[sensors.eye]
bearings_deg = [90, 10]
range_m = 1.0
observations = ["nothing", "wall"]
designates = { door = "wall", person = "wall", robot = "wall" }
distance_edges_m = [0.3]
distance_classes = ["near", "far"]
[sensors.eye.confusion]
nothing = [0.9, 0.1]
wall = [0.2, 0.8]
[sensors.eye.distance_confusion]
near = [0.7, 0.3]
far = [0.1, 0.9]
"#;

fn tiles(across: u32) -> Tiles {
    with_sensor(across, EYE)
}

/// Recorded readings do not name the beam.
fn one_beam(across: u32) -> Tiles {
    with_sensor(across, &EYE.replace("[90, 10]", "[90]"))
}

fn with_sensor(across: u32, sensor: &str) -> Tiles {
    Tiles::new("....# .#... ...>.", across)
        .keys("record = { trajectories = true, events = false, calibration = true }")
        .sections(sensor)
        .robots("effector = \"nomad\"\nsensors = [\"eye\"]\nbehaviour = { kind = \"random\" }")
}

fn model(tiles: &Tiles) -> MarkovModel {
    let compiled = Compiled::new(&tiles.source(), &Behaviours::new(), StorageOrder::ById);
    markov_model(&compiled.unwrap_or_else(|e| panic!("{e}"))).unwrap_or_else(|e| panic!("{e}"))
}

fn file(options: &PomdpOptions) -> File {
    File::read(&model(&tiles(1)).pomdp(options).unwrap_or_else(|e| panic!("{e}")).to_string())
}

fn beams(indices: &[usize]) -> Option<Vec<Beam>> {
    Some(indices.iter().map(|&index| Beam { sensor: "eye".into(), index }).collect())
}

#[test]
fn every_row_is_there_and_sums_to_one_in_the_digits_printed() {
    for contacts in [false, true] {
        for beams in [None, beams(&[]), beams(&[0, 1]), beams(&[1, 0, 1])] {
            let options = PomdpOptions { contacts, beams, ..PomdpOptions::default() };
            let file = file(&options);
            for (name, row) in &file.transitions {
                assert_eq!(row.values().sum::<u64>(), UNIT, "{name:?}");
            }
            assert_eq!(file.transitions.len(), file.states.len() * file.actions.len());
            assert!(file.readings.values().all(|row| row.values().sum::<u64>() == UNIT));
            assert_eq!(file.readings.len(), file.states.len());
            let size = model(&tiles(1)).pomdp(&options).unwrap().size();
            assert_eq!(
                (size.states, size.observations),
                (file.states.len(), file.observations.len())
            );
        }
    }
}

#[test]
fn the_file_says_what_was_computed_by_hand() {
    let file = file(&PomdpOptions { goal: Some((4, 0)), ..PomdpOptions::default() });
    assert_eq!((file.start.as_str(), file.discount), ("c3r0-east", 0.95));
    assert_eq!(file.actions, ["forward", "left", "right", "stay"]);
    // Ahead one free box, then the wall; drifts: free to the left, a wall to the right.
    let row = &file.transitions[&("forward".to_string(), "c3r0-east".to_string())];
    let expected = [
        ("c4r0-east", 880_000_000_000),
        ("c3r0-east", 40_000_000_000),
        ("c4r0-east-front-wall", 20_000_000_000),
        ("c4r1-east", 30_000_000_000),
        ("c4r0-east-right-wall", 30_000_000_000),
    ];
    assert_eq!(*row, expected.map(|(name, p)| (name.to_string(), p)).into());
    // The beam nearest to the heading is the second. From [3, 0] it meets the wall behind one
    // free box of 0.25 m: near.
    let seen = &file.readings["c3r0-east"];
    let expected = [
        ("free_nothing", 200_000_000_000),
        ("free_wall-near", 560_000_000_000),
        ("free_wall-far", 240_000_000_000),
    ];
    assert_eq!(*seen, expected.map(|(name, p)| (name.to_string(), p)).into());
    let felt = &file.readings["c4r0-east-front-wall"];
    assert!(felt.keys().all(|o| o.starts_with("front-wall_")));
    assert!(file.rewards.iter().all(|(s, r)| s.starts_with("c4r0-") && *r == 1.0));
    assert_eq!(file.rewards.len(), file.states.iter().filter(|s| s.starts_with("c4r0-")).count());
}

/// Readings of the simulator, by the pose at which they were taken, against the rows of the
/// exported file.
#[test]
fn the_simulator_reports_what_the_file_says() {
    let options = PomdpOptions { contacts: false, beams: beams(&[0]), ..Default::default() };
    let file = File::read(&model(&one_beam(1)).pomdp(&options).unwrap().to_string());
    let tiles = one_beam(20);
    let mut simulation = tiles.simulation();
    simulation.start_recording();
    let mut recorder = MemoryRecorder::new(&simulation.schemas());
    simulation.advance(100);
    simulation.record(&mut recorder).expect("memory takes everything");
    let labels = |column: &str| labels(&recorder, &simulation.schemas(), column);
    let (seen, class) = (labels("reported"), labels("reported_class"));
    let poses = poses_by_cycle(&recorder);
    let mut counts: BTreeMap<String, BTreeMap<String, u64>> = BTreeMap::new();
    for (row, pose) in poses.into_iter().enumerate() {
        let name = if seen[row] == "nothing" {
            seen[row].clone()
        } else {
            format!("{}-{}", seen[row], class[row])
        };
        *counts.entry(pose).or_default().entry(name).or_insert(0) += 1;
    }
    assert!(counts.len() > 30, "robots come about: {}", counts.len());
    for (pose, counts) in counts.iter().filter(|(_, c)| c.values().sum::<u64>() > 300) {
        let row = file.readings[pose].iter();
        let exact = row.map(|(o, &u)| (o.clone(), u as f64 / UNIT as f64)).collect();
        assert_fits(pose, counts, &exact);
    }
}

/// Names of the poses in the order of the readings: by cycle, then by robot.
fn poses_by_cycle(recorder: &MemoryRecorder) -> Vec<String> {
    let numbers = |column: &str| match recorder.column("trajectories", column) {
        Some(ColumnValues::U32(values) | ColumnValues::Label(values)) => values.to_vec(),
        Some(ColumnValues::U64(values)) => values.iter().map(|&v| v as u32).collect(),
        _ => panic!("{column}"),
    };
    let [cycle, body, col, row, heading] =
        ["cycle", "body", "col_boxes", "row_boxes", "heading"].map(numbers);
    let mut rows: Vec<(u32, u32, String)> = (0..cycle.len())
        .map(|k| {
            let heading = ["east", "north", "west", "south"][heading[k] as usize];
            // Tiles of 5 x 3 boxes and their walls.
            (cycle[k], body[k], format!("c{}r{}-{heading}", col[k] % 6, row[k] % 4))
        })
        .collect();
    rows.sort();
    rows.into_iter().map(|row| row.2).collect()
}

fn labels(
    recorder: &MemoryRecorder,
    schemas: &[sidestep::kernel::ports::TableSchema],
    column: &str,
) -> Vec<String> {
    let readings = schemas.iter().find(|s| s.name == "readings").expect("calibration is on");
    let spec = readings.columns.iter().find(|c| c.name == column).expect("a column");
    let Some(ColumnValues::Label(values)) = recorder.column("readings", column) else {
        panic!("labels")
    };
    values.iter().map(|&v| spec.labels[v as usize].clone()).collect()
}

#[test]
fn options_that_do_not_fit_are_refused() {
    let model = model(&tiles(1));
    let refused = |options: PomdpOptions| model.pomdp(&options).expect_err("refused");
    let default = PomdpOptions::default;
    for discount in [0.0, 1.0, f64::NAN] {
        assert_eq!(refused(PomdpOptions { discount, ..default() }).place(), "--discount");
    }
    for goal in [(1, 1), (4, 2), (99, 0), (u32::MAX, 0)] {
        assert_eq!(refused(PomdpOptions { goal: Some(goal), ..default() }).place(), "--goal");
    }
    let beams = |indices| PomdpOptions { beams: beams(indices), ..default() };
    assert_eq!(refused(beams(&[2])).remedy(), "count beams from 0 to 1");
    assert_eq!(refused(beams(&[0, 1, 0, 1])).cause(), "4 beams");
    let unknown = vec![Beam { sensor: "eyes".into(), index: 0 }];
    let error = refused(PomdpOptions { beams: Some(unknown), ..default() });
    assert_eq!((error.place(), error.remedy()), ("--sensor", "did you mean `eye`?"));
}
