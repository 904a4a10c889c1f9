//! Fleets as processes: the program `sidestep-link` as started by `sidestep fleet`.

use crate::support::{run_in_one_process, superconflict, untimed, wide};
use serde_json::Value;
use sidestep::worlds::WORLDS;
use sidestep_session::fleet::{
    ClockMode, CommonSettings, FleetJob, FleetStatus, Job, JobError, JobScenario, LinkMessage,
    Topology, link_command,
};
use sidestep_session::{ManagedRun, NoWatcher, RunStatus};
use sidestep_testing::{JsonProcess, try_signal};
use std::io::{BufRead, BufReader};
use std::ops::{Deref, DerefMut};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Time longer than anything here takes, on a machine that has much else to do.
const TEST_TIMEOUT: Duration = Duration::from_secs(300);

/// Time in seconds for which no node that runs is silent on such a machine.
const LONG_LEASE_S: f64 = 60.0;

/// A job of the scenario `s.toml` of a folder.
pub(crate) fn job(folder: &Path, topology: Topology, clock: ClockMode) -> FleetJob {
    let flown = JobScenario {
        file: folder.join("s.toml"),
        overrides: Vec::new(),
        build: WORLDS.build().into(),
    };
    let (tls, metrics, log) = (None, None, "error".to_string());
    FleetJob {
        common: CommonSettings {
            flown,
            tls,
            is_insecure: false,
            lease_s: LONG_LEASE_S,
            metrics,
            json_log: false,
            log,
        },
        nodes: None,
        clock,
        topology,
        multicast_group: None,
        listen: vec!["tcp/127.0.0.1:0".into()],
        out: None,
        replace: false,
        packets: false,
    }
}

/// A program that does a job. It is killed when it is dropped.
pub(crate) struct LinkProcess {
    process: JsonProcess<LinkMessage>,
    /// The lines that it, and the nodes that it starts, have logged so far.
    logged: Arc<Mutex<Vec<String>>>,
}

impl LinkProcess {
    pub(crate) fn start(job: &Job) -> Self {
        Self::start_by(link_command(env!("CARGO_BIN_EXE_sidestep-link")), job)
    }

    /// Starts the program in a network namespace.
    pub(crate) fn start_in(namespace: &str, job: &Job) -> Self {
        let mut command = link_command("ip");
        command.args(["netns", "exec", namespace, env!("CARGO_BIN_EXE_sidestep-link")]);
        Self::start_by(command, job)
    }

    pub(crate) fn start_by(mut command: Command, job: &Job) -> Self {
        command.stderr(Stdio::piped());
        let mut process = JsonProcess::start_with(command, job);
        let errors = BufReader::new(process.child.stderr.take().expect("a pipe"));
        let logged = Arc::new(Mutex::new(Vec::new()));
        let log = logged.clone();
        std::thread::spawn(move || {
            for line in errors.lines().map_while(Result::ok) {
                log.lock().expect("no panic").push(line);
            }
        });
        Self { process, logged }
    }

    /// Returns the lines that were logged so far.
    pub(crate) fn logged(&self) -> Vec<String> {
        self.logged.lock().expect("no panic").clone()
    }

    /// Returns the next line for which something holds.
    pub(crate) fn until<T>(&self, what: &str, wanted: impl Fn(LinkMessage) -> Option<T>) -> T {
        self.until_within(what, TEST_TIMEOUT, wanted)
    }

    /// Returns the same, where it takes longer.
    pub(crate) fn until_within<T>(
        &self,
        what: &str,
        within: Duration,
        wanted: impl Fn(LinkMessage) -> Option<T>,
    ) -> T {
        let until = Instant::now() + within;
        loop {
            let message =
                self.process.lines.recv_timeout(until.saturating_duration_since(Instant::now()));
            let message = message.unwrap_or_else(|e| {
                let logged = self.logged().join("\n");
                panic!("waited for {what}: {e}; it logged:\n{logged}")
            });
            if let Some(found) = wanted(message) {
                return found;
            }
        }
    }

    /// Returns the fleet once something holds for it.
    pub(crate) fn fleet(&self, what: &str, holds: impl Fn(&FleetStatus) -> bool) -> FleetStatus {
        self.until(what, |message| match message {
            LinkMessage::Fleet(now) if holds(&now) => Some(now),
            LinkMessage::Failed(failed) => panic!("{failed:?}"),
            _ => None,
        })
    }

    /// Returns the summary of a fleet that flies to its end, and the state of its nodes there. A fleet that has lost a node
    /// has a summary of what it has reached: its digest is compared with none.
    pub(crate) fn complete(&self) -> (Value, FleetStatus) {
        self.complete_within(TEST_TIMEOUT)
    }

    /// Returns the same, where it takes longer.
    pub(crate) fn complete_within(&self, within: Duration) -> (Value, FleetStatus) {
        let (summary, fleet) = self.until_within("the end", within, |message| match message {
            LinkMessage::Ended { summary, fleet, .. } => Some((summary, fleet)),
            LinkMessage::Failed(failed) => panic!("{failed:?}"),
            _ => None,
        });
        if summary["status"] != "complete" {
            let failed = self.until("the reason", |message| match message {
                LinkMessage::Failed(failed) => Some(failed),
                _ => None,
            });
            panic!("it has ended in cycle {}: {failed:?}, {:?}", fleet.cycle, self.logged());
        }
        (summary, fleet)
    }

    /// Returns the exit code, and the reason if it failed.
    pub(crate) fn end(mut self) -> (Option<i32>, Option<JobError>) {
        let status = self.process.child.wait().expect("it ends");
        let failed = self.process.lines.iter().find_map(|message| match message {
            LinkMessage::Failed(failed) => Some(failed),
            _ => None,
        });
        (status.code(), failed)
    }
}

impl Deref for LinkProcess {
    type Target = JsonProcess<LinkMessage>;

    fn deref(&self) -> &Self::Target {
        &self.process
    }
}

impl DerefMut for LinkProcess {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.process
    }
}

pub(crate) fn folder(text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("s.toml"), text).expect("written");
    folder
}

/// Returns whether a process exists, and is no zombie.
fn is_alive(process: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    stat.rsplit(')')
        .next()
        .is_some_and(|rest| !rest.is_empty() && !rest.trim_start().starts_with('Z'))
}

pub(crate) fn wait_until_gone(fleet: &FleetStatus, within: Duration) {
    let until = Instant::now() + within;
    let processes: Vec<u32> = fleet.nodes.iter().filter_map(|node| node.process).collect();
    while let Some(left) = processes.iter().find(|&&process| is_alive(process)) {
        assert!(Instant::now() < until, "process {left} of {processes:?} is left over");
        std::thread::sleep(Duration::from_millis(5));
    }
}

pub(crate) fn signal(process: u32, name: &str) {
    assert!(try_signal(process, name), "{name} to {process}");
}

#[test]
fn processes_come_out_as_one_process_does_and_leave_an_ordinary_folder() {
    let text = superconflict(4, "compact-team", 40, "");
    let folder = folder(&text);
    let out = folder.path().join("run");
    let job = FleetJob {
        out: Some(out.clone()),
        ..job(folder.path(), Topology::Mesh, ClockMode::Lockstep)
    };
    let program = LinkProcess::start(&Job::Fleet(job));
    let (summary, fleet) = program.complete();
    assert_eq!(program.end(), (Some(0), None));
    let one = run_in_one_process(&text);
    assert_eq!(summary["digest"], one.digest);
    assert_eq!(untimed(summary["metrics"].clone()), one.metrics);
    let packets: u64 = fleet.nodes.iter().map(|node| node.packets).sum();
    assert_eq!(summary["metrics"]["messages"], packets, "nodes count what the run does");
    assert!(fleet.nodes.iter().all(|node| node.late == 0), "{fleet:?}");
    let recorded = sidestep_session::read_summary(&out).expect("an ordinary folder");
    assert_eq!(recorded.expect("a summary")["digest"], one.digest);
}

/// Commanded levels and speeds travel in reports, also over a network that loses messages.
#[test]
fn processes_come_out_as_one_process_does_where_levels_and_speeds_are_commanded() {
    let mvp = "method = \"mvp\"\nmvp = { resolution = \"heading-speed-vertical\" }\nnetwork = { loss = 0.1 }";
    let text = superconflict(3, "team", 20, mvp);
    let folder = folder(&text);
    let job = job(folder.path(), Topology::Star, ClockMode::Lockstep);
    let program = LinkProcess::start(&Job::Fleet(job));
    let (summary, _) = program.complete();
    let one = run_in_one_process(&text);
    assert_eq!(summary["digest"], one.digest);
    assert_eq!(untimed(summary["metrics"].clone()), one.metrics);
    assert!(one.metrics["commands_held"].is_u64(), "{}", one.metrics);
}

/// All deployments, with and without faults.
#[test]
#[ignore = "minutes of processor time: eight whole flights of ten airplanes"]
fn a_whole_super_conflict_of_ten_comes_out_as_in_one_process_in_every_deployment() {
    for deployment in ["team", "compact-team", "pim", "hierarchical-pim"] {
        for network in ["", "network = { loss = 0.1, max_delay_s = 0.003 }"] {
            let text = wide(&superconflict(10, deployment, 1_000, network), 4_000);
            let folder = folder(&text);
            let job = job(folder.path(), Topology::Mesh, ClockMode::Lockstep);
            let program = LinkProcess::start(&Job::Fleet(job));
            let (summary, _) = program.complete_within(60 * TEST_TIMEOUT);
            let digest = run_in_one_process(&text).digest;
            assert_eq!(summary["digest"], digest, "{deployment} {network}");
        }
    }
}

#[test]
fn a_fleet_whose_starter_is_gone_ends_in_good_order_and_leaves_no_process() {
    let folder = folder(&wide(&superconflict(4, "compact-team", 1_000_000, ""), 1_000_000));
    let out = folder.path().join("run");
    let job = FleetJob {
        out: Some(out.clone()),
        ..job(folder.path(), Topology::Star, ClockMode::Lockstep)
    };
    let mut program = LinkProcess::start(&Job::Fleet(job));
    let fleet = program.fleet("some cycles", |now| now.cycle > 3);
    drop(program.stdin.take());
    let (code, failed) = program.end();
    assert_eq!(code, Some(130), "{failed:?}");
    wait_until_gone(&fleet, Duration::ZERO);
    let stored = sidestep_session::read_summary(&out).expect("stored").expect("a summary");
    assert_eq!(stored["status"], "incomplete");
}

/// The server is killed, and its nodes end although nothing ends them; the folder is not lost.
#[test]
fn nodes_of_a_server_that_is_killed_end_by_themselves_and_a_run_in_lockstep_resumes() {
    let text = wide(&superconflict(4, "compact-team", 2_000, ""), 8_000)
        + "[record]\ncheckpoint_every = 5\n";
    let folder = folder(&text);
    let out = folder.path().join("run");
    let common = job(folder.path(), Topology::Mesh, ClockMode::Lockstep);
    let job = FleetJob { out: Some(out.clone()), ..common };
    let mut program = LinkProcess::start(&Job::Fleet(job));
    let fleet = program.fleet("some cycles", |now| now.cycle > 10);
    program.child.kill().expect("killed");
    wait_until_gone(&fleet, Duration::from_secs(10));
    let journey = ManagedRun::resume(&WORLDS, &out, 1, None).expect("it can be resumed");
    assert!(journey.cycle() >= 5);
    let summary = journey.run_to_end(&NoWatcher).expect("computed to the end");
    assert_eq!(summary.status, RunStatus::Complete);
    // It was computed in any case, so its digest is that of a run in one process.
    assert_eq!(summary.digest, run_in_one_process(&text).digest);
    let manifest = sidestep_record::RunReader::open(&out).expect("a run").manifest;
    assert!(!manifest.is_flight());
    assert_eq!(manifest.origins[0].until, summary.cycles);
}

#[test]
fn lockstep_does_not_go_on_without_a_node_that_is_killed() {
    let folder = folder(&wide(&superconflict(4, "compact-team", 1_000_000, ""), 1_000_000));
    let job = job(folder.path(), Topology::Mesh, ClockMode::Lockstep);
    let program = LinkProcess::start(&Job::Fleet(job));
    let fleet = program.fleet("some cycles", |now| now.cycle > 3);
    signal(fleet.nodes[2].process.expect("a process"), "KILL");
    let (code, failed) = program.end();
    let cause = failed.expect("it says why").cause;
    assert_eq!(code, Some(1));
    assert!(cause.contains("airplane 2 is gone") && cause.contains("signal: 9"), "{cause}");
    wait_until_gone(&fleet, Duration::ZERO);
}
