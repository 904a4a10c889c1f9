//! The port: found, bound, and kept from too many connections.

use axum::serve::Listener;
use sidestep::kernel::InputError;
use std::io;
use std::net::{IpAddr, SocketAddr, TcpListener, ToSocketAddrs};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// The first port that is tried where none is asked for.
const FIRST_PORT: u16 = 7800;
/// The number of ports that are tried.
const PORTS: u16 = 100;
/// The number of connections at a time.
const MOST_CONNECTIONS: usize = 128;

/// Binds the port that is asked for; the first free one of some where none is.
///
/// # Errors
/// When the address is not one of this machine, or the port is in use; then with the next free one.
pub(crate) fn bind(host: &str, port: Option<u16>) -> Result<TcpListener, InputError> {
    let ip = resolve(host)?;
    let at = |port: u16| TcpListener::bind(SocketAddr::new(ip, port));
    let Some(port) = port else {
        let mut tried = (FIRST_PORT..FIRST_PORT + PORTS).map(at);
        let found = tried.find(|bound| !is_taken(bound)).unwrap_or_else(|| at(0));
        return found.map_err(|e| unusable(host, &e));
    };
    match at(port) {
        bound if is_taken(&bound) => {
            let after = (port..port.saturating_add(PORTS)).skip(1);
            let free = after.into_iter().find(|port| at(*port).is_ok());
            let remedy = match free {
                Some(free) => format!("give --port {free}, which is free, or leave it out"),
                None => "leave it out, and a free one is taken".into(),
            };
            Err(InputError::new(format!("--port {port}"), "the port is in use", remedy))
        }
        bound => bound.map_err(|e| unusable(&format!("{host} --port {port}"), &e)),
    }
}

fn is_taken(bound: &io::Result<TcpListener>) -> bool {
    bound.as_ref().is_err_and(|e| e.kind() == io::ErrorKind::AddrInUse)
}

fn resolve(host: &str) -> Result<IpAddr, InputError> {
    let name = host.trim_start_matches('[').trim_end_matches(']');
    let found = (name, 0).to_socket_addrs().map_err(|e| unusable(host, &e))?;
    let first = found.map(|address| address.ip()).next();
    first.ok_or_else(|| unusable(host, &io::ErrorKind::AddrNotAvailable.into()))
}

fn unusable(host: &str, error: &io::Error) -> InputError {
    let remedy = "give an address of this machine, such as 127.0.0.1 or 0.0.0.0, and a port that you may use";
    InputError::new(format!("--addr {host}"), error.to_string(), remedy)
}

/// A listener that takes so many connections at a time; others wait.
pub(crate) struct Limited {
    listener: tokio::net::TcpListener,
    places: Arc<Semaphore>,
}

impl Limited {
    /// Takes connections of a bound port.
    ///
    /// # Errors
    /// When the system refuses.
    pub(crate) fn new(listener: TcpListener) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        let listener = tokio::net::TcpListener::from_std(listener)?;
        Ok(Self { listener, places: Arc::new(Semaphore::new(MOST_CONNECTIONS)) })
    }
}

impl Listener for Limited {
    type Io = Connection;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Connection, SocketAddr) {
        // The semaphore is never closed.
        let place = self.places.clone().acquire_owned().await.ok();
        let (stream, address) = Listener::accept(&mut self.listener).await;
        // Frames are sent at once. Without it they are only late.
        let _ = stream.set_nodelay(true);
        (Connection { stream, _place: place }, address)
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }
}

/// A connection, and its place among all.
pub(crate) struct Connection {
    stream: TcpStream,
    _place: Option<OwnedSemaphorePermit>,
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
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
        assert!(error.remedy().contains("--port ") || port > u16::MAX - PORTS, "{error}");
        assert!(bind("127.0.0.1", None).is_ok());
    }

    #[test]
    fn an_address_that_is_not_this_machines_is_an_error() {
        for host in ["192.0.2.1", "no such host", ""] {
            let error = bind(host, None).expect_err(host);
            assert!(error.place().starts_with("--addr"), "{error}");
        }
    }
}
