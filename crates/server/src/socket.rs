//! The socket of one page: requests go to sessions, and their messages to the page.

use crate::encode::problem;
use crate::files::FileMatches;
use crate::files::names_files;
use crate::gallery::gallery_reply;
use crate::outbox::{Outbox, OutboxItem};
use crate::protocol::{
    ClientRequest, OpenTarget, Problem, Reply, ReplyBody, ReplyResult, ServerMethod, SessionId,
    SessionMethod,
};
use crate::request::decode;
use crate::results::list_sweep_runs;
use crate::session::{
    OpenRequest, Session, SessionDeps, apply_edits, no_such_session, text_problems,
    text_values_reply,
};
use crate::state::AppState;
use crate::usage::server_usage;
use axum::extract::ws::{Message, WebSocket};
use sidestep_scenario::{ImportOptions, Source, Worlds};
use sidestep_session::Error;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::task::spawn_blocking;
use tokio::time::{MissedTickBehavior, interval, sleep, timeout};

/// Maximum number of sessions of a socket: each has threads and memory of its own.
const MAX_SESSIONS: usize = 4;
/// Maximum number of requests without a reply and of unsent replies. Further requests are not read from the socket, so TCP
/// holds the page back.
const MAX_BACKLOG: usize = 64;
/// Size in bytes above which a request is long.
const LONG_REQUEST_BYTES: usize = 1 << 20;
/// Bytes of long requests without a reply beyond which further requests are not read: each may be 40 MiB, and
/// [`MAX_BACKLOG`] of them would be gigabytes.
const MAX_LONG_REQUEST_BYTES: usize = 64 << 20;
/// Sustained number of requests per second; a page that drags a slider sends one for each frame of the screen.
const MAX_REQUESTS_PER_S: f64 = 300.0;
/// Number of requests that may arrive at once, after a pause: two seconds' worth.
const MAX_REQUEST_BURST: f64 = 600.0;
/// Time between two pings: routers forget connections that are idle for a minute or more.
const PING_INTERVAL: Duration = Duration::from_secs(30);
/// Time without a message or a pong after which a page counts as gone. A laptop that sleeps for some minutes keeps its
/// sessions.
const SILENCE_TIMEOUT: Duration = Duration::from_secs(600);

/// Serves a page until it leaves or the server ends. Its sessions end with it.
pub(crate) async fn serve(
    mut socket: WebSocket,
    state: Arc<AppState>,
    _permit: OwnedSemaphorePermit,
) {
    let outbox = Arc::new(Outbox::default());
    outbox.send_notification(&state.hello_notification());
    let sessions = SocketSessions {
        state: state.clone(),
        outbox: outbox.clone(),
        sessions: BTreeMap::new(),
        blocking_turn: Arc::new(Semaphore::new(1)),
    };
    tokio::select! {
        () = state.wait_for_shutdown() => {}
        () = run(&mut socket, sessions, &outbox) => {}
    }
    // A page that reads learns that this is the end; one that does not is not waited for.
    let _ = timeout(Duration::from_millis(200), socket.send(Message::Close(None))).await;
}

async fn run(socket: &mut WebSocket, mut sessions: SocketSessions, outbox: &Outbox) {
    let mut rate_limiter = RateLimiter { left: MAX_REQUEST_BURST, at: Instant::now() };
    let mut ping = interval(PING_INTERVAL);
    ping.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut last_heard = Instant::now();
    loop {
        tokio::select! {
            () = outbox.wait_until_ready() => {
                while let Some(item) = outbox.pop() {
                    let message = match item {
                        OutboxItem::Text(text) => Message::text(text),
                        OutboxItem::Frame(bytes) => Message::binary(bytes),
                    };
                    if !send(socket, message).await {
                        return;
                    }
                }
            }
            message = socket.recv(), if can_read_request(outbox) => {
                last_heard = Instant::now();
                match message {
                    Some(Ok(Message::Text(text))) => sessions.on_request(&text),
                    Some(Ok(Message::Binary(_))) => sessions.refuse_binary(),
                    Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                }
                rate_limiter.acquire().await;
            }
            _ = ping.tick() => {
                if last_heard.elapsed() > SILENCE_TIMEOUT || !send(socket, Message::Ping(Vec::new().into())).await {
                    return;
                }
            }
        }
    }
}

/// Returns whether a further request may be read.
fn can_read_request(outbox: &Outbox) -> bool {
    outbox.backlog() < MAX_BACKLOG && outbox.pending_large_request_bytes() < MAX_LONG_REQUEST_BYTES
}

/// Sends a message; returns whether the page is still connected.
async fn send(socket: &mut WebSocket, message: Message) -> bool {
    timeout(SILENCE_TIMEOUT, socket.send(message)).await.is_ok_and(|sent| sent.is_ok())
}

/// A token bucket: the number of requests that a page may send at present.
struct RateLimiter {
    left: f64,
    at: Instant,
}

impl RateLimiter {
    /// Takes a token for one request; waits if there were too many.
    async fn acquire(&mut self) {
        let now = Instant::now();
        let more = now.duration_since(self.at).as_secs_f64() * MAX_REQUESTS_PER_S;
        self.left = (self.left + more).min(MAX_REQUEST_BURST) - 1.0;
        self.at = now;
        if self.left < 0.0 {
            sleep(Duration::from_secs_f64(-self.left / MAX_REQUESTS_PER_S)).await;
        }
    }
}

/// The sessions of a socket, which end with it.
struct SocketSessions {
    state: Arc<AppState>,
    outbox: Arc<Outbox>,
    sessions: BTreeMap<SessionId, Session>,
    /// The turn of requests that are answered in another thread because they read files: one at a time, so that a page with
    /// many such requests keeps no other page waiting.
    blocking_turn: Arc<Semaphore>,
}

impl Drop for SocketSessions {
    fn drop(&mut self) {
        // Requests that wait for their turn are dropped.
        self.blocking_turn.close();
    }
}

impl SocketSessions {
    /// Processes a request; it is answered now, or later by a session.
    fn on_request(&mut self, text: &str) {
        self.outbox.add_open_request();
        match decode(text) {
            Err(unreadable) => {
                let (id, problem) = *unreadable;
                refuse(&self.outbox, id, problem);
            }
            Ok(request) => {
                let (ClientRequest::Server { id, .. } | ClientRequest::Session { id, .. }) =
                    request;
                if text.len() > LONG_REQUEST_BYTES {
                    self.outbox.record_large_request(id, text.len());
                }
                let outbox = self.outbox.clone();
                catch_panic(&outbox, id, || match request {
                    ClientRequest::Server { call, .. } => self.call_server(id, call),
                    ClientRequest::Session { session, call, .. } => {
                        self.call_session(id, session, call)
                    }
                });
            }
        }
    }

    fn refuse_binary(&self) {
        self.outbox.add_open_request();
        let problem = Problem::new("request", "it is not text", "send JSON as the protocol has it");
        refuse(&self.outbox, 0, problem);
    }

    /// Answers a request to the server itself; `None` if it is answered by another thread.
    fn call_server(&mut self, id: u32, call: ServerMethod) -> Option<Result<ReplyBody, Problem>> {
        match call {
            ServerMethod::Files { folder } => {
                let deps = self.state.deps.clone();
                self.answer_in_thread(id, move || {
                    let found = deps.files.list_folder(folder.as_deref(), &deps.worlds)?;
                    Ok(files_reply(found))
                });
                None
            }
            ServerMethod::Find { text } => {
                let deps = self.state.deps.clone();
                self.answer_in_thread(id, move || {
                    Ok(files_reply(deps.files.find(&text, &deps.worlds)))
                });
                None
            }
            ServerMethod::Identify { path } => {
                let deps = self.state.deps.clone();
                self.answer_in_thread(id, move || {
                    let entry = deps.files.identify(&path, &deps.worlds)?;
                    Ok(ReplyBody::Identified { entry })
                });
                None
            }
            ServerMethod::Gallery {} => {
                let deps = &self.state.deps;
                Some(Ok(gallery_reply(deps.gallery, &deps.worlds)))
            }
            ServerMethod::Usage {} => Some(Ok(ReplyBody::Usage(server_usage(&self.state)))),
            ServerMethod::ImportReport { path } => {
                let deps = self.state.deps.clone();
                self.answer_in_thread(id, move || import_report(&deps, &path));
                None
            }
            ServerMethod::Runs { folder } => {
                let deps = self.state.deps.clone();
                self.answer_in_thread(id, move || {
                    list_sweep_runs(&deps.files.resolve(&folder)?, &deps.worlds)
                });
                None
            }
            ServerMethod::Open { target, seed } => self.open(id, target, seed).err().map(Err),
            ServerMethod::Schema { world } => {
                let worlds = self.state.deps.worlds.clone();
                self.answer_in_thread(id, move || schema_reply(&worlds, &world));
                None
            }
        }
    }

    /// Answers a request to a session; `None` if it is answered by another thread.
    fn call_session(
        &mut self,
        id: u32,
        session: SessionId,
        call: SessionMethod,
    ) -> Option<Result<ReplyBody, Problem>> {
        match call {
            SessionMethod::Close {} => {
                let closed = self.sessions.remove(&session).ok_or_else(no_such_session);
                self.outbox.discard_update(session);
                Some(closed.map(|_| ReplyBody::Done))
            }
            SessionMethod::Check { text } => {
                self.answer_scenario_text_request(id, session, move |deps, source| {
                    Ok(ReplyBody::Problems { problems: text_problems(deps, source, text)? })
                })
            }
            SessionMethod::Edit { text, edits } => {
                self.answer_scenario_text_request(id, session, move |deps, source| {
                    apply_edits(deps, source, text, edits)
                })
            }
            SessionMethod::Model { text } => {
                self.answer_scenario_text_request(id, session, move |deps, source| {
                    text_values_reply(deps, source, text)
                })
            }
            SessionMethod::Run(call) => {
                let Some(session) = self.sessions.get(&session) else {
                    return Some(Err(no_such_session()));
                };
                session.send_request(id, call).err().map(Err)
            }
        }
    }

    fn open(&mut self, id: u32, target: OpenTarget, seed: Option<u64>) -> Result<(), Problem> {
        self.sessions.retain(|_, session| !session.is_finished());
        if self.sessions.len() == MAX_SESSIONS {
            let cause = format!("this page has {MAX_SESSIONS} sessions already");
            return Err(Problem::new("open", cause, "close one first"));
        }
        let (session, permit) = self.state.acquire_session()?;
        let request = OpenRequest { session, id, target, seed };
        let started = Session::start(self.state.deps.clone(), request, self.outbox.clone(), permit);
        let started = started.map_err(|e| {
            let cause = format!("no thread can be started: {e}");
            Problem::new("open", cause, "close other sessions or programs")
        })?;
        self.sessions.insert(session, started);
        Ok(())
    }

    /// Answers a request on a text that stands for a session's scenario.
    fn answer_scenario_text_request(
        &self,
        id: u32,
        session: SessionId,
        work: impl FnOnce(&SessionDeps, &Source) -> Result<ReplyBody, Problem> + Send + 'static,
    ) -> Option<Result<ReplyBody, Problem>> {
        let Some(source) = self.sessions.get(&session).and_then(Session::scenario_source) else {
            return Some(Err(no_such_session()));
        };
        let deps = self.state.deps.clone();
        self.answer_in_thread(id, move || work(&deps, &source));
        None
    }

    /// Answers a request in another thread, because it may read files.
    fn answer_in_thread(
        &self,
        id: u32,
        work: impl FnOnce() -> Result<ReplyBody, Problem> + Send + 'static,
    ) {
        let outbox = self.outbox.clone();
        let turn = self.blocking_turn.clone();
        tokio::spawn(async move {
            let Ok(_turn) = turn.acquire().await else { return };
            // A panic of the work is caught within, so joining cannot fail.
            let _ = spawn_blocking(move || catch_panic(&outbox, id, || Some(work()))).await;
        });
    }
}

fn files_reply(FileMatches { entries, left_out }: FileMatches) -> ReplyBody {
    ReplyBody::Files { entries, left_out }
}

/// Returns what becomes of a file, as people read it.
fn import_report(deps: &SessionDeps, path: &str) -> Result<ReplyBody, Problem> {
    let file = deps.files.resolve(path)?;
    // A page can write scenarios, and a scenario can name any file of the disk: only opening checks which.
    if names_files(&file) {
        let remedy = "open a scenario instead, or choose a map, a profile or traffic";
        return Err(Problem::new(path.to_string(), "this is no file to import", remedy));
    }
    let inspected = sidestep_session::inspect(&deps.worlds, &file, &ImportOptions::default());
    let inspected = inspected.map_err(|e| match e {
        Error::Input(error) => problem(&error),
        other => Problem::new(path.to_string(), other.to_string(), "try another file"),
    })?;
    let lines = inspected.report.lines();
    let findings = inspected.report.findings.iter().map(ToString::to_string).collect();
    Ok(ReplyBody::ImportReport { lines, findings })
}

/// Returns the JSON Schema of a world's scenarios, and the tools that edit them on the canvas.
///
/// # Errors
/// When there is no such world.
pub(crate) fn schema_reply(worlds: &Worlds, world: &str) -> Result<ReplyBody, Problem> {
    let world_type = worlds.find(world).ok_or_else(|| {
        let names = worlds.names().join(", ");
        Problem::new(world, "no such world", format!("give one of {names}"))
    })?;
    let schema = sidestep_scenario::schema::for_world(world_type);
    Ok(ReplyBody::Schema { schema, editing: world_type.editing() })
}

/// Answers a request with the result of `work`, if there is one, and with a problem if it panics.
fn catch_panic(
    outbox: &Outbox,
    id: u32,
    work: impl FnOnce() -> Option<Result<ReplyBody, Problem>>,
) {
    let done = catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| {
        let cause = "internal error (a bug in Sidestep)";
        Some(Err(Problem::new("request", cause, "please report it with the request")))
    });
    match done {
        Some(Ok(answer)) => outbox.send_reply(&Reply { id, result: ReplyResult::Answer(answer) }),
        Some(Err(problem)) => refuse(outbox, id, problem),
        None => {}
    }
}

fn refuse(outbox: &Outbox, id: u32, problem: Problem) {
    outbox.send_reply(&Reply { id, result: ReplyResult::Problem(problem) });
}
