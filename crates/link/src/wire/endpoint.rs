//! Endpoints: their notation, ports that are held, and reasons why there is no wire.

use std::net::{TcpListener, ToSocketAddrs};

/// The reason why there is no wire.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// Listening at an address is impossible.
    #[error("cannot listen at {endpoint}: {reason}")]
    Taken {
        /// The address.
        endpoint: String,
        /// The reason.
        reason: String,
    },
    /// A text is not in the form of an endpoint.
    #[error("`{0}` is no endpoint")]
    NoEndpoint(String),
    /// There is no answer.
    #[error("nobody answers at {endpoint}: {reason}")]
    NoAnswer {
        /// The address.
        endpoint: String,
        /// The reason.
        reason: String,
    },
    /// There is an answer, and one of the two ends does not take the other's certificate.
    #[error("{endpoint} and this party do not trust each other: {reason}")]
    Distrust {
        /// The address.
        endpoint: String,
        /// The reason.
        reason: String,
    },
}

/// Returns an endpoint's host and port, e.g. of `tcp/127.0.0.1:7600`.
///
/// # Errors
/// When the text is no endpoint.
pub fn host_and_port(endpoint: &str) -> Result<(&str, u16), WireError> {
    let no_endpoint = || WireError::NoEndpoint(endpoint.into());
    let (protocol, address) = endpoint.split_once('/').ok_or_else(no_endpoint)?;
    let (host, port) = address.rsplit_once(':').ok_or_else(no_endpoint)?;
    if !["tcp", "tls"].contains(&protocol) || host.is_empty() {
        return Err(no_endpoint());
    }
    Ok((host, port.parse().map_err(|_| no_endpoint())?))
}

/// A port held until another socket may have it.
#[derive(Debug)]
pub struct PortReservation {
    /// The endpoint, with a port.
    pub endpoint: String,
    _port: TcpListener,
}

/// Lowest port that is tried where any will do, and their number: below those that systems give to outgoing
/// connections, one of which could take it first.
const PORT_RANGE: (u16, u16) = (20_000, 12_000);

/// Holds the port of an endpoint; port 0 stands for any free one.
///
/// # Errors
/// When it cannot be taken, or the text is no endpoint.
pub fn reserve_port(endpoint: &str) -> Result<PortReservation, WireError> {
    let (host, port) = host_and_port(endpoint)?;
    let bare = host.trim_start_matches('[').trim_end_matches(']');
    let bind = |port: u16| {
        let addresses = (bare, port).to_socket_addrs().map_err(|e| e.to_string())?;
        TcpListener::bind(&*addresses.collect::<Vec<_>>()).map_err(|e| e.to_string())
    };
    let with = |port: u16| {
        let start = endpoint.len() - endpoint.rsplit(':').next().map_or(0, str::len);
        format!("{}{port}", &endpoint[..start])
    };
    if port > 0 {
        let held = bind(port).map_err(|reason| endpoint_in_use(&[endpoint.into()], reason))?;
        return Ok(PortReservation { endpoint: endpoint.into(), _port: held });
    }
    let first = (std::process::id().wrapping_mul(97) % u32::from(PORT_RANGE.1)) as u16;
    let mut why = String::new();
    for k in 0..PORT_RANGE.1 {
        let port = PORT_RANGE.0 + (first + k) % PORT_RANGE.1;
        match bind(port) {
            Ok(held) => return Ok(PortReservation { endpoint: with(port), _port: held }),
            Err(reason) => why = reason,
        }
    }
    Err(endpoint_in_use(&[endpoint.into()], why))
}

/// Checks that listening at an endpoint is possible.
pub(super) fn check_vacant(endpoint: &str) -> Result<(), WireError> {
    reserve_port(endpoint).map(drop)
}

pub(super) fn endpoint_in_use(endpoints: &[String], reason: String) -> WireError {
    WireError::Taken { endpoint: endpoints.join(", "), reason }
}
