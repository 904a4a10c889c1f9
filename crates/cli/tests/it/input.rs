//! E1: wrong input is one error with file, line, column, cause and remedy; exit code 2,
//! nothing written.

use crate::support::{SCENARIO, TestFolder};

/// Runs the command, checks that the input is refused and that nothing was written, and returns the
/// error.
fn refused(place: &TestFolder, file: &str, more: &[&str]) -> String {
    let before = place.names();
    let ended = place.run(&[&["run", file, "--out", "out"], more].concat());
    let err = ended.err();
    assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{err}");
    assert!(err.starts_with("error: ") && err.contains("\n  help: "), "{err}");
    assert_eq!(err.matches("error: ").count(), 1, "{err}");
    assert_eq!(place.names(), before, "something was written");
    err
}

/// Cases: if `find` is replaced in [`SCENARIO`], the input must be refused with these words.
const TABLE: [(&str, &str, &str, &[&str]); 17] = [
    ("unknown key", "cycles = 3000", "cylces = 3000", &["did you mean `cycles`?"]),
    ("unknown key inside", "count = 1\nsensors", "cuont = 1\nsensors", &["did you mean `count`?"]),
    ("no TOML", "[map]", "[map", &["s.toml:7:"]),
    ("wrong type", "seed = 5", "seed = \"five\"", &["invalid type"]),
    ("another format", "format = 1", "format = 7", &["format 7", "format = 1"]),
    ("unknown world", "world = \"robots\"", "world = \"robot\"", &["did you mean `robots`?"]),
    ("unknown sensor", "sonar-8", "sonar-9", &["did you mean `sonar-8`?"]),
    (
        "unknown effector",
        "effector = \"nomad\"\n\n",
        "effector = \"nomed\"\n\n",
        &["did you mean `nomad`?"],
    ),
    (
        "body in the wall",
        "count = 1\nsensors",
        "at = [[0, 0]]\nsensors",
        &["in the wall at [0, 0]"],
    ),
    (
        "bodies on each other",
        "count = 1\nsensors",
        "at = [[5, 5], [5, 5]]\nsensors",
        &["stands on body"],
    ),
    ("outside the map", "count = 1\nsensors", "at = [[500, 5]]\nsensors", &["leaves the map"]),
    ("too many bodies", "count = 1\nsensors", "count = 4000\nsensors", &["no free place"]),
    ("absurdly many bodies", "count = 1\nsensors", "count = 4000000000\nsensors", &["at most"]),
    ("absurd body", "size = 2", "size = 60000", &["size = 60000", "give 1 to 64"]),
    ("absurd region", "a = [1, 3, 2, 2]", "a = [1, 3, 4000000000, 2]", &["leaves the map"]),
    (
        "map without free boxes",
        "\n#..........#...........#",
        "\n########################",
        &["no free box"],
    ),
    (
        "ragged map",
        "#......................#\n#..........#",
        "#.....#\n#..........#",
        &["map.ascii"],
    ),
];

#[test]
fn a_wrong_scenario_is_refused_where_it_is_wrong() {
    for (name, find, replace, said) in TABLE {
        let place = TestFolder::new();
        assert!(SCENARIO.contains(find), "{name}");
        let mut text = SCENARIO.replacen(find, replace, 1);
        if name == "map without free boxes" {
            text = SCENARIO.replace('.', "#").replace("0#25", "0.25").replace("0#0", "0.0");
        }
        place.write("s.toml", text);
        let err = refused(&place, "s.toml", &[]);
        assert!(said.iter().all(|words| err.contains(words)), "{name}: {err}");
        assert!(has_position(&err, "s.toml") || err.contains("map.ascii"), "{name}: {err}");
    }
}

/// Returns whether a text starts with `file:LINE:COLUMN: `.
fn has_position(err: &str, file: &str) -> bool {
    let Some((_, rest)) = err.split_once(&format!("{file}:")) else { return false };
    let mut parts = rest.splitn(3, ':');
    (0..2).all(|_| parts.next().is_some_and(|p| p.parse::<u32>().is_ok_and(|n| n > 0)))
}

#[test]
fn a_row_that_does_not_sum_to_one_says_by_how_much() {
    let place = TestFolder::new();
    let sensor = "\n[sensors.mine]\nbearings_deg = [0]\nrange_m = 2.0\nobservations = [\"nothing\", \"something\"]\ndesignates = { wall = \"something\", door = \"something\", person = \"something\", robot = \"something\" }\n[sensors.mine.confusion]\nnothing = [0.9, 0.2]\nsomething = [0.0, 1.0]\n";
    place.write("s.toml", SCENARIO.replace("bumper-4", "mine") + sensor);
    let err = refused(&place, "s.toml", &[]);
    assert!(err.contains("row `nothing`") && err.contains("1.1") && err.contains("0.1"), "{err}");
    assert!(has_position(&err, "s.toml"), "{err}");
}

#[test]
fn an_error_stands_where_it_stands_in_the_file_whatever_is_set() {
    let place = TestFolder::new();
    place.write("s.toml", SCENARIO.replace("seed = 5\n", "").replace("sonar-8", "sonar-9"));
    let plain = refused(&place, "s.toml", &[]);
    assert_eq!(refused(&place, "s.toml", &["--seed", "7"]), plain);
    assert_eq!(refused(&place, "s.toml", &["--set", "robots.1.count=2"]), plain);
}

#[test]
fn check_tells_all_errors_and_their_number() {
    let place = TestFolder::new();
    let wrong = SCENARIO.replace("seed = 5", "seed = \"five\"").replace("sonar-8", "sonar-9");
    place.write("s.toml", wrong.replace("cycles = 3000", "cylces = 3000"));
    let ended = place.run(&["check", "s.toml"]);
    let err = ended.err();
    assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{err}");
    for words in ["did you mean `cycles`?", "invalid type", "did you mean `sonar-8`?"] {
        assert_eq!(err.matches(words).count(), 1, "{err}");
    }
    assert!(err.ends_with("error: s.toml: 3 errors\n"), "{err}");
    assert_eq!(refused(&place, "s.toml", &[]).matches("error: ").count(), 1);
}

/// The sensor is there, so that nothing else is wrong with a robot that has it.
#[test]
fn a_mistake_in_a_sensor_is_one_error_and_the_sensor_stays_known() {
    for (sensor, said) in [
        ("[sensors]\n\"my eye\" = 3\n", "invalid type: integer `3`"),
        ("[[sensors.\"my eye\"]]\nrange_m = 3\n", "invalid type: map"),
        (
            "[sensors.\"my eye\"]\nrange_m = 3\nbearings_deg = [0]\nobservations = []\nconfusion = 3\n",
            "invalid type: integer `3`",
        ),
        (
            "[sensors.\"my eye\"]\nrange_m = 3\nbearings_deg = [0]\nobservations = [\"nothing\"]\n",
            "the sensor has no `confusion`",
        ),
    ] {
        let place = TestFolder::new();
        place.write("s.toml", SCENARIO.replace("bumper-4", "my eye") + sensor);
        let ended = place.run(&["check", "s.toml"]);
        assert_eq!(ended.code(), 2);
        assert!(ended.err().contains(said), "{sensor}: {}", ended.err());
        assert!(!ended.err().contains("unknown sensor"), "{sensor}: {}", ended.err());
    }
}

/// Names that a profile may have are not unknown where the profile cannot be read.
#[test]
fn a_mistake_in_a_profile_is_one_error_and_its_names_stay_known() {
    let profiles = [None, Some("[sensors.\"my eye\"]\nrange_m = \"x\"\n"), Some("format = ")];
    for text in profiles {
        let place = TestFolder::new();
        if let Some(text) = text {
            place.write("p.toml", text);
        }
        let scenario = SCENARIO.replace("bumper-4", "my eye");
        place.write("s.toml", format!("profiles = [\"p.toml\"]\n{scenario}"));
        let ended = place.run(&["check", "s.toml"]);
        assert_eq!(ended.code(), 2);
        assert!(ended.err().contains("p.toml"), "{text:?}: {}", ended.err());
        assert!(!ended.err().contains("unknown sensor"), "{text:?}: {}", ended.err());
    }
}

#[test]
fn a_wrong_override_is_named() {
    let place = TestFolder::new();
    for wrong in ["seed", "seed.x=1", "robots.9.count=1", "nothing.at.all=1"] {
        let err = refused(&place, "s.toml", &["--set", wrong]);
        let key = wrong.split(['.', '=']).next().unwrap_or(wrong);
        assert!(err.contains(key), "{wrong}: {err}");
    }
}

#[test]
fn a_missing_file_is_named() {
    let place = TestFolder::new();
    assert!(refused(&place, "missing.toml", &[]).contains("missing.toml"));
    place.write("m.toml", with_map("nowhere.yaml"));
    assert!(refused(&place, "m.toml", &[]).contains("nowhere.yaml"));
    assert!(refused(&place, ".", &[]).contains("error: ."));
}

fn with_map(file: &str) -> String {
    format!(
        "format = 1\nworld = \"robots\"\n[map]\nfile = \"{file}\"\nbox_size_m = 0.5\n[robots]\ncount = 1\n"
    )
}

const YAML: &str = "image: m.pgm\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
const PGM: &str = "P2\n3 2\n255\n254 254 254\n254 254 254\n";

#[test]
fn a_damaged_map_is_refused_by_run_and_by_map() {
    let cases = [
        ("truncated image", YAML.to_string(), "P2\n3 2\n255\n254 254\n".to_string(), "m.pgm"),
        ("a turn of many turns", YAML.replace("0, 0, 0", "0, 0, 70"), PGM.into(), "m.yaml:3:"),
        ("a resolution of 0", YAML.replace("0.5", "0.0"), PGM.into(), "m.yaml:2:"),
        ("absurd image", YAML.into(), PGM.replace("3 2", "4000000000 4000000000"), "m.pgm"),
        ("absurd boxes", YAML.replace("0.5", "1e9"), PGM.into(), "boxes"),
        ("no image", YAML.replace("m.pgm", "gone.pgm"), PGM.into(), "gone.pgm"),
    ];
    for (name, yaml, pgm, said) in cases {
        let place = TestFolder::new();
        place.write("m.yaml", yaml);
        place.write("m.pgm", pgm);
        place.write("m.toml", with_map("m.yaml"));
        let err = refused(&place, "m.toml", &[]);
        assert!(err.contains(said), "{name}: {err}");
        let shown = place.run(&["map", "m.yaml", "--box", "0.5", "--png", "m.png"]);
        assert_eq!((shown.code(), shown.out().as_str()), (2, ""), "{name}");
        assert!(shown.err().contains(said), "{name}: {}", shown.err());
        assert!(!place.path("m.png").exists());
    }
}

#[test]
fn bytes_that_are_no_text_are_refused() {
    let place = TestFolder::new();
    place.write("b.toml", [0xff, 0xfe, 0x00, 0x80]);
    assert!(refused(&place, "b.toml", &[]).contains("b.toml"));
    place.write("e.toml", "");
    assert!(refused(&place, "e.toml", &[]).contains("format"));
}

#[test]
fn a_folder_that_cannot_be_made_is_an_error_of_the_option() {
    let place = TestFolder::new();
    place.write("file", "");
    let ended = place.run(&["run", "s.toml", "--out", "file/r"]);
    assert_eq!(ended.code(), 2, "{}", ended.err());
    assert!(ended.err().contains("file/r"), "{}", ended.err());
}
