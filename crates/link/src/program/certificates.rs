//! Checks of certificates before anything starts: on a network a wrong one shows only as silence.

use crate::distributed::DistributedWorld;
use crate::identity::{CertificateName, common_name};
use crate::messenger::Messenger;
use crate::wire::access::Credentials;
use crate::wire::endpoint::{bare_host, host_and_port};
use rustls::client::WebPkiServerVerifier;
use rustls::client::danger::ServerCertVerifier;
use rustls::crypto::CryptoProvider;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName, UnixTime};
use rustls::server::WebPkiClientVerifier;
use rustls::sign::CertifiedKey;
use rustls::{CertificateError, Error, InconsistentKeys, RootCertStore};
use sidestep::kernel::{EntityId, InputError};
use sidestep_session::fleet::{CommonSettings, Tls, WatchJob};
use std::net::IpAddr;
use std::path::Path;
use std::sync::Arc;
use x509_parser::pem::Pem;

/// Checks certificates, and that endpoints are encrypted if and only if there are certificates; without them they must be
/// of this machine alone, unless the user said that the network is trusted.
///
/// # Errors
/// With the first thing that is wrong.
pub(super) fn check_encryption<'a>(
    endpoints: impl IntoIterator<Item = &'a String>,
    common: &CommonSettings,
) -> Result<(), InputError> {
    let tls = common.tls.as_ref();
    check_links(endpoints, tls, common.is_insecure)?;
    if let Some(address) = &common.metrics
        && tls.is_none()
        && !common.is_insecure
    {
        check_metrics_address(address)?;
    }
    Ok(())
}

/// Checks the endpoints of a viewer by the same rule.
///
/// # Errors
/// With the first thing that is wrong.
pub(super) fn check_viewer_encryption(job: &WatchJob) -> Result<(), InputError> {
    check_links(&job.connect, job.tls.as_ref(), job.is_insecure)
}

/// Checks certificates, and endpoints by them.
///
/// # Errors
/// With the first thing that is wrong.
pub(super) fn check_links<'a>(
    endpoints: impl IntoIterator<Item = &'a String>,
    tls: Option<&Tls>,
    is_insecure: bool,
) -> Result<(), InputError> {
    tls.map_or(Ok(()), check_certificates)?;
    for endpoint in endpoints {
        check_endpoint_encryption(endpoint, tls)?;
        if tls.is_none() && !is_insecure {
            check_is_of_this_machine(endpoint)?;
        }
    }
    Ok(())
}

/// Checks that a party may be who it is to be by its certificate.
///
/// # Errors
/// When the certificate is for somebody else.
pub(super) fn check_identity(
    tls: Option<&Tls>,
    is_allowed: impl Fn(&CertificateName) -> bool,
    wanted: &str,
) -> Result<(), InputError> {
    let Some(tls) = tls else { return Ok(()) };
    let name = common_name(&tls.certificate).unwrap_or_default();
    if CertificateName::parse(&name).is_some_and(|name| is_allowed(&name)) {
        return Ok(());
    }
    let place = format!("--tls-cert {}", tls.certificate.display());
    let cause = format!("it is for `{name}` (its common name), and this party is `{wanted}`");
    let remedy = format!("give the certificate with the common name `{wanted}` (CN={wanted})");
    Err(InputError::new(place, cause, remedy))
}

/// Returns the certificates of a party, with the names in those of a world's agents.
pub(super) fn credentials(tls: Option<&Tls>, world: &dyn DistributedWorld) -> Option<Credentials> {
    let tls = tls?.clone();
    let agents = 0..world.agent_count() as EntityId;
    let names = agents.map(|agent| CertificateName::Agent(world.name(agent)).to_string());
    Some(Credentials { tls, agents: names.collect() })
}

/// Makes a party believe nodes only by their signatures, where there are certificates, and a node sign.
///
/// # Errors
/// When a file has become unreadable.
pub(super) fn with_signatures(
    messenger: Messenger,
    credentials: Option<&Credentials>,
) -> Result<Messenger, InputError> {
    let Some(Credentials { tls, agents }) = credentials else { return Ok(messenger) };
    messenger.with_signatures(tls, agents.clone()).map_err(|cause| {
        let place = format!("--tls-cert {}", tls.certificate.display());
        InputError::new(place, cause, "give --tls-ca, --tls-cert and --tls-key that can be read")
    })
}

/// Checks that a node's certificate holds at the endpoints at which others reach it.
///
/// # Errors
/// With the first endpoint for which it does not.
pub(super) fn check_names(tls: Option<&Tls>, listen: &[String]) -> Result<(), InputError> {
    let Some(tls) = tls else { return Ok(()) };
    let Some(parts) = CertificateParts::read(tls) else { return Ok(()) };
    for endpoint in listen {
        let Ok((host, _)) = host_and_port(endpoint) else { continue };
        if parts.verify_as_server(bare_host(host)).is_err_and(|error| is_other_name(&error)) {
            let cert = tls.certificate.display();
            let cause =
                format!("the certificate {cert} is not for {host}, where others reach this party");
            let remedy = format!("have it made with the subject alternative name {host}");
            return Err(InputError::new(endpoint, cause, remedy));
        }
    }
    Ok(())
}

/// Checks that the files exist, are certificates that are valid today, and fit each other.
///
/// # Errors
/// With the first that is not.
fn check_certificates(tls: &Tls) -> Result<(), InputError> {
    for (option, file) in [("--tls-ca", &tls.authority), ("--tls-cert", &tls.certificate)] {
        let place = format!("{option} {}", file.display());
        check_certificate(&place, &read_tls_file(&place, file)?)?;
    }
    let place = format!("--tls-key {}", tls.key.display());
    let key = read_tls_file(&place, &tls.key)?;
    let text = String::from_utf8_lossy(&key);
    if text.contains("ENCRYPTED") {
        let remedy = "give the key without a password: openssl pkey -in KEY -out KEY.open";
        return Err(InputError::new(place, "it is locked by a password", remedy));
    }
    if !text.contains("PRIVATE KEY-----") {
        let remedy = "give the file that begins with -----BEGIN PRIVATE KEY-----";
        return Err(InputError::new(place, "there is no private key in it", remedy));
    }
    check_key(&place, tls)?;
    check_authority(tls)
}

/// Checks that the private key can be used, and is that of the certificate.
fn check_key(place: &str, tls: &Tls) -> Result<(), InputError> {
    let unreadable = |cause: String| {
        let remedy =
            "give the private key that was made with the certificate (RSA, ECDSA or Ed25519)";
        InputError::new(place, cause, remedy)
    };
    let key = PrivateKeyDer::from_pem_file(&tls.key)
        .map_err(|e| unreadable(format!("its private key cannot be read: {e}")))?;
    let key = provider()
        .key_provider
        .load_private_key(key)
        .map_err(|_| unreadable("its private key is damaged, or of an unknown kind".into()))?;
    let Some(parts) = CertificateParts::read(tls) else { return Ok(()) };
    match CertifiedKey::new(parts.chain, key).keys_match() {
        Err(Error::InconsistentKeys(InconsistentKeys::KeyMismatch)) => {
            let certificate = tls.certificate.display();
            Err(unreadable(format!("it is not the key of the certificate {certificate}")))
        }
        _ => Ok(()),
    }
}

/// Checks that the certificate was signed by the authority, for links in both directions.
fn check_authority(tls: &Tls) -> Result<(), InputError> {
    let Some(parts) = CertificateParts::read(tls) else { return Ok(()) };
    // Of the name only the endpoints know: any will do here.
    let as_server = parts.verify_as_server("localhost");
    let problems = [parts.verify_as_client().err(), as_server.err()];
    let Some(problem) = problems.into_iter().flatten().find(|error| !is_other_name(error)) else {
        return Ok(());
    };
    let authority = tls.authority.display();
    let place = format!("--tls-cert {}", tls.certificate.display());
    let cause = match problem {
        Error::InvalidCertificate(CertificateError::UnknownIssuer) => {
            format!("it was not signed by the authority in {authority}")
        }
        Error::InvalidCertificate(reason) => format!("it does not hold by {authority}: {reason}"),
        other => format!("it does not hold by {authority}: {other}"),
    };
    let remedy = "give a certificate that this authority has signed, for servers and clients";
    Err(InputError::new(place, cause, remedy))
}

/// Returns whether a certificate holds, and is for another name.
fn is_other_name(error: &Error) -> bool {
    matches!(
        error,
        Error::InvalidCertificate(
            CertificateError::NotValidForName | CertificateError::NotValidForNameContext { .. }
        )
    )
}

/// Certificates of a party, read.
struct CertificateParts {
    chain: Vec<CertificateDer<'static>>,
    roots: Arc<RootCertStore>,
}

impl CertificateParts {
    /// Reads the certificates; `None` where [`check_certificates`] has said what is wrong.
    fn read(tls: &Tls) -> Option<Self> {
        let chain = read_chain(&tls.certificate)?;
        let mut roots = RootCertStore::empty();
        for certificate in read_chain(&tls.authority)? {
            // One that is no root is of no use, and the certificate does not hold then.
            let _ = roots.add(certificate);
        }
        Some(Self { chain, roots: Arc::new(roots) })
    }

    fn verify_as_client(&self) -> Result<(), Error> {
        let builder = WebPkiClientVerifier::builder_with_provider(self.roots.clone(), provider());
        let verifier = builder.build().map_err(|e| Error::General(e.to_string()))?;
        verifier.verify_client_cert(&self.chain[0], &self.chain[1..], UnixTime::now()).map(drop)
    }

    fn verify_as_server(&self, host: &str) -> Result<(), Error> {
        let name = ServerName::try_from(host).map_err(|e| Error::General(e.to_string()))?;
        let builder = WebPkiServerVerifier::builder_with_provider(self.roots.clone(), provider());
        let verifier = builder.build().map_err(|e| Error::General(e.to_string()))?;
        let end = &self.chain[0];
        verifier.verify_server_cert(end, &self.chain[1..], &name, &[], UnixTime::now()).map(drop)
    }
}

/// Returns the certificates of a file; `None` if there is none that can be read.
fn read_chain(file: &Path) -> Option<Vec<CertificateDer<'static>>> {
    let chain: Vec<_> = CertificateDer::pem_file_iter(file).ok()?.collect::<Result<_, _>>().ok()?;
    (!chain.is_empty()).then_some(chain)
}

fn provider() -> Arc<CryptoProvider> {
    Arc::new(rustls::crypto::ring::default_provider())
}

/// Checks that all links are encrypted if there are certificates, and none is without.
///
/// # Errors
/// With the first endpoint for which that is not so.
fn check_endpoint_encryption(endpoint: &str, tls: Option<&Tls>) -> Result<(), InputError> {
    if tls.is_none() && endpoint.starts_with("tls/") {
        let cause = "links to it are encrypted, and there is no certificate to show";
        let remedy = "give --tls-ca, --tls-cert and --tls-key, or tcp/HOST:PORT";
        return Err(InputError::new(endpoint, cause, remedy));
    }
    if tls.is_some() && endpoint.starts_with("tcp/") {
        let cause = "links to it are not encrypted, although there are certificates";
        return Err(InputError::new(endpoint, cause, "write it as tls/HOST:PORT"));
    }
    Ok(())
}

/// Refuses an endpoint that others than the programs of this machine can reach. A text that is none has an error of its
/// own.
fn check_is_of_this_machine(endpoint: &str) -> Result<(), InputError> {
    let Ok((host, _)) = host_and_port(endpoint) else { return Ok(()) };
    if is_of_this_machine(host) {
        return Ok(());
    }
    let cause = "it is not of this machine alone, and without certificates whoever reaches it can take part in the fleet, \
                 and read and change all that is sent";
    let remedy = "give --tls-ca, --tls-cert and --tls-key with tls/HOST:PORT (the chapter \"Who may do what in a fleet\" of \
                  the book has the commands that make certificates), an address as tcp/127.0.0.1:7600, or, on a network \
                  that you trust, --insecure";
    Err(InputError::new(endpoint, cause, remedy))
}

/// Refuses an address of metrics that others than the programs of this machine can reach. A text that is none has an error
/// of its own.
fn check_metrics_address(address: &str) -> Result<(), InputError> {
    let Some((host, port)) = address.rsplit_once(':') else { return Ok(()) };
    if is_of_this_machine(host) {
        return Ok(());
    }
    let cause = "it is not of this machine alone, and whoever reaches it sees the state of the fleet, which has no \
                 certificates";
    let remedy = format!(
        "give --metrics 127.0.0.1:{port}, certificates by --tls-ca, --tls-cert and --tls-key, or, on a network that you \
         trust, --insecure"
    );
    Err(InputError::new(format!("--metrics {address}"), cause, remedy))
}

pub(super) fn is_of_this_machine(host: &str) -> bool {
    let address = bare_host(host).parse::<IpAddr>();
    host == "localhost" || address.is_ok_and(|address| address.is_loopback())
}

fn read_tls_file(place: &str, file: &Path) -> Result<Vec<u8>, InputError> {
    std::fs::read(file)
        .map_err(|e| InputError::new(place, e.to_string(), "give a file that can be read"))
}

fn check_certificate(place: &str, text: &[u8]) -> Result<(), InputError> {
    let mut has_any = false;
    for pem in Pem::iter_from_buffer(text) {
        let pem = pem.map_err(|e| no_certificate(place, &e.to_string()))?;
        let certificate = pem.parse_x509().map_err(|e| no_certificate(place, &e.to_string()))?;
        let validity = certificate.validity();
        if !validity.is_valid() {
            let cause =
                format!("it is valid from {} to {}", validity.not_before, validity.not_after);
            let remedy = "renew the certificate, or correct the date of this machine";
            return Err(InputError::new(place, cause, remedy));
        }
        has_any = true;
    }
    if !has_any {
        return Err(no_certificate(place, "there is no certificate in it"));
    }
    Ok(())
}

fn no_certificate(place: &str, cause: &str) -> InputError {
    let remedy = "give a file that begins with -----BEGIN CERTIFICATE-----";
    InputError::new(place, cause, remedy)
}
