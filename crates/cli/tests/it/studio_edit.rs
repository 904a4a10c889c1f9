//! Scenarios that are edited and saved in the studio: nothing of them is lost, even if other programs change their
//! files.

use crate::studio::{Page, Studio};
use crate::support::{SmallDisk, TestFolder};
use serde_json::{Value, json};

impl Page {
    fn edit(&mut self, text: &Value, edits: Value) -> Value {
        let call = json!({ "do": "edit", "session": 1, "text": text, "edits": edits });
        self.ask(call)["text"].clone()
    }

    fn text(&mut self) -> Value {
        self.ask(json!({ "do": "source", "session": 1 }))["text"].clone()
    }
}

fn save(text: &Value, to: Option<&str>, over: bool) -> Value {
    json!({ "do": "save", "session": 1, "text": text, "to": to, "overwrite": over })
}

fn cause(reply: &Value) -> String {
    reply["problem"]["cause"].as_str().unwrap_or_else(|| panic!("{reply}")).to_string()
}

#[test]
fn comments_outlive_ten_edits_and_saving_and_the_session_goes_on_with_the_file() {
    let place = TestFolder::new();
    let old = place.read("s.toml").replace("seed = 5", "# On the seed.\nseed = 5   # why");
    place.write("s.toml", &old);
    let studio = Studio::start(&place, &["s.toml"]);
    let mut page = studio.page();
    page.open("s.toml");
    let mut text = page.text();
    for round in 0..10 {
        let edits = json!([
            { "op": "set", "key": "seed", "value": round },
            { "op": "set", "key": "robots.0.count", "value": round % 3 + 1 },
            { "op": "paint", "key": "map.ascii", "cells": [[2, round + 1, "#"]] },
            { "op": "insert", "key": "robots", "at": null, "value": { "effector": "nomad" } },
            { "op": "remove", "key": "robots.2" },
        ]);
        text = page.edit(&text, edits);
    }
    let expected =
        old.replace("seed = 5 ", "seed = 9 ").replace("count = 2\nsize", "count = 1\nsize");
    let lines: Vec<&str> = expected.lines().collect();
    let edited: Vec<&str> = text.as_str().expect("text").lines().collect();
    let differing: Vec<usize> =
        (0..lines.len()).filter(|line| lines[*line] != edited[*line]).collect();
    assert_eq!((edited.len(), differing.len()), (lines.len(), 1), "{text}");
    assert_eq!(edited[differing[0]], "############...........#", "the row that was painted");
    assert_eq!(page.ask(save(&text, None, false)), json!({ "is": "saved", "place": "s.toml" }));
    assert_eq!(text, place.read("s.toml"));
    page.ask(json!({ "do": "restart", "session": 1, "seed": null, "text": text }));
    // A file that it has written itself is no surprise.
    let again = page.edit(&text, json!([{ "op": "set", "key": "seed", "value": 3 }]));
    assert_eq!(page.ask(save(&again, None, false))["is"], "saved");
    assert!(place.read("s.toml").contains("# On the seed.\nseed = 3   # why\n"));
}

#[test]
fn a_file_to_import_is_reported_as_the_command_does_and_a_scenario_is_not() {
    let place = TestFolder::new();
    place.write("a.map", "type octile\nheight 1\nwidth 3\nmap\n.@S\n");
    let studio = Studio::start(&place, &["."]);
    let mut page = studio.page();
    let reply = page.ask(json!({ "do": "import-report", "path": "./a.map" }));
    assert_eq!(reply["lines"][0], json!(["format", "map in characters (MovingAI)"]), "{reply}");
    let told = place.json(&["inspect", "a.map"]);
    assert_eq!(reply["findings"].as_array().map(Vec::len), Some(1), "{reply}");
    assert!(reply["findings"][0].as_str().expect("words").contains("symbol `S`"), "{reply}");
    assert_eq!(told["files"][0]["findings"].as_array().map(Vec::len), Some(1), "{told}");
    // A scenario that a page has written may name any file of the disk.
    for path in ["./s.toml", "/etc/passwd", "missing.map"] {
        let reply = page.reply(json!({ "do": "import-report", "path": path }));
        assert!(reply["problem"].is_object(), "{path}: {reply}");
    }
}

#[test]
fn the_values_of_a_text_and_the_files_that_it_can_name_are_told() {
    let place = TestFolder::new();
    place.write("plan.pgm", "P2 1 1 255 255");
    let studio = Studio::start(&place, &["s.toml"]);
    let mut page = studio.page();
    page.open("s.toml");
    let text = "a = 2020-01-01\nb = [nan, 1.5, 2]\n\"c.d\" = { e = 'x' }\nf = \"/etc/passwd\"\n";
    let model = page.ask(json!({ "do": "model", "session": 1, "text": text }));
    let value =
        json!({ "a": "2020-01-01", "b": [null, 1.5, 2], "c.d": { "e": "x" }, "f": "/etc/passwd" });
    assert_eq!((&model["value"], &model["files"]), (&value, &json!(["plan.pgm", "s.toml"])));
    let reply = page.reply(json!({ "do": "model", "session": 1, "text": "a = = 1" }));
    assert_eq!((&reply["problem"]["line"], &reply["problem"]["column"]), (&json!(1), &json!(5)));
    let edit = json!([{ "op": "set", "key": "robots.7.count", "value": 1 }]);
    let wrong =
        json!({ "do": "edit", "session": 1, "text": "[[robots]]\n[[robots]]\n", "edits": edit });
    let reply = page.reply(wrong);
    assert!(cause(&reply).contains("no element 7"), "{reply}");
    assert_eq!(reply["problem"]["key"], "robots.7.count");
}

#[test]
fn a_file_that_another_program_changed_is_not_overwritten_unasked() {
    let place = TestFolder::new();
    let studio = Studio::start(&place, &["s.toml"]);
    let mut page = studio.page();
    page.open("s.toml");
    let text = page.text();
    let changed = place.read("s.toml").replace("seed = 5", "seed = 77");
    place.write("s.toml", &changed);
    let mine = page.edit(&text, json!([{ "op": "set", "key": "seed", "value": 6 }]));
    assert_eq!(page.ask(save(&mine, None, false)), json!({ "is": "differs", "text": changed }));
    assert_eq!(place.read("s.toml"), changed);
    assert_eq!(page.ask(save(&mine, None, true))["is"], "saved");
    assert_eq!(mine, place.read("s.toml"));
    // A file that was written again with the same content has not changed; one that is gone has nothing to lose.
    std::fs::remove_file(place.path("s.toml")).expect("removed");
    place.write("s.toml", mine.as_str().expect("text"));
    assert_eq!(page.ask(save(&text, None, false))["is"], "saved");
    std::fs::remove_file(place.path("s.toml")).expect("removed");
    assert_eq!(page.ask(save(&mine, None, false))["is"], "saved");
    assert_eq!(place.names(), ["s.toml"]);
}

#[test]
fn a_scenario_is_saved_under_another_name_and_stays_there() {
    let place = TestFolder::new();
    std::fs::create_dir(place.path("deep")).expect("made");
    place.write("taken.toml", "world = \"robots\"\n");
    place.write("traffic.scn", "00:00:00.00>CRE A,B738,52,4,90,FL200,250\n");
    let studio = Studio::start(&place, &["s.toml", "."]);
    let mut page = studio.page();
    let open = |what: Value| json!({ "do": "open", "target": what, "seed": null });
    page.ask(open(json!({ "kind": "new", "world": "robots" })));
    let text = page.text();
    assert!(cause(&page.reply(save(&text, None, false))).contains("in no file yet"));
    for (to, wrong) in [
        ("deep/new.txt", "no name of a scenario"),
        ("../new.toml", "below"),
        ("/tmp/new.toml", "below"),
        (".new.toml", "hidden"),
        ("gone/new.toml", "below"),
    ] {
        let reply = page.reply(save(&text, Some(to), true));
        assert!(cause(&reply).contains(wrong), "{reply}");
    }
    assert_eq!(page.ask(save(&text, Some("taken.toml"), false))["is"], "differs");
    assert_eq!(page.ask(save(&text, Some("deep/new.toml"), false))["place"], "deep/new.toml");
    let source = page.ask(json!({ "do": "source", "session": 1 }));
    assert_eq!(source["place"], "deep/new.toml");
    assert_eq!(page.ask(save(&json!("world = 1"), None, false))["is"], "saved");
    assert_eq!(place.read("deep/new.toml"), "world = 1");
    let model = page.ask(json!({ "do": "model", "session": 1, "text": "" }));
    assert_eq!(model["files"], json!(["new.toml"]), "its folder is another one");
    page.ask(json!({ "do": "close", "session": 1 }));
    page.ask(open(json!({ "kind": "scenario", "path": "traffic.scn" })));
    let mut call = save(&json!("world = \"airspace\"\n"), None, true);
    call["session"] = json!(2);
    assert!(cause(&page.reply(call.clone())).contains("in no file yet"));
    call["to"] = json!("traffic.toml");
    assert_eq!(page.ask(call)["is"], "saved");
    assert!(place.read("traffic.scn").starts_with("00:00"));
}

#[test]
fn a_studio_that_only_reads_writes_nothing_and_edits_nothing() {
    let place = TestFolder::new();
    let old = place.read("s.toml");
    let studio = Studio::start(&place, &["s.toml", "--read-only"]);
    let mut page = studio.page();
    page.open("s.toml");
    let text = page.text();
    for call in [
        save(&text, None, true),
        save(&text, Some("new.toml"), true),
        json!({ "do": "edit", "session": 1, "text": text, "edits": [] }),
    ] {
        let reply = page.reply(call);
        let remedy = reply["problem"]["remedy"].as_str().expect("a remedy");
        assert!(remedy.contains("--read-only"), "{reply}");
    }
    assert_eq!((place.names(), place.read("s.toml")), (vec!["s.toml".into()], old));
    assert_eq!(page.ask(json!({ "do": "model", "session": 1, "text": text }))["value"]["seed"], 5);
}

#[test]
fn a_recording_is_not_saved() {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--cycles", "10", "--out", "r"]);
    let studio = Studio::start(&place, &["r"]);
    let mut page = studio.page();
    page.ask(json!({ "do": "open", "target": { "kind": "recording", "path": "r" }, "seed": null }));
    let text = page.text();
    for to in [None, Some("r/new.toml")] {
        assert!(cause(&page.reply(save(&text, to, true))).contains("recording"));
    }
}

#[test]
fn a_full_disk_leaves_the_old_file_whole() {
    let place = TestFolder::new();
    let at = place.path("disk");
    let Some(disk) = SmallDisk::mount(&at, "32k") else {
        sidestep_testing::skip("this user may not mount a small disk");
        return;
    };
    let old = place.read("s.toml");
    place.write("disk/s.toml", &old);
    let studio = Studio::start(&place, &["disk/s.toml"]);
    let mut page = studio.page();
    page.open("disk/s.toml");
    let long = json!(format!("{old}{}", "# A line of a comment.\n".repeat(3000)));
    let reply = page.reply(save(&long, None, false));
    assert!(cause(&reply).contains("it is as it was"), "{reply}");
    assert_eq!(reply["problem"]["remedy"], "make room, and save again");
    assert_eq!(place.read("disk/s.toml"), old);
    assert_eq!(std::fs::read_dir(&at).expect("a folder").count(), 1, "nothing half-written stays");
    disk.grow("1m");
    assert_eq!(page.ask(save(&long, None, false))["is"], "saved");
    assert_eq!(long, place.read("disk/s.toml"));
}
