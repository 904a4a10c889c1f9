//! Bytes to and from an autopilot.

use super::endpoint::{MavlinkEndpoint, MavlinkTransport};
use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, TcpStream, UdpSocket};
use std::time::{Duration, Instant};

/// Time that a TCP connection may take, and a write: the autopilot is on the same machine or one hop away.
const CONNECT_TIMEOUT: Duration = Duration::from_millis(500);

/// Time between attempts to connect again by TCP.
const RETRY_INTERVAL: Duration = Duration::from_secs(1);

/// The shortest wait: a time of zero means forever to the operating system.
const MIN_WAIT: Duration = Duration::from_micros(100);

/// Time after which datagrams of another address are listened to, when the one so far says nothing.
const PEER_SILENCE: Duration = Duration::from_secs(5);

/// What has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Arrival {
    /// A datagram of so many bytes: frames do not go on in the next one.
    Datagram(usize),
    /// So many bytes of a stream.
    Stream(usize),
    /// Another stream has begun.
    Reconnected,
    /// Nothing yet.
    Nothing,
}

/// An open connection.
#[derive(Debug)]
pub(super) enum Socket {
    /// See [`UdpPeer`].
    Udp(UdpPeer),
    /// See [`TcpPeer`].
    Tcp(TcpPeer),
}

/// A socket for datagrams.
#[derive(Debug)]
pub(super) struct UdpPeer {
    socket: UdpSocket,
    /// To whom datagrams go; none before the autopilot was heard.
    peer: Option<SocketAddr>,
    /// From where the last datagram has come.
    source: Option<SocketAddr>,
    heard_at: Option<Instant>,
    /// Datagrams of other addresses.
    strangers: u64,
}

/// A stream, which is connected again when it breaks.
#[derive(Debug)]
pub(super) struct TcpPeer {
    address: SocketAddr,
    stream: Option<TcpStream>,
    retry_at: Instant,
}

impl Socket {
    /// Opens the connection.
    ///
    /// # Errors
    /// When an address cannot be bound, is not known or does not answer.
    pub(super) fn open(endpoint: &MavlinkEndpoint) -> Result<Self, String> {
        let address = endpoint.resolve()?;
        match endpoint.transport {
            MavlinkTransport::UdpListen => {
                let socket = bind(address)?;
                Ok(Self::Udp(UdpPeer::new(socket, None)))
            }
            MavlinkTransport::UdpConnect => {
                let any = match address {
                    SocketAddr::V4(_) => SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0)),
                    SocketAddr::V6(_) => SocketAddr::from((Ipv6Addr::UNSPECIFIED, 0)),
                };
                Ok(Self::Udp(UdpPeer::new(bind(any)?, Some(address))))
            }
            MavlinkTransport::TcpConnect => {
                let stream = connect(address).map_err(|error| error.to_string())?;
                let retry_at = Instant::now() + RETRY_INTERVAL;
                Ok(Self::Tcp(TcpPeer { address, stream: Some(stream), retry_at }))
            }
        }
    }

    /// Returns the address of this end.
    pub(super) fn local_address(&self) -> Option<SocketAddr> {
        match self {
            Self::Udp(udp) => udp.socket.local_addr().ok(),
            Self::Tcp(tcp) => tcp.stream.as_ref().and_then(|stream| stream.local_addr().ok()),
        }
    }

    /// Waits for bytes.
    ///
    /// # Errors
    /// With a failure of the machine, such as one that is out of memory.
    pub(super) fn receive(
        &mut self,
        buffer: &mut [u8],
        within: Duration,
    ) -> std::io::Result<Arrival> {
        match self {
            Self::Udp(udp) => udp.receive(buffer, within),
            Self::Tcp(tcp) => Ok(tcp.receive(buffer, within)),
        }
    }

    /// Sends a frame. Returns whether it could be sent.
    pub(super) fn send(&mut self, frame: &[u8]) -> bool {
        match self {
            // Before anybody was heard there is nobody to whom it could be sent.
            Self::Udp(udp) => udp.peer.is_none_or(|peer| udp.socket.send_to(frame, peer).is_ok()),
            Self::Tcp(tcp) => tcp.send(frame),
        }
    }

    /// Takes note that the last bytes were from the autopilot: answers go there.
    pub(super) fn accept_source(&mut self) {
        if let Self::Udp(udp) = self {
            udp.peer = udp.source;
            udp.heard_at = Some(Instant::now());
        }
    }

    /// Returns the number of datagrams that were dropped because they came from another address.
    pub(super) fn strangers(&self) -> u64 {
        match self {
            Self::Udp(udp) => udp.strangers,
            Self::Tcp(_) => 0,
        }
    }
}

fn bind(address: SocketAddr) -> Result<UdpSocket, String> {
    UdpSocket::bind(address).map_err(|error| format!("{address} cannot be bound: {error}"))
}

fn connect(address: SocketAddr) -> std::io::Result<TcpStream> {
    let stream = TcpStream::connect_timeout(&address, CONNECT_TIMEOUT)?;
    // Setpoints are small, and late ones are useless.
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(CONNECT_TIMEOUT))?;
    Ok(stream)
}

impl UdpPeer {
    fn new(socket: UdpSocket, peer: Option<SocketAddr>) -> Self {
        Self { socket, peer, source: None, heard_at: None, strangers: 0 }
    }

    fn receive(&mut self, buffer: &mut [u8], within: Duration) -> std::io::Result<Arrival> {
        self.socket.set_read_timeout(Some(within.max(MIN_WAIT)))?;
        match self.socket.recv_from(buffer) {
            Ok((bytes, source)) if self.is_welcome(source) => {
                self.source = Some(source);
                Ok(Arrival::Datagram(bytes))
            }
            Ok(_) => {
                self.strangers += 1;
                Ok(Arrival::Nothing)
            }
            Err(error) if is_passing(error.kind()) => Ok(Arrival::Nothing),
            Err(error) => Err(error),
        }
    }

    /// Whoever is heard first is listened to, until it says nothing more: its machine may get another port.
    fn is_welcome(&self, source: SocketAddr) -> bool {
        let Some(heard_at) = self.heard_at else { return true };
        self.peer == Some(source) || heard_at.elapsed() > PEER_SILENCE
    }
}

/// Returns whether a failure of a datagram says nothing about the next one: there was none in time, or nobody listens
/// there at the moment.
fn is_passing(kind: ErrorKind) -> bool {
    matches!(
        kind,
        ErrorKind::WouldBlock
            | ErrorKind::TimedOut
            | ErrorKind::Interrupted
            | ErrorKind::ConnectionRefused
            | ErrorKind::ConnectionReset
    )
}

impl TcpPeer {
    fn receive(&mut self, buffer: &mut [u8], within: Duration) -> Arrival {
        let Some(stream) = &mut self.stream else { return self.retry(within) };
        let is_set = stream.set_read_timeout(Some(within.max(MIN_WAIT))).is_ok();
        match stream.read(buffer) {
            Ok(bytes) if bytes > 0 && is_set => Arrival::Stream(bytes),
            Err(error)
                if is_passing(error.kind()) && error.kind() != ErrorKind::ConnectionReset =>
            {
                Arrival::Nothing
            }
            // The other end has closed it, or it broke.
            _ => {
                self.stream = None;
                Arrival::Nothing
            }
        }
    }

    fn retry(&mut self, within: Duration) -> Arrival {
        let now = Instant::now();
        if now < self.retry_at {
            std::thread::sleep(within.min(self.retry_at - now));
            return Arrival::Nothing;
        }
        self.retry_at = now + RETRY_INTERVAL;
        match connect(self.address) {
            Ok(stream) => {
                self.stream = Some(stream);
                Arrival::Reconnected
            }
            Err(error) => {
                tracing::debug!("cannot connect to {}: {error}", self.address);
                Arrival::Nothing
            }
        }
    }

    fn send(&mut self, frame: &[u8]) -> bool {
        let Some(stream) = &mut self.stream else { return false };
        if stream.write_all(frame).is_err() {
            // A frame that is half sent makes what follows unreadable.
            self.stream = None;
            return false;
        }
        true
    }
}
