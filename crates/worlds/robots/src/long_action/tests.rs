//! An action of k cycles holds the boxes that it leaves until it ends, and goes on over checkpoints, workers and slots.

use crate::exact::single_robot;
use crate::scenario::{Behaviours, Compiled, StorageOrder};
use crate::test_runs::run_in_order;
use crate::{RobotsRun, kinds};
use sidestep_kernel::Simulation;
use sidestep_kernel::view::{BodyId, FactValue};
use sidestep_scenario::Source;

fn compiled(text: &str, order: StorageOrder) -> (Source, Compiled) {
    let source = Source::new("test", text, "");
    let compiled = Compiled::new(&source, &Behaviours::new(), order);
    let compiled = compiled.unwrap_or_else(|e| panic!("{e}"));
    (source, compiled)
}

fn run(text: &str) -> RobotsRun {
    run_in_order(text, 1, StorageOrder::Spatial)
}

fn advance_audited(run: &mut RobotsRun) {
    run.advance(1);
    run.world().audit(run.state()).unwrap_or_else(|e| panic!("cycle {}: {e}", run.cycle()));
}

fn cols(run: &RobotsRun) -> Vec<u32> {
    run.snapshot().bodies.iter().map(|body| body.at.0).collect()
}

/// Robots in a corridor that go forward again and again, three cycles for each box.
fn queue(places: &str, policy: &str, more: &str) -> String {
    format!(
        "format = 1\nworld = \"robots\"\nconflict_policy = \"{policy}\"\n[map]\nascii = \"........\"\n\
         [robots]\nat = {places}\naction_cycles = 3\n\
         behaviour = {{ kind = \"replay\", actions = [\"forward\"], repeat = true }}\n{more}"
    )
}

#[test]
fn nobody_enters_a_box_that_is_being_left_before_the_action_ends() {
    for policy in ["fixed", "random", "rounds", "simultaneous"] {
        let mut run = run(&queue("[[0, 0, 0], [1, 0, 0]]", policy, ""));
        for expected in [[0, 2], [0, 2], [0, 2], [1, 3], [1, 3], [1, 3], [2, 4]] {
            advance_audited(&mut run);
            assert_eq!(cols(&run), expected, "{policy}, cycle {}", run.cycle());
        }
        // The one behind ran into the one ahead once; both began three actions.
        let total = run.metrics().total;
        assert_eq!((total.contacts, total.actions), (1, 6), "{policy}");
    }
}

#[test]
fn a_robot_that_is_followed_too_closely_cannot_be_passed_through() {
    let ring = "format = 1\nworld = \"robots\"\nconflict_policy = \"simultaneous\"\n[map]\nascii = \"\"\"\n..\n..\n\"\"\"\n\
                [robots]\nat = [[0, 0, 0], [1, 0, 1], [1, 1, 2], [0, 1, 3]]\naction_cycles = 2\n\
                behaviour = { kind = \"replay\", actions = [\"forward\"], repeat = true }\n";
    let mut held = run(ring);
    let mut free = run(&ring.replace("action_cycles = 2\n", ""));
    let before = held.snapshot();
    advance_audited(&mut held);
    advance_audited(&mut free);
    let places = |bodies: &[crate::state::BodyRecord]| -> Vec<_> {
        bodies.iter().map(|body| body.at).collect()
    };
    assert_eq!(places(&held.snapshot().bodies), places(&before.bodies));
    assert_ne!(places(&free.snapshot().bodies), places(&before.bodies), "rings rotate otherwise");
    assert_eq!(held.metrics().total.contacts, 4);
}

const LATE: &str = "effector = \"w\"\n[effectors.w]\nforward = [{ p = 1.0, path = \"F\" }]\n\
                    [effectors.w.delays]\np = 1.0\nmin = 2\nmax = 2\n";

#[test]
fn a_delay_prolongs_the_action_in_progress_by_its_cycles() {
    // By action: two cycles of delay, then three of the action.
    let mut run_by_action = run(&queue("[[0, 0, 0]]", "random", LATE));
    for expected in [0, 0, 1, 1, 1, 1, 1, 2] {
        advance_audited(&mut run_by_action);
        assert_eq!(cols(&run_by_action), [expected], "cycle {}", run_by_action.cycle());
    }
    // In every cycle that is not delayed one may start: the first action never ends.
    let always =
        LATE.replace("min", "per = \"cycle\"\nmin").replace("p = 1.0\nper", "p = 0.5\nper");
    let mut run_by_cycle = run(&queue("[[0, 0, 0]]", "random", &always));
    for _ in 0..200 {
        advance_audited(&mut run_by_cycle);
    }
    let total = run_by_cycle.metrics().total;
    assert!(total.delayed_cycles > 0, "{total:?}");
    let left = u64::from(run_by_cycle.state().action_progress.left(0));
    let busy = u64::from(run_by_cycle.state().action_progress.busy(0));
    let before = total.delayed_cycles + total.actions + busy;
    assert!(before > 200, "some delays fell into actions");
    // Each action had three cycles without delay, but the last one, of which some are left.
    let missed = u64::from(run_by_cycle.state().delays.missed(0));
    assert_eq!(200 - total.delayed_cycles, 3 * total.actions - left);
    assert_eq!(total.actions + busy + missed, 200);
}

/// Bodies of several sizes and periods, in two rooms with a door, led and not, with steps to the side and delays.
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
...........#...........
"""
[[robots]]
count = 8
action_cycles = 3
effector = "w"
behaviour = { kind = "shuttle", a = [0, 0, 4, 5], b = [19, 0, 4, 5] }
planner = { method = "pibt" }
[[robots]]
count = 2
size = 2
action_cycles = 2
effector = "w"
sensors = ["sonar-8"]
[[robots]]
count = 2
period = 2
sensors = ["sonar-8"]
[people]
count = 1
[doors]
at = [[11, 3]]
random = { p_open = 0.3, p_close = 0.02 }
[effectors.w]
forward = [{ p = 0.9, path = "F" }, { p = 0.04, path = "FF" }, { p = 0.04, path = "FL" }, { p = 0.02 }]
left = [{ p = 0.95, turn = 90 }, { p = 0.05 }]
right = [{ p = 0.95, turn = -90 }, { p = 0.05 }]
[effectors.w.delays]
p = 0.05
per = "cycle"
min = 1
max = 4
"#;

fn rooms(policy: &str) -> String {
    format!("conflict_policy = \"{policy}\"\n{ROOMS}")
}

#[test]
fn actions_of_several_cycles_are_the_same_bits_on_any_number_of_workers_and_in_any_storage() {
    for policy in ["random", "simultaneous", "rounds"] {
        let mut one = run(&rooms(policy));
        (0..400).for_each(|_| advance_audited(&mut one));
        for workers in [2, 3, 8] {
            let mut many = run_in_order(&rooms(policy), workers, StorageOrder::Spatial);
            many.advance(400);
            assert_eq!(many.digest(), one.digest(), "{policy}, {workers} workers");
        }
        let mut shuffled = run_in_order(&rooms(policy), 2, StorageOrder::Shuffled(3));
        shuffled.advance(400);
        assert_eq!(shuffled.digest(), one.digest(), "{policy}");
    }
}

#[test]
fn a_run_that_is_resumed_within_an_action_goes_on_with_the_same_bits() {
    let mut whole = run(&rooms("simultaneous"));
    whole.advance(300);
    for at in [1, 2, 3, 64, 65, 137] {
        let mut first = run(&rooms("simultaneous"));
        first.advance(at);
        let saved = first.checkpoint();
        let mut resumed = run_in_order(&rooms("simultaneous"), 2, StorageOrder::Spatial);
        resumed.restore(&saved).expect("the same scenario");
        resumed.world().audit(resumed.state()).unwrap_or_else(|e| panic!("resumed at {at}: {e}"));
        assert_eq!(resumed.digest(), first.digest(), "resumed at {at}");
        resumed.advance(300 - at);
        assert_eq!(resumed.digest(), whole.digest(), "resumed at {at}");
        assert_eq!(resumed.metrics().total, whole.metrics().total);
    }
}

#[test]
fn looking_at_a_run_changes_nothing_and_says_how_long_an_action_goes_on() {
    let mut watched = run(&rooms("random"));
    let mut unwatched = run(&rooms("random"));
    let mut told_left = 0;
    for _ in 0..60 {
        let told = watched.inspect(BodyId::new(kinds::ROBOT, 3, None)).expect("it is there");
        let left = watched.state().action_progress.left(3);
        let words = FactValue::number(f64::from(left), "cycles");
        assert_eq!(told.fact_value("Now", "action goes on for"), Some(&words));
        told_left += left;
        watched.advance(1);
        unwatched.advance(1);
        assert_eq!(watched.digest(), unwatched.digest());
    }
    assert!(told_left > 0);
}

#[test]
fn what_is_left_of_an_action_is_part_of_the_state() {
    let [short, long] = [3, 4].map(|cycles| {
        let text = queue("[[0, 0, 0]]", "random", "")
            .replace("action_cycles = 3", &format!("action_cycles = {cycles}"));
        let mut run = run(&text);
        run.advance(2);
        run
    });
    assert_eq!(cols(&short), cols(&long));
    assert_ne!(short.digest(), long.digest());
}

/// A floor on which a team of robots has to make way for each other, and no wheels slip.
fn reliable_team(more: &str) -> String {
    format!(
        "format = 1\nworld = \"robots\"\nregime = \"reliable\"\n[map]\nascii = \"\"\"\n\
         ....................\n..###..######..###..\n....................\n....................\n\"\"\"\n\
         [[robots]]\ncount = 16\nbehaviour = {{ kind = \"shuttle\", a = [0, 0, 2, 4], b = [18, 0, 2, 4] }}\n\
         planner = {{ method = \"pibt\" }}\n{more}"
    )
}

#[test]
fn a_team_whose_actions_take_several_cycles_arrives_and_touches_nothing() {
    for policy in ["random", "simultaneous"] {
        let text =
            format!("conflict_policy = \"{policy}\"\n{}", reliable_team("action_cycles = 4\n"));
        let mut led = run(&text);
        led.advance(4000);
        let total = led.metrics().total;
        assert_eq!([total.off_plan, total.contacts], [0, 0], "{policy}");
        assert!(total.trips > 150, "{policy}: {}", total.trips);
    }
}

#[test]
fn an_exact_chain_refuses_actions_of_several_cycles_by_name() {
    let single = |text: &str| single_robot(&compiled(text, StorageOrder::ById).1).map(|_| ());
    let text = queue("[[0, 0, 0]]", "random", "");
    let error = single(&text).expect_err("its actions take three cycles");
    assert!(error.cause().contains("actions take 3 cycles"), "{error}");
    assert!(error.remedy().contains("period = 3"), "{error}");
    single(&text.replace("action_cycles", "period")).expect("the remedy works");
}

#[test]
fn a_period_beside_actions_of_several_cycles_is_refused() {
    let text = queue("[[0, 0, 0]]", "random", "period = 2\n");
    let source = Source::new("test", &text, "");
    let error = Compiled::new(&source, &Behaviours::new(), StorageOrder::ById).expect_err("both");
    assert!(error.cause().contains("action_cycles = 3 beside a period of 2"), "{error}");
    assert!(error.remedy().contains("leave out `period`"), "{error}");
    assert_eq!(error.line_and_column().map(|at| at.0), Some(8), "{error}");
}
