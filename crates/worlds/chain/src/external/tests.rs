use crate::ChainRun;
use crate::kinds;
use crate::scenario::AnyChainScenario;
use sidestep_kernel::control::{AgentTeam, BufferMut, MultiAgentOrder, OrderLog, ValueDomain};
use sidestep_kernel::ports::{MemoryRecorder, Recorder};
use sidestep_kernel::view::{BodyId, FactValue};
use sidestep_kernel::{Cycle, Simulation};
use sidestep_rods::geometry::norm;
use sidestep_scenario::Source;
use std::collections::BTreeMap;

mod answers;

/// Two chains under orders among discs, a wall and moving obstacles, one that decides for itself, and
/// one that takes orders once it has rested.
const MIXED: &str = r#"
[[obstacles]]
at_m = [1.0, 0.2]
radius_m = 0.3
[[obstacles]]
ends_m = [[-3.0, 1.6], [3.0, 1.6]]
[[obstacles]]
at_m = [0.5, -0.6]
radius_m = 0.1
patrol_m = [[0.5, -0.6], [0.5, 1.0]]
speed_m_s = 0.4
[[chains]]
name = "snake"
connectors = 6
count = 2
apart_m = [0.0, 0.6]
rod_m = [0.25, 0.35]
[[chains.tasks]]
kind = "external"
[[chains]]
connectors = 5
at_m = [0.0, -0.9]
rod_m = 0.3
[[chains.tasks]]
kind = "targets"
targets_m = [[2.0, 0.9]]
[[chains]]
connectors = 4
at_m = [0.0, 1.2]
rod_m = 0.3
[[chains.tasks]]
kind = "rest"
lasts_s = 0.2
[[chains.tasks]]
kind = "external"
connector = 3
"#;

fn source(text: &str) -> Source {
    Source::new("s.toml", format!("format = 1\nworld = \"chain\"\nseed = 7\n{text}"), "")
}

fn plane(text: &str, workers: usize) -> ChainRun<2> {
    let source = source(text);
    let mut run = match AnyChainScenario::new(&source).unwrap_or_else(|error| panic!("{error}")) {
        AnyChainScenario::Plane(compiled) => compiled.start(&source, workers),
        AnyChainScenario::Space(_) => panic!("in the plane"),
    };
    run.force_parallel();
    run
}

/// Observations of a team: one vector per space.
fn observed(run: &dyn Simulation, team: usize) -> BTreeMap<String, Vec<f64>> {
    let AgentTeam { agents, observation_spaces: observed, .. } = &run.agent_teams()[team];
    let sizes: Vec<usize> =
        observed.iter().map(|space| space.value_count() * agents.len()).collect();
    let mut whole: Vec<Vec<i64>> = sizes.iter().map(|&n| vec![0; n]).collect();
    let mut real: Vec<Vec<f64>> = sizes.iter().map(|&n| vec![0.0; n]).collect();
    let rooms = observed.iter().zip(whole.iter_mut().zip(&mut real));
    let mut room: Vec<_> = rooms
        .map(|(space, (whole, real))| match space.is_integer() {
            true => BufferMut::Integer(whole),
            false => BufferMut::Real(real),
        })
        .collect();
    run.observe(team, &mut room).expect("the room fits");
    for (space, (whole, real)) in observed.iter().zip(whole.iter().zip(&mut real)) {
        if space.is_integer() {
            *real = whole.iter().map(|&value| value as f64).collect();
        }
    }
    observed.iter().map(|space| space.name.clone()).zip(real).collect()
}

/// The name of a choice that the first agent of a team observes.
fn name(run: &dyn Simulation, team: usize, space: &str) -> String {
    let number = observed(run, team)[space][0] as usize;
    let space = run.agent_teams()[team]
        .observation_spaces
        .iter()
        .find(|s| s.name == space)
        .expect("a space");
    let ValueDomain::Discrete(names) = &space.kind else { panic!("no choice") };
    names[number].clone()
}

fn order(run: &mut dyn Simulation, order: &str, agent: u32, values: &[f64]) {
    run.order(&MultiAgentOrder { order, agents: &[agent], values })
        .unwrap_or_else(|error| panic!("{error}"));
}

/// A policy that depends on its observations: away from anything near, else ahead; every third cycle it
/// turns a rod instead, every fifth the tail leads.
fn decide(run: &mut dyn Simulation, team: usize) {
    let (seen, now) = (observed(run, team), run.cycle());
    let agents = run.agent_teams()[team].agents.clone();
    let n = seen["gap_m"].len() / agents.len();
    for (row, &agent) in agents.iter().enumerate() {
        let k = if now.is_multiple_of(5) { n - 1 } else { 0 };
        let at = |k: usize, i: usize| seen["joints_m"][2 * (row * n + k) + i];
        let near = |i: usize| seen["nearest_m"][2 * (row * n + k) + i];
        let to = [at(k, 0) + 0.02 - 0.1 * near(0), at(k, 1) + 0.01 - 0.1 * near(1)];
        if now.is_multiple_of(3) {
            let ends = [at(1, 0), at(1, 1) + 0.004, at(2, 0), at(2, 1) + 0.004];
            order(run, "rod_to_m", agent, &ends);
            order(run, "rod", agent, &[1.0]);
        } else {
            order(run, "to_m", agent, &to);
            order(run, "connector", agent, &[k as f64]);
        }
        order(run, "reach", agent, &[f64::from(u8::from(now.is_multiple_of(2)))]);
    }
}

/// Decides for all chains that take orders, for `cycles` cycles.
fn decided(run: &mut dyn Simulation, cycles: u64) {
    for _ in 0..cycles {
        let teams: Vec<usize> = (0..run.agent_teams().len())
            .filter(|&team| !run.agent_teams()[team].action_spaces.is_empty())
            .collect();
        teams.into_iter().for_each(|team| decide(run, team));
        run.advance(1);
    }
}

/// The book of all orders that were recorded.
fn book(recorder: &MemoryRecorder) -> OrderLog {
    OrderLog::from_recorder(recorder).expect("orders are recorded")
}

fn recorded(
    run: &mut ChainRun<2>,
    until: Cycle,
    go_on: impl Fn(&mut ChainRun<2>),
) -> MemoryRecorder {
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
    let mut first = plane(MIXED, 1);
    let rows = recorded(&mut first, 60, |run| {
        let cycles = 7.min(60 - run.cycle());
        decided(run, cycles);
    });
    assert!(rows.row_count("orders") > 600, "{}", rows.row_count("orders"));
    for workers in [1, 2, 3, 8] {
        let mut again = plane(MIXED, workers);
        again.replay_orders(book(&rows)).expect("they were obeyed once");
        let its = recorded(&mut again, 60, |run| {
            run.advance(60 - run.cycle());
        });
        assert_eq!(again.digest(), first.digest(), "{workers} workers");
        assert_eq!(book(&its), book(&rows), "{workers} workers");
    }
    for at in 0..60 {
        let mut before = plane(MIXED, 1);
        decided(&mut before, at);
        // An order that was given before the checkpoint is in it, and so is the answer to the last one.
        order(&mut before, "to_m", 1, &[-2.0, 0.5]);
        let checkpoint = before.checkpoint();
        let told = observed(&before, 0);
        before.advance(1);
        decided(&mut before, 59 - at);
        let mut after = plane(MIXED, 2);
        after.restore(&checkpoint).expect("the same scenario");
        assert_eq!(observed(&after, 0), told, "resumed at {at}");
        after.advance(1);
        decided(&mut after, 59 - at);
        assert_eq!(after.digest(), before.digest(), "resumed at {at}");
    }
}

#[test]
fn going_back_gives_the_same_orders_again() {
    let mut first = plane(MIXED, 1);
    let rows = recorded(&mut first, 60, |run| decided(run, 60));
    let mut again = plane(MIXED, 1);
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
fn an_order_is_a_part_of_the_state_until_the_cycle_has_used_it() {
    let mut run = plane(MIXED, 1);
    let fresh = run.digest();
    order(&mut run, "reach", 0, &[1.0]);
    assert_ne!(run.digest(), fresh);
    order(&mut run, "reach", 0, &[0.0]);
    assert_eq!(run.digest(), fresh, "the later one takes the place of the earlier one");
    let without = {
        let mut run = plane(MIXED, 1);
        run.advance(1);
        run.digest()
    };
    order(&mut run, "connector", 0, &[3.0]);
    run.advance(1);
    assert_eq!(run.digest(), without, "who names a connector and no place moves nothing");
}

#[test]
fn chains_of_one_name_and_length_are_a_team_and_those_that_decide_for_themselves_only_observe() {
    let run = plane(MIXED, 1);
    let teams: Vec<_> = run
        .agent_teams()
        .iter()
        .map(|team| {
            (
                &team.name[..],
                team.agents.clone(),
                team.action_spaces.len(),
                team.observation_spaces.len(),
            )
        })
        .collect();
    let expected =
        [("snake", vec![0, 1], 5, 15), ("chain", vec![2], 0, 8), ("chain 2", vec![3], 5, 15)];
    assert_eq!(teams, expected);
    for space in run
        .agent_teams()
        .iter()
        .flat_map(|team| team.observation_spaces.iter().chain(&team.action_spaces))
    {
        assert_eq!(space.unit().is_some(), space.name.ends_with("_m"), "{}", space.name);
        assert!(!space.meaning.is_empty());
    }
}

#[test]
fn gaps_are_observed_as_the_chain_itself_meets_them() {
    let text = MIXED.replace("count = 2\napart_m = [0.0, 0.6]\n", "at_m = [0.35, 0.0]\n");
    let text = text.split("[[chains]]\nconnectors = 5").next().expect("one chain");
    let mut run = plane(text, 1);
    let mut least_m = f64::INFINITY;
    for _ in 0..120 {
        decided(&mut run, 1);
        let seen = observed(&run, 0);
        least_m = seen["gap_m"].iter().chain(&seen["rod_gap_m"]).fold(least_m, |a, b| a.min(*b));
        let measured_m = run.agent_metrics()[0]["min_clearance_m"].as_f64();
        let look_m = run.world().look_m;
        assert_eq!(measured_m.unwrap_or(look_m), least_m.min(look_m), "cycle {}", run.cycle());
        // The way to a near surface is as long as the gap and the radius, 0.05 m.
        let ways = seen["nearest_m"].as_chunks::<2>().0.iter().zip(&seen["gap_m"]);
        for (way, gap_m) in ways.filter(|(_, gap_m)| **gap_m < look_m) {
            assert!((norm(*way) - 0.05 - gap_m).abs() < 1e-9, "{way:?} {gap_m}");
        }
    }
    assert!(least_m < run.world().look_m, "something came near");
}

#[test]
fn another_chain_is_observed_where_it_is() {
    let run = plane(MIXED, 1);
    let seen = observed(&run, 0);
    // The two snakes lie 0.6 m above each other, and their connectors have radii of 0.05 m.
    let look_m = run.world().look_m;
    assert!(look_m < 0.5, "so far apart they do not see each other");
    assert_eq!(seen["gap_m"][3], look_m);
    let text = MIXED.replace("apart_m = [0.0, 0.6]", "apart_m = [0.0, 0.2]");
    let seen = observed(&plane(&text, 1), 0);
    assert!((seen["gap_m"][3] - 0.1).abs() < 1e-12 && (seen["gap_m"][9] - 0.1).abs() < 1e-12);
    assert!(seen["nearest_m"][6] == 0.0 && (seen["nearest_m"][7] - 0.15).abs() < 1e-12);
}

/// Refusals, and a part of the message that names the remedy.
#[test]
fn what_cannot_be_obeyed_is_refused_and_nothing_of_it_noted() {
    let mut run = plane(MIXED, 1);
    let before = run.digest();
    let one = |order: &'static str, values: &'static [f64], words: &'static str| {
        (MultiAgentOrder { order, agents: &[0], values }, words)
    };
    let refused = [
        (MultiAgentOrder { order: "to_m", agents: &[9], values: &[0.0; 2] }, "there is no chain 9"),
        (
            MultiAgentOrder { order: "to_m", agents: &[2], values: &[0.0; 2] },
            "chain 2 decides for itself",
        ),
        one("fly", &[0.0], "it takes to_m, connector, reach, rod_to_m, rod"),
        one("to_m", &[0.0; 3], "needs 1 x 2 values, not 3"),
        one("to_m", &[f64::NAN, 0.0], "is NaN; it must be a number from -1000000 to 1000000"),
        one("to_m", &[2e6, 0.0], "is 2000000"),
        one("connector", &[6.0], "it must be a whole number from 0 to 5"),
        one("rod", &[5.0], "it must be a whole number from 0 to 4"),
        one("reach", &[2.0], "it must be one of 0 exact, 1 as-far-as-it-goes"),
        one(
            "rod_to_m",
            &[0.0, 0.0, 1.0, 0.0],
            "the order `rod_to_m` to chain 0 cannot be obeyed: its places are 1 m apart, and no rod \
             of the chain is as long; give places 0.25 m to 0.35 m apart",
        ),
    ];
    for (orders, words) in refused {
        let error = run.order(&orders).expect_err(words).to_string();
        assert!(error.contains(words), "{error}");
        assert_eq!(run.digest(), before, "{error}");
    }
    let mut book = OrderLog::default();
    book.add(3, &MultiAgentOrder { order: "rod_to_m", agents: &[0], values: &[0.0; 4] });
    let error = run.replay_orders(book).expect_err("a rod is no point").to_string();
    assert!(error.contains("its places are 0 m apart"), "{error}");
    assert!(run.observe(0, &mut []).is_err() && run.observe(7, &mut []).is_err());
}

#[test]
fn a_task_under_orders_has_no_patience_and_nothing_follows_it_unless_it_ends() {
    let wrong = |tasks: &str| {
        let text = format!("[[chains]]\nconnectors = 3\nrod_m = 0.3\n{tasks}");
        AnyChainScenario::new(&source(&text)).map(drop).expect_err(tasks).to_string()
    };
    let external = "[[chains.tasks]]\nkind = \"external\"\n";
    let told = wrong(&format!("{external}patience_s = 3\n"));
    assert!(told.contains("`patience_s` does nothing in a task of kind external"), "{told}");
    let told = wrong(&external.repeat(2));
    assert!(told.contains("never ends") && told.contains("lasts_s"), "{told}");
}

#[test]
fn who_looks_at_a_connector_sees_the_order_that_is_ahead() {
    let mut run = plane(MIXED, 1);
    order(&mut run, "to_m", 0, &[-1.5, -0.4]);
    order(&mut run, "connector", 0, &[5.0]);
    let digest = run.digest();
    let told = run.inspect(BodyId::new(kinds::CONNECTOR, 0, Some(5))).expect("it is there");
    assert_eq!(told.fact_value("Wish", "what"), Some(&"go, as ordered".into()));
    assert_eq!(
        told.fact_value("Wish", "of"),
        Some(&FactValue::Body(BodyId::new(kinds::CONNECTOR, 0, Some(5))))
    );
    assert_eq!(told.fact_value("Ladder", "rung"), Some(&"as wanted".into()));
    assert_eq!(run.digest(), digest);
}
