//! A problem becomes a scenario with its map, starts, tasks, actions and delays, and what is wrong in it is told.

use super::*;
use crate::RobotsRun;
use crate::scenario::{Behaviours, Compiled, StorageOrder};
use sidestep_kernel::Simulation;
use sidestep_scenario::Source;

const MAP: &str = "type octile\nheight 3\nwidth 5\nmap\n..E@.\n..S..\n.....\n";
const PROBLEM: &str = r#"{
    "mapFile": "m.map", "agentFile": "m.agents", "teamSize": 2, "taskFile": "m.tasks",
    "numTasksReveal": 1.5, "version": "2026 LoRR", "agentCounter": 3, "agentSize": 0.9,
    "delayConfig": {
        "seed": 7, "minDelay": 2, "maxDelay": 4, "eventModel": "bernoulli", "pDelay": 0.25,
        "durationModel": "gaussian", "gaussMeanRatio": 0.5, "gaussStdRatio": 0.5
    }
}"#;

fn imported(problem: &str) -> ImportedScenario {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let lists = "# version for LoRR 2026\n2\n";
    for (name, text) in [
        ("p.json", problem.to_owned()),
        ("m.map", MAP.to_owned()),
        ("m.agents", format!("{lists}0\n6\n")),
        ("m.tasks", format!("{lists}0,7\n4,10,2\n")),
    ] {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    import_file(&folder.path().join("p.json")).expect("a problem").expect("recognized")
}

fn compiled(imported: &ImportedScenario) -> (Source, Compiled) {
    let text = imported.scenario.as_ref().expect("a scenario");
    let source = Source::new("p", text, "");
    let compiled = Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial);
    (source, compiled.unwrap_or_else(|e| panic!("{e}\n{text}")))
}

fn run(problem: &str) -> RobotsRun {
    let (source, compiled) = compiled(&imported(problem));
    compiled.start(&source, 1)
}

#[test]
fn a_problem_is_a_scenario_in_which_its_tasks_are_carried_out() {
    let imported = imported(PROBLEM);
    let (_, compiled) = compiled(&imported);
    assert_eq!((compiled.seed, compiled.cycles, &*compiled.name), (7, CYCLES, "p"));
    // Rows count from the south.
    assert_eq!(compiled.start[..], [((0, 2), 0), ((1, 1), 0)]);
    assert_eq!(compiled.world.bodies[0].action_cycles, 3);
    let tasks = compiled.world.planner_teams[0].tasks.as_ref().expect("tasks");
    assert_eq!(tasks.tasks, [vec![(0, 2), (2, 1)], vec![(4, 2), (0, 0), (2, 2)]]);
    assert_eq!(tasks.known, 3);
    let found: Vec<&str> = imported.report.findings.iter().map(|f| f.rule.as_str()).collect();
    assert!(found.iter().any(|rule| rule.contains("1500 cycles")), "{found:?}");
    assert!(found.iter().any(|rule| rule.contains("agentSize 0.9")), "{found:?}");
    let mut run = run(PROBLEM);
    run.advance(1500);
    let metrics = run.metrics();
    assert!(metrics.tasks_finished > 20, "{}", metrics.tasks_finished);
    // What is late is no contact: whoever is late stands where it was planned to be, or before it.
    assert!(metrics.total.delayed_cycles > 500, "{:?}", metrics.total);
}

/// The probabilities that the start kit's generator has: rounded to whole ticks, and cut off.
#[test]
fn gaussian_delays_are_rounded_and_moved_to_the_ends() {
    let text = rounded_normal(2, 4, 3.0, 1.0);
    // P(x < 2.5) = 0.3085 for a mean of 3 and a deviation of 1.
    assert!(text.contains("cycles = 2, p = 0.30853"), "{text}");
    assert!(text.contains("cycles = 3, p = 0.38292"), "{text}");
    assert!(text.contains("cycles = 4, p = 0.30853"), "{text}");
    assert_eq!(rounded_normal(2, 5, 3.5, 0.0), "min = 4\nmax = 4\n");
}

/// The number of robots that are late at once differs between the models, not their mean.
#[test]
fn delays_of_a_team_have_the_mean_of_their_chance() {
    for (events, duration) in
        [("bernoulli", "uniform"), ("poisson", "uniform"), ("poisson", "gaussian")]
    {
        let text = PROBLEM
            .replace("bernoulli", events)
            .replace("gaussian", duration)
            .replace("\"pDelay\": 0.25", "\"pDelay\": 0.1");
        let mut run = run(&text);
        run.advance(20_000);
        let late = run.metrics().total.delayed_cycles as f64 / 40_000.0;
        // A delay of 3 cycles starts after 10 without on the mean; of two robots that are drawn together, one that is
        // ready has more than its share.
        let expected = if events == "poisson" { 0.2..0.32 } else { 0.21..0.25 };
        assert!(expected.contains(&late), "{events}, {duration}: {late}");
    }
}

#[test]
fn a_problem_without_delays_is_reliable() {
    let mut run = run(&PROBLEM.replace("0.25", "0.0"));
    run.advance(1000);
    let metrics = run.metrics();
    assert_eq!((metrics.total.off_plan, metrics.total.contacts), (0, 0));
    assert!(metrics.tasks_finished > 20, "{}", metrics.tasks_finished);
}

#[test]
fn other_files_are_no_problems() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("other.json");
    std::fs::write(&path, "{ \"states\": [] }").expect("written");
    assert_eq!(import_file(&path).map(|import| import.is_some()), Ok(false));
    assert_eq!(import_file(folder.path()).map(|import| import.is_some()), Ok(false));
}
