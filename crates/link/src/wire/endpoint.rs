//! Endpoints: their notation, reserved ports, and reasons why there is no wire.

use std::io::ErrorKind;
use std::net::{IpAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::time::Duration;

/// Time that an address has to accept a connection, where it is asked why it did not.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(1);

/// The reason why there is no wire.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WireSetupError {
    /// An address cannot be bound.
    #[error("cannot listen at {endpoint}: {reason}")]
    Taken {
        /// The address.
        endpoint: String,
        /// What the operating system says.
        reason: String,
    },
    /// A text is not in the form of an endpoint.
    #[error("{reason}")]
    NoEndpoint {
        /// The text.
        endpoint: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Nothing has answered within the time that was given.
    #[error("no answer from {endpoint}: {reason}")]
    NoAnswer {
        /// The address.
        endpoint: String,
        /// What the last attempt to connect has found.
        reason: String,
    },
    /// There is an answer, and one of the two ends rejects the other's certificate.
    #[error("{endpoint} and this party do not trust each other: {reason}")]
    Distrust {
        /// The address.
        endpoint: String,
        /// Which certificate is rejected, and why.
        reason: String,
    },
}

/// Returns an endpoint's host and port, e.g. of `tcp/127.0.0.1:7600`.
///
/// # Errors
/// When the text is no endpoint.
pub fn host_and_port(endpoint: &str) -> Result<(&str, u16), WireSetupError> {
    parse_endpoint(endpoint)
        .map_err(|reason| WireSetupError::NoEndpoint { endpoint: endpoint.into(), reason })
}

/// Returns host and port, or the reason why a text is no endpoint.
fn parse_endpoint(endpoint: &str) -> Result<(&str, u16), String> {
    let (protocol, address) = endpoint.split_once('/').ok_or("the protocol is missing")?;
    if !["tcp", "tls"].contains(&protocol) {
        return Err(format!("`{protocol}` is neither tcp nor tls"));
    }
    let (host, port) = address.rsplit_once(':').ok_or("the port is missing")?;
    if host.is_empty() {
        return Err("the host is missing".into());
    }
    // `::1` would be taken for the host `:` and the port 1.
    if host.contains(':') && !(host.starts_with('[') && host.ends_with(']')) {
        return Err("an IPv6 address is written between brackets, as in [::1]:7600".into());
    }
    Ok((host, parse_port(port)?))
}

/// Returns the number of a port, or the reason why a text is none.
pub fn parse_port(port: &str) -> Result<u16, String> {
    let is_number = !port.is_empty() && port.bytes().all(|byte| byte.is_ascii_digit());
    if !is_number {
        return Err(format!("port `{port}` is no number"));
    }
    port.parse().map_err(|_| format!("port {port} is above {}", u16::MAX))
}

/// Checks the address of an endpoint at which other nodes are to reach this one.
///
/// # Errors
/// When it is no endpoint, or stands for all addresses of a machine: others cannot connect to such a one.
pub fn check_reachable(endpoint: &str) -> Result<(), WireSetupError> {
    let (host, _) = host_and_port(endpoint)?;
    let address = bare_host(host).parse::<IpAddr>();
    if address.is_ok_and(|address| address.is_unspecified()) {
        let reason =
            format!("{host} stands for every address of this machine, and others need one of them");
        return Err(WireSetupError::NoEndpoint { endpoint: endpoint.into(), reason });
    }
    Ok(())
}

/// Returns a host without the brackets of an IPv6 address.
pub fn bare_host(host: &str) -> &str {
    host.trim_start_matches('[').trim_end_matches(']')
}

/// Returns why no link to an endpoint can be opened, as the operating system says it; none if there is an answer.
pub(super) fn connection_problem(endpoint: &str) -> Option<String> {
    let (host, port) = host_and_port(endpoint).ok()?;
    let address = match (bare_host(host), port).to_socket_addrs() {
        Ok(mut addresses) => addresses.next()?,
        Err(error) => return Some(format!("{host} is not known ({error})")),
    };
    match TcpStream::connect_timeout(&address, CONNECT_TIMEOUT) {
        Ok(_) => None,
        Err(error) if error.kind() == ErrorKind::ConnectionRefused => {
            Some("nothing listens there".into())
        }
        Err(error) => Some(error.to_string()),
    }
}

/// Returns what a library says without the places in its source, such as ` at src/lib.rs:12`, which say nothing to users.
pub fn without_sources(text: &str) -> String {
    let mut parts = text.split(" at ");
    let mut clean = parts.next().unwrap_or_default().to_string();
    for part in parts {
        if let Some(rest) = after_source(part) {
            clean.push_str(rest);
        } else {
            clean.push_str(" at ");
            clean.push_str(part);
        }
    }
    clean.trim_end_matches([' ', '.']).to_string()
}

/// Returns what follows the place in a source with which a text begins; none if it begins with something else.
fn after_source(text: &str) -> Option<&str> {
    let (path, rest) = text.split_once(".rs:")?;
    let rest = rest.trim_start_matches(|c: char| c.is_ascii_digit());
    (!path.contains(char::is_whitespace)).then_some(rest)
}

/// A port that is bound, so that no other program gets it, until a socket of this program needs it.
#[derive(Debug)]
pub struct PortReservation {
    /// The endpoint, with the reserved port in place of port 0.
    pub endpoint: String,
    _port: TcpListener,
}

/// Lowest port that is tried where any will do. The ports are below those that systems give to outgoing connections (from
/// 32,768 on for Linux), one of which could get the port between its reservation and its use.
pub(super) const FIRST_PORT: u16 = 20_000;

/// Number of ports that are tried.
pub(super) const PORT_COUNT: u16 = 12_000;

/// Reserves the port of an endpoint; port 0 stands for any free one.
///
/// # Errors
/// When it cannot be bound, or the text is no endpoint.
pub fn reserve_port(endpoint: &str) -> Result<PortReservation, WireSetupError> {
    let (host, port) = host_and_port(endpoint)?;
    let bare = bare_host(host);
    if port > 0 {
        let bound =
            bind(bare, port).map_err(|reason| endpoint_in_use(&[endpoint.into()], reason))?;
        return Ok(PortReservation { endpoint: endpoint.into(), _port: bound });
    }
    // Processes that start together begin their search at different ports: their ids follow each other.
    let first = (std::process::id().wrapping_mul(97) % u32::from(PORT_COUNT)) as u16;
    let mut last_reason = String::new();
    for k in 0..PORT_COUNT {
        let port = FIRST_PORT + (first + k) % PORT_COUNT;
        match bind(bare, port) {
            Ok(bound) => {
                let endpoint = with_port(endpoint, port);
                return Ok(PortReservation { endpoint, _port: bound });
            }
            Err(reason) => last_reason = reason,
        }
    }
    Err(endpoint_in_use(&[endpoint.into()], last_reason))
}

fn bind(host: &str, port: u16) -> Result<TcpListener, String> {
    let addresses = (host, port).to_socket_addrs().map_err(|e| e.to_string())?;
    TcpListener::bind(&*addresses.collect::<Vec<_>>()).map_err(|error| match error.kind() {
        ErrorKind::AddrInUse => "something else listens there".into(),
        ErrorKind::AddrNotAvailable => format!("{host} is no address of this machine"),
        ErrorKind::PermissionDenied => format!("this user may not listen at port {port}"),
        _ => error.to_string(),
    })
}

/// Returns an endpoint with another port, in place of any that it has.
pub fn with_port(endpoint: &str, port: u16) -> String {
    let address = endpoint.rsplit_once(':').map_or(endpoint, |(address, _)| address);
    format!("{address}:{port}")
}

/// Checks that an endpoint can be bound.
pub(super) fn check_vacant(endpoint: &str) -> Result<(), WireSetupError> {
    reserve_port(endpoint).map(drop)
}

pub(super) fn endpoint_in_use(endpoints: &[String], reason: String) -> WireSetupError {
    WireSetupError::Taken { endpoint: endpoints.join(", "), reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_is_no_endpoint_is_refused_by_what_is_wrong_with_it() {
        for (text, reason) in [
            ("tcp/127.0.0.1:99999", "port 99999 is above 65535"),
            ("tcp/127.0.0.1:", "port `` is no number"),
            ("tcp/127.0.0.1:http", "port `http` is no number"),
            ("tcp/127.0.0.1", "the port is missing"),
            ("127.0.0.1:7600", "the protocol is missing"),
            ("http/127.0.0.1:7600", "`http` is neither"),
            ("tcp/:7600", "the host is missing"),
            ("tcp/::1:7600", "between brackets"),
        ] {
            let error = host_and_port(text).expect_err(text).to_string();
            assert!(error.contains(reason), "{text}: {error}");
        }
        assert_eq!(host_and_port("tcp/[::1]:7600"), Ok(("[::1]", 7600)));
    }

    #[test]
    fn an_address_that_stands_for_all_of_a_machine_is_none_for_others() {
        for text in ["tcp/0.0.0.0:0", "tls/[::]:7600"] {
            let error = check_reachable(text).expect_err(text).to_string();
            assert!(error.contains("every address"), "{text}: {error}");
        }
        for text in ["tcp/127.0.0.1:0", "tls/[::1]:7600", "tcp/vehicle-3:7600"] {
            check_reachable(text).expect(text);
        }
    }

    #[test]
    fn what_a_library_says_has_no_places_in_its_source() {
        let said = "Cannot create a listener on 127.0.0.1:25961. KeyMismatch at \
                    /home/u/.cargo/src/tls/utils.rs:247. at /home/u/.cargo/src/unicast.rs:426.";
        let clean = "Cannot create a listener on 127.0.0.1:25961. KeyMismatch";
        assert_eq!(without_sources(said), clean);
        assert_eq!(without_sources("no answer at noon"), "no answer at noon");
        assert_eq!(without_sources(""), "");
    }
}
