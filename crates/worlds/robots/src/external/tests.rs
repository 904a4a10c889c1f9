use crate::{RobotsRun, robots_run};
use sidestep_kernel::control::{AgentTeam, BufferMut, MultiAgentOrder, OrderLog};
use sidestep_kernel::ports::{MemoryRecorder, Recorder};
use sidestep_kernel::{Cycle, EntityId, Simulation};
use sidestep_scenario::Source;
use std::collections::BTreeMap;

/// Six robots under orders, one of them slow, two that decide for themselves, and a door: sensors lie,
/// wheels slip, the radio loses words.
const MIXED: &str = r#"
format = 1
world = "robots"
seed = 7
cycles = 60
[map]
ascii = """
..........
..........
....##....
..........
..........
"""
[radio]
range_m = 100
loss = 0.2
[record]
calibration = true
[[robots]]
count = 5
sensors = ["sonar-8"]
effector = "nomad"
behaviour.kind = "external"
[[robots]]
count = 1
period = 3
behaviour.kind = "external"
[[robots]]
count = 2
sensors = ["sonar-8"]
[[doors]]
at = [[9, 0]]
random = { p_open = 0.1, p_close = 0.1 }
"#;

fn source(text: &str) -> Source {
    Source::new("s.toml", text, "")
}

fn run(workers: usize) -> RobotsRun {
    robots_run(&source(MIXED), workers).expect("it compiles")
}

/// Observations of a team: one vector per space.
fn observed(run: &dyn Simulation, team: usize) -> BTreeMap<String, Vec<i64>> {
    let AgentTeam { agents, observation_spaces: observed, .. } = &run.agent_teams()[team];
    let mut rooms: Vec<_> =
        observed.iter().map(|s| vec![0; s.value_count() * agents.len()]).collect();
    let mut room: Vec<_> = rooms.iter_mut().map(|room| BufferMut::Integer(room)).collect();
    run.observe(team, &mut room).expect("the room fits");
    observed.iter().map(|space| space.name.clone()).zip(rooms).collect()
}

/// A policy that depends on its observations: ahead unless something is reported there.
fn decide(run: &dyn Simulation, team: usize) -> Vec<f64> {
    let seen = observed(run, team);
    let n = run.agent_teams()[team].agents.len();
    let beams = seen.get("sonar-8_report").map_or(0, |reports| reports.len() / n);
    let action = |k: usize| {
        let is_blocked = beams > 0 && seen["sonar-8_report"][k * beams] != 0;
        if is_blocked || seen["contact"][k] != 0 { 1.0 } else { 0.0 }
    };
    (0..n).map(action).collect()
}

/// Decides for all that take orders, for `cycles` cycles.
fn decided(run: &mut RobotsRun, cycles: u64) {
    for _ in 0..cycles {
        let teams: Vec<AgentTeam> = run.agent_teams().to_vec();
        for (k, team) in teams.iter().enumerate().filter(|(_, team)| !team.action_spaces.is_empty())
        {
            let values = decide(run, k);
            let agents = &team.agents;
            run.order(&MultiAgentOrder { order: "action", agents, values: &values })
                .expect("right");
            let word = run.cycle() as f64 + 10.0;
            let said =
                MultiAgentOrder { order: "broadcast", agents: &agents[..1], values: &[word] };
            run.order(&said).expect("right");
        }
        run.advance(1);
    }
}

/// The book of all orders that were recorded.
fn book(recorder: &MemoryRecorder) -> OrderLog {
    OrderLog::from_recorder(recorder).expect("orders are recorded")
}

fn recorded(run: &mut RobotsRun, until: Cycle, go_on: impl Fn(&mut RobotsRun)) -> MemoryRecorder {
    run.start_recording();
    let mut recorder = MemoryRecorder::new(&run.schemas());
    while run.cycle() < until {
        go_on(run);
        run.record(&mut recorder).expect("memory suffices");
    }
    recorder.finish().expect("memory suffices");
    recorder
}

#[test]
fn a_run_is_the_same_from_its_recorded_orders_whatever_the_workers_and_wherever_it_is_resumed() {
    let mut first = run(1);
    let rows = recorded(&mut first, 60, |run| decided(run, 7.min(60 - run.cycle())));
    assert!(rows.row_count("orders") > 300, "{}", rows.row_count("orders"));
    for workers in [1, 2, 3, 8] {
        let mut again = run(workers);
        again.replay_orders(book(&rows)).expect("they were obeyed once");
        let its = recorded(&mut again, 60, |run| {
            run.advance(60 - run.cycle());
        });
        assert_eq!(again.digest(), first.digest(), "{workers} workers");
        assert_eq!(book(&its), book(&rows), "{workers} workers");
    }
    for at in 0..60 {
        let mut before = run(1);
        decided(&mut before, at);
        // An order that was given before the checkpoint is in it.
        before
            .order(&MultiAgentOrder { order: "trip", agents: &[5], values: &[1.0] })
            .expect("right");
        let checkpoint = before.checkpoint();
        decided(&mut before, 60 - at);
        let mut after = run(2);
        after.restore(&checkpoint).expect("the same scenario");
        decided(&mut after, 60 - at);
        assert_eq!(after.digest(), before.digest(), "resumed at {at}");
    }
}

#[test]
fn going_back_gives_the_same_orders_again() {
    let mut first = run(1);
    let rows = recorded(&mut first, 60, |run| decided(run, 60));
    let mut again = run(1);
    again.replay_orders(book(&rows)).expect("they were obeyed once");
    again.advance(20);
    let checkpoint = again.checkpoint();
    for _ in 0..3 {
        again.restore(&checkpoint).expect("its own");
        again.advance(40);
        assert_eq!(again.digest(), first.digest());
    }
}

#[test]
fn what_is_observed_is_what_the_robot_would_perceive_in_the_cycle() {
    let mut seen = Vec::new();
    let mut run = run(1);
    run.start_recording();
    let mut recorder = MemoryRecorder::new(&run.schemas());
    for now in 0..60 {
        for team in [0, 2] {
            let agents = run.agent_teams()[team].agents.clone();
            let all = observed(&run, team);
            let beams = all["sonar-8_report"].len() / agents.len();
            for (k, &agent) in agents.iter().enumerate() {
                let names = |space: &str, k: usize| all[space][k];
                for beam in k * beams..(k + 1) * beams {
                    let report = names("sonar-8_report", beam) as usize;
                    let class = names("sonar-8_class", beam) as usize;
                    seen.push((now, agent, report, class));
                }
            }
        }
        decided(&mut run, 1);
        run.record(&mut recorder).expect("memory suffices");
    }
    seen.sort_by_key(|&(now, agent, ..)| (now, agent));
    let schema = run.schemas().into_iter().find(|schema| schema.name == "readings").expect("kept");
    let team = &run.agent_teams()[0].observation_spaces;
    let names = |space: usize, number: usize| match &team[space].kind {
        sidestep_kernel::control::ValueDomain::Discrete(names) => names[number].clone(),
        _ => panic!("a choice"),
    };
    let column = |name: &str| {
        let at = schema.columns.iter().position(|column| column.name == name).expect("a column");
        let values = recorder.column("readings", name).expect("a column");
        (0..seen.len()).map(|row| schema.columns[at].text(values, row)).collect::<Vec<_>>()
    };
    let reports: Vec<_> = seen.iter().map(|&(.., report, _)| names(0, report)).collect();
    let classes: Vec<_> = seen.iter().map(|&(.., class)| names(1, class)).collect();
    assert_eq!(recorder.row_count("readings"), seen.len());
    assert_eq!(column("reported"), reports);
    assert_eq!(column("reported_class"), classes);
}

#[test]
fn readings_that_nobody_records_change_nothing_when_they_are_left_out() {
    let with = |calibration: bool| {
        let text = MIXED.replace("calibration = true", &format!("calibration = {calibration}"));
        let mut run = robots_run(&source(&text), 1).expect("it compiles");
        run.start_recording();
        decided(&mut run, 50);
        run.digest()
    };
    assert_eq!(with(true), with(false));
}

#[test]
fn an_order_stands_until_the_slow_robot_has_its_turn_and_the_last_one_counts() {
    let text = "format = 1\nworld = \"robots\"\nmap.ascii = \".....\"\n[[robots]]\n\
                at = [[0, 0, 0]]\nperiod = 3\nphase = 0\nbehaviour.kind = \"external\"\n";
    let mut run = robots_run(&source(text), 1).expect("it compiles");
    let place = |run: &RobotsRun| observed(run, 0)["at_boxes"][0];
    run.advance(1);
    for action in [1.0, 0.0] {
        run.order(&MultiAgentOrder { order: "action", agents: &[0], values: &[action] })
            .expect("right");
    }
    let places: Vec<_> = (0..6)
        .map(|_| {
            run.advance(1);
            place(&run)
        })
        .collect();
    assert_eq!(places, [0, 0, 1, 1, 1, 1]);
}

#[test]
fn words_are_heard_by_those_in_range_and_observed_in_the_order_of_senders() {
    let mut run = run(1);
    let mut heard = BTreeMap::new();
    for _ in 0..60 {
        let all = observed(&run, 1);
        for (from, word) in all["heard_from"].iter().zip(&all["heard_word"]) {
            if *from >= 0 {
                heard.insert((run.cycle(), *from), *word);
            }
        }
        assert!(all["heard_from"].iter().filter(|id| **id >= 0).is_sorted());
        decided(&mut run, 1);
    }
    // Robot 0 says the cycle plus 10, each word one cycle before it is heard, and a fifth gets lost.
    let of_first: Vec<_> = heard.iter().filter(|((_, from), _)| *from == 0).collect();
    assert!((30..59).contains(&of_first.len()), "{}", of_first.len());
    assert!(of_first.iter().all(|((now, _), word)| **word == *now as i64 + 9), "{of_first:?}");
}

/// Refusals, and a part of the message that gives the remedy.
#[test]
fn what_cannot_be_obeyed_is_refused_and_nothing_of_it_noted() {
    let mut run = run(1);
    let before = run.digest();
    let last = run.world().bodies.len() as EntityId - 1;
    let refused: [(MultiAgentOrder<'_>, &str); 9] = [
        (
            MultiAgentOrder { order: "action", agents: &[99], values: &[0.0] },
            "there is no robot 99",
        ),
        (
            MultiAgentOrder { order: "action", agents: &[last], values: &[0.0] },
            "there is no robot 8",
        ),
        (
            MultiAgentOrder { order: "action", agents: &[6], values: &[0.0] },
            "robot 6 decides for itself",
        ),
        (
            MultiAgentOrder { order: "jump", agents: &[0], values: &[0.0] },
            "it takes action, trip, broadcast",
        ),
        (
            MultiAgentOrder { order: "action", agents: &[0, 1], values: &[0.0] },
            "needs 2 x 1 values, not 1",
        ),
        (
            MultiAgentOrder { order: "action", agents: &[0, 1], values: &[0.0, 99.0] },
            "one of 0 forward",
        ),
        (
            MultiAgentOrder { order: "action", agents: &[0], values: &[f64::NAN] },
            "is NaN; it must be one of",
        ),
        (
            MultiAgentOrder { order: "broadcast", agents: &[0], values: &[-1.0] },
            "a whole number from 0",
        ),
        (MultiAgentOrder { order: "action", agents: &[], values: &[1.0] }, "needs 0 values, not 1"),
    ];
    for (orders, words) in refused {
        let error = run.order(&orders).expect_err(words).to_string();
        assert!(error.contains(words), "{error}");
        assert_eq!(run.digest(), before, "{error}");
    }
    let mut book = OrderLog::default();
    book.add(3, &MultiAgentOrder { order: "action", agents: &[0], values: &[77.0] });
    let error = run.replay_orders(book).expect_err("out of bounds").to_string();
    assert!(error.contains("is 77"), "{error}");
    let mut short = [0; 3];
    let error = run.observe(0, &mut [BufferMut::Integer(&mut short)]).expect_err("too short");
    assert!(error.to_string().contains("sonar-8_report of 5 x"), "{error}");
    assert!(run.observe(7, &mut []).is_err());
}

/// Two robots that carry tasks out, and two that go to and fro, led from outside; some are late, and wheels slip.
const LED: &str = r#"
format = 1
world = "robots"
seed = 3
cycles = 300
conflict_policy = "simultaneous"
map.ascii = """
............
............
............
............
"""
[[robots]]
at = [[0, 0, 0], [0, 1, 0]]
action_cycles = 2
planner = { method = "external" }
tasks = { list = [[[5, 0], [1, 1]], [[7, 1], [2, 0]]] }
[[robots]]
at = [[0, 3, 0], [11, 2, 0]]
effector = "late"
behaviour = { kind = "shuttle", a = [0, 2, 1, 2], b = [11, 2, 1, 2] }
planner = { method = "external" }
[effectors.late]
forward = [{ p = 0.9, path = "F" }, { p = 0.1 }]
[effectors.late.delays]
p = 0.05
min = 1
max = 5
"#;

/// Orders each robot to turn to its goal, along the row first, and to go there.
fn led(run: &mut RobotsRun, cycles: u64) {
    for _ in 0..cycles {
        for team in 0..run.agent_teams().len() {
            let all = observed(run, team);
            let agents = run.agent_teams()[team].agents.clone();
            let action = |k: usize| {
                let [east, north] =
                    [2 * k, 2 * k + 1].map(|n| all["goal_boxes"][n] - all["at_boxes"][n]);
                let toward = match (east.signum(), north.signum()) {
                    (1, _) => 0,
                    (-1, _) => 2,
                    (_, 1) => 1,
                    (_, -1) => 3,
                    _ => return 3.0,
                };
                match (toward - all["heading"][k]).rem_euclid(4) {
                    0 => 0.0,
                    3 => 2.0,
                    _ => 1.0,
                }
            };
            let values: Vec<f64> = (0..agents.len()).map(action).collect();
            let order = MultiAgentOrder { order: "action", agents: &agents, values: &values };
            run.order(&order).expect("right");
        }
        run.advance(1);
    }
}

#[test]
fn a_team_that_is_led_from_outside_is_told_its_goals_and_stands_still_without_orders() {
    let mut run = robots_run(&source(LED), 1).expect("it compiles");
    run.advance(50);
    assert_eq!(run.metrics().total.distance_m, 0.0);
    assert_eq!(observed(&run, 0)["goal_boxes"], [5, 0, 7, 1]);
    assert_eq!(observed(&run, 1)["goal_boxes"], [11, 3, 0, 2]);
    led(&mut run, 250);
    let metrics = run.metrics();
    assert!(metrics.tasks_finished >= 10, "{metrics:?}");
    assert!(metrics.total.trips >= 25, "{metrics:?}");
    assert!(metrics.total.off_plan > 0, "{metrics:?}");
}

#[test]
fn a_run_that_is_led_from_outside_is_the_same_from_its_orders_and_when_it_is_resumed() {
    let run = |workers: usize| robots_run(&source(LED), workers).expect("it compiles");
    let mut first = run(1);
    let rows = recorded(&mut first, 200, |run| led(run, 9.min(200 - run.cycle())));
    for workers in [1, 2, 3] {
        let mut again = run(workers);
        again.replay_orders(book(&rows)).expect("they were obeyed once");
        again.advance(200);
        assert_eq!(again.digest(), first.digest(), "{workers} workers");
    }
    for at in [0, 1, 7, 50, 123] {
        let mut before = run(1);
        led(&mut before, at);
        let checkpoint = before.checkpoint();
        let mut after = run(2);
        after.restore(&checkpoint).expect("the same scenario");
        led(&mut after, 200 - at);
        assert_eq!(after.digest(), first.digest(), "resumed at {at}");
    }
}

#[test]
fn a_robot_that_is_late_or_in_an_action_is_where_its_planner_outside_knows_it_to_be() {
    let text = LED.replace("effector = \"late\"", "effector = \"punctual\"")
        + "[effectors.punctual]\nforward = [{ p = 1.0, path = \"F\" }]\n";
    let mut run = robots_run(&source(&text), 1).expect("it compiles");
    led(&mut run, 100);
    assert!(run.metrics().total.distance_m > 0.0);
    assert_eq!(run.metrics().total.off_plan, 0, "no wheel slips, and nobody meets another");
}

/// Orders the robots of each team in turn to go to their goals by a plan, along the row first, whenever no plan is left.
fn led_by_plans(run: &mut RobotsRun, cycles: u64) {
    for _ in 0..cycles {
        for team in 0..run.agent_teams().len() {
            let all = observed(run, team);
            let agents = run.agent_teams()[team].agents.clone();
            if all["plan_left"].iter().any(|&left| left > 0) {
                continue;
            }
            let k = (run.cycle() / 3) as usize % agents.len();
            let way = [2 * k, 2 * k + 1].map(|n| all["goal_boxes"][n] - all["at_boxes"][n]);
            let mut heading = all["heading"][k];
            let mut plan = Vec::new();
            for (axis, boxes) in way.into_iter().enumerate().filter(|&(_, boxes)| boxes != 0) {
                let toward = axis as i64 + if boxes < 0 { 2 } else { 0 };
                let turns = (toward - heading).rem_euclid(4);
                plan.extend(match turns {
                    3 => vec![2.0],
                    turns => vec![1.0; turns as usize],
                });
                heading = toward;
                plan.extend(vec![0.0; boxes.unsigned_abs() as usize]);
            }
            plan.resize(12, 3.0);
            let order = MultiAgentOrder { order: "plan", agents: &agents[k..=k], values: &plan };
            run.order(&order).expect("right");
        }
        run.advance(1);
    }
}

#[test]
fn plans_from_outside_are_carried_out_by_the_executor_and_replayed_and_resumed_to_the_bit() {
    let text = LED.replace("\"external\"", "\"external\", executor = \"adg\", window = 12");
    let run = |workers: usize| robots_run(&source(&text), workers).expect("it compiles");
    let mut first = run(1);
    let rows = recorded(&mut first, 300, |run| led_by_plans(run, 9.min(300 - run.cycle())));
    let metrics = first.metrics();
    assert!(metrics.tasks_finished > 0 && metrics.total.trips > 2, "{metrics:?}");
    // Plans through a robot that stands are failures, and others are not.
    assert!(metrics.plan_failures > 0, "{metrics:?}");
    assert!(metrics.plans > metrics.plan_failures + 10, "{metrics:?}");
    let mut again = run(3);
    again.replay_orders(book(&rows)).expect("they were obeyed once");
    again.advance(300);
    assert_eq!(again.digest(), first.digest());
    for at in [0, 1, 7, 50, 123] {
        let mut before = run(1);
        led_by_plans(&mut before, at);
        let mut after = run(2);
        after.restore(&before.checkpoint()).expect("the same scenario");
        led_by_plans(&mut after, 300 - at);
        assert_eq!(after.digest(), first.digest(), "resumed at {at}");
    }
}

#[test]
fn an_order_of_a_plan_stands_over_a_checkpoint() {
    let text = LED
        .replace("\"external\"", "\"external\", executor = \"blind\", window = 3")
        .replace("action_cycles = 2\n", "");
    let run = || robots_run(&source(&text), 1).expect("it compiles");
    let mut whole = run();
    let order = MultiAgentOrder { order: "plan", agents: &[0], values: &[0.0, 0.0, 3.0] };
    whole.order(&order).expect("right");
    let mut resumed = run();
    resumed.restore(&whole.checkpoint()).expect("the same scenario");
    for run in [&mut whole, &mut resumed] {
        run.advance(2);
        assert_eq!(observed(run, 0)["at_boxes"][..2], [2, 0]);
    }
    assert_eq!(resumed.digest(), whole.digest());
}

#[test]
fn a_planner_outside_whose_robots_report_sees_them_where_they_should_be() {
    let text =
        LED.replace("\"external\"", "\"external\", places = \"believed\", report_every = 1000");
    let mut run = robots_run(&source(&text), 1).expect("it compiles");
    // One order more than there are boxes as far as the border of the map.
    let order = |run: &mut RobotsRun, action: f64| {
        let order = MultiAgentOrder { order: "action", agents: &[2], values: &[action] };
        run.order(&order).expect("right");
        run.advance(1);
    };
    for _ in 0..12 {
        order(&mut run, 0.0);
    }
    let believed = observed(&run, 1)["at_boxes"][0];
    let is = run.world().map_position(run.state().body(2).position()).0;
    assert!(is < 11, "it slipped and was late");
    assert_eq!(believed, 11, "at the border, where its orders have led it");
}

#[test]
fn an_order_to_a_robot_that_reports_is_believed_to_be_carried_out_once_though_it_is_late() {
    let text = LED
        .replace("\"external\"", "\"external\", places = \"believed\", report_every = 1000")
        .replace("p = 0.05\nmin = 1\nmax = 5", "p = 1.0\nmin = 9\nmax = 9");
    let mut run = robots_run(&source(&text), 1).expect("it compiles");
    let order = MultiAgentOrder { order: "action", agents: &[2], values: &[0.0] };
    run.order(&order).expect("right");
    // It stands in a checkpoint, because the robot has not got it yet.
    let mut resumed = robots_run(&source(&text), 1).expect("it compiles");
    resumed.restore(&run.checkpoint()).expect("the same scenario");
    for run in [&mut run, &mut resumed] {
        run.advance(6);
        assert_eq!(observed(run, 1)["at_boxes"][0], 1);
        assert_eq!(run.world().map_position(run.state().body(2).position()).0, 0, "it is late");
    }
}
