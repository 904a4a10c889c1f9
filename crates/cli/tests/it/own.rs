//! A program with behaviors of its own, `examples/own_command.rs`, has the whole command line.

use crate::support::{CommandOutput, TestFolder};
use std::path::Path;
use std::process::{Command, Stdio};

const WALL: &str = r#"format = 1
world = "robots"
cycles = 300
map = { office = { corridors = 1, rooms_per_side = 3 } }
robots = { count = 5, size = 2, sensors = ["sonar-8"], effector = "nomad", behaviour = { kind = "wall" } }
"#;

/// A place with a scenario that names a behavior which `sidestep` itself does not have.
fn place() -> TestFolder {
    let place = TestFolder::new();
    place.write("wall.toml", WALL);
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
        let ended = own(&place, args);
        assert_eq!(ended.code(), 0, "{args:?}: {}", ended.err());
    }
    assert!(place.read("w/run.json").contains(".own-"), "who made it is told");
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
    place.write("r/run.json", manifest);
    let ended = place.run(&["resume", "r"]);
    assert!(ended.code() == 2 && ended.err().contains(".own-"), "{}", ended.err());
}
