//! D1: same build, scenario, seed: identical bits for 1, 2, 3, 8 workers, any storage order of
//! entities, recorded or not, resumed or not.

use crate::common::{CROWD, simulation, source, stored};
use sidestep::scenario::Source;
use sidestep::worlds::robots::RobotsRun;
use sidestep::worlds::robots::scenario::StorageOrder;
use sidestep_kernel::Simulation;
use sidestep_kernel::ports::{MemoryRecorder, Recorder};

const CYCLES: u64 = 300;

const POLICIES: [&str; 6] = [
    "conflict_policy='random'",
    "conflict_policy='fixed'",
    "conflict_policy='right_of_way'",
    "conflict_policy='rounds'",
    "conflict_policy='by_kind'",
    "conflict_policy='simultaneous'",
];
const ORDER: &str = "kind_order=['door', 'person', 'robot']";

fn digest_after(mut run: RobotsRun, cycles: u64) -> String {
    let mut done = 0;
    while done < cycles {
        done += run.advance(cycles - done);
    }
    run.digest().to_string()
}

/// All rows of a recorded run; block borders are part of nothing.
fn recorded(mut run: RobotsRun, cycles: u64, slice: u64) -> (String, MemoryRecorder) {
    run.start_recording();
    let mut recorder = MemoryRecorder::new(&run.schemas());
    while run.cycle() < cycles {
        run.advance(slice.min(cycles - run.cycle()));
        run.record(&mut recorder).expect("memory suffices");
    }
    recorder.finish().expect("memory suffices");
    (run.digest().to_string(), recorder)
}

/// Returns the crowd under a policy, with an order of kinds where the policy takes one.
fn crowd_under(policy: &str) -> Source {
    let order = policy.contains("by_kind").then_some(ORDER);
    source(CROWD, &[policy].into_iter().chain(order).collect::<Vec<_>>())
}

#[test]
fn a_recording_that_was_never_begun_is_an_error_and_not_empty() {
    let mut run = simulation(&source(CROWD, &[]), 1);
    run.advance(10);
    let mut recorder = MemoryRecorder::new(&run.schemas());
    let error = run.record(&mut recorder).expect_err("no rows were kept");
    assert!(error.to_string().contains("start_recording"), "{error}");
}

#[test]
fn every_number_of_workers_gives_the_same_bits_under_every_policy() {
    for policy in POLICIES {
        let source = crowd_under(policy);
        let alone = digest_after(simulation(&source, 1), CYCLES);
        for workers in [2, 3, 8] {
            let team = digest_after(simulation(&source, workers), CYCLES);
            assert_eq!(team, alone, "{workers} workers, {policy}");
        }
    }
}

#[test]
fn every_regime_and_law_gives_the_same_bits_for_three_workers() {
    let mut seen = std::collections::BTreeSet::new();
    for regime in ["reliable", "effectors", "sensors", "both"] {
        for law in ["cut", "stay", "renormalise"] {
            let overrides = [format!("regime='{regime}'"), format!("obstacle_rule='{law}'")];
            let source = source(CROWD, &overrides.each_ref().map(String::as_str));
            let alone = digest_after(simulation(&source, 1), CYCLES);
            assert_eq!(digest_after(simulation(&source, 3), CYCLES), alone, "{regime}, {law}");
            seen.insert(alone);
        }
    }
    // With reliable effectors the one path is blocked or not, under every law: 2 + 2 * 3.
    assert_eq!(seen.len(), 8, "regimes and laws make a difference");
}

#[test]
fn storage_order_leaves_no_trace() {
    for policy in POLICIES {
        let source = crowd_under(policy);
        let by_place = digest_after(stored(&source, 2, StorageOrder::Spatial), CYCLES);
        for order in [StorageOrder::ById, StorageOrder::Shuffled(1), StorageOrder::Shuffled(2)] {
            assert_eq!(digest_after(stored(&source, 2, order), CYCLES), by_place, "{policy}");
        }
    }
}

#[test]
fn rounds_come_to_what_random_comes_to() {
    let random = digest_after(simulation(&source(CROWD, &[POLICIES[0]]), 1), CYCLES);
    let rounds = source(CROWD, &["conflict_policy='rounds'"]);
    for workers in [1, 4] {
        assert_eq!(digest_after(simulation(&rounds, workers), CYCLES), random);
    }
}

#[test]
fn recording_changes_nothing_and_rows_do_not_depend_on_workers_or_storage() {
    let source = source(CROWD, &["record.calibration=true"]);
    let plain = digest_after(simulation(&source, 1), CYCLES);
    let (digest, rows) = recorded(simulation(&source, 1), CYCLES, 100);
    assert_eq!(digest, plain);
    assert!(
        rows.row_count("trajectories") > 0
            && rows.row_count("events") > 0
            && rows.row_count("readings") > 0
    );
    for (workers, order) in [(3, StorageOrder::Spatial), (2, StorageOrder::Shuffled(3))] {
        let (digest, same) = recorded(stored(&source, workers, order), CYCLES, 100);
        assert_eq!(digest, plain);
        assert!(same == rows, "rows differ for {workers} workers, {order:?}");
    }
}

#[test]
fn a_resumed_run_continues_bit_for_bit() {
    let source = source(CROWD, &["conflict_policy='right_of_way'"]);
    let whole = digest_after(simulation(&source, 2), CYCLES);
    for at in [0, 1, 137, CYCLES] {
        let mut first = simulation(&source, 3);
        first.advance(at);
        let saved = first.checkpoint();
        assert_eq!(saved, first.checkpoint(), "a checkpoint is a function of the state");
        let mut second = stored(&source, 2, StorageOrder::Shuffled(at));
        second.restore(&saved).expect("same scenario and version");
        assert_eq!(second.cycle(), at);
        assert_eq!(second.digest(), first.digest());
        assert_eq!(digest_after(second, CYCLES - at), whole, "resumed at {at}");
    }
}

#[test]
fn a_checkpoint_of_another_scenario_is_refused() {
    let saved = simulation(&source(CROWD, &[]), 1).checkpoint();
    let error = simulation(&source(CROWD, &["seed=6"]), 1).restore(&saved);
    assert!(error.expect_err("another seed").to_string().contains("scenario"));
}

/// Wherever this is run, the bits must be these (D3); a change needs a line in the CHANGELOG
/// (D4).
#[test]
fn the_golden_digest_of_the_crowd_is_what_every_machine_gets() {
    let digest = digest_after(simulation(&source(CROWD, &[]), 2), CYCLES);
    assert_eq!(digest, include_str!("golden/crowd.txt").trim());
}
