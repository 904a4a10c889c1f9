//! `sidestep inspect`: what a file is, and what becomes of it when it is read.

use crate::support::{SCENARIO, TestFolder, signal, wait_for};

const MAP: &str = "type octile\nheight 2\nwidth 3\nmap\n.@S\n...\n";

#[test]
fn a_report_names_the_format_the_counts_and_what_was_not_taken_as_it_stood() {
    let place = TestFolder::new();
    place.write("a.map", MAP);
    let output = place.run(&["inspect", "a.map"]);
    assert_eq!(output.code(), 0);
    let text = output.out();
    assert!(text.starts_with("a.map\n  format           map in characters (MovingAI)\n"), "{text}");
    assert!(
        text.contains("boxes            3 x 2\n") && text.contains("free boxes       5\n"),
        "{text}"
    );
    assert!(text.contains("  not used: the symbol `S` (swamp, or service point"), "{text}");
    let json = place.json(&["inspect", "a.map"]);
    let file = &json["files"][0];
    assert_eq!(file["file"], "a.map");
    assert_eq!(file["findings"][0]["treatment"], "not-used");
    assert_eq!(file["findings"][0]["places"][0], "line 5");
}

#[test]
fn of_several_files_all_that_can_be_read_are_shown_and_all_errors_are_told() {
    let place = TestFolder::new();
    place.write("a.map", MAP);
    place.write("bad.map", "type octile\nheight 2\n");
    place.write("notes.md", "# Notes\n");
    let output = place.run(&["inspect", "bad.map", "a.map", "notes.md"]);
    assert_eq!(output.code(), 2);
    assert!(output.out().starts_with("a.map\n"), "{}", output.out());
    let errors = output.err();
    assert!(errors.contains("bad.map:") && errors.contains("notes.md: neither"), "{errors}");
}

#[test]
fn runs_recordings_and_scenarios_are_told_apart() {
    let place = TestFolder::new();
    place.write("s.toml", SCENARIO);
    place.json(&["run", "s.toml", "--cycles", "20", "--out", "r", "--mcap", "r.mcap"]);
    let json = place.json(&["inspect", "s.toml", "r", "r.mcap"]);
    let formats: Vec<&str> =
        (0..3).map(|k| json["files"][k]["format"].as_str().expect("a format")).collect();
    assert_eq!(
        formats,
        [
            "scenario of the world `robots`",
            "run folder of this program",
            "recording of this program (MCAP)"
        ]
    );
    let kept = json["files"][1]["kept"].as_array().expect("counts");
    assert!(
        kept.iter().any(|item| item["noun"] == "rows of events" || item["count"] != 0),
        "{json}"
    );
}

#[test]
fn a_clean_map_is_written_for_one_file_at_a_time() {
    let place = TestFolder::new();
    place.write("a.map", MAP);
    assert_eq!(place.run(&["inspect", "a.map", "--clean", "clean map.yaml"]).code(), 0);
    let map = place.json(&["map", "clean map.yaml", "--box", "1"]);
    assert_eq!((&map["boxes"]["free"], &map["boxes"]["wall"]), (&5.into(), &1.into()));
    let two = place.run(&["inspect", "a.map", "clean map.yaml", "--clean", "b.yaml"]);
    assert_eq!(two.code(), 2);
    assert!(two.err().contains("clean one file at a time"), "{}", two.err());
    place.write("s.toml", SCENARIO);
    let told = place.run(&["inspect", "s.toml", "--clean", "b.toml"]);
    assert_eq!(told.code(), 2);
    assert!(told.err().contains("s.toml: --clean writes no file of this kind"), "{}", told.err());
}

#[test]
fn a_folder_is_not_cleaned_and_one_of_no_kind_is_told_apart_from_a_file() {
    let place = TestFolder::new();
    let child = place.start(&["run", "s.toml", "--out", "a run", "--cycles", "1000000000"]);
    wait_for("a checkpoint", || place.path("a run/checkpoint.bin").exists());
    signal(&child, "INT");
    child.wait_with_output().expect("ended");
    place.write("a run/notes.txt", "mine");
    let told = place.run(&["inspect", "a run", "--clean", "clean"]);
    assert_eq!(told.code(), 2);
    assert!(told.out().contains("continue it with `sidestep resume 'a run'`"), "{}", told.out());
    let advised =
        "takes nothing out of a folder\n  help: leave --clean out; `sidestep verify 'a run'` lists";
    assert!(told.err().contains(advised), "{}", told.err());
    let listed = place.run(&["verify", "a run"]);
    assert!(listed.out().contains("notes.txt"), "{}{}", listed.out(), listed.err());
    std::fs::create_dir(place.path("empty")).expect("made");
    for clean in [&[][..], &["--clean", "clean"]] {
        let told = place.run(&[&["inspect", "empty"], clean].concat());
        assert_eq!(told.code(), 2);
        assert!(told.err().contains("empty: this folder is no run"), "{}", told.err());
    }
    assert!(!place.path("clean").exists());
}
