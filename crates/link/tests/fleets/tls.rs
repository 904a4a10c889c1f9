//! Encrypted links, whose both ends prove who they are.

use crate::processes::{Program, folder, job};
use crate::support::{alone, superconflict};
use sidestep_session::fleet::{Clock, FleetJob, Job, NodeJob, Tls, Told, Topology};
use std::path::{Path, PathBuf};
use std::process::Command;

fn openssl(folder: &Path, words: &str) -> bool {
    let made = Command::new("openssl").args(words.split_whitespace()).current_dir(folder).output();
    made.is_ok_and(|made| made.status.success())
}

/// Makes an authority, and a certificate that holds so many days for this machine.
fn authority(folder: &Path, name: &str, days: i32) -> Option<Tls> {
    let file = |end: &str| folder.join(format!("{name}{end}"));
    std::fs::write(file(".ext"), "subjectAltName=IP:127.0.0.1\n").expect("written");
    let key = "-newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes";
    let made = openssl(
        folder,
        &format!(
            "req -x509 {key} -keyout {name}-ca.key -out {name}-ca.pem -subj /CN={name}-ca -days 2"
        ),
    ) && openssl(
        folder,
        &format!("req {key} -keyout {name}.key -out {name}.csr -subj /CN={name}"),
    ) && openssl(
        folder,
        &format!(
            "x509 -req -in {name}.csr -CA {name}-ca.pem -CAkey {name}-ca.key -CAcreateserial -extfile {name}.ext -out {name}.pem -days {days}"
        ),
    );
    if !made {
        sidestep_testing::skip(format!("openssl does not make the certificate `{name}` here"));
        return None;
    }
    let (authority, certificate, key) = (file("-ca.pem"), file(".pem"), file(".key"));
    Some(Tls { authority, certificate, key })
}

fn fleet(folder: &Path, tls: Option<Tls>) -> FleetJob {
    let mut fleet = job(folder, Topology::Mesh, Clock::Lockstep);
    fleet.common.tls = tls;
    fleet.listen = vec!["tls/127.0.0.1:0".into()];
    fleet
}

#[test]
fn with_certificates_a_fleet_flies_as_ever_and_whoever_has_none_of_its_authority_does_not_get_in() {
    let text = superconflict(2, "compact-team", 10, "");
    let folder = folder(&text);
    let Some(ours) = authority(folder.path(), "ours", 2) else { return };
    let Some(others) = authority(folder.path(), "others", 2) else { return };
    let server = Program::start(&Job::Fleet(FleetJob {
        nodes: Some(1),
        ..fleet(folder.path(), Some(ours.clone()))
    }));
    let connect = server.until("its endpoints", |told| match told {
        Told::Listens(endpoints) => Some(endpoints),
        Told::Failed(failed) => panic!("{failed:?}"),
        _ => None,
    });
    server.fleet("the first node", |now| now.nodes[0].state == "joined");
    let node = |tls: Option<Tls>, patience_s| {
        let common = fleet(folder.path(), tls).common;
        let (connect, listen) = (connect.clone(), vec!["tls/127.0.0.1:0".into()]);
        Program::start(&Job::Node(NodeJob { common, airplane: 1, connect, listen, patience_s }))
    };
    for tls in [None, Some(others)] {
        let (code, failed) = node(tls, 2.0).end();
        let failed = failed.expect("it says why");
        assert_eq!(code, Some(1), "{failed:?}");
        assert!(
            failed.cause.contains("nobody answers") && failed.remedy.contains("--tls-ca"),
            "{failed:?}"
        );
    }
    let last = node(Some(ours), 30.0);
    let digest = server.until("the end", |told| match told {
        Told::Ended { summary, .. } => Some(summary["digest"].clone()),
        _ => None,
    });
    assert_eq!(digest, alone(&text).digest);
    assert_eq!((server.end(), last.end()), ((Some(0), None), (Some(0), None)));
}

#[test]
fn certificates_that_are_none_or_out_of_date_are_refused_before_anything_starts() {
    let folder = folder(&superconflict(2, "compact-team", 10, ""));
    let Some(ours) = authority(folder.path(), "ours", 2) else { return };
    let refused = |tls: Tls, cause: &str| {
        let (code, failed) = Program::start(&Job::Fleet(fleet(folder.path(), Some(tls)))).end();
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
    let Some(old) = authority(folder.path(), "old", -1) else { return };
    refused(Tls { authority: ours.authority.clone(), ..old }, "it holds from");
}
