//! Promise D1, D2: a run that was decided from outside is computed again from its orders.

use crate::support::SHIPPED_WORLDS;
use sidestep_kernel::control::MultiAgentOrder;
use sidestep_kernel::ports::ColumnValues;
use sidestep_scenario::Source;
use sidestep_session::{
    ManagedRun, NoWatcher, OutputPaths, RecordedRun, RestoreError, RowSelection, replay_all,
    replay_to,
};
use std::path::Path;

const SCENARIO: &str = "format = 1\nworld = \"robots\"\ncycles = 200\n\
    [map]\nascii = \"\"\"\n........\n........\n...##...\n........\n\"\"\"\n\
    [record]\ncheckpoint_every = 50\n\
    [[robots]]\ncount = 4\neffector = \"nomad\"\nbehaviour.kind = \"external\"\n";

fn started(keep: OutputPaths<'_>) -> ManagedRun {
    let source = Source::new("s.toml", SCENARIO, "");
    let compiled = SHIPPED_WORLDS.compile(&source).expect("valid");
    ManagedRun::start(&SHIPPED_WORLDS, compiled.as_ref(), &source, 1, keep).expect("vacant")
}

/// Records a run to cycle `until` in which a caller orders turns and steps; returns its digest.
fn record_run(folder: &Path, until: u64) -> String {
    let mut journey = started(OutputPaths { folder: Some(folder), ..OutputPaths::default() });
    while journey.cycle() < until {
        let now = journey.cycle();
        let values = [0, 1, 2, 3].map(|k| ((now / 3 + k * k) % 3) as f64);
        let orders = MultiAgentOrder { order: "action", agents: &[0, 1, 2, 3], values: &values };
        journey.simulation_mut().order(&orders).expect("right");
        journey.advance_to(now + 1, &NoWatcher).expect("there is room");
    }
    journey.finish(&NoWatcher).expect("there is room").digest
}

#[test]
fn a_run_that_was_decided_from_outside_is_replayed_from_its_orders() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("run");
    let digest = record_run(&folder, 200);
    let again = RecordedRun::open(&SHIPPED_WORLDS, &folder).expect("a run");
    for workers in [1, 2] {
        let replayed = replay_all(&again, workers, &NoWatcher).expect("the digest is confirmed");
        assert_eq!(replayed.run.digest().to_string(), digest);
    }
    for cycle in [0, 1, 73, 150, 199] {
        let replayed = replay_to(&again, cycle, 1, &NoWatcher).expect("the poses are confirmed");
        assert_eq!(replayed.compared_poses, 4, "cycle {cycle}");
    }
}

#[test]
fn a_run_that_lost_its_deciders_is_not_resumed_without_them() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("run");
    record_run(&folder, 120);
    let error = ManagedRun::resume(&SHIPPED_WORLDS, &folder, 1, None)
        .map(drop)
        .expect_err("nobody decides");
    let words = error.to_string();
    assert!(words.contains("its agents were controlled externally up to cycle 120"), "{words}");
    let again = RecordedRun::open(&SHIPPED_WORLDS, &folder).expect("a run");
    replay_to(&again, 119, 1, &NoWatcher).expect("what was recorded can be looked at");
}

/// Returns the cycles of the kept poses, each once, and takes all rows.
fn taken_cycles(journey: &mut ManagedRun) -> Vec<u64> {
    let tables = journey.take_rows().expect("rows");
    let poses = tables.iter().find(|(schema, _)| schema.name == "trajectories").expect("poses");
    let ColumnValues::U64(cycles) = &poses.1[0] else { panic!("cycles come first") };
    let mut cycles = cycles.to_vec();
    cycles.sort_unstable();
    cycles.dedup();
    cycles
}

#[test]
fn rows_in_memory_never_tell_of_two_pasts_and_have_no_hole() {
    let mut journey = started(OutputPaths::default());
    journey.keep_rows(&RowSelection::default()).expect("kept");
    let advance =
        |journey: &mut ManagedRun, until| journey.advance_to(until, &NoWatcher).expect("ok");
    advance(&mut journey, 20);
    let at_20 = journey.checkpoint().expect("saved");
    advance(&mut journey, 33);
    let at_33 = journey.checkpoint().expect("saved");
    journey.restore(&at_20).expect("its own");
    let turn = MultiAgentOrder { order: "action", agents: &[0], values: &[1.0] };
    journey.order(&turn).expect("right");
    advance(&mut journey, 25);
    let digest = journey.simulation().digest();
    let refused = journey.restore(&at_33).expect_err("of the way that it left");
    assert!(
        matches!(refused, RestoreError::UnknownHistory { from: 0, now: 25, of: 33 }),
        "{refused}"
    );
    assert_eq!((journey.cycle(), journey.simulation().digest()), (25, digest));
    assert_eq!(taken_cycles(&mut journey), (0..25).collect::<Vec<_>>());
    // Nothing of another past is kept any longer.
    journey.restore(&at_33).expect("of the same scenario");
    advance(&mut journey, 38);
    assert_eq!(taken_cycles(&mut journey), (33..38).collect::<Vec<_>>());
}

#[test]
fn another_scenario_is_told_as_such_also_where_rows_are_kept() {
    let source = Source::new("s.toml", format!("seed = 9\n{SCENARIO}"), "");
    let compiled = SHIPPED_WORLDS.compile(&source).expect("valid");
    let other = compiled.start(&source, 1).checkpoint();
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("run");
    for keep in
        [OutputPaths::default(), OutputPaths { folder: Some(&folder), ..OutputPaths::default() }]
    {
        let mut journey = started(keep);
        if keep.folder.is_none() {
            journey.keep_rows(&RowSelection::default()).expect("kept");
        }
        let told = journey.restore(&other).expect_err("another seed").to_string();
        assert!(told.contains("belongs to scenario"), "{told}");
    }
}
