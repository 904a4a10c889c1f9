//! Wrong input: exit code 2, nothing started or written, the remedy said.

use crate::processes::{LinkProcess, folder, job};
use crate::support::{run_in_one_process, superconflict};
use sidestep::worlds::WORLDS;
use sidestep_session::fleet::{
    AgentName, ClockMode, CommonSettings, FleetJob, Job, JobScenario, LinkMessage, NodeJob,
    Topology, WatchJob,
};
use std::net::TcpListener;
use std::path::Path;

fn fleet(folder: &Path) -> FleetJob {
    job(folder, Topology::Star, ClockMode::Lockstep)
}

fn flown(job: &FleetJob, change: impl FnOnce(&mut JobScenario)) -> FleetJob {
    let mut job = job.clone();
    change(&mut job.common.flown);
    job
}

fn with(job: &FleetJob, key: &str) -> FleetJob {
    flown(job, |flown| flown.overrides.push(key.into()))
}

/// Does a job that is wrong, and returns the message.
pub(crate) fn refused(job: &Job) -> String {
    let (code, failed) = LinkProcess::start(job).end();
    let failed = failed.expect("it says why");
    let said = format!("{}: {}; {}", failed.place, failed.cause, failed.remedy);
    assert!(failed.is_input && !failed.remedy.is_empty(), "{said}");
    assert_eq!(code, Some(2), "{said}");
    said
}

#[test]
fn a_fleet_that_cannot_be_flown_is_refused_before_anything_is_started() {
    let folder = folder(&superconflict(3, "compact-team", 5, ""));
    let right = fleet(folder.path());
    let out = folder.path().join("run");
    let right = FleetJob { out: Some(out.clone()), ..right };
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let taken = taken.local_addr().expect("bound").to_string();
    let listen = |endpoint: &str| FleetJob { listen: vec![endpoint.into()], ..right.clone() };
    let metrics = |address: &str| {
        let common = CommonSettings { metrics: Some(address.into()), ..right.common.clone() };
        FleetJob { common, ..right.clone() }
    };
    let wrong = [
        (flown(&right, |flown| flown.file = "nowhere.toml".into()), "nowhere.toml"),
        (flown(&right, |flown| flown.build = "0.0.0".into()), "0.0.0"),
        (with(&right, "airspace.deployment=direct"), "one process decides for all"),
        (with(&right, "airspace.generator.n=-1"), "n = -1"),
        (listen(&format!("tcp/{taken}")), "cannot listen"),
        (listen("tcp/0.0.0.0:0"), "or, on a network that you trust, --insecure"),
        (listen("tcp/192.0.2.1:7600"), "not of this machine alone"),
        (listen("tcp/[2001:db8::1]:7600"), "not of this machine alone"),
        (listen("127.0.0.1:7600"), "tcp/HOST:PORT"),
        (metrics(&taken), "--metrics"),
        (metrics("no address"), "--metrics"),
        (metrics("0.0.0.0:0"), "or, on a network that you trust, --insecure"),
    ];
    for (job, cause) in wrong {
        let said = refused(&Job::Fleet(job));
        assert!(said.contains(cause), "{cause} in {said}");
        assert!(!out.exists(), "{cause}: nothing is written");
    }
    let level = CommonSettings { log: "loud".into(), ..right.common.clone() };
    assert!(refused(&Job::Fleet(FleetJob { common: level, ..right.clone() })).contains("loud"));
    std::fs::create_dir(&out).expect("made");
    std::fs::write(out.join("something"), "").expect("written");
    assert!(refused(&Job::Fleet(right)).contains("run"));
}

/// By the rule of nodes: the way of the pictures is as open to others as that of controls.
#[test]
fn a_viewer_leaves_its_machine_without_certificates_only_where_the_network_is_said_to_be_trusted() {
    let job = |endpoint: &str, is_insecure| {
        Job::Watch(WatchJob {
            build: WORLDS.build().into(),
            connect: vec!["tcp/127.0.0.1:9".into(), endpoint.into()],
            tls: None,
            is_insecure,
            patience_s: 0.5,
        })
    };
    for elsewhere in ["tcp/192.0.2.1:9", "tcp/[2001:db8::1]:9", "tcp/fleet.example:9"] {
        let said = refused(&job(elsewhere, false));
        assert!(
            said.starts_with(&format!("{elsewhere}: it is not of this machine alone")),
            "{said}"
        );
        assert!(said.contains("or, on a network that you trust, --insecure"), "{said}");
    }
    for (here, is_insecure) in [("tcp/localhost:9", false), ("tcp/127.0.0.2:9", true)] {
        let (code, failed) = LinkProcess::start(&job(here, is_insecure)).end();
        let failed = failed.expect("it says why");
        assert!(failed.cause.contains("no answer from"), "{failed:?}");
        assert_eq!(code, Some(1), "{failed:?}");
    }
}

/// One airplane is flown here, and the other one is awaited.
#[test]
fn nodes_that_do_not_belong_to_a_fleet_are_refused_and_the_one_that_does_completes_it() {
    let text = superconflict(2, "compact-team", 20, "");
    let folder = folder(&text);
    let fleet = FleetJob { nodes: Some(1), ..fleet(folder.path()) };
    let program = LinkProcess::start(&Job::Fleet(fleet.clone()));
    let connect = program.until("its endpoints", |message| match message {
        LinkMessage::Listens(endpoints) => Some(endpoints),
        _ => None,
    });
    program.fleet("the first node", |now| now.nodes[0].state == "joined");
    let node = |fleet: &FleetJob, airplane| {
        let agent = AgentName::new("airplane", airplane, None);
        let common = fleet.common.clone();
        let (connect, listen, patience_s) = (connect.clone(), Vec::new(), 30.0);
        Job::Node(NodeJob { common, agent, connect, listen, patience_s })
    };
    let wrong = [
        (node(&fleet, 0), "has a node already"),
        (node(&fleet, 7), "give --airplane 0 to 1"),
        (node(&with(&fleet, "seed=6"), 1), "another scenario"),
        (node(&flown(&fleet, |flown| flown.build = "0.0.0".into()), 1), "0.0.0"),
    ];
    for (job, cause) in wrong {
        let said = refused(&job);
        assert!(said.contains(cause), "{cause} in {said}");
    }
    let last = LinkProcess::start(&node(&fleet, 1));
    let (summary, _) = program.complete();
    assert_eq!(summary["digest"], run_in_one_process(&text).digest);
    assert_eq!((program.end(), last.end()), ((Some(0), None), (Some(0), None)));
}

#[test]
fn a_node_whose_server_is_not_there_gives_up_in_time() {
    let folder = folder(&superconflict(2, "compact-team", 5, ""));
    let nobody = TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("bound");
    let job = NodeJob {
        common: fleet(folder.path()).common,
        agent: AgentName::new("airplane", 0, None),
        connect: vec![format!("tcp/{nobody}")],
        listen: Vec::new(),
        patience_s: 0.5,
    };
    let (code, failed) = LinkProcess::start(&Job::Node(job)).end();
    let failed = failed.expect("it says why");
    assert_eq!(code, Some(1));
    assert!(failed.cause.contains("no answer from"), "{failed:?}");
}
