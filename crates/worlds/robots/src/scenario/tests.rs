//! Scenarios that are refused, and the words for their authors.

use super::*;
use sidestep_kernel::{InputError, Simulation as _};
use sidestep_scenario::{CompiledScenario as _, Remark, Severity, Source};
use std::path::Path;

const MAP: &str = "[map]\nascii = \".....\\n.....\\n.....\\n\"\nbox_size_m = 0.5\n";

/// Returns a scenario with keys of its own at the top and sections at the end.
fn text(keys: &str, sections: &str) -> String {
    let map = if sections.contains("[map") { "" } else { MAP };
    format!("format = 1\nworld = \"robots\"\n{keys}\n{map}{sections}")
}

fn compiled(text: &str, folder: &Path) -> Result<Compiled, InputError> {
    Compiled::new(&Source::new("s.toml", text, folder), &Behaviours::new(), StorageOrder::Spatial)
}

/// Asserts that a scenario is refused at the last place where `at` stands, with these words.
fn assert_refused(text: &str, at: &str, words: &str) {
    let error = compiled(text, Path::new("")).expect_err(text);
    let told = format!("{}; {}", error.cause(), error.remedy());
    assert!(told.contains(words), "{text}\n{told}");
    let offset = text.rfind(at).expect(at);
    let wanted = InputError::new("", "", "").with_byte_offset(text, offset);
    assert_eq!(error.line_and_column(), wanted.line_and_column(), "{text}\n{error}");
}

fn remarks(text: &str, folder: &Path) -> Vec<Remark> {
    compiled(text, folder).unwrap_or_else(|e| panic!("{text}\n{e}")).remarks()
}

/// A sensor that sees the observations of a list, without errors.
fn sensor(observations: &[&str], more: &str) -> String {
    let list = format!("{observations:?}");
    let row = |k: usize| {
        let entries: Vec<&str> =
            (0..observations.len()).map(|c| if c == k { "1.0" } else { "0.0" }).collect();
        format!("{} = [{}]\n", observations[k], entries.join(", "))
    };
    let rows: String = (0..observations.len()).map(row).collect();
    format!(
        "[sensors.eye]\nbearings_deg = [0]\nrange_m = 2.0\nobservations = {list}\n{more}\
         [sensors.eye.confusion]\n{rows}"
    )
}

const ROBOT: &str = "[robots]\ncount = 1\nsensors = [\"eye\"]\n";

#[test]
fn every_kind_that_a_sensor_meets_is_known_to_it_or_declared_unseen() {
    let people = format!("{ROBOT}[people]\ncount = 1\n");
    let doors = format!("{ROBOT}[doors]\nat = [[1, 1]]\nperiodic = {{ open = 1, closed = 1 }}\n");
    let carts = ROBOT.replace("[robots]", "[kinds.cart]\n[[robots]]\nkind = \"cart\"");
    for (kind, bodies) in [("person", &people), ("door", &doors), ("cart", &carts)] {
        let known = ["nothing", "wall", "robot", "person", "door", "cart"];
        let others: Vec<&str> = known.into_iter().filter(|name| *name != kind).collect();
        let without = text("", &(bodies.clone() + &sensor(&others, "")));
        assert_refused(&without, "[\"nothing\"", &format!("for the kind `{kind}`"));
        let unseen = format!("designates = {{ {kind} = \"nothing\" }}\n");
        for declared in [sensor(&known, ""), sensor(&others, &unseen)] {
            assert!(compiled(&text("", &(bodies.clone() + &declared)), Path::new("")).is_ok());
        }
    }
}

#[test]
fn a_misspelled_observation_is_told_with_the_nearest_where_it_stands() {
    let known = ["nothing", "wall", "robot", "person"];
    let people = format!("{ROBOT}[people]\ncount = 1\n");
    let kinds = "[kinds.person]\nobservation = \"persn\"\n";
    let mapped = text("", &(kinds.to_string() + &people + &sensor(&known, "")));
    assert_refused(&mapped, "\"persn\"", "did you mean `person`?");
    let own = sensor(&known, "designates = { person = \"persn\" }\n");
    assert_refused(&text("", &(people.clone() + &own)), "\"persn\"", "did you mean `person`?");
    let list = sensor(&["nothing", "wall", "robot", "persn"], "");
    assert_refused(&text("", &(people + &list)), "[\"nothing\"", "did you mean `persn`?");
    // Presets cannot be changed, so the scenario's own kind is pointed at.
    let preset = "[kinds.cart]\n[robots]\nkind = \"cart\"\ncount = 1\nsensors = [\"camera\"]\n";
    assert_refused(&text("", preset), "cart]", "[kinds.cart]");
    let nobody = "[kinds.persn]\nobservation = \"robot\"\n[robots]\ncount = 1\n";
    assert_refused(&text("", nobody), "\"robot\"", "did you mean `person`?");
}

#[test]
fn kinds_that_do_not_occur_need_not_be_known() {
    let sees_walls = sensor(&["nothing", "wall", "robot"], "");
    let nobody = format!("{ROBOT}[people]\ncount = 0\n");
    assert!(compiled(&text("", &(nobody + &sees_walls)), Path::new("")).is_ok());
}

#[test]
fn keys_that_do_nothing_are_refused_with_the_reason() {
    let robots = |more: &str| text("", &format!("[[robots]]\ncount = 1\n[[robots]]\n{more}\n"));
    let behaviour = |more: &str| robots(&format!("count = 1\nbehaviour = {{ {more} }}"));
    let office = "[map]\noffice = {}\n";
    let no_office = "office = true\nat = [[1, 1]]\nrandom = { p_open = 0, p_close = 0 }\n";
    for (text, at, words) in [
        (behaviour("kind = \"wander\", goals = [[1, 1]]"), "goals", "a key of `goto`"),
        (behaviour("kind = \"goto\", a = [0, 0, 1, 1], goals = [[1, 1]]"), "a = [", "`shuttle`"),
        (behaviour("kind = \"gotoo\", goals = [[1, 1]]"), "\"gotoo\"", "did you mean `goto`?"),
        (behaviour("kind = \"external\", repeat = true"), "repeat", "does nothing"),
        (behaviour("kind = \"goto\", goals = []"), "goals", "is empty"),
        (behaviour("kind = \"replay\", actions = []"), "actions", "is empty"),
        (behaviour("kind = \"wander\", turn_every = 0"), "turn_every", "give 1 or more"),
        (robots("at = [[1, 1]]\nscen = \"s.scen\""), "at = ", "beside `scen`"),
        (robots("region = [0, 0, 1, 1]\nscen = \"s.scen\""), "region", "beside `scen`"),
        (robots("behaviour = { kind = \"wander\" }\nscen = \"s\""), "behaviour", "beside `scen`"),
        (robots("at = [[1, 1]]\nregion = [0, 0, 2, 2]"), "region", "beside `at`"),
        (robots("count = 1\nperiod = 3\nphase = 3"), "phase", "give 0 to 2"),
        (text("kind_order = [\"robot\"]", "[robots]\ncount = 1\n"), "kind_order", "by_kind"),
        (text("", "[people]\nat = [[1, 1]]\nregion = [0, 0, 2, 2]"), "region", "beside `at`"),
        (
            text("", &format!("{office}unknown = \"free\"\n[robots]\ncount = 1")),
            "unknown",
            "office",
        ),
        (text("", &format!("{office}[doors]\noffice = true\nsize = [1, 1]")), "size", "`office`"),
        (text("", &format!("[doors]\n{no_office}")), "office = true", "without doors of its own"),
    ] {
        assert_refused(&text, at, words);
    }
}

#[test]
fn tables_that_no_robot_uses_are_checked_as_well() {
    let eye = |more: &str| {
        text("", &("[robots]\ncount = 1\n".to_string() + &sensor(&["nothing", "wall"], more)))
    };
    assert!(compiled(&eye(""), Path::new("")).is_ok());
    let edges = "distance_edges_m = [0.5]\n";
    for (more, at) in [
        ("designates = { persn = \"wall\" }\n", "persn"),
        (&*format!("{edges}distance_classes = [\"a\", \"a\"]\n"), "[\"a\""),
        (&*format!("{edges}distance_classes = [\"a\", \"beyond\"]\n"), "[\"a\""),
    ] {
        assert_refused(&eye(more), at, "");
    }
    let wheels = "[robots]\ncount = 1\n[effectors.wheels]\nforward = [{ p = 0.5, path = \"F\" }]\n";
    assert_refused(&text("", wheels), "[{ p", "sum");
    let box_m = "[robots]\ncount = 1\n[effectors.wheels]\nbox_m = 0\nforward = [{ p = 1 }]\n";
    assert_refused(&text("", box_m), "0\nforward", "above 0");
}

#[test]
fn a_list_of_starts_for_another_map_is_refused_with_both_sizes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let list = |size: &str, rest: &str| {
        std::fs::write(
            folder.path().join("a.scen"),
            format!("version 1\n0\tm\t{size}\t{rest}\t1\n"),
        )
        .expect("written");
    };
    let with = |robots: &str| {
        compiled(&text("", &format!("[robots]\nscen = \"a.scen\"\n{robots}")), folder.path())
    };
    list("5\t3", "0\t0\t4\t2");
    assert!(with("").is_ok());
    list("5\t9", "0\t0\t4\t2");
    let error = with("").expect_err("another map");
    assert!(error.cause().contains("5 x 9") && error.cause().contains("5 x 3"), "{error}");
    assert_eq!(error.line_and_column(), Some((2, 1)));
    list("5\t3", "0\t1\t4\t0");
    let error = with("size = 2").expect_err("no room");
    assert!(error.cause().contains("does not fit at (4, 2)"), "{error}");
}

#[test]
fn goals_out_of_reach_are_told_with_their_number() {
    let split = "[map]\nascii = \"..#..\\n..#..\\n\"\n";
    let goals = "behaviour = { kind = \"goto\", goals = [[4, 0], [0, 0], [3, 1]] }";
    let robots =
        format!("{split}[[robots]]\nat = [[4, 1]]\n[[robots]]\nat = [[1, 0], [1, 1]]\n{goals}");
    let told = remarks(&text("", &robots), Path::new(""));
    let [warning] = &told[..] else { panic!("{told:?}") };
    assert_eq!((warning.severity, warning.key.as_str()), (Severity::Warning, "robots.1"));
    assert!(warning.words.starts_with("2 of 2 robots cannot reach a goal, 4 goals"), "{warning:?}");
}

#[test]
fn an_effector_that_was_learned_for_other_boxes_is_refused() {
    let of = |box_m: f64| {
        let learned = "[robots]\ncount = 1\neffector = \"wheels\"\n[effectors.wheels]\n";
        text("", &format!("{learned}box_m = {box_m}\nforward = [{{ p = 1, path = \"F\" }}]\n"))
    };
    assert!(remarks(&of(0.5), Path::new("")).is_empty());
    let error = compiled(&of(0.25), Path::new("")).expect_err("another box");
    assert!(error.line_and_column().is_some(), "{error}");
    assert!(error.cause().contains("boxes of 0.25 m, and those of the map are 0.5 m"), "{error}");
    assert!(error.remedy().contains("--box 0.5"), "{error}");
}

#[test]
fn a_task_that_no_robot_can_come_to_is_a_warning_with_its_errands() {
    let of = |list: &str| {
        let robots = format!(
            "[map]\nascii = \"....#..\"\n[robots]\nat = [[0, 0, 0], [1, 0, 0]]\n\
             planner = {{ method = \"pibt\" }}\ntasks = {{ list = {list} }}\n"
        );
        let text = format!("format = 1\nworld = \"robots\"\n{robots}");
        remarks(&text, Path::new(""))
    };
    let told = of("[[[3, 0]], [[2, 0], [6, 0]], [[5, 0]]]");
    assert_eq!(told[0].severity, Severity::Warning);
    assert_eq!(told[0].key, "robots.0.tasks");
    let words = &told[0].words;
    assert!(words.starts_with("no robot can ever carry out 2 of 3 tasks"), "{words}");
    assert!(words.contains("the errands [[2, 0], [6, 0]]"), "{words}");
    assert!(of("[[[3, 0]], [[2, 0]]]").iter().all(|remark| remark.severity != Severity::Warning));
}

fn first_remark_on_map(folder: &Path, file: &str) -> Remark {
    let map = format!("[map]\nfile = \"{file}\"\nbox_size_m = 0.5\n[robots]\ncount = 1\n");
    remarks(&text("", &map), folder).remove(0)
}

#[test]
fn a_map_file_that_is_probably_meant_otherwise_is_warned_of() {
    let folder = tempfile::tempdir().expect("a folder");
    let yaml = "image: m.pgm\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\n\
                occupied_thresh: 0.65\nfree_thresh: 0.25\n";
    std::fs::write(folder.path().join("m.yaml"), yaml).expect("written");
    std::fs::write(folder.path().join("m.pgm"), "P2 4 1 255 205 0 254 254").expect("written");
    let warehouse = "type octile\nheight 1\nwidth 3\nmap\n.E.\n";
    std::fs::write(folder.path().join("m.map"), warehouse).expect("written");
    let gray = first_remark_on_map(folder.path(), "m.yaml");
    assert_eq!((gray.severity, gray.key.as_str()), (Severity::Warning, "map.file"));
    assert!(gray.words.contains("(25.0 % of all pixels)"), "{gray:?}");
    assert_eq!(first_remark_on_map(folder.path(), "m.map").severity, Severity::Note);
}

#[test]
fn an_author_is_told_what_will_surprise() {
    let surprising = "[[robots]]\ncount = 1\neffector = \"wheels\"\nsensors = [\"eye\"]\n\
        [people]\ncount = 1\n[effectors.wheels]\nbox_m = 0.5\n\
        forward = [{ p = 0.4, path = \"F\" }, { p = 0.6, turn = -90 }]\n";
    let eye = sensor(
        &["nothing", "wall", "robot"],
        "designates = { person = \"nothing\" }\ndistance_edges_m = [0.5, 5.0]\n",
    );
    let told = remarks(&text("", &(surprising.to_string() + &eye)), Path::new(""));
    let keys: Vec<&str> = told.iter().map(|remark| remark.key.as_str()).collect();
    assert_eq!(keys, ["robots.0.effector", "effectors.wheels", "sensors.eye", "sensors.eye"]);
    let parts = [
        "`forward` of `wheels` mostly comes to a turn of -90 degrees (60 %)",
        "its turns never err",
        "does not see person",
        "at the distance class class2",
    ];
    for (remark, words) in told.iter().zip(parts) {
        assert!(remark.words.contains(words), "{remark:?}");
    }
    assert_eq!(remarks(&text("", "[robots]\ncount = 1\n"), Path::new("")), []);
    let radio = remarks(&text("", "[robots]\ncount = 2\n[radio]\nrange_m = 9\n"), Path::new(""));
    assert_eq!(radio.iter().map(|remark| remark.key.as_str()).collect::<Vec<_>>(), ["radio"]);
}

#[test]
fn seeds_decide_where_something_always_draws_and_otherwise_runs_tell() {
    let text = |regime: &str, robots: &str, more: &str| {
        let map = "................\n".repeat(7);
        format!(
            "format = 1\nworld = \"robots\"\nregime = \"{regime}\"\n[map]\nascii = \"\"\"\n{map}\"\"\"\n\
             [[robots]]\n{robots}\n{more}"
        )
    };
    let draws = |text: String| {
        let source = Source::new("s", text, "");
        let compiled = Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial);
        compiled.expect("valid").is_always_random()
    };
    let placed = "at = [[1, 1, 1], [9, 1, 2]]";
    assert!(!draws(text("reliable", placed, "")));
    assert!(draws(text("reliable", "count = 2", "")), "places are drawn");
    assert!(draws(text("reliable", "at = [[1, 1], [9, 1]]", "")), "headings are drawn");
    assert!(draws(text("reliable", placed, "[[people]]\ncount = 1\n")));
    assert!(draws(text("sensors", placed, "")));
}

#[test]
fn another_seed_gives_what_compiling_with_it_would() {
    let text = "format = 1\nworld = \"robots\"\nseed = SEED\n[map]\nascii = \"\"\"\nMAP\"\"\"\n\
                [[robots]]\ncount = 9\nperiod = 3\n[[robots]]\nat = [[1, 1], [3, 1]]\n\
                [[people]]\ncount = 4\n[doors]\nat = [[6, 0]]\nrandom = { p_open = 0.1, p_close = 0.1 }\n";
    let text = text.replace("MAP", &"................\n".repeat(7));
    let compiled = |seed: u64| {
        let source = Source::new("s", text.replace("SEED", &seed.to_string()), "");
        Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial).expect("valid")
    };
    let source = Source::new("s", text.clone(), "");
    let first = compiled(1);
    for seed in [2, 99, u64::MAX >> 1] {
        let (again, anew) = (first.reseeded(seed).expect("there is room"), compiled(seed));
        assert_eq!((again.seed, &again.start), (seed, &anew.start));
        let digest = |compiled: Compiled| {
            let mut run = compiled.start(&source, 1);
            run.advance(50);
            run.digest()
        };
        assert_eq!(digest(again), digest(anew), "seed {seed}");
    }
}
