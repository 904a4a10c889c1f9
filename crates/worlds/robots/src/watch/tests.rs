//! Tests of the progress of robots, and of gridlocks.

use crate::metrics::Counters;
use crate::progress::Gridlock;
use crate::scenario::{Behaviours, Compiled, StorageOrder};
use crate::state::RobotsState;
use crate::{RobotsRun, robots_run};
use serde_json::{Value, json};
use sidestep_kernel::ports::MemoryRecorder;
use sidestep_kernel::view::{FrameOptions, LogEventKind};
use sidestep_kernel::{CheckpointableWorld, Simulation};
use sidestep_scenario::Source;

/// Two robots in a lane that is as wide as they are, each with its goal behind the other.
const HEAD_ON: &str = "[map]\nascii = \"....................\"\n\
    [[robots]]\nat = [[2, 0, 0]]\nsensors = [\"sonar-ring\"]\n\
    behaviour = { kind = \"shuttle\", a = [0, 0, 1, 1], b = [19, 0, 1, 1] }\n\
    [[robots]]\nat = [[16, 0, 2]]\nsensors = [\"sonar-ring\"]\n\
    behaviour = { kind = \"shuttle\", b = [0, 0, 1, 1], a = [19, 0, 1, 1] }\n";

/// Three robots behind one that acts every 400 cycles, in a lane that is as wide as they are.
const QUEUE: &str = "[map]\nascii = \"....................\"\n\
    [[robots]]\nat = [[4, 0, 0]]\nperiod = 400\nphase = 0\n\
    behaviour = { kind = \"goto\", goals = [[19, 0, 1, 1]] }\n\
    [[robots]]\nat = [[1, 0, 0], [2, 0, 0], [3, 0, 0]]\n\
    behaviour = { kind = \"goto\", goals = [[19, 0, 1, 1]] }\n";

fn run(scenario: &str) -> RobotsRun {
    let text = format!("format = 1\nworld = \"robots\"\nregime = \"reliable\"\n{scenario}");
    robots_run(&Source::new("s", &text, ""), 1).unwrap_or_else(|error| panic!("{error}"))
}

/// The counters of one robot.
fn counts(run: &RobotsRun, robot: u32) -> Counters {
    run.world().counts(run.state(), run.cycle(), robot)
}

fn metric(run: &RobotsRun, name: &str) -> Value {
    Simulation::metrics(run)[name].clone()
}

/// Four robots that fill their room, each with its goal where the next one stands.
const RING: &str = "[map]\nascii = \"..\\n..\"\n\
    [[robots]]\nat = [[0, 0, 0]]\nbehaviour = { kind = \"goto\", goals = [[1, 0]], avoidance = \"avoid\" }\n\
    [[robots]]\nat = [[1, 0, 1]]\nbehaviour = { kind = \"goto\", goals = [[1, 1]], avoidance = \"avoid\" }\n\
    [[robots]]\nat = [[1, 1, 2]]\nbehaviour = { kind = \"goto\", goals = [[0, 1]], avoidance = \"avoid\" }\n\
    [[robots]]\nat = [[0, 1, 3]]\nbehaviour = { kind = \"goto\", goals = [[0, 0]], avoidance = \"avoid\" }\n";

/// Returns two rows of three robots each that meet in a corridor as wide as they are.
fn rows_head_on(sensors: &str, avoidance: &str) -> String {
    let map = ".".repeat(40);
    let section = |at: &str, ends: [u32; 2]| {
        format!(
            "[[robots]]\nat = {at}\nsensors = {sensors}\nbehaviour = {{ kind = \"shuttle\", a = [{}, 0, 3, 1], \
             b = [{}, 0, 3, 1], avoidance = \"{avoidance}\" }}\n",
            ends[0], ends[1],
        )
    };
    let west = section("[[0, 0, 0], [1, 0, 0], [2, 0, 0]]", [0, 37]);
    let east = section("[[37, 0, 2], [38, 0, 2], [39, 0, 2]]", [37, 0]);
    format!("[map]\nascii = \"{map}\"\n{west}{east}")
}

/// Returns the first gridlock and the cycle after which it was found.
fn first_gridlock(run: &mut RobotsRun, cycles: u64) -> (u64, Gridlock) {
    run.advance(cycles);
    let progress = &run.state().progress;
    let found = progress.first_gridlock_cycle().expect("a gridlock");
    (found, progress.first_gridlock().expect("a gridlock").clone())
}

#[test]
fn two_robots_that_cannot_pass_each_other_are_a_gridlock_within_500_cycles() {
    let mut run = run(HEAD_ON);
    run.start_recording();
    run.advance(100);
    assert_eq!(metric(&run, "gridlocks"), 0, "they have just met");
    let (found, first) = first_gridlock(&mut run, 450);
    assert!((found - 250..=found - 200).contains(&first.since), "{first}, found at {found}");
    assert_eq!(first.robots, [0, 1]);
    run.advance(2000);
    let standing = (metric(&run, "gridlocks"), metric(&run, "robots_in_gridlock"));
    assert_eq!(standing, (json!(1), json!(2)));
    assert_eq!(metric(&run, "first_gridlock_cycle"), found);
    let mut rows = MemoryRecorder::new(&run.schemas());
    run.record(&mut rows).expect("recorded");
    let column = |name: &str| rows.column("events", name).expect("a column");
    let told: Vec<usize> =
        (0..column("event").len()).filter(|&row| !column("robots").is_missing(row)).collect();
    assert_eq!(told.len(), 1, "one event");
    let schemas = run.schemas();
    let events = schemas.iter().find(|schema| schema.name == "events").expect("a table");
    let spec = events.columns.iter().find(|spec| spec.name == "event").expect("a column");
    assert_eq!(spec.text(column("event"), told[0]), "gridlock");
    assert_eq!(column("robots").text(told[0]), "0 1");
    assert_eq!(column("since_cycle").json(told[0]), first.since);
    assert_eq!(column("cycle").json(told[0]), found - 1);
}

#[test]
fn rows_of_robots_head_on_are_found_although_those_that_plan_stray() {
    for (sensors, avoidance, latest) in
        [("[]", "avoid", 300), ("[]", "touch", 300), ("[\"sonar-ring\"]", "plan", 800)]
    {
        let mut run = run(&rows_head_on(sensors, avoidance));
        let (found, first) = first_gridlock(&mut run, 1000);
        assert!(found <= latest, "{avoidance}: {found}");
        assert!(found - first.since < 500, "{avoidance}: {found}, {first}");
        assert!(first.robots.len() >= 5, "{avoidance}: {first}");
        assert_eq!(run.metrics().total.trips, 0, "{avoidance}");
    }
}

#[test]
fn a_ring_of_four_robots_with_nowhere_to_go_is_a_gridlock_unless_they_move_at_once() {
    let (found, first) = first_gridlock(&mut run(RING), 250);
    assert_eq!((found, first.since), (200, 0));
    assert_eq!(first.robots, [0, 1, 2, 3]);
    let mut at_once = run(&format!("conflict_policy = \"simultaneous\"\n{RING}"));
    at_once.advance(600);
    assert_eq!(metric(&at_once, "gridlocks"), 0);
}

#[test]
fn robots_that_a_planner_leads_may_be_in_a_gridlock_too() {
    let lane = ".".repeat(40);
    let mut run = run(&format!(
        "[map]\nascii = \"{lane}\"\n[[robots]]\nat = [[0, 0, 0], [1, 0, 0], [38, 0, 2], [39, 0, 2]]\n\
         behaviour = {{ kind = \"shuttle\", a = [0, 0, 1, 1], b = [39, 0, 1, 1] }}\n\
         planner = {{ method = \"pibt\" }}\n"
    ));
    let (found, first) = first_gridlock(&mut run, 1000);
    assert!(found <= 500 && first.robots.len() >= 2, "{found}: {first}");
}

#[test]
fn a_queue_behind_a_slow_robot_is_no_gridlock() {
    let mut run = run(QUEUE);
    run.advance(1950);
    assert_eq!(metric(&run, "gridlocks"), 0);
    let share = metric(&run, "waiting_share").as_f64().expect("they have goals");
    assert!(share > 0.5, "{share}");
}

#[test]
fn robots_behind_one_that_has_arrived_are_no_gridlock() {
    let mut run = run("[map]\nascii = \"..........\"\n\
        [[robots]]\nat = [[5, 0, 0]]\nbehaviour = { kind = \"goto\", goals = [[5, 0]] }\n\
        [[robots]]\nat = [[1, 0, 0], [2, 0, 0]]\nbehaviour = { kind = \"goto\", goals = [[9, 0]] }\n");
    run.advance(1000);
    assert_eq!(metric(&run, "gridlocks"), 0);
    // The one that has arrived waits no more.
    assert_eq!(counts(&run, 0).waiting_share, None);
    assert!(counts(&run, 1).waiting_share.is_some_and(|share| share > 0.5));
}

#[test]
fn a_gridlock_ends_when_its_robots_come_nearer_to_their_goals() {
    let mut run = run(HEAD_ON);
    run.enable_events();
    run.advance(500);
    assert_eq!(metric(&run, "robots_in_gridlock"), 2);
    let log = run.frame(FrameOptions::WITHOUT_SCANS).log;
    let event = log.iter().find(|event| event.kind == LogEventKind::Gridlock).expect("told");
    assert!(event.words.contains("2 robots (0, 1)"), "{event:?}");
    // Each is lifted over the other, to where it wants to go.
    let mut snapshot = run.snapshot();
    let at = [snapshot.bodies[0].at, snapshot.bodies[1].at];
    let goals = snapshot.progress.approaches.iter().map(|approach| approach.goal);
    let ends = goals.map(|goal| goal.expect("a goal")).collect::<Vec<_>>();
    let columns = [[0, 19], [19, 0]];
    for robot in 0..2 {
        snapshot.bodies[robot].at.0 = columns[robot][ends[robot] as usize];
    }
    let places = [snapshot.bodies[0].at, snapshot.bodies[1].at];
    assert!(places != at && places[0] != places[1], "{at:?}, {places:?}");
    let state = RobotsState::restore(run.world(), &snapshot);
    let mut progress = snapshot.progress;
    let found = run.world().check_progress(&mut progress, &state, 550);
    let ended: Vec<_> =
        found.iter().map(|event| (event.has_begun, &event.gridlock.robots[..])).collect();
    assert_eq!(ended, [(false, &[0, 1][..])]);
    assert_eq!((progress.gridlocks_begun(), progress.gridlocks().len()), (1, 0));
}

#[test]
fn a_resumed_run_goes_on_with_the_progress_of_its_robots() {
    for stop in ["", "[stop]\ngridlock = true\n"] {
        let text = format!("{HEAD_ON}{stop}");
        let mut whole = run(&text);
        whole.advance(175);
        let checkpoint = whole.checkpoint();
        let mut resumed = run(&text);
        resumed.restore(&checkpoint).expect("its own");
        assert_eq!(Simulation::metrics(&resumed), Simulation::metrics(&whole));
        for run in [&mut whole, &mut resumed] {
            run.advance(1000);
        }
        assert_eq!(metric(&whole, "gridlocks"), 1);
        assert_eq!(Simulation::metrics(&resumed), Simulation::metrics(&whole));
        assert_eq!((resumed.cycle(), resumed.digest()), (whole.cycle(), whole.digest()));
    }
}

#[test]
fn a_run_ends_at_its_first_gridlock_where_the_scenario_asks_for_it() {
    let text = format!("{HEAD_ON}[stop]\ngridlock = true\n");
    let mut run = run(&text);
    let done = run.advance(5000);
    assert!(run.is_over() && done <= 500, "{done}");
    let reason = run.end_reason().expect("a reason");
    assert!(reason.starts_with("a gridlock of 2 robots (0, 1)"), "{reason}");
    let mut stepped = self::run(&text);
    while !stepped.is_over() {
        assert_eq!(stepped.advance(1), 1);
    }
    assert_eq!((stepped.cycle(), stepped.digest()), (run.cycle(), run.digest()));
    let mut without = self::run(HEAD_ON);
    assert_eq!((without.advance(5000), without.end_reason()), (5000, None));
}

#[test]
fn a_gridlock_does_not_depend_on_the_number_of_workers() {
    let text = rows_head_on("[\"sonar-ring\"]", "plan");
    let text = format!("format = 1\nworld = \"robots\"\nregime = \"both\"\n{text}");
    let of_workers = |workers| {
        let mut run = robots_run(&Source::new("s", &text, ""), workers).expect("fits");
        run.force_parallel();
        run.advance(1500);
        run.snapshot()
    };
    let alone = of_workers(1);
    assert!(alone.progress.gridlocks_begun() > 0);
    assert_eq!(of_workers(2), alone);
    assert_eq!(of_workers(3), alone);
}

#[test]
fn what_ends_a_run_is_in_its_digest() {
    let text = format!("{HEAD_ON}[stop]\ngridlock = true\n");
    let mut run = run(&text);
    run.advance(150);
    let mut snapshot = run.snapshot();
    snapshot.progress.approaches[0].nearer_at -= 50;
    let state = RobotsState::restore(run.world(), &snapshot);
    assert_ne!(run.world().digest(&state, 150), run.digest());
    let mut without = self::run(HEAD_ON);
    without.advance(150);
    assert_eq!(without.snapshot().digest(), run.snapshot().digest(), "the bodies are the same");
    assert_eq!(without.digest(), without.snapshot().digest());
}

/// Two robots in a lane that is as wide as they are, which both have to go to both of its ends.
const ERRANDS: &str = "[map]\nascii = \"............\"\n\
    [[robots]]\nat = [[2, 0, 0], [9, 0, 2]]\nplanner = { method = \"pibt\" }\n\
    tasks = { list = [[[11, 0], [0, 0]]], policy = \"fifo\" }\n";

#[test]
fn robots_with_tasks_that_block_each_other_for_good_are_in_a_gridlock() {
    let mut first = run(ERRANDS);
    first.advance(600);
    assert_eq!(metric(&first, "tasks_finished"), json!(0));
    let found = metric(&first, "first_gridlock_cycle").as_u64().expect("a gridlock");
    assert!(found <= 500, "it is found within 500 cycles: {found}");
    assert_eq!(metric(&first, "robots_in_gridlock"), json!(2));
    // It is found at the same time in a run that is resumed before it.
    let mut before = run(ERRANDS);
    before.advance(found - 70);
    let mut resumed = run(ERRANDS);
    resumed.restore(&before.checkpoint()).expect("the same scenario");
    resumed.advance(600 - (found - 70));
    assert_eq!(resumed.digest(), first.digest());
    assert_eq!(metric(&resumed, "first_gridlock_cycle"), json!(found));
}

#[test]
fn robots_with_tasks_that_get_on_are_in_no_gridlock() {
    let open = ERRANDS.replace("\"............\"", "\"\"\"\n............\n............\n\"\"\"");
    let mut run = run(&open);
    run.advance(3_000);
    assert_eq!(metric(&run, "gridlocks"), json!(0));
    assert!(
        metric(&run, "tasks_finished").as_u64() > Some(100),
        "{}",
        metric(&run, "tasks_finished")
    );
}

/// Two robots that block each other, and two others that go on with the same tasks on a floor of their own.
const HALF_JAMMED: &str = "[map]\nascii = \"\"\"\n............\n############\n............\n............\n\"\"\"\n\
    [[robots]]\nat = [[2, 3, 0], [9, 3, 2]]\nplanner = { method = \"pibt\" }\n\
    tasks = { list = [[[11, 3], [0, 3]]], policy = \"fifo\", reveal = 1.0 }\n\
    [[robots]]\nat = [[2, 0, 0], [9, 1, 2]]\nplanner = { method = \"pibt\" }\n\
    tasks = { list = [[[11, 0]], [[0, 1]]], policy = \"nearest\", reveal = 2.0 }\n";

#[test]
fn robots_with_tasks_that_others_finish_meanwhile_are_in_a_gridlock_all_the_same() {
    let mut run = run(HALF_JAMMED);
    run.advance(1_000);
    assert!(metric(&run, "tasks_finished").as_u64() > Some(100));
    assert_eq!(metric(&run, "gridlocks"), json!(1));
    assert_eq!(metric(&run, "robots_in_gridlock"), json!(2));
}

#[test]
fn a_full_hall_in_which_tasks_are_finished_has_no_gridlock() {
    let text = "conflict_policy = \"simultaneous\"\n[map]\nascii = \"\"\"\n........\n........\n........\n\
        ........\n........\n........\n\"\"\"\n[[robots]]\ncount = 24\nplanner = { method = \"pibt\" }\n\
        tasks = { list = [[[0, 0], [7, 5]], [[7, 0]], [[0, 5], [3, 2]]], reveal = 1.5 }\n";
    let mut run = run(text);
    run.advance(4_000);
    assert!(
        metric(&run, "tasks_finished").as_u64() > Some(100),
        "{}",
        metric(&run, "tasks_finished")
    );
    assert_eq!(metric(&run, "gridlocks"), json!(0));
}

#[test]
fn a_run_that_should_end_by_a_gridlock_of_robots_that_are_not_watched_is_a_warning() {
    let rows = format!("{}\n", ".".repeat(130)).repeat(130);
    let text = format!(
        "format = 1\nworld = \"robots\"\nstop.gridlock = true\nmap.ascii = \"\"\"\n{rows}\"\"\"\n[robots]\ncount = 2\n\
         planner = {{ method = \"pibt\" }}\ntasks = {{ list = [[[3, 3]]] }}\n"
    );
    let source = Source::new("s", &text, "");
    let compiled = Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial);
    let remarks = compiled.expect("it compiles").remarks;
    let told: Vec<String> = remarks.iter().map(|remark| format!("{remark:?}")).collect();
    assert!(told.iter().any(|words| words.contains("does not end by gridlocks")), "{told:?}");
}
