//! An attacker who holds the certificate of a node, and speaks Zenoh: it reads nothing of others and forges nothing.

use crate::processes::{LinkProcess, folder, job};
use crate::support::{superconflict, wide};
use crate::tls::{authority, certificate, endpoints, is_process_with_one_thread};
use sidestep_link::peer::PeerId;
use sidestep_link::protocol::{Incarnation, JoinError, Message, RecipientHeader, TransportFrame};
use sidestep_session::fleet::{ClockMode, FleetJob, Job, Tls, Topology};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use zenoh::sample::Locality;
use zenoh::{Config, Session, Wait};

/// Opens a session of a client that minds no rules.
fn session(connect: &[String], tls: &Tls) -> Session {
    let text = |path: &std::path::Path| serde_json::json!(path).to_string();
    let mut config = Config::default();
    for (key, value) in [
        ("mode", "\"client\"".to_string()),
        ("scouting/multicast/enabled", "false".into()),
        ("connect/endpoints", serde_json::json!(connect).to_string()),
        ("transport/link/tls/root_ca_certificate", text(&tls.authority)),
        ("transport/link/tls/connect_certificate", text(&tls.certificate)),
        ("transport/link/tls/connect_private_key", text(&tls.key)),
        ("transport/link/tls/enable_mtls", "true".into()),
    ] {
        config.insert_json5(key, &value).expect("a key of Zenoh");
    }
    zenoh::open(config).wait().expect("the server takes the certificate")
}

/// A frame of the server to airplane 0 that ends its node, if it is believed.
pub(crate) fn dismissal() -> Vec<u8> {
    let header =
        RecipientHeader { peer: PeerId::Node(0), incarnation: None, ack: 0, sequence: None };
    let error = JoinError { cause: "forged".into(), remedy: "none".into() };
    let message = Some(Message::Refused(error));
    let from = PeerId::Server;
    TransportFrame { from, incarnation: Incarnation(1), number: 0, to: vec![header], message }
        .encode()
}

#[test]
fn a_valid_certificate_of_a_node_reads_nothing_of_others_and_forges_nothing() {
    let test = "attack::a_valid_certificate_of_a_node_reads_nothing_of_others_and_forges_nothing";
    if !is_process_with_one_thread(test) {
        return;
    }
    let folder = folder(&wide(&superconflict(3, "compact-team", 1_000_000, ""), 1_000_000));
    let Some(ours) = authority(folder.path(), "ours", 2) else { return };
    let Some(own) = certificate(folder.path(), "ours", "airplane-1", 2) else { return };
    let mut fleet = FleetJob {
        listen: vec!["tls/127.0.0.1:0".into()],
        ..job(folder.path(), Topology::Star, ClockMode::Lockstep)
    };
    fleet.common.tls = Some(ours);
    fleet.common.log = "warn".into();
    let server = LinkProcess::start(&Job::Fleet(fleet));
    let connect = endpoints(&server);
    let before = server.fleet("some cycles", |now| now.cycle > 3);
    assert!(!server.logged().join("\n").contains("denied"), "{:?}", server.logged());

    let attacker = session(&connect, &own);
    let heard = Arc::new(Mutex::new(Vec::new()));
    let mut subscribers = Vec::new();
    for key in ["sidestep/**", "sidestep/*/0", "sidestep/server/*", "sidestep/*/server", "**"] {
        let heard = heard.clone();
        let subscriber = attacker.declare_subscriber(key).callback(move |sample| {
            heard.lock().expect("no panic").push(sample.key_expr().to_string());
        });
        subscribers.push(subscriber.wait().expect("declared"));
    }
    for _ in 0..20 {
        // Under the server's name, and the server's word under the attacker's own.
        for key in ["sidestep/server/0", "sidestep/2/0", "sidestep/0/server", "sidestep/1/0"] {
            // Not to its own subscribers.
            let put = attacker.put(key, dismissal()).allowed_destination(Locality::Remote);
            put.wait().expect("put");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    for key in ["sidestep/view", "sidestep/scene"] {
        let replies = attacker.get(key).timeout(Duration::from_secs(1)).wait().expect("asked");
        assert!(replies.iter().all(|reply| reply.result().is_err()), "{key}");
    }
    let after = server.fleet("more cycles", |now| now.cycle > before.cycle + 20);
    assert!(after.nodes.iter().all(|node| node.lives == 1 && node.late == 0), "{after:?}");
    assert_eq!(*heard.lock().expect("no panic"), [""; 0]);
    drop(subscribers);
    let until = std::time::Instant::now() + Duration::from_secs(60);
    let told = |word: &str| server.logged().iter().any(|line| line.contains(word));
    while !(told("denied") && told("reason=\"forged\"")) {
        assert!(std::time::Instant::now() < until, "{:?}", server.logged());
        std::thread::sleep(Duration::from_millis(50));
    }
}
