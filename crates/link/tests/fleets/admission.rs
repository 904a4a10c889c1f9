//! Admission: what can be wrong is found before a node has a seat, and whoever leaves gives the seat back at once.

use crate::input::refused;
use crate::processes::{LinkProcess, folder, job, signal};
use crate::support::{run_in_one_process, superconflict};
use sidestep_session::fleet::{
    AgentName, ClockMode, CommonSettings, FleetJob, Job, LinkMessage, NodeJob, Topology,
};

/// A fleet of two in a mesh, of which one node is started by hand.
struct OpenFleet {
    text: String,
    job: FleetJob,
    server: LinkProcess,
    connect: Vec<String>,
    _folder: tempfile::TempDir,
}

impl OpenFleet {
    /// With a lease that no test waits for.
    fn start() -> Self {
        let text = superconflict(2, "compact-team", 12, "");
        let folder = folder(&text);
        let mut job = job(folder.path(), Topology::Mesh, ClockMode::Lockstep);
        job.common.log = "warn".into();
        let job = FleetJob { nodes: Some(1), ..job };
        let server = LinkProcess::start(&Job::Fleet(job.clone()));
        let connect = server.until("its endpoints", |message| match message {
            LinkMessage::Listens(endpoints) => Some(endpoints),
            _ => None,
        });
        server.fleet("the first node", |now| now.nodes[0].state == "joined");
        Self { text, job, server, connect, _folder: folder }
    }

    /// The job of the other node, which listens at some endpoints.
    fn node(&self, listen: &[&str]) -> NodeJob {
        NodeJob {
            common: CommonSettings { is_insecure: true, ..self.job.common.clone() },
            agent: AgentName::new("airplane", 1, None),
            connect: self.connect.clone(),
            listen: listen.iter().map(|&at| at.into()).collect(),
            patience_s: 30.0,
        }
    }

    /// Completes the fleet by the right node, and checks that all comes out as in one process.
    fn complete(self) {
        let last = LinkProcess::start(&Job::Node(self.node(&["tcp/127.0.0.1:0"])));
        let (summary, _) = self.server.complete();
        assert_eq!(summary["digest"], run_in_one_process(&self.text).digest);
        assert_eq!((self.server.end(), last.end()), ((Some(0), None), (Some(0), None)));
    }
}

#[test]
fn a_node_that_others_cannot_reach_gets_no_seat_and_the_right_one_gets_it_at_once() {
    let fleet = OpenFleet::start();
    for (listen, cause) in [
        (&[][..], "it listens nowhere"),
        (&["tcp/0.0.0.0:0"], "every address of this machine"),
        (&["tcp/127.0.0.1:99999"], "port 99999 is above 65535"),
        (&["tcp/192.0.2.1:0"], "192.0.2.1 is no address of this machine"),
    ] {
        let said = refused(&Job::Node(fleet.node(listen)));
        assert!(said.contains(cause) && !said.contains(".rs:"), "{cause} in {said}");
    }
    fleet.complete();
}

#[test]
fn a_node_that_is_asked_to_end_says_so_and_another_one_gets_its_seat_at_once() {
    if !cfg!(unix) {
        sidestep_testing::skip("processes get signals on Unix");
        return;
    }
    // Of three airplanes, so that the fleet does not begin.
    let text = superconflict(3, "compact-team", 12, "");
    let folder = folder(&text);
    let job = job(folder.path(), Topology::Star, ClockMode::Lockstep);
    let mut fleet = FleetJob { nodes: Some(1), ..job };
    fleet.common.log = "warn".into();
    let server = LinkProcess::start(&Job::Fleet(fleet.clone()));
    let connect = server.until("its endpoints", |message| match message {
        LinkMessage::Listens(endpoints) => Some(endpoints),
        _ => None,
    });
    let start = || {
        LinkProcess::start(&Job::Node(NodeJob {
            common: fleet.common.clone(),
            agent: AgentName::new("airplane", 1, None),
            connect: connect.clone(),
            listen: Vec::new(),
            patience_s: 30.0,
        }))
    };
    for (lives, way) in (1..).zip(["TERM", "INT", "its starter"]) {
        let mut node = start();
        server.fleet("it has joined", |now| {
            now.nodes[1].state == "joined" && now.nodes[1].lives == lives
        });
        match way {
            "its starter" => drop(node.stdin.take()),
            name => signal(node.child.id(), name),
        }
        assert_eq!(node.end().0, Some(130), "{way}");
        server.fleet("its seat is free", |now| now.nodes[1].state == "gone");
    }
    let says = server.logged().join("\n");
    assert!(says.contains("a node is gone") && says.contains("it was asked to end"), "{says}");
}
