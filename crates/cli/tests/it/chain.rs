//! The world of chains by the real command: run, record, replay, resume, pictures.

use crate::support::{TestFolder, names, wait_for};
use serde_json::{Value, json};
use sidestep_record::read_table;
use std::path::Path;

/// Two chains among a pillar and a ball that goes to and fro.
const TWO: &str = r#"format = 1
world = "chain"
name = "Two"
seed = 5
cycles = 60

[chain]
dt_s = 0.05

[[obstacles]]
at_m = [1.5, 0.3]
radius_m = 0.2

[[obstacles]]
at_m = [-1.0, 1.5]
radius_m = 0.1
patrol_m = [[-1.0, 1.5], [1.0, 1.5]]

[[chains]]
name = "first"
connectors = 6
at_m = [0.0, 0.0]
rod_m = [0.25, 0.3]
radius_m = 0.05

[[chains.tasks]]
kind = "targets"
targets_m = [[1.2, 0.2], [0.5, 0.5]]
tolerance_m = 0.05

[[chains]]
name = "second"
connectors = 4
at_m = [0.0, -1.0]
rod_m = 0.3
radius_m = 0.05

[[chains.tasks]]
kind = "wander"
speed_m_s = 0.3
"#;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/chain");

fn place() -> TestFolder {
    let place = TestFolder::new();
    place.write("two.toml", TWO);
    place
}

#[test]
fn a_run_says_in_fixed_words_what_came_of_it() {
    let place = place();
    let told = place.json(&["run", "two.toml"]);
    assert_eq!((&told["world"], &told["status"]), (&json!("chain"), &json!("complete")));
    assert!(told["digest"].as_str().is_some_and(|d| d.len() == 32));
    let metrics = &told["metrics"];
    for key in [
        "steps",
        "vetoes",
        "penetrations",
        "min_clearance_m",
        "max_rod_violation_m",
        "progress",
        "steps_per_cpu_s",
    ] {
        assert!(metrics[key].is_number(), "{key}: {metrics}");
    }
    assert_eq!((&metrics["steps"], &metrics["penetrations"]), (&json!(120), &json!(0)));
    let words = place.run(&["run", "two.toml"]).out();
    for word in ["Two", "progress", "vetoes", "penetrations", "none", "clearance", "digest"] {
        assert!(words.contains(word), "{word} is missing in\n{words}");
    }
    assert_eq!(place.names(), ["s.toml", "two.toml"], "without --out nothing is written");
}

#[test]
fn check_counts_what_there_is_and_runs_nothing() {
    let told = place().json(&["check", "two.toml"]);
    for (key, value) in [
        ("chains", 2),
        ("connectors", 10),
        ("rods", 8),
        ("obstacles", 1),
        ("movers", 1),
        ("dimensions", 2),
    ] {
        assert_eq!(told[key], value, "{key}: {told}");
    }
    assert_eq!(
        (&told["name"], &told["cycles"], &told["seed"]),
        (&json!("Two"), &json!(60), &json!(5))
    );
}

#[test]
fn workers_and_recording_change_nothing_and_set_reaches_nested_keys() {
    let place = place();
    let digest =
        |more: &[&str]| place.json(&[&["run", "two.toml"][..], more].concat())["digest"].clone();
    let plain = digest(&[]);
    assert_eq!(digest(&["--workers", "3"]), plain);
    assert_eq!(digest(&["--out", "a", "--workers", "2"]), plain);
    assert_eq!(digest(&["--out", "b", "--set", "record.every=7"]), plain);
    assert_ne!(digest(&["--seed", "6"]), plain);
    for nested in [
        "chain.dt_s=0.04",
        "chains.0.radius_m=0.1",
        "chains.1.tasks.speed_m_s=0.2",
        "chains.0.tasks.targets_m=[[0.3,0.0]]",
    ] {
        assert_ne!(digest(&["--set", nested]), plain, "{nested}");
    }
}

#[test]
fn a_recorded_run_has_tables_and_pictures_and_replays() {
    let place = place();
    let digest = place.json(&["run", "two.toml", "--out", "r"])["digest"].clone();
    let files = names(&place.path("r"));
    for file in [
        "events",
        "movers",
        "trajectories",
        "trajectories.png",
        "trajectories.svg",
        "summary.json",
        "scenario.toml",
    ] {
        assert!(files.contains(&file.to_string()), "{file}: {files:?}");
    }
    assert!(
        std::fs::read(place.path("r/trajectories.png")).expect("a file").starts_with(b"\x89PNG")
    );
    assert!(place.read("r/trajectories.svg").contains("<svg"));
    let rows = |table: &str| read_table(&place.path("r"), table, ..).expect("a table").rows();
    assert_eq!((rows("trajectories"), rows("movers")), (60 * 10, 60));
    let summary: Value = serde_json::from_str(&place.read("r/summary.json")).expect("JSON");
    assert_eq!(summary["per_agent"].as_array().map(Vec::len), Some(2), "{summary}");
    for cycle in ["0", "1", "33", "59"] {
        let replay = place.json(&["replay", "r", "--cycle", cycle]);
        assert_eq!(replay["compared_poses"], 10, "cycle {cycle}: {replay}");
    }
    let end = place.json(&["replay", "r", "--cycle", "60", "--png", "end.png"]);
    assert_eq!(end["digest"], digest);
    assert!(std::fs::read(place.path("end.png")).expect("a file").starts_with(b"\x89PNG"));
    assert_eq!(place.json(&["resume", "r"])["digest"], digest, "told again, not run again");
}

#[test]
fn a_replay_of_changed_rows_says_so() {
    let place = place();
    place.json(&["run", "two.toml", "--out", "r"]);
    place.json(&["run", "two.toml", "--out", "other", "--seed", "6"]);
    std::fs::remove_dir_all(place.path("r/trajectories")).expect("removed");
    std::fs::rename(place.path("other/trajectories"), place.path("r/trajectories")).expect("moved");
    let damaged = place.run(&["replay", "r"]);
    assert_eq!(damaged.code(), 2, "{}", damaged.err());
    assert!(damaged.err().contains("does not match its digest"), "{}", damaged.err());
    crate::support::list_other_rows(&place, "r", "other");
    for cycle in [&["--cycle", "50"][..], &[]] {
        let ended = place.run(&[&["replay", "r"], cycle].concat());
        assert_eq!(ended.code(), 1, "{}", ended.err());
        assert!(ended.err().contains("differ"), "{}", ended.err());
    }
}

#[test]
fn a_killed_run_resumes_to_the_same_digest_and_the_same_rows() {
    let place = place();
    let long = [
        "run",
        "two.toml",
        "--cycles",
        "20000",
        "--set",
        "record.checkpoint_every=4000",
        "--set",
        "chains.1.tasks.lasts_s=900",
    ];
    let mut child = place.start(&[&long[..], &["--out", "r"]].concat());
    wait_for("a checkpoint", || place.path("r/checkpoint.bin").exists());
    child.kill().expect("killed");
    child.wait().expect("ended");
    let resumed = place.json(&["resume", "r", "--workers", "3"]);
    let whole = place.json(&[&long[..], &["--out", "whole"]].concat());
    assert_eq!((&resumed["digest"], &resumed["status"]), (&whole["digest"], &json!("complete")));
    for key in ["vetoes", "min_clearance_m", "progress", "done", "steps"] {
        assert_eq!(resumed["metrics"][key], whole["metrics"][key], "{key}");
    }
    for table in ["trajectories", "movers", "events"] {
        let read = |folder: &str| read_table(&place.path(folder), table, ..).expect("a table");
        assert!(read("r").columns == read("whole").columns, "{table} differs");
    }
}

const PGM: &str = "P2\n8 4\n255\n0 0 0 0 0 0 0 0\n0 254 254 254 254 254 254 0\n\
                   0 254 254 254 254 254 254 0\n0 0 0 0 0 0 0 0\n";
const YAML: &str = "image: m.pgm\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\n\
                    occupied_thresh: 0.65\nfree_thresh: 0.196\n";
const ON_MAP: &str = "format = 1\nworld = \"chain\"\ncycles = 30\n[ground]\nmap = \"m.yaml\"\n\
    [chains]\nconnectors = 3\nat_m = [2.0, 1.0]\nrod_m = 0.3\nradius_m = 0.1\n\
    [chains.tasks]\nkind = \"script\"\nscript_file = \"way.txt\"\n";
const ON_STAGE: &str = "format = 1\nworld = \"chain\"\ncycles = 30\n[ground]\nstage = \"w.world\"\n\
    [chains]\nconnectors = 3\nat_m = [0.0, 1.0]\nrod_m = 0.3\nradius_m = 0.1\n\
    [chains.tasks]\nkind = \"wander\"\n";
const URDF: &str = r#"<robot name="a"><link name="base"/><link name="one"/><link name="two"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="one"/><origin xyz="0 0 0.5"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="j2" type="revolute"><parent link="one"/><child link="two"/><origin xyz="0 0 0.5"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>"#;
const ARM: &str = "format = 1\nworld = \"chain\"\ncycles = 30\n[chain]\ndimensions = 3\n\
    [chains]\narm = { urdf = \"a.urdf\" }\nradius_m = 0.05\n[chains.tasks]\nkind = \"rest\"\nlasts_s = 1\n";

#[test]
fn a_run_folder_needs_no_other_file() {
    let files = [
        ("map.toml", ON_MAP, &[("m.pgm", PGM), ("m.yaml", YAML), ("way.txt", "goto 2.5, 1.1")][..]),
        (
            "stage.toml",
            ON_STAGE,
            &[
                ("m.pgm", PGM),
                ("i.inc", "model ( bitmap \"m.pgm\" size [8 8 1] pose [0 0 0 0] )\n"),
                ("w.world", "include \"i.inc\"\nmodel ( size [1 1 1] pose [-2 2 0 30] )\n"),
            ],
        ),
        ("arm.toml", ARM, &[("a.urdf", URDF)]),
    ];
    for (name, text, inputs) in files {
        let place = TestFolder::new();
        place.write(name, text);
        inputs.iter().for_each(|(file, content)| place.write(file, content));
        let told = place.json(&["run", name, "--out", "r"]);
        for gone in inputs.iter().map(|(file, _)| *file).chain([name]) {
            std::fs::remove_file(place.path(gone)).expect("removed");
        }
        std::fs::rename(place.path("r"), place.path("moved")).expect("moved");
        let cycles = told["cycles"].to_string();
        let replay = place.json(&["replay", "moved", "--cycle", &cycles]);
        assert_eq!(replay["digest"], told["digest"], "{name}");
        let compared = &place.json(&["replay", "moved", "--cycle", "3"])["compared_poses"];
        assert_eq!(compared, &told["robots"], "{name}");
        assert_eq!(place.json(&["run", "moved/scenario.toml"])["digest"], told["digest"], "{name}");
    }
}

#[test]
fn every_scenario_of_chains_that_is_shipped_is_right_and_penetrates_nothing() {
    let place = TestFolder::new();
    let files: Vec<String> =
        names(Path::new(FOLDER)).into_iter().filter(|n| n.ends_with(".toml")).collect();
    assert!(files.len() >= 5, "{files:?}");
    for file in files {
        let path = format!("{FOLDER}/{file}");
        place.json(&["check", &path]);
        let run = place.json(&["run", &path, "--set", "cycles=150"]);
        let metrics = &run["metrics"];
        assert_eq!(metrics["penetrations"], 0, "{file}: {metrics}");
        assert!(metrics["max_rod_violation_m"].as_f64() <= Some(1e-9), "{file}: {metrics}");
        assert!(metrics["steps"].as_u64() > Some(0), "{file}");
    }
}

#[test]
fn missing_parts_of_a_broken_chain_are_told_by_their_number() {
    let scenario = format!("{FOLDER}/broken.toml");
    let wide = ["run", &scenario, "--set", "chains.0.changes.0.apart_m=[-3.0, 0.0]"];
    let told = TestFolder::new().json(&[&wide[..], &["--cycles", "200"]].concat());
    let metrics = &told["metrics"];
    assert_eq!(metrics["not_reformed"], 1);
    assert_eq!(metrics["missing_parts"], 3, "3 m of rods of 1.1 m");
    let words = TestFolder::new().run(&[&wide[..], &["--cycles", "200"]].concat()).out();
    assert!(words.contains("1 times; 3 parts are missing"), "{words}");
}

#[test]
fn a_broken_chain_is_whole_in_the_end_and_goes_on() {
    let told = TestFolder::new().json(&["run", &format!("{FOLDER}/broken.toml")]);
    let metrics = &told["metrics"];
    assert_eq!((&metrics["reformed"], &metrics["progress"]), (&json!(1), &json!(1.0)), "{metrics}");
    assert!(metrics["max_rod_violation_m"].as_f64() <= Some(1e-9), "{metrics}");
}

#[test]
fn a_run_of_no_cycles_and_a_chain_of_one_connector_are_runs() {
    let place = place();
    assert_eq!(place.json(&["run", "two.toml", "--cycles", "0"])["metrics"]["steps"], 0);
    let one = place.json(&["run", "two.toml", "--set", "chains.1.connectors=1"]);
    assert_eq!(one["robots"], 7, "{one}");
}

#[test]
fn a_team_of_agents_runs_is_recorded_and_replayed_and_says_who_was_lost() {
    let place = TestFolder::new();
    let team = format!("{FOLDER}/team.toml");
    assert_eq!(place.json(&["check", &team])["deployment"], "team");
    assert!(place.run(&["check", &team]).out().contains("an agent per connector"));
    let told = place.json(&["run", &team, "--cycles", "320", "--out", "r"]);
    let metrics = &told["metrics"];
    assert_eq!((&metrics["contacts_lost"], &metrics["dropped"]), (&json!(1), &json!(0)));
    assert!(metrics["stood"].as_u64() >= Some(59), "three seconds of 0.05 s: {metrics}");
    assert!(metrics["messages"].as_u64() > Some(10_000), "{metrics}");
    assert_eq!(place.json(&["replay", "r", "--cycle", "320"])["digest"], told["digest"]);
    let words = place.run(&["run", &team, "--cycles", "320", "--workers", "2"]).out();
    assert!(words.contains("1 contacts lost") && words.contains(" bytes"), "{words}");
    let events = read_table(&place.path("r"), "events", ..).expect("a table").rows();
    assert!(events >= 2, "somebody is lost, and heard again");
}

#[test]
fn a_team_that_would_have_to_see_the_whole_chain_is_refused_with_the_key() {
    let place = place();
    let ended = place.run(&["run", "two.toml", "--set", "chain.deployment=team", "--out", "r"]);
    let told = ended.err();
    assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{told}");
    assert!(
        told.contains("self_collision") && told.contains("which no connector of a team sees"),
        "{told}"
    );
    assert_eq!(place.names(), ["s.toml", "two.toml"], "nothing is written");
}
