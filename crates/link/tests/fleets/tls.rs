//! Encrypted links, at which both ends prove their identity.

use crate::processes::{LinkProcess, folder, job};
use crate::support::{run_in_one_process, superconflict};
use sidestep_link::wire::endpoint::reserve_port;
use sidestep_link::wire::zenoh::ZenohWire;
use sidestep_link::wire::{PeerId, WireSetupError};
use sidestep_session::fleet::{
    AgentName, ClockMode, FleetJob, Job, LinkMessage, NodeJob, Tls, Topology,
};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

fn openssl(folder: &Path, words: &str) -> bool {
    let made = Command::new("openssl").args(words.split_whitespace()).current_dir(folder).output();
    made.is_ok_and(|made| made.status.success())
}

/// Makes an authority, and a certificate of it that is valid for a number of days on this machine.
fn authority(folder: &Path, name: &str, days: i32) -> Option<Tls> {
    let ca = format!(
        "req -x509 {KEY} -keyout {name}-ca.key -out {name}-ca.pem -subj /CN={name}-ca -days 2"
    );
    if !openssl(folder, &ca) {
        sidestep_testing::skip(format!("openssl does not make the authority `{name}` here"));
        return None;
    }
    certificate(folder, name, name, days)
}

/// Words for a new key.
const KEY: &str = "-newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes";

/// Makes a certificate of an authority.
fn certificate(folder: &Path, authority: &str, name: &str, days: i32) -> Option<Tls> {
    let file = |name: &str, end: &str| folder.join(format!("{name}{end}"));
    std::fs::write(file(name, ".ext"), "subjectAltName=IP:127.0.0.1\n").expect("written");
    let request = format!("req {KEY} -keyout {name}.key -out {name}.csr -subj /CN={name}");
    let sign = format!(
        "x509 -req -in {name}.csr -CA {authority}-ca.pem -CAkey {authority}-ca.key -CAcreateserial \
         -extfile {name}.ext -out {name}.pem -days {days}"
    );
    if !(openssl(folder, &request) && openssl(folder, &sign)) {
        sidestep_testing::skip(format!("openssl does not make the certificate `{name}` here"));
        return None;
    }
    let (authority, key) = (file(authority, "-ca.pem"), file(name, ".key"));
    Some(Tls { authority, certificate: file(name, ".pem"), key })
}

fn fleet(folder: &Path, tls: Option<Tls>) -> FleetJob {
    let mut fleet = job(folder, Topology::Mesh, ClockMode::Lockstep);
    fleet.common.tls = tls;
    fleet.listen = vec!["tls/127.0.0.1:0".into()];
    fleet
}

#[test]
fn with_certificates_a_fleet_flies_as_ever_and_whoever_has_none_of_its_authority_is_refused_by_name()
 {
    let text = superconflict(2, "compact-team", 10, "");
    let folder = folder(&text);
    let Some(ours) = authority(folder.path(), "ours", 2) else { return };
    let Some(others) = authority(folder.path(), "others", 2) else { return };
    let mut job = FleetJob { nodes: Some(1), ..fleet(folder.path(), Some(ours.clone())) };
    job.common.log = "warn".into();
    let server = LinkProcess::start(&Job::Fleet(job));
    let connect = server.until("its endpoints", |message| match message {
        LinkMessage::Listens(endpoints) => Some(endpoints),
        LinkMessage::Failed(failed) => panic!("{failed:?}"),
        _ => None,
    });
    server.fleet("the first node", |now| now.nodes[0].state == "joined");
    let node = |tls: Option<Tls>, patience_s| {
        let common = fleet(folder.path(), tls).common;
        let (connect, listen) = (connect.clone(), vec!["tls/127.0.0.1:0".into()]);
        LinkProcess::start(&Job::Node(NodeJob {
            common,
            agent: AgentName::new("airplane", 1, None),
            connect,
            listen,
            patience_s,
        }))
    };
    let theirs = Tls { authority: ours.authority.clone(), ..others.clone() };
    for (tls, cause) in [
        (None, "there is no certificate to show"),
        (Some(theirs), "it does not take the certificate"),
        (Some(others), "its certificate does not hold by"),
    ] {
        let (code, failed) = node(tls, 30.0).end();
        let failed = failed.expect("it says why");
        assert_eq!(code, Some(2), "{failed:?}");
        assert!(failed.cause.contains(cause) && failed.remedy.contains("--tls-ca"), "{failed:?}");
        assert_eq!(failed.place, connect[0], "{failed:?}");
    }
    // Zenoh's words, because it alone sees the certificate.
    let says = |line: &String| line.contains("UnknownIssuer");
    assert!(server.logged().iter().any(says), "{:?}", server.logged());
    let last = node(Some(ours), 30.0);
    let digest = server.until("the end", |message| match message {
        LinkMessage::Ended { summary, .. } => Some(summary["digest"].clone()),
        _ => None,
    });
    assert_eq!(digest, run_in_one_process(&text).digest);
    assert_eq!((server.end(), last.end()), ((Some(0), None), (Some(0), None)));
}

#[test]
fn certificates_that_are_none_or_out_of_date_are_refused_before_anything_starts() {
    let folder = folder(&superconflict(2, "compact-team", 10, ""));
    let Some(ours) = authority(folder.path(), "ours", 2) else { return };
    let refused = |tls: Tls, cause: &str| {
        let (code, failed) = LinkProcess::start(&Job::Fleet(fleet(folder.path(), Some(tls)))).end();
        let failed = failed.expect("it says why");
        assert_eq!(code, Some(2), "{failed:?}");
        assert!(failed.is_input && format!("{failed:?}").contains(cause), "{cause} in {failed:?}");
    };
    refused(
        Tls { authority: PathBuf::from("nowhere.pem"), ..ours.clone() },
        "--tls-ca nowhere.pem",
    );
    refused(Tls { certificate: folder.path().join("s.toml"), ..ours.clone() }, "no certificate");
    refused(Tls { key: ours.certificate.clone(), ..ours.clone() }, "no private key");
    let Some(old) = certificate(folder.path(), "ours", "old", -1) else { return };
    refused(old, "it is valid from");
    let mut open = fleet(folder.path(), Some(ours));
    open.listen = vec!["tcp/127.0.0.1:0".into()];
    let (code, failed) = LinkProcess::start(&Job::Fleet(open)).end();
    let failed = failed.expect("it says why");
    assert_eq!(code, Some(2), "{failed:?}");
    assert!(failed.remedy.contains("tls/HOST:PORT"), "{failed:?}");
}

/// A node checks its own certificate first; here is one that does not.
#[test]
fn a_certificate_that_is_out_of_date_is_refused_by_the_server_which_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(ours) = authority(folder.path(), "ours", 2) else { return };
    let Some(old) = certificate(folder.path(), "ours", "old", -1) else { return };
    let at = [reserve_port("tls/127.0.0.1:0").expect("a free port").endpoint];
    let _server = ZenohWire::server_wire(&at, Some(&ours)).expect("a server");
    let node =
        |tls: &Tls| ZenohWire::node_wire(PeerId::Node(0), &at, Some(tls), Duration::from_secs(30));
    match node(&old).map(drop) {
        Err(WireSetupError::Distrust { endpoint, reason }) => {
            assert_eq!(endpoint, at[0]);
            assert!(reason.contains("old.pem") && reason.contains("Expired"), "{reason}");
        }
        other => panic!("{other:?}"),
    }
    node(&ours).expect("with one that holds it gets in");
}
