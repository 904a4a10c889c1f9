//! Many runs: the same table for any number of workers, in shares or in one go, and every row is
//! what `run` gives for its scenario and seed.

use crate::support::{Place, names};
use std::path::Path;

/// Six variants with three seeds each.
const SWEEP: &str = r#"format = 1
scenario = "s.toml"
name = "crowds"
replicates = 3
metrics = ["contacts", "coverage"]
baseline = { regime = "reliable", people.count = 0 }

[set]
cycles = 400

[vary]
regime = ["reliable", "effectors", "both"]
people.count = [0, 2]
"#;

pub(crate) fn place() -> Place {
    let place = Place::new();
    place.write("sweep.toml", SWEEP);
    place
}

fn bytes(place: &Place, file: &str) -> Vec<u8> {
    std::fs::read(place.path(file)).expect(file)
}

#[test]
fn the_table_of_runs_does_not_depend_on_workers_shares_or_order() {
    let place = place();
    place.json(&["sweep", "sweep.toml", "--out", "one", "--workers", "1"]);
    let results = bytes(&place, "one/results.parquet");
    place.json(&["sweep", "sweep.toml", "--out", "three", "--workers", "3"]);
    assert!(results == bytes(&place, "three/results.parquet"), "three workers");
    place.json(&["sweep", "plan", "sweep.toml", "--out", "shared"]);
    for shard in ["2/3", "0/3", "1/3"] {
        place.json(&["sweep", "run", "shared", "--shard", shard]);
    }
    let collected = place.json(&["sweep", "collect", "shared"]);
    assert_eq!((&collected["runs"], &collected["failed"]), (&18.into(), &0.into()));
    assert!(results == bytes(&place, "shared/results.parquet"), "three shares");
    place.json(&["sweep", "sweep.toml", "--out", "recorded", "--record-runs"]);
    assert_eq!(names(&place.path("recorded/runs")).len(), 18);
    let again = place.json(&["replay", "recorded/runs/000007", "--cycle", "400"]);
    let recorded = place.read("recorded/runs/000007/run.json");
    assert!(recorded.contains(again["digest"].as_str().expect("text")));
}

#[test]
fn a_row_is_what_run_gives_for_the_scenario_of_its_variant_and_its_seed() {
    let place = place();
    let swept = place.json(&["sweep", "sweep.toml", "--out", "d"]);
    assert_eq!(swept["first_seed"], 5, "the scenario's own");
    let journal = place.read("d/shares/0-of-1.journal");
    let line = journal.lines().find(|l| l.contains("\"cell\":7,")).expect("cell 7");
    // Cell 7 of three replicates: variant 2, replicate 1.
    let row: serde_json::Value = serde_json::from_str(&line[9..]).expect("JSON");
    let run = place.json(&["run", "d/variants/0002/scenario.toml", "--seed", "6"]);
    assert_eq!(row["digest"], run["digest"]);
    assert_eq!(row["metrics"]["contacts"], run["metrics"]["contacts"]);
    assert_eq!(row["cycles"], 400);
}

#[test]
fn many_runs_of_one_scenario_need_no_file_and_leave_nothing_behind() {
    let place = place();
    let args = ["--replicate", "4", "--cycles", "300", "--vary", "regime=reliable,both"];
    let run = place.json(&[&["run", "s.toml"][..], &args[..]].concat());
    let sweep = place.json(&[&["sweep", "s.toml"][..], &args[..]].concat());
    assert_eq!(run["summary"], sweep["summary"]);
    assert_eq!((&run["runs"], &run["parameters"][0]), (&8.into(), &"regime".into()));
    assert_eq!(place.names(), ["s.toml", "sweep.toml"]);
    let words = place.run(&[&["sweep", "s.toml"][..], &args[..]].concat()).out();
    assert!(words.contains("8 runs of 2 variants") && words.contains("| n | mean |"), "{words}");
}

#[test]
fn a_sweep_runs_until_it_is_precise_and_shares_of_it_are_refused() {
    let place = place();
    let until = ["sweep", "s.toml", "--cycles", "300", "--until", "ci=0.2", "--max", "60"];
    let args = [&until[..], &["--metrics", "coverage", "--out", "d"]].concat();
    let done = place.json(&args);
    let runs = done["stopped"][0]["runs"].as_u64().expect("a number");
    assert!((10..=60).contains(&runs) && done["runs"] == runs, "{done}");
    let again = place.json(&args);
    assert_eq!(again["summary"], done["summary"], "nothing is run again");
    assert_eq!(again["stopped"], done["stopped"], "why it was enough is still told");
    place.json(&["report", "d"]);
    assert!(place.read("d/report.md").contains("Why so many runs"));
    let planned = [&["sweep", "plan"], &args[1..]].concat();
    let planned: Vec<&str> = planned.iter().map(|a| if *a == "d" { "p" } else { a }).collect();
    place.json(&planned);
    let refused = place.run(&["sweep", "run", "p", "--shard", "0/2"]);
    assert_eq!(refused.code(), 2);
    assert!(refused.err().contains("stops by its precision"), "{}", refused.err());
    assert_eq!(place.json(&["resume", "p"])["summary"], done["summary"]);
}

#[test]
fn what_is_wrong_in_any_variant_is_told_before_anything_is_run() {
    let place = place();
    for (args, cause) in [
        (vec!["--vary", "robots.0.size=2,900"], "robots.0.size = 900"),
        (vec!["--vary", "robots.0.sizes=2"], "unknown key `sizes`"),
        (vec!["--vary", "seed=1,2"], "`seed` is set"),
        (vec!["--vary", "regime"], "there is no `=`"),
        (vec!["--vary", "regime=both", "--vary", "regime=reliable"], "`regime` is set twice"),
        (vec!["--replicate", "2", "--baseline", "regime=both"], "no variant has the settings"),
        (vec!["--replicate", "2", "--metrics", "contcats"], "contcats"),
    ] {
        let ended = place.run(&[&["sweep", "s.toml", "--out", "d"], &args[..]].concat());
        assert_eq!(ended.code(), 2, "{args:?}: {}", ended.err());
        assert!(ended.err().contains(cause), "{args:?}: {}", ended.err());
        let is_there = place.path("d").exists();
        assert!(!is_there, "{args:?} left a folder");
    }
}

#[test]
fn options_about_many_runs_are_refused_where_there_is_one() {
    let place = place();
    for option in [&["--metrics", "contacts"][..], &["--baseline", "seed=1"], &["--record-runs"]] {
        let ended = place.run(&[&["run", "s.toml"], option].concat());
        assert_eq!(ended.code(), 2, "{option:?}");
        assert!(ended.err().contains(option[0]), "{}", ended.err());
    }
}

#[test]
fn a_folder_holds_one_sweep() {
    let place = place();
    place.json(&["sweep", "sweep.toml", "--out", "d"]);
    let other = place.run(&["sweep", "s.toml", "--replicate", "2", "--out", "d"]);
    assert_eq!(other.code(), 2);
    assert!(other.err().contains("another sweep"), "{}", other.err());
    let done = place.run(&["resume", "d"]);
    assert!(done.code() == 2 && done.err().contains("done"), "{}", done.err());
    let planned = place.run(&["sweep", "plan", "sweep.toml", "--out", "d"]);
    assert!(planned.err().contains("holds a sweep already"), "{}", planned.err());
    let none = place.run(&["sweep", "collect", "."]);
    assert!(none.code() == 2 && none.err().contains("no sweep"), "{}", none.err());
}

#[test]
fn the_shipped_sweeps_are_right() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/sweeps");
    let place = Place::new();
    for name in names(&root) {
        let file = root.join(&name).display().to_string();
        let planned = place.json(&["sweep", "plan", &file, "--out", &name]);
        assert!(planned["cells"].as_u64() > Some(10), "{name}");
    }
}
