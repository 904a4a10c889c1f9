//! Tests of problems: small ones that are written here, and those of the start kit.

use super::*;
use sidestep_testing::shared_data as shared;

const MAP: &str = "type octile\nheight 2\nwidth 5\nmap\n..E@.\n..S@.\n";
const AGENTS: &str = "# version for LoRR 2026\n2\n0\n6\n";
const TASKS: &str = "# version for LoRR 2026\n2\n0,7\n1,5,2\n";
const PROBLEM: &str = r#"{
    "mapFile": "maps/m.map",
    "agentFile": "agents/m.agents",
    "teamSize": 2,
    "taskFile": "tasks/m.tasks",
    "numTasksReveal": 1.5,
    "version": "2026 LoRR",
    "agentCounter": 3,
    "agentSize": 1.0,
    "delayConfig": {
        "seed": 7, "minDelay": 2, "maxDelay": 8, "eventModel": "poisson", "pDelay": 0.003,
        "durationModel": "gaussian", "gaussMeanRatio": 0.5, "gaussStdRatio": 0.22
    }
}"#;

/// Loads a problem with these texts.
fn loaded(problem: &str, agents: &str, tasks: &str) -> Result<Problem, InputError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let files = [
        ("p.json", problem),
        ("maps/m.map", MAP),
        ("agents/m.agents", agents),
        ("tasks/m.tasks", tasks),
    ];
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        std::fs::write(path, text).expect("written");
    }
    load(&folder.path().join("p.json"))
}

#[test]
fn a_problem_has_its_places_counted_from_the_south_and_its_delays() {
    let problem = loaded(PROBLEM, AGENTS, TASKS).expect("a problem");
    assert_eq!(problem.starts, [(0, 1), (1, 0)]);
    assert_eq!(problem.tasks, [vec![(0, 1), (2, 0)], vec![(1, 1), (0, 0), (2, 1)]]);
    assert_eq!((problem.settings.team_size, problem.settings.ticks_per_action), (2, 3));
    let duration = DurationModel::Gaussian { mean_ratio: 0.5, deviation_ratio: 0.22 };
    let expected = Delays {
        seed: 7,
        chance: 0.003,
        events: EventModel::Poisson,
        duration,
        min_ticks: 2,
        max_ticks: 8,
    };
    assert_eq!(problem.settings.delays, expected);
    let kept: Vec<u64> = problem.report.kept.iter().map(|item| item.count).collect();
    assert_eq!(kept, [8, 2, 2, 5]);
}

#[test]
fn what_a_file_does_not_say_is_guessed_and_what_nobody_reads_is_said() {
    let short = r#"{"mapFile": "maps/m.map", "agentFile": "agents/m.agents", "teamSize": 1,
        "taskFile": "tasks/m.tasks", "color": 3}"#;
    let problem = loaded(short, AGENTS, TASKS).expect("a problem");
    assert_eq!((problem.starts.len(), problem.settings.delays.chance), (1, 0.0));
    let said: Vec<String> = problem.report.findings.iter().map(ToString::to_string).collect();
    for words in [
        "the key `color`",
        "starts beyond teamSize (1)",
        "agentCounter is 1",
        "no robot is delayed",
    ] {
        assert!(said.iter().any(|line| line.contains(words)), "{words}: {said:?}");
    }
}

/// The error of a problem where some text is another, with its line and column.
fn error_of(from: &str, to: &str) -> (InputError, (usize, usize)) {
    assert!(PROBLEM.contains(from), "{from}");
    let error = loaded(&PROBLEM.replace(from, to), AGENTS, TASKS).expect_err(to);
    let position = error.line_and_column().expect("a position");
    (error, position)
}

#[test]
fn errors_of_the_problem_point_at_the_key_and_say_what_is_right() {
    let cases = [
        ("0.003", "1.5", (11, 75), "write a number from 0 to 1"),
        ("0.003", "-0.1", (11, 75), "write a number from 0 to 1"),
        ("\"poisson\"", "\"often\"", (11, 50), "write \"bernoulli\" or \"poisson\""),
        ("\"gaussian\"", "\"long\"", (12, 9), "write \"uniform\" or \"gaussian\""),
        ("\"teamSize\": 2", "\"teamSize\": 3", (4, 5), "set teamSize to 2 or less"),
        ("\"teamSize\": 2", "\"teamSize\": -2", (4, 5), "write a whole number from 1 to 1048576"),
        ("\"minDelay\": 2", "\"minDelay\": 9", (11, 20), "set minDelay to maxDelay or less"),
        (
            "maps/m.map",
            "maps/n.map",
            (2, 5),
            "name a file in the folder of the problem or in one beside it",
        ),
        ("2026 LoRR", "2023 LoRR", (7, 5), "give a problem of \"2026 LoRR\""),
        ("\"taskFile\"", "\"tasks\"", (1, 1), "write \"taskFile\": with a text behind it"),
        (
            "\"agentCounter\": 3",
            "\"agentCounter\": \"3\"",
            (8, 5),
            "write a whole number from 1 to 1048576",
        ),
    ];
    for (from, to, position, remedy) in cases {
        let (error, found) = error_of(from, to);
        assert_eq!((found, error.remedy()), (position, remedy), "{to}: {error}");
    }
}

#[test]
fn a_problem_that_is_cut_off_anywhere_is_an_error_at_its_end() {
    for end in 0..PROBLEM.len() {
        let error = parse_settings("p", &PROBLEM[..end]).expect_err("cut off");
        assert!(error.remedy().contains("cut off") && error.line_and_column().is_some(), "{error}");
    }
}

#[test]
fn errors_of_the_lists_point_at_the_location() {
    let cases = [
        ("2\n0\n10\n", TASKS, (3, 1), "is no location"),
        ("2\n0\n3\n", TASKS, (3, 1), "is a wall"),
        ("2\n0\n-1\n", TASKS, (3, 1), "is no location"),
        ("2\n0\n0\n", TASKS, (3, 1), "a second robot"),
        ("3\n0\n1\n", TASKS, (4, 1), "ends after 2 of 3 items"),
        ("1\n0\n1\n", TASKS, (3, 1), "has 2 items, not 1"),
        (AGENTS, "1\n0,4\n", (2, 3), "no robot can come to 4"),
        (AGENTS, "1\n0,,4\n", (2, 3), "is no location"),
        ("2\n0\n4\n", "1\n0,4\n", (2, 3), "no path to 4"),
        (AGENTS, "", (1, 1), "is empty"),
        (AGENTS, "x\n", (1, 1), "is no number of items"),
    ];
    for (agents, tasks, position, cause) in cases {
        let error = loaded(PROBLEM, agents, tasks).expect_err(cause);
        assert!(error.cause().contains(cause), "{cause}: {error}");
        assert_eq!(error.line_and_column(), Some(position), "{error}");
    }
}

#[test]
fn the_problems_of_the_start_kit_are_read() {
    let problems = [
        ("maze.domain/maze-example_40.json", 40, 160),
        ("room.domain/room-example_150.json", 150, 1375),
        ("random.domain/random-example_400.json", 400, 3200),
        ("warehouse.domain/fulfill-example_2500.json", 2500, 22500),
        ("city.domain/bos-example_600.json", 600, 3600),
        ("iron_harvest.domain/iron-example_10000.json", 10000, 25000),
    ];
    for (name, robots, tasks) in problems {
        let Some(path) = shared(&format!("lorr/{name}")) else { return };
        let problem = load(&path).expect(name);
        assert_eq!((problem.starts.len(), problem.tasks.len()), (robots, tasks), "{name}");
        assert_eq!(problem.settings.ticks_per_action, 3, "{name}");
    }
}
