use crate::agents::{RobotAgent, RobotControl, RobotPercept};
use crate::decide::UNSEEN;
use crate::effector::FORWARD;
use crate::sensor::Reading;
use crate::{RobotsRun, robots_run};
use proptest::prelude::*;
use sidestep_kernel::control::{ControlLog, MultiAgentOrder};
use sidestep_kernel::ports::{MemoryRecorder, Recorder};
use sidestep_kernel::{Cycle, EntityId, Simulation};
use sidestep_scenario::Source;

/// Robots that lie, slip, talk, are late, and ask each other to make room, among people and doors.
const MIXED: &str = r#"
format = 1
world = "robots"
seed = 11
cycles = 120
[map]
ascii = """
..............
..............
....##...###..
....##........
..............
..........##..
..............
..............
"""
[radio]
range_m = 2
loss = 0.2
[effectors.late]
forward = [{ p = 0.9, path = "F" }, { p = 0.05, path = "FF" }, { p = 0.05 }]
left = [{ p = 0.95, turn = 90 }, { p = 0.05 }]
right = [{ p = 0.95, turn = -90 }, { p = 0.05 }]
delays = { p = 0.1, min = 1, max = 4 }
[[robots]]
count = 4
sensors = ["sonar-8"]
effector = "nomad"
behaviour = { kind = "announce", turn_every = 10 }
[[robots]]
count = 3
size = 2
sensors = ["sonar-ring", "bumper-4"]
effector = "late"
behaviour = { kind = "shuttle", a = [0, 0, 3, 8], b = [11, 0, 3, 8], avoidance = "plan" }
[[robots]]
count = 2
period = 3
sensors = ["bumper-4"]
behaviour = { kind = "random", weights = { forward = 3, left = 1 }, weights_after_contact = { left = 1, right = 2 } }
[[robots]]
count = 2
action_cycles = 2
sensors = ["sonar-8"]
behaviour = { kind = "goto", goals = [[0, 7], [13, 0]], repeat = true, avoidance = "filter" }
[people]
count = 3
period = 2
[[doors]]
at = [[7, 4]]
random = { p_open = 0.2, p_close = 0.2 }
"#;

/// A team that a planner leads, and whose robots are late.
fn led(planner: &str) -> String {
    format!(
        r#"
format = 1
world = "robots"
seed = 3
cycles = 120
conflict_policy = "simultaneous"
[map]
ascii = """
............
............
...##..##...
...##..##...
............
............
"""
[[robots]]
count = 6
effector = "wheels"
behaviour = {{ kind = "shuttle", a = [0, 0, 2, 6], b = [10, 0, 2, 6] }}
planner = {{ {planner} }}
[effectors.wheels]
forward = [{{ p = 0.95, path = "F" }}, {{ p = 0.05 }}]
left = [{{ p = 1.0, turn = 90 }}]
right = [{{ p = 1.0, turn = -90 }}]
delays = {{ p = 0.05, min = 1, max = 3 }}
"#
    )
}

fn run(text: &str) -> RobotsRun {
    robots_run(&Source::new("s.toml", text, ""), 1).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns the control that the program of its robot gives for each percept of the present cycle.
fn controls(run: &RobotsRun) -> Vec<(EntityId, Vec<u8>)> {
    let mut controls = Vec::new();
    for percept in run.world().percepts_in_cycle(run.state(), run.cycle()) {
        // Over the wire and back, as at a node.
        let bytes = postcard::to_stdvec(&percept).expect("plain data");
        let percept: RobotPercept = postcard::from_bytes(&bytes).expect("it was written");
        let agent = RobotAgent::new(run.world().clone(), percept.id).expect("a robot");
        let control = agent.decide(&percept).expect("a percept of the run");
        controls.push((percept.id, postcard::to_stdvec(&control).expect("plain data")));
    }
    controls
}

/// Advances a run whose robots decide outside of it.
fn advance_by_agents(run: &mut RobotsRun, cycles: Cycle) {
    for _ in 0..cycles {
        let controls = controls(run);
        run.submit_controls(&controls).expect("controls of this cycle");
        run.advance(1);
    }
}

fn assert_alike(text: &str, cycles: Cycle) {
    let mut inside = run(text);
    inside.advance(cycles);
    let mut outside = run(text);
    advance_by_agents(&mut outside, cycles);
    assert_eq!(inside.digest(), outside.digest(), "{text}");
    assert_eq!(inside.metrics().total, outside.metrics().total, "{text}");
    assert!(inside.metrics().total.distance_m > 20.0, "they do move: {text}");
}

#[test]
fn robots_that_decide_outside_of_a_run_leave_the_state_that_those_inside_leave() {
    assert_alike(MIXED, 120);
}

#[test]
fn robots_that_a_planner_leads_carry_out_its_orders_outside_of_the_run_alike() {
    for planner in [
        "method = \"pibt\"",
        "method = \"lacam\", executor = \"adg\", window = 8",
        "method = \"pibt\", places = \"believed\", report_every = 3, report_loss = 0.1",
    ] {
        assert_alike(&led(planner), 120);
    }
}

#[test]
fn a_robot_that_has_sent_nothing_stays_where_it_is_with_its_memory() {
    let mut run = run(MIXED);
    advance_by_agents(&mut run, 20);
    let robots = 0..run.world().robot_count() as EntityId;
    let rests = |id: EntityId| {
        // An action of several cycles goes on.
        let left = run.state().action_progress.left(id);
        left == 0
    };
    let standing: Vec<EntityId> = robots.filter(|&id| rests(id)).collect();
    let look = |run: &RobotsRun, id: EntityId| {
        let record = &run.snapshot().bodies[id as usize];
        // The request that it hears is written by the world.
        let [goal, avoidance, request, _] = record.memory;
        (record.at, record.facing, [goal, avoidance, request], record.voice)
    };
    let before: Vec<_> = standing.iter().map(|&id| look(&run, id)).collect();
    run.submit_controls(&[]).expect("nobody has sent anything");
    run.advance(1);
    let after: Vec<_> = standing.iter().map(|&id| look(&run, id)).collect();
    assert_eq!(before, after);
}

#[test]
fn percepts_change_nothing_and_are_the_same_when_they_are_asked_for_again() {
    let mut run = run(MIXED);
    run.advance(15);
    let digest = run.digest();
    let first = run.world().percepts_in_cycle(run.state(), run.cycle());
    let controls = controls(&run);
    run.submit_controls(&controls).expect("controls of this cycle");
    assert_eq!(first, run.world().percepts_in_cycle(run.state(), run.cycle()));
    assert_eq!(digest, run.digest());
    assert!(first.is_sorted_by(|a, b| a.id < b.id));
    assert!(first.iter().any(|percept| !percept.heard.is_empty()), "somebody hears somebody");
}

#[test]
fn recorded_controls_are_replayed_to_the_same_digest() {
    let text = format!("{MIXED}\n[record]\ncontrols = true\ncalibration = true\n");
    let mut flown = run(&text);
    flown.start_recording();
    let mut tables = MemoryRecorder::new(&flown.schemas());
    // Some robots are late in some cycles.
    for cycle in 0..60 {
        let mut controls = controls(&flown);
        controls.retain(|(id, _)| !(u64::from(*id) + cycle).is_multiple_of(5));
        flown.submit_controls(&controls).expect("controls of this cycle");
        flown.advance(1);
    }
    flown.record(&mut tables).expect("memory suffices");
    tables.finish().expect("memory suffices");
    let mut again = run(&text);
    again.replay_controls(ControlLog::from_recorder(&tables).expect("a table of controls"));
    again.advance(60);
    assert_eq!(flown.digest(), again.digest());
}

#[test]
fn controls_that_no_robot_can_carry_out_are_refused_as_a_whole_with_the_reason() {
    let mut run = run(&MIXED
        .replace("[radio]\nrange_m = 2\nloss = 0.2\n", "")
        .replace("{ kind = \"announce\", turn_every = 10 }", "{ kind = \"wander\" }"));
    let right = RobotControl {
        id: 0,
        cycle: 0,
        action: FORWARD,
        trip: None,
        broadcast: None,
        memory: [0; 4],
    };
    let bytes = |control: &RobotControl| postcard::to_stdvec(control).expect("plain data");
    let due = |run: &RobotsRun| run.world().percepts_in_cycle(run.state(), 0);
    let idle = (0..run.world().robot_count() as EntityId)
        .find(|id| due(&run).iter().all(|percept| percept.id != *id))
        .expect("one of the slow robots waits");
    let mut long = bytes(&right);
    long.push(0);
    let wrong = [
        (99, bytes(&right), "there is no such robot"),
        (12, bytes(&right), "there is no such robot"),
        (0, long, "no control of this build"),
        (1, bytes(&right), "it is of robot 0 and cycle 0; give that of robot 1 and cycle 0"),
        (0, bytes(&RobotControl { cycle: 1, ..right.clone() }), "give that of robot 0 and cycle 0"),
        (
            0,
            bytes(&RobotControl { action: 9, ..right.clone() }),
            "it tries action 9; give one of 0 to 3",
        ),
        (0, bytes(&RobotControl { broadcast: Some(1), ..right.clone() }), "add [radio]"),
        (
            idle,
            bytes(&RobotControl { id: idle, ..right.clone() }),
            "it does not decide in this cycle",
        ),
    ];
    for (id, bytes, reason) in wrong {
        let given = [(id, bytes)];
        let refused = run.submit_controls(&given).expect_err(reason).to_string();
        assert!(refused.contains(reason), "{refused}");
        let found = run.world().find_invalid_controls(run.state(), 0, &given);
        assert!(found.len() == 1 && found[0].1.contains(reason), "{found:?}");
    }
    let twice = [(0, bytes(&right)), (0, bytes(&right))];
    let refused = run.submit_controls(&twice).expect_err("two of one robot").to_string();
    assert!(refused.contains("there are two of it"), "{refused}");
}

#[test]
fn a_robot_under_orders_has_no_program_and_takes_its_orders_also_where_others_decide_outside() {
    let text = MIXED.replace(
        "{ kind = \"random\", weights = { forward = 3, left = 1 }, weights_after_contact = { left = 1, right = 2 } }",
        "{ kind = \"external\" }",
    );
    let ordered = |run: &mut RobotsRun| {
        let team = run.agent_teams().iter().position(|team| !team.action_spaces.is_empty());
        let team = team.expect("a team under orders");
        let agents = run.agent_teams()[team].agents.clone();
        let values = vec![f64::from(FORWARD); agents.len()];
        let order = MultiAgentOrder { order: "action", agents: &agents, values: &values };
        run.order(&order).expect("an order");
    };
    let mut inside = run(&text);
    let mut outside = run(&text);
    let first = outside.world().find_external_robot().expect("a robot under orders");
    assert!(RobotAgent::new(outside.world().clone(), first).is_none());
    for _ in 0..30 {
        ordered(&mut inside);
        inside.advance(1);
        ordered(&mut outside);
        advance_by_agents(&mut outside, 1);
    }
    assert_eq!(inside.digest(), outside.digest());
}

#[test]
fn a_percept_that_cannot_be_is_refused_with_the_reason() {
    let run = run(MIXED);
    let percepts = run.world().percepts_in_cycle(run.state(), 0);
    let agent = RobotAgent::new(run.world().clone(), 0).expect("a robot");
    let right = &percepts[0];
    assert_eq!(right.id, 0);
    let reading = |reading| {
        let mut readings = right.readings.clone();
        readings[0] = reading;
        RobotPercept { readings, ..right.clone() }
    };
    let wrong = [
        (percepts[1].clone(), "it is of robot 1"),
        (RobotPercept { readings: Vec::new(), ..right.clone() }, "it has 0 readings; give 8"),
        (reading(Reading { observation: 200, class: 0 }), "reports observation 200"),
        (reading(Reading { observation: 1, class: UNSEEN }), "in class 255"),
        (RobotPercept { at: (14, 0), ..right.clone() }, "column 14, row 0; the map has 14 x 8"),
        (RobotPercept { at: (u32::MAX, 0), ..right.clone() }, "the map has 14 x 8"),
        (RobotPercept { heading: 4, ..right.clone() }, "its heading is 4"),
    ];
    for (percept, reason) in wrong {
        let refused = agent.decide(&percept).expect_err(reason);
        assert!(refused.contains(reason), "{refused}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// A control may hold any memory: nothing that the world reads of it may end the run.
    #[test]
    fn no_memory_that_a_control_claims_does_harm(words: [u32; 4], actions in prop::collection::vec(0u8..4, 11)) {
        let mut run = run(MIXED);
        for _ in 0..3 {
            let cycle = run.cycle();
            let mut controls = Vec::new();
            for percept in run.world().percepts_in_cycle(run.state(), cycle) {
                let action = actions[percept.id as usize];
                let control = RobotControl { id: percept.id, cycle, action, trip: None, broadcast: None, memory: words };
                controls.push((percept.id, postcard::to_stdvec(&control).expect("plain data")));
            }
            run.submit_controls(&controls).expect("any memory may be");
            run.advance(1);
        }
        // And the behaviors go on from there.
        advance_by_agents(&mut run, 3);
        run.advance(3);
        prop_assert!(run.world().audit(run.state()).is_ok());
        let _ = run.metrics();
    }

    #[test]
    fn no_bytes_do_harm(id in 0u32..14, bytes: Vec<u8>) {
        let mut run = run(MIXED);
        let _ = run.submit_controls(&[(id, bytes)]);
        run.advance(1);
    }
}
