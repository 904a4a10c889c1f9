//! D1: same build, scenario, seed: identical bits for 1, 2, 3, 8 workers, recorded or not,
//! resumed or not.

use crate::support::TestFolder;
use serde_json::Value;

/// Enough robots that several workers share the work.
const CROWD: [&str; 4] = ["--set", "robots.1.count=40", "--set", "people.count=20"];

fn digest(place: &TestFolder, more: &[&str]) -> Value {
    let args = [&["run", "s.toml", "--cycles", "1500"], &CROWD[..], more].concat();
    place.json(&args)["digest"].clone()
}

#[test]
fn the_number_of_workers_changes_nothing() {
    let place = TestFolder::new();
    let alone = digest(&place, &["--workers", "1"]);
    for workers in ["2", "3", "8"] {
        assert_eq!(digest(&place, &["--workers", workers]), alone, "{workers} workers");
    }
}

#[test]
fn recording_changes_nothing() {
    let place = TestFolder::new();
    let plain = digest(&place, &[]);
    assert_eq!(digest(&place, &["--out", "a"]), plain);
    let calibration = ["--out", "b", "--set", "record.calibration=true"];
    assert_eq!(digest(&place, &calibration), plain);
    let nothing = ["--set", "record.trajectories=false", "--set", "record.events=false"];
    assert_eq!(digest(&place, &[&["--out", "c"], &nothing[..]].concat()), plain);
}

#[test]
fn another_seed_or_regime_is_another_run_and_options_win_over_set() {
    let place = TestFolder::new();
    let run = |more: &[&str]| digest(&place, more);
    let seven = run(&["--seed", "7"]);
    assert_ne!(seven, run(&[]));
    assert_eq!(seven, run(&["--set", "seed=7"]));
    assert_eq!(seven, run(&["--set", "seed=8", "--seed", "7"]));
    let reliable = run(&["--regime", "reliable"]);
    assert_ne!(reliable, run(&[]));
    assert_eq!(reliable, run(&["--set", "regime=reliable"]));
}

#[test]
fn the_resolved_scenario_runs_to_the_same_digest() {
    let place = TestFolder::new();
    let first = digest(&place, &["--seed", "9", "--out", "a"]);
    assert!(place.read("a/scenario.toml").contains("seed = 9"));
    assert_eq!(place.json(&["run", "a/scenario.toml"])["digest"], first);
}

#[test]
fn a_run_folder_needs_no_other_file() {
    let place = TestFolder::new();
    place.write("m.txt", "##########\n#........#\n#..?.....#\n#........#\n##########\n");
    place.write("p.toml", "format = 1\nprofile = \"p\"\n[effectors.mine]\nforward = [{ p = 0.5, path = \"F\" }, { p = 0.5, path = \"\" }]\n");
    place.write("list.scen", "version 1\n0\tm.txt\t10\t5\t1\t1\t8\t3\t7.0\n");
    place.write("f.toml", "format = 1\nworld = \"robots\"\ncycles = 50\nprofiles = [\"p.toml\"]\n[map]\nfile = \"m.txt\"\nbox_size_m = 0.3\nunknown = \"free\"\n[[robots]]\nscen = \"list.scen\"\neffector = \"mine\"\n");
    let digest = place.json(&["run", "f.toml", "--out", "r"])["digest"].clone();
    for gone in ["m.txt", "p.toml", "list.scen", "f.toml"] {
        std::fs::remove_file(place.path(gone)).expect("removed");
    }
    std::fs::rename(place.path("r"), place.path("moved")).expect("moved");
    let replay = place.json(&["replay", "moved", "--cycle", "50"]);
    assert_eq!(replay["digest"], digest);
    assert_eq!(place.json(&["run", "moved/scenario.toml"])["digest"], digest);
}
