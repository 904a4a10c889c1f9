//! A team that a planner leads goes where it should, and is the same run on any number of workers, resumed or not.

use crate::RobotsRun;
use crate::scenario::{Behaviours, Compiled, StorageOrder};
use sidestep_kernel::{CheckpointableWorld, Digest, Simulation};
use sidestep_scenario::Source;

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

/// A run that always uses all its workers.
fn run_in_order(text: &str, workers: usize, order: StorageOrder) -> RobotsRun {
    let source = Source::new("test", text, "");
    let compiled = Compiled::new(&source, &Behaviours::new(), order);
    let mut run = compiled.unwrap_or_else(|e| panic!("{e}")).start(&source, workers);
    run.force_parallel();
    run
}

fn run(text: &str, workers: usize) -> RobotsRun {
    run_in_order(text, workers, StorageOrder::Spatial)
}

fn digest(run: &RobotsRun) -> Digest {
    run.world().digest(run.state(), run.cycle())
}

#[test]
fn a_plan_is_the_same_bits_on_any_number_of_workers_and_in_any_storage() {
    let mut one = run(ROOMS, 1);
    one.advance(400);
    for workers in [2, 3, 8] {
        let mut many = run(ROOMS, workers);
        many.advance(400);
        assert_eq!(digest(&many), digest(&one), "{workers} workers");
    }
    let mut shuffled = run_in_order(ROOMS, 2, StorageOrder::Shuffled(3));
    shuffled.advance(400);
    assert_eq!(digest(&shuffled), digest(&one));
}

#[test]
fn a_run_that_goes_on_from_a_snapshot_in_mid_plan_is_the_same_run() {
    let mut whole = run(ROOMS, 1);
    whole.advance(137);
    let saved = whole.checkpoint();
    whole.advance(263);
    // Nothing of the planner itself is kept, as after a resume in another process.
    let mut resumed = run(ROOMS, 2);
    resumed.restore(&saved).expect("fits");
    resumed.advance(263);
    assert_eq!(digest(&resumed), digest(&whole));
    assert!(whole.metrics().total.off_plan > 0);
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
