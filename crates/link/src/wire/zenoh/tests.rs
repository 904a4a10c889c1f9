//! Pitfalls of Zenoh that this wire avoids, each shown to be one, on loopback.

use super::*;
use crate::messenger::Messenger;
use crate::protocol::Message;
use crate::wire::endpoint::reserve_port;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Time longer than anything here takes.
const TEST_TIMEOUT: Duration = Duration::from_secs(30);

/// A hundred times the time that a frame on loopback takes.
const SHORT_WAIT: Duration = Duration::from_millis(300);

const A: PeerId = PeerId::Node(1);
const B: PeerId = PeerId::Node(2);

fn free() -> String {
    reserve_port("tcp/127.0.0.1:0").expect("a free port").endpoint
}

fn link(
    mode: &str,
    me: PeerId,
    [listen, connect]: [&[String]; 2],
) -> (ZenohLink, Receiver<Vec<u8>>) {
    let connected_within = (mode == "client").then_some(TEST_TIMEOUT);
    let session = ZenohConfig { mode, listen, connect, connected_within, ..ZenohConfig::default() }
        .open()
        .expect("open");
    let (sender, frames) = channel();
    let inbox = Inbox { frames: sender, waker: Arc::default(), forged: Arc::default() };
    (ZenohLink::new(session, me, &inbox, &EchoProbes::default()).expect("a link"), frames)
}

/// Sends a frame again and again until it has come.
fn reaches(from: &mut ZenohLink, to: PeerId, frames: &Receiver<Vec<u8>>) {
    let until = Instant::now() + TEST_TIMEOUT;
    loop {
        from.send(to, b"frame");
        if frames.recv_timeout(Duration::from_millis(20)).is_ok() {
            return;
        }
        assert!(Instant::now() < until, "no frame has come to {to}");
    }
}

/// A hub that is a peer hears both leaves, and they do not hear each other, without any notice. Through a router they
/// do.
#[test]
fn a_peer_does_not_relay_and_a_router_does() {
    for (hub, leaf, relays) in [("peer", "peer", false), ("router", "client", true)] {
        let at = [free()];
        let (_hub, at_hub) = link(hub, PeerId::Server, [&at, &[]]);
        let (mut a, _at_a) = link(leaf, A, [&[], &at]);
        let (mut b, at_b) = link(leaf, B, [&[], &at]);
        reaches(&mut a, PeerId::Server, &at_hub);
        reaches(&mut b, PeerId::Server, &at_hub);
        if relays {
            reaches(&mut a, B, &at_b);
        } else {
            a.send(B, b"frame");
            assert!(
                at_b.recv_timeout(SHORT_WAIT).is_err(),
                "peers relay now: the wire can be made simpler"
            );
        }
    }
}

/// Three nodes, in a mesh or a star.
fn three(is_mesh: bool) -> (ZenohWire, Vec<ZenohWire>) {
    let at = [free()];
    let hub = ZenohWire::server_wire(&at, None).expect("a server");
    let held: Vec<PortReservation> =
        (0..3).map(|_| reserve_port("tcp/127.0.0.1:0").expect("a free port")).collect();
    let listens =
        |held: &PortReservation| if is_mesh { vec![held.endpoint.clone()] } else { Vec::new() };
    let members: Vec<FleetMember> = (0..)
        .zip(&held)
        .map(|(agent, held)| FleetMember {
            agent,
            incarnation: crate::protocol::Incarnation(0),
            listens: listens(held),
            session: None,
        })
        .collect();
    let node = |(agent, held): (EntityId, PortReservation)| {
        let wire =
            ZenohWire::node_wire(PeerId::Node(agent), &at, None, TEST_TIMEOUT).expect("it answers");
        let mut wire = if is_mesh { wire.with_listeners(vec![held]) } else { wire };
        wire.connect_mesh(agent, &members).expect("a mesh");
        wire
    };
    let nodes = (0..).zip(held).map(node).collect();
    (hub, nodes)
}

#[test]
fn a_frame_for_all_others_comes_once_to_each_of_them_and_to_nobody_else() {
    for is_mesh in [true, false] {
        let (mut hub, mut nodes) = three(is_mesh);
        let others = [0, 2].map(PeerId::Node);
        for k in [0, 2] {
            let until = Instant::now() + TEST_TIMEOUT;
            while nodes[k].receive(Duration::from_millis(20)).is_none() {
                assert!(Instant::now() < until, "no frame has come to {k}, mesh {is_mesh}");
                nodes[1].send(&[PeerId::Node(k as EntityId)], b"there");
            }
        }
        for k in [0, 2] {
            while nodes[k].receive(SHORT_WAIT).is_some() {}
        }
        nodes[1].send(&others, b"all");
        for k in [0, 2] {
            assert_eq!(
                nodes[k].receive(TEST_TIMEOUT).as_deref(),
                Some(&b"all"[..]),
                "mesh {is_mesh}"
            );
            assert_eq!(nodes[k].receive(SHORT_WAIT), None, "it comes once");
        }
        assert_eq!(nodes[1].receive(SHORT_WAIT), None, "not to the sender");
        assert_eq!(hub.receive(SHORT_WAIT), None, "not to the server");
    }
}

/// A cable between two ends that can be cut: then it takes all bytes, as a network without a cable does, and
/// nothing arrives.
struct Cable {
    endpoint: String,
    is_cut: Arc<AtomicBool>,
}

impl Cable {
    fn to(server: &str, is_cut: bool) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let endpoint = format!("tcp/{}", listener.local_addr().expect("bound"));
        let is_cut = Arc::new(AtomicBool::new(is_cut));
        let (cut, server) = (is_cut.clone(), server.trim_start_matches("tcp/").to_string());
        std::thread::spawn(move || {
            for near in listener.incoming().flatten() {
                let Ok(far) = TcpStream::connect(&server) else { continue };
                let both = [(near.try_clone(), far.try_clone()), (Ok(far), Ok(near))];
                for (from, to) in both {
                    let cut = cut.clone();
                    std::thread::spawn(move || carry(from.ok()?, to.ok()?, &cut));
                }
            }
        });
        Self { endpoint, is_cut }
    }

    fn cut(&self, is_cut: bool) {
        self.is_cut.store(is_cut, Ordering::Relaxed);
    }
}

/// Carries bytes one way. A connection that has lost any is never whole again.
fn carry(mut from: TcpStream, mut to: TcpStream, is_cut: &AtomicBool) -> Option<()> {
    let mut bytes = [0; 4096];
    let mut has_lost = false;
    loop {
        let read = from.read(&mut bytes).ok().filter(|read| *read > 0);
        let Some(read) = read else {
            let _ = to.shutdown(std::net::Shutdown::Both);
            return None;
        };
        has_lost |= is_cut.load(Ordering::Relaxed);
        if !has_lost {
            to.write_all(&bytes[..read]).ok()?;
        }
    }
}

/// In a partition a put succeeds and its frame is gone; reliable messages arrive when it is over. The link is given up within its
/// lease, and opened again within seconds, because both time limits of opening are short: Zenoh's own are ten.
#[test]
fn best_effort_messages_are_lost_in_a_partition_and_reliable_ones_are_not() {
    let server = free();
    let cable = Cable::to(&server, false);
    let wire = ZenohWire::server_wire(&[server], None).expect("a server");
    let mut hub = Messenger::new(PeerId::Server, Box::new(wire));
    let wire = ZenohWire::node_wire(A, std::slice::from_ref(&cable.endpoint), None, TEST_TIMEOUT)
        .expect("it answers");
    let mut node = Messenger::new(A, Box::new(wire));
    node.connect(PeerId::Server, hub.incarnation());
    hub.connect(A, node.incarnation());
    let mut receives = |node: &mut Messenger, message: Message, within: Duration| {
        let until = Instant::now() + within;
        while Instant::now() < until {
            node.receive(Duration::from_millis(1));
            match hub.receive(Duration::from_millis(5)) {
                Some(received) if received.message == message => return true,
                _ => {}
            }
        }
        false
    };
    node.send_reliable(PeerId::Server, Message::Close(1));
    assert!(receives(&mut node, Message::Close(1), TEST_TIMEOUT));
    cable.cut(true);
    node.send_best_effort(PeerId::Server, Message::Hello);
    node.send_reliable(PeerId::Server, Message::Close(2));
    assert!(
        !receives(&mut node, Message::Close(2), 2 * Duration::from_millis(LEASE_MS)),
        "it is cut"
    );
    cable.cut(false);
    let healed = Instant::now();
    assert!(
        receives(&mut node, Message::Close(2), TEST_TIMEOUT),
        "a reliable message arrives in the end"
    );
    assert!(healed.elapsed() < Duration::from_secs(8), "{:?}", healed.elapsed());
    assert!(!receives(&mut node, Message::Hello, SHORT_WAIT), "a best-effort message is lost");
}

/// Carries the frames of one end of a link, but from the third on only those of one byte, signs of life, while the
/// link is half-open.
fn carry_half_open(
    mut from: TcpStream,
    mut to: TcpStream,
    is_half_open: bool,
) -> std::io::Result<()> {
    for k in 0.. {
        let mut length = [0; 2];
        from.read_exact(&mut length)?;
        let mut frame = vec![0; usize::from(u16::from_le_bytes(length))];
        from.read_exact(&mut frame)?;
        // Two frames open the link.
        if k < 2 || frame.len() == 1 || !is_half_open {
            to.write_all(&length)?;
            to.write_all(&frame)?;
        }
    }
    Ok(())
}

/// Returns an endpoint from which connections are carried to another, the first as half-open links.
fn half_open_at_first(server: &str) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let endpoint = format!("tcp/{}", listener.local_addr().expect("bound"));
    let server = server.trim_start_matches("tcp/").to_string();
    std::thread::spawn(move || {
        for (k, near) in listener.incoming().flatten().enumerate() {
            let Ok(far) = TcpStream::connect(&server) else { continue };
            let both = [(near.try_clone(), far.try_clone(), k == 0), (Ok(far), Ok(near), false)];
            for (from, to, is_half_open) in both {
                std::thread::spawn(move || {
                    let (from, to) = (from?, to?);
                    let ends = [from.try_clone()?, to.try_clone()?];
                    let carried = carry_half_open(from, to, is_half_open);
                    ends.iter().try_for_each(|end| end.shutdown(std::net::Shutdown::Both))?;
                    carried
                });
            }
        }
    });
    endpoint
}

/// Returns a server's endpoint with two nodes in a mesh, and each as a member for the other; the second sees the
/// first at an endpoint made from its own.
fn two_in_a_mesh(seen: impl Fn(&str) -> String) -> ([ZenohWire; 3], Vec<FleetMember>) {
    let at = [free()];
    let hub = ZenohWire::server_wire(&at, None).expect("a server");
    let held = [0, 1].map(|_| reserve_port("tcp/127.0.0.1:0").expect("a free port"));
    let lives = [5, 6].map(crate::protocol::Incarnation);
    let seen_at = [seen(&held[0].endpoint), held[1].endpoint.clone()];
    let members: Vec<FleetMember> = (0..)
        .zip(lives)
        .zip(seen_at)
        .map(|((agent, incarnation), seen)| FleetMember {
            agent,
            incarnation,
            listens: vec![seen],
            session: None,
        })
        .collect();
    let node = |(agent, held)| {
        let wire =
            ZenohWire::node_wire(PeerId::Node(agent), &at, None, TEST_TIMEOUT).expect("it answers");
        let mut wire = wire.with_listeners(vec![held]);
        wire.connect_mesh(agent, &members).expect("a mesh");
        wire
    };
    let [first_held, second_held] = held;
    let (first, second) = (node((0, first_held)), node((1, second_held)));
    until(|| is_open(&second, &members[0]));
    ([hub, first, second], members)
}

fn is_open(wire: &ZenohWire, member: &FleetMember) -> bool {
    wire.mesh.as_ref().is_some_and(|mesh| mesh.is_open_to(member))
}

/// Waits until something holds, as it will at some time.
fn until(mut is_so: impl FnMut() -> bool) {
    let until = Instant::now() + TEST_TIMEOUT;
    while !is_so() {
        assert!(Instant::now() < until, "it never is");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A link through which signs of life arrive and nothing else: Zenoh keeps it for good, and the wire detects it and opens
/// it again.
#[test]
fn a_half_open_link_is_detected_and_opened_again() {
    let ([_hub, mut first, mut second], members) = two_in_a_mesh(half_open_at_first);
    // Rarely, because a sender gives no other sign of life.
    let mut comes = |second: &mut ZenohWire, times: u32| {
        (0..times).any(|_| {
            second.send(&[PeerId::Node(0)], b"frame");
            first.receive(Duration::from_millis(LEASE_MS / 3)).is_some()
        })
    };
    assert!(!comes(&mut second, 4), "nothing arrives");
    assert!(is_open(&second, &members[0]), "and Zenoh keeps it");
    assert!(!second.is_half_open(&members[0], TEST_TIMEOUT), "it was probed just now");
    let is_half_open = |wire: &mut ZenohWire| {
        std::thread::sleep(Duration::from_millis(LEASE_MS / 3));
        wire.is_half_open(&members[0], Duration::from_secs(1))
    };
    assert!((0..20).any(|_| is_half_open(&mut second)), "it answers nothing");
    until(|| second.reopen_links().is_ok());
    assert!(comes(&mut second, 40), "it is heard");
    let other = FleetMember {
        agent: 0,
        incarnation: crate::protocol::Incarnation(7),
        listens: Vec::new(),
        session: None,
    };
    assert!(!is_open(&second, &other), "another incarnation of it is not there");
}

/// The first node receives nothing, as one that computes for long: its session answers all the same.
#[test]
fn a_link_of_a_node_that_receives_nothing_is_not_half_open() {
    let ([_hub, mut first, mut second], members) = two_in_a_mesh(ToString::to_string);
    for _ in 0..3 {
        assert!(!second.is_half_open(&members[0], TEST_TIMEOUT));
        until(|| second.echoes.drain_replies());
    }
    second.send(&[PeerId::Node(0)], b"frame");
    assert_eq!(first.receive(TEST_TIMEOUT).as_deref(), Some(&b"frame"[..]), "a probe is no frame");
}

#[test]
fn links_that_could_not_be_opened_are_opened_at_another_time() {
    let ([_hub, mut first, mut second], members) = two_in_a_mesh(ToString::to_string);
    let mesh = second.mesh.take().expect("a mesh");
    mesh.session.close().wait().expect("it is closed");
    drop(mesh);
    let port = second.listens[0].trim_start_matches("tcp/").to_string();
    let mut other = None;
    until(|| {
        other = TcpListener::bind(&port).ok();
        other.is_some()
    });
    assert!(second.reopen_links().is_err(), "somebody else has its port");
    drop(other);
    until(|| second.reopen_links().is_ok());
    until(|| is_open(&second, &members[0]));
    second.send(&[PeerId::Node(0)], b"frame");
    assert_eq!(first.receive(TEST_TIMEOUT).as_deref(), Some(&b"frame"[..]));
}

/// An end that takes connections and never answers, as one behind a cut cable, holds up no other for long.
#[test]
fn a_link_that_is_not_answered_is_tried_again_soon() {
    let server = free();
    let _hub = ZenohWire::server_wire(std::slice::from_ref(&server), None).expect("a server");
    let cable = Cable::to(&server, true);
    let mended = {
        let is_cut = cable.is_cut.clone();
        std::thread::spawn(move || {
            // As long as one try may take.
            std::thread::sleep(Duration::from_millis(OPEN_TIMEOUT_MS));
            is_cut.store(false, Ordering::Relaxed);
        })
    };
    let began = Instant::now();
    let at = std::slice::from_ref(&cable.endpoint);
    ZenohWire::node_wire(A, at, None, TEST_TIMEOUT).expect("it answers in the end");
    assert!(began.elapsed() < Duration::from_secs(8), "{:?}", began.elapsed());
    mended.join().expect("no panic");
}

/// The effect is shown by the cuts of `tests/fleets/cuts.rs`.
#[test]
fn links_of_this_build_are_closed_without_a_wait() {
    assert_eq!(LINGER_S, [Some("0"); 2], "see .cargo/config.toml");
}

#[test]
fn a_port_that_is_taken_or_an_endpoint_that_is_none_is_said_to_be() {
    let held = reserve_port("tcp/127.0.0.1:0").expect("a free port");
    let again = reserve_port(&held.endpoint).expect_err("it is held");
    assert!(
        matches!(again, WireSetupError::Taken { ref endpoint, .. } if *endpoint == held.endpoint),
        "{again}"
    );
    let server = ZenohWire::server_wire(std::slice::from_ref(&held.endpoint), None);
    assert!(matches!(server, Err(WireSetupError::Taken { .. })));
    for wrong in ["127.0.0.1:7600", "udp/127.0.0.1:1", "tcp/127.0.0.1", "tcp/:1", "tcp/a:99999", ""]
    {
        assert!(
            matches!(
                reserve_port(wrong),
                Err(WireSetupError::NoEndpoint { endpoint, .. }) if endpoint == wrong
            ),
            "{wrong}"
        );
    }
}

#[test]
fn nobody_who_answers_is_an_error_in_time() {
    let at = [free()];
    let began = Instant::now();
    let found = ZenohWire::node_wire(A, &at, None, SHORT_WAIT);
    assert!(matches!(found, Err(WireSetupError::NoAnswer { .. })));
    assert!(began.elapsed() < Duration::from_secs(8));
}
