//! The wire between processes and machines: Zenoh sessions on explicitly named endpoints, with scouting off.
//!
//! A node has a session as a *client* of the server's, which relays (a *router* in Zenoh's words, because peers do
//! not). In a mesh it has another one as a *peer*, connected to every other node: packets go directly there. A frame
//! that cannot be sent soon is dropped rather than waited for, so that a stopped party does not stop others.

mod echo;

use super::endpoint::{PortReservation, WireError, check_vacant, endpoint_in_use, host_and_port};
use super::{Peer, Wire, handshake};
use crate::protocol::Member;
use echo::EchoProbes;
use sidestep::kernel::EntityId;
use sidestep_session::fleet::Tls;
use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};
use zenoh::key_expr::KeyExpr;
use zenoh::pubsub::Subscriber;
use zenoh::qos::CongestionControl;
use zenoh::sample::{Locality, Sample};
use zenoh::{Config, Session, Wait};

/// Time without a sign of life after which Zenoh takes a link for broken, in milliseconds.
const LEASE_MS: u64 = 2_000;

/// Time that opening a link may take at either end, in milliseconds. With Zenoh's own limit, ten seconds, coming back
/// after a partition takes as long. It must not be short either: a link with an opening that is broken off at the
/// very end stays alive and deaf (`Wire::reopen_links`).
const OPEN_TIMEOUT_MS: u64 = 3_000;

/// Time in which the endpoints of a closed session can usually be taken again.
const RELEASE_TIMEOUT: Duration = Duration::from_secs(1);

/// Settings of a Zenoh session.
#[derive(Debug, Clone, Default)]
struct ZenohConfig<'a> {
    /// Name by which others know the session; none for one that Zenoh makes up.
    id: Option<String>,
    mode: &'a str,
    listen: &'a [String],
    connect: &'a [String],
    /// Time that it waits for the first connection; none for one that goes on trying.
    connected_within: Option<Duration>,
    tls: Option<&'a Tls>,
}

impl ZenohConfig<'_> {
    /// Returns the keys of Zenoh's configuration, as JSON. Its queues by priority stay, although each link has eight
    /// of them with buffers: without them (`transport/unicast/qos/enabled`) a session turns deaf now and then.
    fn keys(&self) -> Vec<(&'static str, String)> {
        let list = |endpoints: &[String]| serde_json::json!(endpoints).to_string();
        let connected = self.connected_within.map_or(-1, |within| within.as_millis() as i64);
        let mut keys = vec![
            ("mode", format!("{:?}", self.mode)),
            ("scouting/multicast/enabled", "false".into()),
            ("scouting/gossip/enabled", "false".into()),
            // A router sleeps that long before it is open, in order to be found.
            ("scouting/delay", "0".into()),
            // A router would stamp relayed frames with the time of its wall clock, which no code reads.
            ("timestamping/enabled", "false".into()),
            // Without the empty list a party that only connects would listen at every interface.
            ("listen/endpoints", list(self.listen)),
            ("listen/exit_on_failure", "true".into()),
            ("connect/endpoints", list(self.connect)),
            ("connect/timeout_ms", connected.to_string()),
            ("connect/exit_on_failure", self.connected_within.is_some().to_string()),
            (
                "connect/retry",
                r#"{"period_init_ms":50,"period_max_ms":500,"period_increase_factor":2}"#.into(),
            ),
            ("transport/link/tx/lease", LEASE_MS.to_string()),
            ("transport/link/tx/keep_alive", "4".into()),
            ("transport/unicast/open_timeout", OPEN_TIMEOUT_MS.to_string()),
            ("transport/unicast/accept_timeout", OPEN_TIMEOUT_MS.to_string()),
        ];
        if let Some(id) = &self.id {
            keys.push(("id", format!("{id:?}")));
        }
        if let Some(tls) = self.tls {
            let path = |path: &PathBuf| serde_json::json!(path).to_string();
            let [certificate, key] = [path(&tls.certificate), path(&tls.key)];
            keys.extend([
                ("transport/link/tls/root_ca_certificate", path(&tls.authority)),
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
        let mut config = Config::default();
        for (key, value) in self.keys() {
            config.insert_json5(key, &value).map_err(|e| format!("{key} = {value}: {e}"))?;
        }
        zenoh::open(config).wait().map_err(|e| e.to_string())
    }
}

/// A wire over one or two Zenoh sessions.
pub struct ZenohWire {
    me: Peer,
    arrived: Receiver<Vec<u8>>,
    arrives: Sender<Vec<u8>>,
    /// The session with the server, or the server's own.
    hub: ZenohLink,
    /// The session with all other nodes, in a mesh.
    mesh: Option<ZenohLink>,
    /// The endpoints at which they reach this one, none in a star.
    listens: Vec<String>,
    /// The ports of those, until it listens.
    ports: Vec<PortReservation>,
    tls: Option<Tls>,
    /// All other nodes, rising.
    others: Vec<Peer>,
    /// The endpoints to which this one opens links.
    connect: Vec<String>,
    /// The name by which they know this one.
    me_there: u128,
    /// Number of times that it has opened them.
    opened: u32,
    /// Questions to the other ends of the mesh.
    echoes: EchoProbes,
}

/// A session, and the receivers reached over it.
struct ZenohLink {
    keys: BTreeMap<Peer, KeyExpr<'static>>,
    _heard: Vec<Subscriber<()>>,
    session: Session,
}

/// The bits of a session's name that identify its node: the other bits count the times that that node has opened it.
const ZENOH_ID_MASK: u128 = u128::MAX >> 32;

/// Returns the name of a node in its present life.
fn zenoh_id(member: &Member) -> u128 {
    u128::from(member.agent) << 64 | u128::from(member.life.0)
}

/// The key under which frames for most nodes are published. No party has that name.
const BROADCAST_KEY: &str = "sidestep/all";

impl fmt::Debug for ZenohWire {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ZenohWire").field("me", &self.me).finish_non_exhaustive()
    }
}

/// The key under which frames for a party are published.
fn peer_key(to: Peer) -> String {
    format!("sidestep/{to}")
}

impl ZenohLink {
    fn new(
        session: Session,
        me: Peer,
        arrives: &Sender<Vec<u8>>,
        echoes: &EchoProbes,
    ) -> Result<Self, String> {
        let hear = |key: &str| {
            let arrives = arrives.clone();
            let is_echo = match me {
                Peer::Node(agent) => Some(echoes.handler(agent, session.clone())),
                Peer::Server => None,
            };
            let took = move |sample: Sample| {
                if is_echo.as_ref().is_none_or(|is_echo| !is_echo(&sample)) {
                    // The receiver is gone when the wire is.
                    let _ = arrives.send(sample.payload().to_bytes().into_owned());
                }
            };
            session.declare_subscriber(key).callback(took).wait().map_err(|e| e.to_string())
        };
        // Others see them in this order: a party that can reach this one reaches it with frames for most, too. No
        // frame for most nodes is for the server.
        let for_most = (me != Peer::Server).then(|| BROADCAST_KEY.to_string());
        let heard = for_most
            .into_iter()
            .chain([peer_key(me)])
            .map(|key| hear(&key))
            .collect::<Result<_, _>>()?;
        Ok(Self { keys: BTreeMap::new(), _heard: heard, session })
    }

    fn send(&mut self, to: Peer, frame: &[u8]) {
        let key = self.keys.entry(to).or_insert_with(|| {
            KeyExpr::try_from(peer_key(to)).expect("a path of letters and digits is a key")
        });
        put(&self.session, key, frame, None);
    }

    /// Returns whether there is a link to another node that shows signs of life, even if nothing else comes through.
    fn is_open_to(&self, member: &Member) -> bool {
        let is_it = |id: zenoh::session::ZenohId| {
            u128::from_le_bytes(id.to_le_bytes()) & ZENOH_ID_MASK == zenoh_id(member)
        };
        self.session.info().peers_zid().wait().any(is_it)
    }

    /// Sends a frame to all that hear this session except itself.
    fn send_to_all(&self, frame: &[u8]) {
        let key = KeyExpr::try_from(BROADCAST_KEY).expect("a path of letters is a key");
        put(&self.session, &key, frame, None);
    }
}

/// Sends a frame; one that is no mail has a mark.
fn put(session: &Session, key: &KeyExpr<'_>, frame: &[u8], mark: Option<&'static [u8]>) {
    // Not by a publisher: the first thing that one does in a client is to wait for the other end.
    let put = session.put(key, frame).attachment(mark).allowed_destination(Locality::Remote);
    // Lost where it cannot be sent, as on the way.
    let _ = put.congestion_control(CongestionControl::Drop).wait();
}

impl ZenohWire {
    /// Returns the server's wire, which listens at endpoints.
    ///
    /// # Errors
    /// When one of them cannot be taken.
    pub fn server(listen: &[String], tls: Option<&Tls>) -> Result<Self, WireError> {
        listen.iter().try_for_each(|endpoint| check_vacant(endpoint))?;
        let settings = ZenohConfig { mode: "router", listen, tls, ..ZenohConfig::default() };
        Self::with_one_session(Peer::Server, &settings)
            .map_err(|reason| endpoint_in_use(listen, reason))
    }

    /// Returns the wire of a node to its server, at one of some endpoints.
    ///
    /// # Errors
    /// When none of them answers within some time, or a certificate is not taken.
    pub fn node(
        me: Peer,
        connect: &[String],
        tls: Option<&Tls>,
        within: Duration,
    ) -> Result<Self, WireError> {
        check_trust(connect, tls)?;
        let connected_within = Some(within);
        let settings = ZenohConfig {
            mode: "client",
            connect,
            tls,
            connected_within,
            ..ZenohConfig::default()
        };
        Self::with_one_session(me, &settings).map_err(|reason| {
            // The other end may have begun to listen meanwhile.
            let endpoint = connect.join(", ");
            check_trust(connect, tls).err().unwrap_or(WireError::NoAnswer { endpoint, reason })
        })
    }

    fn with_one_session(me: Peer, settings: &ZenohConfig<'_>) -> Result<Self, String> {
        let ((arrives, arrived), echoes) = (channel(), EchoProbes::default());
        let hub = ZenohLink::new(settings.open()?, me, &arrives, &echoes)?;
        Ok(Self {
            me,
            arrived,
            arrives,
            hub,
            mesh: None,
            listens: Vec::new(),
            ports: Vec::new(),
            tls: settings.tls.cloned(),
            others: Vec::new(),
            connect: Vec::new(),
            me_there: 0,
            opened: 0,
            echoes,
        })
    }

    /// Lets this node be reached by others at endpoints of its own, once it joins them.
    pub fn with_listeners(self, ports: Vec<PortReservation>) -> Self {
        let listens = ports.iter().map(|held| held.endpoint.clone()).collect();
        Self { listens, ports, ..self }
    }

    fn open_mesh(&mut self) -> Result<(), WireError> {
        // Held until now, so that no other program takes them.
        self.ports.clear();
        // A name of its own each time: others may not have noticed yet that the session before is gone.
        self.opened += 1;
        let id = Some(format!("{:x}", u128::from(self.opened) << 96 | self.me_there));
        let (listen, connect, tls) = (&self.listens, &self.connect, self.tls.as_ref());
        let settings =
            ZenohConfig { id, mode: "peer", listen, connect, tls, connected_within: None };
        let line = |session| ZenohLink::new(session, self.me, &self.arrives, &self.echoes);
        let open = settings.open().and_then(line);
        self.mesh = Some(open.map_err(|reason| endpoint_in_use(listen, reason))?);
        Ok(())
    }
}

impl ZenohWire {
    /// Returns the server's session, for questions of others than nodes.
    pub(super) fn session(&self) -> &Session {
        &self.hub.session
    }
}

/// Returns a session with a fleet's server for a watcher, which is no node and only asks.
///
/// # Errors
/// When none of some endpoints answers within some time.
pub(super) fn open_query_session(
    connect: &[String],
    tls: Option<&Tls>,
    within: Duration,
) -> Result<Session, WireError> {
    for endpoint in connect {
        host_and_port(endpoint)?;
    }
    let connected_within = Some(within);
    let settings =
        ZenohConfig { mode: "client", connect, tls, connected_within, ..ZenohConfig::default() };
    let no_answer = |reason| WireError::NoAnswer { endpoint: connect.join(", "), reason };
    settings.open().map_err(no_answer)
}

impl Wire for ZenohWire {
    fn send(&mut self, to: &[Peer], frame: &[u8]) {
        let line = match &mut self.mesh {
            Some(mesh) if !to.contains(&Peer::Server) => mesh,
            _ => &mut self.hub,
        };
        // One frame for all is worth it although some of them have no use for it.
        let are_most = to.len() > 1 && 2 * to.len() > self.others.len();
        if are_most && to.iter().all(|party| self.others.binary_search(party).is_ok()) {
            line.send_to_all(frame);
        } else {
            to.iter().for_each(|&party| line.send(party, frame));
        }
    }

    fn receive(&mut self, within: Duration) -> Option<Vec<u8>> {
        self.arrived.recv_timeout(within).ok()
    }

    fn connect_mesh(&mut self, me: EntityId, members: &[Member]) -> Result<(), WireError> {
        let others = members.iter().map(|member| Peer::Node(member.agent));
        self.others = others.filter(|&party| party != self.me).collect();
        self.others.sort_unstable();
        // The session reconnects to returning nodes by itself.
        if self.listens.is_empty() || self.mesh.is_some() {
            return Ok(());
        }
        // One connection for each pair: opened by the node with the higher id.
        let before = members.iter().filter(|member| member.agent < me);
        self.connect = before.flat_map(|member| member.listens.clone()).collect();
        self.me_there = members.iter().find(|member| member.agent == me).map_or(0, zenoh_id);
        self.open_mesh()
    }

    fn is_half_open(&mut self, member: &Member, within: Duration) -> bool {
        let (Some(mesh), Peer::Node(me)) = (&self.mesh, self.me) else { return false };
        mesh.is_open_to(member) && self.echoes.probe(&mesh.session, me, member.agent, within)
    }

    fn reopen_links(&mut self) -> Result<(), WireError> {
        if let Some(mesh) = self.mesh.take() {
            // Unsent frames are lost, like frames in transit.
            let _ = mesh.session.close().wait();
        }
        self.echoes.clear();
        if self.listens.is_empty() {
            return Ok(());
        }
        let until = Instant::now() + RELEASE_TIMEOUT;
        loop {
            match self.open_mesh() {
                Err(_) if Instant::now() < until => std::thread::sleep(RELEASE_TIMEOUT / 100),
                opened => return opened,
            }
        }
    }
}

/// Finds out whether certificates are the reason why no endpoint can be reached: Zenoh gives none.
fn check_trust(connect: &[String], tls: Option<&Tls>) -> Result<(), WireError> {
    let Some(tls) = tls else { return Ok(()) };
    let mut first = Ok(());
    for endpoint in connect {
        match handshake::certificate_problem(endpoint, tls) {
            // One that can be reached is enough.
            None => return Ok(()),
            Some(reason) if first.is_ok() => {
                first = Err(WireError::Distrust { endpoint: endpoint.clone(), reason });
            }
            Some(_) => {}
        }
    }
    first
}

#[cfg(test)]
mod tests;
