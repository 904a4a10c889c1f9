//! A multicast group of UDP: a frame to many nodes is sent once, and the network copies it.
//!
//! Without certificates a frame to one node goes to it alone, as soon as it was heard. A datagram arrives whole or not at
//! all, and a lost one stops no other: what must arrive is repeated above (`arq.rs`). There are no links that could
//! break, and nothing here waits for another node.

use super::PeerId;
use super::endpoint::{WireSetupError, bare_host, endpoint_in_use, host_and_port};
use crate::protocol::{FleetMember, Incarnation, TransportFrame};
use mio::net::UdpSocket;
use mio::{Events, Interest, Poll, Token, Waker};
use socket2::{Domain, Protocol, Socket, Type};
use std::collections::BTreeMap;
use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::io;
use std::net::{
    IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4, ToSocketAddrs, UdpSocket as StdUdpSocket,
};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::Duration;

/// Maximum size of a datagram's content: what a length of 16 bits leaves beside the headers of IPv4 and UDP.
pub(super) const MAX_DATAGRAM_BYTES: usize = 65_507;

/// Bytes that wait in the socket until the node reads them; the system may give less. A round of fifty nodes fits in,
/// with the bookkeeping of the system for each datagram.
const RECEIVE_BUFFER_BYTES: usize = 1 << 20;

/// Maximum number of routers between two nodes, which have to be told to forward multicast at all.
const TIME_TO_LIVE: u32 = 8;

/// Number of times that a node lets other processes run before it sleeps until a datagram arrives. Nodes of one machine take
/// turns: what the others send meanwhile is read in one go, and nobody has to wake this node for each of it. Where no
/// other process wants to run, these are some microseconds.
const YIELDS_BEFORE_SLEEP: usize = 8;

const GROUP_SOCKET: Token = Token(0);
const OWN_SOCKET: Token = Token(1);
const WAKER: Token = Token(2);

/// Wakes a node that waits for datagrams when something else has arrived; none before it has a multicast group.
pub(super) type SharedWaker = Arc<OnceLock<Waker>>;

/// A membership in a group.
pub(super) struct MulticastSocket {
    group: SocketAddrV4,
    poll: Poll,
    events: Events,
    /// Receives what is sent to the group.
    receiver: ReadySocket,
    /// Sends, and receives what is for this node alone.
    own: ReadySocket,
    /// The address from which this node sends: its own datagrams come back to it, too.
    own_address: SocketAddr,
    /// The incarnations of the members of the fleet: another fleet may have the same group.
    members: BTreeMap<PeerId, Incarnation>,
    /// The addresses from which members were last heard.
    addresses: BTreeMap<PeerId, SocketAddr>,
    buffer: Box<[u8]>,
}

/// A socket, and whether datagrams may be there. The system tells that once, when the first one arrives: until the socket
/// was found empty, it has to be read without asking.
struct ReadySocket {
    socket: UdpSocket,
    is_ready: bool,
}

impl MulticastSocket {
    /// Joins a group at the interface by which this machine reaches one of some endpoints; `waker` is set.
    ///
    /// # Errors
    /// When this machine has no such interface, or it carries no multicast.
    pub(super) fn join(
        group: SocketAddrV4,
        toward: &[String],
        waker: &SharedWaker,
    ) -> Result<Self, WireSetupError> {
        let taken =
            |error: io::Error| endpoint_in_use(&[format!("udp/{group}")], error.to_string());
        let interface = interface_toward(toward)?;
        let poll = Poll::new().map_err(taken)?;
        let mut receiver = open_receiver(group, interface).map_err(taken)?;
        let mut own = open_own(interface).map_err(taken)?;
        let readable = Interest::READABLE;
        poll.registry().register(&mut receiver, GROUP_SOCKET, readable).map_err(taken)?;
        poll.registry().register(&mut own, OWN_SOCKET, readable).map_err(taken)?;
        let own_address = own.local_addr().map_err(taken)?;
        let [receiver, own] = [receiver, own].map(|socket| ReadySocket { socket, is_ready: true });
        let _ = waker.set(Waker::new(poll.registry(), WAKER).map_err(taken)?);
        let events = Events::with_capacity(4);
        let buffer = vec![0; MAX_DATAGRAM_BYTES].into();
        let members = BTreeMap::new();
        let addresses = BTreeMap::new();
        Ok(Self { group, poll, events, receiver, own, own_address, members, addresses, buffer })
    }

    /// Learns of the members of the fleet, some of which may have restarted.
    pub(super) fn set_members(&mut self, members: &[FleetMember]) {
        let known = std::mem::take(&mut self.members);
        for member in members {
            self.members.insert(PeerId::Node(member.agent), member.incarnation);
        }
        // A process that has taken the place of another one has an address of its own.
        self.addresses.retain(|peer, _| known.get(peer) == self.members.get(peer));
    }

    /// Sends a frame to nodes of the group, and returns whether the system has taken it.
    pub(super) fn send(&self, to: &[PeerId], frame: &[u8]) -> bool {
        let address = match to {
            [one] => self.addresses.get(one).copied(),
            _ => None,
        };
        self.own.socket.send_to(frame, address.unwrap_or(self.group.into())).is_ok()
    }

    /// Returns the next frame that has arrived from another node, with the sender that it names, if any.
    pub(super) fn try_receive(&mut self) -> Option<(Option<PeerId>, Vec<u8>)> {
        let Self { own, receiver, buffer, own_address, .. } = self;
        let (frame, from) = own
            .try_receive(*own_address, buffer)
            .or_else(|| receiver.try_receive(*own_address, buffer))?;
        let process = TransportFrame::sender_process(&frame);
        if let Some((sender, incarnation)) = process
            && self.members.get(&sender) == Some(&incarnation)
        {
            self.addresses.insert(sender, from);
        }
        Some((process.map(|(sender, _)| sender), frame))
    }

    /// Waits until something arrives here, or its waker is used, and at most the given time.
    pub(super) fn wait(&mut self, within: Duration) {
        for _ in 0..YIELDS_BEFORE_SLEEP {
            thread::yield_now();
            if self.poll_events(Duration::ZERO) {
                return;
            }
        }
        self.poll_events(within);
    }

    /// Waits for an event, and returns whether there was one.
    fn poll_events(&mut self, within: Duration) -> bool {
        if self.poll.poll(&mut self.events, Some(within)).is_err() {
            // An interrupt is like an arrival: the caller looks what there is.
            return true;
        }
        for event in &self.events {
            match event.token() {
                GROUP_SOCKET => self.receiver.is_ready = true,
                OWN_SOCKET => self.own.is_ready = true,
                _ => {}
            }
        }
        !self.events.is_empty()
    }
}

impl ReadySocket {
    /// Returns the next datagram that is not this node's own, and the address of its sender.
    fn try_receive(
        &mut self,
        own_address: SocketAddr,
        buffer: &mut [u8],
    ) -> Option<(Vec<u8>, SocketAddr)> {
        while self.is_ready {
            match self.socket.recv_from(buffer) {
                Ok((_, from)) if from == own_address => {}
                Ok((length, from)) => return Some((buffer[..length].to_vec(), from)),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => self.is_ready = false,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                // The socket has an error, which the next call may not have.
                Err(_) => return None,
            }
        }
        None
    }
}

fn open_receiver(group: SocketAddrV4, interface: Ipv4Addr) -> io::Result<UdpSocket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    // Every node of a machine receives at the same port.
    socket.set_reuse_address(true)?;
    // A system that gives less gives what it has.
    let _ = socket.set_recv_buffer_size(RECEIVE_BUFFER_BYTES);
    // Bound to the group, it gets nothing that is sent to another one at the same port; Windows cannot bind it so.
    let bound = if cfg!(windows) { Ipv4Addr::UNSPECIFIED } else { *group.ip() };
    socket.bind(&SocketAddrV4::new(bound, group.port()).into())?;
    socket.join_multicast_v4(group.ip(), &interface)?;
    socket.set_nonblocking(true)?;
    Ok(UdpSocket::from_std(socket.into()))
}

fn open_own(interface: Ipv4Addr) -> io::Result<UdpSocket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_multicast_if_v4(&interface)?;
    socket.set_multicast_ttl_v4(TIME_TO_LIVE)?;
    // Nodes on the same machine hear it, too.
    socket.set_multicast_loop_v4(true)?;
    let _ = socket.set_recv_buffer_size(RECEIVE_BUFFER_BYTES);
    socket.bind(&SocketAddrV4::new(interface, 0).into())?;
    socket.set_nonblocking(true)?;
    Ok(UdpSocket::from_std(socket.into()))
}

/// Returns the address of this machine from which it reaches one of some endpoints.
fn interface_toward(endpoints: &[String]) -> Result<Ipv4Addr, WireSetupError> {
    for endpoint in endpoints {
        let (host, port) = host_and_port(endpoint)?;
        let Ok(addresses) = (bare_host(host), port).to_socket_addrs() else { continue };
        for address in addresses.filter(SocketAddr::is_ipv4) {
            if let Some(interface) = interface_toward_address(address) {
                return Ok(interface);
            }
        }
    }
    let reason = "multicast needs an IPv4 address of the server, from which follows the interface"
        .to_string();
    Err(WireSetupError::NoEndpoint { endpoint: endpoints.join(", "), reason })
}

fn interface_toward_address(address: SocketAddr) -> Option<Ipv4Addr> {
    let socket = StdUdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).ok()?;
    // Nothing is sent: the system looks up the route.
    socket.connect(address).ok()?;
    match socket.local_addr().ok()?.ip() {
        IpAddr::V4(interface) => Some(interface),
        IpAddr::V6(_) => None,
    }
}

/// Returns a group that no other fleet has, but for a chance of 1 in 786 million: its address is of those that stay within
/// an organization's network (RFC 2365), its port one of those that fleets take (`reserve_port`).
pub fn draw_group() -> SocketAddrV4 {
    // The standard library seeds its hash maps from the system's source of randomness.
    let [a, b, c, d, ..] = RandomState::new().hash_one("multicast group").to_le_bytes();
    let port =
        super::endpoint::FIRST_PORT + u16::from_le_bytes([c, d]) % super::endpoint::PORT_COUNT;
    SocketAddrV4::new(Ipv4Addr::new(239, 255, a, b), port)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Message;
    use std::time::Instant;

    const LOOPBACK: &str = "tcp/127.0.0.1:7600";

    /// Returns a member of a group on this machine; `None`, with a printed reason, where that has no multicast.
    fn member(group: SocketAddrV4, waker: &SharedWaker) -> Option<MulticastSocket> {
        let joined = MulticastSocket::join(group, &[LOOPBACK.into()], waker);
        joined.map_err(|error| sidestep_testing::skip(error.to_string())).ok()
    }

    /// The receivers of a frame for more than one.
    const ALL: [PeerId; 2] = [PeerId::Node(0), PeerId::Node(1)];

    fn receive(socket: &mut MulticastSocket) -> Option<Vec<u8>> {
        let until = Instant::now() + Duration::from_secs(20);
        loop {
            let frame = socket.try_receive().map(|(_, frame)| frame);
            let left = until.saturating_duration_since(Instant::now());
            if frame.is_some() || left.is_zero() {
                return frame;
            }
            socket.wait(left);
        }
    }

    #[test]
    fn a_frame_reaches_all_others_of_its_group_and_not_its_sender() {
        let group = draw_group();
        let join = || member(group, &SharedWaker::default());
        let (Some(mut a), Some(mut b), Some(mut c)) = (join(), join(), join()) else { return };
        let large = vec![7; MAX_DATAGRAM_BYTES];
        a.send(&ALL, &large);
        b.send(&ALL, &[8]);
        assert!(receive(&mut b) == Some(large.clone()), "of the greatest size");
        assert!(receive(&mut c) == Some(large));
        assert_eq!(receive(&mut c), Some(vec![8]));
        assert_eq!(receive(&mut a), Some(vec![8]), "its own frame does not come back");
    }

    #[test]
    fn a_frame_of_another_group_at_the_same_port_is_not_heard() {
        let group = draw_group();
        let other = SocketAddrV4::new(Ipv4Addr::new(239, 254, 0, 1), group.port());
        let join = |group| member(group, &SharedWaker::default());
        let (Some(mut a), Some(b), Some(stranger)) = (join(group), join(group), join(other)) else {
            return;
        };
        stranger.send(&ALL, &[1]);
        b.send(&ALL, &[2]);
        assert_eq!(receive(&mut a), Some(vec![2]));
    }

    /// A frame of a node to others.
    fn frame_of(agent: u32, number: u64) -> Vec<u8> {
        let from = PeerId::Node(agent);
        let message = Some(Message::Heartbeat);
        TransportFrame { from, incarnation: Incarnation(1), number, to: Vec::new(), message }
            .encode()
    }

    #[test]
    fn a_frame_to_one_node_that_was_heard_reaches_it_alone() {
        let group = draw_group();
        let join = || member(group, &SharedWaker::default());
        let (Some(mut a), Some(mut b), Some(mut c)) = (join(), join(), join()) else { return };
        let [hello, to_one, to_all] = [frame_of(2, 0), frame_of(1, 1), frame_of(1, 2)];
        let member = |incarnation| FleetMember {
            agent: 2,
            incarnation: Incarnation(incarnation),
            listens: Vec::new(),
            session: None,
        };
        a.set_members(&[member(7)]);
        c.send(&ALL, &hello);
        assert_eq!(receive(&mut a), Some(hello.clone()));
        assert!(a.addresses.is_empty(), "it is no member");
        a.set_members(&[member(1)]);
        c.send(&ALL, &hello);
        assert_eq!(receive(&mut a), Some(hello.clone()));
        assert_eq!([receive(&mut b), receive(&mut b)], [Some(hello.clone()), Some(hello)]);
        a.send(&[PeerId::Node(2)], &to_one);
        a.send(&ALL, &to_all);
        assert_eq!(receive(&mut b), Some(to_all.clone()), "what was for one does not come here");
        let heard = [receive(&mut c), receive(&mut c)];
        assert!(heard.contains(&Some(to_one)) && heard.contains(&Some(to_all)));
        a.set_members(&[member(2)]);
        assert!(a.addresses.is_empty(), "another process is in its place");
    }

    #[test]
    fn a_waker_ends_a_wait_for_datagrams() {
        let waker = SharedWaker::default();
        let Some(mut socket) = member(draw_group(), &waker) else { return };
        let began = Instant::now();
        waker.get().expect("it is set").wake().expect("awake");
        socket.wait(Duration::from_secs(20));
        assert!(began.elapsed() < Duration::from_secs(10));
        assert!(socket.try_receive().is_none());
    }

    #[test]
    fn a_server_that_has_no_ipv4_address_is_refused_with_the_reason() {
        let error = MulticastSocket::join(
            draw_group(),
            &["tcp/[::1]:7600".into()],
            &SharedWaker::default(),
        );
        let text = error.err().expect("no interface").to_string();
        assert!(text.contains("IPv4"), "{text}");
    }
}
