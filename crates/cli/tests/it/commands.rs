//! The effects of each command, beyond its JSON.

use crate::support::{TestFolder, names};
use sidestep_record::read_table;

#[test]
fn a_recorded_run_leaves_what_the_readme_lists() {
    let place = TestFolder::new();
    let ended = place.run(&["run", "s.toml", "--out", "deep/r"]);
    assert_eq!(ended.code(), 0, "{}", ended.err());
    let next = "Next: `sidestep report deep/r` writes a page with pictures and numbers.\n";
    assert_eq!(ended.err(), next, "and no bar without a terminal");
    let files = names(&place.path("deep/r"));
    let listed = [
        "checkpoint.bin",
        "events",
        "run.json",
        "run.lock",
        "scenario.toml",
        "series",
        "summary.json",
        "trajectories",
        "trajectories.png",
        "trajectories.svg",
    ];
    assert_eq!(files, listed);
    assert!(place.read("deep/r/summary.json").contains("\"per_agent\""));
    let table = read_table(&place.path("deep/r"), "trajectories", ..).expect("a table");
    assert_eq!(table.rows(), 4 * 3000, "three robots and a person");
    assert_eq!(table.origin.seed, 5);
}

#[test]
fn the_report_names_what_a_person_asks_for() {
    let out = TestFolder::new().run(&["run", "s.toml", "--out", "r"]).out();
    for word in ["robots", "cycles", "contacts", "trips", "coverage", "largest", "digest", "r\n"] {
        assert!(out.contains(word), "{word}: {out}");
    }
}

#[test]
fn quiet_keeps_to_the_digest() {
    let place = TestFolder::new();
    let digest = place.json(&["run", "s.toml"])["digest"].as_str().expect("text").to_string();
    assert_eq!(place.run(&["run", "s.toml", "--quiet"]).out(), format!("{digest}\n"));
}

#[test]
fn an_existing_run_is_replaced_only_when_asked() {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--out", "r"]);
    let before = place.read("r/run.json");
    let again = place.run(&["run", "s.toml", "--out", "r", "--seed", "6"]);
    assert_eq!((again.code(), place.read("r/run.json")), (2, before));
    place.json(&["run", "s.toml", "--out", "r", "--seed", "6", "--replace"]);
    assert!(place.read("r/run.json").contains("\"seed\": 6"));
}

#[test]
fn a_folder_with_something_else_is_left_alone() {
    let place = TestFolder::new();
    std::fs::create_dir(place.path("mine")).expect("made");
    place.write("mine/letter.txt", "dear");
    for more in [&[][..], &["--replace"]] {
        let ended = place.run(&[&["run", "s.toml", "--out", "mine"], more].concat());
        assert_eq!(ended.code(), 2, "{}", ended.err());
    }
    assert_eq!(names(&place.path("mine")), ["letter.txt"]);
}

#[test]
fn a_replay_agrees_with_the_record_at_every_cycle_asked() {
    let place = TestFolder::new();
    let digest = place.json(&["run", "s.toml", "--out", "r"])["digest"].clone();
    for cycle in ["0", "1", "699", "700", "2999"] {
        let replay = place.json(&["replay", "r", "--cycle", cycle, "--workers", "2"]);
        assert_eq!(replay["compared_poses"], 4, "cycle {cycle}");
    }
    let end = place.json(&["replay", "r", "--cycle", "3000", "--png", "end.png"]);
    assert_eq!((&end["digest"], &end["compared_poses"]), (&digest, &0.into()));
    assert!(std::fs::read(place.path("end.png")).expect("a file").starts_with(b"\x89PNG"));
    assert_eq!(place.run(&["replay", "r", "--cycle", "3001"]).code(), 2);
}

#[test]
fn a_replay_of_changed_rows_says_so() {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--out", "r"]);
    place.json(&["run", "s.toml", "--out", "other", "--seed", "6"]);
    std::fs::remove_dir_all(place.path("r/trajectories")).expect("removed");
    std::fs::rename(place.path("other/trajectories"), place.path("r/trajectories")).expect("moved");
    let damaged = place.run(&["replay", "r"]);
    assert_eq!(damaged.code(), 2, "{}", damaged.err());
    assert!(damaged.err().contains("does not match its digest"), "{}", damaged.err());
    crate::support::list_other_rows(&place, "r", "other");
    for cycle in [&["--cycle", "500"][..], &[]] {
        let ended = place.run(&[&["replay", "r"], cycle].concat());
        assert_eq!(ended.code(), 1, "{}", ended.err());
        assert!(ended.err().contains("differ"), "{}", ended.err());
    }
}

#[test]
fn new_writes_a_scenario_that_runs_and_overwrites_nothing() {
    for world in ["robots", "airspace", "chain"] {
        let place = TestFolder::new();
        assert_eq!(place.run(&["new", world, "n.toml"]).code(), 0);
        assert_eq!(place.run(&["check", "n.toml"]).code(), 0);
        assert_eq!(place.run(&["run", "n.toml", "--cycles", "20"]).code(), 0);
        let text = place.read("n.toml");
        let again = place.run(&["new", world, "n.toml"]);
        assert_eq!((again.code(), place.read("n.toml")), (2, text));
        assert!(again.err().contains("n.toml"));
    }
}

#[test]
fn every_scenario_that_is_shipped_runs() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/robots");
    let place = TestFolder::new();
    let files: Vec<String> =
        names(folder.as_ref()).into_iter().filter(|n| n.ends_with(".toml")).collect();
    assert!(files.len() >= 4, "{files:?}");
    for file in files {
        let path = format!("{folder}/{file}");
        let run = place.json(&["run", &path, "--cycles", "200"]);
        assert!(run["metrics"]["distance_m"].as_f64() > Some(0.0), "{file}");
    }
}

#[test]
fn map_draws_to_the_terminal_and_to_a_file() {
    let place = TestFolder::new();
    place.write("m.txt", "####\n#..#\n#.?#\n####\n");
    let ended = place.run(&["map", "m.txt", "--box", "0.5", "--png", "m.png"]);
    let drawn = "  ####\n  #..#\n  #.?#\n0 ####\n  0\n4 x 4 pixels";
    assert!(ended.out().starts_with(drawn), "{}", ended.out());
    assert!(std::fs::read(place.path("m.png")).expect("a file").starts_with(b"\x89PNG"));
    let narrow = place.run(&["map", "m.txt", "--width", "4", "--unknown", "free"]).out();
    assert!(narrow.starts_with("  ##\n0 ##\n"), "{narrow}");
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let place = TestFolder::new();
    let row = format!("{}\n", "#".repeat(200));
    place.write("m.txt", row.repeat(2000));
    let mut child = place.start(&["map", "m.txt", "--width", "200"]);
    drop(child.stdout.take());
    assert_eq!(child.wait().expect("ended").code(), Some(0));
}
