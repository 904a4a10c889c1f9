//! The airspace world by the real command: run, record, replay, compare, other programs' files.

use crate::support::{Place, names};
use serde_json::Value;

const SIX: &str = "format = 1\nworld = \"airspace\"\nname = \"Six\"\n\
                   [airspace.generator]\nkind = \"superconflict\"\nn = 6\n";

#[test]
fn a_run_ends_when_all_have_arrived_and_says_what_came_of_it() {
    let place = Place::new();
    place.write("six.toml", SIX);
    let told = place.json(&["run", "six.toml", "--out", "six"]);
    let metrics = &told["metrics"];
    assert_eq!(told["status"], "complete");
    assert_eq!((&metrics["airplanes"], &metrics["arrived"]), (&Value::from(6), &Value::from(6)));
    assert_eq!(metrics["losses_of_separation"], 0);
    assert!(metrics["min_separation_m"].as_f64().is_some_and(|d| d >= 500.0));
    for key in [
        "mean_delay_percent",
        "messages",
        "bytes",
        "optimisations",
        "rounds_mean",
        "optimise_cpu_s",
        "shield_overrides",
    ] {
        assert!(metrics[key].is_number(), "{key}");
    }
    assert!(told["digest"].as_str().is_some_and(|d| d.len() == 32));
    let written = names(&place.path("six"));
    assert!(written.contains(&"trajectories.png".to_string()), "{written:?}");
    let replayed = place.run(&["replay", "six", "--cycle", "20"]);
    assert_eq!(replayed.code(), 0, "{}", replayed.err());
    assert!(replayed.out().contains("equal to the 6 recorded poses"), "{}", replayed.out());
    let again = place.run(&["resume", "six"]);
    assert_eq!(again.code(), 2, "a complete run cannot be resumed");
}

#[test]
fn every_deployment_gives_the_digest_of_one_process() {
    let place = Place::new();
    place.write("six.toml", SIX);
    let digest = |deployment: &str| {
        let set = format!("airspace.deployment={deployment}");
        let args =
            ["run", "six.toml", "--cycles", "12", "--set", &set, "--set", "airspace.generator.n=3"];
        place.json(&args)["digest"].clone()
    };
    for deployment in ["team", "compact-team", "pim"] {
        assert_eq!(digest(deployment), digest("direct"), "{deployment}");
    }
}

#[test]
fn methods_are_compared_on_the_same_traffic() {
    let place = Place::new();
    place.write("six.toml", SIX);
    let args = [
        "compare",
        "six.toml",
        "--methods",
        "pc,none",
        "--runs",
        "2",
        "--set",
        "airspace.shield=off",
    ];
    let told = place.json(&args);
    assert_eq!(
        (&told["methods"][0]["method"], &told["methods"][0]["loss_free"]),
        (&Value::from("pc"), &Value::from(2))
    );
    assert_eq!(
        (&told["methods"][1]["method"], &told["methods"][1]["loss_free"]),
        (&Value::from("none"), &Value::from(0))
    );
    let other = place.run(&["compare", "s.toml"]);
    assert_eq!(other.code(), 2);
    assert!(other.err().contains("airspace"), "{}", other.err());
}

#[test]
fn a_bluesky_file_is_a_scenario_and_check_counts_its_commands() {
    let place = Place::new();
    place.write(
        "two.scn",
        "00:00:00.00>CRE A1,B744,0,-0.4,90,FL200,250\n\
         00:00:00.00>CRE B2,B744,0,0.4,270,FL200,250\n\
         00:00:00.00>PAN 0 0\n00:00:01.00>MCRE 3,B744\n00:00:02.00>CRE broken\n",
    );
    let told = place.json(&["check", "two.scn"]);
    assert_eq!(told["command_lines"], 5, "{told}");
    assert_eq!(told["commands"]["CRE"], 3, "{told}");
    assert_eq!(told["not_understood"]["MCRE"], 1, "{told}");
    assert_eq!(told["unparsed_lines"], 1, "{told}");
    place.write("nowhere.scn", "00:00:00.00>CRE A1,B744,EHAM,RWY18L,90,FL200,250\n");
    let nowhere = place.json(&["check", "nowhere.scn"]);
    assert_eq!((&nowhere["airplanes"], &nowhere["commands"]["CRE"]), (&0.into(), &1.into()));
    assert_eq!(place.run(&["run", "nowhere.scn"]).code(), 2);
    let ran = place.json(&["run", "two.scn", "--cycles", "5", "--out", "two"]);
    assert_eq!(ran["metrics"]["airplanes"], 2);
    assert!(place.read("two/scenario.toml").contains("[[airplanes]]"));
    assert_eq!(ran["file"]["not_understood"]["MCRE"], 1, "{ran}");
    assert_eq!(ran["file"]["unparsed_lines"], 1, "{ran}");
    let report = place.run(&["run", "two.scn", "--cycles", "5"]).out();
    for expected in ["not acted on", "MCRE 1", "display only", "PAN 1", "two.scn:5:13"] {
        assert!(report.contains(expected), "{expected} is missing in\n{report}");
    }
}
