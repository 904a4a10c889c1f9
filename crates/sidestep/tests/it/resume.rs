//! D1, "resumed or not", for everything that a run reports at its end: a run that was resumed from
//! any checkpoint has the metrics of a whole one, in all and of each agent and pair, but for times.

use crate::common::CROWD;
use crate::{airspace, chain};
use serde_json::Value;
use sidestep::kernel::Simulation;
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;

/// Metrics that a clock has measured.
const CLOCK_METRICS: [&str; 3] = ["optimize_cpu_s", "plan_cpu_s", "steps_per_cpu_s"];

fn start(source: &Source, workers: usize) -> Box<dyn Simulation> {
    let compiled = WORLDS.compile(source).unwrap_or_else(|e| panic!("{e}"));
    compiled.start(source, workers)
}

fn advance_to(run: &mut dyn Simulation, cycle: u64) {
    while run.cycle() < cycle && !run.is_over() {
        run.advance(cycle - run.cycle());
    }
}

/// Returns the metrics of a run, of its agents and of its pairs.
fn all_metrics(run: &dyn Simulation) -> [Value; 3] {
    let mut metrics = run.metrics();
    let all = metrics.as_object_mut().expect("metrics are named");
    all.retain(|name, _| !CLOCK_METRICS.contains(&name.as_str()));
    [metrics, run.agent_metrics(), run.pair_metrics()]
}

fn assert_resumed_tells_the_same(source: &Source, cycles: u64, stops: &[u64]) {
    let mut whole = start(source, 2);
    advance_to(whole.as_mut(), cycles);
    let mut first = start(source, 3);
    for &stop in stops {
        advance_to(first.as_mut(), stop);
        let saved = first.checkpoint();
        // Also where the process has already run further: nothing of that is left.
        let mut used = start(source, 1);
        advance_to(used.as_mut(), cycles);
        for mut second in [start(source, 1), used] {
            second.restore(&saved).expect("its own checkpoint");
            assert_eq!(all_metrics(second.as_ref()), all_metrics(first.as_ref()), "at {stop}");
            advance_to(second.as_mut(), cycles);
            assert_eq!(
                all_metrics(second.as_ref()),
                all_metrics(whole.as_ref()),
                "resumed at {stop}"
            );
        }
    }
}

#[test]
fn a_resumed_run_of_robots_tells_what_a_whole_one_tells() {
    assert_resumed_tells_the_same(&Source::new("crowd", CROWD, ""), 120, &[1, 60, 119, 120]);
}

#[test]
fn a_resumed_run_of_airplanes_tells_what_a_whole_one_tells() {
    for more in [airspace::ERRING, airspace::LOSING] {
        assert_resumed_tells_the_same(&airspace::traffic(more), 30, &[1, 9, 16, 23, 29, 30]);
    }
}

#[test]
fn a_resumed_run_of_chains_tells_what_a_whole_one_tells() {
    for text in [chain::SEVERAL, chain::SWARM, chain::BROKEN, chain::REPORTING] {
        assert_resumed_tells_the_same(&chain::source(3, text), 90, &[1, 25, 60, 89, 90]);
    }
}
