//! Clocks: they are never compared, so one that is wrong, or jumps, changes nothing.

use crate::processes::{LinkProcess, folder, job, signal};
use crate::support::{run_in_one_process, superconflict, wide};
use serde_json::Value;
use sidestep_session::fleet::{
    AgentName, ClockMode, FleetJob, FleetStatus, Job, LinkMessage, NodeJob, Topology, link_command,
};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

const FAST: ClockMode = ClockMode::Realtime { speed: 20.0 };

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths.flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] }).collect()
}

/// Files that write the wall clock into messages for others, as ROS 2 and VDA 5050 ask for, or so that the numbers of messages
/// grow when a program starts anew; nothing here reads it there.
const DATED: [&str; 4] =
    ["ros2/node.rs", "program/dispatch.rs", "flight/time.rs", "drive/beacon.rs"];

/// Certificates and logs have dates; their libraries know them.
#[test]
fn no_code_of_fleets_names_the_wall_clock() {
    let all = sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    assert!(all.len() > 20, "{all:?}");
    for path in all.iter().filter(|path| !DATED.iter().any(|dated| path.ends_with(dated))) {
        let text = std::fs::read_to_string(path).expect("text");
        for name in ["SystemTime", "UNIX_EPOCH"] {
            assert!(!text.contains(name), "{name} in {}", path.display());
        }
    }
}

/// Code that replaces the system's wall clock by one that is an hour ahead in every other second.
const JUMPS: &str = r#"
#define _GNU_SOURCE
#include <dlfcn.h>
#include <time.h>
int clock_gettime(clockid_t id, struct timespec *at) {
  static int (*next)(clockid_t, struct timespec *);
  if (!next) next = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
  int answer = next(id, at);
  if (id == CLOCK_REALTIME && at->tv_sec % 2) at->tv_sec += 3600;
  return answer;
}
"#;

/// Builds it; `None` where that cannot be done, with a printed reason.
fn jumping_clock(folder: &Path) -> Option<PathBuf> {
    let [source, library] = ["jumps.c", "jumps.so"].map(|name| folder.join(name));
    std::fs::write(&source, JUMPS).expect("written");
    let mut command = Command::new("cc");
    command.args(["-shared", "-fPIC", "-o"]).args([&library, &source]).arg("-ldl");
    let is_built = command.output().is_ok_and(|output| output.status.success());
    if !is_built || !cfg!(target_os = "linux") {
        sidestep_testing::skip(
            "no clock can be made to jump here: that takes Linux and a C compiler",
        );
        return None;
    }
    Some(library)
}

fn start(job: &FleetJob, clock: &Path) -> LinkProcess {
    let mut command = link_command(env!("CARGO_BIN_EXE_sidestep-link"));
    command.env("LD_PRELOAD", clock);
    LinkProcess::start_by(command, &Job::Fleet(job.clone()))
}

#[test]
fn a_wall_clock_that_jumps_makes_nobody_late_or_lost() {
    let folder = folder(&wide(&superconflict(3, "compact-team", 1_000_000, ""), 8_000));
    let Some(clock) = jumping_clock(folder.path()) else { return };
    let mut job = job(folder.path(), Topology::Mesh, FAST);
    (job.common.lease_s, job.common.json_log, job.common.log) = (3.0, true, "debug".into());
    let mut program = start(&job, &clock);
    let now = program.fleet("jumps", |now| now.nodes.iter().all(|node| node.flown > 16));
    assert!(now.nodes.iter().all(|node| node.lives == 1 && node.late < 4), "{now:?}");
    let lines = program.logged();
    let hour = |line: &String| -> Option<String> {
        let line: Value = serde_json::from_str(line).ok()?;
        Some(line["timestamp"].as_str()?.get(..13)?.to_string())
    };
    let hours: BTreeSet<String> = lines.iter().filter_map(hour).collect();
    assert!(hours.len() > 1, "the clock has jumped: {hours:?}");
    drop(program.stdin.take());
    let losses = program.until("the end", |message| match message {
        LinkMessage::Ended { summary, .. } => {
            Some(summary["metrics"]["losses_of_separation"].clone())
        }
        _ => None,
    });
    assert_eq!(losses, 0);
}

/// Stops all processes of a fleet for longer than its lease, as a machine that is suspended does, and lets them go on.
fn suspend(server: &LinkProcess, fleet: &FleetStatus) {
    let nodes = fleet.nodes.iter().map(|node| node.process.expect("it has joined"));
    let processes: Vec<u32> = [server.child.id()].into_iter().chain(nodes).collect();
    processes.iter().for_each(|&process| signal(process, "STOP"));
    std::thread::sleep(Duration::from_secs(SHORT_LEASE_S + 2));
    processes.iter().for_each(|&process| signal(process, "CONT"));
}

/// Longer than links need to be opened again.
const SHORT_LEASE_S: u64 = 5;

#[test]
fn a_fleet_that_is_suspended_for_longer_than_its_lease_comes_out_as_in_one_process() {
    // So long that it is seen under way before it is over.
    let text = wide(&superconflict(3, "compact-team", 2000, ""), 8_000);
    let folder = folder(&text);
    let mut job = job(folder.path(), Topology::Mesh, ClockMode::Lockstep);
    job.common.lease_s = SHORT_LEASE_S as f64;
    let server = LinkProcess::start(&Job::Fleet(job));
    let now = server.fleet("some cycles", |now| now.cycle > 3);
    suspend(&server, &now);
    let (summary, _) = server.complete();
    assert_eq!(summary["digest"], run_in_one_process(&text).digest);
    assert_eq!(server.end(), (Some(0), None));
}

#[test]
fn in_real_time_a_fleet_that_is_suspended_for_longer_than_its_lease_loses_nobody() {
    let folder = folder(&wide(&superconflict(3, "compact-team", 1_000_000, ""), 8_000));
    let mut job = job(folder.path(), Topology::Star, FAST);
    job.common.lease_s = SHORT_LEASE_S as f64;
    let server = LinkProcess::start(&Job::Fleet(job));
    let now = server.fleet("some cycles", |now| now.nodes.iter().all(|node| node.flown > 3));
    suspend(&server, &now);
    let flown: Vec<u64> = now.nodes.iter().map(|node| node.flown).collect();
    let now = server.fleet("they fly on", |now| {
        now.nodes.iter().zip(&flown).all(|(node, flown)| node.flown > flown + 12)
    });
    assert!(now.nodes.iter().all(|node| node.lives == 1), "{now:?}");
}

/// Two machines with monotonic clocks that are unrelated, too: one has run for a day longer.
#[test]
fn a_node_whose_machine_runs_since_another_day_flies_with_the_rest() {
    let text = superconflict(3, "compact-team", 20, "");
    let folder = folder(&text);
    let shifted = ["-T", "--monotonic", "86400", "--boottime", "86400", "--fork", "--kill-child"];
    let can = Command::new("unshare").args(shifted).arg("true").status();
    if !can.is_ok_and(|status| status.success()) {
        sidestep_testing::skip("time namespaces need privileges that this user does not have");
        return;
    }
    let fleet =
        FleetJob { nodes: Some(2), ..job(folder.path(), Topology::Mesh, ClockMode::Lockstep) };
    let common = fleet.common.clone();
    let server = LinkProcess::start(&Job::Fleet(fleet));
    let connect = server.until("its endpoints", |message| match message {
        LinkMessage::Listens(endpoints) => Some(endpoints),
        _ => None,
    });
    let agent = AgentName::new("airplane", 2, None);
    let (listen, patience_s) = (vec!["tcp/127.0.0.1:0".into()], 30.0);
    let node = Job::Node(NodeJob { common, agent, connect, listen, patience_s });
    let mut command = link_command("unshare");
    command.args(shifted).arg(env!("CARGO_BIN_EXE_sidestep-link"));
    let node = LinkProcess::start_by(command, &node);
    let (summary, _) = server.complete();
    assert_eq!(summary["digest"], run_in_one_process(&text).digest);
    assert_eq!((server.end(), node.end()), ((Some(0), None), (Some(0), None)));
}
