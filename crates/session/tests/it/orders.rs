//! Promise D1, D2: a run that was decided from outside is computed again from its orders.

use sidestep::kernel::control::Orders;
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use sidestep_session::{Journey, Keep, Recorded, Unwatched, replay_all, replay_to};
use std::path::Path;

const SCENARIO: &str = "format = 1\nworld = \"robots\"\ncycles = 200\n\
    [map]\nascii = \"\"\"\n........\n........\n...##...\n........\n\"\"\"\n\
    [record]\ncheckpoint_every = 50\n\
    [[robots]]\ncount = 4\neffector = \"nomad\"\nbehaviour.kind = \"external\"\n";

/// Records a run to cycle `until` in which a caller orders turns and steps; returns its digest.
fn recorded(folder: &Path, until: u64) -> String {
    let source = Source::new("s.toml", SCENARIO, "");
    let compiled = WORLDS.compile(&source).expect("valid");
    let keep = Keep { folder: Some(folder), ..Keep::default() };
    let mut journey = Journey::start(compiled.as_ref(), &source, 1, keep, None).expect("vacant");
    while journey.cycle() < until {
        let now = journey.cycle();
        let values = [0, 1, 2, 3].map(|k| ((now / 3 + k * k) % 3) as f64);
        let orders = Orders { order: "action", agents: &[0, 1, 2, 3], values: &values };
        journey.simulation_mut().order(&orders).expect("right");
        journey.advance_to(now + 1, &Unwatched).expect("there is room");
    }
    journey.finish(&Unwatched).expect("there is room").digest
}

#[test]
fn a_run_that_was_decided_from_outside_is_replayed_from_its_orders() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("run");
    let digest = recorded(&folder, 200);
    let again = Recorded::open(WORLDS, &folder).expect("a run");
    for workers in [1, 2] {
        let replayed = replay_all(&again, workers, &Unwatched).expect("the digest is confirmed");
        assert_eq!(replayed.run.digest().to_string(), digest);
    }
    for cycle in [0, 1, 73, 150, 199] {
        let replayed = replay_to(&again, cycle, 1, &Unwatched).expect("the poses are confirmed");
        assert_eq!(replayed.compared_poses, 4, "cycle {cycle}");
    }
}

#[test]
fn a_run_that_lost_its_deciders_is_not_resumed_without_them() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("run");
    recorded(&folder, 120);
    let error = Journey::resume(WORLDS, &folder, 1, None).map(drop).expect_err("nobody decides");
    let words = error.to_string();
    assert!(words.contains("its agents were decided from outside up to cycle 120"), "{words}");
    let again = Recorded::open(WORLDS, &folder).expect("a run");
    replay_to(&again, 119, 1, &Unwatched).expect("what was recorded can be looked at");
}
