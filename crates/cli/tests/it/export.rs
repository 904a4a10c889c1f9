//! Exports of recorded runs, and runs computed again from their recordings.

use crate::support::{TestFolder, names};
use serde_json::json;

fn recorded() -> TestFolder {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--cycles", "400", "--out", "r", "--mcap", "r.mcap"]);
    place
}

#[test]
fn a_whole_run_is_computed_again_and_its_digest_confirmed() {
    let place = recorded();
    let run = place.json(&["run", "s.toml", "--cycles", "400"]);
    for recording in ["r", "r.mcap"] {
        let replayed = place.json(&["replay", recording]);
        assert_eq!((&replayed["digest"], &replayed["confirmed"]), (&run["digest"], &json!(true)));
    }
    let words = place.run(&["replay", "r"]);
    assert!(words.out().starts_with("Confirmed: 400 cycles"), "{}", words.out());
    // The recording must be self-contained.
    std::fs::rename(place.path("r.mcap"), place.path("alone.mcap")).expect("moved");
    std::fs::remove_dir_all(place.path("r")).expect("removed");
    assert_eq!(place.run(&["replay", "alone.mcap", "--workers", "3"]).code(), 0);
}

#[test]
fn a_recording_brings_the_files_of_its_scenario_along() {
    let place = TestFolder::new();
    place.write("floor.pgm", [&b"P5\n40 30\n255\n"[..], &[254; 40 * 30]].concat());
    place.write(
        "floor.yaml",
        "image: floor.pgm\nresolution: 0.1\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n\
         occupied_thresh: 0.65\nfree_thresh: 0.196\n",
    );
    let text = "format = 1\nworld = \"robots\"\ncycles = 50\n[map]\nfile = \"floor.yaml\"\n\
                box_size_m = 0.2\n[robots]\ncount = 3\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n";
    place.write("map.toml", text);
    let run = place.json(&["run", "map.toml", "--out", "r", "--mcap", "m.mcap"]);
    for name in ["floor.pgm", "floor.yaml", "map.toml"] {
        std::fs::remove_file(place.path(name)).expect("removed");
    }
    assert_eq!(place.json(&["replay", "m.mcap"])["digest"], run["digest"]);
    place.json(&["export", "r", "--to", "mcap", "--out", "e.mcap"]);
    place.json(&["export", "m.mcap", "--to", "mcap", "--out", "again.mcap"]);
    let bytes = |name: &str| std::fs::read(place.path(name)).expect("read");
    assert!(bytes("e.mcap") == bytes("m.mcap") && bytes("again.mcap") == bytes("m.mcap"));
}

#[test]
fn another_digest_than_the_recorded_one_fails() {
    let place = recorded();
    let manifest = place.read("r/run.json");
    let changed = manifest.replace("\"digest\": \"", "\"digest\": \"00");
    assert_ne!(manifest, changed);
    place.write("r/run.json", sidestep_record::seal_again(&changed));
    let replayed = place.run(&["replay", "r"]);
    assert_eq!((replayed.code(), replayed.out().as_str()), (1, ""), "{}", replayed.err());
    assert!(replayed.err().contains("recorded is 00"), "{}", replayed.err());
    assert_eq!(place.run(&["export", "r", "--to", "gif"]).code(), 1);
    assert!(!place.path("r.gif").exists(), "nothing is made of what differs");
}

#[test]
fn frames_change_no_result_and_equal_runs_give_equal_bytes() {
    let place = recorded();
    let plain = place.json(&["run", "s.toml", "--cycles", "400"]);
    let args = ["run", "s.toml", "--cycles", "400", "--workers", "2", "--mcap", "again.mcap"];
    assert_eq!(place.json(&args)["digest"], plain["digest"]);
    let bytes = |name: &str| std::fs::read(place.path(name)).expect("read");
    // The scenario of a run folder is the resolved one, like that of a recording.
    assert!(bytes("r.mcap") == bytes("again.mcap"), "the recordings differ");
    place.json(&["export", "r", "--to", "mcap", "--out", "exported.mcap"]);
    assert!(bytes("r.mcap") == bytes("exported.mcap"), "the exported recording differs");
}

#[test]
fn tables_are_exported_whole_or_in_part() {
    let place = recorded();
    let done = place.json(&["export", "r", "--to", "csv"]);
    assert_eq!(
        done["written"],
        json!(["r-csv/events.csv", "r-csv/series.csv", "r-csv/trajectories.csv"])
    );
    let lines = |name: &str| place.read(name).lines().count();
    assert_eq!(lines("r-csv/trajectories.csv"), 1 + 400 * 4);
    let part = ["export", "r", "--to", "csv", "--table", "trajectories"];
    let cycles = ["--from", "100", "--until", "200", "--every", "50"];
    place.json(&[&part[..], &cycles, &["--out", "part.csv"]].concat());
    assert_eq!(lines("part.csv"), 1 + 3 * 4);
    let begin = "cycle,body,col_boxes,row_boxes,heading\n100,0,";
    assert!(place.read("part.csv").starts_with(begin), "{}", place.read("part.csv"));
    place.json(&["export", "r", "--to", "parquet", "--table", "events"]);
    assert!(place.path("r-events.parquet").is_file());
    assert!(!place.names().iter().any(|name| name.ends_with(".partial")), "{:?}", place.names());
}

#[test]
fn pictures_and_films_are_drawn() {
    let place = recorded();
    for (form, begin) in [("svg", &b"<svg"[..]), ("png", b"\x89PNG"), ("gif", b"GIF89a")] {
        let done = place.json(&["export", "r", "--to", form]);
        assert_eq!(done["digest_confirmed"], true, "{form}");
        let bytes = std::fs::read(place.path(&format!("r.{form}"))).expect("written");
        assert!(bytes.starts_with(begin), "{form}");
    }
    let film = ["export", "r.mcap", "--to", "mp4-frames", "--from", "10", "--until", "40"];
    let told = place.run(&[&film[..], &["--every", "10", "--width", "200"]].concat());
    assert!(told.out().contains("ffmpeg -framerate 15"), "{}{}", told.out(), told.err());
    let numbered = ["frame-00001.png", "frame-00002.png", "frame-00003.png", "frame-00004.png"];
    let files = [&["export.manifest.json"], &numbered[..]].concat();
    assert_eq!(names(&place.path("r-frames")), files);
    let moment = ["export", "r", "--to", "svg", "--from", "123", "--out", "moment.svg"];
    assert_eq!(place.run(&moment).code(), 0);
    assert!(place.read("moment.svg").contains("Cycle 123."));
}

#[test]
fn pictures_show_the_chosen_agents_and_cycles_in_the_chosen_size() {
    let place = recorded();
    for recording in ["r", "r.mcap"] {
        let out = format!("{recording}.svg");
        let options =
            ["--to", "svg", "--agents", "0,2", "--cycles", "100:300", "--size", "800x500"];
        place.json(&[&["export", recording, "--out", &out, "--replace"][..], &options].concat());
        let svg = place.read(&out);
        assert!(svg.contains("width=\"800\" height=\"500\""), "{svg}");
        // The scenario has two sections of robots without names.
        for words in [">robots 0 to 1: robot 0<", ">robots 2: robot 2<", ">other robot (1)<"] {
            assert!(svg.contains(words), "{recording}: {words}: {svg}");
        }
        assert!(svg.contains("Tracks of 2 of 3 robots (the others pale), cycles 100 to 300."));
        assert_eq!(svg.matches("class=\"trail\"").count(), 2, "{recording}");
        assert!(svg.contains(">person<") && !svg.contains("mobile object"));
    }
    place.json(&["export", "r", "--to", "csv", "--table", "trajectories", "--cycles", "5:6"]);
    let rows = place.read("r-trajectories.csv");
    let cycles = rows.lines().skip(1).filter_map(|row| row.split(',').next());
    assert!(
        cycles.clone().count() > 0 && cycles.into_iter().all(|cycle| ["5", "6"].contains(&cycle))
    );
    let size = ["--size", "400x300", "--every", "50", "--out", "r.gif"];
    place.json(&[&["export", "r", "--to", "gif", "--cycles", "100:300"][..], &size].concat());
    let bytes = std::fs::read(place.path("r.gif")).expect("a film");
    let sides = [6, 8].map(|at| u16::from_le_bytes([bytes[at], bytes[at + 1]]));
    assert_eq!(sides, [400, 300]);
}

#[test]
fn options_of_pictures_that_fit_nothing_are_told_with_what_fits() {
    let place = recorded();
    let told = |options: &[&str]| {
        let ended = place.run(&[&["export", "r", "--out", "no"][..], options].concat());
        assert_ne!(ended.code(), 0, "{options:?}");
        assert!(!place.path("no").exists(), "{options:?}");
        ended.err()
    };
    let cases: [(&[&str], &str); 7] = [
        (&["--to", "png", "--view", "left"], "top, side, front"),
        (&["--to", "png", "--view", "side"], "give top, or leave it out"),
        (&["--to", "svg", "--agents", "7"], "their numbers are 0 to 2"),
        (&["--to", "csv", "--agents", "1"], "--agents"),
        (&["--to", "gif", "--cycles", "1:2", "--from", "1"], "leave one of them out"),
        (&["--to", "png", "--size", "800x600", "--width", "800"], "leave one of them out"),
        (&["--to", "mp4-frames", "--size", "801x600"], "give --size 800x600"),
    ];
    for (options, words) in cases {
        let said = told(options);
        assert!(said.contains(words), "{options:?}: {said}");
    }
}

#[test]
fn a_page_is_one_file_that_names_no_folder_and_lets_nothing_out() {
    let place = recorded();
    let made =
        place.run(&["export", "r", "--to", "page", "--agents", "0", "--every", "10", "--json"]);
    if made.err().contains("built without the studio's page") {
        return;
    }
    assert_eq!(made.code(), 0, "{}", made.err());
    let told: serde_json::Value = serde_json::from_str(&made.out()).expect("JSON");
    assert_eq!(
        told["page"],
        json!({ "frames": 41, "every": 10, "inspections": 41, "events_left_out": 0 })
    );
    let page = place.read("r.html");
    assert!(page.starts_with("<!doctype html>") && page.contains("default-src 'none'"));
    let folder = place.path("").display().to_string();
    assert!(!page.contains(folder.trim_end_matches('/')));
    assert_eq!(place.run(&["export", "r", "--to", "page"]).code(), 2, "it is there already");
    let beside = ["export", "r", "--to", "page", "--beside", "r.mcap", "--out", "two.html"];
    assert_eq!(place.run(&beside).code(), 0);
    let refused = place.run(&["export", "r", "--to", "page", "--agents", "999", "--out", "x.html"]);
    assert!(refused.err().contains("there is no such agent"), "{}", refused.err());
    assert!(!place.path("x.html").exists());
}

#[test]
fn what_is_there_is_replaced_only_when_asked() {
    let place = recorded();
    place.json(&["export", "r", "--to", "csv"]);
    place.write("r.gif", "mine");
    for form in ["csv", "gif"] {
        let refused = place.run(&["export", "r", "--to", form]);
        assert_eq!((refused.code(), refused.out().as_str()), (2, ""), "{form}");
        assert!(refused.err().contains("--replace"), "{}", refused.err());
    }
    let refused = place.run(&["export", "r", "--to", "gif", "--replace"]);
    assert_eq!(refused.code(), 2, "a file of others is left alone");
    assert!(refused.err().contains("no list names this file"), "{}", refused.err());
    assert_eq!(place.read("r.gif"), "mine");
    let mcap = ["run", "s.toml", "--cycles", "10", "--mcap", "r.mcap"];
    assert_eq!(place.run(&mcap).code(), 2, "a recording is no less safe");
    assert_eq!(place.run(&[&mcap[..], &["--replace"]].concat()).code(), 0);
    place.write("r-csv/notes.txt", "mine");
    let tables = ["export", "r", "--to", "csv", "--replace"];
    assert_eq!(place.run(&tables).code(), 0);
    assert_eq!(place.read("r-csv/notes.txt"), "mine", "files of others stay");
    place.write("r-csv/events.csv", "edited");
    let refused = place.run(&tables);
    assert_eq!((refused.code(), place.read("r-csv/events.csv").as_str()), (2, "edited"));
    assert!(
        refused.err().contains("changed since they were written: events.csv"),
        "{}",
        refused.err()
    );
}

#[test]
fn a_recording_for_viewers_is_replaced_only_if_it_is_ours_and_whole() {
    let place = recorded();
    let again = ["run", "s.toml", "--cycles", "10", "--mcap", "r.mcap", "--replace"];
    let whole = std::fs::read(place.path("r.mcap")).expect("read");
    let mut flipped = whole.clone();
    flipped[whole.len() / 3] ^= 4;
    for other in [&b"mine"[..], b"\x89MCAP0\r\nof others", &flipped] {
        place.write("r.mcap", other);
        let refused = place.run(&again);
        assert_eq!(refused.code(), 2, "{}", refused.err());
        assert!(std::fs::read(place.path("r.mcap")).expect("there") == other);
    }
    place.write("r.mcap", &whole);
    place.write("r.mcap.partial", "mine");
    let refused = place.run(&again);
    assert!(refused.err().contains("another program"), "{}", refused.err());
    assert_eq!(place.read("r.mcap.partial"), "mine");
    // As a killed process leaves it.
    place.write("r.mcap.partial", &whole[..whole.len() / 2]);
    for path in ["r.mcap", "new/../r.mcap"] {
        let refused = place.run(&["run", "s.toml", "--cycles", "10", "--mcap", path]);
        assert_eq!(refused.code(), 2, "what was recorded is not overwritten unasked");
    }
    let refused = place.run(&["run", "s.toml", "--cycles", "10", "--out", "new/../r"]);
    assert_eq!(refused.code(), 2, "{}", refused.err());
    assert!(!place.path("new").exists());
    assert_eq!(place.run(&again).code(), 0);
    assert!(!place.path("r.mcap.partial").exists());
}

#[test]
fn wrong_exports_are_told_and_write_nothing() {
    let place = recorded();
    place.write("foreign.mcap", b"\x89MCAP0\r\nno more");
    let before = place.names();
    let wrong: [(&[&str], &str); 11] = [
        (&["nowhere", "--to", "csv"], "nowhere"),
        (&["s.toml", "--to", "csv"], "no folder"),
        (&["foreign.mcap", "--to", "gif"], "damaged"),
        (&["r.mcap", "--to", "csv"], "no tables"),
        (&["r", "--to", "csv", "--table", "tracks"], "events, series, trajectories"),
        (&["r", "--to", "gif", "--from", "401"], "give 0 to 400"),
        (&["r", "--to", "gif", "--from", "40", "--until", "30"], "--until 30"),
        (&["r", "--to", "svg", "--fps", "10"], "--to svg"),
        (&["r", "--to", "csv", "--agents", "1"], "--agents: means nothing for --to csv"),
        (&["r", "--to", "page", "--agents", "x"], "`x` is no number of an agent"),
        (&["r", "--to", "page", "--cycles", "9:3"], "before it begins"),
    ];
    for (args, word) in wrong {
        let ended = place.run(&[&["export"], args].concat());
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{args:?}");
        assert!(ended.err().contains(word), "{args:?}: {}", ended.err());
    }
    assert_eq!(place.names(), before);
}

#[test]
fn a_recording_that_is_cut_off_is_noticed() {
    let place = recorded();
    let whole = std::fs::read(place.path("r.mcap")).expect("read");
    for length in [0, 8, 100, whole.len() / 2, whole.len() - 1] {
        place.write("cut.mcap", &whole[..length]);
        let ended = place.run(&["replay", "cut.mcap"]);
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{length} bytes");
    }
}
