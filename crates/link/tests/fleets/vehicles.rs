//! Robots for which a program of a user decides, over the public wire: `examples/vehicle.py`, as its users run it.

use crate::processes::{LinkProcess, folder, job};
use crate::support::{run_in_one_process, superconflict};
use sidestep::worlds::WORLDS;
use sidestep_session::fleet::{
    AgentName, ClockMode, FleetJob, Job, LinkMessage, NodeJob, Topology, VehicleJob,
};
use sidestep_session::{NoWatcher, RecordedRun, replay_all};
use sidestep_testing::{has_modules, python, root};
use std::path::Path;
use std::process::{Child, Command};

const FLOOR: &str = "format = 1\nworld = \"robots\"\nname = \"floor\"\nseed = 6\ncycles = 40\n[map]\nascii = \"\"\"\n\
    ..........\n..........\n....##....\n..........\n..........\n\"\"\"\n\
    [[robots]]\ncount = 3\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n";

/// What a vehicle imports.
pub(crate) const MODULES: &str = "numpy, rosbags.typesys, zenoh";

/// A vehicle that is ended when it is dropped.
pub(crate) struct Vehicle(Child);

impl Vehicle {
    pub(crate) fn start(robot: u32, endpoint: &str, cycles: u32) -> Self {
        let mut command = Command::new(python());
        command.arg(root().join("examples/vehicle.py"));
        command.args(["--robot", &robot.to_string(), "--connect", endpoint]);
        command.args(["--cycles", &cycles.to_string()]);
        Self(command.spawn().expect("Python starts"))
    }

    pub(crate) fn id(&self) -> u32 {
        self.0.id()
    }

    /// Returns whether it has ended well.
    fn has_ended_well(mut self) -> bool {
        self.0.wait().expect("a process of this test").success()
    }
}

impl Drop for Vehicle {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts a fleet of which the last one of three robots has no node yet; returns it with the endpoint of its server.
fn fleet_without_the_last(folder: &Path, clock: ClockMode) -> (LinkProcess, FleetJob, String) {
    fleet_without_the_last_of(folder, clock, 3)
}

/// Returns the same with a number of robots.
pub(crate) fn fleet_without_the_last_of(
    folder: &Path,
    clock: ClockMode,
    robots: u32,
) -> (LinkProcess, FleetJob, String) {
    let job = FleetJob {
        nodes: Some(robots as usize - 1),
        out: Some(folder.join("run")),
        ..job(folder, Topology::Star, clock)
    };
    let program = LinkProcess::start(&Job::Fleet(job.clone()));
    let endpoint = listens(&program);
    (program, job, endpoint)
}

/// Returns the endpoint at which a program listens.
pub(crate) fn listens(program: &LinkProcess) -> String {
    program.until("it listens", |message| match message {
        LinkMessage::Listens(endpoints) => endpoints.into_iter().next(),
        _ => None,
    })
}

/// Returns the job of the node of a robot, for a vehicle.
pub(crate) fn vehicle_job(fleet: &FleetJob, server: &str, endpoint: &str, robot: u32) -> Job {
    let node = NodeJob {
        common: fleet.common.clone(),
        agent: AgentName::new("robot", robot, None),
        connect: vec![server.into()],
        listen: Vec::new(),
        patience_s: 60.0,
    };
    Job::Vehicle(VehicleJob { node, endpoint: endpoint.into() })
}

#[test]
fn a_vehicle_in_python_joins_a_fleet_in_lockstep_and_decides_in_every_cycle() {
    if !has_modules(MODULES) {
        return;
    }
    let folder = folder(FLOOR);
    let (fleet, job, server) = fleet_without_the_last(folder.path(), ClockMode::Lockstep);
    let node = LinkProcess::start(&vehicle_job(&job, &server, "tcp/127.0.0.1:0", 2));
    let vehicle = Vehicle::start(2, &listens(&node), 40);
    let (summary, status) = fleet.complete();
    assert_eq!(fleet.end(), (Some(0), None));
    assert_eq!(node.end(), (Some(0), None));
    assert!(vehicle.has_ended_well());
    assert!(status.nodes.iter().all(|node| (node.flown, node.late) == (40, 0)), "{status:?}");
    assert_ne!(summary["digest"], run_in_one_process(FLOOR).digest, "it decides by itself");
    let distance_m = summary["metrics"]["distance_m"].as_f64().expect("a metric");
    assert!(distance_m > 5.0, "{distance_m}");
    let recorded = RecordedRun::open(&WORLDS, &folder.path().join("run")).expect("a run");
    replay_all(&recorded, 1, &NoWatcher).expect("computed again, to the same digest");
}

#[test]
fn in_real_time_a_vehicle_that_is_gone_makes_its_robot_stand_and_another_one_takes_over() {
    if !has_modules(MODULES) {
        return;
    }
    let folder = folder(&FLOOR.replace("cycles = 40", "cycles = 100000"));
    // A fifth of a second for a cycle: a vehicle in Python on a busy machine decides within that, if not always.
    let clock = ClockMode::Realtime { speed: 5.0 };
    let (mut fleet, job, server) = fleet_without_the_last(folder.path(), clock);
    let node = LinkProcess::start(&vehicle_job(&job, &server, "tcp/127.0.0.1:0", 2));
    let endpoint = listens(&node);
    // As many decisions as it takes until ten of them were in time.
    let first = Vehicle::start(2, &endpoint, 1_000_000);
    let now = fleet.fleet("ten decisions", |now| now.nodes.len() == 3 && now.nodes[2].flown >= 10);
    drop(first);
    let missed = now.nodes[2].late;
    let alone = fleet.fleet("its controls are late", |now| now.nodes[2].late > missed + 5);
    let _second = Vehicle::start(2, &endpoint, 1_000_000);
    let flown = alone.nodes[2].flown;
    fleet.fleet("another vehicle decides", |now| now.nodes[2].flown > flown + 10);
    drop(fleet.stdin.take());
    assert_eq!(fleet.end().0, Some(130));
    let recorded = RecordedRun::open(&WORLDS, &folder.path().join("run")).expect("a run");
    replay_all(&recorded, 1, &NoWatcher).expect("computed again, to the same digest");
}

#[test]
fn an_endpoint_for_a_vehicle_that_others_reach_needs_insecure_and_other_worlds_have_none() {
    let folder = folder(FLOOR);
    let fleet = job(folder.path(), Topology::Star, ClockMode::Lockstep);
    let open = vehicle_job(&fleet, "tcp/127.0.0.1:1", "tcp/0.0.0.0:7700", 2);
    let said = crate::input::refused(&open);
    assert!(said.contains("--insecure"), "{said}");
    let ring = crate::processes::folder(&superconflict(3, "team", 5, ""));
    let fleet = job(ring.path(), Topology::Star, ClockMode::Lockstep);
    let node = NodeJob {
        common: fleet.common,
        agent: AgentName::new("airplane", 2, None),
        connect: vec!["tcp/127.0.0.1:1".into()],
        listen: Vec::new(),
        patience_s: 1.0,
    };
    let endpoint = "tcp/127.0.0.1:0".into();
    let said = crate::input::refused(&Job::Vehicle(VehicleJob { node, endpoint }));
    assert!(said.contains("no public messages for an agent of the kind `airplane`"), "{said}");
}
