//! Endpoints: their notation, reserved ports, and reasons why there is no wire.

use std::net::{TcpListener, ToSocketAddrs};

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
    #[error("`{0}` is no endpoint")]
    NoEndpoint(String),
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
    parse_endpoint(endpoint).ok_or_else(|| WireSetupError::NoEndpoint(endpoint.into()))
}

fn parse_endpoint(endpoint: &str) -> Option<(&str, u16)> {
    let (protocol, address) = endpoint.split_once('/')?;
    let (host, port) = address.rsplit_once(':')?;
    if !["tcp", "tls"].contains(&protocol) || host.is_empty() {
        return None;
    }
    Some((host, port.parse().ok()?))
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
const FIRST_PORT: u16 = 20_000;

/// Number of ports that are tried.
const PORT_COUNT: u16 = 12_000;

/// Reserves the port of an endpoint; port 0 stands for any free one.
///
/// # Errors
/// When it cannot be bound, or the text is no endpoint.
pub fn reserve_port(endpoint: &str) -> Result<PortReservation, WireSetupError> {
    let (host, port) = host_and_port(endpoint)?;
    let bare = host.trim_start_matches('[').trim_end_matches(']');
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
    TcpListener::bind(&*addresses.collect::<Vec<_>>()).map_err(|e| e.to_string())
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
