//! Whole scenarios, deployed as a team and as one process.

use crate::agents::{ChainCycleControls, ConnectorAgent};
use crate::scenario::ChainScenario;
use crate::{ChainRun, chain_run};
use serde_json::Value;
use sidestep_kernel::control::ControlLog;
use sidestep_kernel::network::NetworkAgent;
use sidestep_kernel::ports::{MemoryRecorder, Recorder};
use sidestep_kernel::view::FrameOptions;
use sidestep_kernel::{Digest, Simulation};
use sidestep_scenario::Source;

/// The part that is the same in all scenarios here.
fn text(deployment: &str, more: &str) -> String {
    format!(
        "format = 1\nworld = \"chain\"\nseed = 3\n[chain]\ndt_s = 0.05\nself_collision = false\n\
         backtracks = 0\nescape = \"off\"\ndeployment = \"{deployment}\"\n{more}"
    )
}

/// A chain of slack rods that is led through a field of discs, autonomously.
const FIELD: &str = "[[fields]]\nlo_m = [-1, -2]\nhi_m = [8, 2]\npart = 0.15\nradius_m = 0.25\n\
    [[chains]]\nconnectors = 12\nat_m = [-1.5, 0]\nrod_m = [0.3, 0.4]\nradius_m = 0.1\nmax_bend_deg = 80\n\
    [[chains.tasks]]\nkind = \"targets\"\ntargets_m = [[6, 0.5], [2, -1]]\npatience_s = 3\n";

/// A chain in a dead end, which its other end pulls back.
const DEAD_END: &str = "[[obstacles]]\nends_m = [[2, -0.3], [2, 0.3]]\n[[obstacles]]\nends_m = [[-1, -0.3], [2, -0.3]]\n\
    [[obstacles]]\nends_m = [[-1, 0.3], [2, 0.3]]\n\
    [[chains]]\nconnectors = 6\nat_m = [0, 0]\nrod_m = 0.3\nradius_m = 0.1\n\
    [[chains.tasks]]\nkind = \"targets\"\ntargets_m = [[4, 0]]\npatience_s = 8\n";

/// A chain of fixed rods on open ground, led by a connector in the middle, then pushed by its head.
const OPEN: &str = "[[chains]]\nconnectors = 9\nrod_m = 0.5\n\
    [[chains.tasks]]\nkind = \"script\"\nconnector = 4\nscript = \"forward 1 turn 70 forward 1\"\n\
    [[chains.tasks]]\nkind = \"script\"\nscript = \"turn 170 forward 1\"\n";

/// Two chains in each other's way, past a disc that moves, of which one gets a bend limit on the way.
const TWO: &str = "[[obstacles]]\nat_m = [2, -1]\nradius_m = 0.3\npatrol_m = [[2, -1], [2, 2]]\n\
    [[chains]]\nconnectors = 8\nat_m = [0, 0]\nrod_m = [0.3, 0.35]\ncount = 2\napart_m = [0.0, 0.5]\n\
    [[chains.tasks]]\nkind = \"wander\"\nwithin_m = [[-3, -3], [4, 3]]\npatience_s = 100\n\
    [[chains.changes]]\nat_s = 3.0\nconnector = 3\nmax_bend_deg = 60\n";

/// A snake in space among balls.
const SPACE: &str = "dimensions = 3\n[[fields]]\nlo_m = [-1, -2, -2]\nhi_m = [4, 2, 2]\npart = 0.1\nradius_m = 0.3\n\
    [[chains]]\nconnectors = 15\nat_m = [-1.5, 0, 0]\nalong = [-1, 0, 0]\nrod_m = [0.25, 0.3]\nradius_m = 0.05\n\
    [[chains.tasks]]\nkind = \"wander\"\nwithin_m = [[-2, -2, -2], [4, 2, 2]]\npatience_s = 100\n";

/// Robots on wheels that follow a navigator around a corner.
const WHEELS: &str = "[ground]\ncorridor = { width_m = 2.0, legs = [{ straight_m = 5 }, { radius_m = 2, turn_deg = 90 }, { straight_m = 4 }] }\n\
    [[chains]]\nconnectors = 5\nat_m = [3.4, 0]\nrod_m = [0.6, 0.8]\nrod_radius_m = 0.05\nrobots = { radius_m = 0.25 }\n\
    [[chains.tasks]]\nkind = \"navigate\"\nnavigator = { noise_m = 0.01 }\n";

fn run(text: &str) -> Box<dyn Simulation> {
    chain_run(&Source::new("s", text.to_string(), ""), 1).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn refused(text: &str, cause: &str) -> String {
    match chain_run(&Source::new("s", text.to_string(), ""), 1) {
        Ok(_) => panic!("is accepted, although {cause}: {text}"),
        Err(error) => error.to_string(),
    }
}

/// The end of a run: its digest, and its metrics without those of the network and of the clock.
fn end(text: &str, cycles: u64) -> (Digest, Value, [u64; 2]) {
    let mut run = run(text);
    run.advance(cycles);
    let mut metrics = run.metrics();
    let all = metrics.as_object_mut().expect("metrics are a table");
    let traffic = ["messages", "bytes"].map(|key| all.remove(key).and_then(|v| v.as_u64()));
    all.remove("steps_per_cpu_s");
    (run.digest(), metrics, traffic.map(|count| count.expect("a count")))
}

#[test]
fn a_team_ends_with_the_digest_and_the_metrics_of_one_process() {
    let all = [(FIELD, 400), (DEAD_END, 250), (OPEN, 180), (TWO, 150), (SPACE, 200), (WHEELS, 250)];
    for (more, cycles) in all {
        let (direct, metrics, alone) = end(&text("direct", more), cycles);
        let (team, same, traffic) = end(&text("team", more), cycles);
        assert_eq!((team, same), (direct, metrics), "{more}");
        assert_eq!(alone, [0, 0]);
        assert!(traffic[0] > cycles && traffic[1] > 10 * traffic[0], "{traffic:?} {more}");
    }
}

/// The comparison above includes vetoes, ways to the side, and the other end in the lead.
#[test]
fn what_is_compared_has_vetoes_and_all_that_comes_of_them() {
    let (_, field, _) = end(&text("team", FIELD), 400);
    let (_, dead_end, _) = end(&text("team", DEAD_END), 250);
    let count = |of: &Value, key: &str| of["rungs"][key].as_u64().unwrap_or_default();
    assert!(field["vetoes"].as_u64() > Some(10), "{field}");
    assert!(count(&field, "shorter") > 0 && count(&field, "sideways") > 0, "{field}");
    assert!(count(&dead_end, "pulled_back") > 0, "{dead_end}");
}

/// Lost packets change nothing as long as all is said in time, and more of them are sent.
#[test]
fn a_network_that_loses_packets_costs_packets_and_moves_nobody_elsewhere() {
    let faults = "network = { loss = 0.1, duplication = 0.1, max_delay_s = 2e-5 }\n";
    for (more, cycles) in [(FIELD, 120), (SPACE, 60)] {
        let (direct, metrics, _) = end(&text("direct", more), cycles);
        let (_, _, few) = end(&text("team", more), cycles);
        let (team, same, many) = end(&text("team", &format!("{faults}{more}")), cycles);
        assert_eq!((team, same), (direct, metrics), "{more}");
        assert!(many[0] > 2 * few[0], "{many:?} {few:?}");
    }
}

fn compiled(text: &str) -> ChainScenario<2> {
    ChainScenario::new(&Source::new("s", text.to_string(), "")).expect("a scenario")
}

/// Agents that are handed their packets one by one, in any order that keeps each link's own.
fn talk_elsewhere(run: &ChainRun<2>, cycle: u64) {
    loop {
        let shown = run.world().percepts_in_cycle(run.state(), cycle);
        if shown.is_empty() {
            return;
        }
        for (chain, sights) in shown {
            let agent = |k| ConnectorAgent::new(run.world(), chain, k);
            let mut agents: Vec<_> = (0..sights.len() as u32).map(agent).collect();
            let mut waiting = Vec::new();
            let first = agents[0].id();
            // The last begins first: one that has not begun yet keeps the packets sent to it.
            for (k, sight) in sights.into_iter().enumerate().rev() {
                agents[k].start(sight, 0).expect("a sight");
                let sent = agents[k].take_packets();
                waiting.extend(sent.into_iter().map(|out| (agents[k].id(), out)));
                while let Some((from, out)) = waiting.pop() {
                    let to = (out.to[0] - first) as usize;
                    agents[to].on_packet(from, &out.payload, 0);
                    let sent = agents[to].take_packets();
                    waiting.extend(sent.into_iter().rev().map(|out| (agents[to].id(), out)));
                }
            }
            let controls = agents.iter().map(ConnectorAgent::control).collect();
            let handed = ChainCycleControls { cycle, controls, gone: Vec::new() };
            run.world().submit_controls(run.state(), chain, handed).expect("decisions");
        }
    }
}

#[test]
fn agents_that_run_elsewhere_have_the_same_digest_and_as_many_packets() {
    for more in [FIELD, TWO, WHEELS] {
        let text = text("team", more);
        let mut elsewhere = compiled(&text).start(&Source::new("s", text.clone(), ""), 1);
        for cycle in 0..80 {
            talk_elsewhere(&elsewhere, cycle);
            elsewhere.advance(1);
        }
        let mut here = run(&text);
        here.advance(80);
        assert_eq!(elsewhere.digest(), here.digest(), "{more}");
        let [a, b] = [&elsewhere as &dyn Simulation, &*here].map(|run| run.metrics());
        assert_eq!((&a["messages"], &a["bytes"]), (&b["messages"], &b["bytes"]), "{more}");
    }
}

/// Hands over the decisions made elsewhere, except those of some connectors in some cycles, as a process would.
fn hand_over(run: &mut ChainRun<2>) {
    let cycle = run.cycle();
    talk_elsewhere(run, cycle);
    let mut controls = Vec::new();
    for (chain, first_id) in [(0, 0), (1, run.world().first_connector_id(1))] {
        let handed =
            run.state().body(chain).submitted.clone().filter(|handed| handed.cycle == cycle);
        for (id, control) in (first_id..).zip(handed.into_iter().flat_map(|all| all.controls)) {
            let bytes = |one| postcard::to_stdvec(&one).expect("plain data");
            // Some come too late, and of some the process is gone.
            match (cycle * 7 + u64::from(id)) % 61 {
                0 => {}
                1 => controls.push((id, ChainCycleControls::<2>::ABSENT_CONTROL.to_vec())),
                _ => controls.extend(control.map(|one| (id, bytes(one)))),
            }
        }
    }
    Simulation::submit_controls(run, &controls).expect("decisions");
}

#[test]
fn a_recorded_run_with_missing_decisions_is_computed_again_to_its_digest() {
    let text = format!("{}[record]\ncontrols = true\n", text("team", TWO));
    let start = || compiled(&text).start(&Source::new("s", text.clone(), ""), 1);
    let mut driven = start();
    driven.start_recording();
    let mut rows = MemoryRecorder::new(&driven.schemas());
    for _ in 0..60 {
        hand_over(&mut driven);
        driven.advance(1);
        driven.record(&mut rows).expect("memory suffices");
    }
    rows.finish().expect("memory suffices");
    let book = ControlLog::from_recorder(&rows).expect("controls are recorded");
    let mut again = start();
    again.replay_controls(book.clone());
    again.advance(25);
    let checkpoint = again.checkpoint();
    again.advance(35);
    assert_eq!(again.digest(), driven.digest());
    let mut resumed = start();
    resumed.replay_controls(book);
    resumed.restore(&checkpoint).expect("the same scenario");
    resumed.advance(35);
    assert_eq!(resumed.digest(), driven.digest());
    let mut whole = start();
    whole.advance(60);
    assert_ne!(whole.digest(), driven.digest(), "somebody was missing");
}

#[test]
fn a_checkpoint_has_the_decisions_that_were_handed_over() {
    let text = text("team", TWO);
    let start = || compiled(&text).start(&Source::new("s", text.clone(), ""), 1);
    let mut driven = start();
    hand_over(&mut driven);
    let mut resumed = start();
    resumed.restore(&driven.checkpoint()).expect("the same scenario");
    assert_eq!(resumed.digest(), driven.digest());
    driven.advance(2);
    resumed.advance(2);
    assert_eq!(resumed.digest(), driven.digest());
    let wrong =
        Simulation::submit_controls(&mut driven, &[(0, vec![1, 2, 3])]).expect_err("no decision");
    assert!(wrong.to_string().contains("connector 0 of chain 0"), "{wrong}");
}

#[test]
fn a_chain_stands_in_a_cycle_in_which_a_decision_does_not_come() {
    let text = text("team", FIELD);
    let mut elsewhere = compiled(&text).start(&Source::new("s", text.clone(), ""), 1);
    talk_elsewhere(&elsewhere, 0);
    elsewhere.advance(1);
    let before = elsewhere.state().body(0).chain.points().to_vec();
    let (chain, sights) = elsewhere.world().percepts_in_cycle(elsewhere.state(), 1).remove(0);
    let world = elsewhere.world().clone();
    let nothing = ChainCycleControls::empty(1, sights.len());
    world.submit_controls(elsewhere.state(), chain, nothing).expect("no decisions");
    elsewhere.advance(1);
    assert_eq!(elsewhere.state().body(0).chain.points(), before);
    talk_elsewhere(&elsewhere, 2);
    elsewhere.advance(1);
    assert_ne!(elsewhere.state().body(0).chain.points(), before, "and goes on");
    let nothing = || ChainCycleControls::empty(3, 0);
    let wrong = world.submit_controls(elsewhere.state(), 7, nothing()).expect_err("no such chain");
    assert!(wrong.to_string().contains("count from 0"), "{wrong}");
    let few = world.submit_controls(elsewhere.state(), 0, nothing()).expect_err("too few");
    assert!(few.to_string().contains("0 decisions for 12"), "{few}");
}

/// Hands over the decisions of the first chain's connectors, some of which are gone.
fn hand_over_without(run: &mut ChainRun<2>, gone: &[u32]) {
    let cycle = run.cycle();
    talk_elsewhere(run, cycle);
    let handed = run.state().body(0).submitted.clone().expect("it has talked");
    let mut controls = Vec::new();
    for (id, control) in (0..).zip(handed.controls) {
        match control {
            _ if gone.contains(&id) => {
                controls.push((id, ChainCycleControls::<2>::ABSENT_CONTROL.to_vec()))
            }
            Some(control) => {
                controls.push((id, postcard::to_stdvec(&control).expect("plain data")));
            }
            None => {}
        }
    }
    Simulation::submit_controls(run, &controls).expect("decisions");
}

#[test]
fn a_chain_stands_in_a_cycle_in_which_an_agent_is_gone_says_whose_and_goes_on() {
    let network = format!("network = {{ loss = 0.05 }}\n{FIELD}");
    for more in [FIELD, &network] {
        let text = text("team", more);
        let mut run = compiled(&text).start(&Source::new("s", text.clone(), ""), 1);
        run.enable_events();
        run.advance(3);
        let points = |run: &ChainRun<2>| run.state().body(0).chain.points().to_vec();
        let before = points(&run);
        // The last follower: no motion in the open comes to it.
        hand_over_without(&mut run, &[11]);
        run.advance(1);
        assert_eq!(points(&run), before, "{more}");
        let said = |run: &mut ChainRun<2>| {
            let log = run.frame(FrameOptions::WITHOUT_SCANS).log;
            log.into_iter().map(|entry| format!("{entry:?}")).collect::<Vec<_>>().join("\n")
        };
        let lost = said(&mut run);
        assert!(lost.contains("is not heard by connector 10: the chain stands"), "{lost}");
        hand_over_without(&mut run, &[]);
        run.advance(1);
        let back = said(&mut run);
        assert!(back.contains("is heard by connector 10 again"), "{back}");
        run.advance(1);
        assert_ne!(points(&run), before, "it goes on");
    }
}

#[test]
fn bytes_that_are_no_decision_are_refused_and_connectors_are_known_by_their_ids() {
    let text = text("team", TWO);
    let run = compiled(&text).start(&Source::new("s", text.clone(), ""), 1);
    let world = run.world();
    assert_eq!(world.connector_id(1, 3), Some(11));
    assert_eq!(world.find_connector(11), Some((1, 3)));
    assert_eq!((world.connector_id(1, 8), world.connector_id(2, 0)), (None, None));
    assert_eq!((world.find_connector(15), world.find_connector(16)), (Some((1, 7)), None));
    let refused = |id, bytes: &[u8]| world.read_control(0, id, bytes).expect_err("no decision");
    assert!(refused(16, ChainCycleControls::<2>::ABSENT_CONTROL).contains("no such connector"));
    assert!(refused(3, &[1, 2, 3]).contains("none of a decision of this build"));
    assert_eq!(world.read_control(0, 3, ChainCycleControls::<2>::ABSENT_CONTROL), Ok(None));
    talk_elsewhere(&run, 0);
    let handed = run.state().body(1).submitted.clone().expect("it has talked");
    let control = handed.controls[3].clone().expect("a decision");
    let bytes = postcard::to_stdvec(&control).expect("plain data");
    assert_eq!(world.read_control(0, 11, &bytes), Ok(Some(control)));
    let of = |now, id| world.read_control(now, id, &bytes).expect_err("of another");
    assert!(of(0, 12).contains("is of connector 3"));
    assert!(of(1, 11).contains("cycle 0"));
    let twice = [(11, bytes.clone()), (11, bytes)];
    let twice = world.decode_agent_controls(0, &twice).expect_err("two of one");
    assert!(twice.to_string().contains("there are two of it"), "{twice}");
}

#[test]
fn what_no_connector_of_a_team_sees_is_refused_with_the_key_and_the_reason() {
    let chain =
        "[[chains]]\nconnectors = 4\nrod_m = 1.0\n[[chains.tasks]]\nkind = \"rest\"\nlasts_s = 1\n";
    let limits = |limit: &str| format!("{chain}[[chains.limits]]\nconnector = 3\n{limit}\n");
    let change = |what: &str| format!("{chain}[[chains.changes]]\nat_s = 1\n{what}\n");
    let task = |what: &str| format!("{chain}[[chains.tasks]]\n{what}\n");
    let planned = "kind = \"targets\"\ntargets_m = [[1, 1]]\nplanner = \"rrt-connect\"";
    let wrong = [
        (text("team", chain).replace("self_collision = false\n", ""), "self_collision = true"),
        (text("team", chain).replace("backtracks = 0\n", ""), "backtracks = 64"),
        (text("team", &format!("slave_step_max_m = inf\n{chain}")), "slave_step_max_m"),
        (text("team", TWO).replace("escape = \"off\"\n", ""), "escape"),
        (text("team", &limits("mobility = \"fixed\"")), "connector 3 is held"),
        (text("team", &limits("failed = true")), "connector 3 is held"),
        (text("team", &change("connector = 2\nfailed = true")), "connector 2 is held at some time"),
        (text("team", &change("scatter = [1, 2]")), "a chain that breaks"),
        (text("team", &task("kind = \"external\"")), "external"),
        (text("team", &task(planned)), "a planner"),
        (text("direct", &format!("network = {{ loss = 0.1 }}\n{chain}")), "one process moves"),
    ];
    for (text, cause) in wrong {
        let error = refused(&text, cause);
        assert!(error.contains(cause), "{cause}: {error}");
        assert!(error.contains("deployment"), "{error}");
    }
}

#[test]
fn a_network_needs_connectors_that_exist_and_times_that_fit() {
    let chain =
        "[[chains]]\nconnectors = 4\nrod_m = 1.0\n[[chains.tasks]]\nkind = \"rest\"\nlasts_s = 1\n";
    let wrong = [
        ("loss = 1.5", "give 0 or more and less than 1"),
        ("latency_s = 0.01", "at most an eighth of the deadline"),
        ("deadline_s = 0.06", "at most dt_s"),
        ("silent = [{ connector = 4 }]", "numbers from 0 to 3"),
        ("silent = [{ connector = 1, chain = 1 }]", "numbers from 0 to 0"),
        ("silent = [{ connector = 1, from_s = 9, until_s = 3 }]", "end after the start"),
        ("one_way = [{ sender = 1, receiver = 3 }]", "numbers that differ by 1"),
        ("partitions = [{ sides = [[0, 1], [2, 9]] }]", "numbers from 0 to 3"),
        ("partitions = [{ sides = [[0, 1], [1, 2]] }]", "name each connector once"),
        ("partitions = [{ sides = [[0, 1]] }]", "at least two"),
        ("bandwidth_bit_s = 0.5", "at least 1 bit/s"),
        ("budget_bytes_s = 4000", "share no radio channel"),
    ];
    for (network, cause) in wrong {
        let text = text("team", &format!("network = {{ {network} }}\n{chain}"));
        let error = refused(&text, cause);
        assert!(error.contains(cause), "{network}: {error}");
    }
}
