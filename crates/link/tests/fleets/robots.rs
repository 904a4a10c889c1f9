//! Robots that are nodes: they give the same results as in one process, and wait for one that is lost.

use crate::input::refused;
use crate::processes::{LinkProcess, folder, job, signal};
use crate::support::{run_in_one_process, untimed};
use crate::threads::run_over_memory;
use sidestep::worlds::WORLDS;
use sidestep_session::fleet::{AgentName, ClockMode, FleetJob, Job, NodeJob, Topology};
use sidestep_session::{NoWatcher, RecordedRun, replay_all};

/// Robots with sensors that lie, wheels that slip and a radio, among people; `more` is the rest of a section of robots.
fn office(cycles: u64, more: &str) -> String {
    format!(
        "format = 1\nworld = \"robots\"\nname = \"office\"\nseed = 4\ncycles = {cycles}\n\
         [map.office]\ncorridors = 1\nrooms_per_side = 2\n[map]\nbox_size_m = 0.25\n\
         [radio]\nrange_m = 4\nloss = 0.1\n\
         [[robots]]\ncount = 4\nsize = 2\nsensors = [\"sonar-ring\"]\neffector = \"nomad\"\n{more}\n\
         [people]\ncount = 3\nperiod = 2\n"
    )
}

const ANNOUNCE: &str = "behaviour = { kind = \"announce\", turn_every = 20 }";
const SHUTTLE: &str = "behaviour = { kind = \"shuttle\", a = [1, 22, 3, 8], b = [28, 22, 3, 8], avoidance = \"plan\" }";

#[test]
fn threads_come_out_as_one_process_does() {
    for more in [ANNOUNCE, SHUTTLE] {
        let text = office(60, more);
        let (threads, one) = (run_over_memory(&text), run_in_one_process(&text));
        assert!(one.metrics["distance_m"].as_f64() > Some(10.0), "{}", one.metrics);
        assert_eq!(threads, one, "{text}");
    }
}

#[test]
fn robots_that_a_planner_leads_come_out_as_in_one_process() {
    let led = "behaviour = { kind = \"shuttle\", a = [1, 22, 3, 8], b = [28, 22, 3, 8] }\n\
               planner = { method = \"lacam\", executor = \"adg\", window = 8 }";
    let text = office(60, led).replace("effector = \"nomad\"", "effector = \"perfect\"");
    assert_eq!(run_over_memory(&text), run_in_one_process(&text));
}

#[test]
fn processes_come_out_as_one_process_does_and_leave_a_folder_that_is_replayed() {
    for topology in [Topology::Mesh, Topology::Star] {
        let text = office(40, SHUTTLE);
        let folder = folder(&text);
        let out = folder.path().join("run");
        let job = job(folder.path(), topology, ClockMode::Lockstep);
        let program = LinkProcess::start(&Job::Fleet(FleetJob { out: Some(out.clone()), ..job }));
        let (summary, fleet) = program.complete();
        assert_eq!(program.end(), (Some(0), None));
        let one = run_in_one_process(&text);
        assert_eq!(summary["digest"], one.digest, "{text}");
        assert_eq!(untimed(summary["metrics"].clone()), one.metrics);
        assert_eq!((&*fleet.noun, fleet.nodes.len()), ("robot", 4));
        assert!(fleet.nodes.iter().all(|node| node.late == 0 && node.flown == 40), "{fleet:?}");
        let recorded = RecordedRun::open(&WORLDS, &out).expect("an ordinary folder");
        replay_all(&recorded, 1, &NoWatcher).expect("computed again, to the same digest");
    }
}

#[test]
fn in_real_time_a_run_is_complete_and_is_replayed_whatever_came_late() {
    let text = office(60, ANNOUNCE);
    let folder = folder(&text);
    let out = folder.path().join("run");
    let job = job(folder.path(), Topology::Star, ClockMode::Realtime { speed: 20.0 });
    let program = LinkProcess::start(&Job::Fleet(FleetJob { out: Some(out.clone()), ..job }));
    let (_, fleet) = program.complete();
    assert_eq!(program.end(), (Some(0), None));
    assert!(fleet.nodes.iter().all(|node| node.flown + node.late == 60), "{fleet:?}");
    let recorded = RecordedRun::open(&WORLDS, &out).expect("an ordinary folder");
    replay_all(&recorded, 1, &NoWatcher).expect("computed again, to the same digest");
}

#[test]
fn a_fleet_waits_for_a_robot_that_was_killed_and_only_one_cycle_is_made_without_it() {
    let folder = folder(&office(3_000, ANNOUNCE));
    let out = folder.path().join("run");
    let mut job = job(folder.path(), Topology::Star, ClockMode::Lockstep);
    job.common.lease_s = 10.0;
    let program = LinkProcess::start(&Job::Fleet(FleetJob { out: Some(out.clone()), ..job }));
    let now = program.fleet("some cycles", |now| now.cycle >= 1);
    signal(now.nodes[2].process.expect("a process"), "KILL");
    let waits = program.fleet("it is missed", |now| now.waits_for == ["2"]);
    let back = program.fleet("it is back", |now| now.waits_for.is_empty());
    assert_eq!((waits.nodes[2].state.as_str(), back.nodes[2].lives), ("gone", 2));
    let (_, fleet) = program.complete();
    assert_eq!(program.end(), (Some(0), None));
    let missed: u64 = fleet.nodes.iter().map(|node| node.late).sum();
    assert!(missed <= 1, "only the cycle under way was made without it: {fleet:?}");
    let recorded = RecordedRun::open(&WORLDS, &out).expect("an ordinary folder");
    replay_all(&recorded, 1, &NoWatcher).expect("computed again, to the same digest");
}

#[test]
fn robots_that_cannot_be_nodes_are_refused_with_the_way_to_make_them_some() {
    let external = office(5, "behaviour = { kind = \"external\" }");
    let folder_of_external = folder(&external);
    let fleet = job(folder_of_external.path(), Topology::Star, ClockMode::Lockstep);
    let said = refused(&Job::Fleet(fleet));
    assert!(said.contains("robot 0 follows the orders of a caller"), "{said}");
    let folder = folder(&office(5, ANNOUNCE));
    let fleet = job(folder.path(), Topology::Star, ClockMode::Lockstep);
    let node = |number| {
        let mut agent = AgentName::new("robot", number, None);
        if number == 7 {
            agent.noun = "airplane".into();
        }
        Job::Node(NodeJob {
            common: fleet.common.clone(),
            agent,
            connect: vec!["tcp/127.0.0.1:1".into()],
            listen: Vec::new(),
            patience_s: 1.0,
        })
    };
    for (number, cause) in
        [(9, "the scenario has no robot 9"), (7, "the scenario has no airplane 7")]
    {
        let said = refused(&node(number));
        assert!(said.contains(cause) && said.contains("give --robot 0 to 3"), "{said}");
    }
}
