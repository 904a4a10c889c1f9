//! E1 for sweeps: partial output is never taken for whole. No kill loses a finished run, and none
//! is made twice; a full disk stops the sweep, and it goes on when there is room.

use crate::support::{SmallDisk, TestFolder, fractions, kill_count, runs_until, signal, wait_for};
use crate::sweep::place;
use std::collections::BTreeSet;
use std::time::Instant;

/// Lines of the journal that are whole; the first is its head.
fn finished(place: &TestFolder, folder: &str) -> Vec<String> {
    let path = place.path(&format!("{folder}/shares/0-of-1.journal"));
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let whole = text.split_inclusive('\n').filter(|line| line.ends_with('\n'));
    whole.skip(1).map(str::to_string).collect()
}

fn cell(line: &str) -> u64 {
    let row: serde_json::Value = serde_json::from_str(&line[9..]).expect("a whole line is JSON");
    row["cell"].as_u64().expect("a number")
}

#[test]
fn fifty_kills_at_any_time_lose_no_finished_run_and_repeat_none() {
    let place = place();
    let args = ["sweep", "sweep.toml", "--replicate", "8", "--workers", "2"];
    let sweep = |folder: &str| [&args[..], &["--out", folder]].concat().join(" ");
    let words = |text: &str| text.split(' ').map(str::to_string).collect::<Vec<_>>();
    let run = |text: &str| {
        let words = words(text);
        place.json(&words.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let began = Instant::now();
    run(&sweep("whole"));
    let a_sweep = began.elapsed();
    let whole = std::fs::read(place.path("whole/results.parquet")).expect("there");
    let all = finished(&place, "whole").len();
    assert_eq!(all, 48);
    let (mut kills, mut broken) = (0, 0);
    let mut fractions = fractions();
    for k in 0.. {
        if kills >= kill_count(50) {
            break;
        }
        let folder = format!("d{k}");
        let mut before = Vec::new();
        // Each sweep is killed up to three times, and then goes to its end. The first kill comes at
        // any time, even before a folder is there; the others once a certain number of runs are
        // made.
        for (again, fraction) in fractions.by_ref().take(3).enumerate() {
            let line = words(&sweep(&folder));
            let mut child = place.start(&line.iter().map(String::as_str).collect::<Vec<_>>());
            let started = Instant::now();
            let runs = before.len() + (fraction * (all - before.len()) as f64) as usize;
            let moment = || match again {
                0 => started.elapsed() >= a_sweep.mul_f64(fraction),
                _ => finished(&place, &folder).len() > runs,
            };
            kills += usize::from(runs_until(&mut child, moment));
            child.kill().expect("killed or over");
            child.wait().expect("gone");
            let after = finished(&place, &folder);
            assert_eq!(after[..before.len()], before, "a finished run was lost");
            broken += usize::from(!after.is_empty() && after.len() < all);
            before = after;
        }
        run(&sweep(&folder));
        let journal = finished(&place, &folder);
        assert_eq!(journal[..before.len()], before, "a finished run was lost");
        let cells: BTreeSet<u64> = journal.iter().map(|line| cell(line)).collect();
        assert_eq!((journal.len(), cells.len()), (all, all), "a finished run was repeated");
        let results = std::fs::read(place.path(&format!("{folder}/results.parquet")));
        assert!(results.expect("there") == whole, "after kills the table differs");
    }
    println!("{kills} kills, {broken} of them between the first and the last run");
    assert!(broken >= 10, "kills must meet sweeps at work: {broken} of {kills} did");
}

#[test]
fn ctrl_c_keeps_finished_runs_and_resume_goes_on() {
    let place = place();
    let args = ["sweep", "sweep.toml", "--replicate", "400", "--out", "d"];
    let child = place.start(&args);
    wait_for("some runs", || finished(&place, "d").len() > 5);
    signal(&child, "INT");
    let ended = child.wait_with_output().expect("ended");
    assert_eq!(ended.status.code(), Some(130));
    let words = String::from_utf8(ended.stderr).expect("text");
    assert!(words.contains("sidestep resume d"), "{words}");
    let before = finished(&place, "d");
    assert!(before.len() < 2400 && !place.path("d/results.parquet").exists());
    let collected = place.run(&["sweep", "collect", "d"]);
    assert_eq!(collected.code(), 1);
    assert!(collected.err().contains("of 2400 runs are missing"), "{}", collected.err());
    assert_eq!(place.json(&["resume", "d"])["runs"], 2400);
    assert_eq!(finished(&place, "d")[..before.len()], before);
}

#[test]
fn a_sweep_whose_folder_is_moved_ends_at_once() {
    let place = place();
    let args = ["sweep", "sweep.toml", "--replicate", "400", "--out", "d"];
    let child = place.start(&args);
    wait_for("some runs", || finished(&place, "d").len() > 5);
    std::fs::rename(place.path("d"), place.path("moved")).expect("moved");
    let ended = child.wait_with_output().expect("ended");
    let said = String::from_utf8_lossy(&ended.stderr);
    // It misses either its journal or the scenario of the next run.
    assert!([Some(1), Some(2)].contains(&ended.status.code()), "{said}");
    assert!(said.contains("d/shares") || said.contains("d/variants"), "{said}");
    assert!(!place.path("d").exists());
    assert_eq!(place.json(&["resume", "moved"])["runs"], 2_400, "it goes on at its new place");
}

#[test]
fn ctrl_c_while_a_sweep_is_planned_leaves_nothing() {
    let place = place();
    let before = place.names();
    let cycles: Vec<String> = (1..20_000).map(|n| n.to_string()).collect();
    let vary = format!("cycles={}", cycles.join(","));
    let child = place.start(&["sweep", "plan", "s.toml", "--vary", &vary, "--out", "d"]);
    wait_for("the first variants", || place.names().len() > before.len());
    signal(&child, "INT");
    let ended = child.wait_with_output().expect("ended");
    assert_eq!(ended.status.code(), Some(130), "{}", String::from_utf8_lossy(&ended.stderr));
    assert_eq!(place.names(), before);
}

#[test]
fn two_processes_do_not_run_one_share() {
    let place = place();
    let args = ["sweep", "sweep.toml", "--replicate", "400", "--out", "d"];
    let mut child = place.start(&args);
    wait_for("some runs", || !finished(&place, "d").is_empty());
    let second = place.run(&["resume", "d"]);
    child.kill().expect("killed or over");
    child.wait().expect("gone");
    assert_eq!(second.code(), 2);
    assert!(second.err().contains("another process"), "{}", second.err());
}

#[test]
fn a_full_disk_stops_a_sweep_which_goes_on_when_there_is_room() {
    let place = place();
    let at = place.path("disk");
    let Some(disk) = SmallDisk::mount(&at, "300k") else {
        sidestep_testing::skip("this user may not mount a small disk");
        return;
    };
    let args = ["sweep", "sweep.toml", "--replicate", "100", "--out", "disk/d", "--json"];
    let ended = place.run(&args);
    assert_eq!((ended.code(), ended.out().as_str()), (1, ""), "{}", ended.err());
    for word in ["disk/d", "finished runs are saved", "sidestep resume"] {
        assert!(ended.err().contains(word), "{word}: {}", ended.err());
    }
    let before = finished(&place, "disk/d");
    assert!(!before.is_empty() && !place.path("disk/d/results.parquet").exists());
    disk.grow("64m");
    assert_eq!(place.json(&["resume", "disk/d"])["runs"], 600);
    assert_eq!(finished(&place, "disk/d")[..before.len()], before);
}
