//! The fixed keys of `--json`, which scripts rely on.

use crate::support::{SCENARIO, TestFolder};
use serde_json::Value;

/// Asserts that all of `keys` exist and none is null.
fn assert_keys(value: &Value, keys: &[&str]) {
    for key in keys {
        assert!(!value[key].is_null(), "`{key}` is missing in {value:#}");
    }
}

#[test]
fn run_says_what_was_promised() {
    let place = TestFolder::new();
    let run = place.json(&["run", "s.toml"]);
    let words = [
        "digest",
        "cycles",
        "robots",
        "wall_s",
        "cpu_s",
        "robot_cycles_per_cpu_s",
        "metrics",
        "seed",
        "status",
        "world",
        "version",
        "workers",
    ];
    assert_keys(&run, &words);
    assert_keys(&run["metrics"], &["contacts", "trips"]);
    assert_eq!((run["cycles"].as_u64(), run["robots"].as_u64()), (Some(3000), Some(3)));
    assert_eq!(run["status"], "complete");
    let digest = run["digest"].as_str().expect("text");
    assert!(digest.len() == 32 && digest.chars().all(|c| c.is_ascii_hexdigit()), "{digest}");
    assert_eq!(place.names(), ["s.toml"], "without --out nothing is written");
}

#[test]
fn the_book_has_every_word_of_a_summary_and_aliases_have_its_values() {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--cycles", "50", "--out", "r", "--mcap", "r.mcap"]);
    let text = place.read("r/summary.json");
    let summary: Value = serde_json::from_str(&text).expect("JSON");
    let chapter = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/columns.md");
    let chapter = std::fs::read_to_string(chapter).expect("the chapter");
    let (_, section) = chapter.split_once("## Summaries\n").expect("a section");
    let (section, _) = section.split_once("\n## ").expect("another one");
    let keys = |value: &Value| -> Vec<String> {
        value.as_object().expect("an object").keys().cloned().collect()
    };
    let words: Vec<String> = [keys(&summary), keys(&summary["phases_s"])].concat();
    for word in &words {
        assert!(section.contains(&format!("`{word}`")), "{word} is not in the book");
    }
    let phases = &summary["phases_s"];
    for (alias, word) in [
        (&summary["robots"], &summary["agents"]),
        (&summary["robot_cycles_per_cpu_s"], &summary["agent_cycles_per_cpu_s"]),
        (&phases["perceive_decide"], &phases["claim"]),
        (&phases["conflicts"], &phases["join"]),
        (&phases["react"], &phases["act"]),
    ] {
        assert!(alias == word && !word.is_null(), "{alias} is not {word}");
    }
}

#[test]
fn check_says_what_it_found() {
    let found = TestFolder::new().json(&["check", "s.toml"]);
    assert_keys(&found, &["name", "seed", "cycles", "regime", "map", "sensors", "memory_bytes"]);
    assert_eq!(found["map"]["width_boxes"], 24);
    assert_eq!(found["bodies"], serde_json::json!({ "door": 1, "person": 1, "robot": 3 }));
    assert_eq!(found["robots"][0]["behaviour"], "shuttle");
    assert_eq!(found["robots"][1]["behaviour"], "wander");
    assert_eq!(found["remarks"], serde_json::json!([]));
}

#[test]
fn check_says_what_will_surprise() {
    let place = TestFolder::new();
    let slips = "[{ p = 0.4, path = \"F\" }, { p = 0.6, turn = -90 }]";
    let wheels = format!("\n[effectors.wheels]\nforward = {slips}\n");
    place.write("s.toml", SCENARIO.replacen("\"nomad\"", "\"wheels\"", 1) + &wheels);
    let remarks = &place.json(&["check", "s.toml"])["remarks"];
    assert_eq!(
        (&remarks[0]["severity"], &remarks[0]["key"]),
        (&"warning".into(), &"robots.0.effector".into())
    );
    let told = place.run(&["check", "s.toml"]).out();
    assert!(told.contains("\nwarning: robots.0.effector\n") && told.contains("60 %"), "{told}");
    let run = place.run(&["run", "s.toml", "--cycles", "2"]);
    assert!(run.err().contains("warning: robots.0.effector: "), "{}", run.err());
}

#[test]
fn check_tells_the_memory_of_a_whole_process() {
    let place = TestFolder::new();
    let head = "format = 1\nworld = \"robots\"\n[map.office]\nfloors = 20\ncorridors = 6\n";
    place.write("large.toml", format!("{head}[people]\ncount = 50000\n"));
    let bytes = |file: &str, key: &str| {
        place.json(&["check", file])[key].as_u64().expect("a number of bytes")
    };
    let small = bytes("s.toml", "memory_bytes");
    // The program itself, and 64 bytes or more for each body.
    assert!(small > 2_000_000, "{small}");
    assert!(bytes("large.toml", "memory_bytes") > small + 64 * 50_000);
    assert!(bytes("large.toml", "recorded_memory_bytes") > small + 1000 * 50_000);
}

#[test]
fn map_counts_pixels_and_boxes() {
    let place = TestFolder::new();
    place.write("m.yaml", "image: m.pgm\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n");
    place.write("m.pgm", "P2\n4 2\n255\n0 254 254 254\n254 254 205 254\n");
    let map = place.json(&["map", "m.yaml", "--box", "1.0"]);
    for (key, count) in [("width", 4), ("height", 2), ("free", 6), ("occupied", 1), ("unknown", 1)]
    {
        assert_eq!(map[key], count, "{key}");
    }
    assert_eq!(map["boxes"], serde_json::json!({ "free": 0, "wall": 1, "unknown": 1 }));
    let walls = place.json(&["map", "m.yaml", "--box", "1.0", "--unknown", "wall"]);
    assert_eq!(walls["boxes"]["wall"], 2);
    assert_eq!(walls["report"]["findings"], serde_json::json!([]));
    place.write("m.pgm", "P2\n4 2\n255\n0 254 254 254\n254 254 216 254\n");
    let found = place.json(&["map", "m.yaml"])["report"]["findings"][0].clone();
    assert_eq!((&found["treatment"], &found["count"]), (&"suspicious".into(), &1.into()));
    let told = place.run(&["map", "m.yaml"]).err();
    assert!(told.starts_with("note: suspicious: pixels of the gray 216 are free"), "{told}");
}

#[test]
fn replay_and_resume_speak_json_too() {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--out", "r"]);
    let replay = place.json(&["replay", "r", "--cycle", "42"]);
    assert_keys(&replay, &["cycle", "digest", "compared_poses", "bodies"]);
    assert_keys(&replay["bodies"][0], &["body", "kind", "col_boxes", "row_boxes", "heading"]);
    assert_eq!(replay["bodies"][4]["kind"], "door");
    assert_keys(&replay["bodies"][4], &["open"]);
}

#[test]
fn new_says_which_file_it_wrote() {
    let place = TestFolder::new();
    assert_eq!(place.json(&["new", "robots"])["file"], "robots.toml");
}

#[test]
fn in_json_mode_errors_leave_standard_output_empty() {
    let place = TestFolder::new();
    let ended = place.run(&["run", "missing.toml", "--json"]);
    assert_eq!((ended.code(), ended.out().as_str()), (2, ""));
    assert!(ended.err().starts_with("error: missing.toml"), "{}", ended.err());
}
