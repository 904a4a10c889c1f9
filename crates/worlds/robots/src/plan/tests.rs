//! A team that a planner leads goes where it should, and is the same run on any number of workers, resumed or not.

use crate::RobotsRun;
use crate::metrics::Metrics;
use crate::scenario::{Behaviours, Compiled, StorageOrder};
use crate::test_runs::run_in_order;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{CheckpointableWorld, Digest, Seed, Simulation};
use sidestep_map::planning::FreeSpace;
use sidestep_planners::{ActionModel, Agent, GridPose, Instance, Plan, plan_file};
use sidestep_scenario::Source;
use std::collections::BTreeSet;
use std::path::Path;

/// Robots that go to and fro in two rooms with a passage of one box, among a person and a door, with wheels that slip.
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
planner = { method = "pibt" }
[people]
count = 1
[doors]
at = [[11, 2]]
random = { p_open = 0.3, p_close = 0.02 }
[effectors.w]
forward = [{ p = 0.9, path = "F" }, { p = 0.1 }]
left = [{ p = 0.95, turn = 90 }, { p = 0.05 }]
right = [{ p = 0.95, turn = -90 }, { p = 0.05 }]
[effectors.w.delays]
p = 0.05
min = 1
max = 4
"#;

fn run(text: &str, workers: usize) -> RobotsRun {
    run_in_order(text, workers, StorageOrder::Spatial)
}

fn digest(run: &RobotsRun) -> Digest {
    run.world().digest(run.state(), run.cycle())
}

/// Each method, and each executor.
const PLANNERS: [&str; 9] = [
    "method = \"pibt\"",
    "method = \"lacam\", budget_expansions = 100",
    "method = \"lacam\", executor = \"blind\", window = 12, budget_expansions = 100",
    "method = \"prioritized\", executor = \"replan\", replan_every = 15, max_deviation = 1",
    "method = \"prioritized\"",
    "method = \"cbs\", executor = \"replan\", budget_expansions = 5",
    "method = \"pibt\", places = \"believed\", report_every = 3, report_loss = 0.2",
    "method = \"lacam\", budget_expansions = 100, places = \"believed\"",
    "method = \"prioritized\", places = \"believed\", report_every = 2",
];

/// Returns the rooms with another planner.
fn rooms(planner: &str) -> String {
    ROOMS.replace("method = \"pibt\"", planner)
}

#[test]
fn a_plan_is_the_same_bits_on_any_number_of_workers_and_in_any_storage() {
    for planner in PLANNERS {
        let text = rooms(planner);
        let mut one = run(&text, 1);
        one.advance(250);
        for workers in [2, 3, 8] {
            let mut many = run(&text, workers);
            many.advance(250);
            assert_eq!(digest(&many), digest(&one), "{planner}, {workers} workers");
        }
        let mut shuffled = run_in_order(&text, 2, StorageOrder::Shuffled(3));
        shuffled.advance(250);
        assert_eq!(digest(&shuffled), digest(&one), "{planner}");
        let metrics = one.metrics();
        assert!(
            // Conflict-based search finds no plan of these in five expansions, so that this is tried, too.
            metrics.total.trips > 0
                && (metrics.plans > metrics.plan_failures || planner.contains("cbs")),
            "{planner}: {metrics:?}"
        );
    }
}

#[test]
fn a_run_that_goes_on_from_a_snapshot_in_mid_plan_is_the_same_run() {
    for planner in PLANNERS {
        let text = rooms(planner);
        let mut whole = run(&text, 1);
        whole.advance(137);
        let saved = whole.checkpoint();
        whole.advance(263);
        // Nothing of the planner itself is kept, as after a resume in another process.
        let mut resumed = run(&text, 2);
        resumed.restore(&saved).expect("fits");
        resumed.advance(263);
        assert_eq!(digest(&resumed), digest(&whole), "{planner}");
        let timeless = |run: &RobotsRun| Metrics { plan_cpu_s: 0.0, ..run.metrics() };
        assert_eq!(timeless(&resumed), timeless(&whole), "{planner}");
        assert!(whole.metrics().total.off_plan > 0);
    }
}

#[test]
fn the_digest_depends_on_what_the_planner_remembers() {
    let mut first = run(ROOMS, 1);
    first.advance(50);
    let mut other = first.snapshot();
    let words = &mut other.bodies[0].contacts;
    *words.last_mut().expect("has words") += 1;
    assert_ne!(other.digest(), first.snapshot().digest());
}

/// In two lanes of one box, robots that decide alone meet head-on and stop for good.
const CORRIDOR: &str = r#"format = 1
world = "robots"
conflict_policy = "simultaneous"
regime = "reliable"
[map]
ascii = """
....................
....................
"""
[[robots]]
count = 16
behaviour = { kind = "shuttle", a = [0, 0, 3, 2], b = [17, 0, 3, 2] }
planner = { method = "pibt" }
"#;

#[test]
fn a_team_that_is_led_passes_where_robots_that_decide_alone_jam() {
    let mut led = run(CORRIDOR, 1);
    led.advance(1000);
    let metrics = led.metrics();
    // Whoever is led by a plan without slips is where it planned, and touches nothing.
    assert_eq!([metrics.total.off_plan, metrics.total.contacts], [0, 0]);
    assert_eq!(metrics.plans, 1000);
    assert!(metrics.total.trips > 60, "{}", metrics.total.trips);
    let mut alone = run(&CORRIDOR.replace("planner = { method = \"pibt\" }\n", ""), 1);
    alone.advance(1000);
    assert_eq!(alone.metrics().plans, 0);
    assert!(alone.metrics().total.trips < metrics.total.trips / 2);
}

#[test]
fn large_bodies_with_a_period_come_to_goals_of_their_own() {
    let text = "format = 1\nworld = \"robots\"\nregime = \"reliable\"\n[map]\nascii = \"\"\"\n........\n........\n\
                ........\n........\n\"\"\"\n[[robots]]\nat = [[0, 0, 0], [0, 2, 0]]\nsize = 2\nperiod = 3\nphase = 1\n\
                behaviour = { kind = \"shuttle\", a = [0, 0, 2, 4], b = [6, 0, 2, 4] }\nplanner = { method = \"pibt\" }\n";
    let mut run = run(text, 1);
    // Each goes straight ahead: one turn to find itself at end 0 and six steps, in every third cycle.
    run.advance(2 + 3 * 6);
    let places: Vec<_> = run.snapshot().bodies.iter().map(|body| body.at).collect();
    assert_eq!(places, [(6, 0), (6, 2)]);
    assert_eq!(run.metrics().plans, 6);
    assert_eq!(run.metrics().total.contacts, 0);
}

#[test]
fn an_inspection_of_a_robot_that_is_led_changes_nothing() {
    let mut watched = run(ROOMS, 1);
    let mut unwatched = run(ROOMS, 1);
    for _ in 0..30 {
        let body = watched.world().body_id(3);
        assert!(watched.inspect(body).is_some());
        watched.advance(1);
        unwatched.advance(1);
    }
    assert_eq!(digest(&watched), digest(&unwatched));
}

/// Draws of the problems.
const PROBLEMS: Purpose = Purpose(1);

/// Returns the map of a problem of path finding, and the starts and goals of 2 to 20 robots of one size.
fn random_problem(number: u32, size: u32) -> (FreeSpace, Vec<[(u32, u32); 2]>) {
    let mut draws = Streams::new(Seed(7)).draws(number, 0, PROBLEMS);
    let side = 8 + draws.uniform_below(7);
    let walls: Vec<bool> = (0..side * side).map(|_| draws.uniform_below(10 * size) == 0).collect();
    let free = FreeSpace::new(side, side, |col, row| !walls[(row * side + col) as usize]);
    let anchors = free.anchors(size);
    let wanted = 2 + draws.uniform_below(19) as usize;
    let mut taken = [BTreeSet::new(), BTreeSet::new()];
    let mut robots = Vec::new();
    for _ in 0..wanted * 20 {
        let robot = [(); 2].map(|()| (draws.uniform_below(side), draws.uniform_below(side)));
        let fits = |end: usize| {
            let (col, row) = robot[end];
            anchors.is_free(col, row) && !super::meets(&taken[end], robot[end], size, None)
        };
        if robots.len() < wanted && fits(0) && fits(1) {
            (0..2).for_each(|end| _ = taken[end].insert(robot[end]));
            robots.push(robot);
        }
    }
    (free, robots)
}

/// Returns a MovingAI list of starts and goals, whose rows count from the north.
fn scen_text(side: u32, robots: &[[(u32, u32); 2]]) -> String {
    let mut text = String::from("version 1\n");
    for [start, goal] in robots {
        let fields =
            [start.0, side - 1 - start.1, goal.0, side - 1 - goal.1].map(|n| n.to_string());
        text += &format!("0\tm.map\t{side}\t{side}\t{}\t1\n", fields.join("\t"));
    }
    text
}

fn scenario_text(free: &FreeSpace, size: u32, planner: &str) -> String {
    let mut text =
        String::from("format = 1\nworld = \"robots\"\nregime = \"reliable\"\nseed = 3\n");
    text += "conflict_policy = \"simultaneous\"\n[map]\nascii = \"\"\"\n";
    for row in (0..free.height()).rev() {
        text.extend((0..free.width()).map(|col| if free.is_free(col, row) { '.' } else { '#' }));
        text.push('\n');
    }
    format!(
        "{text}\"\"\"\n[[robots]]\nscen = \"a.scen\"\nsize = {size}\nplanner = {{ {planner} }}\n"
    )
}

fn run_in(folder: &Path, text: &str) -> RobotsRun {
    let source = Source::new("test", text, folder);
    let compiled = Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial);
    compiled.unwrap_or_else(|e| panic!("{e}\n{text}")).start(&source, 1)
}

/// Returns the poses of all robots.
fn poses(run: &RobotsRun) -> Vec<GridPose> {
    let bodies = run.snapshot().bodies;
    bodies.iter().map(|body| GridPose::new(body.at.0, body.at.1, body.facing.heading())).collect()
}

/// Returns the plan that the team carries out.
fn plan_of(run: &RobotsRun) -> Option<Plan> {
    let memory = run.state().planner_teams[0].locked().1;
    memory.planner.execution.as_ref().map(|execution| execution.plan.clone())
}

/// Runs a scenario from its start on, and returns the plan of the first cycle and what was flown until it is over.
fn flown(folder: &Path, text: &str) -> Option<(Plan, Plan)> {
    let mut run = run_in(folder, text);
    let mut paths: Vec<Vec<GridPose>> = poses(&run).into_iter().map(|pose| vec![pose]).collect();
    run.advance(1);
    let plan = plan_of(&run)?;
    for _ in 0..plan.steps() {
        for (path, pose) in paths.iter_mut().zip(poses(&run)) {
            path.push(pose);
        }
        run.advance(1);
    }
    paths.iter_mut().for_each(|path| path.truncate(plan.steps() + 1));
    Some((plan, Plan::new(paths)))
}

#[test]
fn two_hundred_plans_are_carried_out_by_reliable_robots_to_the_step() {
    let methods = [
        "method = \"lacam\", budget_expansions = 200",
        "method = \"prioritized\"",
        "method = \"cbs\", budget_expansions = 100",
    ];
    let folder = tempfile::tempdir().expect("a folder");
    let mut flights = 0;
    let mut number = 0;
    while flights < 200 {
        assert!(number < 500, "only {flights} plans were found");
        let size = 1 + number % 2;
        let (free, robots) = random_problem(number, size);
        let method = methods[number as usize % methods.len()];
        number += 1;
        std::fs::write(folder.path().join("a.scen"), scen_text(free.width(), &robots))
            .expect("written");
        let by = |rule: &str| {
            flown(
                folder.path(),
                &scenario_text(&free, size, &format!("{method}, executor = {rule}")),
            )
        };
        let Some((plan, blind)) = by("\"blind\"") else { continue };
        let agents = robots.iter().enumerate().map(|(robot, &[_, goal])| Agent {
            size,
            start: plan.pose(robot, 0),
            goal,
        });
        let instance =
            Instance::new(&free, ActionModel::Turns, agents.collect()).expect("is right");
        assert_eq!(plan.validate(&instance), Ok(()));
        assert_eq!(blind.costs(&instance), plan.costs(&instance), "{number}");
        let replan = by("\"replan\", replan_every = 1000").expect("as before");
        assert!(replan.1 == blind, "{number}");
        let (_, ordered) = by("\"adg\"").expect("as before");
        assert!(ordered.costs(&instance).sum_of_costs <= plan.costs(&instance).sum_of_costs);
        std::fs::write(folder.path().join("a.plan"), plan_file::write(&plan)).expect("written");
        let given = "method = \"file\", file = \"a.plan\", executor = \"blind\"";
        let (_, given) = flown(folder.path(), &scenario_text(&free, size, given)).expect("has one");
        assert!(given == blind, "{number}");
        flights += 1;
    }
}

#[test]
fn a_full_corridor_does_not_stand_still_whatever_the_conflict_policy() {
    for policy in ["random", "fixed", "simultaneous"] {
        let text = CORRIDOR.replace(
            "conflict_policy = \"simultaneous\"",
            &format!("conflict_policy = \"{policy}\""),
        );
        let mut run = run(&text, 1);
        run.advance(1_000);
        let metrics = run.metrics();
        assert!(metrics.total.trips >= 50, "{policy}: {metrics:?}");
        assert_eq!(metrics.total.contacts, 0, "{policy}");
    }
}

/// Returns robots at these places that go to and fro between the ends of a corridor of two rows, as a section.
fn corridor_section(at: &str, planner: &str) -> String {
    format!(
        "[[robots]]\nat = {at}\neffector = \"w\"\nperiod = 2\nphase = 1\n\
         behaviour = {{ kind = \"shuttle\", a = [0, 0, 2, 2], b = [10, 0, 2, 2] }}\n{planner}\n"
    )
}

/// Returns a corridor with sections of robots.
fn corridor(sections: &[String]) -> String {
    format!(
        "format = 1\nworld = \"robots\"\nconflict_policy = \"simultaneous\"\n\
         map.ascii = \"\"\"\n............\n............\n\"\"\"\n{}\
         [effectors.w]\nforward = [{{ p = 0.9, path = \"F\" }}, {{ p = 0.1 }}]\n",
        sections.concat()
    )
}

#[test]
fn two_sections_of_one_team_are_led_as_one_section_of_all_their_robots() {
    for method in [
        "\"pibt\"",
        "\"lacam\", budget_expansions = 50",
        "\"pibt\", places = \"believed\", report_every = 3",
    ] {
        let named = format!("name = \"first\"\nplanner = {{ method = {method} }}");
        let places = ["[[0, 0, 0], [3, 1, 2], [5, 0, 0]]", "[[7, 1, 2], [9, 0, 1], [11, 1, 3]]"];
        let all = "[[0, 0, 0], [3, 1, 2], [5, 0, 0], [7, 1, 2], [9, 0, 1], [11, 1, 3]]";
        let apart =
            [corridor_section(places[0], &named), corridor_section(places[1], "team = \"first\"")];
        let mut one = run(&corridor(&[corridor_section(all, &named)]), 1);
        let mut two = run(&corridor(&apart), 2);
        one.advance(600);
        two.advance(600);
        assert!(one.metrics().total.trips > 0, "{method}");
        let places = |run: &RobotsRun| -> Vec<_> {
            (0..6).map(|id| run.state().body(id).position().word()).collect()
        };
        assert_eq!(places(&one), places(&two), "{method}");
        assert_eq!(one.metrics().total.trips, two.metrics().total.trips, "{method}");
    }
}
