//! Two machines, as two network namespaces with a cable between them that can be pulled.

use crate::processes::{Program, folder, job};
use crate::support::{alone, superconflict, wide};
use sidestep_session::fleet::{Clock, FleetJob, Job, NodeJob, Told, Topology};
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
fn start(machines: &Machines, mut fleet: FleetJob) -> (Program, Vec<Program>) {
    fleet.nodes = Some(2);
    fleet.listen = vec![format!("tcp/{}:7600", ADDRESSES[0])];
    let common = fleet.common.clone();
    let connect = fleet.listen.clone();
    let server = Program::start_in(&machines.names[0], &Job::Fleet(fleet));
    server.until("it listens", |told| matches!(told, Told::Listens(_)).then_some(()));
    let node = |airplane| {
        let (common, connect) = (common.clone(), connect.clone());
        let listen = vec![format!("tcp/{}:0", ADDRESSES[1])];
        let job = NodeJob { common, airplane, connect, listen, patience_s: 30.0 };
        Program::start_in(&machines.names[1], &Job::Node(job))
    };
    (server, [2, 3].map(node).into())
}

#[test]
fn two_machines_come_out_as_one_process_does() {
    let Some(machines) = Machines::new() else { return };
    let text = superconflict(4, "compact-team", 15, "");
    let folder = folder(&text);
    let (server, nodes) = start(&machines, job(folder.path(), Topology::Mesh, Clock::Lockstep));
    let digest = server.until("the end", |told| match told {
        Told::Ended { summary, .. } => Some(summary["digest"].clone()),
        Told::Failed(failed) => panic!("{failed:?}"),
        _ => None,
    });
    assert_eq!(digest, alone(&text).digest);
    assert_eq!(server.end(), (Some(0), None));
    for node in nodes {
        assert_eq!(node.end(), (Some(0), None));
    }
}

/// Both halves fly toward each other meanwhile, and none of them hears the other.
#[test]
fn a_pulled_cable_costs_delay_and_no_separation_and_all_fly_on_afterwards() {
    let Some(machines) = Machines::new() else { return };
    let folder = folder(&wide(&superconflict(4, "compact-team", 1_000_000, ""), 8_000));
    let clock = Clock::Realtime { speed: 20.0 };
    let (mut server, _nodes) = start(&machines, job(folder.path(), Topology::Mesh, clock));
    server.fleet("some cycles", |now| now.cycle > 4);
    machines.cable(false);
    let cut = server.fleet("the far ones are late", |now| now.nodes[3].late > 3);
    assert!(cut.nodes[0].late <= 1, "the near ones fly on: {cut:?}");
    machines.cable(true);
    let flown = cut.nodes[3].flown;
    server.fleet("they fly again", |now| now.nodes[3].flown > flown + 3);
    drop(server.stdin.take());
    let losses = server.until("the end", |told| match told {
        Told::Ended { summary, .. } => Some(summary["metrics"]["losses_of_separation"].clone()),
        _ => None,
    });
    assert_eq!(losses, 0);
}
