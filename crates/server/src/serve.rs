//! Connections: taken, served for a time, and ended. No silent one keeps its place.

use crate::limits::{ConnectionLimiter, ConnectionPermit};
use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::io;
use std::pin::{Pin, pin};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, watch};
use tokio::time::{sleep, timeout};

/// The patience with connections that are no sockets.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Timeouts {
    /// The time for the head of a request, and between two requests.
    head: Duration,
    /// The time after which a connection ends with the answer that is under way; the browser opens another one.
    longest: Duration,
    /// The time in which a peer has to read something of such an answer.
    reading: Duration,
}

impl Default for Timeouts {
    fn default() -> Self {
        let [head, longest, reading] = [20, 600, 60].map(Duration::from_secs);
        Self { head, longest, reading }
    }
}

/// The time that an answer under way has when a connection ends.
const GRACE_TIMEOUT: Duration = Duration::from_secs(1);
/// The wait where the system gives no connections, because too many files are open.
const ACCEPT_RETRY_DELAY: Duration = Duration::from_millis(500);
/// The number of connections refused with an answer at a time.
const MAX_REFUSALS: usize = 32;
const TOO_MANY_RESPONSE: &[u8] = b"HTTP/1.1 503 Service Unavailable\r\ncontent-type: text/plain; charset=utf-8\r\n\
    connection: close\r\ncontent-length: 63\r\n\r\nThere are too many connections: close pages, and try it again.\n";

/// Answers requests until the server ends, as `ending` signals.
pub(crate) async fn serve(
    listener: TcpListener,
    routes: Router,
    ending: watch::Receiver<bool>,
    patience: Timeouts,
) {
    let (doors, told) =
        (Arc::new(ConnectionLimiter::default()), Arc::new(Semaphore::new(MAX_REFUSALS)));
    loop {
        let accepted = tokio::select! {
            () = wait_for_shutdown(ending.clone()) => break,
            accepted = listener.accept() => accepted,
        };
        let Ok((stream, address)) = accepted else {
            sleep(ACCEPT_RETRY_DELAY).await;
            continue;
        };
        // With it frames are sent at once; without it they are only late.
        let _ = stream.set_nodelay(true);
        match (doors.acquire(address.ip()), told.clone().try_acquire_owned()) {
            (Some(place), _) => {
                let connection = Connection { stream, stuck: StallTimer::default(), _place: place };
                tokio::spawn(serve_connection(
                    connection,
                    routes.clone(),
                    ending.clone(),
                    patience,
                ));
            }
            (None, Ok(turn)) => drop(tokio::spawn(async move {
                let _turn = turn;
                let _ = timeout(GRACE_TIMEOUT, refuse(stream)).await;
            })),
            (None, Err(_)) => {}
        }
    }
    let emptied = async {
        while !doors.is_empty() {
            sleep(Duration::from_millis(5)).await;
        }
    };
    let _ = timeout(GRACE_TIMEOUT, emptied).await;
}

/// Serves one connection, until it ends, becomes a socket, or has had its time. An answer that is under way then comes
/// to its end, however long it takes to make or to send, unless its peer does not read it.
async fn serve_connection(
    connection: Connection,
    routes: Router,
    ending: watch::Receiver<bool>,
    patience: Timeouts,
) {
    let stuck = connection.stuck.clone();
    let mut http = http1::Builder::new();
    let http = http.timer(TokioTimer::new()).header_read_timeout(patience.head);
    let served = http.serve_connection(TokioIo::new(connection), TowerToHyperService::new(routes));
    let mut served = pin!(served.with_upgrades());
    tokio::select! {
        _ = &mut served => return,
        () = wait_for_shutdown(ending.clone()) => {}
        () = sleep(patience.longest) => {
            served.as_mut().graceful_shutdown();
            tokio::select! {
                _ = &mut served => return,
                () = wait_for_shutdown(ending) => {}
                () = stuck.wait_for_stall(patience.reading) => return,
            }
        }
    }
    served.as_mut().graceful_shutdown();
    let _ = timeout(GRACE_TIMEOUT, served).await;
}

/// The instant since which a peer has taken none of the written bytes, as long as it takes none.
#[derive(Debug, Clone, Default)]
struct StallTimer(Arc<Mutex<Option<Instant>>>);

impl StallTimer {
    /// Notes whether a write had to wait.
    fn record(&self, waits: bool) {
        let mut since = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *since = if waits { since.or_else(|| Some(Instant::now())) } else { None };
    }

    /// Waits until the peer has taken nothing for the given time.
    async fn wait_for_stall(&self, longest: Duration) {
        loop {
            let since = *self.0.lock().unwrap_or_else(PoisonError::into_inner);
            match since.map_or(longest, |since| longest.saturating_sub(since.elapsed())) {
                Duration::ZERO => return,
                rest => sleep(rest).await,
            }
        }
    }
}

/// Waits until the server ends.
pub(crate) async fn wait_for_shutdown(mut ending: watch::Receiver<bool>) {
    // An error means that its owner is gone: then it ends, too.
    let _ = ending.wait_for(|ends| *ends).await;
}

/// Tells a peer that there are too many connections.
async fn refuse(mut stream: TcpStream) -> io::Result<()> {
    stream.write_all(TOO_MANY_RESPONSE).await?;
    stream.shutdown().await?;
    // Its request must be read, or the system may discard our answer.
    let mut said = [0; 1024];
    while stream.read(&mut said).await? > 0 {}
    Ok(())
}

/// A connection, and its place among all.
struct Connection {
    stream: TcpStream,
    stuck: StallTimer,
    _place: ConnectionPermit,
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
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.stuck.record(written.is_pending());
        written
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
    use axum::routing::get;
    use std::io::{Read, Write};

    /// A server of one word, with little patience; returns its address, and the sender that ends it.
    fn impatient(longest: Duration) -> (std::net::SocketAddr, watch::Sender<bool>) {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("bound");
        listener.set_nonblocking(true).expect("set");
        let (ends, ending) = watch::channel(false);
        let [head, reading] = [200, 2000].map(Duration::from_millis);
        let patience = Timeouts { head, longest, reading };
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
            runtime.expect("a runtime").block_on(async {
                let listener = TcpListener::from_std(listener).expect("taken");
                let late = || async {
                    sleep(Duration::from_secs(3)).await;
                    "late"
                };
                let routes = Router::new().route("/", get(|| async { "here" }));
                let routes = routes.route("/late", get(late));
                let routes = routes.route("/much", get(|| async { "much ".repeat(20 << 20) }));
                serve(listener, routes, ending, patience).await;
            });
        });
        (address, ends)
    }

    fn connect(address: std::net::SocketAddr) -> std::net::TcpStream {
        let stream = std::net::TcpStream::connect(address).expect("connected");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a time");
        stream
    }

    /// The words received until the connection ends, however it ends.
    fn heard(mut stream: std::net::TcpStream) -> String {
        let mut said = Vec::new();
        let _ = stream.read_to_end(&mut said);
        String::from_utf8_lossy(&said).into_owned()
    }

    #[test]
    fn a_connection_that_says_nothing_or_half_a_head_or_nothing_more_is_ended() {
        let (address, _ends) = impatient(Duration::from_secs(600));
        for said in ["", "GET / HTTP/1.1\r\nHost: a", "GET / HTTP/1.1\r\nHost: a\r\n\r\n"] {
            let mut stream = connect(address);
            stream.write_all(said.as_bytes()).expect("sent");
            let started = Instant::now();
            let is_whole = said.ends_with("\r\n\r\n");
            assert_eq!(heard(stream).ends_with("here"), is_whole, "{said}");
            assert!(started.elapsed() < Duration::from_secs(30), "{said}");
        }
    }

    #[test]
    fn a_connection_that_asks_again_and_again_has_its_time() {
        let (address, _ends) = impatient(Duration::from_millis(600));
        let mut stream = connect(address);
        let mut told = [0; 256];
        let started = Instant::now();
        // A write or a read fails once it is ended.
        while stream.write_all(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n").is_ok()
            && stream.read(&mut told).is_ok_and(|bytes| bytes > 0)
        {
            assert!(started.elapsed() < Duration::from_secs(30), "it goes on");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    #[test]
    fn an_answer_that_takes_longer_than_a_connection_has_comes_whole() {
        let (address, _ends) = impatient(Duration::from_millis(300));
        let mut stream = connect(address);
        stream.write_all(b"GET /late HTTP/1.1\r\nHost: a\r\n\r\n").expect("sent");
        let said = heard(stream);
        assert!(said.ends_with("late"), "{said}");
    }

    #[test]
    fn who_does_not_read_an_answer_is_not_waited_for_and_who_reads_slowly_is() {
        let (address, _ends) = impatient(Duration::from_millis(300));
        let ask = || {
            let mut stream = connect(address);
            stream.write_all(b"GET /much HTTP/1.1\r\nHost: a\r\n\r\n").expect("sent");
            stream
        };
        let mut asleep = ask();
        let mut slow = ask();
        let (mut part, mut bytes) = (vec![0; 2 << 20], 0);
        while let Ok(read @ 1..) = slow.read(&mut part) {
            bytes += read;
            std::thread::sleep(Duration::from_millis(20));
        }
        assert!(bytes > 100 << 20, "{bytes}");
        // It must not read to learn that it was given up: a write fails then.
        let started = Instant::now();
        while asleep.write_all(b"\n").is_ok() {
            assert!(started.elapsed() < Duration::from_secs(30), "it is waited for");
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(heard(asleep).len() < 100 << 20);
    }

    #[test]
    fn who_comes_when_there_are_too_many_is_told_so_and_places_are_free_again() {
        let (address, _ends) = impatient(Duration::from_secs(600));
        let ask = |mut stream: std::net::TcpStream| {
            let asked = b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n";
            stream.write_all(asked).expect("sent");
            heard(stream)
        };
        let mut told = String::new();
        let mut inside: Vec<std::net::TcpStream> = Vec::new();
        while !told.starts_with("HTTP/1.1 503") {
            // They keep their places for a while, and are then ended.
            inside.clear();
            inside.extend((0..128).map(|_| connect(address)));
            told = ask(connect(address));
        }
        assert!(told.ends_with("try it again.\n"), "{told}");
        drop(inside);
        while !ask(connect(address)).ends_with("here") {}
    }

    #[test]
    fn the_refusal_has_the_length_that_it_names() {
        let text = String::from_utf8_lossy(TOO_MANY_RESPONSE);
        let (head, body) = text.split_once("\r\n\r\n").expect("a head");
        assert!(
            head.ends_with(&format!("content-length: {}", body.len())),
            "{head} {}",
            body.len()
        );
    }
}
