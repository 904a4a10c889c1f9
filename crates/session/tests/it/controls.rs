//! Promise D1, D2: a run that was flown by pilots outside of it is computed again from its folder, even if some
//! of their controls are missing.

use crate::support::SHIPPED_WORLDS;
use sidestep_airspace::pilot::{AirplaneControl, Percept, Pilot};
use sidestep_airspace::{AirspaceRun, RemotePilotRun};
use sidestep_kernel::EntityId;
use sidestep_kernel::network::{NetworkAgent, OutgoingPacket};
use sidestep_scenario::Source;
use sidestep_session::{ManagedRun, NoWatcher, OutputPaths, RecordedRun, replay_all, replay_to};
use std::any::Any;
use std::path::Path;

const SCENARIO: &str = "format = 1\nworld = \"airspace\"\ncycles = 30\n[airspace]\ndeployment = \"team\"\n\
    [airspace.generator]\nkind = \"superconflict\"\nn = 3\nradius_m = 3000.0\n\
    [record]\ncontrols = true\ncheckpoint_every = 10\n";

fn airspace(journey: &mut ManagedRun) -> &mut AirspaceRun {
    let run: &mut dyn Any = journey.simulation_mut();
    run.downcast_mut().expect("a run of an airspace")
}

/// Lets pilots decide a cycle: all packets arrive, one after the other.
fn decide_cycle(pilots: &mut [Pilot], sights: Vec<Percept>) -> Vec<AirplaneControl> {
    let ids: Vec<EntityId> = sights.iter().map(|sight| sight.own.id).collect();
    let mut due = Vec::new();
    for sight in sights {
        let own = sight.own.id as usize;
        pilots[own].start(sight, 0);
    }
    loop {
        for pilot in &mut *pilots {
            for OutgoingPacket { to, payload, .. } in pilot.take_packets() {
                due.extend(to.iter().map(|&other| (other, pilot.id(), payload.clone())));
            }
        }
        let Some((to, from, payload)) = due.pop() else { break };
        pilots[to as usize].on_packet(from, &payload, 0);
    }
    ids.iter().map(|&id| pilots[id as usize].control().expect("nobody waits any more")).collect()
}

/// Records a run to cycle `until`; returns its digest. Some controls never reach it.
fn record_run(folder: &Path, until: u64) -> String {
    let source = Source::new("s.toml", SCENARIO, "");
    let compiled = SHIPPED_WORLDS.compile(&source).expect("valid");
    let keep = OutputPaths { folder: Some(folder), ..OutputPaths::default() };
    let mut journey =
        ManagedRun::start(&SHIPPED_WORLDS, compiled.as_ref(), &source, 1, keep).expect("vacant");
    let world = airspace(&mut journey).world().clone();
    let mut pilots: Vec<Pilot> =
        (0..3).map(|id| Pilot::new(world.clone(), id, Default::default())).collect();
    while journey.cycle() < until {
        let now = journey.cycle();
        let run = airspace(&mut journey);
        let controls = decide_cycle(&mut pilots, run.percepts());
        let come =
            controls.into_iter().filter(|control| !(now + u64::from(control.id)).is_multiple_of(6));
        run.submit(come.collect()).expect("what pilots decide");
        journey.advance_to(now + 1, &NoWatcher).expect("there is room");
    }
    journey.finish(&NoWatcher).expect("there is room").digest
}

#[test]
fn a_run_that_was_flown_from_outside_is_replayed_from_its_controls() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("run");
    let digest = record_run(&folder, 30);
    let again = RecordedRun::open(&SHIPPED_WORLDS, &folder).expect("a run");
    for workers in [1, 2] {
        let replayed = replay_all(&again, workers, &NoWatcher).expect("the digest is confirmed");
        assert_eq!(replayed.run.digest().to_string(), digest);
    }
    for cycle in [0, 7, 13, 29] {
        replay_to(&again, cycle, 1, &NoWatcher).expect("the poses are confirmed");
    }
}

/// The server is gone: pilots in memory fly on, and the whole run is computed again.
#[test]
fn a_run_that_lost_its_server_goes_on_by_itself_and_is_replayed() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("run");
    record_run(&folder, 17);
    let journey = ManagedRun::resume(&SHIPPED_WORLDS, &folder, 1, None).expect("it can go on");
    let digest = journey.run_to_end(&NoWatcher).expect("there is room").digest;
    let again = RecordedRun::open(&SHIPPED_WORLDS, &folder).expect("a run");
    let replayed = replay_all(&again, 2, &NoWatcher).expect("the digest is confirmed");
    assert_eq!(replayed.run.digest().to_string(), digest);
}
