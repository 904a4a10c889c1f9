//! Flights without a server as processes on loopback: what is recorded, what is flown when nodes are killed, and what is refused.

use crate::input::refused;
use crate::processes::{LinkProcess, folder, job, signal};
use crate::tls::authority;
use serde_json::Value;
use sidestep::worlds::WORLDS;
use sidestep_session::fleet::{
    AgentName, ClockMode, CommonSettings, FleetStatus, FlightClock, FlightJob, FlightNetwork,
    FlightRecorderJob, GuardSettings, Job, LinkMessage, ModelPlantSettings, PlantChoice, Topology,
};
use sidestep_session::{ManagedRun, NoWatcher, OutputPaths, RecordedRun, RunStatus, replay_all};
use std::path::Path;

/// Seconds of the scenario in a second: a cycle takes half a second.
const SPEED: f64 = 4.0;

/// Returns the text of a scenario: a ring of airplanes with cycles of two seconds.
pub(crate) fn ring(n: usize, cycles: u64, network: &str) -> String {
    format!(
        "format = 1\nworld = \"airspace\"\nseed = 3\ncycles = {cycles}\n[airspace]\n\
         deployment = \"replica-team\"\ngroups = \"heard\"\ndt_s = 2.0\nmax_rounds = 20\n\
         [airspace.network]\ndeadline_s = 0.7\npatience_s = 0.08\n{network}\n\
         [airspace.generator]\nkind = \"superconflict\"\nn = {n}\nradius_m = 200.0\njitter_m = 5.0\n\
         [airplane]\nv_m_s = 10.0\nomega_max_deg_s = 20.0\nseparation_m = 30.0\nnic = 11\n"
    )
}

fn common(folder: &Path) -> CommonSettings {
    job(folder, Topology::Mesh, ClockMode::Lockstep).common
}

fn plant() -> PlantChoice {
    PlantChoice::Model(ModelPlantSettings { lag_s: 0.3, noise_m: 0.5 })
}

/// Limits that no busy machine exceeds.
fn guard() -> GuardSettings {
    GuardSettings { max_age_s: 300.0, patience_s: 300.0, ..GuardSettings::default() }
}

fn clock() -> FlightClock {
    FlightClock { start_s: None, speed: SPEED, tolerance_s: 30.0 }
}

pub(crate) fn recorder(folder: &Path) -> FlightRecorderJob {
    FlightRecorderJob {
        common: common(folder),
        nodes: None,
        clock: clock(),
        network: FlightNetwork { listen: Vec::new(), peers: Vec::new(), is_scouting: false },
        plant: plant(),
        guard: guard(),
        out: Some(folder.join("run")),
        replace: false,
    }
}

/// Returns how often something was counted by all nodes.
pub(crate) fn counted(fleet: &FleetStatus, name: &str) -> u64 {
    let counts = fleet.nodes.iter().flat_map(|node| &node.counts);
    counts.filter(|(counted, _)| counted == name).map(|(_, count)| count).sum()
}

pub(crate) fn check_recording(folder: &Path, summary: &Value) {
    assert_eq!(summary["metrics"]["losses_of_separation"], 0, "{summary}");
    let recorded = RecordedRun::open(&WORLDS, &folder.join("run")).expect("an ordinary folder");
    replay_all(&recorded, 1, &NoWatcher).expect("computed again, to the same digest");
}

/// Returns the digest of the scenario in one process.
fn digest_of_one_process(folder: &Path) -> String {
    let read = sidestep_session::read_scenario(&WORLDS, &folder.join("s.toml"), &[]);
    let (source, compiled) = read.expect("a scenario");
    let paths = OutputPaths::default();
    let run = ManagedRun::start(&WORLDS, compiled.as_ref(), &source, 1, paths);
    let mut run = run.expect("started");
    let cycles = run.simulation().config().cycles;
    run.advance_to(cycles, &NoWatcher).expect("flown");
    run.finish(&NoWatcher).expect("finished").digest
}

#[test]
fn processes_on_loopback_fly_as_one_process_and_the_recording_replays() {
    let folder = folder(&ring(4, 20, ""));
    let program = LinkProcess::start(&Job::FlightRecorder(Box::new(recorder(folder.path()))));
    let (summary, fleet) = program.complete();
    assert_eq!(program.end(), (Some(0), None));
    check_recording(folder.path(), &summary);
    let differing: u64 = fleet.nodes.iter().map(|node| node.differing).sum();
    let unknown: u64 = fleet.nodes.iter().map(|node| node.late).sum();
    let late = ["late-controls", "refused-controls", "late-cycles", "unheard-cycles"];
    let late: u64 = late.into_iter().map(|name| counted(&fleet, name)).sum();
    let late = late + summary["metrics"]["contacts_lost"].as_u64().expect("a count");
    assert_eq!(differing, 0, "what is recorded is what was flown: {fleet:?}");
    // A machine that is too busy for half a second a cycle flies otherwise, and says so.
    if late + unknown > 0 {
        println!("not compared with one process: {late} late, {unknown} unknown");
        return;
    }
    assert_eq!(summary["digest"], digest_of_one_process(folder.path()));
}

#[test]
fn a_node_that_is_killed_returns_and_no_pair_loses_separation() {
    let folder = folder(&ring(4, 34, "loss = 0.15\nmax_delay_s = 0.02"));
    let program = LinkProcess::start(&Job::FlightRecorder(Box::new(recorder(folder.path()))));
    let fleet = program.fleet("some cycles", |now| now.cycle >= 5);
    let process = fleet.nodes[1].process.expect("it is there");
    signal(process, "KILL");
    let (summary, fleet) = program.complete();
    check_recording(folder.path(), &summary);
    assert_eq!(fleet.nodes[1].lives, 2, "{fleet:?}");
    assert!(counted(&fleet, "unheard-cycles") > 0, "{fleet:?}");
}

#[test]
fn nodes_that_are_started_one_by_one_find_each_other_by_listed_endpoints() {
    let folder = folder(&ring(3, 10, ""));
    let mut endpoints: Vec<String> = Vec::new();
    let mut nodes = Vec::new();
    for airplane in 0..3 {
        let node = FlightJob {
            common: common(folder.path()),
            agent: AgentName::new("airplane", airplane, None),
            clock: clock(),
            network: FlightNetwork {
                listen: vec!["tcp/127.0.0.1:0".into()],
                peers: endpoints.clone(),
                is_scouting: false,
            },
            plant: plant(),
            guard: guard(),
            journal: None,
        };
        let node = LinkProcess::start(&Job::Flight(Box::new(node)));
        let listens = node.until("its endpoint", |message| match message {
            LinkMessage::Listens(endpoints) => Some(endpoints),
            LinkMessage::Failed(failed) => panic!("{failed:?}"),
            _ => None,
        });
        endpoints.extend(listens);
        nodes.push(node);
    }
    let network = FlightNetwork { listen: Vec::new(), peers: endpoints, is_scouting: false };
    let job = FlightRecorderJob { nodes: Some(0), network, ..recorder(folder.path()) };
    let program = LinkProcess::start(&Job::FlightRecorder(Box::new(job)));
    let (summary, _) = program.complete();
    check_recording(folder.path(), &summary);
    for node in nodes {
        let arrived = node.until("its end", |message| match message {
            LinkMessage::Flight(status) if status.state == "done" => Some(status),
            LinkMessage::Failed(failed) => panic!("{failed:?}"),
            _ => None,
        });
        assert!(arrived.max_deviation_m > 0.0, "a model that lags is behind: {arrived:?}");
        assert_eq!(node.end(), (Some(0), None));
    }
}

#[test]
fn with_certificates_all_links_are_encrypted_and_a_flight_ends_as_ever() {
    let folder = folder(&ring(3, 8, ""));
    let Some(tls) = authority(folder.path(), "ours", 2) else { return };
    let job = recorder(folder.path());
    let common = CommonSettings { tls: Some(tls), ..job.common.clone() };
    let job = FlightRecorderJob { common, ..job };
    let program = LinkProcess::start(&Job::FlightRecorder(Box::new(job)));
    let (summary, fleet) = program.complete();
    check_recording(folder.path(), &summary);
    assert!(fleet.nodes.iter().all(|node| node.flown > 0), "{fleet:?}");
}

#[test]
fn a_flight_that_is_cut_off_is_on_disk() {
    let folder = folder(&ring(3, 1000, ""));
    let mut program = LinkProcess::start(&Job::FlightRecorder(Box::new(recorder(folder.path()))));
    program.fleet("some cycles", |now| now.cycle >= 3);
    drop(program.stdin.take());
    let failed = program.until("the reason", |message| match message {
        LinkMessage::Failed(failed) => Some(failed),
        _ => None,
    });
    assert!(failed.is_interrupted, "{failed:?}");
    drop(program);
    let summary = std::fs::read_to_string(folder.path().join("run/summary.json"));
    let summary: Value = serde_json::from_str(&summary.expect("a summary")).expect("JSON");
    assert_ne!(summary["status"], serde_json::to_value(RunStatus::Complete).expect("plain data"));
    assert!(summary["cycles"].as_u64() >= Some(3), "{summary}");
}

#[test]
fn what_cannot_be_flown_is_refused_before_anything_starts() {
    let good = ring(3, 10, "");
    for (text, words) in [
        (good.replace("replica-team", "direct").replace("groups = \"heard\"\n", ""), "deployment"),
        (
            good.replace("deadline_s = 0.7\npatience_s = 0.08", ""),
            "airspace.network.deadline_s=0.7",
        ),
        (good.replace("dt_s = 2.0", "dt_s = 2.0\nposition_noise_m = 2.0"), "position_noise_m"),
    ] {
        let folder = folder(&text);
        let said = refused(&Job::FlightRecorder(Box::new(recorder(folder.path()))));
        assert!(said.contains(words), "{words}: {said}");
        assert!(!folder.path().join("run").exists());
    }
    let folder = folder(&good);
    let far = FlightNetwork {
        listen: vec!["tcp/192.0.2.1:7601".into()],
        peers: Vec::new(),
        is_scouting: false,
    };
    let job = FlightRecorderJob { network: far, ..recorder(folder.path()) };
    let said = refused(&Job::FlightRecorder(Box::new(job)));
    assert!(said.contains("--insecure"), "{said}");
    let scouting = FlightNetwork { listen: Vec::new(), peers: Vec::new(), is_scouting: true };
    let job = FlightRecorderJob { network: scouting, ..recorder(folder.path()) };
    assert!(refused(&Job::FlightRecorder(Box::new(job))).contains("--insecure"));
}
