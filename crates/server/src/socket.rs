//! One page's socket: requests to sessions, and their messages.

use crate::house::House;
use crate::outbox::{Mail, Outbox};
use crate::protocol::{Answer, Call, Outcome, Problem, Reply, SessionId, Subject};
use crate::request::decode;
use crate::results::runs;
use crate::session::{Means, Opening, Session, checked, edited, ended, model};
use axum::extract::ws::{Message, WebSocket};
use sidestep::scenario::{Source, Worlds};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::task::spawn_blocking;
use tokio::time::{MissedTickBehavior, interval, sleep, timeout};

/// The largest number of sessions of a socket.
const MOST_SESSIONS: usize = 4;
/// The largest number of open requests and unsent replies; further ones wait in the network.
const MOST_BACKLOG: usize = 64;
/// The size in bytes above which a request is long.
const LONG_BYTES: usize = 1 << 20;
/// The bytes of unanswered long requests beyond which others wait in the network.
const MOST_LONG_BYTES: usize = 64 << 20;
/// Sustained number of requests per second.
const REQUESTS_PER_S: f64 = 300.0;
/// The number of requests that may come at once.
const REQUESTS_AT_ONCE: f64 = 600.0;
/// The time between two requests for a sign of life.
const PING: Duration = Duration::from_secs(30);
/// The silence after which a page counts as gone.
const SILENCE: Duration = Duration::from_secs(600);

/// Serves a page until it leaves or the server ends. Its sessions end with it.
pub(crate) async fn serve(mut socket: WebSocket, house: Arc<House>, _seat: OwnedSemaphorePermit) {
    let outbox = Arc::new(Outbox::default());
    outbox.notice(&house.hello());
    let (house_, outbox_, aside) = (house.clone(), outbox.clone(), Arc::new(Semaphore::new(1)));
    let desk = Desk { house: house_, outbox: outbox_, sessions: BTreeMap::new(), aside };
    tokio::select! {
        () = house.ended() => {}
        () = talk(&mut socket, desk, &outbox) => {}
    }
    // A page that reads learns that this is the end; there is no need to wait for any other.
    let _ = timeout(Duration::from_millis(200), socket.send(Message::Close(None))).await;
}

async fn talk(socket: &mut WebSocket, mut desk: Desk, outbox: &Outbox) {
    let mut allowance = Allowance { left: REQUESTS_AT_ONCE, at: Instant::now() };
    let mut ping = interval(PING);
    ping.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut heard = Instant::now();
    loop {
        tokio::select! {
            () = outbox.ready() => {
                while let Some(mail) = outbox.next() {
                    let message = match mail {
                        Mail::Text(text) => Message::text(text),
                        Mail::Frame(bytes) => Message::binary(bytes),
                    };
                    if !sent(socket, message).await {
                        return;
                    }
                }
            }
            message = socket.recv(), if has_room(outbox) => {
                heard = Instant::now();
                match message {
                    Some(Ok(Message::Text(text))) => desk.take(&text),
                    Some(Ok(Message::Binary(_))) => desk.refuse_binary(),
                    Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                }
                allowance.spend().await;
            }
            _ = ping.tick() => {
                if heard.elapsed() > SILENCE || !sent(socket, Message::Ping(Vec::new().into())).await {
                    return;
                }
            }
        }
    }
}

/// Returns whether a further request may be taken in.
fn has_room(outbox: &Outbox) -> bool {
    outbox.backlog() < MOST_BACKLOG && outbox.long_bytes() < MOST_LONG_BYTES
}

/// Sends a message; returns whether the page is still there.
async fn sent(socket: &mut WebSocket, message: Message) -> bool {
    timeout(SILENCE, socket.send(message)).await.is_ok_and(|sent| sent.is_ok())
}

/// The number of requests that a page may still send.
struct Allowance {
    left: f64,
    at: Instant,
}

impl Allowance {
    /// Takes one request; waits if there were too many.
    async fn spend(&mut self) {
        let now = Instant::now();
        let more = now.duration_since(self.at).as_secs_f64() * REQUESTS_PER_S;
        (self.left, self.at) = ((self.left + more).min(REQUESTS_AT_ONCE) - 1.0, now);
        if self.left < 0.0 {
            sleep(Duration::from_secs_f64(-self.left / REQUESTS_PER_S)).await;
        }
    }
}

/// The sessions of a socket.
struct Desk {
    house: Arc<House>,
    outbox: Arc<Outbox>,
    sessions: BTreeMap<SessionId, Session>,
    /// One thread for work that reads files, so that a page with many such requests keeps no other page waiting.
    aside: Arc<Semaphore>,
}

impl Drop for Desk {
    fn drop(&mut self) {
        // Work that waits for its turn is no longer wanted.
        self.aside.close();
    }
}

impl Desk {
    /// Takes a request; it is answered now, or later by a session.
    fn take(&mut self, text: &str) {
        self.outbox.expect_reply();
        match decode(text) {
            Err(unread) => {
                let (id, problem) = *unread;
                refuse(&self.outbox, id, problem);
            }
            Ok(request) => {
                let id = request.id;
                if text.len() > LONG_BYTES {
                    self.outbox.note_long(id, text.len());
                }
                let outbox = self.outbox.clone();
                guarded(&outbox, id, || self.dispatch(id, request.call));
            }
        }
    }

    fn refuse_binary(&self) {
        self.outbox.expect_reply();
        let problem = Problem::new("request", "it is not text", "send JSON as the protocol has it");
        refuse(&self.outbox, 0, problem);
    }

    /// Passes a request on; returns the answer to one that is not answered elsewhere.
    fn dispatch(&mut self, id: u32, call: Call) -> Option<Result<Answer, Problem>> {
        match call {
            Call::Files { folder } => {
                let means = self.house.means.clone();
                self.aside(id, move || {
                    let entries = means.files.list(folder.as_deref(), means.worlds)?;
                    Ok(Answer::Files { entries })
                });
                None
            }
            Call::Runs { folder } => {
                let means = self.house.means.clone();
                self.aside(id, move || runs(&means.files.find(&folder)?));
                None
            }
            Call::Open { what, seed } => self.open(id, what, seed).err().map(Err),
            Call::Close { session } => {
                let closed = self.sessions.remove(&session).ok_or_else(ended);
                self.outbox.clear(session);
                Some(closed.map(|_| Answer::Done))
            }
            Call::Check { session, text } => self.on_text(id, session, move |means, source| {
                Ok(Answer::Problems { problems: checked(means, source, text)? })
            }),
            Call::Edit { session, text, edits } => {
                self.on_text(id, session, move |means, source| edited(means, source, text, edits))
            }
            Call::Model { session, text } => {
                self.on_text(id, session, move |means, source| model(means, source, text))
            }
            Call::Schema { world } => {
                let worlds = self.house.means.worlds;
                self.aside(id, move || schema(worlds, &world));
                None
            }
            call => {
                let session = call.session().and_then(|session| self.sessions.get(&session));
                let Some(session) = session else { return Some(Err(ended())) };
                session.order(id, call).err().map(Err)
            }
        }
    }

    fn open(&mut self, id: u32, what: Subject, seed: Option<u64>) -> Result<(), Problem> {
        self.sessions.retain(|_, session| !session.is_finished());
        if self.sessions.len() == MOST_SESSIONS {
            let cause = format!("this page has {MOST_SESSIONS} sessions already");
            return Err(Problem::new("open", cause, "close one first"));
        }
        let (session, place) = self.house.admit()?;
        let opening = Opening { session, id, what, seed };
        let (means, outbox) = (self.house.means.clone(), self.outbox.clone());
        let started = Session::start(means, opening, outbox, place);
        let started = started.map_err(|e| {
            let cause = format!("no thread can be started: {e}");
            Problem::new("open", cause, "close other sessions or programs")
        })?;
        self.sessions.insert(session, started);
        Ok(())
    }

    /// Answers a request on a text that stands for a session's scenario.
    fn on_text(
        &self,
        id: u32,
        session: SessionId,
        work: impl FnOnce(&Means, &Source) -> Result<Answer, Problem> + Send + 'static,
    ) -> Option<Result<Answer, Problem>> {
        let Some(source) = self.sessions.get(&session).and_then(Session::source) else {
            return Some(Err(ended()));
        };
        let means = self.house.means.clone();
        self.aside(id, move || work(&means, &source));
        None
    }

    /// Answers a request in another thread, one after the other, because it may read files.
    fn aside(&self, id: u32, work: impl FnOnce() -> Result<Answer, Problem> + Send + 'static) {
        let (outbox, aside) = (self.outbox.clone(), self.aside.clone());
        tokio::spawn(async move {
            let Ok(_turn) = aside.acquire().await else { return };
            // It cannot panic: its work is guarded.
            let _ = spawn_blocking(move || guarded(&outbox, id, || Some(work()))).await;
        });
    }
}

/// Returns the schema of a world's scenarios.
///
/// # Errors
/// When there is no such world.
fn schema(worlds: Worlds, world: &str) -> Result<Answer, Problem> {
    let schema = worlds.schema(Some(world)).ok_or_else(|| {
        let names = worlds.names().join(", ");
        Problem::new(world, "no such world is known", format!("name one of {names}"))
    })?;
    Ok(Answer::Schema { schema })
}

/// Answers a request with the result of `work`, if there is one, and with a problem if it panics.
fn guarded(outbox: &Outbox, id: u32, work: impl FnOnce() -> Option<Result<Answer, Problem>>) {
    let done = catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| {
        let cause = "this is a bug in sidestep";
        Some(Err(Problem::new("request", cause, "please report it with the request")))
    });
    match done {
        Some(Ok(answer)) => outbox.reply(&Reply { id, result: Outcome::Answer(answer) }),
        Some(Err(problem)) => refuse(outbox, id, problem),
        None => {}
    }
}

fn refuse(outbox: &Outbox, id: u32, problem: Problem) {
    outbox.reply(&Reply { id, result: Outcome::Problem(problem) });
}
