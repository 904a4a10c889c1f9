//! Two machines, as two network namespaces with a cable between them that can be pulled.

use crate::processes::{LinkProcess, folder, job};
use crate::support::{run_in_one_process, superconflict, wide};
use sidestep_session::fleet::{
    AgentName, ClockMode, FleetJob, Job, LinkMessage, NodeJob, Topology,
};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

/// Two namespaces, each with an address.
struct Machines {
    names: [String; 2],
}

const ADDRESSES: [&str; 2] = ["10.77.0.1", "10.77.0.2"];

fn ip(words: &[&str]) -> bool {
    Command::new("ip").args(words).output().is_ok_and(|output| output.status.success())
}

impl Machines {
    /// Makes them; `None` where this user may not, with a printed reason.
    fn new() -> Option<Self> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let names = ["a", "b"].map(|side| format!("sk{}{side}{count}", std::process::id()));
        let made = Self { names };
        let [a, b] = made.names.each_ref().map(String::as_str);
        let is_made = ip(&["netns", "add", a])
            && ip(&["netns", "add", b])
            && ip(&["link", "add", a, "netns", a, "type", "veth", "peer", "name", b, "netns", b])
            && [(a, ADDRESSES[0]), (b, ADDRESSES[1])].into_iter().all(|(name, address)| {
                ip(&["-n", name, "addr", "add", &format!("{address}/24"), "dev", name])
                    && ip(&["-n", name, "link", "set", "lo", "up"])
                    && ip(&["-n", name, "link", "set", name, "up"])
            });
        if !is_made {
            sidestep_testing::skip(
                "network namespaces need privileges that this user does not have",
            );
            return None;
        }
        Some(made)
    }

    /// Runs a command on one of them; returns whether it could.
    fn run(&self, machine: usize, words: &str) -> bool {
        let name = &self.names[machine];
        let words = words.replace("{cable}", name);
        let mut command = Command::new("ip");
        command.args(["netns", "exec", name]).args(words.split_whitespace());
        command.output().is_ok_and(|output| output.status.success())
    }

    /// Adds a rule to the packet filter of the second one, or takes it away. Returns whether there is one; where
    /// there is none, the reason is printed.
    fn filter(&self, is_on: bool, rule: &str) -> bool {
        let verb = if is_on { "-A" } else { "-D" };
        let programs = ["iptables-legacy", "iptables"];
        let is_there = programs.iter().any(|name| self.run(1, &format!("{name} {verb} {rule}")));
        if !is_there {
            sidestep_testing::skip("there is no packet filter here (iptables)");
        }
        is_there
    }

    /// Pulls the cable between them, or puts it in again.
    fn cable(&self, is_in: bool) {
        let name = &self.names[1];
        assert!(ip(&["-n", name, "link", "set", name, if is_in { "up" } else { "down" }]));
    }
}

impl Drop for Machines {
    fn drop(&mut self) {
        for name in &self.names {
            ip(&["netns", "del", name]);
        }
    }
}

/// Starts a fleet on the first machine, with the nodes of two airplanes there and two on the second.
fn start(machines: &Machines, mut fleet: FleetJob) -> (LinkProcess, Vec<LinkProcess>) {
    fleet.nodes = Some(2);
    fleet.listen = vec![format!("tcp/{}:7600", ADDRESSES[0])];
    fleet.common.is_insecure = true;
    let common = fleet.common.clone();
    let connect = fleet.listen.clone();
    let server = LinkProcess::start_in(&machines.names[0], &Job::Fleet(fleet));
    server.until("it listens", |message| matches!(message, LinkMessage::Listens(_)).then_some(()));
    let node = |airplane| {
        let (common, connect) = (common.clone(), connect.clone());
        let listen = vec![format!("tcp/{}:0", ADDRESSES[1])];
        let agent = AgentName::new("airplane", airplane, None);
        let job = NodeJob { common, agent, connect, listen, patience_s: 30.0 };
        LinkProcess::start_in(&machines.names[1], &Job::Node(job))
    };
    (server, [2, 3].map(node).into())
}

#[test]
fn two_machines_come_out_as_one_process_does() {
    let text = superconflict(4, "compact-team", 15, "");
    let folder = folder(&text);
    for topology in [Topology::Mesh, Topology::Multicast] {
        let Some(machines) = Machines::new() else { return };
        let (server, nodes) = start(&machines, job(folder.path(), topology, ClockMode::Lockstep));
        let (summary, _) = server.complete();
        assert_eq!(summary["digest"], run_in_one_process(&text).digest, "{topology:?}");
        assert_eq!(server.end(), (Some(0), None));
        for node in nodes {
            assert_eq!(node.end(), (Some(0), None));
        }
    }
}

/// TCP sends lost packets again, so that all of them come, and late.
#[test]
fn a_cable_that_loses_packets_costs_time_and_no_bit() {
    let Some(machines) = Machines::new() else { return };
    let rule = "INPUT -i {cable} -m statistic --mode random --probability 0.03 -j DROP";
    if !machines.filter(true, rule) {
        return;
    }
    let text = superconflict(4, "compact-team", 6, "");
    let folder = folder(&text);
    let (server, _nodes) =
        start(&machines, job(folder.path(), Topology::Mesh, ClockMode::Lockstep));
    let (summary, _) = server.complete();
    assert_eq!(summary["digest"], run_in_one_process(&text).digest);
}

const FAST: ClockMode = ClockMode::Realtime { speed: 20.0 };

/// Ends a fleet, and returns the losses of separation.
fn losses(mut server: LinkProcess) -> u64 {
    drop(server.stdin.take());
    let losses = |summary: &serde_json::Value| summary["metrics"]["losses_of_separation"].as_u64();
    server.until("the end", |message| match message {
        LinkMessage::Ended { summary, .. } => losses(&summary),
        _ => None,
    })
}

/// A cable on which a packet takes a hundredth of a second, or on which packets queue where that is not available.
#[test]
fn a_slow_cable_costs_no_separation() {
    let Some(machines) = Machines::new() else { return };
    let slow = [
        "tc qdisc add dev {cable} root netem delay 10ms 5ms",
        "tc qdisc add dev {cable} root tbf rate 2mbit burst 4kb latency 300ms",
    ];
    if !slow.iter().any(|words| machines.run(1, words)) {
        sidestep_testing::skip("cables cannot be slowed down here (tc)");
        return;
    }
    let folder = folder(&wide(&superconflict(4, "compact-team", 1_000_000, ""), 8_000));
    let (server, _nodes) = start(&machines, job(folder.path(), Topology::Mesh, FAST));
    let now = server.fleet("all fly", |now| now.nodes.iter().all(|node| node.flown > 6));
    assert!(now.nodes.iter().all(|node| node.lives == 1), "{now:?}");
    assert_eq!(losses(server), 0);
}

/// Cuts the second machine off in some way, and lets it in again: its airplanes are late, the others fly on, and all do
/// afterwards. Both halves fly toward each other meanwhile.
fn cut_off(machines: &Machines, cut: impl Fn(bool) -> bool) {
    let folder = folder(&wide(&superconflict(4, "compact-team", 1_000_000, ""), 8_000));
    let (server, _nodes) = start(machines, job(folder.path(), Topology::Mesh, FAST));
    server.fleet("some cycles", |now| now.cycle > 4);
    if !cut(true) {
        return;
    }
    let now = server.fleet("the far ones are late", |now| now.nodes[3].late > 3);
    assert!(now.nodes[0].late <= 1, "the near ones fly on: {now:?}");
    cut(false);
    let flown = now.nodes[3].flown;
    server.fleet("they fly again", |now| now.nodes[3].flown > flown + 3);
    assert_eq!(losses(server), 0);
}

#[test]
fn a_pulled_cable_costs_delay_and_no_separation_and_all_fly_on_afterwards() {
    let Some(machines) = Machines::new() else { return };
    cut_off(&machines, |is_cut| {
        machines.cable(!is_cut);
        true
    });
}

/// The second machine hears the first until the first misses its answers.
#[test]
fn a_cable_that_carries_one_way_costs_delay_and_no_separation_and_all_fly_on_afterwards() {
    let Some(machines) = Machines::new() else { return };
    cut_off(&machines, |is_cut| machines.filter(is_cut, "OUTPUT -o {cable} -j DROP"));
}
