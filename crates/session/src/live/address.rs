//! The address at which viewers are served.

use sidestep_kernel::InputError;
use std::io;
use std::net::{IpAddr, SocketAddr, TcpListener, ToSocketAddrs};
use std::str::FromStr;

/// The port if none is given: the one that Foxglove's viewers try first.
const DEFAULT_PORT: u16 = 8765;
/// Ports after one that is in use that are tried for a suggestion: a machine rarely has so many servers side by side.
const MAX_PORTS_TRIED: u16 = 100;

/// A host, or a host and a port, at which viewers are served.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ViewerAddress {
    host: String,
    port: u16,
}

impl FromStr for ViewerAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        parse_host_and_port(text).ok_or_else(|| {
            format!("`{text}` is no HOST:PORT; give 127.0.0.1:{DEFAULT_PORT}, for example")
        })
    }
}

fn parse_host_and_port(text: &str) -> Option<ViewerAddress> {
    // Addresses of IPv6 without brackets have colons of their own.
    let is_host_alone = text.parse::<IpAddr>().is_ok() || text.ends_with(']');
    let (host, port) = if is_host_alone {
        (text, DEFAULT_PORT)
    } else if let Some((host, port)) = text.rsplit_once(':') {
        (host, port.parse().ok()?)
    } else if let Ok(port) = text.parse() {
        ("127.0.0.1", port)
    } else {
        (text, DEFAULT_PORT)
    };
    let host = host.trim_start_matches('[').trim_end_matches(']').to_string();
    (!host.is_empty()).then_some(ViewerAddress { host, port })
}

impl ViewerAddress {
    /// Returns the host in the form in which it precedes a port.
    pub fn host(&self) -> String {
        if self.host.contains(':') { format!("[{}]", self.host) } else { self.host.clone() }
    }

    /// Returns the port; 0 for any free one.
    pub fn port(&self) -> u16 {
        self.port
    }

    /// Returns whether other machines can reach it.
    pub fn is_public(&self) -> bool {
        self.resolve_ip().is_ok_and(|ip| !ip.is_loopback())
    }

    /// Returns the address with a port that is free now, if any port will do.
    ///
    /// # Errors
    /// When it does not belong to this machine, or the port is in use; the error then reports the next free one.
    pub fn with_free_port(&self) -> Result<Self, InputError> {
        // Taken for a moment, and free again when the listener is dropped: the server takes the port by its number.
        let bound = self
            .resolve_ip()
            .and_then(|ip| TcpListener::bind((ip, self.port)))
            .and_then(|listener| listener.local_addr());
        let port = bound.map_err(|e| self.bind_error(&e))?.port();
        Ok(Self { port, ..self.clone() })
    }

    /// Returns the address to give to a viewer, with the scheme of WebSockets.
    pub fn url(&self) -> String {
        format!("ws://{}:{}", self.host(), self.port)
    }

    fn resolve_ip(&self) -> io::Result<IpAddr> {
        let mut found = (self.host.as_str(), self.port).to_socket_addrs()?;
        let first = found.next().map(|address| address.ip());
        first.ok_or_else(|| io::ErrorKind::AddrNotAvailable.into())
    }

    /// Returns the error of an address that could not be taken.
    pub(crate) fn bind_error(&self, error: &io::Error) -> InputError {
        let place = format!("--foxglove {}:{}", self.host(), self.port);
        let is_in_use = error.kind() == io::ErrorKind::AddrInUse;
        let Some(ip) = self.resolve_ip().ok().filter(|_| is_in_use) else {
            let remedy = "give an address of this machine, such as 127.0.0.1:8765";
            return InputError::new(place, error.to_string(), remedy);
        };
        let remedy = match next_free_port(ip, self.port) {
            Some(free) => format!("give --foxglove {}:{free}, which is free", self.host()),
            None => format!("give --foxglove {}:0 to use a free one", self.host()),
        };
        InputError::new(place, "the port is in use", remedy)
    }
}

/// Returns the first port after `port` that is free now; `None` if none of the next hundred is.
pub fn next_free_port(ip: IpAddr, port: u16) -> Option<u16> {
    let after = (port..port.saturating_add(MAX_PORTS_TRIED)).skip(1);
    after.into_iter().find(|port| TcpListener::bind(SocketAddr::new(ip, *port)).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_have_a_host_a_port_or_both() {
        let read = |text: &str| text.parse::<ViewerAddress>().map(|at| (at.host(), at.port()));
        let is = |host: &str, port| Ok((host.to_string(), port));
        assert_eq!(read("127.0.0.1:9000"), is("127.0.0.1", 9000));
        assert_eq!(read("9000"), is("127.0.0.1", 9000));
        assert_eq!(read("here.example"), is("here.example", DEFAULT_PORT));
        assert_eq!(read("[::1]:9000"), is("[::1]", 9000));
        assert_eq!(read("::1"), is("[::1]", DEFAULT_PORT));
        assert_eq!(read("[::1]"), is("[::1]", DEFAULT_PORT));
        for wrong in ["", ":9000", "host:", "host:port", "host:70000"] {
            assert!(read(wrong).is_err_and(|e| e.contains("127.0.0.1:8765")), "{wrong}");
        }
    }

    #[test]
    fn a_port_in_use_is_an_error_with_the_next_free_one() {
        let taken = TcpListener::bind("127.0.0.1:0").expect("any port");
        let port = taken.local_addr().expect("bound").port();
        let at: ViewerAddress = format!("127.0.0.1:{port}").parse().expect("an address");
        let error = at.with_free_port().expect_err("in use");
        assert_eq!(error.place(), format!("--foxglove 127.0.0.1:{port}"));
        assert!(error.remedy().contains("--foxglove 127.0.0.1:"), "{error}");
        drop(taken);
        assert_eq!(at.with_free_port(), Ok(at));
        let any: ViewerAddress = "127.0.0.1:0".parse().expect("an address");
        assert!(
            any.with_free_port()
                .is_ok_and(|at| at.port() > 0 && at.url().starts_with("ws://127.0.0.1:"))
        );
    }

    #[test]
    fn an_address_that_is_not_this_machines_is_an_error() {
        let at: ViewerAddress = "192.0.2.1:9000".parse().expect("an address");
        assert!(at.with_free_port().is_err() && at.is_public());
    }
}
