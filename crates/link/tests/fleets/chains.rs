//! Chains of connectors that are nodes: they give the same results as in one process, and stand still while one of
//! them is missing.

use crate::input::refused;
use crate::processes::{LinkProcess, folder, job, signal};
use crate::support::{chain_in_space, run_in_one_process, two_chains, untimed};
use crate::threads::run_over_memory;
use sidestep::kernel::EntityId;
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use sidestep_link::hosted_run::HostedRun;
use sidestep_link::worlds::distributed_world;
use sidestep_record::read_table;
use sidestep_session::fleet::{
    AgentName, ClockMode, FleetJob, Job, LinkMessage, NodeJob, Topology,
};
use sidestep_session::{ManagedRun, NoWatcher, OutputPaths, RecordedRun, RunStatus, replay_all};
use std::path::Path;

const LOSSY: &str = "network = { loss = 0.1, duplication = 0.1, max_delay_s = 2e-5, range_m = 0.34, \
    silent = [{ connector = 1, from_s = 0.3, until_s = 0.5 }] }";

#[test]
fn threads_come_out_as_one_process_does_in_the_plane_and_in_space() {
    for text in [two_chains(5, 40, ""), chain_in_space(7, 40, "")] {
        let (threads, one) = (run_over_memory(&text), run_in_one_process(&text));
        assert!(one.metrics["messages"].as_u64() > Some(100), "{}", one.metrics);
        assert_eq!(threads, one, "{text}");
    }
}

#[test]
fn the_scenarios_own_faults_are_the_same_ones_in_threads_to_the_last_message() {
    for text in [two_chains(4, 15, LOSSY), chain_in_space(5, 15, LOSSY)] {
        let (threads, one) = (run_over_memory(&text), run_in_one_process(&text));
        assert!(one.metrics["contacts_lost"].as_u64() > Some(0), "{}", one.metrics);
        assert_eq!(threads, one, "{text}");
    }
}

#[test]
fn chains_that_may_meet_decide_one_after_the_other_in_rounds_of_one_cycle() {
    let text = two_chains(5, 40, "");
    let source = Source::new("s.toml", text, "");
    let compiled = WORLDS.compile(&source).expect("a scenario");
    let world = distributed_world(compiled.as_ref(), &source).expect("connectors");
    let run = ManagedRun::start(&WORLDS, compiled.as_ref(), &source, 1, OutputPaths::default())
        .expect("started");
    let mut run = HostedRun::new(run, world, &NoWatcher);
    let (first, second): (Vec<EntityId>, Vec<EntityId>) = ((0..5).collect(), (5..10).collect());
    for (group, further) in [(first, 1), (second, 0)] {
        let percepts = run.percepts();
        let agents: Vec<EntityId> = percepts.iter().map(|percept| percept.agent).collect();
        assert_eq!((&agents, run.max_further_rounds(1)), (&group, further));
        assert!(percepts.iter().all(|percept| percept.group == group && percept.start.cycle == 0));
        assert!(run.accept_controls(&[group], Vec::new(), &[]).is_empty());
    }
    assert!(run.percepts().is_empty());
    run.advance().expect("it goes on, and both stand");
    assert_eq!((run.cycle(), run.percepts().len()), (1, 5));
    assert_eq!(run.simulation().metrics()["stood"], 2, "{}", run.simulation().metrics());
}

#[test]
fn processes_come_out_as_one_process_does_and_leave_a_folder_that_is_replayed() {
    let mesh = (two_chains(3, 25, ""), Topology::Mesh);
    let star = (chain_in_space(4, 25, LOSSY), Topology::Star);
    for (text, topology) in [mesh, star] {
        let folder = folder(&text);
        let out = folder.path().join("run");
        let job = job(folder.path(), topology, ClockMode::Lockstep);
        let program = LinkProcess::start(&Job::Fleet(FleetJob { out: Some(out.clone()), ..job }));
        let (summary, fleet) = program.complete();
        assert_eq!(program.end(), (Some(0), None));
        let one = run_in_one_process(&text);
        assert_eq!(summary["digest"], one.digest, "{text}");
        assert_eq!(untimed(summary["metrics"].clone()), one.metrics);
        let packets: u64 = fleet.nodes.iter().map(|node| node.packets).sum();
        assert_eq!(summary["metrics"]["messages"], packets, "nodes count what the run does");
        assert!(fleet.nodes.iter().all(|node| node.late == 0), "{fleet:?}");
        let recorded = RecordedRun::open(&WORLDS, &out).expect("an ordinary folder");
        replay_all(&recorded, 1, &NoWatcher).expect("computed again, to the same digest");
    }
}

/// The job of a fleet that flies for a long time.
fn long(folder: &Path, topology: Topology, clock: ClockMode, lease_s: f64) -> FleetJob {
    let mut job = job(folder, topology, clock);
    job.common.lease_s = lease_s;
    FleetJob { out: Some(folder.join("run")), ..job }
}

/// Events of one kind: cycles and connectors.
fn events(out: &Path, kind: &str) -> Vec<(u64, u64)> {
    let table = read_table(out, "events", ..).expect("a table");
    let at = |name: &str| table.schema.columns.iter().position(|column| column.name == name);
    let kinds = &table.schema.columns[at("event").expect("a column")].labels;
    let number = |name: &str, row| {
        let values = table.column(name).unwrap_or_else(|| panic!("no column {name}"));
        values.number(row).expect("none is missing") as u64
    };
    let of_kind = |row: &usize| kinds[number("event", *row) as usize] == kind;
    let rows = (0..table.rows()).filter(of_kind);
    rows.map(|row| (number("cycle", row), number("connector", row))).collect()
}

/// Ends a fleet that would fly on, and lets its run go on to the end in one process; then replays it.
fn resumed(mut program: LinkProcess, out: &Path) {
    drop(program.stdin.take());
    assert_eq!(program.end().0, Some(130));
    let run = ManagedRun::resume(&WORLDS, out, 1, None).expect("it can be resumed");
    let summary = run.run_to_end(&NoWatcher).expect("flown to the end");
    assert_eq!(summary.status, RunStatus::Complete);
    let recorded = RecordedRun::open(&WORLDS, out).expect("an ordinary folder");
    replay_all(&recorded, 1, &NoWatcher).expect("computed again, to the same digest");
}

/// Checks that a fleet has waited for a node, said so, and gone on once it was back, in a number of lives.
fn waits_and_goes_on(program: &LinkProcess, again: impl FnOnce(), lives: u64) {
    let waits = program.fleet("it is missed", |now| now.waits_for == ["0.2"]);
    assert_eq!((&*waits.nodes[2].state, &*waits.noun), ("gone", "connector"), "{waits:?}");
    again();
    let back = program.fleet("it is back", |now| now.waits_for.is_empty());
    assert_eq!(back.nodes[2].lives, lives, "{back:?}");
    // The cycle under way was made without it, and no other cycle.
    assert!(back.cycle >= waits.cycle, "{waits:?} {back:?}");
    program.fleet("it flies again", |now| now.nodes[2].flown > back.nodes[2].flown + 1);
}

#[test]
fn a_chain_stands_while_a_node_that_was_killed_is_started_again_and_says_for_whom_it_waits() {
    let folder = folder(&two_chains(3, 6_000, ""));
    let mut job = long(folder.path(), Topology::Mesh, ClockMode::Lockstep, 10.0);
    job.common.log = "warn".into();
    let program = LinkProcess::start(&Job::Fleet(job));
    let now = program.fleet("some cycles", |now| now.cycle >= 1);
    signal(now.nodes[2].process.expect("a process"), "KILL");
    waits_and_goes_on(&program, || {}, 2);
    let said = program.logged().join("\n");
    assert!(said.contains("all wait for a node") && said.contains("connector 0.2"), "{said}");
    let out = folder.path().join("run");
    resumed(program, &out);
    let (lost, back) = (events(&out, "unheard"), events(&out, "heard"));
    // A node that was killed after its last word in a cycle is missed in none: it is back for the next.
    assert!(lost.len() <= 1, "the cycle under way, and no other: {lost:?}");
    let expected: Vec<_> = lost.iter().map(|(cycle, _)| (cycle + 1, 2)).collect();
    assert_eq!(back, expected, "by the next cycle it was back: {lost:?}");
    assert!(lost.iter().all(|(_, connector)| *connector == 2), "{lost:?}");
}

#[test]
fn a_chain_waits_for_a_node_that_is_stopped_and_comes_out_as_in_one_process_when_it_goes_on() {
    let text = two_chains(2, 2_000, "");
    let folder = folder(&text);
    let job = job(folder.path(), Topology::Star, ClockMode::Lockstep);
    let program = LinkProcess::start(&Job::Fleet(job));
    let now = program.fleet("some cycles", |now| now.cycle >= 1);
    let stopped = now.nodes[1].process.expect("a process");
    signal(stopped, "STOP");
    let waits = program.fleet("it is missed", |now| now.waits_for == ["0.1"]);
    assert_eq!(waits.nodes[1].state, "silent", "{waits:?}");
    let still = program.fleet("the next look", |_| true);
    assert_eq!(still.cycle, waits.cycle, "time stands still");
    signal(stopped, "CONT");
    let (summary, fleet) = program.complete();
    assert_eq!(summary["digest"], run_in_one_process(&text).digest);
    assert!(fleet.nodes.iter().all(|node| node.lives == 1 && node.late == 0), "{fleet:?}");
}

#[test]
fn a_node_that_is_stopped_for_longer_than_its_lease_takes_its_place_again_when_it_goes_on() {
    let folder = folder(&two_chains(3, 6_000, ""));
    let job = long(folder.path(), Topology::Star, ClockMode::Lockstep, 1.5);
    let program = LinkProcess::start(&Job::Fleet(job));
    let now = program.fleet("some cycles", |now| now.cycle >= 1);
    let stopped = now.nodes[2].process.expect("a process");
    signal(stopped, "STOP");
    program.fleet("its lease is over", |now| now.nodes[2].state == "gone");
    waits_and_goes_on(&program, || signal(stopped, "CONT"), 1);
}

#[test]
fn in_real_time_a_chain_stands_in_the_cycles_in_which_a_connector_is_late_and_goes_on() {
    let folder = folder(&chain_in_space(4, 1_000_000, ""));
    let out = folder.path().join("run");
    // Ten cycles a second.
    let job = long(folder.path(), Topology::Mesh, ClockMode::Realtime { speed: 0.5 }, 10.0);
    let mut program = LinkProcess::start(&Job::Fleet(job));
    let now = program.fleet("some cycles", |now| now.cycle >= 5 && now.nodes[1].flown >= 5);
    let stopped = now.nodes[1].process.expect("a process");
    signal(stopped, "STOP");
    let before = now.nodes[1].late;
    let late = program.fleet("it is late", |now| now.nodes[1].late >= before + 4);
    assert!(late.cycle > now.cycle, "time goes on");
    signal(stopped, "CONT");
    program.fleet("it flies again", |now| now.nodes[1].flown >= late.nodes[1].flown + 4);
    drop(program.stdin.take());
    let metrics = program.until("the end", |message| match message {
        LinkMessage::Ended { summary, .. } => Some(summary["metrics"].clone()),
        LinkMessage::Failed(failed) => panic!("{failed:?}"),
        _ => None,
    });
    program.end();
    assert!(metrics["stood"].as_u64() >= Some(4), "{metrics}");
    let (lost, back) = (events(&out, "unheard"), events(&out, "heard"));
    assert!(lost.iter().any(|(_, connector)| *connector == 1), "{lost:?}");
    assert!(back.iter().any(|(_, connector)| *connector == 1), "{back:?}");
}

#[test]
fn chains_of_which_somebody_must_see_all_are_refused_with_the_reason() {
    let folder = folder(&two_chains(3, 20, ""));
    let right = long(folder.path(), Topology::Star, ClockMode::Lockstep, 10.0);
    let with = |key: &str| {
        let mut job = right.clone();
        job.common.flown.overrides.push(key.into());
        job
    };
    for (key, cause) in [
        ("chain.deployment=direct", "add --set chain.deployment=team"),
        ("chain.self_collision=true", "set chain.self_collision = false"),
        ("chain.backtracks=64", "set chain.backtracks = 0"),
        ("chain.slave_step_max_m=inf", "slave_step_max_m = inf"),
    ] {
        let said = refused(&Job::Fleet(with(key)));
        assert!(said.contains(cause), "{cause} in {said}");
        assert!(!folder.path().join("run").exists(), "{key}: nothing is written");
    }
    let node = |agent| {
        let (connect, listen) = (vec!["tcp/127.0.0.1:9".into()], Vec::new());
        Job::Node(NodeJob { common: right.common.clone(), agent, connect, listen, patience_s: 1.0 })
    };
    let connector = |chain, connector| AgentName::new("connector", chain, Some(connector));
    for (agent, cause) in [
        (
            AgentName::new("airplane", 0, None),
            "the scenario has no airplane 0; give --connector 0.0 to 1.2",
        ),
        (connector(0, 3), "the scenario has no connector 0.3; give --connector 0.0 to 1.2"),
        (connector(2, 0), "no connector 2.0"),
    ] {
        let said = refused(&node(agent));
        assert!(said.contains(cause), "{cause} in {said}");
    }
}

/// A connector of a chain is a node of its own, elsewhere.
#[test]
fn a_node_joins_a_chain_by_the_name_of_its_connector_and_not_twice() {
    let text = two_chains(2, 20, "");
    let folder = folder(&text);
    let fleet =
        FleetJob { nodes: Some(3), ..job(folder.path(), Topology::Star, ClockMode::Lockstep) };
    let common = fleet.common.clone();
    let program = LinkProcess::start(&Job::Fleet(fleet));
    let connect = program.until("its endpoints", |message| match message {
        LinkMessage::Listens(endpoints) => Some(endpoints),
        _ => None,
    });
    program.fleet("the others", |now| now.nodes[0].state == "joined");
    let node = |connector: u32| {
        let agent = AgentName::new("connector", connector / 2, Some(connector % 2));
        let (common, connect) = (common.clone(), connect.clone());
        Job::Node(NodeJob { common, agent, connect, listen: Vec::new(), patience_s: 30.0 })
    };
    let said = refused(&node(0));
    assert!(said.contains("connector 0.0 has a node already"), "{said}");
    let last = LinkProcess::start(&node(3));
    let (summary, _) = program.complete();
    assert_eq!(summary["digest"], run_in_one_process(&text).digest);
    assert_eq!((program.end(), last.end()), ((Some(0), None), (Some(0), None)));
}
