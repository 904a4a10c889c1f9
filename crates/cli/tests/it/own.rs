//! A program with parts of its own, `examples/own_command.rs`, has the whole command line.

use crate::support::{CommandOutput, TestFolder};
use std::path::Path;
use std::process::{Command, Stdio};

const WALL: &str = r#"format = 1
world = "robots"
cycles = 300
map = { office = { corridors = 1, rooms_per_side = 3 } }
robots = { count = 5, size = 2, sensors = ["sonar-8"], effector = "nomad", behaviour = { kind = "wall" } }
"#;

const SKY: &str = r#"format = 1
world = "airspace"
cycles = 60
airspace = { method = "keep-right", generator = { kind = "superconflict", n = 6 } }
"#;

const CHAIN: &str = r#"format = 1
world = "chain"
cycles = 300
chain = { rotation = "straight" }
obstacles = { at_m = [1.0, 0.9], radius_m = 0.2 }
chains = { connectors = 5, at_m = [0.0, 0.0], rod_m = [0.4, 0.5], tasks = [{ kind = "back-and-forth" }] }
"#;

/// A place with scenarios that name parts which `sidestep` itself does not have.
fn place() -> TestFolder {
    let place = TestFolder::new();
    place.write("wall.toml", WALL);
    place.write("sky.toml", SKY);
    place.write("chain.toml", CHAIN);
    place
}

/// Runs the program of our own; cargo builds examples beside the tests.
fn own(place: &TestFolder, args: &[&str]) -> CommandOutput {
    let folder = Path::new(env!("CARGO_BIN_EXE_sidestep")).parent().expect("a folder");
    let program = format!("own_command{}", std::env::consts::EXE_SUFFIX);
    let mut command = Command::new(folder.join("examples").join(program));
    command.args(args).current_dir(place.path("")).stdin(Stdio::null());
    CommandOutput(command.output().expect("the example is built"))
}

fn assert_done(place: &TestFolder, args: &[&str]) {
    let ended = own(place, args);
    assert_eq!(ended.code(), 0, "{args:?}: {}", ended.err());
}

/// Returns the digest at the end of a run.
fn digest(place: &TestFolder, args: &[&str]) -> String {
    let ended = own(place, &[args, &["--json"]].concat());
    assert_eq!(ended.code(), 0, "{args:?}: {}", ended.err());
    let summary: serde_json::Value = serde_json::from_str(&ended.out()).expect("JSON");
    summary["digest"].as_str().expect("a digest").to_string()
}

#[test]
fn a_behavior_of_ones_own_is_checked_run_swept_and_replayed() {
    let place = place();
    for args in [
        &["check", "wall.toml"][..],
        &["run", "wall.toml", "--out", "w", "--workers", "2"],
        &["replay", "w"],
        &["report", "w"],
        &["sweep", "wall.toml", "--vary", "robots.count=3,5", "--replicate", "2", "--out", "d"],
        &["export", "w", "--to", "gif", "--out", "w.gif"],
    ] {
        assert_done(&place, args);
    }
    assert!(place.read("w/run.json").contains(".own-"), "who made it is told");
}

#[test]
fn own_methods_drivers_and_reactions_are_checked_run_resumed_swept_and_replayed() {
    let place = place();
    for (name, vary) in
        [("sky", "airspace.method=keep-right,orca"), ("chain", "chain.rotation=straight,union")]
    {
        let scenario = format!("{name}.toml");
        let sweep = format!("{name}-sweep");
        assert_done(&place, &["check", &scenario]);
        let digest = digest(&place, &["run", &scenario, "--out", name, "--workers", "1"]);
        assert_done(&place, &["replay", name, "--workers", "2"]);
        let manifest = place.read(&format!("{name}/run.json"));
        let interrupted = manifest.replace("\"complete\"", "\"incomplete\"");
        place.write(&format!("{name}/run.json"), sidestep_record::seal_again(&interrupted));
        assert_eq!(self::digest(&place, &["resume", name, "--workers", "2"]), digest);
        let swept = ["sweep", &scenario, "--vary", vary, "--replicate", "2", "--out", &sweep];
        assert_done(&place, &swept);
        let unknown = place.run(&["check", &scenario]);
        assert_eq!(unknown.code(), 2);
        assert!(unknown.err().contains("unknown value `"), "{}", unknown.err());
    }
}

#[test]
fn another_program_neither_knows_the_behavior_nor_continues_its_runs() {
    let place = place();
    let ended = place.run(&["check", "wall.toml"]);
    assert!(
        ended.code() == 2 && ended.err().contains("unknown behaviour `wall`"),
        "{}",
        ended.err()
    );
    let stopped = own(&place, &["run", "s.toml", "--out", "r", "--cycles", "200"]);
    assert_eq!(stopped.code(), 0, "{}", stopped.err());
    let manifest = place.read("r/run.json").replace("\"complete\"", "\"incomplete\"");
    place.write("r/run.json", sidestep_record::seal_again(&manifest));
    let ended = place.run(&["resume", "r"]);
    assert!(ended.code() == 2 && ended.err().contains(".own-"), "{}", ended.err());
}
