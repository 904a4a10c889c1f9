//! Encrypted links, at which both ends prove their identity.

use crate::attack::session;
use crate::processes::{LinkProcess, folder, job};
use crate::support::{run_in_one_process, superconflict, wide};
use sidestep_link::wire::access::Credentials;
use sidestep_link::wire::endpoint::reserve_port;
use sidestep_link::wire::zenoh::{ONE_THREAD, ZenohWire};
use sidestep_link::wire::{PeerId, WireSetupError};
use sidestep_session::fleet::{
    AgentName, ClockMode, FleetJob, Job, LinkMessage, NodeJob, Tls, Topology,
};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

fn openssl(folder: &Path, words: &str) -> bool {
    let made = Command::new("openssl").args(words.split_whitespace()).current_dir(folder).output();
    made.is_ok_and(|made| made.status.success())
}

/// Makes an authority, and a certificate of it that is valid for a number of days on this machine.
pub(crate) fn authority(folder: &Path, name: &str, days: i32) -> Option<Tls> {
    let ca = format!(
        "req -x509 {KEY} -keyout {name}-ca.key -out {name}-ca.pem -subj /CN={name}-ca -days 2"
    );
    if !openssl(folder, &ca) {
        sidestep_testing::skip(format!("openssl does not make the authority `{name}` here"));
        return None;
    }
    certificate(folder, name, "server", days)
}

/// Words for a new key.
const KEY: &str = "-newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes";

/// Makes a certificate of an authority for a party.
pub(crate) fn certificate(folder: &Path, authority: &str, party: &str, days: i32) -> Option<Tls> {
    let file = |name: &str, end: &str| folder.join(format!("{name}{end}"));
    let name = &format!("{authority}-{party}{days}");
    std::fs::write(file(name, ".ext"), "subjectAltName=IP:127.0.0.1\n").expect("written");
    let request = format!("req {KEY} -keyout {name}.key -out {name}.csr -subj /CN={party}");
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

/// Starts the node of airplane 1 by hand, as on another machine.
fn start_node(folder: &Path, tls: Option<Tls>, connect: &[String]) -> LinkProcess {
    let common = fleet(folder, tls).common;
    let agent = AgentName::new("airplane", 1, None);
    let (connect, listen) = (connect.to_vec(), vec!["tls/127.0.0.1:0".into()]);
    LinkProcess::start(&Job::Node(NodeJob { common, agent, connect, listen, patience_s: 30.0 }))
}

/// Returns where a server listens.
pub(crate) fn endpoints(server: &LinkProcess) -> Vec<String> {
    server.until("its endpoints", |message| match message {
        LinkMessage::Listens(endpoints) => Some(endpoints),
        LinkMessage::Failed(failed) => panic!("{failed:?}"),
        _ => None,
    })
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
    let connect = endpoints(&server);
    server.fleet("the first node", |now| now.nodes[0].state == "joined");
    let node = |tls: Option<Tls>| start_node(folder.path(), tls, &connect);
    let theirs = Tls { authority: ours.authority.clone(), ..others.clone() };
    for (tls, place, cause) in [
        (None, &*connect[0], "there is no certificate to show"),
        (Some(theirs), "--tls-cert", "it was not signed by the authority"),
        (Some(others), &*connect[0], "its certificate does not hold by"),
    ] {
        let (code, failed) = node(tls).end();
        let failed = failed.expect("it says why");
        assert_eq!(code, Some(2), "{failed:?}");
        assert!(failed.cause.contains(cause) && !failed.remedy.is_empty(), "{failed:?}");
        assert!(failed.place.starts_with(place), "{failed:?}");
    }
    // With Zenoh's words, because it alone sees the certificate.
    let says = |line: &String| {
        line.contains("UnknownCA")
            && line.contains("give the other end the authority of this party")
    };
    let until = Instant::now() + Duration::from_secs(60);
    while !server.logged().iter().any(says) {
        assert!(Instant::now() < until, "{:?}", server.logged());
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(!server.logged().join(" ").contains("open file limit"), "{:?}", server.logged());
    let Some(own) = certificate(folder.path(), "ours", "airplane-1", 2) else { return };
    let last = node(Some(own));
    let (summary, _) = server.complete();
    assert_eq!(summary["digest"], run_in_one_process(&text).digest);
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
    let Some(old) = certificate(folder.path(), "ours", "server", -1) else { return };
    refused(old, "it is valid from");
    let Some(node) = certificate(folder.path(), "ours", "airplane-1", 2) else { return };
    refused(node.clone(), "it is for `airplane-1` (its common name), and this party is `server`");
    refused(Tls { key: node.key.clone(), ..ours.clone() }, "it is not the key of the certificate");
    let damaged = folder.path().join("damaged.key");
    let text = "-----BEGIN PRIVATE KEY-----\nabcd\n-----END PRIVATE KEY-----\n";
    std::fs::write(&damaged, text).expect("written");
    refused(Tls { key: damaged, ..ours.clone() }, "its private key is damaged");
    let Some(others) = authority(folder.path(), "others", 2) else { return };
    let theirs = Tls { authority: ours.authority.clone(), ..others };
    refused(theirs, "it was not signed by the authority");
    let mut open = fleet(folder.path(), Some(ours));
    open.listen = vec!["tcp/127.0.0.1:0".into()];
    let (code, failed) = LinkProcess::start(&Job::Fleet(open)).end();
    let failed = failed.expect("it says why");
    assert_eq!(code, Some(2), "{failed:?}");
    assert!(failed.remedy.contains("tls/HOST:PORT"), "{failed:?}");
}

/// Returns the kinds of threads that the network has in a process, by the names that Zenoh gives them.
fn network_threads(process: u32) -> BTreeSet<String> {
    let tasks = std::fs::read_dir(format!("/proc/{process}/task")).expect("a process");
    let comm = |task: std::io::Result<std::fs::DirEntry>| {
        std::fs::read_to_string(task.ok()?.path().join("comm")).ok()
    };
    let kind = |name: String| Some(name.trim_end().rsplit_once('-')?.0.to_string());
    let kinds: BTreeSet<String> = tasks.filter_map(comm).filter_map(kind).collect();
    let zenoh = ["acc", "app", "net", "rx", "tx"].map(String::from);
    kinds.intersection(&BTreeSet::from(zenoh)).cloned().collect()
}

/// With a second one Zenoh reads and writes a link at the same time, which crashes processes now and then.
#[test]
fn a_process_with_certificates_has_one_thread_of_the_network_whoever_has_started_it() {
    if !cfg!(target_os = "linux") {
        sidestep_testing::skip("threads have names that can be seen on Linux");
        return;
    }
    let folder = folder(&wide(&superconflict(2, "compact-team", 1_000_000, ""), 1_000_000));
    let Some(ours) = authority(folder.path(), "ours", 2) else { return };
    let job = FleetJob { nodes: Some(1), ..fleet(folder.path(), Some(ours.clone())) };
    let server = LinkProcess::start(&Job::Fleet(job));
    let node = start_node(folder.path(), Some(ours), &endpoints(&server));
    let now = server.fleet("some cycles", |now| now.cycle > 3);
    assert_eq!(now.nodes[1].process, Some(node.child.id()), "it keeps its process id");
    let nodes = now.nodes.iter().map(|node| node.process.expect("a process"));
    for process in nodes.chain([server.child.id()]) {
        assert_eq!(network_threads(process), BTreeSet::from(["rx".to_string()]), "{process}");
    }
}

/// Does a test of this program in a process with one thread of the network; in that process it returns true.
pub(crate) fn is_process_with_one_thread(test: &str) -> bool {
    let (variable, one_thread) = ONE_THREAD;
    if std::env::var_os(variable).is_some_and(|own| own == one_thread) {
        return true;
    }
    let mut command = Command::new(std::env::current_exe().expect("a program"));
    let command = command.args(["--exact", test, "--nocapture"]).env(variable, one_thread);
    let output = command.output().expect("it starts");
    let said = format!("{output:?}");
    assert!(output.status.success() && said.contains("1 passed"), "{said}");
    false
}

/// A node checks its own certificate first; here is one that does not.
#[test]
fn a_certificate_that_is_out_of_date_is_refused_by_the_server_which_says_so() {
    let test = "tls::a_certificate_that_is_out_of_date_is_refused_by_the_server_which_says_so";
    if !is_process_with_one_thread(test) {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let Some(ours) = authority(folder.path(), "ours", 2) else { return };
    let Some(old) = certificate(folder.path(), "ours", "airplane-0", -1) else { return };
    let at = [reserve_port("tls/127.0.0.1:0").expect("a free port").endpoint];
    let credentials =
        |tls: &Tls| Credentials { tls: tls.clone(), agents: vec!["airplane-0".into()] };
    let _server = ZenohWire::server_wire(&at, Some(&credentials(&ours))).expect("a server");
    let node = |tls: &Tls| {
        let own = credentials(tls);
        ZenohWire::node_wire(PeerId::Node(0), &at, Some(&own), Duration::from_secs(30))
    };
    match node(&old).map(drop) {
        Err(WireSetupError::Distrust { endpoint, reason }) => {
            assert_eq!(endpoint, at[0]);
            assert!(reason.contains("airplane-0-1.pem") && reason.contains("Expired"), "{reason}");
        }
        other => panic!("{other:?}"),
    }
    node(&ours).expect("with one that holds it gets in");
}

/// Whose certificate is for nobody is let in by Zenoh, and denied everything; whose is out of date is not let in.
#[test]
fn the_server_says_whom_it_denies_everything_and_why_links_are_not_opened_and_what_would_be_right()
{
    let test = "tls::the_server_says_whom_it_denies_everything_and_why_links_are_not_opened_and_what_would_be_right";
    if !is_process_with_one_thread(test) {
        return;
    }
    let folder = folder(&superconflict(2, "compact-team", 10, ""));
    let Some(ours) = authority(folder.path(), "ours", 2) else { return };
    let Some(stranger) = certificate(folder.path(), "ours", "airplane-7", 2) else { return };
    let Some(old) = certificate(folder.path(), "ours", "airplane-1", -1) else { return };
    let mut job = FleetJob { nodes: Some(1), ..fleet(folder.path(), Some(ours)) };
    job.common.log = "warn".into();
    let server = LinkProcess::start(&Job::Fleet(job));
    let connect = endpoints(&server);
    server.fleet("the first node", |now| now.nodes[0].state == "joined");
    let told = |words: &[&str]| {
        let until = Instant::now() + Duration::from_secs(60);
        let is_told = |line: &String| words.iter().all(|word| line.contains(word));
        while !server.logged().iter().any(is_told) {
            assert!(Instant::now() < until, "{words:?} in {:?}", server.logged());
            server.fleet("a report", |_| true);
        }
    };
    let guest = session("client", &connect, &stranger);
    told(&["denied everything", "`airplane-7`", "`airplane-0` to `airplane-1`", "count=1"]);
    for count in [1, 2] {
        let own = Credentials { tls: old.clone(), agents: vec!["airplane-1".into()] };
        let refused =
            ZenohWire::node_wire(PeerId::Node(1), &connect, Some(&own), Duration::from_secs(30));
        assert!(matches!(refused, Err(WireSetupError::Distrust { .. })));
        told(&["links are not opened", "xpired", "renew it", &format!("count={count}")]);
    }
    drop(guest);
    let names = server.logged().iter().filter(|line| line.contains("`airplane-7`")).count();
    assert_eq!(names, 1, "{:?}", server.logged());
}
