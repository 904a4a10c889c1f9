//! The server's port, and the address at which other machines reach it.

use sidestep_kernel::InputError;
use sidestep_session::next_free_port;
use std::io;
use std::net::{IpAddr, SocketAddr, TcpListener, ToSocketAddrs, UdpSocket};

/// The first port that is tried where none is given: no common program has it.
const FIRST_PORT: u16 = 7800;
/// The number of ports that are tried: more servers on one machine use any free port.
const PORT_COUNT: u16 = 100;

/// Binds the given port, or the first free one of a range.
///
/// # Errors
/// If the address is not one of this machine, or the port is in use; the error then suggests the next free one.
pub(crate) fn bind(host: &str, port: Option<u16>) -> Result<TcpListener, InputError> {
    let ip = resolve(host)?;
    let Some(port) = port else {
        return bind_first_free(ip).map_err(|e| listen_address_error(host, &e));
    };
    let bound = bind_port(ip, port);
    if is_address_in_use(&bound) {
        let remedy = match next_free_port(ip, port) {
            Some(free) => format!("give --port {free}, which is free, or leave it out"),
            None => "leave it out to use a free one".into(),
        };
        return Err(InputError::new(format!("--port {port}"), "the port is in use", remedy));
    }
    bound.map_err(|e| listen_address_error(&format!("{host} --port {port}"), &e))
}

/// Binds the first free port of the range, else any that the system has: addresses in bookmarks and terminals stay the
/// same as long as possible.
fn bind_first_free(ip: IpAddr) -> io::Result<TcpListener> {
    for port in FIRST_PORT..FIRST_PORT + PORT_COUNT {
        let bound = bind_port(ip, port);
        if !is_address_in_use(&bound) {
            return bound;
        }
    }
    bind_port(ip, 0)
}

fn bind_port(ip: IpAddr, port: u16) -> io::Result<TcpListener> {
    TcpListener::bind(SocketAddr::new(ip, port))
}

fn is_address_in_use(bound: &io::Result<TcpListener>) -> bool {
    bound.as_ref().is_err_and(|e| e.kind() == io::ErrorKind::AddrInUse)
}

fn resolve(host: &str) -> Result<IpAddr, InputError> {
    let name = host.trim_start_matches('[').trim_end_matches(']');
    let found = (name, 0).to_socket_addrs().map_err(|e| listen_address_error(host, &e))?;
    let first = found.map(|address| address.ip()).next();
    first.ok_or_else(|| listen_address_error(host, &io::ErrorKind::AddrNotAvailable.into()))
}

fn listen_address_error(host: &str, error: &io::Error) -> InputError {
    let remedy = "give an address of this machine, such as 127.0.0.1 or 0.0.0.0, and a port that you may use";
    InputError::new(format!("--addr {host}"), error.to_string(), remedy)
}

/// Returns the address at which other machines reach this one, if it has one: that from which it would send to them.
/// Nothing is sent to find it.
pub(crate) fn outbound_address(ip: IpAddr) -> Option<IpAddr> {
    // Addresses reserved for documentation: they lead nowhere, but take the route of all others.
    let far: SocketAddr = match ip {
        IpAddr::V4(_) => ([192, 0, 2, 1], 9).into(),
        IpAddr::V6(_) => ([0x2001, 0xdb8, 0, 0, 0, 0, 0, 1], 9).into(),
    };
    let socket = UdpSocket::bind((ip, 0)).ok()?;
    socket.connect(far).ok()?;
    let own = socket.local_addr().ok()?.ip();
    (!own.is_loopback() && !own.is_unspecified()).then_some(own)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_in_use_is_an_error_with_the_next_free_one_and_without_one_a_free_one_is_found() {
        let taken = bind("127.0.0.1", Some(0)).expect("any port");
        let port = taken.local_addr().expect("bound").port();
        let error = bind("127.0.0.1", Some(port)).expect_err("in use");
        assert_eq!(error.place(), format!("--port {port}"));
        assert!(error.remedy().contains("--port ") || port > u16::MAX - PORT_COUNT, "{error}");
        assert!(bind("127.0.0.1", None).is_ok());
    }

    #[test]
    fn an_address_that_is_not_this_machines_is_an_error() {
        for host in ["192.0.2.1", "no such host", ""] {
            let error = bind(host, None).expect_err(host);
            assert!(error.place().starts_with("--addr"), "{error}");
        }
    }

    #[test]
    fn an_own_address_is_one_that_can_be_listened_at() {
        if let Some(own) = outbound_address(IpAddr::from([0, 0, 0, 0])) {
            assert!(bind(&own.to_string(), Some(0)).is_ok(), "{own}");
        }
        assert_eq!(outbound_address(IpAddr::from([127, 0, 0, 1])), None, "others cannot reach it");
    }
}
