//! Many runs: the same table for any number of workers, in shares or in one go, and every row
//! equals the result of `run` for its scenario and seed.

use crate::support::{TestFolder, names, wait_for};
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

pub(crate) fn place() -> TestFolder {
    let place = TestFolder::new();
    place.write("sweep.toml", SWEEP);
    place
}

fn bytes(place: &TestFolder, file: &str) -> Vec<u8> {
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
fn the_status_of_a_sweep_tells_its_shares_and_what_comes_next() {
    let place = place();
    place.json(&["sweep", "plan", "sweep.toml", "--out", "shared"]);
    let status = || place.json(&["sweep", "status", "shared"]);
    assert_eq!((&status()["runs"], &status()["of"]), (&0.into(), &18.into()));
    place.json(&["sweep", "run", "shared", "--shard", "2/3"]);
    let told = status();
    assert_eq!((&told["runs"], &told["failed"]), (&6.into(), &0.into()));
    assert_eq!(told["shares"][0]["is_done"], true);
    let words = || place.run(&["sweep", "status", "shared"]).out();
    for part in ["crowds: 6 of 18 runs", "share 2/3", "6 of 6, done", "sidestep resume shared"] {
        assert!(words().contains(part), "no {part} in {}", words());
    }
    place.json(&["resume", "shared"]);
    assert_eq!((&status()["runs"], &status()["is_complete"]), (&18.into(), &true.into()));
    assert!(words().contains("sidestep report shared"), "{}", words());
    let none = place.run(&["sweep", "status", "nowhere"]);
    assert_eq!(none.code(), 2);
    assert!(none.err().contains("this is no sweep"), "{}", none.err());
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
    assert!(words.contains("8 runs of 2 variants") && words.contains("  mean  "), "{words}");
    assert!(
        words.contains("regime=both       4  ") && words.contains(" n=4 "),
        "in columns: {words}"
    );
    for markup in ["|", "&lt;", "`"] {
        assert!(!words.contains(markup), "{markup}: {words}");
    }
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
    assert!(place.read("d/report.md").contains("Why this number of runs"));
    let planned = [&["sweep", "plan"], &args[1..]].concat();
    let planned: Vec<&str> = planned.iter().map(|a| if *a == "d" { "p" } else { a }).collect();
    place.json(&planned);
    let refused = place.run(&["sweep", "run", "p", "--shard", "0/2"]);
    assert_eq!(refused.code(), 2);
    assert!(refused.err().contains("target precision cannot be sharded"), "{}", refused.err());
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
        (vec!["--replicate", "2", "--baseline", "regime=both"], "which is not varied"),
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
fn a_sweep_and_a_scenario_are_not_taken_for_each_other() {
    let place = place();
    let ended = place.run(&["run", "sweep.toml"]);
    assert!(ended.code() == 2 && ended.err().contains("sidestep sweep"), "{}", ended.err());
    place.write("typo.toml", SWEEP.replace("scenario =", "scenaro ="));
    let ended = place.run(&["sweep", "typo.toml"]);
    assert!(ended.code() == 2 && ended.err().contains("scenaro"), "{}", ended.err());
}

#[test]
fn a_folder_holds_one_sweep() {
    let place = place();
    place.json(&["sweep", "sweep.toml", "--out", "d"]);
    let other = place.run(&["sweep", "s.toml", "--replicate", "2", "--out", "d"]);
    assert_eq!(other.code(), 2);
    assert!(other.err().contains("another sweep"), "{}", other.err());
    let done = place.run(&["resume", "d"]);
    assert!(done.code() == 0 && done.err().contains("finished already"), "{}", done.err());
    let planned = place.run(&["sweep", "plan", "sweep.toml", "--out", "d"]);
    assert!(planned.err().contains("holds a sweep already"), "{}", planned.err());
    let none = place.run(&["sweep", "collect", "."]);
    assert!(none.code() == 2 && none.err().contains("no sweep"), "{}", none.err());
}

#[test]
fn the_shipped_sweeps_are_right() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/sweeps");
    let place = TestFolder::new();
    for name in names(&root) {
        let file = root.join(&name).display().to_string();
        let planned = place.json(&["sweep", "plan", &file, "--out", &name]);
        assert!(planned["cells"].as_u64() > Some(10), "{name}");
    }
}

#[test]
fn the_shipped_sweep_of_flying_balls_runs_as_it_is_by_both_methods_of_escape() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/sweeps/flying.toml");
    let place = TestFolder::new();
    place.json(&["sweep", file, "--cycles", "60", "--replicate", "1", "--out", "flying"]);
    let rows = place.read("flying/shares/0-of-1.journal");
    for cell in ["\"cell\":0", "\"cell\":1"] {
        assert!(rows.contains(cell), "{rows}");
    }
    assert!(!rows.contains("failure"), "{rows}");
}

const SNAKE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/chain/snake3d.toml");

/// A chain in space with few balls: some of its vetoes are rare.
const RARE: [&str; 10] = [
    "--cycles",
    "150",
    "--seed",
    "2",
    "--replicate",
    "8",
    "--set",
    "fields.0.fill_fraction=0.05",
    "--set",
    "chains.0.connectors=60",
];

#[test]
fn what_happens_rarely_is_zero_elsewhere_and_shares_join_to_the_same_table() {
    let place = place();
    let args = [&[SNAKE][..], &RARE].concat();
    place.json(&[&["sweep"], &args[..], &["--out", "one"]].concat());
    place.json(&[&["sweep", "plan"], &args[..], &["--out", "shared"]].concat());
    for shard in ["4/5", "0/5", "1/5", "3/5", "2/5"] {
        place.json(&["sweep", "run", "shared", "--shard", shard]);
    }
    place.json(&["sweep", "collect", "shared"]);
    assert!(bytes(&place, "one/results.parquet") == bytes(&place, "shared/results.parquet"));
    let journal = place.read("one/shares/0-of-1.journal");
    let counted = journal.matches("\"vetoes_by_reason.target-blocked\":").count();
    assert_eq!(counted, 8, "a reason that nobody had is 0, not missing");
}

#[test]
fn a_share_makes_no_run_that_another_has_made_and_a_finished_one_is_told_again() {
    let place = place();
    place.json(&["sweep", "plan", "s.toml", "--replicate", "4", "--out", "d"]);
    for shard in ["0/2", "1/2"] {
        place.json(&["sweep", "run", "d", "--shard", shard]);
    }
    let all = place.json(&["sweep", "run", "d", "--shard", "0/1"]);
    assert_eq!(all["runs"], 0, "all are made already");
    let again = place.json(&["sweep", "run", "d", "--shard", "0/2"]);
    assert_eq!(again["runs"], 2, "a finished share is told again");
}

#[test]
fn a_variant_that_was_changed_or_is_gone_stops_the_sweep_until_it_is_back() {
    let place = place();
    place.json(&["sweep", "plan", "sweep.toml", "--out", "d"]);
    let path = place.path("d/variants/0001/scenario.toml");
    let planned = std::fs::read_to_string(&path).expect("there");
    std::fs::write(&path, planned.replace("cycles = 400", "cycles = 50")).expect("written");
    let ended = place.run(&["resume", "d", "--workers", "1"]);
    assert_eq!(ended.code(), 2);
    assert!(ended.err().contains("not as it was planned"), "{}", ended.err());
    std::fs::remove_file(&path).expect("removed");
    assert_eq!(place.run(&["resume", "d"]).code(), 2);
    std::fs::write(&path, planned).expect("written");
    let done = place.json(&["resume", "d"]);
    assert_eq!((&done["runs"], &done["failed"]), (&18.into(), &0.into()), "none has failed for it");
}

#[test]
fn a_plan_that_a_precision_ends_names_only_commands_that_run_it() {
    let place = place();
    let plan = ["sweep", "plan", "s.toml", "--cycles", "50", "--until", "ci=0.5", "--max", "12"];
    let told = place.run(&[&plan[..], &["--out", "d"]].concat());
    assert_eq!(told.code(), 0, "{}", told.err());
    assert!(told.out().contains("at most 12 of each, at most 12 in all"), "{}", told.out());
    let status = place.run(&["sweep", "status", "d"]).out();
    assert!(status.contains("of at most 12") && status.contains("sidestep resume d"), "{status}");
    let commands = told.out();
    let commands: Vec<&str> =
        commands.lines().filter_map(|l| l.split_once("sidestep ")).map(|p| p.1).collect();
    assert_eq!(commands, ["resume d"]);
    let ended = place.run(&["resume", "d"]);
    assert_eq!(ended.code(), 0, "{}", ended.err());
}

#[test]
fn the_status_of_a_sweep_that_somebody_works_on_names_no_second_command() {
    let place = place();
    place.json(&["sweep", "plan", "s.toml", "--cycles", "100000000", "--out", "d"]);
    let next = || place.run(&["sweep", "status", "d"]).out();
    assert!(next().contains("sidestep resume d"), "{}", next());
    let mut child = place.start(&["resume", "d", "--workers", "1"]);
    let journal = place.path("d/shares/0-of-1.journal");
    wait_for("the journal", || journal.is_file());
    let at_work = next();
    child.kill().expect("killed");
    child.wait().expect("gone");
    assert!(!at_work.contains("sidestep"), "{at_work}");
    assert!(next().contains("sidestep resume d"), "{}", next());
}

#[test]
fn a_wanted_precision_on_the_command_line_keeps_what_else_the_file_says_of_it() {
    let place = place();
    let file = "format = 1\nscenario = \"s.toml\"\n[set]\ncycles = 100\n\
                [until]\nci = 0.5\nmetrics = [\"contacts\"]\nmax_runs = 12\n";
    place.write("until.toml", file);
    let done = place.json(&["sweep", "until.toml", "--until", "ci=0.0001"]);
    assert_eq!(done["runs"], 12);
    let done = place.json(&["sweep", "until.toml", "--until", "ci=0.0001", "--max", "11"]);
    assert_eq!(done["runs"], 11);
    let ended = place.run(&["sweep", "s.toml", "--max", "11"]);
    assert!(ended.code() == 2 && ended.err().contains("--until"), "{}", ended.err());
}

#[test]
fn a_wrong_baseline_is_answered_with_what_there_is() {
    let place = place();
    let wrong = [
        ("regime=sensors", "which no variant has", "\"reliable\", \"both\""),
        ("regme=both", "which is not varied", "did you mean `regime`"),
    ];
    for (baseline, cause, remedy) in wrong {
        let vary = ["sweep", "s.toml", "--vary", "regime=reliable,both", "--baseline", baseline];
        let ended = place.run(&vary);
        assert_eq!(ended.code(), 2);
        assert!(ended.err().contains(cause) && ended.err().contains(remedy), "{}", ended.err());
    }
    let twice = place.run(&["sweep", "s.toml", "--vary", "regime=both,both", "--out", "d"]);
    assert!(twice.code() == 2 && twice.err().contains("is there twice"), "{}", twice.err());
    assert!(!place.path("d").exists());
}

#[test]
fn variants_whose_planner_knows_all_places_are_marked_as_privileged_in_tables_and_figures() {
    let place = TestFolder::new();
    let hall = "format = 1\nworld = \"robots\"\ncycles = 60\nmap.ascii = \"\"\"\n........\n........\n\"\"\"\n\
                [robots]\ncount = 4\nbehaviour = { kind = \"shuttle\", a = [0, 0, 1, 2], b = [7, 0, 1, 2] }\n";
    place.write("hall.toml", hall);
    let sweep = "format = 1\nscenario = \"hall.toml\"\nreplicates = 2\nmetrics = [\"trips\"]\n\
                 [[variant]]\nname = \"alone\"\n\
                 [[variant]]\nname = \"all places\"\nrobots.planner = { method = \"pibt\" }\n\
                 [[variant]]\nname = \"reports\"\n\
                 robots.planner = { method = \"pibt\", places = \"believed\", report_every = 3 }\n";
    place.write("s.sweep.toml", sweep);
    place.json(&["sweep", "s.sweep.toml", "--out", "s"]);
    let report = place.run(&["report", "s"]);
    assert_eq!(report.code(), 0, "{}", report.err());
    let markdown = place.read("s/report.md");
    let note = "Variants with \\* (all places \\*) are privileged, a bound rather than an equal of others: a planner knows \
                the true places of all bodies, and who is late.";
    assert!(markdown.matches(note).count() > 1, "below the table and the figure: {markdown}");
    assert!(markdown.contains("| all places \\* |"), "{markdown}");
    assert!(!markdown.contains("reports \\*") && !markdown.contains("alone \\*"), "{markdown}");
}
