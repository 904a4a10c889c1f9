//! Problems of the League of Robot Runners are run, checked, compared and recorded as scenarios are; what is wrong in one is
//! told with its place and a remedy, and nothing is written.

use crate::support::TestFolder;

const MAP: &str = "type octile\nheight 4\nwidth 8\nmap\n........\n.@@.@@..\n....@...\n.T....@@\n";
const PROBLEM: &str = r#"{
    "mapFile": "maps/m.map",
    "agentFile": "agents/m.agents",
    "teamSize": 3,
    "taskFile": "tasks/m.tasks",
    "numTasksReveal": 1.5,
    "version": "2026 LoRR",
    "agentCounter": 3,
    "agentSize": 1.0,
    "delayConfig": {
        "seed": 4, "minDelay": 1, "maxDelay": 6, "eventModel": "poisson", "pDelay": 0.02,
        "durationModel": "gaussian", "gaussMeanRatio": 0.5, "gaussStdRatio": 0.22
    }
}
"#;
const AGENTS: &str = "# version for LoRR 2026\n3\n0\n7\n24\n";
const TASKS: &str = "# version for LoRR 2026\n3\n16,3\n23,0,5\n28\n";

/// A folder with a problem of these lists.
fn problem_folder(agents: &str, tasks: &str) -> TestFolder {
    let place = TestFolder::new();
    for folder in ["maps", "agents", "tasks"] {
        std::fs::create_dir(place.path(folder)).expect("made");
    }
    place.write("p.json", PROBLEM);
    place.write("maps/m.map", MAP);
    place.write("agents/m.agents", agents);
    place.write("tasks/m.tasks", tasks);
    place
}

#[test]
fn a_problem_is_run_checked_recorded_and_verified() {
    let place = problem_folder(AGENTS, TASKS);
    let checked = place.run(&["check", "p.json"]);
    assert_eq!(checked.code(), 0, "{}", checked.err());
    assert!(checked.out().contains("3 robot"), "{}", checked.out());
    let text = place.run(&["run", "p.json", "--cycles", "600"]);
    assert_eq!(text.code(), 0, "{}", text.err());
    assert!(text.out().contains("tasks finished"), "{}", text.out());
    assert!(text.out().contains("guessed"), "{}", text.out());
    let json = place.json(&["run", "p.json", "--cycles", "600", "--out", "r"]);
    let finished = json["metrics"]["tasks_finished"].as_u64();
    assert!(finished.is_some_and(|tasks| tasks > 20), "{json}");
    assert_eq!(json["metrics"]["contacts"], 0, "{json}");
    let again = place.json(&["run", "p.json", "--cycles", "600", "--workers", "2"]);
    assert_eq!(again["digest"], json["digest"]);
    let other = place.json(&["run", "p.json", "--cycles", "600", "--seed", "5"]);
    assert_ne!(other["digest"], json["digest"]);
    assert_eq!(place.run(&["verify", "r"]).code(), 0);
}

#[test]
fn keys_of_a_problem_are_set_as_those_of_a_scenario() {
    let place = problem_folder(AGENTS, TASKS);
    let run = |set: &str| place.json(&["run", "p.json", "--cycles", "600", "--set", set]);
    let reliable = run("regime=reliable");
    assert_eq!(reliable["metrics"]["delayed_cycles"], 0, "{reliable}");
    let fifo = run("robots.tasks.policy=fifo");
    assert_ne!(fifo["digest"], run("robots.tasks.policy=optimal")["digest"]);
    let wrong = place.run(&["run", "p.json", "--set", "robots.tasks.policy=best"]);
    assert_eq!(wrong.code(), 2);
    assert!(wrong.err().contains("nearest"), "{}", wrong.err());
}

#[track_caller]
fn assert_refused(place: &TestFolder, file: &str, at: &str, cause: &str, remedy: &str) {
    let before = place.names();
    let output = place.run(&["run", file, "--out", "out"]);
    assert_eq!(output.code(), 2, "{}{}", output.out(), output.err());
    let error = output.err();
    assert!(error.contains(at) && error.contains(cause) && error.contains(remedy), "{error}");
    assert_eq!(place.names(), before, "nothing is written");
}

#[test]
fn what_is_wrong_in_a_problem_is_told_with_its_place_and_a_remedy() {
    let wall = problem_folder(AGENTS, &TASKS.replace("16,3", "16,9"));
    assert_refused(&wall, "p.json", "m.tasks:3:4", "location 9", "give a free box");
    let many = problem_folder(AGENTS, TASKS);
    many.write("p.json", PROBLEM.replace("\"teamSize\": 3", "\"teamSize\": 40"));
    assert_refused(&many, "p.json", "p.json:4:", "40", "set teamSize to 3 or less");
    let taken = problem_folder(&AGENTS.replace("\n7\n", "\n0\n"), TASKS);
    assert_refused(&taken, "p.json", "m.agents:4:1", "a second robot", "a start of its own");
    let outside = problem_folder(&AGENTS.replace("\n7\n", "\n32\n"), TASKS);
    assert_refused(&outside, "p.json", "m.agents:4:1", "`32` is no location", "0 to 31");
    let unreachable = problem_folder(AGENTS, TASKS);
    unreachable
        .write("maps/m.map", MAP.replace(".T....@@", ".T....@.").replace("....@...", "....@..@"));
    unreachable.write("tasks/m.tasks", TASKS.replace("23", "22").replace("28", "31"));
    assert_refused(
        &unreachable,
        "p.json",
        "m.tasks:5:1",
        "no robot can come to 31",
        "free boxes connect",
    );
    let cut = problem_folder(AGENTS, TASKS);
    for bytes in [40, 200, PROBLEM.len() - 3] {
        cut.write("p.json", &PROBLEM[..bytes]);
        assert_refused(&cut, "p.json", "p.json:", "is not JSON", "it is cut off here");
    }
    let list = problem_folder(AGENTS, &TASKS[..TASKS.len() - 3]);
    assert_refused(
        &list,
        "p.json",
        "m.tasks:",
        "the list ends after 2 of 3 items",
        "copy the whole file",
    );
}
