//! Sweeps and comparisons as a newcomer meets them: baselines, seeds that change nothing, lines that
//! fit, and errors that name the typed words.

use crate::support::{CommandOutput, TestFolder};
use serde_json::Value;

/// Two airplanes that meet; no number is drawn but by the optimizer.
const MEETING: &str = "format = 1\nworld = \"airspace\"\nname = \"meeting\"\n[airspace]\n\
                       shield = \"off\"\n[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\n\
                       way_points_m = [[9000, 0]]\n[[airplanes]]\nat_m = [9000, 500]\nheading_deg = 180\n\
                       way_points_m = [[0, 500]]\n";

fn place() -> TestFolder {
    let place = TestFolder::new();
    place.write("meeting.toml", MEETING);
    place
}

/// Checks that the text fits into 80 columns.
fn fits(ended: &CommandOutput) {
    let text = ended.out();
    let long = text.lines().find(|line| line.chars().count() > 80);
    assert!(ended.code() == 0 && long.is_none(), "{long:?} in\n{text}{}", ended.err());
}

fn comparisons(told: &Value) -> Vec<[&str; 2]> {
    let all = told["summary"]["metrics"][0]["comparisons"].as_array().expect("a list");
    all.iter().map(|c| ["variant", "baseline"].map(|key| c[key].as_str().expect("text"))).collect()
}

#[test]
fn a_baseline_is_compared_within_the_other_factors() {
    let place = place();
    let base = ["sweep", "s.toml", "--vary", "regime=reliable,both", "--vary", "people.count=0,2"];
    let short = ["--replicate", "3", "--cycles", "100", "--metrics", "contacts"];
    let told = place.json(&[&base[..], &short, &["--baseline", "regime=reliable"]].concat());
    assert_eq!(told["summary"]["baseline"], "regime=reliable");
    assert_eq!(
        comparisons(&told),
        [
            ["regime=both, count=0", "regime=reliable, count=0"],
            ["regime=both, count=2", "regime=reliable, count=2"],
        ]
    );
    let plain = place.run(&[&base[..], &short].concat());
    assert!(plain.out().contains("--baseline regime=reliable"), "{}", plain.out());
    fits(&plain);
}

#[test]
fn listed_variants_have_names_and_a_name_is_a_baseline() {
    let place = place();
    let file = "format = 1\nscenario = \"s.toml\"\nreplicates = 2\nmetrics = [\"contacts\"]\n\
                baseline = \"as it is\"\n[set]\ncycles = 100\n[[variant]]\nname = \"as it is\"\n\
                [[variant]]\nname = \"a crowd\"\npeople.count = 4\nregime = \"both\"\n";
    place.write("named.toml", file);
    assert_eq!(comparisons(&place.json(&["sweep", "named.toml"])), [["a crowd", "as it is"]]);
    let wrong = place.run(&["sweep", "named.toml", "--baseline", "a crwd"]);
    assert!(wrong.code() == 2 && wrong.err().contains("did you mean `a crowd`"), "{}", wrong.err());
    // The variant that sets no number of people has that of the scenario.
    let told = place.json(&["sweep", "named.toml", "--baseline", "people.count=(default)"]);
    assert_eq!(told["summary"]["baseline"], "as it is");
}

#[test]
fn where_seeds_change_nothing_there_is_one_run_and_no_interval() {
    let place = place();
    let sweep = |method: &str| {
        let method = format!("airspace.method={method}");
        place.run(&["sweep", "meeting.toml", "--replicate", "20", "--vary", &method])
    };
    let undrawn = sweep("none,mvp");
    fits(&undrawn);
    assert!(undrawn.out().contains("2 runs of 2 variants"), "{}", undrawn.out());
    assert!(undrawn.out().contains("no random number is drawn"), "{}", undrawn.out());
    assert!(!undrawn.out().contains(" n=") && !undrawn.out().contains('['), "{}", undrawn.out());
    let searched = sweep("pc,mvp");
    assert!(searched.out().contains("3 runs of 2 variants"), "{}", searched.out());
    assert!(searched.out().contains("seeds 1 and 2 ended in the same"), "{}", searched.out());
    let drawn = place.json(&[
        "sweep",
        "meeting.toml",
        "--replicate",
        "3",
        "--set",
        "airspace.position_noise_m=5",
    ]);
    assert_eq!(drawn["runs"], 3, "errors of positions are drawn");
}

#[test]
fn shares_come_to_the_table_of_one_process_where_seeds_change_nothing() {
    let place = place();
    let vary = ["--vary", "airspace.method=none,pc", "--replicate", "5"];
    place.json(&[&["sweep", "meeting.toml", "--out", "one"][..], &vary].concat());
    place.json(&[&["sweep", "plan", "meeting.toml", "--out", "shared"][..], &vary].concat());
    for shard in ["1/2", "0/2"] {
        place.json(&["sweep", "run", "shared", "--shard", shard]);
    }
    assert_eq!(place.json(&["sweep", "collect", "shared"])["runs"], 3);
    let table =
        |folder: &str| std::fs::read(place.path(folder).join("results.parquet")).expect("there");
    assert!(table("one") == table("shared"));
}

#[test]
fn compare_flies_once_what_no_seed_changes_and_fits() {
    let place = place();
    let compared = place.run(&["compare", "meeting.toml", "--runs", "20"]);
    fits(&compared);
    assert!(!compared.out().contains(" n="), "{}", compared.out());
    let told = place.json(&["compare", "meeting.toml", "--runs", "20"]);
    for method in told["methods"].as_array().expect("a list") {
        assert_eq!((&method["runs"], &method["loss_free_interval"]), (&1.into(), &Value::Null));
    }
    let drawn = ["compare", "meeting.toml", "--runs", "3", "--set", "airspace.position_noise_m=5"];
    fits(&place.run(&drawn));
    assert_eq!(place.json(&drawn)["methods"][0]["runs"], 3);
}

#[test]
fn a_quiet_sweep_prints_its_tables_or_where_they_are() {
    let place = place();
    let base = ["sweep", "s.toml", "--replicate", "2", "--cycles", "50", "-q"];
    let tables = place.run(&base);
    let told = ["not shown", "time  ", "#"].iter().any(|word| tables.out().contains(word));
    assert!(
        !told && tables.err().is_empty() && tables.out().contains("variant"),
        "{}",
        tables.out()
    );
    let kept = place.run(&[&base[..], &["--out", "d"]].concat());
    assert_eq!((kept.out().as_str(), kept.err().as_str()), ("d/results.parquet\n", ""));
}

#[test]
fn an_error_names_the_setting_that_was_typed_and_no_line_of_an_edited_text() {
    let place = place();
    let ended = place.run(&["run", "s.toml", "--set", "cycles=50", "--set", "people.count=-4"]);
    assert_eq!(ended.code(), 2);
    assert!(
        ended.err().starts_with("error: s.toml with --set people.count=-4: "),
        "{}",
        ended.err()
    );
    let ended = place.run(&["sweep", "s.toml", "--vary", "people.count=1,-4"]);
    assert!(ended.err().starts_with("error: s.toml, where people.count = -4: "), "{}", ended.err());
}
