//! `reproduce`: a quick run writes a report, its figures and all its numbers.

use crate::browser::{assert_sound, chromium};
use crate::support::{CommandOutput, TestFolder, names, signal, wait_for};
use serde_json::Value;
use sidestep_testing::require;

/// The names in the folder of a report.
const WHOLE: [&str; 5] =
    ["figures", "report.html", "report.json", "report.manifest.json", "report.md"];

#[test]
fn a_rehearsal_leaves_a_whole_report() {
    let place = TestFolder::new();
    let told = place.json(&["reproduce", "loria", "--quick", "--out", "loria"]);
    assert!(told["claims"].as_array().map(Vec::len) > Some(10));
    assert_eq!(names(&place.path("loria")), WHOLE);
    let stored: Value = serde_json::from_str(&place.read("loria/report.json")).expect("JSON");
    assert_eq!(stored["claims"], told["claims"]);
    assert!(place.read("loria/report.md").contains("A rehearsal"));
    let figures = names(&place.path("loria/figures"));
    let kind = |end: &str| figures.iter().filter(|f| f.ends_with(end)).count();
    assert!(kind(".svg") > 5 && kind(".svg") == kind(".png"), "{figures:?}");
    assert_eq!(figures.len() / 2, place.read("loria/report.md").matches("](figures/").count());
    let again = place.run(&["reproduce", "loria", "--quick", "--out", "loria"]);
    assert_eq!(again.code(), 2, "a folder with something in it is left alone");
}

#[test]
fn a_plan_out_of_range_is_refused_and_leaves_no_folder() {
    let place = TestFolder::new();
    let ended = place.run(&["reproduce", "loria", "--seeds", "1", "--out", "loria"]);
    assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{}", ended.err());
    assert!(ended.err().contains("seeds"), "{}", ended.err());
    assert_eq!(place.names(), ["s.toml"]);
}

#[test]
fn ctrl_c_leaves_nothing_behind() {
    let place = TestFolder::new();
    let child = place.start(&["reproduce", "loria", "--seeds", "1000", "--out", "loria"]);
    wait_for("the folder", || place.path("loria/timed-runs").exists());
    std::thread::sleep(std::time::Duration::from_millis(300));
    signal(&child, "INT");
    let ended = CommandOutput(child.wait_with_output().expect("ended"));
    assert_eq!((ended.code(), ended.out().as_str()), (130, ""));
    assert_eq!(place.names(), ["s.toml"]);
}

#[test]
fn a_rehearsal_of_the_serpentine_experiments_leaves_a_whole_report() {
    let place = TestFolder::new();
    let told = place.json(&["reproduce", "serpentine", "--quick", "--out", "s", "--seeds", "1"]);
    assert_eq!(told["claims"].as_array().map(Vec::len), Some(25));
    assert_eq!(names(&place.path("s")), WHOLE);
    let stored: Value = serde_json::from_str(&place.read("s/report.json")).expect("JSON");
    assert_eq!(stored["claims"], told["claims"]);
    let report = place.read("s/report.md");
    assert!(report.contains("A rehearsal") && !report.contains("NaN"), "{report}");
    let figures = names(&place.path("s/figures"));
    let count = |is: &dyn Fn(&str) -> bool| figures.iter().filter(|f| is(f)).count();
    assert_eq!(count(&|f| f.ends_with(".svg")), count(&|f| f.ends_with(".png")));
    let Some(browser) = chromium() else { return };
    let found = assert_sound(&browser, &place.path("s/report.html"));
    assert_eq!(found["pictures"].as_array().map(Vec::len), Some(4), "the scenes");
    assert_eq!(found["figures"].as_u64(), Some(count(&|f| f.ends_with(".svg")) as u64 - 4));
    assert_eq!(found["badges"].as_array().map(Vec::len), Some(25), "a verdict for every claim");
    let told = found["hover"].as_array().expect("what each figure says");
    assert!(told.iter().any(|words| words.as_str().is_some_and(|words| words.contains("n ="))));
    let [as_told, rising, falling, again] = [0, 1, 2, 3].map(|k| &found["sorted"][k]);
    assert!(as_told == again && rising != falling, "a head sorts up, down, and as it was");
}

/// Returns whether the program that carries the network is there or not.
#[test]
fn a_rehearsal_of_the_airspace_experiments_measures_over_sockets_or_says_how_to() {
    let place = TestFolder::new();
    let told = place.json(&["reproduce", "agentfly", "--quick", "--seeds", "1", "--out", "a"]);
    assert_eq!(names(&place.path("a")), WHOLE);
    let report = place.read("a/report.md");
    assert!(report.contains("Over real sockets") && !report.contains("NaN"), "{report}");
    let Some(cases) = told["sockets"]["measured"].as_array() else {
        let reason = told["sockets"]["left-out"]["reason"].as_str().expect("a reason");
        assert!(reason.contains("cargo install --path crates/link"), "{reason}");
        assert!(report.contains("Left out"), "{report}");
        return require(
            "link",
            "sidestep-link is not built: cargo build --release -p sidestep-link",
        );
    };
    assert_eq!(cases.len(), 4, "every deployment");
    for case in cases {
        let (alone, fleet) = (&case["alone"][0], &case["over_sockets"][0]);
        assert!(alone["messages"].as_f64() > Some(0.0), "{case}");
        assert_eq!([&alone["messages"], &alone["bytes"]], [&fleet["messages"], &fleet["bytes"]]);
        assert!(fleet["elapsed_s"].as_f64() > Some(0.0), "{case}");
    }
}

#[test]
fn interrupted_experiments_go_on_and_other_ones_do_not_take_their_place() {
    let place = TestFolder::new();
    let command = ["reproduce", "mapf", "--quick", "--seeds", "2", "--out", "m"];
    let trials = || std::fs::read_to_string(place.path("m/trials.jsonl")).unwrap_or_default();
    let child = place.start(&command);
    // The first line says which experiments they are.
    wait_for("a trial", || trials().lines().count() > 1);
    signal(&child, "INT");
    let ended = CommandOutput(child.wait_with_output().expect("ended"));
    assert_eq!((ended.code(), ended.out().as_str()), (130, ""));
    assert!(ended.err().contains("the same command goes on"), "{}", ended.err());
    assert_eq!(names(&place.path("m")), ["trials.jsonl"]);
    let kept = trials();
    let other = place.run(&["reproduce", "mapf", "--quick", "--seeds", "1", "--out", "m"]);
    assert_eq!(other.code(), 2, "{}", other.err());
    assert!(other.err().contains("the beginning of other experiments"), "{}", other.err());
    assert_eq!(trials(), kept);
    let whole = place.run(&command);
    assert_eq!(whole.code(), 0, "{}", whole.err());
    assert!(whole.err().contains("Goes on after"), "{}", whole.err());
    assert_eq!(names(&place.path("m")), WHOLE);
}

#[test]
fn a_rehearsal_of_the_study_of_planners_leaves_a_whole_report() {
    let place = TestFolder::new();
    let told = place.json(&["reproduce", "mapf", "--quick", "--seeds", "1", "--out", "m"]);
    assert_eq!(told["claims"].as_array().map(Vec::len), Some(8));
    assert_eq!(names(&place.path("m")), WHOLE);
    let report = place.read("m/report.md");
    assert!(report.contains("A rehearsal") && !report.contains("NaN"), "{report}");
    let figures = names(&place.path("m/figures"));
    assert_eq!(figures.iter().filter(|name| name.ends_with(".png")).count(), 5, "{figures:?}");
}
