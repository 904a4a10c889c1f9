//! Connections: accepted, served for some time, and ended. One that asks for nothing gives way to others, and no idle one
//! keeps its permit for long.

use crate::limits::{ConnectionLimiter, ConnectionPermit, RequestInProgress};
use axum::Router;
use axum::body::{Body, Bytes, HttpBody};
use hyper::body::{Frame, Incoming, SizeHint};
use hyper::server::conn::http1;
use hyper::service::Service;
use hyper::{Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::convert::Infallible;
use std::io;
use std::pin::{Pin, pin};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, watch};
use tokio::time::{sleep, timeout};

/// Timeouts of connections that are no WebSockets.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Timeouts {
    /// The time for the head of a request, and between two requests: ample for a browser, and no idle connection
    /// keeps its permit for longer.
    head: Duration,
    /// The time after which a connection ends with the response in progress; the browser opens another one. Otherwise one
    /// that repeats a request again and again would keep its permit for good.
    max_lifetime: Duration,
    /// The time in which a peer has to read some of such a response.
    stall: Duration,
}

impl Default for Timeouts {
    fn default() -> Self {
        Self {
            head: Duration::from_secs(20),
            max_lifetime: Duration::from_secs(600),
            stall: Duration::from_secs(60),
        }
    }
}

/// The time that a response in progress has when the server ends: small ones get through, and nobody waits for the
/// end.
const GRACE_TIMEOUT: Duration = Duration::from_secs(1);
/// The delay after a failure to accept, because of too many open files for instance: retrying at once would be a busy loop.
const ACCEPT_RETRY_DELAY: Duration = Duration::from_millis(500);
/// Maximum number of connections that are refused with a response at a time: refusals have no permits, so they need a
/// limit.
const MAX_REFUSALS: usize = 32;
const TOO_MANY_RESPONSE: &[u8] = b"HTTP/1.1 503 Service Unavailable\r\ncontent-type: text/plain; charset=utf-8\r\n\
    connection: close\r\ncontent-length: 63\r\n\r\nThere are too many connections: close pages, and try it again.\n";

/// Answers requests until `shutdown` signals the end of the server.
pub(crate) async fn serve(
    listener: TcpListener,
    routes: Router,
    shutdown: watch::Receiver<bool>,
    timeouts: Timeouts,
) {
    let limiter = Arc::new(ConnectionLimiter::default());
    let refusals = Arc::new(Semaphore::new(MAX_REFUSALS));
    loop {
        let accepted = tokio::select! {
            () = wait_for_shutdown(shutdown.clone()) => break,
            accepted = listener.accept() => accepted,
        };
        let Ok((stream, address)) = accepted else {
            sleep(ACCEPT_RETRY_DELAY).await;
            continue;
        };
        // Without it Nagle's algorithm would delay small frames. If it cannot be set, frames are only late.
        let _ = stream.set_nodelay(true);
        if let Some(permit) = limiter.acquire(address.ip()) {
            let stall_timer = StallTimer::default();
            let connection = PermittedConnection { stream, stall_timer, permit: Arc::new(permit) };
            tokio::spawn(serve_connection(connection, routes.clone(), shutdown.clone(), timeouts));
        } else if let Ok(permit) = refusals.clone().try_acquire_owned() {
            tokio::spawn(async move {
                let _permit = permit;
                let _ = timeout(GRACE_TIMEOUT, refuse(stream)).await;
            });
        }
    }
    let _ = timeout(GRACE_TIMEOUT, wait_until_empty(&limiter)).await;
}

async fn wait_until_empty(limiter: &ConnectionLimiter) {
    while !limiter.is_empty() {
        // In a loop, because permits are dropped without a signal; it lasts a second at most.
        sleep(Duration::from_millis(5)).await;
    }
}

/// Serves one connection, until it ends, becomes a WebSocket, or has reached its maximum lifetime. A response that is in
/// progress then is completed, however long it takes to make or to send (an export may take minutes), unless its peer
/// does not read it.
async fn serve_connection(
    connection: PermittedConnection,
    routes: Router,
    shutdown: watch::Receiver<bool>,
    timeouts: Timeouts,
) {
    let stall_timer = connection.stall_timer.clone();
    let permit = connection.permit.clone();
    let routes = TowerToHyperService::new(routes);
    let routes = PermittedRoutes { routes, permit: permit.clone() };
    let mut http = http1::Builder::new();
    let http = http.timer(TokioTimer::new()).header_read_timeout(timeouts.head);
    let served = http.serve_connection(TokioIo::new(connection), routes);
    let mut served = pin!(served.with_upgrades());
    tokio::select! {
        _ = &mut served => return,
        // Nothing was asked, so there is nobody to be told.
        () = permit.wait_for_loss() => return,
        () = wait_for_shutdown(shutdown.clone()) => {}
        () = sleep(timeouts.max_lifetime) => {
            served.as_mut().graceful_shutdown();
            tokio::select! {
                _ = &mut served => return,
                () = wait_for_shutdown(shutdown) => {}
                () = stall_timer.wait_for_stall(timeouts.stall) => return,
            }
        }
    }
    served.as_mut().graceful_shutdown();
    let _ = timeout(GRACE_TIMEOUT, served).await;
}

/// The instant since which a peer has read none of the written bytes; none while it reads.
#[derive(Debug, Clone, Default)]
struct StallTimer(Arc<Mutex<Option<Instant>>>);

impl StallTimer {
    /// Records whether a write had to wait.
    fn record(&self, waits: bool) {
        let mut since = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *since = if waits { since.or_else(|| Some(Instant::now())) } else { None };
    }

    /// Waits until the peer has read nothing for the given time.
    async fn wait_for_stall(&self, limit: Duration) {
        loop {
            let since = *self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let remaining = since.map_or(limit, |since| limit.saturating_sub(since.elapsed()));
            if remaining.is_zero() {
                return;
            }
            sleep(remaining).await;
        }
    }
}

/// Waits until the server ends.
pub(crate) async fn wait_for_shutdown(mut shutdown: watch::Receiver<bool>) {
    // An error means that the owner of the server was dropped: then it ends, too.
    let _ = shutdown.wait_for(|is_requested| *is_requested).await;
}

/// Tells a peer that there are too many connections.
async fn refuse(mut stream: TcpStream) -> io::Result<()> {
    stream.write_all(TOO_MANY_RESPONSE).await?;
    stream.shutdown().await?;
    // Closing a socket with unread data resets the connection, and the peer may never see the response.
    let mut unread = [0; 1024];
    while stream.read(&mut unread).await? > 0 {}
    Ok(())
}

/// The routes for one connection, whose permit learns of its requests.
struct PermittedRoutes {
    routes: TowerToHyperService<Router>,
    permit: Arc<ConnectionPermit>,
}

impl Service<Request<Incoming>> for PermittedRoutes {
    type Response = Response<PermittedBody>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Self::Response, Infallible>> + Send>>;

    fn call(&self, request: Request<Incoming>) -> Self::Future {
        let permit = self.permit.clone();
        let in_progress = permit.begin_request();
        let answer = self.routes.call(request);
        Box::pin(async move {
            let answer = answer.await?;
            if answer.status() == StatusCode::SWITCHING_PROTOCOLS {
                permit.record_socket();
            }
            Ok(answer.map(|body| PermittedBody { body, _in_progress: in_progress }))
        })
    }
}

/// The body of an answer, which is in progress until all of it is sent.
struct PermittedBody {
    body: Body,
    _in_progress: RequestInProgress,
}

impl HttpBody for PermittedBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.body).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// A connection that keeps its permit also after it has become a WebSocket.
struct PermittedConnection {
    stream: TcpStream,
    stall_timer: StallTimer,
    permit: Arc<ConnectionPermit>,
}

impl AsyncRead for PermittedConnection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for PermittedConnection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.stall_timer.record(written.is_pending());
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

    /// Starts a server with short timeouts; returns its address, and the sender that ends it.
    fn impatient(max_lifetime: Duration) -> (std::net::SocketAddr, watch::Sender<bool>) {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("bound");
        listener.set_nonblocking(true).expect("set");
        let (ends, shutdown) = watch::channel(false);
        let [head, stall] = [200, 2000].map(Duration::from_millis);
        let timeouts = Timeouts { head, max_lifetime, stall };
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
                serve(listener, routes, shutdown, timeouts).await;
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
            inside.extend((0..128).map(|_| {
                let mut stream = connect(address);
                stream.write_all(b"GET /late HTTP/1.1\r\nHost: a\r\n\r\n").expect("sent");
                stream
            }));
            told = ask(connect(address));
        }
        assert!(told.ends_with("try it again.\n"), "{told}");
        drop(inside);
        while !ask(connect(address)).ends_with("here") {}
    }

    #[test]
    fn hundreds_of_connections_that_ask_for_nothing_cost_nobody_a_place() {
        let (address, _ends) = impatient(Duration::from_secs(600));
        let ask = b"GET / HTTP/1.1\r\nHost: a\r\n\r\n";
        let mut half_open = Vec::new();
        for k in 0..400 {
            let mut stream = connect(address);
            // Some have begun to ask, and some are idle after an answer; one that was ended already cannot be written to.
            let _ = stream.write_all(&ask[..k % (ask.len() + 1)]);
            half_open.push(stream);
        }
        let mut newcomer = connect(address);
        newcomer
            .write_all(b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
            .expect("sent");
        let told = heard(newcomer);
        assert!(told.ends_with("here"), "{told}");
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
