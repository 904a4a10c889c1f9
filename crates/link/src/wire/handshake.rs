//! Handshakes that only find out whether two peers accept each other's certificates: Zenoh keeps trying to connect, and
//! reports no reason.

use super::endpoint::{bare_host, host_and_port};
use rustls::pki_types::pem::{self, PemObject};
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use rustls::{ClientConfig, ClientConnection, Error, RootCertStore, Stream};
use sidestep_session::fleet::Tls;
use std::io::{self, Read};
use std::net::{TcpStream, ToSocketAddrs};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// Time that each step may take: connecting, and each reading and writing.
const STEP_TIMEOUT: Duration = Duration::from_secs(1);

/// Returns why one of the two ends rejects the other's certificate; none if neither does, or there is no answer.
pub(super) fn certificate_problem(endpoint: &str, tls: &Tls) -> Option<String> {
    let (host, port) = host_and_port(endpoint).ok()?;
    let bare = bare_host(host);
    let address = (bare, port).to_socket_addrs().ok()?.next()?;
    let mut stream = TcpStream::connect_timeout(&address, STEP_TIMEOUT).ok()?;
    stream.set_read_timeout(Some(STEP_TIMEOUT)).ok()?;
    stream.set_write_timeout(Some(STEP_TIMEOUT)).ok()?;
    let name = ServerName::try_from(bare.to_string()).ok()?;
    let mut connection = match tls_client_config(tls) {
        Ok(config) => ClientConnection::new(Arc::new(config), name).ok()?,
        Err(error) => return Some(format!("{}: {error}", tls.certificate.display())),
    };
    // The other end checks this one's certificate last, after this one's handshake is complete: an alert with its verdict
    // arrives only as the first thing that is read. A timeout means that it has accepted.
    let read = Stream::new(&mut connection, &mut stream).read(&mut [0]);
    describe_certificate_error(read.err()?, tls)
}

fn tls_client_config(tls: &Tls) -> Result<ClientConfig, Error> {
    let mut roots = RootCertStore::empty();
    for certificate in read_certificates(&tls.authority)? {
        roots.add(certificate)?;
    }
    let key = PrivateKeyDer::from_pem_file(&tls.key).map_err(pem_error)?;
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()?
        .with_root_certificates(roots)
        .with_client_auth_cert(read_certificates(&tls.certificate)?, key)
}

fn read_certificates(file: &Path) -> Result<Vec<CertificateDer<'static>>, Error> {
    let certificates = CertificateDer::pem_file_iter(file).map_err(pem_error)?;
    certificates.collect::<Result<_, _>>().map_err(pem_error)
}

fn pem_error(error: pem::Error) -> Error {
    Error::General(error.to_string())
}

/// Describes the failure of a handshake, if certificates are the reason.
fn describe_certificate_error(error: io::Error, tls: &Tls) -> Option<String> {
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
