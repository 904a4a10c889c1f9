//! What killed commands leave is removed by the next command that writes to the same place, and nothing else is; what
//! vanishes during work ends it.

use crate::support::{CommandOutput, TestFolder, names, signal, stop, wait_for};
use std::path::PathBuf;
use std::process::Child;

/// An export that takes some seconds: it draws a picture of every fourth cycle.
const EXPORT: [&str; 6] = ["export", "r", "--to", "mp4-frames", "--out", "film"];

/// Number of cycles of which an export takes some seconds in any form.
const MANY_CYCLES: u32 = 6_000;

fn recorded(cycles: u32) -> TestFolder {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--cycles", &cycles.to_string(), "--out", "r"]);
    place
}

/// Returns the hidden folders beside a target.
fn hidden(place: &TestFolder) -> Vec<String> {
    place.names().into_iter().filter(|name| name.starts_with(".film.new-")).collect()
}

/// Starts an export, and waits until it has drawn some pictures; returns its folder as well.
fn export_under_way(place: &TestFolder) -> (Child, PathBuf) {
    let child = place.start(&EXPORT);
    let folder = place.path(&format!(".film.new-{}", child.id()));
    wait_for("some pictures", || folder.join("frame-00002.png").exists());
    (child, folder)
}

#[test]
fn what_a_killed_export_left_is_removed_by_the_next_one_to_the_same_place_which_says_so() {
    let place = recorded(600);
    let (mut child, left) = export_under_way(&place);
    child.kill().expect("killed");
    child.wait().expect("gone");
    assert!(left.is_dir());
    // Another place has nothing to do with it.
    place.json(&["export", "r", "--to", "csv", "--out", "other"]);
    assert!(left.is_dir());
    let ended = place.run(&["export", "r", "--to", "csv", "--out", "film"]);
    assert_eq!(ended.code(), 0, "{}", ended.err());
    assert!(!left.exists());
    let note = format!("removed ./.film.new-{}, which a killed command left there", child.id());
    assert!(ended.err().contains(&note), "{}", ended.err());
    assert_eq!(
        names(&place.path("film")),
        ["events.csv", "export.manifest.json", "series.csv", "trajectories.csv"]
    );
    assert_eq!(place.run(&["verify", "film"]).code(), 0);
}

#[test]
fn the_folder_of_a_process_at_work_and_what_is_not_ours_stay() {
    let place = recorded(600);
    let (mut child, at_work) = export_under_way(&place);
    stop(&child);
    let pictures = names(&at_work).len();
    // Of a user: without the mark of an export, or with one that names no process.
    std::fs::create_dir(place.path(".film.new-1")).expect("made");
    place.write(".film.new-1/mine.csv", "mine");
    std::fs::create_dir(place.path(".film.new-2")).expect("made");
    place.write(".film.new-2/.sidestep-unfinished", "mine");
    place.write(".film.new-3", "mine");
    std::fs::create_dir(place.path(".film.new-mine")).expect("made");
    place.write(".film.new-mine/.sidestep-unfinished", "3");
    let before = hidden(&place);
    let ended = place.run(&["export", "r", "--to", "csv", "--out", "film"]);
    assert_eq!((ended.code(), ended.err().contains("removed")), (0, false), "{}", ended.err());
    assert_eq!(hidden(&place), before);
    assert_eq!(names(&at_work).len(), pictures);
    assert_eq!(place.read(".film.new-1/mine.csv"), "mine");
    signal(&child, "CONT");
    // It finds the place taken, and takes away what it has made.
    assert_eq!(child.wait().expect("ended").code(), Some(2));
    assert!(!at_work.exists());
}

#[test]
fn what_a_killed_plan_of_a_sweep_left_is_removed_by_the_next_one() {
    let place = TestFolder::new();
    let cycles: Vec<String> = (1..20_000).map(|n| n.to_string()).collect();
    let vary = format!("cycles={}", cycles.join(","));
    let mut child = place.start(&["sweep", "plan", "s.toml", "--vary", &vary, "--out", "d"]);
    let left = place.path(&format!(".d.new-{}", child.id()));
    wait_for("the first variants", || left.join("variants").is_dir());
    child.kill().expect("killed");
    child.wait().expect("gone");
    let ended = place.run(&["sweep", "plan", "s.toml", "--replicate", "2", "--out", "d"]);
    assert_eq!(ended.code(), 0, "{}", ended.err());
    assert!(!left.exists() && ended.err().contains("a killed command left"), "{}", ended.err());
    assert!(!place.path("d/.sidestep-unfinished").exists());
}

#[test]
fn an_export_whose_place_is_deleted_meanwhile_fails_and_names_it() {
    let place = recorded(MANY_CYCLES);
    std::fs::create_dir(place.path("deep")).expect("made");
    let forms = [("mp4-frames", "frame-00002.png"), ("rosbag", "bag_0.mcap")];
    for (form, first) in forms {
        let args = ["export", "r", "--to", form, "--out", "deep/x", "--json"];
        let child = place.start(&args);
        let folder = format!("deep/.x.new-{}", child.id());
        wait_for("the first file", || place.path(&folder).join(first).exists());
        stop(&child);
        std::fs::remove_dir_all(place.path("deep")).expect("removed");
        signal(&child, "CONT");
        let ended = CommandOutput(child.wait_with_output().expect("ended"));
        assert_eq!((ended.code(), ended.out().as_str()), (1, ""), "{form}: {}", ended.err());
        for word in ["deep/x", "was deleted or moved", "help:"] {
            assert!(ended.err().contains(word), "{form}: {word}: {}", ended.err());
        }
        assert!(!ended.err().contains(".new-"), "{}", ended.err());
        assert!(!place.path("deep").exists(), "{form}: nothing is written elsewhere");
        std::fs::create_dir(place.path("deep")).expect("made");
    }
    // Only some of the files are gone, and others come after them.
    let child = place.start(&EXPORT);
    let folder = place.path(&format!(".film.new-{}", child.id()));
    wait_for("some pictures", || folder.join("frame-00002.png").exists());
    stop(&child);
    for name in names(&folder) {
        std::fs::remove_file(folder.join(name)).expect("removed");
    }
    signal(&child, "CONT");
    let ended = CommandOutput(child.wait_with_output().expect("ended"));
    assert_eq!((ended.code(), ended.out().as_str()), (1, ""), "{}", ended.err());
    assert!(ended.err().contains("film: what was written so far was deleted"), "{}", ended.err());
    assert!(!place.path("film").exists() && hidden(&place).is_empty());
}

#[test]
fn an_exported_file_whose_folder_is_deleted_meanwhile_fails_and_names_it() {
    let place = recorded(MANY_CYCLES);
    for (form, partial) in [("gif", "x.gif.PID.partial"), ("mcap", "x.mcap.partial")] {
        std::fs::create_dir(place.path("deep")).expect("made");
        let out = format!("deep/x.{form}");
        let child = place.start(&["export", "r", "--to", form, "--out", &out, "--json"]);
        let partial = partial.replace("PID", &child.id().to_string());
        wait_for("the file", || place.path("deep").join(&partial).exists());
        stop(&child);
        std::fs::remove_dir_all(place.path("deep")).expect("removed");
        signal(&child, "CONT");
        let ended = CommandOutput(child.wait_with_output().expect("ended"));
        assert_eq!((ended.code(), ended.out().as_str()), (1, ""), "{form}: {}", ended.err());
        assert!(ended.err().contains(&out) && ended.err().contains("help:"), "{}", ended.err());
        assert!(!place.path("deep").exists(), "{form}");
    }
}
