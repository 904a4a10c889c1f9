//! Fleets whose nodes hear each other by UDP multicast: the same bits, and a group that anybody may send to.

use crate::attack::dismissal;
use crate::processes::{LinkProcess, folder, job};
use crate::support::{run_in_one_process, superconflict};
use crate::tls::authority;
use sidestep_link::peer::PeerId;
use sidestep_link::protocol::{AgentPacket, Incarnation, Message, RecipientHeader, TransportFrame};
use sidestep_link::wire::draw_group;
use sidestep_session::fleet::{ClockMode, FleetJob, Job, Topology, check_loopback_multicast};
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::path::Path;
use std::time::{Duration, Instant};

/// Returns whether a datagram to a group comes back on this machine; the reason is printed where it does not.
fn has_multicast() -> bool {
    check_loopback_multicast()
        .inspect_err(|error| {
            sidestep_testing::skip(format!("this machine has no multicast: {error}"))
        })
        .is_ok()
}

fn multicast_job(folder: &Path, clock: ClockMode) -> FleetJob {
    job(folder, Topology::Multicast, clock)
}

#[test]
fn processes_by_multicast_come_out_as_one_process_does() {
    if !has_multicast() {
        return;
    }
    for deployment in ["compact-team", "replica-team"] {
        let text = superconflict(5, deployment, 15, "");
        let folder = folder(&text);
        let fleet = Job::Fleet(multicast_job(folder.path(), ClockMode::Lockstep));
        let program = LinkProcess::start(&fleet);
        let (summary, _) = program.complete();
        assert_eq!(summary["digest"], run_in_one_process(&text).digest, "{deployment}");
        assert_eq!(program.end(), (Some(0), None));
    }
}

#[test]
fn two_fleets_in_one_group_do_each_other_no_harm() {
    if !has_multicast() {
        return;
    }
    let text = superconflict(4, "compact-team", 15, "");
    let folder = folder(&text);
    let job = FleetJob {
        multicast_group: Some(draw_group()),
        ..multicast_job(folder.path(), ClockMode::Lockstep)
    };
    let both = [0, 1].map(|_| LinkProcess::start(&Job::Fleet(job.clone())));
    for program in both {
        let (summary, _) = program.complete();
        assert_eq!(summary["digest"], run_in_one_process(&text).digest);
    }
}

#[test]
fn with_certificates_frames_in_the_group_are_signed_and_the_bits_are_the_same() {
    if !has_multicast() {
        return;
    }
    let text = superconflict(3, "replica-team", 10, "");
    let folder = folder(&text);
    let Some(ours) = authority(folder.path(), "ours", 2) else { return };
    let mut fleet = multicast_job(folder.path(), ClockMode::Lockstep);
    fleet.common.tls = Some(ours);
    fleet.listen = vec!["tls/127.0.0.1:0".into()];
    let program = LinkProcess::start(&Job::Fleet(fleet));
    let (summary, _) = program.complete();
    assert_eq!(summary["digest"], run_in_one_process(&text).digest);
}

/// Three airplanes side by side on a long way, which decide together in every cycle.
fn abreast() -> String {
    let mut text = "format = 1\nworld = \"airspace\"\nseed = 1\ncycles = 1000000\n[airspace]\n\
                    deployment = \"replica-team\"\n"
        .to_string();
    for y_m in [-700, 0, 700] {
        text += &format!(
            "[[airplanes]]\nat_m = [-60000.0, {y_m}.0]\nheading_deg = 0.0\nway_points_m = [[60000.0, {}.0]]\n",
            -y_m
        );
    }
    text
}

/// Packets of airplane 1, from a process that is no member.
fn strangers_packets() -> Vec<u8> {
    let to = |agent| RecipientHeader {
        peer: PeerId::Node(agent),
        incarnation: None,
        ack: 0,
        sequence: None,
    };
    let packet =
        AgentPacket { cycle: 5, departs: 0, sequence: 0, arrives: 0, payload: vec![1; 60] };
    let message = Some(Message::Packets(vec![packet]));
    let from = PeerId::Node(1);
    TransportFrame { from, incarnation: Incarnation(1), number: 0, to: vec![to(0), to(2)], message }
        .encode()
}

#[test]
fn whoever_sends_to_the_group_ends_no_node_and_is_told() {
    if !has_multicast() {
        return;
    }
    let folder = folder(&abreast());
    let group: SocketAddrV4 = draw_group();
    let mut fleet = FleetJob {
        multicast_group: Some(group),
        ..multicast_job(folder.path(), ClockMode::Realtime { speed: 10.0 })
    };
    fleet.common.log = "warn".into();
    let server = LinkProcess::start(&Job::Fleet(fleet));
    let before = server.fleet("all are heard", |now| {
        now.cycle > 3 && now.nodes.iter().all(|node| node.heard == 2)
    });
    let attacker = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a socket");
    let until = Instant::now() + Duration::from_secs(60);
    let told = |word: &str| server.logged().iter().any(|line| line.contains(word));
    while !told("reason=\"forged\"") {
        assert!(Instant::now() < until, "{:?}", server.logged());
        for frame in [dismissal(), strangers_packets(), vec![0; 40]] {
            attacker.send_to(&frame, group).expect("sent");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let after = server.fleet("more cycles, in which all are heard", |now| {
        now.cycle > before.cycle + 10 && now.nodes.iter().all(|node| node.heard == 2)
    });
    assert!(after.nodes.iter().all(|node| node.lives == 1), "{after:?}");
}
