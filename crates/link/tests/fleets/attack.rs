//! An attacker who holds the certificate of a node, and speaks Zenoh: it reads nothing of others and forges nothing.

use crate::output::{ask, families, free_addresses};
use crate::processes::{LinkProcess, folder, job};
use crate::support::{superconflict, wide};
use crate::tls::{authority, certificate, endpoints, is_process_with_one_thread};
use sidestep_link::peer::PeerId;
use sidestep_link::protocol::{
    AgentPacket, Control, CycleStart, Incarnation, JoinError, Message, RecipientHeader,
    TransportFrame,
};
use sidestep_link::wire::endpoint::reserve_port;
use sidestep_session::fleet::{AgentName, ClockMode, FleetJob, Job, NodeJob, Tls, Topology};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use zenoh::pubsub::Subscriber;
use zenoh::sample::Locality;
use zenoh::{Config, Session, Wait};

/// Time longer than anything here takes, on a machine that has much else to do.
const TEST_TIMEOUT: Duration = Duration::from_secs(120);

/// The airplanes, of which the attacker has the key of number 1.
const AIRPLANES: u32 = 3;

/// A fleet in which each node has a certificate of its own.
struct OwnFleet {
    server: LinkProcess,
    nodes: Vec<LinkProcess>,
    /// Where the server listens.
    connect: Vec<String>,
    /// Where the nodes listen; nowhere in a star.
    listens: Vec<String>,
    metrics: String,
    /// The certificate and the key of airplane 1, which the attacker has as well.
    own: Tls,
}

impl OwnFleet {
    /// Starts it; none where no certificates can be made.
    fn start(folder: &Path, topology: Topology, clock: ClockMode) -> Option<Self> {
        let ours = authority(folder, "ours", 2)?;
        let [metrics] = free_addresses();
        let listen = vec!["tls/127.0.0.1:0".into()];
        let mut fleet = FleetJob { listen, nodes: Some(0), ..job(folder, topology, clock) };
        fleet.common.tls = Some(ours);
        fleet.common.log = "warn".into();
        let common = fleet.common.clone();
        fleet.common.metrics = Some(metrics.clone());
        let server = LinkProcess::start(&Job::Fleet(fleet));
        let connect = endpoints(&server);
        let mut keys = Vec::new();
        for airplane in 0..AIRPLANES {
            keys.push(certificate(folder, "ours", &format!("airplane-{airplane}"), 2)?);
        }
        let mut nodes = Vec::new();
        let mut listens = Vec::new();
        for airplane in 0..AIRPLANES {
            let mut common = common.clone();
            common.tls = Some(keys[airplane as usize].clone());
            let listen = match topology {
                Topology::Star | Topology::Multicast => Vec::new(),
                Topology::Mesh => {
                    vec![reserve_port("tls/127.0.0.1:0").expect("a free port").endpoint]
                }
            };
            listens.extend(listen.clone());
            let agent = AgentName::new("airplane", airplane, None);
            let connect = connect.clone();
            let node = NodeJob { common, agent, connect, listen, patience_s: 60.0 };
            nodes.push(join(&server, node));
        }
        let own = keys.swap_remove(1);
        Some(Self { server, nodes, connect, listens, metrics, own })
    }

    /// Returns the processes that the attacker connects with: the server, and in a mesh the other nodes.
    fn attacked(&self) -> impl Iterator<Item = &LinkProcess> {
        let nodes = [&self.nodes[0], &self.nodes[2]];
        let nodes = nodes.into_iter().filter(|_| !self.listens.is_empty());
        [&self.server].into_iter().chain(nodes)
    }

    /// Returns the number of forged frames that the server and airplane 0 have counted.
    fn forged(&self) -> [f64; 2] {
        let (_, text) = ask(&self.metrics, "GET");
        let told = families(&text);
        let count = |name: &str, labels: &[(&str, &str)]| {
            told.get(name).and_then(|family| family.value(labels)).unwrap_or(0.0)
        };
        [
            count("sidestep_frames_dropped_total", &[("reason", "forged")]),
            count("sidestep_dropped_total", &[("airplane", "0"), ("reason", "forged")]),
        ]
    }
}

/// Starts a node, and waits until it has joined.
fn join(server: &LinkProcess, job: NodeJob) -> LinkProcess {
    let airplane = job.agent.number as usize;
    let mut node = LinkProcess::start(&Job::Node(job));
    while server.fleet("a report", |_| true).nodes[airplane].lives == 0 {
        if node.child.try_wait().expect("a process").is_some() {
            panic!("airplane {airplane}: {:?}", node.end());
        }
    }
    node
}

fn says(process: &LinkProcess, word: &str) -> bool {
    process.logged().iter().any(|line| line.contains(word))
}

/// Opens a session that minds no rules, to the server or to nodes.
pub(crate) fn session(mode: &str, connect: &[String], tls: &Tls) -> Session {
    let text = |path: &Path| serde_json::json!(path).to_string();
    let mut config = Config::default();
    for (key, value) in [
        ("mode", format!("{mode:?}")),
        ("scouting/multicast/enabled", "false".into()),
        ("scouting/gossip/enabled", "false".into()),
        ("listen/endpoints", "[]".into()),
        ("connect/endpoints", serde_json::json!(connect).to_string()),
        ("connect/timeout_ms", TEST_TIMEOUT.as_millis().to_string()),
        ("connect/exit_on_failure", "true".into()),
        ("transport/link/tls/root_ca_certificate", text(&tls.authority)),
        ("transport/link/tls/connect_certificate", text(&tls.certificate)),
        ("transport/link/tls/connect_private_key", text(&tls.key)),
        ("transport/link/tls/enable_mtls", "true".into()),
    ] {
        config.insert_json5(key, &value).expect("a key of Zenoh");
    }
    zenoh::open(config).wait().expect("the certificate is taken")
}

/// A frame of the server to airplane 0 that ends its node, if it is believed.
pub(crate) fn dismissal() -> Vec<u8> {
    let error = JoinError { cause: "forged".into(), remedy: "none".into() };
    frame(PeerId::Server, PeerId::Node(0), Message::Refused(error))
}

/// A frame that would do harm if it were believed.
fn frame(from: PeerId, to: PeerId, message: Message) -> Vec<u8> {
    let header = RecipientHeader { peer: to, incarnation: None, ack: 0, sequence: None };
    let incarnation = Incarnation(1);
    let to = vec![header];
    TransportFrame { from, incarnation, number: 0, to, message: Some(message) }.encode()
}

/// What the attacker publishes: keys, and frames in the name of others.
fn forgeries() -> Vec<(&'static str, Vec<u8>)> {
    let [victim, other] = [0, 2].map(PeerId::Node);
    let dismissal = dismissal();
    let start = CycleStart { cycle: 1, percept: vec![0; 8], out_of_range: Vec::new() };
    let percept = frame(PeerId::Server, victim, Message::CycleStart(start));
    let control = Control { cycle: 1, control: vec![0; 8] };
    let control = frame(victim, PeerId::Server, Message::Control(control));
    let packet = AgentPacket { cycle: 1, departs: 0, sequence: 0, arrives: 0, payload: vec![0; 8] };
    let letter = frame(other, victim, Message::Packets(vec![packet]));
    vec![
        // Under the names of others.
        ("sidestep/server/0/*", dismissal.clone()),
        ("sidestep/server/0/*", percept.clone()),
        ("sidestep/server/all/*", dismissal.clone()),
        ("sidestep/*/0/*", dismissal.clone()),
        ("sidestep/**", dismissal.clone()),
        ("sidestep/0/server/*", control.clone()),
        ("sidestep/2/0/*", letter.clone()),
        // The words of others under its own.
        ("sidestep/1/0/*", dismissal.clone()),
        ("sidestep/1/0/*", percept),
        ("sidestep/1/all/*", dismissal),
        ("sidestep/1/0/*", letter),
        ("sidestep/1/server/*", control),
    ]
}

/// Subscribes to everything of others, and notes what is heard.
fn listen(attacker: &Session, heard: &Arc<Mutex<Vec<String>>>) -> Vec<Subscriber<()>> {
    let mut subscribers = Vec::new();
    for key in ["sidestep/**", "sidestep/*/0/*", "sidestep/server/**", "sidestep/*/server/*", "**"]
    {
        let heard = heard.clone();
        let subscriber = attacker.declare_subscriber(key).callback(move |sample| {
            heard.lock().expect("no panic").push(sample.key_expr().to_string());
        });
        subscribers.push(subscriber.wait().expect("declared"));
    }
    subscribers
}

/// Attacks a fleet, and checks that nobody minds and that it is told.
fn attack(topology: Topology, clock: ClockMode) {
    let folder = folder(&wide(&superconflict(3, "compact-team", 1_000_000, ""), 1_000_000));
    let Some(fleet) = OwnFleet::start(folder.path(), topology, clock) else { return };
    let own = &fleet.own;
    let before = fleet.server.fleet("some cycles", |now| now.cycle > 3);
    for process in fleet.attacked() {
        assert!(!says(process, "denied") && !says(process, "forged"), "{:?}", process.logged());
    }

    let mut attackers = vec![session("client", &fleet.connect, own)];
    if let [first, _, last] = &*fleet.listens {
        attackers.push(session("peer", &[first.clone(), last.clone()], own));
    }
    let heard = Arc::new(Mutex::new(Vec::new()));
    let subscribers: Vec<_> =
        attackers.iter().flat_map(|attacker| listen(attacker, &heard)).collect();
    let mut rounds = 0;
    let after = loop {
        for attacker in &attackers {
            for (key, bytes) in forgeries() {
                // Not to its own subscribers.
                let put = attacker.put(key, bytes).allowed_destination(Locality::Remote);
                put.wait().expect("put");
            }
        }
        rounds += 1;
        let now = fleet.server.fleet("a report", |_| true);
        if rounds >= 10 && now.cycle > before.cycle + 8 {
            break now;
        }
    };
    for key in ["sidestep/view", "sidestep/scene"] {
        let replies = attackers[0].get(key).timeout(Duration::from_secs(1)).wait().expect("asked");
        assert!(replies.iter().all(|reply| reply.result().is_err()), "{key}");
    }
    for (node, start) in after.nodes.iter().zip(&before.nodes) {
        assert_eq!((node.lives, node.late - start.late), (1, 0), "{after:?}");
        assert!(node.flown > start.flown, "{after:?}");
    }
    assert_eq!(*heard.lock().expect("no panic"), [""; 0]);
    drop(subscribers);
    let until = Instant::now() + TEST_TIMEOUT;
    let victims = [&fleet.server, &fleet.nodes[0]];
    let is_told = || {
        victims.iter().all(|victim| says(victim, "reason=\"forged\""))
            && fleet.attacked().all(|process| says(process, "denied"))
            && fleet.forged().iter().all(|&count| count >= 2.0)
    };
    while !is_told() {
        let logged: Vec<_> = fleet.attacked().map(LinkProcess::logged).collect();
        assert!(Instant::now() < until, "{:?}: {logged:?}", fleet.forged());
        fleet.server.fleet("a report", |_| true);
    }
}

#[test]
fn in_a_star_the_key_of_a_node_reads_nothing_of_others_and_forges_nothing() {
    let test = "attack::in_a_star_the_key_of_a_node_reads_nothing_of_others_and_forges_nothing";
    if is_process_with_one_thread(test) {
        attack(Topology::Star, ClockMode::Lockstep);
    }
}

#[test]
fn in_a_mesh_the_key_of_a_node_reads_nothing_of_others_and_forges_nothing() {
    let test = "attack::in_a_mesh_the_key_of_a_node_reads_nothing_of_others_and_forges_nothing";
    if is_process_with_one_thread(test) {
        attack(Topology::Mesh, ClockMode::Lockstep);
    }
}

/// Slow enough that no control is late on a busy machine by itself.
#[test]
fn in_real_time_the_key_of_a_node_makes_no_control_of_others_late() {
    let test = "attack::in_real_time_the_key_of_a_node_makes_no_control_of_others_late";
    if is_process_with_one_thread(test) {
        attack(Topology::Mesh, ClockMode::Realtime { speed: 8.0 });
    }
}
