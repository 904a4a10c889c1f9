//! Where an autopilot is, as ground stations write it.

use crate::wire::endpoint::{bare_host, parse_port};
use std::fmt;
use std::net::{IpAddr, SocketAddr, ToSocketAddrs};

/// How bytes come from an autopilot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MavlinkTransport {
    /// By UDP: it is waited for at an address of this machine.
    UdpListen,
    /// By UDP: the first datagram goes to its address.
    UdpConnect,
    /// By TCP: it listens.
    TcpConnect,
}

/// The address of an autopilot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MavlinkEndpoint {
    /// How bytes come from there.
    pub transport: MavlinkTransport,
    /// Name or address of the machine; for [`MavlinkTransport::UdpListen`] of this one.
    pub host: String,
    /// The port; 0 for any that is free, where this machine listens.
    pub port: u16,
}

/// The forms that are understood.
const FORMS: &str = "give udp:HOST:PORT or udpin:HOST:PORT to wait for the autopilot at an address of this machine, \
                     udpout:HOST:PORT to send to it, or tcp:HOST:PORT to connect to it, as in udp:127.0.0.1:14550";

impl MavlinkEndpoint {
    /// Reads `udp:HOST:PORT`, `udpin:HOST:PORT`, `udpout:HOST:PORT` or `tcp:HOST:PORT`.
    ///
    /// # Errors
    /// With what is wrong.
    pub fn parse(text: &str) -> Result<Self, String> {
        let Some((name, address)) = text.split_once(':') else {
            return Err(format!("it has no protocol: {FORMS}"));
        };
        let transport = match name {
            "udp" | "udpin" => MavlinkTransport::UdpListen,
            "udpout" => MavlinkTransport::UdpConnect,
            "tcp" => MavlinkTransport::TcpConnect,
            _ => return Err(format!("`{name}` is no protocol: {FORMS}")),
        };
        let Some((host, port)) = address.rsplit_once(':') else {
            return Err(format!("it has no port: {FORMS}"));
        };
        if host.is_empty() {
            return Err(format!("it has no host: {FORMS}"));
        }
        // `::1` would be taken for the host `:` and the port 1.
        if host.contains(':') && !(host.starts_with('[') && host.ends_with(']')) {
            return Err("an IPv6 address is written between brackets, as in udp:[::1]:14550".into());
        }
        let port = parse_port(port).map_err(|reason| format!("{reason}: {FORMS}"))?;
        if port == 0 && transport != MavlinkTransport::UdpListen {
            return Err(format!("nothing can be reached at port 0: {FORMS}"));
        }
        Ok(Self { transport, host: bare_host(host).to_string(), port })
    }

    /// Returns whether all of its bytes stay on this machine.
    pub fn is_loopback(&self) -> bool {
        let address = self.host.parse::<IpAddr>();
        self.host == "localhost" || address.is_ok_and(|address| address.is_loopback())
    }

    /// Returns its address.
    ///
    /// # Errors
    /// When the host is not known.
    pub(super) fn resolve(&self) -> Result<SocketAddr, String> {
        let found = (self.host.as_str(), self.port).to_socket_addrs();
        let mut addresses =
            found.map_err(|error| format!("{} is not known ({error})", self.host))?;
        addresses.next().ok_or_else(|| format!("{} has no address", self.host))
    }
}

impl fmt::Display for MavlinkEndpoint {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self.transport {
            MavlinkTransport::UdpListen => "udpin",
            MavlinkTransport::UdpConnect => "udpout",
            MavlinkTransport::TcpConnect => "tcp",
        };
        let Self { host, port, .. } = self;
        if host.contains(':') {
            write!(out, "{name}:[{host}]:{port}")
        } else {
            write!(out, "{name}:{host}:{port}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endpoints_are_those_of_ground_stations() {
        for (text, transport, host, port) in [
            ("udp:127.0.0.1:14550", MavlinkTransport::UdpListen, "127.0.0.1", 14550),
            ("udpin:0.0.0.0:14550", MavlinkTransport::UdpListen, "0.0.0.0", 14550),
            ("udpout:drone.example:9", MavlinkTransport::UdpConnect, "drone.example", 9),
            ("tcp:[::1]:5760", MavlinkTransport::TcpConnect, "::1", 5760),
        ] {
            let expected = MavlinkEndpoint { transport, host: host.into(), port };
            assert_eq!(MavlinkEndpoint::parse(text), Ok(expected.clone()), "{text}");
            assert_eq!(MavlinkEndpoint::parse(&expected.to_string()), Ok(expected), "{text}");
        }
    }

    #[test]
    fn what_is_no_endpoint_is_refused_with_the_forms() {
        for (text, cause) in [
            ("127.0.0.1", "no protocol"),
            ("serial:/dev/ttyUSB0:57600", "`serial`"),
            ("udp:127.0.0.1", "no port"),
            ("udp::14550", "no host"),
            ("udp:::1:14550", "brackets"),
            ("udp:a:x", "no number"),
            ("tcp:a:0", "port 0"),
        ] {
            let error = MavlinkEndpoint::parse(text).expect_err(text);
            assert!(error.contains(cause), "{text}: {error}");
        }
    }

    #[test]
    fn only_addresses_of_this_machine_alone_are_loopback() {
        for (text, expected) in [
            ("udp:127.0.0.1:1", true),
            ("udp:localhost:1", true),
            ("udpout:[::1]:1", true),
            ("udp:0.0.0.0:1", false),
            ("udpout:10.0.0.2:1", false),
        ] {
            let endpoint = MavlinkEndpoint::parse(text).expect(text);
            assert_eq!(endpoint.is_loopback(), expected, "{text}");
        }
    }
}
