//! The master control of vehicles: what the command refuses. Its flights with a broker are tests of `sidestep-link`.

use crate::fleet::is_there;
use crate::support::TestFolder;

const HALL: &str = "format = 1\nworld = \"robots\"\ncycles = 30\nconflict_policy = \"simultaneous\"\n\
    [map]\nascii = \"\"\"\n..\n..\n\"\"\"\n[[robots]]\ncount = 4\n\
    behaviour = { kind = \"shuttle\", a = [0, 0, 1, 2], b = [1, 0, 1, 2] }\n";

/// A plan in which four go around in a ring.
const RING: &str = "0 0 0 F\n1 0 1 F\n1 1 2 F\n0 1 3 F\n";

const BROKER: [&str; 2] = ["--vda5050", "mqtt://127.0.0.1:1"];

fn refusal(text: &str, more: &[&str]) -> String {
    let place = TestFolder::new();
    place.write("hall.toml", text);
    place.write("ring.plan", RING);
    let args = [&["dispatch", "hall.toml"][..], &BROKER, more].concat();
    let ended = place.run(&args);
    assert_eq!(ended.code(), 2, "{}", ended.err());
    ended.err()
}

#[test]
fn levels_of_topics_and_times_are_checked_on_the_command_line() {
    let place = TestFolder::new();
    place.write("hall.toml", HALL);
    let missing = place.run(&["dispatch", "hall.toml"]);
    assert_eq!(missing.code(), 2);
    assert!(missing.err().contains("--vda5050"), "{}", missing.err());
    assert!(refusal(HALL, &["--serial-prefix", "a/b"]).contains("without /"));
    assert!(refusal(HALL, &["--silence", "0"]).contains("0.1 to 86400"));
    assert!(refusal(HALL, &["--regime", "both"]).contains("leave it out"));
}

#[test]
fn a_scenario_without_a_plan_for_vehicles_is_refused_with_a_remedy() {
    if !is_there() {
        return;
    }
    let alone = refusal(HALL, &[]);
    assert!(alone.contains("decides alone") && alone.contains("planner = "), "{alone}");
    let airspace =
        "format = 1\nworld = \"airspace\"\n[airspace.generator]\nkind = \"superconflict\"\nn = 3\n";
    let flies = refusal(airspace, &[]);
    assert!(flies.contains("world = \"robots\""), "{flies}");
    let planner = "planner = { method = \"file\", file = \"ring.plan\" }\n";
    let ring = refusal(&format!("{HALL}{planner}"), &[]);
    assert!(ring.contains("in a ring") && ring.contains("conflict_policy"), "{ring}");
}
