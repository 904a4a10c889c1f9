//! The wire between processes and machines: Zenoh sessions on explicitly named endpoints, with scouting off.
//!
//! A node has a session as a *client* of the server's, which relays (as a *router*, because Zenoh's *peers* do not
//! relay). In a mesh it has another one as a *peer*, connected to every other node: packets go directly there. With
//! multicast they go by a socket of its own (`multicast.rs`). A frame that cannot be sent soon is dropped rather than
//! waited for, so that a stopped peer does not stop others.

mod echo;

use super::access::{
    ALL, Credentials, Guarded, access_control, frame_key, keys_to_session, sender_of,
};
use super::endpoint::{
    PortReservation, WireSetupError, check_vacant, connection_problem, endpoint_in_use,
    host_and_port, without_sources,
};
use super::multicast::{MAX_DATAGRAM_BYTES, MulticastSocket, SharedWaker};
use super::{PeerId, Wire, handshake};
use crate::protocol::{FleetMember, TransportFrame};
use echo::EchoProbes;
use sidestep::kernel::EntityId;
use sidestep_session::fleet::Tls;
use std::collections::BTreeMap;
use std::fmt;
use std::net::SocketAddrV4;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Once};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use zenoh::key_expr::KeyExpr;
use zenoh::pubsub::Subscriber;
use zenoh::qos::CongestionControl;
use zenoh::sample::{Locality, Sample};
use zenoh::{Config, Session, Wait};

/// Time without a sign of life after which Zenoh gives up a link, in milliseconds. Its own default is ten seconds, as is that
/// of `--lease`: a node would be taken for gone before its broken link could be opened anew, which takes up to
/// [`OPEN_TIMEOUT_MS`].
const LEASE_MS: u64 = 2_000;

/// Time that opening a link may take at either end, in milliseconds. With Zenoh's own limit, ten seconds, returning after
/// a partition takes as long. It must not be short either: a link whose opening is broken off at the very end stays alive
/// and half-open (`Wire::reopen_links`).
const OPEN_TIMEOUT_MS: u64 = 3_000;

/// The environment variable, with its value, by which Zenoh has one thread in a process. It is read when the first session
/// opens.
///
/// Where links are encrypted this is no choice: Zenoh reads and writes a TLS link without a lock between the two, and with
/// the threads that it has by default a process crashes now and then
/// (<https://github.com/eclipse-zenoh/zenoh/issues/2557>). On two processors it is faster there, too: two airplanes with
/// certificates fly twice as many cycles in a second by it.
pub const ONE_THREAD: (&str, &str) = (
    "ZENOH_RUNTIME",
    "(rx: (worker_threads: 1), tx: (handover: rx), acc: (handover: rx), net: (handover: rx), app: (handover: rx))",
);

/// The times in seconds for which the close of a TCP link, or of an encrypted one, waits until the other end has received
/// everything; none where Zenoh was compiled with its own, ten seconds.
///
/// The wait blocks a thread, which may be the only one ([`ONE_THREAD`]): the links to all others stand still meanwhile. A
/// link is closed when its other end is silent, so the wait is in vain, and what must arrive is sent again over the next
/// link. Zenoh reads the times as variables of its compiler; `.cargo/config.toml` sets them.
const LINGER_S: [Option<&str>; 2] =
    [option_env!("TCP_LINGER_TIMEOUT"), option_env!("TLS_LINGER_TIMEOUT")];

/// Logs, once, that this program was built with links that block when they are closed.
fn warn_of_linger() {
    static ONCE: Once = Once::new();
    if LINGER_S != [Some("0"); 2] {
        ONCE.call_once(|| {
            tracing::warn!(
                "a broken link can stop the others for 10 s in this build: build in the folder of its sources, where \
                 .cargo/config.toml sets TCP_LINGER_TIMEOUT=0 and TLS_LINGER_TIMEOUT=0"
            );
        });
    }
}

/// The parts of a Zenoh session's configuration that differ by session.
#[derive(Debug, Clone, Default)]
struct ZenohConfig<'a> {
    /// Id by which others know the session; none for one that Zenoh draws.
    id: Option<String>,
    mode: &'a str,
    listen: &'a [String],
    connect: &'a [String],
    /// Time that it waits for the first connection; none for a session that keeps trying.
    connected_within: Option<Duration>,
    /// Whether it tells those who connect of each other.
    has_gossip: bool,
    /// Whether it looks for others by multicast, and connects to those that it finds.
    is_scouting: bool,
    /// Certificates, and the endpoint at which they control access.
    guard: Option<(&'a Credentials, Guarded)>,
}

impl ZenohConfig<'_> {
    /// Returns the keys of Zenoh's configuration, as JSON. Its queues by priority stay, although each link has eight
    /// of them with buffers: without them (`transport/unicast/qos/enabled`) links become half-open now and then.
    fn json_entries(&self) -> Vec<(&'static str, String)> {
        let connected = self.connected_within.map_or(-1, |within| within.as_millis() as i64);
        let mut keys = vec![
            ("mode", format!("{:?}", self.mode)),
            ("scouting/multicast/enabled", self.is_scouting.to_string()),
            ("scouting/gossip/enabled", self.has_gossip.to_string()),
            // A router would sleep that long before it opens, to find others by scouting.
            ("scouting/delay", "0".into()),
            // A router would stamp relayed frames with the time of its wall clock, which no code reads.
            ("timestamping/enabled", "false".into()),
            // Without the empty list a session that only connects would listen at every interface.
            ("listen/endpoints", serde_json::json!(self.listen).to_string()),
            ("listen/exit_on_failure", "true".into()),
            ("connect/endpoints", serde_json::json!(self.connect).to_string()),
            ("connect/timeout_ms", connected.to_string()),
            ("connect/exit_on_failure", self.connected_within.is_some().to_string()),
            (
                // A node that starts before the server, or returns, need not wait longer than half a second.
                "connect/retry",
                r#"{"period_init_ms":50,"period_max_ms":500,"period_increase_factor":2}"#.into(),
            ),
            ("transport/link/tx/lease", LEASE_MS.to_string()),
            // Signs of life in each lease, so that some of them may be late.
            ("transport/link/tx/keep_alive", "4".into()),
            ("transport/unicast/open_timeout", OPEN_TIMEOUT_MS.to_string()),
            ("transport/unicast/accept_timeout", OPEN_TIMEOUT_MS.to_string()),
        ];
        if let Some(id) = &self.id {
            keys.push(("id", format!("{id:?}")));
        }
        if let Some((Credentials { tls, agents }, guarded)) = self.guard {
            keys.push(("access_control", access_control(guarded, agents).to_string()));
            let authority = serde_json::json!(tls.authority).to_string();
            let certificate = serde_json::json!(tls.certificate).to_string();
            let key = serde_json::json!(tls.key).to_string();
            keys.extend([
                ("transport/link/tls/root_ca_certificate", authority),
                ("transport/link/tls/listen_certificate", certificate.clone()),
                ("transport/link/tls/listen_private_key", key.clone()),
                ("transport/link/tls/connect_certificate", certificate),
                ("transport/link/tls/connect_private_key", key),
                ("transport/link/tls/enable_mtls", "true".into()),
                ("transport/link/tls/verify_name_on_connect", "true".into()),
                ("transport/link/tls/close_link_on_expiration", "true".into()),
            ]);
        }
        keys
    }

    fn open(&self) -> Result<Session, String> {
        warn_of_linger();
        let mut config = Config::default();
        for (key, value) in self.json_entries() {
            config
                .insert_json5(key, &value)
                .map_err(|e| format!("{key} = {value}: {}", without_sources(&e.to_string())))?;
        }
        zenoh::open(config).wait().map_err(|e| without_sources(&e.to_string()))
    }
}

/// How a party without a server finds others and proves its identity.
#[derive(Debug, Clone, Copy, Default)]
pub struct PeerOptions<'a> {
    /// Whether it looks for others by multicast.
    pub is_scouting: bool,
    /// Its certificates, if there are any.
    pub credentials: Option<&'a Credentials>,
}

/// A wire over one or two Zenoh sessions.
pub struct ZenohWire {
    me: PeerId,
    /// Frames that have arrived, over any session.
    frames: Receiver<Vec<u8>>,
    inbox: Inbox,
    /// The session with the server, or the server's own.
    hub: ZenohLink,
    /// The session with all other nodes, in a mesh.
    mesh: Option<ZenohLink>,
    /// The group of all nodes, with multicast.
    multicast: Option<MulticastSocket>,
    /// Endpoints at one of which the server listens; none of the server's own wire.
    server: Vec<String>,
    /// The endpoints at which other nodes reach this one; none in a star.
    listens: Vec<String>,
    /// The ports of these endpoints, until the mesh is opened.
    ports: Vec<PortReservation>,
    credentials: Option<Credentials>,
    /// All other nodes, in ascending order.
    other_nodes: Vec<PeerId>,
    /// The endpoints of the mesh to which this node opens links.
    connect: Vec<String>,
    /// The id of this node in the mesh, which all its sessions there share; 0 before the first.
    mesh_id: u128,
    /// Number of times that the mesh was opened.
    mesh_openings: u32,
    /// Probes of the links of the mesh.
    echoes: EchoProbes,
    /// The thread that closes the former links of the mesh, if any were closed.
    closing: Option<JoinHandle<()>>,
}

/// A session, and the keys of the peers reached over it.
struct ZenohLink {
    me: PeerId,
    keys: BTreeMap<PeerId, KeyExpr<'static>>,
    _subscribers: Vec<Subscriber<()>>,
    session: Session,
}

/// The bits of a session's id that identify its node: the other bits count how often the node has opened the session.
const ZENOH_ID_MASK: u128 = u128::MAX >> 32;

/// Returns the id of a node in its present incarnation.
fn zenoh_id(member: &FleetMember) -> u128 {
    u128::from(member.agent) << 64 | u128::from(member.incarnation.0)
}

impl fmt::Debug for ZenohWire {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ZenohWire").field("me", &self.me).finish_non_exhaustive()
    }
}

/// What the subscribers of a wire share.
struct Inbox {
    frames: Sender<Vec<u8>>,
    /// Wakes the receiver where it does not wait for these frames alone.
    waker: SharedWaker,
    /// Number of frames that were not received because their sender is not who they say.
    forged: Arc<AtomicU64>,
}

/// Forwards the frames that are published under a key to the receiver of a wire; echo probes are answered on the spot. A
/// frame whose sender is another one than its key says is not forwarded: only the key is under access control.
fn subscribe(
    session: &Session,
    key: &str,
    me: PeerId,
    inbox: &Inbox,
    echoes: &EchoProbes,
) -> Result<Subscriber<()>, String> {
    let frames = inbox.frames.clone();
    let waker = inbox.waker.clone();
    let forged = inbox.forged.clone();
    let is_echo = match me {
        PeerId::Node(agent) => Some(echoes.handler(agent, session.clone())),
        PeerId::Server => None,
    };
    let subscriber = session.declare_subscriber(key).callback(move |sample: Sample| {
        if is_echo.as_ref().is_some_and(|is_echo| is_echo(&sample)) {
            return;
        }
        let bytes = sample.payload().to_bytes().into_owned();
        let said = TransportFrame::sender(&bytes);
        if said.is_some() && said != sender_of(sample.key_expr().as_str()) {
            forged.fetch_add(1, Ordering::Relaxed);
            return;
        }
        // An error means that the wire was dropped.
        let _ = frames.send(bytes);
        if let Some(waker) = waker.get() {
            let _ = waker.wake();
        }
    });
    subscriber.wait().map_err(|e| without_sources(&e.to_string()))
}

impl ZenohLink {
    fn new(
        session: Session,
        me: PeerId,
        inbox: &Inbox,
        echoes: &EchoProbes,
    ) -> Result<Self, String> {
        let mut subscribers = Vec::new();
        for key in keys_to_session(me, session.zid()) {
            subscribers.push(subscribe(&session, &key, me, inbox, echoes)?);
        }
        Ok(Self { me, keys: BTreeMap::new(), _subscribers: subscribers, session })
    }

    fn send(&mut self, to: PeerId, frame: &[u8]) {
        let me = self.me;
        let key = self.keys.entry(to).or_insert_with(|| {
            KeyExpr::try_from(frame_key(me, to)).expect("a path of letters and digits is a key")
        });
        publish_to_key(&self.session, key, frame, None);
    }

    /// Returns whether there is a link to another node that shows signs of life, even if nothing else arrives through it.
    fn is_open_to(&self, member: &FleetMember) -> bool {
        let wanted = zenoh_id(member);
        let mut peers = self.session.info().peers_zid().wait();
        peers.any(|id| u128::from_le_bytes(id.to_le_bytes()) & ZENOH_ID_MASK == wanted)
    }

    /// Closes all links, which takes up to some seconds where another end is out of reach.
    fn close(self) {
        // Unsent frames are lost, like frames in transit.
        let _ = self.session.close().wait();
    }

    /// Sends a frame to all nodes that this session reaches, except itself.
    fn broadcast(&self, frame: &[u8]) {
        let key = KeyExpr::try_from(frame_key(self.me, ALL)).expect("a path of letters is a key");
        publish_to_key(&self.session, &key, frame, None);
    }
}

/// Publishes a frame, or with an attachment a probe.
fn publish_to_key(
    session: &Session,
    key: &KeyExpr<'_>,
    frame: &[u8],
    attachment: Option<&'static [u8]>,
) {
    // Not by a declared publisher: declaring one in a client waits for the other end first.
    let put = session.put(key, frame).attachment(attachment).allowed_destination(Locality::Remote);
    // An error is like a loss in transit.
    let _ = put.congestion_control(CongestionControl::Drop).wait();
}

impl ZenohWire {
    /// Returns the server's wire, which listens at endpoints. A process with certificates needs [`ONE_THREAD`].
    ///
    /// # Errors
    /// When one of them cannot be bound.
    pub fn server_wire(
        listen: &[String],
        credentials: Option<&Credentials>,
    ) -> Result<Self, WireSetupError> {
        // Zenoh's own error names no endpoint.
        listen.iter().try_for_each(|endpoint| check_vacant(endpoint))?;
        let guard = credentials.map(|own| (own, Guarded::Server));
        let config = ZenohConfig { mode: "router", listen, guard, ..ZenohConfig::default() };
        Self::from_config(PeerId::Server, &config).map_err(|reason| endpoint_in_use(listen, reason))
    }

    /// Returns the wire of a node to its server, at one of some endpoints. A process with certificates needs
    /// [`ONE_THREAD`].
    ///
    /// # Errors
    /// When none of them answers within some time, or a certificate is rejected.
    pub fn node_wire(
        me: PeerId,
        connect: &[String],
        credentials: Option<&Credentials>,
        within: Duration,
    ) -> Result<Self, WireSetupError> {
        let tls = credentials.map(|own| &own.tls);
        check_trust(connect, tls)?;
        let guarded = match me {
            PeerId::Node(agent) => Guarded::Node(agent),
            PeerId::Server => Guarded::Server,
        };
        let config = client_config(connect, credentials.map(|own| (own, guarded)), within);
        let wire = Self::from_config(me, &config).map_err(|reason| {
            // At the first check the other end may not have listened yet.
            check_trust(connect, tls).err().unwrap_or_else(|| no_answer(connect, reason))
        })?;
        Ok(Self { server: connect.to_vec(), ..wire })
    }

    /// Returns the wire of a party without a server: a peer that listens at endpoints, connects to those of others, and looks
    /// for further ones by multicast if it is to. It opens at once, and goes on to connect. A process with certificates needs
    /// [`ONE_THREAD`].
    ///
    /// # Errors
    /// When an endpoint cannot be bound.
    pub fn peer_wire(
        me: PeerId,
        listen: &[String],
        connect: &[String],
        options: PeerOptions<'_>,
    ) -> Result<Self, WireSetupError> {
        connect.iter().try_for_each(|endpoint| host_and_port(endpoint).map(drop))?;
        listen.iter().try_for_each(|endpoint| check_vacant(endpoint))?;
        let guarded = match me {
            PeerId::Node(agent) => Guarded::Mesh(agent),
            PeerId::Server => Guarded::Server,
        };
        let config = ZenohConfig {
            mode: "peer",
            listen,
            connect,
            is_scouting: options.is_scouting,
            guard: options.credentials.map(|own| (own, guarded)),
            ..ZenohConfig::default()
        };
        Self::from_config(me, &config).map_err(|reason| endpoint_in_use(listen, reason))
    }

    fn from_config(me: PeerId, config: &ZenohConfig<'_>) -> Result<Self, String> {
        let (frame_sender, frames) = channel();
        let echoes = EchoProbes::default();
        let inbox = Inbox { frames: frame_sender, waker: Arc::default(), forged: Arc::default() };
        let hub = ZenohLink::new(config.open()?, me, &inbox, &echoes)?;
        Ok(Self {
            me,
            frames,
            inbox,
            hub,
            mesh: None,
            multicast: None,
            server: Vec::new(),
            listens: Vec::new(),
            ports: Vec::new(),
            credentials: config.guard.map(|(own, _)| own.clone()),
            other_nodes: Vec::new(),
            connect: Vec::new(),
            mesh_id: 0,
            mesh_openings: 0,
            echoes,
            closing: None,
        })
    }

    /// Makes this node reachable by others at endpoints of its own, once it joins the mesh.
    pub fn with_listeners(self, ports: Vec<PortReservation>) -> Self {
        let listens = ports.iter().map(|port| port.endpoint.clone()).collect();
        Self { listens, ports, ..self }
    }

    fn open_mesh(&mut self) -> Result<(), WireSetupError> {
        // Reserved until now, so that no other program gets them.
        self.ports.clear();
        // An id of its own each time: others may not have noticed yet that the session before is closed, and reject a second
        // one with the same id.
        self.mesh_openings += 1;
        let id = u128::from(self.mesh_openings) << 96 | self.mesh_id;
        let guarded = match self.me {
            PeerId::Node(agent) => Some(Guarded::Mesh(agent)),
            PeerId::Server => None,
        };
        let config = ZenohConfig {
            id: Some(format!("{id:x}")),
            mode: "peer",
            listen: &self.listens,
            connect: &self.connect,
            guard: self.credentials.as_ref().zip(guarded),
            ..ZenohConfig::default()
        };
        let link = config
            .open()
            .and_then(|session| ZenohLink::new(session, self.me, &self.inbox, &self.echoes))
            .map_err(|reason| endpoint_in_use(&self.listens, reason))?;
        self.mesh = Some(link);
        Ok(())
    }
}

impl ZenohWire {
    /// Returns the server's session, for queries of viewers.
    pub(super) fn server_session(&self) -> &Session {
        &self.hub.session
    }
}

/// Returns the configuration of a client's session.
fn client_config<'a>(
    connect: &'a [String],
    guard: Option<(&'a Credentials, Guarded)>,
    within: Duration,
) -> ZenohConfig<'a> {
    ZenohConfig {
        mode: "client",
        connect,
        guard,
        connected_within: Some(within),
        ..ZenohConfig::default()
    }
}

/// Returns a session with a fleet's server for a viewer, which is no node and only sends queries.
///
/// # Errors
/// When none of some endpoints answers within some time.
pub(super) fn open_query_session(
    connect: &[String],
    tls: Option<&Tls>,
    within: Duration,
) -> Result<Session, WireSetupError> {
    for endpoint in connect {
        host_and_port(endpoint)?;
    }
    let credentials = tls.map(|tls| Credentials { tls: tls.clone(), agents: Vec::new() });
    let guard = credentials.as_ref().map(|own| (own, Guarded::Viewer));
    client_config(connect, guard, within).open().map_err(|reason| no_answer(connect, reason))
}

/// Returns the session by which a node serves its vehicle at an endpoint.
///
/// # Errors
/// When the endpoint cannot be bound.
pub(crate) fn open_vehicle_session(endpoint: &str) -> Result<Session, WireSetupError> {
    check_vacant(endpoint)?;
    let listen = [endpoint.to_string()];
    let config = ZenohConfig { mode: "router", listen: &listen, ..ZenohConfig::default() };
    config.open().map_err(|reason| endpoint_in_use(&listen, reason))
}

/// Returns the session of a node of ROS 2. One that listens is a *router*, by which other nodes find each other, as ROS
/// requires one on each machine; one that only connects is a *client* of another router.
///
/// # Errors
/// When an endpoint cannot be bound, or none of the routers answers within some time.
pub(crate) fn open_ros2_session(
    listen: &[String],
    connect: &[String],
    within: Duration,
) -> Result<Session, WireSetupError> {
    for endpoint in connect {
        host_and_port(endpoint)?;
    }
    if listen.is_empty() {
        return client_config(connect, None, within).open().map_err(|said| {
            let problems = connect.iter().filter_map(|endpoint| connection_problem(endpoint));
            let reason = problems.reduce(|all, next| format!("{all}; {next}")).unwrap_or(said);
            WireSetupError::NoAnswer { endpoint: connect.join(", "), reason }
        });
    }
    listen.iter().try_for_each(|endpoint| check_vacant(endpoint))?;
    let has_gossip = true;
    let config =
        ZenohConfig { mode: "router", listen, connect, has_gossip, ..ZenohConfig::default() };
    config.open().map_err(|reason| endpoint_in_use(listen, reason))
}

/// Returns the error of endpoints that do not answer. Zenoh says of most that time has passed, and not why.
fn no_answer(connect: &[String], said: String) -> WireSetupError {
    let mut reasons = Vec::new();
    for endpoint in connect {
        let Some(reason) = connection_problem(endpoint) else { continue };
        reasons.push(reason);
    }
    let reason = match () {
        () if !reasons.is_empty() => reasons.join("; "),
        () if said.contains("Timeout") => {
            "what listens there is no server of a fleet, or asks for \
                                           certificates that were not given"
                .into()
        }
        () => said,
    };
    WireSetupError::NoAnswer { endpoint: connect.join(", "), reason }
}

impl Wire for ZenohWire {
    fn send(&mut self, to: &[PeerId], frame: &[u8]) {
        if let Some(group) = &self.multicast
            && !to.contains(&PeerId::Server)
            // The server relays what is too large for a datagram, or what the system does not take.
            && frame.len() <= MAX_DATAGRAM_BYTES
            && group.send(to, frame)
        {
            return;
        }
        let link = match &mut self.mesh {
            Some(mesh) if !to.contains(&PeerId::Server) => mesh,
            _ => &mut self.hub,
        };
        // To more than half of the nodes one broadcast is cheaper than a frame for each, although some nodes receive it in
        // vain: with ten airplanes in a star it took the processor time of a packet from 153 to about 100 us.
        // With certificates nobody reads what is not for it.
        let are_most = match &self.credentials {
            None => to.len() > 1 && 2 * to.len() > self.other_nodes.len(),
            Some(_) => to.len() > 1 && to.len() >= self.other_nodes.len(),
        };
        if are_most && to.iter().all(|peer| self.other_nodes.binary_search(peer).is_ok()) {
            link.broadcast(frame);
        } else {
            to.iter().for_each(|&peer| link.send(peer, frame));
        }
    }

    fn take_forged(&mut self) -> u64 {
        self.inbox.forged.swap(0, Ordering::Relaxed)
    }

    fn receive(&mut self, within: Duration) -> Option<Vec<u8>> {
        let Some(group) = &mut self.multicast else {
            return self.frames.recv_timeout(within).ok();
        };
        let until = Instant::now() + within;
        loop {
            // What the server says comes first: it may make what others say obsolete.
            if let Ok(frame) = self.frames.try_recv() {
                return Some(frame);
            }
            let heard = group.try_receive();
            let is_silent = heard.is_none();
            if let Some((sender, frame)) = heard {
                // Only a node sends to the group. Whoever names the server there would be believed: what that says is
                // not signed, because it comes over a link with it.
                if sender != Some(PeerId::Server) {
                    return Some(frame);
                }
                self.inbox.forged.fetch_add(1, Ordering::Relaxed);
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            if is_silent {
                group.wait(left);
            }
        }
    }

    fn join_multicast(&mut self, group: SocketAddrV4) -> Result<(), WireSetupError> {
        self.multicast = Some(MulticastSocket::join(group, &self.server, &self.inbox.waker)?);
        Ok(())
    }

    fn connect_mesh(
        &mut self,
        me: EntityId,
        members: &[FleetMember],
    ) -> Result<(), WireSetupError> {
        let others = members.iter().map(|member| PeerId::Node(member.agent));
        self.other_nodes = others.filter(|&peer| peer != self.me).collect();
        self.other_nodes.sort_unstable();
        // With certificates nobody is believed by an address: whoever repeats a frame would have one.
        if let (Some(group), None) = (&mut self.multicast, &self.credentials) {
            group.set_members(members);
        }
        // An open session reconnects to returning nodes by itself.
        if self.listens.is_empty() || self.mesh.is_some() {
            return Ok(());
        }
        // One connection for each pair of nodes, opened by the one with the higher id.
        let lower = members.iter().filter(|member| member.agent < me);
        self.connect = lower.flat_map(|member| member.listens.clone()).collect();
        self.mesh_id = members.iter().find(|member| member.agent == me).map_or(0, zenoh_id);
        self.open_mesh()
    }

    fn is_half_open(&mut self, member: &FleetMember, within: Duration) -> bool {
        let (Some(mesh), PeerId::Node(me)) = (&self.mesh, self.me) else { return false };
        mesh.is_open_to(member)
            && self.echoes.probe_and_check_timeout(&mesh.session, me, member.agent, within)
    }

    fn reopen_links(&mut self) -> Result<(), WireSetupError> {
        if let Some(mesh) = self.mesh.take() {
            self.closing = Some(std::thread::spawn(move || mesh.close()));
        }
        self.echoes.clear();
        if self.listens.is_empty() {
            return Ok(());
        }
        if self.closing.as_ref().is_some_and(|closing| !closing.is_finished()) {
            let reason = "the former links are being closed".to_string();
            return Err(endpoint_in_use(&self.listens, reason));
        }
        self.open_mesh()
    }
}

/// Checks whether certificates are the reason why no endpoint can be reached: Zenoh gives none.
///
/// # Errors
/// With the problem of the first endpoint, if certificates are rejected at every one.
fn check_trust(connect: &[String], tls: Option<&Tls>) -> Result<(), WireSetupError> {
    let Some(tls) = tls else { return Ok(()) };
    let mut first_problem = None;
    for endpoint in connect {
        let Some(reason) = handshake::certificate_problem(endpoint, tls) else {
            // One endpoint that can be reached is enough.
            return Ok(());
        };
        let problem = WireSetupError::Distrust { endpoint: endpoint.clone(), reason };
        first_problem.get_or_insert(problem);
    }
    first_problem.map_or(Ok(()), Err)
}

#[cfg(test)]
mod tests;
