//! Promise L2 in action: the reports and moves of robots follow the tables of the
//! scenario, and impossible outcomes never happen.

use super::tiles::{Tiles, assert_fits, law, repeating};
use sidestep::error_models::effector::ObstacleRule;
use sidestep::exact::{ActionOutcome, GridPose};
use sidestep::kernel::Simulation;
use sidestep::kernel::ports::{ColumnValues, MemoryRecorder};
use sidestep::scenario::Source;
use sidestep::worlds::robots::{RobotsRun, robots_run};
use std::collections::BTreeMap;

/// A robot that stands still. Its beams meet a wall near by (ahead), a person at medium
/// distance (left), a closed door far off (behind) and nothing (right).
fn watchers(regime: &str) -> Source {
    let mut rows = vec![".".repeat(19); 19];
    rows[9] = ".".repeat(10) + "#" + &".".repeat(8);
    let text = format!(
        r#"
format = 1
world = "robots"
seed = 11
regime = "{regime}"
[map]
box_size_m = 1.0
ascii = """
{}
"""
[robots]
at = [[9, 9, 0]]
sensors = ["eye"]
behaviour = {{ kind = "replay", actions = ["stay"], repeat = true }}
[people]
at = [[9, 13]]
period = 1000000
phase = 1
[doors]
at = [[2, 9]]
periodic = {{ open = 0, closed = 1 }}
[record]
trajectories = false
events = false
calibration = true
[sensors.eye]
bearings_deg = [0, 90, 180, 270]
range_m = 8.0
observations = ["nothing", "wall", "door", "person"]
designates = {{ robot = "person" }}
distance_edges_m = [2.0, 5.0]
distance_classes = ["near", "medium", "far"]
[sensors.eye.confusion]
nothing = [0.90, 0.05, 0.04, 0.01]
wall = [0.10, 0.70, 0.15, 0.05]
door = [0.20, 0.30, 0.45, 0.05]
person = [0.25, 0.05, 0.10, 0.60]
[sensors.eye.confusion_by_class.medium]
person = [0.02, 0.03, 0.05, 0.90]
[sensors.eye.confusion_by_class.beyond]
nothing = [0.70, 0.10, 0.15, 0.05]
[sensors.eye.distance_confusion]
near = [0.80, 0.15, 0.05]
medium = [0.10, 0.75, 0.15]
far = [0.00, 0.30, 0.70]
beyond = [0.20, 0.30, 0.50]
"#,
        rows.join("\n")
    );
    Source::new("watchers.toml", text, "")
}

const NAMES: [&str; 4] = ["nothing", "wall", "door", "person"];
const CLASSES: [&str; 3] = ["near", "medium", "far"];

/// The things that the four beams truly meet, the row that its report is drawn from, and the row of its
/// class: those of [`watchers`], copied by hand.
const TRUTHS: [(&str, &str, [f64; 4], [f64; 3]); 4] = [
    ("wall", "near", [0.10, 0.70, 0.15, 0.05], [0.80, 0.15, 0.05]),
    ("person", "medium", [0.02, 0.03, 0.05, 0.90], [0.10, 0.75, 0.15]),
    ("door", "far", [0.20, 0.30, 0.45, 0.05], [0.00, 0.30, 0.70]),
    ("nothing", "beyond", [0.70, 0.10, 0.15, 0.05], [0.20, 0.30, 0.50]),
];

type Report = (String, String);

/// Runs and counts reports by truth.
fn reports(source: &Source, cycles: u64) -> BTreeMap<Report, BTreeMap<Report, u64>> {
    let mut counts = BTreeMap::new();
    let recorder = recorded(source, cycles);
    let [truth, class, reported, reported_class] =
        ["true", "true_class", "reported", "reported_class"].map(|c| labels(&recorder, c));
    for row in 0..recorder.0.row_count("readings") {
        let truth = (truth[row].clone(), class[row].clone());
        let report = (reported[row].clone(), reported_class[row].clone());
        *counts.entry(truth).or_insert_with(BTreeMap::new).entry(report).or_insert(0) += 1;
    }
    counts
}

/// A recording and the run that it belongs to.
type Recorded = (MemoryRecorder, RobotsRun);

fn recorded(source: &Source, cycles: u64) -> Recorded {
    let mut simulation = robots_run(source, 2).unwrap_or_else(|e| panic!("{e}"));
    simulation.start_recording();
    let mut recorder = MemoryRecorder::new(&simulation.schemas());
    simulation.advance(cycles);
    simulation.record(&mut recorder).expect("memory takes everything");
    (recorder, simulation)
}

/// A column of readings, labels written out.
fn labels((recorder, simulation): &Recorded, column: &str) -> Vec<String> {
    let schemas = simulation.schemas();
    let readings = schemas.iter().find(|s| s.name == "readings").expect("calibration is on");
    let spec = readings.columns.iter().find(|c| c.name == column).expect("a column");
    let Some(ColumnValues::Label(values)) = recorder.column("readings", column) else {
        panic!("{column} holds labels")
    };
    values.iter().map(|&v| spec.labels[v as usize].clone()).collect()
}

/// `P(report)` for independent draws of observation and class; a missed report is `beyond`.
fn joint(seen: &[f64; 4], classes: &[f64; 3]) -> BTreeMap<Report, f64> {
    let mut joint = BTreeMap::from([(("nothing".into(), "beyond".into()), seen[0])]);
    for (name, p) in NAMES.iter().zip(seen).skip(1) {
        for (class, q) in CLASSES.iter().zip(classes) {
            joint.insert((name.to_string(), class.to_string()), p * q);
        }
    }
    joint
}

#[test]
fn reports_follow_the_joint_distribution_of_observation_and_class() {
    let reports = reports(&watchers("both"), 20_000);
    assert_eq!(reports.len(), 4, "each beam has one truth: {:?}", reports.keys());
    for (name, class, seen, classes) in &TRUTHS {
        let counts = &reports[&(name.to_string(), class.to_string())];
        assert_eq!(counts.values().sum::<u64>(), 20_000);
        assert_fits(name, counts, &joint(seen, classes));
    }
}

/// The contingency table of reported observations and distances, against the product of
/// its own margins: no table of the scenario enters.
#[test]
fn observation_and_class_are_drawn_independently() {
    for (truth, counts) in reports(&watchers("sensors"), 20_000) {
        let something = counts.into_iter().filter(|(r, _)| r.0 != "nothing");
        let counts: BTreeMap<Report, u64> = something.collect();
        let total = counts.values().sum::<u64>() as f64;
        let margin = |keep: &dyn Fn(&Report) -> bool| {
            counts.iter().filter(|(r, _)| keep(r)).map(|(_, &n)| n as f64).sum::<f64>() / total
        };
        let product = |(o, c): &Report| margin(&|r| r.0 == *o) * margin(&|r| r.1 == *c);
        let expected = counts.keys().map(|r| (r.clone(), product(r))).collect();
        assert_fits(&format!("{truth:?}"), &counts, &expected);
    }
}

#[test]
fn a_regime_switches_the_errors_of_sensors_on_and_off() {
    for (regime, errs) in
        [("reliable", false), ("effectors", false), ("sensors", true), ("both", true)]
    {
        for (truth, counts) in reports(&watchers(regime), 500) {
            let wrong = counts.iter().filter(|(report, _)| **report != truth).count();
            assert_eq!(wrong > 0, errs, "{regime}: {truth:?} reported as {counts:?}");
        }
    }
}

/// Free boxes all around, so that no drift meets anything.
const OPEN: [&str; 4] = [
    "....... ....... ....... ...>... ....... ....... .......",
    "....... ....... ....... ...^... ....... ....... .......",
    "....... ....... ....... ...<... ....... ....... .......",
    "....... ....... ....... ...v... ....... ....... .......",
];

/// 3600 robots do one action.
fn one_action(art: &str, regime: &str, action: &str) -> BTreeMap<ActionOutcome, u64> {
    let tiles = Tiles::new(art, 60)
        .keys(&format!("regime = \"{regime}\""))
        .robots(&format!("effector = \"nomad\"\n{}", repeating(action)));
    let mut simulation = tiles.simulation();
    simulation.advance(1);
    tiles.outcomes(&simulation)
}

/// The ends of the nomad's actions in a free place, for a body at `[3, 3]`: written for each
/// heading by hand.
fn in_the_open(heading: u8, action: &str) -> BTreeMap<ActionOutcome, f64> {
    let ahead = [(1, 0), (0, 1), (-1, 0), (0, -1)][usize::from(heading)];
    let left = [(0, 1), (-1, 0), (0, -1), (1, 0)][usize::from(heading)];
    let at = |a: i32, l: i32, turn: u8| ActionOutcome {
        pose: GridPose {
            col: 3 + a * ahead.0 + l * left.0,
            row: 3 + a * ahead.1 + l * left.1,
            heading: (heading + turn) % 4,
        },
        contact: None,
    };
    let table = match action {
        "forward" => vec![
            (at(1, 0, 0), 0.88),
            (at(0, 0, 0), 0.04),
            (at(2, 0, 0), 0.02),
            (at(1, 1, 0), 0.03),
            (at(1, -1, 0), 0.03),
        ],
        "left" => vec![(at(0, 0, 1), 0.95), (at(0, 0, 0), 0.04), (at(0, 0, 2), 0.01)],
        "right" => vec![(at(0, 0, 3), 0.95), (at(0, 0, 0), 0.04), (at(0, 0, 2), 0.01)],
        _ => vec![(at(0, 0, 0), 1.0)],
    };
    table.into_iter().collect()
}

#[test]
fn moves_in_the_open_follow_the_transitions_for_every_heading_and_action() {
    for (heading, art) in OPEN.iter().enumerate() {
        for action in ["forward", "left", "right", "stay"] {
            let expected = in_the_open(heading as u8, action);
            let what = format!("{action} heading {heading}");
            assert_fits(&what, &one_action(art, "both", action), &expected);
        }
    }
}

#[test]
fn a_regime_switches_the_errors_of_effectors_on_and_off() {
    for (regime, errs) in
        [("reliable", false), ("effectors", true), ("sensors", false), ("both", true)]
    {
        for (heading, art) in OPEN.iter().enumerate() {
            for action in ["forward", "left"] {
                let outcomes = one_action(art, regime, action);
                let intended = in_the_open(heading as u8, action);
                let (likeliest, _) = intended.iter().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
                assert!(outcomes[likeliest] > 3000, "{regime}: {outcomes:?}");
                assert_eq!(outcomes.len() > 1, errs, "{regime}: {outcomes:?}");
            }
        }
    }
}

/// Two robots in the middle of every one of 900 tiles, at the given boxes and headings.
fn pairs(robots: [[i32; 3]; 2], effector: &str, seed: u64) -> Source {
    let tile = format!("{}\n", (".".repeat(7) + "#").repeat(30)).repeat(7);
    let map = format!("{tile}{}\n", "#".repeat(240)).repeat(30);
    let places: Vec<String> = (0..900)
        .flat_map(|tile| robots.map(|[c, r, h]| (c + 8 * (tile % 30), r + 8 * (tile / 30), h)))
        .map(|(c, r, h)| format!("[{c}, {}, {h}]", r + 1))
        .collect();
    let text = format!(
        "format = 1\nworld = \"robots\"\nseed = {seed}\n[map]\nascii = \"\"\"\n{map}\"\"\"\n\
         [robots]\nat = [{}]\neffector = \"own\"\n{}\n[effectors.own]\nforward = {effector}\n",
        places.join(", "),
        repeating("forward"),
    );
    Source::new("pairs.toml", text, "")
}

/// The places of both robots of each tile after one cycle.
fn meet(robots: [[i32; 3]; 2], effector: &str, seed: u64) -> Vec<[(i32, i32); 2]> {
    let source = pairs(robots, effector, seed);
    let mut simulation = robots_run(&source, 2).unwrap_or_else(|e| panic!("{e}"));
    simulation.advance(1);
    let bodies = simulation.snapshot().bodies;
    let in_tile = |at: (u32, u32)| ((at.0 % 8) as i32, (at.1 % 8) as i32 - 1);
    bodies.chunks(2).map(|pair| [in_tile(pair[0].at), in_tile(pair[1].at)]).collect()
}

#[test]
fn a_slip_of_two_boxes_sweeps_the_box_between() {
    let blocked = "..... ..... ..P.. ..^..";
    let tiles = Tiles::new(blocked, 20)
        .keys(&law(ObstacleRule::Cut))
        .sections("[effectors.own]\nforward = [{ p = 1.0, path = \"FF\" }]")
        .robots(&format!("effector = \"own\"\n{}", repeating("forward")));
    let mut simulation = tiles.simulation();
    simulation.advance(1);
    assert!(tiles.outcomes(&simulation).keys().all(|o| o.pose == tiles.start()));

    // One slips north through [3, 4]; the other goes two boxes east onto it or through it.
    let slip = "[{ p = 1.0, path = \"FF\" }]";
    for seed in 0..5 {
        for pair in meet([[3, 3, 1], [1, 4, 0]], slip, seed) {
            let north_first = [(3, 5), (3, 4)];
            let east_first = [(3, 3), (3, 4)];
            assert!(pair == north_first || pair == east_first, "{pair:?}");
        }
        for pair in meet([[3, 3, 1], [2, 4, 0]], slip, seed) {
            // Both pass through [3, 4] one after the other.
            assert_eq!(pair, [(3, 5), (4, 4)]);
        }
    }
}

#[test]
fn two_robots_head_on_never_change_places() {
    for path in ["F", "FF"] {
        let forward = format!("[{{ p = 1.0, path = \"{path}\" }}]");
        for seed in 0..5 {
            for [a, b] in meet([[3, 3, 0], [4, 3, 2]], &forward, seed) {
                assert_eq!([a, b], [(3, 3), (4, 3)], "{path}");
            }
            for [a, b] in meet([[2, 3, 0], [4, 3, 2]], &forward, seed) {
                assert!(a.0 < b.0 && a.1 == 3 && b.1 == 3, "{path}: {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn two_robots_side_by_side_never_cross_diagonally() {
    let drifts = "[{ p = 0.5, path = \"FL\" }, { p = 0.5, path = \"FR\" }]";
    let mut seen = BTreeMap::new();
    for seed in 0..10 {
        for pair in meet([[3, 3, 1], [4, 3, 1]], drifts, seed) {
            assert_ne!(pair[0], pair[1], "two robots in one box");
            assert_ne!(pair, [(4, 4), (3, 4)], "they crossed");
            *seen.entry(pair).or_insert(0u64) += 1;
        }
    }
    // A fair draw says which goes first; the other is stopped where the first stands.
    let expected = BTreeMap::from([
        ([(2, 4), (5, 4)], 1.0 / 4.0),
        ([(2, 4), (3, 4)], 1.0 / 8.0),
        ([(4, 4), (5, 4)], 1.0 / 8.0),
        ([(4, 4), (4, 3)], 1.0 / 4.0),
        ([(3, 3), (3, 4)], 1.0 / 4.0),
    ]);
    assert_fits("side by side", &seen, &expected);
}
