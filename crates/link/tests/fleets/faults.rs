//! Faults of real processes, in real time: killed and stopped nodes, a stopped server. Airplanes stay apart.

use crate::processes::{LinkProcess, folder, job, signal};
use crate::support::{superconflict, wide};
use sidestep_session::fleet::{ClockMode, FleetJob, FleetStatus, Job, LinkMessage, Topology};
use std::time::Duration;

/// A second for 20 of the scenario: four cycles.
const FAST: ClockMode = ClockMode::Realtime { speed: 20.0 };

fn program(folder: &std::path::Path, topology: Topology) -> LinkProcess {
    let mut job = job(folder, topology, FAST);
    job.common.lease_s = 3.0;
    LinkProcess::start(&Job::Fleet(FleetJob { ..job }))
}

/// Ends a fleet, and returns the losses of separation and the fleet at the end.
fn ended(mut program: LinkProcess) -> (u64, FleetStatus) {
    drop(program.stdin.take());
    let result = program.until("the end", |message| match message {
        LinkMessage::Ended { summary, fleet, .. } => {
            Some((summary["metrics"]["losses_of_separation"].as_u64().expect("counted"), fleet))
        }
        _ => None,
    });
    program.end();
    result
}

#[test]
fn a_node_that_is_killed_is_started_again_and_all_stay_apart() {
    let folder = folder(&wide(&superconflict(4, "compact-team", 1_000_000, ""), 8_000));
    let program = program(folder.path(), Topology::Mesh);
    let now = program.fleet("some cycles", |now| now.cycle >= 4);
    let killed = now.nodes[2].process.expect("a process");
    signal(killed, "KILL");
    let again = program.fleet("it is back", |now| {
        let node = &now.nodes[2];
        node.lives == 2 && node.process != Some(killed) && node.state != "gone"
    });
    let flown = again.nodes[2].flown;
    program.fleet("it flies again", |now| now.nodes[2].flown > flown + 1);
    let (losses, fleet) = ended(program);
    assert_eq!(losses, 0);
    assert!(fleet.nodes[2].late > 0, "meanwhile it stayed on its orbit: {fleet:?}");
}

#[test]
fn a_node_that_is_stopped_is_late_and_flies_on_when_it_goes_on() {
    let folder = folder(&wide(&superconflict(4, "compact-team", 1_000_000, ""), 8_000));
    let program = program(folder.path(), Topology::Star);
    let now = program.fleet("some cycles", |now| now.cycle >= 4);
    let stopped = now.nodes[1].process.expect("a process");
    signal(stopped, "STOP");
    let late = program.fleet("it is late", |now| now.nodes[1].late >= 2);
    let others = late.nodes[0].flown;
    program.fleet("the others fly on", |now| now.nodes[0].flown > others);
    signal(stopped, "CONT");
    let flown = late.nodes[1].flown;
    program.fleet("it flies again", |now| now.nodes[1].flown > flown);
    let (losses, _) = ended(program);
    assert_eq!(losses, 0);
}

/// The server does not rush to catch up, and counts that it was late.
#[test]
fn a_server_that_is_stopped_for_a_while_is_late_once_and_goes_on() {
    let folder = folder(&wide(&superconflict(3, "compact-team", 1_000_000, ""), 8_000));
    let program = program(folder.path(), Topology::Star);
    let now = program.fleet("some cycles", |now| now.cycle >= 4);
    let before = now.late_cycles;
    signal(program.child.id(), "STOP");
    std::thread::sleep(Duration::from_millis(1_500));
    signal(program.child.id(), "CONT");
    let after = program.fleet("it goes on", |later| later.cycle > now.cycle + 3);
    assert!(after.late_cycles > before, "{after:?}");
    let (losses, fleet) = ended(program);
    assert_eq!(losses, 0);
    assert!(fleet.nodes.iter().all(|node| node.lives == 1), "nobody has given it up: {fleet:?}");
}
