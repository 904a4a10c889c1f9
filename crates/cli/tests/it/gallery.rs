//! The runs of a sweep as pages: variants x seeds with their metrics, and replays that end as the sweep's runs do.

use crate::support::{TestFolder, names};
use serde_json::{Value, json};

/// Two variants with seeds 5 to 10; the digests of all runs are in the folder `w`.
fn swept() -> TestFolder {
    let place = TestFolder::new();
    let sweep = "format = 1\nscenario = \"s.toml\"\nname = \"</script><b>few & many\"\nreplicates = 6\n\
                 [set]\ncycles = 60\n[vary]\nrobots.1.count = [1, 4]\n";
    place.write("w.toml", sweep);
    place.json(&["sweep", "w.toml", "--out", "w"]);
    place
}

/// Exports the sweep; none where the program has no page.
fn exported(place: &TestFolder, more: &[&str]) -> Option<Value> {
    let made = place.run(&[&["export", "w", "--to", "page", "--json"], more].concat());
    if made.err().contains("built without the studio's page") {
        return None;
    }
    assert_eq!(made.code(), 0, "{more:?}: {}", made.err());
    Some(made.json())
}

#[test]
fn a_sweep_becomes_a_page_of_its_runs_with_replays_and_the_number_of_workers_changes_no_byte() {
    let place = swept();
    let all = ["--runs", "all", "--every", "10", "--workers", "1", "--out", "one"];
    let Some(told) = exported(&place, &all) else { return };
    assert_eq!(told["written"], json!(["one/index.html"]));
    assert_eq!((&told["gallery"]["runs"], &told["gallery"]["replays"]), (&json!(12), &json!(12)));
    assert_eq!(told["digest_confirmed"], json!(true));
    assert_eq!(names(&place.path("one")), ["export.manifest.json", "index.html", "runs"]);
    let pages = names(&place.path("one/runs"));
    let expected: Vec<String> = (0..12).map(|trial| format!("{trial:06}.html")).collect();
    assert_eq!(pages, expected);
    exported(&place, &["--runs", "all", "--every", "10", "--workers", "3", "--out", "three"]);
    let files = pages.iter().map(|page| format!("runs/{page}")).chain(["index.html".to_string()]);
    for file in files {
        let bytes = |folder: &str| std::fs::read(place.path(folder).join(&file)).expect("a page");
        assert!(bytes("one") == bytes("three"), "{file}");
    }
    assert_eq!(place.run(&["verify", "one"]).code(), 0);
}

#[test]
fn the_page_has_every_run_names_are_text_and_no_place_of_the_machine_is_in_it() {
    let place = swept();
    if exported(&place, &["--runs", "3", "--every", "30"]).is_none() {
        return;
    }
    assert_eq!(names(&place.path("w-gallery/runs")).len(), 3, "the first of each variant, and one");
    let page = place.read("w-gallery/index.html");
    for run in ["000000", "000006"] {
        assert!(page.contains(&format!("runs/{run}.html")), "the first run of each variant");
    }
    assert_eq!(page.matches("data-run=").count(), 12);
    assert!(page.contains("few &amp; many") && !page.contains("<b>few"));
    assert!(page.contains("--runs all --replace w</code>"), "how to get the others");
    let replay = place.read("w-gallery/runs/000006.html");
    assert!(replay.contains("(count=4), seed 5 "), "a replay says which run it is");
    let folder = place.path("").display().to_string();
    for text in [&page, &replay] {
        assert!(!text.contains(folder.trim_end_matches('/')));
        assert!(text.contains("default-src 'none'"));
    }
}

#[test]
fn what_is_there_is_replaced_only_when_asked_and_files_of_others_stay() {
    let place = swept();
    let few = ["--runs", "1", "--every", "60"];
    if exported(&place, &few).is_none() {
        return;
    }
    let refused = place.run(&[&["export", "w", "--to", "page"], &few[..]].concat());
    assert_eq!((refused.code(), refused.out().as_str()), (2, ""));
    assert!(refused.err().contains("--replace"), "{}", refused.err());
    place.write("w-gallery/notes.txt", "mine");
    exported(&place, &["--runs", "2", "--every", "60", "--replace"]);
    assert_eq!(place.read("w-gallery/notes.txt"), "mine");
    assert_eq!(names(&place.path("w-gallery/runs")), ["000000.html", "000006.html"]);
    let refused = place.run(&["export", "w", "--to", "page", "--out", "w", "--replace"]);
    assert_eq!(refused.code(), 2, "a sweep is not replaced by its own pages");
    assert!(refused.err().contains("is exported, or holds it"), "{}", refused.err());
}

#[test]
fn what_cannot_be_is_told_and_nothing_is_written() {
    let place = swept();
    place.json(&["run", "s.toml", "--cycles", "20", "--out", "r"]);
    let before = place.names();
    let wrong: [(&[&str], &str); 7] = [
        (&["w", "--to", "csv"], "this is a sweep, not a run"),
        (&["w", "--to", "csv"], "w/results.parquet"),
        (&["w", "--to", "page", "--from", "3"], "--from: means nothing for the runs of a sweep"),
        (&["w", "--to", "page", "--beside", "r"], "--beside: means nothing"),
        (&["w", "--to", "page", "--runs", "0"], "is not `all`, `outliers` or a number"),
        (&["r", "--to", "page", "--runs", "all"], "--runs: means nothing for a single run"),
        (
            &["w", "--to", "page", "--every", "60", "--agents", "99"],
            "no run with a replay has such",
        ),
    ];
    for (args, words) in wrong {
        let ended = place.run(&[&["export"], args].concat());
        if ended.err().contains("built without the studio's page") {
            continue;
        }
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{args:?}: {}", ended.err());
        assert!(ended.err().contains(words), "{args:?}: {}", ended.err());
    }
    // Another scenario makes other runs.
    let scenario = place.read("w/variants/0001/scenario.toml");
    place.write("w/variants/0001/scenario.toml", scenario.replace("cycles = 60", "cycles = 61"));
    let ended = place.run(&["export", "w", "--to", "page", "--runs", "all"]);
    if !ended.err().contains("built without the studio's page") {
        assert_eq!(ended.code(), 2, "{}", ended.err());
        assert!(ended.err().contains("not as it was planned"), "{}", ended.err());
    }
    assert_eq!(place.names(), before);
}

#[test]
fn a_report_has_its_replay_beside_it_and_events_lead_to_their_cycle_and_agent() {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--cycles", "400", "--out", "r"]);
    let made = place.run(&["report", "r", "--page", "--json"]);
    if made.err().contains("built without the studio's page") {
        return;
    }
    assert_eq!(made.code(), 0, "{}", made.err());
    assert_eq!(made.json()["replay"], "r/report-replay.html");
    let report = place.read("r/report.html");
    assert!(report.contains("<a href=\"report-replay.html\">Open the replay</a>"));
    let links = report.matches("href=\"report-replay.html#cycle=").count();
    assert!(links > 3 && report.contains("&amp;agent="), "{links} events lead to the replay");
    assert!(place.read("r/report.md").contains("[Open the replay](report-replay.html)"));
    assert!(place.read("r/report-replay.html").starts_with("<!doctype html>"));
    assert_eq!(place.run(&["verify", "r/report.html"]).code(), 0);
    // Without it nothing leads anywhere.
    place.json(&["report", "r", "--out", "plain.html"]);
    assert!(!place.read("plain.html").contains("replay.html"));
}

#[test]
fn a_report_of_a_sweep_has_the_page_of_its_runs_beside_it() {
    let place = swept();
    let made = place.run(&["report", "w", "--page", "--json"]);
    if made.err().contains("built without the studio's page") {
        return;
    }
    assert_eq!(made.code(), 0, "{}", made.err());
    assert_eq!(made.json()["replay"], "w/report-replays/index.html");
    assert!(place.read("w/report.html").contains("href=\"report-replays/index.html\""));
    assert_eq!(names(&place.path("w/report-replays/runs")).len(), 12);
    assert_eq!(place.run(&["verify", "w/report.html"]).code(), 0);
}
