//! Handshakes that only find out whether two parties take each other's certificates: Zenoh goes on trying, and gives
//! no reason.

use super::endpoint::host_and_port;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use rustls::{ClientConfig, ClientConnection, Error, RootCertStore, Stream};
use sidestep_session::fleet::Tls;
use std::io::{self, Read};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::time::Duration;

/// Time that each step may take.
const STEP_TIMEOUT: Duration = Duration::from_secs(1);

/// Returns why one of the two ends does not take the other's certificate; none if both do, or no one is there.
pub(super) fn certificate_problem(endpoint: &str, tls: &Tls) -> Option<String> {
    let (host, port) = host_and_port(endpoint).ok()?;
    let bare = host.trim_start_matches('[').trim_end_matches(']');
    let address = (bare, port).to_socket_addrs().ok()?.next()?;
    let mut stream = TcpStream::connect_timeout(&address, STEP_TIMEOUT).ok()?;
    stream.set_read_timeout(Some(STEP_TIMEOUT)).ok()?;
    stream.set_write_timeout(Some(STEP_TIMEOUT)).ok()?;
    let name = ServerName::try_from(bare.to_string()).ok()?;
    let mut connection = match config(tls) {
        Ok(config) => ClientConnection::new(Arc::new(config), name).ok()?,
        Err(error) => return Some(format!("{}: {error}", tls.certificate.display())),
    };
    // The other end checks this one's certificate last: its verdict is the first thing that comes.
    let heard = Stream::new(&mut connection, &mut stream).read(&mut [0]);
    describe_error(heard.err()?, tls)
}

fn config(tls: &Tls) -> Result<ClientConfig, Error> {
    let unreadable = |e: rustls::pki_types::pem::Error| Error::General(e.to_string());
    let read = |file| -> Result<Vec<CertificateDer<'static>>, Error> {
        let all = CertificateDer::pem_file_iter(file).map_err(unreadable)?;
        all.collect::<Result<_, _>>().map_err(unreadable)
    };
    let mut roots = RootCertStore::empty();
    for certificate in read(&tls.authority)? {
        roots.add(certificate)?;
    }
    let key = PrivateKeyDer::from_pem_file(&tls.key).map_err(unreadable)?;
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()?
        .with_root_certificates(roots)
        .with_client_auth_cert(read(&tls.certificate)?, key)
}

/// Returns words for an end of a handshake, if certificates are the reason.
fn describe_error(error: io::Error, tls: &Tls) -> Option<String> {
    match error.get_ref()?.downcast_ref::<Error>()? {
        Error::AlertReceived(alert) => {
            let own = tls.certificate.display();
            Some(format!("it does not take the certificate {own} ({alert:?})"))
        }
        Error::InvalidCertificate(reason) => {
            let authority = tls.authority.display();
            Some(format!("its certificate does not hold by {authority} ({reason})"))
        }
        _ => None,
    }
}
