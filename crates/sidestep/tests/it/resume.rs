//! D1, "resumed or not", for everything that a run reports at its end: a run that was resumed from
//! any checkpoint has the metrics of a whole one, in all and of each agent and pair, but for times.

use crate::common::CROWD;
use crate::{airspace, chain};
use serde_json::Value;
use sidestep::Run;
use sidestep::kernel::Simulation;
use sidestep::kernel::ports::ColumnValues;
use sidestep::scenario::Source;
use sidestep::session::{ManagedRun, NoWatcher};
use sidestep::worlds::WORLDS;
use sidestep_record::read_table;
use std::path::Path;

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

/// Two that meet head-on, and are in conflict at the planned end.
const MEETING: &str = "format = 1\nworld = \"airspace\"\ncycles = 16\n[airspace]\nmethod = \"none\"\nshield = \"off\"\n\
                       [[airplanes]]\nat_m = [-3500.0, 0.0]\nheading_deg = 0.0\nway_points_m = [[9000.0, 0.0]]\n\
                       [[airplanes]]\nat_m = [3500.0, 0.0]\nheading_deg = 180.0\nway_points_m = [[-9000.0, 0.0]]\n";

/// Returns the cycles of the encounters in a folder, and whether each lasts.
fn encounters(folder: &Path) -> (Vec<u64>, Vec<u32>) {
    let table = read_table(folder, "pairs", ..).unwrap_or_else(|e| panic!("{e}"));
    let Some(ColumnValues::U64(cycles)) = table.column("cycle") else { panic!("cycles") };
    let Some(ColumnValues::Label(open)) = table.column("open") else { panic!("labels") };
    (cycles.to_vec(), open.to_vec())
}

#[test]
fn an_encounter_that_lasts_has_one_row_however_often_the_run_was_stopped() {
    let place = tempfile::tempdir().expect("a folder");
    let [whole, parts] = ["whole", "parts"].map(|name| place.path().join(name));
    let meeting = |folder: &Path| sidestep::parse(MEETING).workers(1).record_to(folder).start();
    meeting(&whole).and_then(Run::finish).expect("recorded");
    assert_eq!(encounters(&whole), (vec![16], vec![1]));

    let mut stopped = meeting(&parts).expect("started");
    stopped.advance(14).expect("advanced");
    stopped.stop().expect("stopped");
    assert_eq!(encounters(&parts), (vec![14], vec![1]));
    for until in [Some(15), None] {
        let resumed = ManagedRun::resume(&WORLDS, &parts, 1, until).expect("its own build");
        resumed.run_to_end(&NoWatcher).expect("recorded");
    }
    let [rows, in_one_go] =
        [&parts, &whole].map(|folder| read_table(folder, "pairs", ..).expect("whole").columns);
    assert!(rows == in_one_go, "{rows:?} {in_one_go:?}");
}

#[test]
fn rows_in_memory_have_what_lasts_once_at_the_planned_end() {
    let mut run = sidestep::parse(MEETING).workers(1).keep_tables().start().expect("started");
    let mut rows = Vec::new();
    for cycles in [14, 2, 0] {
        run.advance(cycles).expect("advanced");
        let tables = run.tables().expect("rows");
        let pairs = tables.iter().find(|table| table.name() == "pairs").expect("a table");
        rows.push(pairs.column("open").map_or(0, ColumnValues::len));
    }
    assert_eq!(rows, [0, 1, 0]);
}
