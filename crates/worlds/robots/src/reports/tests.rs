//! What a planner believes of robots that report now and then.

use crate::RobotsRun;
use crate::scenario::StorageOrder;
use crate::test_runs::run_in_order;
use sidestep_kernel::Simulation;

/// Robots that slip and are late, in two rooms with a passage.
const ROOMS: &str = r#"format = 1
world = "robots"
seed = 5
[map]
ascii = """
...........#...........
...........#...........
.......................
...........#...........
...........#...........
"""
[[robots]]
count = 8
effector = "w"
behaviour = { kind = "shuttle", a = [0, 0, 4, 5], b = [19, 0, 4, 5] }
planner = { PLANNER }
[effectors.w]
forward = [{ p = 0.9, path = "F" }, { p = 0.1 }]
left = [{ p = 0.95, turn = 90 }, { p = 0.05 }]
right = [{ p = 0.95, turn = -90 }, { p = 0.05 }]
[effectors.w.delays]
p = 0.05
min = 1
max = 4
"#;

/// A robot that is led along a lane, on which another one stands of which its planner knows nothing.
const LANE: &str = r#"format = 1
world = "robots"
regime = "reliable"
map.ascii = "...................."
[[robots]]
at = [[0, 0, 0]]
behaviour = { kind = "goto", goals = [[19, 0]] }
planner = { method = "pibt", places = "believed", report_every = 5 }
[[robots]]
at = [[3, 0, 0]]
behaviour = { kind = "replay", actions = ["stay"], repeat = true }
"#;

fn run(text: &str) -> RobotsRun {
    run_in_order(text, 1, StorageOrder::Spatial)
}

/// The column where the planner of the first team believes its first robot.
fn believed_col(run: &RobotsRun) -> u32 {
    let (_planner, memory) = run.state().planner_teams[0].locked();
    memory.beliefs[0].pose.col
}

/// The column where a robot is.
fn col(run: &RobotsRun, robot: u32) -> u32 {
    run.world().map_position(run.state().body(robot).position()).0
}

#[test]
fn robots_that_report_in_each_cycle_are_led_as_if_their_places_were_known() {
    for planner in [
        "method = \"pibt\"",
        "method = \"lacam\", budget_expansions = 100",
        "method = \"lacam\", executor = \"replan\", budget_expansions = 100",
        "method = \"prioritized\", executor = \"blind\", window = 12",
    ] {
        let mut known = run(&ROOMS.replace("PLANNER", planner));
        let believed = format!("{planner}, places = \"believed\"");
        let mut reported = run(&ROOMS.replace("PLANNER", &believed));
        for cycle in 0..200 {
            known.advance(1);
            reported.advance(1);
            for robot in 0..8 {
                let [is, must_be] = [&reported, &known].map(|run| {
                    let body = run.state().body(robot);
                    (body.position(), body.facing.get().heading())
                });
                // A plan whose order is kept goes on where a robot turns out to be behind, and is else made anew.
                if planner.contains("lacam") && !planner.contains("replan") {
                    continue;
                }
                assert_eq!(is, must_be, "{planner}, robot {robot}, cycle {cycle}");
            }
        }
        assert!(reported.metrics().total.trips > 0, "{planner}");
    }
}

#[test]
fn a_planner_believes_that_its_orders_are_carried_out_until_a_report_says_otherwise() {
    let mut run = run(LANE);
    let mut believed = Vec::new();
    for _ in 0..11 {
        run.advance(1);
        believed.push(believed_col(&run));
    }
    // The reports before the cycles 0, 5 and 10 tell the truth: from column 2 on, it runs against the other robot.
    assert_eq!(believed, [0, 1, 2, 3, 4, 2, 3, 4, 5, 6, 2]);
    assert_eq!(col(&run, 0), 2);
}

#[test]
fn without_any_report_a_planner_follows_its_orders_only() {
    let text = LANE.replace("report_every = 5", "report_loss = 1.0");
    let mut run = run(&text);
    run.advance(60);
    assert_eq!(believed_col(&run), 19);
    assert_eq!(col(&run, 0), 2);
    assert_eq!(run.metrics().total.trips, 0, "what is only believed is no trip");
}

#[test]
fn a_robot_whose_reports_are_lost_at_times_arrives_all_the_same() {
    let text = ROOMS.replace(
        "PLANNER",
        "method = \"pibt\", places = \"believed\", report_every = 4, report_loss = 0.5",
    );
    let mut run = run(&text);
    run.advance(2_000);
    let metrics = run.metrics();
    assert!(metrics.total.trips >= 8, "{metrics:?}");
}
