//! Checks of certificates before anything starts: on a network a wrong one shows only as silence.

use sidestep::kernel::InputError;
use sidestep_session::fleet::Tls;
use std::path::Path;
use x509_parser::pem::Pem;

/// Checks certificates, and that endpoints are encrypted if and only if there are certificates.
///
/// # Errors
/// With the first thing that is wrong.
pub(super) fn check_encryption<'a>(
    endpoints: impl IntoIterator<Item = &'a String>,
    tls: Option<&Tls>,
) -> Result<(), InputError> {
    tls.map_or(Ok(()), check_certificates)?;
    check_endpoint_encryption(endpoints, tls)
}

/// Checks that the files exist, and are certificates that are valid today.
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
    if !String::from_utf8_lossy(&key).contains("PRIVATE KEY-----") {
        let remedy = "give the file that begins with -----BEGIN PRIVATE KEY-----";
        return Err(InputError::new(place, "there is no private key in it", remedy));
    }
    Ok(())
}

/// Checks that all links are encrypted if there are certificates, and none is without.
///
/// # Errors
/// With the first endpoint for which that is not so.
fn check_endpoint_encryption<'a>(
    endpoints: impl IntoIterator<Item = &'a String>,
    tls: Option<&Tls>,
) -> Result<(), InputError> {
    for endpoint in endpoints {
        if tls.is_none() && endpoint.starts_with("tls/") {
            let cause = "links to it are encrypted, and there is no certificate to show";
            let remedy = "give --tls-ca, --tls-cert and --tls-key, or tcp/HOST:PORT";
            return Err(InputError::new(endpoint, cause, remedy));
        }
        if tls.is_some() && endpoint.starts_with("tcp/") {
            let cause = "links to it are not encrypted, although there are certificates";
            return Err(InputError::new(endpoint, cause, "write it as tls/HOST:PORT"));
        }
    }
    Ok(())
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
