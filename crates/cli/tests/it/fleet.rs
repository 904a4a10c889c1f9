//! Fleets: a process for each airplane, by the program `sidestep-link` where it is built.

use crate::support::{Place, requires, signal, wait_for};
use std::path::Path;

const RING: &str = "format = 1\nworld = \"airspace\"\nseed = 5\ncycles = 12\n[airspace]\n\
    deployment = \"compact-team\"\n[airspace.generator]\nkind = \"superconflict\"\nn = 3\n";

/// Whether the program of fleets is there: the tests of its own crate build it beside `sidestep`.
pub(crate) fn is_there() -> bool {
    let beside = Path::new(env!("CARGO_BIN_EXE_sidestep")).with_file_name("sidestep-link");
    if !beside.is_file() {
        requires("link", "sidestep-link is not built: cargo build --release -p sidestep-link");
    }
    beside.is_file()
}

fn place() -> Place {
    let place = Place::new();
    place.write("ring.toml", RING);
    place
}

#[test]
fn where_the_program_is_missing_it_is_said_how_to_get_it() {
    let place = place();
    let args = ["fleet", "ring.toml", "--out", "r"];
    let output = place.command(&args).env("SIDESTEP_LINK", "nowhere").output().expect("it starts");
    let said = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("cargo install --path crates/link"), "{said}");
    assert!(!place.path("r").exists());
}

#[test]
fn a_fleet_has_the_digest_of_a_run_and_its_folder_is_one_for_all_other_commands() {
    if !is_there() {
        return;
    }
    let place = place();
    let alone = place.json(&["run", "ring.toml"]);
    let fleet = place.json(&["fleet", "ring.toml", "--out", "r"]);
    assert_eq!(fleet["digest"], alone["digest"]);
    assert_eq!(fleet["metrics"]["messages"], alone["metrics"]["messages"]);
    assert_eq!(fleet["fleet"]["nodes"].as_array().map(Vec::len), Some(3));
    assert_eq!(place.json(&["replay", "r"])["digest"], alone["digest"]);
    assert_eq!(place.run(&["report", "r"]).code(), 0);
    assert_eq!(place.run(&["export", "r", "--to", "csv"]).code(), 0);
    let words = place.run(&["fleet", "ring.toml", "--topology", "star"]).out();
    assert!(words.contains("3 in a star, lockstep"), "{words}");
}

#[test]
fn ctrl_c_ends_a_fleet_in_good_order() {
    if !is_there() {
        return;
    }
    let place = place();
    let args = ["fleet", "ring.toml", "--cycles", "1000000", "--out", "r", "--log", "info"];
    let child = place.start(&args);
    wait_for("the folder", || place.path("r/scenario.toml").exists());
    signal(&child, "INT");
    let ended = crate::support::Ended(child.wait_with_output().expect("ended"));
    assert_eq!(ended.code(), 130, "{}", ended.err());
    let folder = sidestep_record::RunView::open(&place.path("r"));
    assert!(folder.is_ok(), "it can be looked at: {:?}", folder.err());
}
