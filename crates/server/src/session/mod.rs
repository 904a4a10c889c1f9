//! Sessions: each is a thread of its own that owns a run, and takes requests by a channel.
//!
//! No socket waits for another one, and no result depends on any: the session's thread alone controls the computation, and
//! its frames go to an [`Outbox`], which never makes it wait.

mod ahead_run;
mod edit;
mod fleet_session;
mod foxglove;
mod history;
mod inspect;
mod open_run;
mod pace;
mod page_publisher;
mod player;
mod save;

pub(crate) use edit::{apply_edits, text_values_reply};
pub(crate) use foxglove::FoxgloveHost;
pub(crate) use open_run::{SessionDeps, problem_of, text_problems};

use crate::outbox::Outbox;
use crate::protocol::{OpenTarget, Problem, Reply, ReplyResult, RunMethod, SessionId};
use fleet_session::FleetSession;
use open_run::OpenRun;
use player::Player;
use save::SharedScenarioText;
use sidestep_kernel::Interrupt;
use sidestep_scenario::Source;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

/// Maximum number of requests that wait for a session; a socket has no more than 64 open, so it is never reached by
/// one.
const MAX_QUEUED_REQUESTS: usize = 256;
/// Maximum wait for a request. It is a safeguard: a request wakes the thread, and so does the time of the next work.
const MAX_WAIT: Duration = Duration::from_secs(5);

/// The request that opens a session: it is answered by the session's thread, because opening may take seconds.
pub(crate) struct OpenRequest {
    pub(crate) session: SessionId,
    /// The number of the request, which the answer repeats.
    pub(crate) id: u32,
    pub(crate) target: OpenTarget,
    /// Another seed than the scenario's.
    pub(crate) seed: Option<u64>,
}

/// A session, as its socket holds it. It ends when this is dropped.
pub(crate) struct Session {
    requests: SyncSender<(u32, RunMethod)>,
    interrupt: Interrupt,
    thread: JoinHandle<()>,
    source: SharedScenarioText,
}

impl Session {
    /// Starts a session, which answers the request that opens it; `permit` is dropped when it has ended.
    ///
    /// # Errors
    /// When the system has no threads left.
    pub(crate) fn start(
        deps: SessionDeps,
        request: OpenRequest,
        outbox: Arc<Outbox>,
        permit: impl Send + 'static,
    ) -> std::io::Result<Self> {
        let (sender, receiver) = sync_channel(MAX_QUEUED_REQUESTS);
        let interrupt = Interrupt::default();
        let source = SharedScenarioText::default();
        let worker = SessionWorker { outbox, interrupt: interrupt.clone(), requests: receiver };
        let worker_source = source.clone();
        let thread =
            Builder::new().name(format!("session-{}", request.session)).spawn(move || {
                let _permit = permit;
                worker.run(deps, request, worker_source);
            })?;
        Ok(Self { requests: sender, interrupt, thread, source })
    }

    /// Passes a request on; it is answered by the session.
    ///
    /// # Errors
    /// When too many wait, or the session has ended.
    pub(crate) fn send_request(&self, id: u32, call: RunMethod) -> Result<(), Problem> {
        self.requests.try_send((id, call)).map_err(|error| match error {
            TrySendError::Full(_) => {
                Problem::new("session", "too many requests wait for it", "ask less often")
            }
            TrySendError::Disconnected(_) => no_such_session(),
        })
    }

    /// Returns its scenario, once it is open: in the file in which it was saved last.
    pub(crate) fn scenario_source(&self) -> Option<Source> {
        self.source.get()
    }

    /// Returns whether its thread has ended by itself, for instance by a bug.
    pub(crate) fn is_finished(&self) -> bool {
        self.thread.is_finished()
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        // The cycle in progress is abandoned: nobody will see its result.
        self.interrupt.raise();
    }
}

/// Returns the problem of a request for a session that does not exist, or no longer.
pub(crate) fn no_such_session() -> Problem {
    Problem::new("session", "there is no such session, or it has ended", "open it again")
}

/// The thread of a session.
struct SessionWorker {
    outbox: Arc<Outbox>,
    interrupt: Interrupt,
    requests: Receiver<(u32, RunMethod)>,
}

/// The reason why a session's work unwound.
enum SessionExit {
    /// It was interrupted, because the socket has dropped the session.
    Interrupted,
    /// A bug: the message of the panic.
    Bug(String),
}

impl SessionWorker {
    /// Opens the target and serves it, until the socket drops the session or it ends by itself.
    fn run(self, deps: SessionDeps, request: OpenRequest, source: SharedScenarioText) {
        let OpenRequest { session, id, target, seed } = request;
        match target {
            OpenTarget::Scenario { path } => {
                self.run_player(session, id, source, || OpenRun::from_file(deps, &path, seed));
            }
            OpenTarget::New { world } => {
                self.run_player(session, id, source, || {
                    OpenRun::from_default_scenario(deps, &world, seed)
                });
            }
            OpenTarget::Shipped { name } => {
                self.run_player(session, id, source, || OpenRun::from_shipped(deps, &name, seed));
            }
            OpenTarget::Recording { path } => {
                self.run_player(session, id, source, || OpenRun::from_recording(deps, &path, seed));
            }
            OpenTarget::Fleet { path } => match deps.fleet_feed(&path) {
                Ok(feed) => {
                    let usage = deps.usage.add(session);
                    FleetSession::new(session, self.outbox.clone(), feed, usage).run(&self, id);
                }
                Err(problem) => self.refuse(id, problem),
            },
        }
        self.refuse_queued();
    }

    /// Opens a run and plays it; `id` is the number of the request that opens it.
    fn run_player(
        &self,
        session: SessionId,
        id: u32,
        source: SharedScenarioText,
        open: impl FnOnce() -> Result<OpenRun, Problem>,
    ) {
        let opened = self.catch_panic(|| {
            let open_run = open()?.with_shared_source(source);
            Player::new(session, self.outbox.clone(), self.interrupt.clone(), open_run)
        });
        let mut player = match opened {
            Ok(Ok(player)) => player,
            Ok(Err(problem)) => return self.refuse(id, problem),
            Err(SessionExit::Bug(message)) => return self.refuse(id, internal_error(&message)),
            Err(SessionExit::Interrupted) => return self.refuse(id, no_such_session()),
        };
        let result = ReplyResult::Answer(player.opened_reply());
        self.outbox.send_reply(&Reply { id, result });
        match self.catch_panic(|| self.play_until_closed(&mut player)) {
            Ok(()) | Err(SessionExit::Interrupted) => player.cancel_seek("the session was closed"),
            Err(SessionExit::Bug(message)) => player.fail(internal_error(&message)),
        }
    }

    /// Refuses the requests in the queue of a session that has ended: each request gets a reply.
    fn refuse_queued(&self) {
        while let Ok((id, _)) = self.requests.try_recv() {
            self.refuse(id, no_such_session());
        }
    }

    fn play_until_closed(&self, player: &mut Player) {
        loop {
            let wait = player.run_due_work().unwrap_or(MAX_WAIT);
            match self.requests.recv_timeout(wait) {
                Ok((id, call)) => player.on_request(id, call),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            while let Ok((id, call)) = self.requests.try_recv() {
                player.on_request(id, call);
            }
        }
    }

    fn refuse(&self, id: u32, problem: Problem) {
        self.outbox.send_reply(&Reply { id, result: ReplyResult::Problem(problem) });
    }

    fn catch_panic<T>(&self, work: impl FnOnce() -> T) -> Result<T, SessionExit> {
        catch_unwind(AssertUnwindSafe(work)).map_err(|payload| {
            if self.interrupt.has_caused_unwind(payload.as_ref()) {
                SessionExit::Interrupted
            } else {
                SessionExit::Bug(panic_message(payload.as_ref()))
            }
        })
    }
}

/// Returns the message of a panic; it is text unless a library panicked with a value of its own.
fn panic_message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default()
}

fn internal_error(message: &str) -> Problem {
    let remedy = "please report it with the scenario; the other sessions continue";
    Problem::new("session", format!("internal error (a bug in Sidestep): {message}"), remedy)
}

#[cfg(test)]
mod tests;
