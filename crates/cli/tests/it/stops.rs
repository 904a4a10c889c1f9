//! Runs stopped by Ctrl-C or by a kill, and `resume` of them.

use crate::support::{CommandOutput, TestFolder, names, signal, wait_for};
use serde_json::Value;
use sidestep_record::read_table;

/// More cycles than any test waits for.
const ENDLESS: [&str; 6] = ["run", "s.toml", "--out", "r", "--cycles", "1000000000"];
/// Long enough to be stopped before the end.
const LONG: [&str; 4] = ["run", "s.toml", "--cycles", "60000"];

fn manifest(place: &TestFolder) -> Value {
    serde_json::from_str(&place.read("r/run.json")).expect("JSON")
}

/// Interrupts an endless run once it has a checkpoint.
fn interrupted(place: &TestFolder, more: &[&str], with: &str) -> CommandOutput {
    let child = place.start(&[&ENDLESS, more].concat());
    wait_for("a checkpoint", || place.path("r/checkpoint.bin").exists());
    signal(&child, with);
    CommandOutput(child.wait_with_output().expect("ended"))
}

/// Kills a long recorded run once it has a checkpoint.
fn killed(place: &TestFolder) {
    let mut child = place.start(&[&LONG[..], &["--out", "r"]].concat());
    wait_for("a checkpoint", || place.path("r/checkpoint.bin").exists());
    child.kill().expect("killed");
    child.wait().expect("ended");
}

/// Asserts that the rows of a table are the same, in the same order.
fn assert_same_rows(place: &TestFolder, a: &str, b: &str) {
    for table in ["trajectories", "events", "series"] {
        let read = |folder: &str| read_table(&place.path(folder), table, ..).expect("a table");
        let (a, b) = (read(a), read(b));
        assert!(a.complete && b.complete && a.rows() > 0);
        assert!(a.columns == b.columns, "{table} differs");
    }
}

#[test]
fn ctrl_c_ends_cleanly_and_marks_the_run_as_incomplete() {
    for name in ["INT", "TERM"] {
        let place = TestFolder::new();
        let ended = interrupted(&place, &["--json"], name);
        assert_eq!(ended.code(), 130, "{}", ended.err());
        let said = ended.json();
        assert_eq!(said["status"], "incomplete");
        let manifest = manifest(&place);
        assert_eq!(manifest["status"], "incomplete");
        assert_eq!(manifest["cycles_done"], said["cycles"]);
        let tables = names(&place.path("r"));
        assert!(tables.contains(&"trajectories.partial".into()), "{tables:?}");
        assert!(place.read("r/trajectories.svg").contains("INCOMPLETE"));
        assert!(place.read("r/summary.json").contains("\"incomplete\""));
    }
}

#[test]
fn ctrl_c_without_a_folder_reports_what_was_done() {
    let place = TestFolder::new();
    let child = place.start(&["run", "s.toml", "--cycles", "1000000000"]);
    std::thread::sleep(std::time::Duration::from_millis(500));
    signal(&child, "INT");
    let ended = CommandOutput(child.wait_with_output().expect("ended"));
    assert_eq!(ended.code(), 130);
    assert!(ended.out().contains("INCOMPLETE"), "{}", ended.out());
    assert_eq!(place.names(), ["s.toml"]);
}

/// Returns `summary.json` without the times of a clock and the names of the place.
fn told(place: &TestFolder, folder: &str) -> Value {
    let text = place.read(&format!("{folder}/summary.json"));
    let mut summary: Value = serde_json::from_str(&text).expect("JSON");
    let of_the_process = [
        "workers",
        "cycles_timed",
        "wall_s",
        "cpu_s",
        "agent_cycles_per_cpu_s",
        "robot_cycles_per_cpu_s",
        "phases_s",
        "folder",
    ];
    let all = summary.as_object_mut().expect("an object");
    all.retain(|key, _| !of_the_process.contains(&key.as_str()));
    summary
}

#[test]
fn a_killed_run_resumes_to_the_same_digest_rows_and_summary() {
    let place = TestFolder::new();
    killed(&place);
    assert_eq!(manifest(&place)["status"], "running");
    let resumed = place.json(&["resume", "r", "--workers", "3"]);
    let whole = place.json(&[&LONG[..], &["--out", "whole"]].concat());
    assert_eq!(resumed["digest"], whole["digest"]);
    assert_eq!(told(&place, "r"), told(&place, "whole"));
    assert_eq!(resumed["status"], "complete");
    assert_same_rows(&place, "r", "whole");
}

#[test]
fn a_run_stopped_several_times_has_the_digest_of_one_in_one_go() {
    let place = TestFolder::new();
    let stopped = killed_then_resumed_to(&place, &["10000", "25000"]);
    assert_eq!(stopped["status"], "complete");
    assert_eq!(stopped["digest"], place.json(&LONG)["digest"]);
}

fn killed_then_resumed_to(place: &TestFolder, stops: &[&str]) -> Value {
    killed(place);
    for stop in stops {
        let ended = place.run(&["resume", "r", "--cycles", stop, "--json"]);
        // A fast machine may have gone farther already.
        assert!([0, 2].contains(&ended.code()), "{}", ended.err());
        assert_ne!(manifest(place)["status"], "complete");
    }
    place.json(&["resume", "r"])
}

#[test]
fn a_run_whose_folder_is_deleted_moved_or_replaced_ends_at_once_and_writes_nowhere_else() {
    for change in ["deleted", "emptied", "moved", "replaced"] {
        let place = TestFolder::new();
        // Its first checkpoint is hours away, and no rows are due before.
        let args = ["--set", "record.checkpoint_every=1000000000"];
        let child = place.start(&[&ENDLESS[..], &args].concat());
        // The last that it makes before its first cycle.
        let tables = ["r/events.partial", "r/trajectories.partial", "r/series.partial"];
        wait_for("the tables", || tables.iter().all(|table| place.path(table).exists()));
        let folder = place.path("r");
        match change {
            "deleted" => std::fs::remove_dir_all(&folder).expect("deleted"),
            "emptied" => {
                for name in names(&folder).iter().filter(|name| name.ends_with("lock")) {
                    std::fs::remove_file(folder.join(name)).expect("deleted");
                }
            }
            _ => std::fs::rename(&folder, place.path("moved")).expect("moved"),
        }
        if change == "replaced" {
            place.json(&["run", "s.toml", "--cycles", "20", "--out", "r"]);
        }
        let ended = CommandOutput(child.wait_with_output().expect("ended"));
        assert_eq!(ended.code(), 1, "{change}: {}", ended.err());
        assert!(ended.err().contains("was deleted, emptied or moved"), "{change}: {}", ended.err());
        assert_eq!(folder.exists(), ["emptied", "replaced"].contains(&change), "{change}");
        if change == "replaced" {
            assert_eq!(place.run(&["verify", "r"]).code(), 0, "the other run is whole");
        }
    }
}

#[test]
fn a_run_whose_table_is_deleted_ends_at_the_next_seal_and_names_it() {
    for table in ["trajectories", "events", "series"] {
        let place = TestFolder::new();
        let child = place.start(&[&ENDLESS[..], &["--json"]].concat());
        wait_for("a checkpoint", || place.path("r/checkpoint.bin").exists());
        // In one step, as a deletion is not: it would meet new files.
        let folder = format!("r/{table}.partial");
        std::fs::rename(place.path(&folder), place.path("gone")).expect("moved");
        let ended = CommandOutput(child.wait_with_output().expect("ended"));
        assert_eq!((ended.code(), ended.out().as_str()), (1, ""), "{}", ended.err());
        for word in [&*folder, "was deleted or moved", "help: put back"] {
            assert!(ended.err().contains(word), "{word}: {}", ended.err());
        }
        assert_ne!(manifest(&place)["status"], "complete");
        assert!(!place.path(&folder).exists() && !place.path(&format!("r/{table}")).exists());
        // The remedy works.
        std::fs::rename(place.path("gone"), place.path(&folder)).expect("moved back");
        let more = (manifest(&place)["cycles_done"].as_u64().expect("cycles") + 10).to_string();
        assert_eq!(place.run(&["resume", "r", "--cycles", &more]).code(), 0);
    }
}

#[test]
fn a_run_of_whose_table_a_part_is_deleted_is_not_called_complete() {
    let place = TestFolder::new();
    let child = place.start(&[&LONG[..], &["--out", "r", "--json"]].concat());
    let first = place.path("r/trajectories.partial").join("part-000000000000000.parquet");
    wait_for("a checkpoint", || place.path("r/checkpoint.bin").exists());
    std::fs::remove_file(&first).expect("removed");
    let ended = CommandOutput(child.wait_with_output().expect("ended"));
    assert_eq!((ended.code(), ended.out().as_str()), (1, ""), "{}", ended.err());
    assert!(ended.err().contains("part-000000000000000.parquet"), "{}", ended.err());
    assert_ne!(manifest(&place)["status"], "complete");
    assert!(!place.path("r/trajectories").exists());
}

#[test]
fn resume_tells_how_to_get_the_mcap_file_that_a_kill_left_incomplete() {
    let place = TestFolder::new();
    let args = ["--out", "r", "--mcap", "it's.mcap", "--mcap-every", "50"];
    let mut child = place.start(&[&LONG[..], &args].concat());
    wait_for("a checkpoint", || place.path("r/checkpoint.bin").exists());
    child.kill().expect("killed");
    child.wait().expect("ended");
    let partial = place.run(&["replay", "it's.mcap.partial"]);
    assert!(partial.code() == 2 && partial.err().contains("was killed"), "{}", partial.err());
    for _ in 0..2 {
        // Again once it is complete, for as long as the remains are there.
        let resumed = place.run(&["resume", "r"]);
        assert_eq!(resumed.code(), 0, "{}", resumed.err());
        let advised =
            "`sidestep export --to mcap r --every 50 --out 'it'\\''s.mcap' --replace` writes all";
        assert!(resumed.err().contains(advised), "{}", resumed.err());
    }
    let args = ["--to", "mcap", "--every", "50", "--out", "it's.mcap", "--replace"];
    let export = place.run(&[&["export", "r"], &args[..]].concat());
    assert_eq!(export.code(), 0, "{}", export.err());
    assert!(!place.path("it's.mcap.partial").exists(), "what was left is gone");
    assert_eq!(place.run(&["replay", "it's.mcap"]).code(), 0);
    assert!(!place.run(&["resume", "r"]).err().contains("mcap"), "nothing is left to tell");

    // A run that is stopped in good order ends its file.
    let child =
        place.start(&["run", "s.toml", "--cycles", "60000", "--out", "s", "--mcap", "s.mcap"]);
    wait_for("a checkpoint", || place.path("s/checkpoint.bin").exists());
    signal(&child, "INT");
    assert_eq!(child.wait_with_output().expect("ended").status.code(), Some(130));
    let resumed = place.run(&["resume", "s"]);
    let advised = "`sidestep export --to mcap s --every 1 --out s.mcap --replace` writes all of it";
    assert!(resumed.err().contains(advised), "{}", resumed.err());
}

#[test]
fn a_run_killed_before_its_first_checkpoint_starts_again() {
    let place = TestFolder::new();
    let long = [&LONG[..], &["--out", "r", "--set", "record.checkpoint_every=1000000"]].concat();
    let mut child = place.start(&long);
    wait_for("the folder", || place.path("r/run.json").exists());
    child.kill().expect("killed");
    child.wait().expect("ended");
    assert_eq!(place.json(&["resume", "r"])["digest"], place.json(&LONG)["digest"]);
}

#[test]
fn what_cannot_be_resumed_is_refused_with_the_reason() {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--out", "r"]);
    let refused = |args: &[&str], reason: &str| {
        let ended = place.run(args);
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{}", ended.err());
        assert!(ended.err().contains(reason), "{}", ended.err());
    };
    refused(&["resume", "r", "--cycles", "4000"], "complete");
    refused(&["resume", "nowhere"], "nowhere");
    refused(&["resume", "."], "no run folder");
    let other = TestFolder::new();
    killed(&other);
    let mut bytes = std::fs::read(other.path("r/checkpoint.bin")).expect("bytes");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    other.write("r/checkpoint.bin", &bytes);
    let ended = other.run(&["resume", "r"]);
    assert_eq!(ended.code(), 2);
    // A kill between the checkpoint and the manifest leaves one that only its own checksum confirms.
    let words = ["does not match its digest", "checksum does not fit"];
    let is_noticed = words.iter().any(|words| ended.err().contains(words));
    assert!(is_noticed && ended.err().contains("help:"), "{}", ended.err());
}

#[test]
fn a_running_folder_is_not_taken_twice() {
    let place = TestFolder::new();
    let mut child = place.start(&ENDLESS);
    wait_for("a checkpoint", || place.path("r/checkpoint.bin").exists());
    let second = place.run(&["resume", "r"]);
    let replacing = place.run(&["run", "s.toml", "--out", "r", "--replace"]);
    child.kill().expect("killed");
    child.wait().expect("ended");
    for ended in [second, replacing] {
        assert_eq!(ended.code(), 2);
        assert!(ended.err().contains("another process"), "{}", ended.err());
    }
}

#[test]
fn a_recording_of_a_stopped_run_can_be_opened_but_is_not_called_whole() {
    let place = TestFolder::new();
    let endless = ["run", "s.toml", "--mcap", "x.mcap", "--cycles", "1000000000", "--json"];
    let child = place.start(&endless);
    let grown = || std::fs::metadata(place.path("x.mcap.partial")).is_ok_and(|m| m.len() > 200_000);
    wait_for("some frames", grown);
    signal(&child, "INT");
    let ended = CommandOutput(child.wait_with_output().expect("ended"));
    assert_eq!(ended.code(), 130, "{}", ended.err());
    assert_eq!(ended.json()["mcap"], "x.mcap.partial");
    assert_eq!(place.names(), ["s.toml", "x.mcap.partial"]);
    let replayed = place.json(&["replay", "x.mcap.partial"]);
    assert_eq!(replayed["complete"], false);
    assert_eq!(replayed["digest"], ended.json()["digest"]);
}
