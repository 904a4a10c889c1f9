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
    memory.beliefs.robots[0].pose.col
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

#[test]
fn robots_that_act_seldom_report_at_their_turns_and_a_resumed_run_believes_the_same() {
    let planner = "method = \"pibt\", places = \"believed\", report_every = 3, report_loss = 0.2";
    let text = ROOMS
        .replace("PLANNER", planner)
        .replace("count = 8\n", "count = 8\nperiod = 3\nphase = 1\n");
    let mut whole = run(&text);
    whole.advance(600);
    assert!(whole.metrics().total.trips > 0, "{:?}", whole.metrics());
    for at in [1, 2, 3, 100, 301] {
        let mut before = run(&text);
        before.advance(at);
        let mut resumed = run_in_order(&text, 2, StorageOrder::Spatial);
        resumed.restore(&before.checkpoint()).expect("the same scenario");
        resumed.advance(600 - at);
        assert_eq!(resumed.digest(), whole.digest(), "resumed at {at}");
    }
}

/// Robots that never err, in a hall.
fn hall(robots: &str, planner: &str) -> String {
    format!(
        "format = 1\nworld = \"robots\"\nregime = \"reliable\"\nconflict_policy = \"simultaneous\"\nseed = 2\nmap.ascii = \"\"\"\n............\n\
         ............\n............\n............\n\"\"\"\n[[robots]]\ncount = 6\n{robots}\
         behaviour = {{ kind = \"shuttle\", a = [0, 0, 2, 4], b = [10, 0, 2, 4] }}\nplanner = {{ {planner} }}\n"
    )
}

#[test]
fn without_errors_and_reports_what_is_believed_is_true_in_each_cycle() {
    for robots in ["", "action_cycles = 3\n", "period = 3\nphase = 1\n"] {
        let planner = "method = \"pibt\", places = \"believed\", report_loss = 1.0";
        let mut run = run(&hall(robots, planner));
        for cycle in 0..60 {
            let (world, state) = (run.world(), run.state());
            let team = &world.planner_teams[0];
            let known = world.situation_ahead(state, team, &state.planner_teams[0], cycle);
            for (robot, id) in team.robots.clone().enumerate() {
                let body = state.body(id);
                let is = (world.map_position(body.position()), body.facing.get().heading());
                let believed = (known.poses[robot].position(), known.poses[robot].heading);
                assert_eq!(believed, is, "robot {id}, cycle {cycle}, {robots}");
                let left = known.busy_agent(robot).map_or(0, |busy| busy.steps_left);
                assert_eq!(left, state.action_progress.left(id), "robot {id}, cycle {cycle}");
            }
            run.advance(1);
        }
        assert!(run.metrics().total.distance_m > 0.0);
    }
}

#[test]
fn the_order_of_a_plan_keeps_robots_out_of_boxes_that_others_are_believed_to_leave() {
    let planner = "method = \"lacam\", budget_expansions = 100, places = \"believed\"";
    let mut run = run(&hall("action_cycles = 3\n", planner));
    run.advance(600);
    let total = run.metrics().total;
    assert!(total.trips > 0, "{total:?}");
    assert_eq!((total.contacts, total.off_plan), (0, 0), "{total:?}");
}

#[test]
fn a_plan_that_something_unknown_stands_in_the_way_of_is_given_up_though_steps_are_believed() {
    let text = LANE.replace("method = \"pibt\"", "method = \"lacam\", budget_expansions = 20");
    let mut run = run(&text);
    run.advance(200);
    assert!(run.metrics().plans >= 3, "{:?}", run.metrics());
}
