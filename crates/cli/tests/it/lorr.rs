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

/// A pose as the League has it: row from the north, column, and heading, clockwise from east.
type LeaguePose = [i64; 3];

/// Returns the ticks of a path, each a letter, after a check of what its segments say of where the robot is.
fn path_letters(path: &str, ticks: usize) -> Vec<char> {
    let mut letters = Vec::new();
    for segment in path.split_terminator(")]") {
        let (head, actions) = segment.split_once("):(").expect("a head");
        let (tick, _) = head.trim_start_matches("[(").split_once(',').expect("a tick");
        assert_eq!(tick.parse(), Ok(letters.len()), "{path}");
        for action in actions.split(',') {
            let (letter, count) = action.split_once(' ').expect("a letter and a number");
            let letter = letter.chars().next().expect("a letter");
            letters.extend(std::iter::repeat_n(letter, count.parse().expect("a number")));
        }
    }
    assert_eq!(letters.len(), ticks);
    letters
}

/// Returns the pose in which a robot begins each tick, or to which its action leads it: as a run records them.
fn followed(
    start: &serde_json::Value,
    letters: &[char],
    ticks_per_action: usize,
) -> Vec<LeaguePose> {
    let heading = "ESWN".find(start[2].as_str().expect("a heading")).expect("one of four");
    let number = |at: usize| start[at].as_i64().expect("a number");
    let mut pose = [number(0), number(1), heading as i64];
    let mut done = 0;
    let mut poses = Vec::new();
    let mut letter_before = 'W';
    for &letter in letters {
        let is_in_action = done > 0;
        let shown = if is_in_action { after(pose, letter_before) } else { pose };
        poses.push(shown);
        if letter == 'W' {
            continue;
        }
        assert!(!is_in_action || letter == letter_before, "an action is carried to its end");
        letter_before = letter;
        done += 1;
        if done == ticks_per_action {
            pose = after(pose, letter);
            done = 0;
        }
    }
    poses
}

fn after([row, col, heading]: LeaguePose, letter: char) -> LeaguePose {
    let [south, east] = [[0, 1], [1, 0], [0, -1], [-1, 0]][heading as usize];
    match letter {
        'F' => [row + south, col + east, heading],
        'R' => [row, col, (heading + 1) % 4],
        'C' => [row, col, (heading + 3) % 4],
        _ => panic!("{letter} is no action of the League"),
    }
}

#[test]
fn an_exported_run_follows_the_leagues_actions_to_the_recorded_poses() {
    const TICKS: usize = 1203;
    let place = problem_folder(AGENTS, TASKS);
    let run = place.json(&["run", "p.json", "--cycles", &TICKS.to_string(), "--out", "r"]);
    let written = place.json(&["export", "r", "--to", "lorr"]);
    assert_eq!(written["digest_confirmed"], true, "{written}");
    assert_eq!(place.read("r-lorr/map.map"), MAP.replace('T', "@"));
    let output: serde_json::Value =
        serde_json::from_str(&place.read("r-lorr/output.json")).expect("JSON");
    assert_eq!(output["version"], "2026 LoRR");
    assert_eq!([&output["teamSize"], &output["makespan"]], [3, TICKS]);
    assert_eq!(output["agentMaxCounter"], 3);
    place.run(&["export", "r", "--to", "csv", "--table", "trajectories", "--out", "t.csv"]);
    let table = place.read("t.csv");
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|row| row.split(',').collect()).collect();
    let mut moves = 0;
    for robot in 0..3 {
        let path = output["actualPaths"][robot].as_str().expect("text");
        let letters = path_letters(path, TICKS);
        moves += letters.iter().filter(|letter| **letter == 'F').count();
        let poses = followed(&output["start"][robot], &letters, 3);
        let name = robot.to_string();
        let recorded = rows.iter().filter(|row| row[1] == name).map(|row| -> LeaguePose {
            let number = |at: usize| row[at].parse::<i64>().expect("a number");
            let names = ["east", "south", "west", "north"];
            let heading = names.iter().position(|name| *name == row[4]).expect("a heading");
            [3 - number(3), number(2), heading as i64]
        });
        assert!(recorded.eq(poses.iter().copied().take(TICKS)), "robot {robot}");
        let planned = output["plannerPaths"][robot].as_str().expect("text");
        path_letters(planned, TICKS);
    }
    assert!(moves > 300, "{moves}");
    assert_tasks_are_told(&output, &run);
}

/// The events of an exported file end as many tasks as the run has finished, and each errand is where its robot is.
fn assert_tasks_are_told(output: &serde_json::Value, run: &serde_json::Value) {
    let finished = run["metrics"]["tasks_finished"].as_u64().expect("a number");
    assert!(finished > 20, "{finished}");
    assert_eq!(output["numTaskFinished"], finished);
    let list = |key: &str| output[key].as_array().expect("a list").clone();
    let tasks = list("tasks");
    let mut ended = 0;
    for event in list("events") {
        let number = |at: usize| event[at].as_u64().expect("a number") as usize;
        let [tick, robot, task, errands] = [0, 1, 2, 3].map(number);
        let path = output["actualPaths"][robot].as_str().expect("text");
        let letters = path_letters(path, output["makespan"].as_u64().expect("a number") as usize);
        let at = followed(&output["start"][robot], &letters, 3)[tick];
        let places = tasks[task][2].as_array().expect("a list");
        let place = &places[2 * errands - 2..2 * errands];
        assert_eq!([&place[0], &place[1]], [at[0], at[1]], "{event}");
        assert!(tasks[task][1].as_u64() < Some(tick as u64), "{event}");
        ended += u64::from(2 * errands == places.len());
    }
    assert_eq!(ended, finished);
    let delayed: u64 = list("delayIntervals")
        .iter()
        .flat_map(|robot| robot.as_array().expect("a list").clone())
        .map(|span| span[1].as_u64().expect("a tick") - span[0].as_u64().expect("a tick"))
        .sum();
    assert!(delayed > 0);
    assert_eq!(run["metrics"]["delayed_cycles"], delayed);
}

#[test]
fn robots_that_the_league_does_not_know_are_refused_by_name() {
    let place = TestFolder::new();
    let text = "format = 1\nworld = \"robots\"\ncycles = 40\n[map]\nascii = \"........\\n........\"\n\
                [robots]\nat = [[2, 0, 0]]\n";
    place.write("one.toml", text);
    place.json(&["run", "one.toml", "--out", "one"]);
    place.json(&["export", "one", "--to", "lorr", "--until", "20"]);
    let output: serde_json::Value =
        serde_json::from_str(&place.read("one-lorr/output.json")).expect("JSON");
    assert_eq!(output["makespan"], 20);
    assert_eq!(output["tasks"], serde_json::json!([[0, 0, [1, 2]]]), "the viewer needs one");
    assert_eq!(output["actualSchedule"], serde_json::json!(["0:-1"]));
    place.write("two.toml", text.replace("\nat =", "\nsize = 2\nat ="));
    place.json(&["run", "two.toml", "--out", "two"]);
    let refused = place.run(&["export", "two", "--to", "lorr"]);
    assert_eq!(refused.code(), 2, "{}", refused.err());
    assert!(refused.err().contains("robot 0 fills 2 x 2 boxes"), "{}", refused.err());
    let from = place.run(&["export", "one", "--to", "lorr", "--from", "3"]);
    assert!(from.err().contains("--from: means nothing for --to lorr"), "{}", from.err());
    assert!(!place.names().iter().any(|name| name == "two-lorr"), "nothing is written");
}
