//! Sessions: each is a thread of its own that owns a run, and takes requests by a channel.
//!
//! Nothing that comes from a socket waits for another socket, and no result depends on one: the thread alone controls
//! the computation, and its views go to an [`Outbox`], which never makes it wait.

mod edit;
mod fleet_session;
mod foxglove;
mod history;
mod inspect;
mod open_run;
mod pace;
mod page_view;
mod player;
mod prefetcher;
mod save;

pub(crate) use edit::{apply_edits, model};
pub(crate) use foxglove::FoxgloveHost;
pub(crate) use open_run::{SessionDeps, problem_of, text_problems};

use crate::outbox::Outbox;
use crate::protocol::{Method, OpenTarget, Problem, Reply, ReplyResult, SessionId};
use fleet_session::FleetSession;
use open_run::OpenRun;
use player::Player;
use save::SharedSource;
use sidestep_kernel::Interrupt;
use sidestep_scenario::Source;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

/// The largest number of requests that wait for a session.
const MAX_QUEUED_REQUESTS: usize = 256;
/// The longest wait for a request, after which the thread looks around again.
const MAX_WAIT: Duration = Duration::from_secs(5);

/// The first request of a session.
pub(crate) struct OpenRequest {
    /// The session's number.
    pub(crate) session: SessionId,
    /// The request.
    pub(crate) id: u32,
    /// The thing to open.
    pub(crate) what: OpenTarget,
    /// Another seed than the scenario's.
    pub(crate) seed: Option<u64>,
}

/// A session, from the side of a socket. It ends when this is dropped.
pub(crate) struct Session {
    orders: SyncSender<(u32, Method)>,
    interrupt: Interrupt,
    thread: JoinHandle<()>,
    shown: SharedSource,
}

impl Session {
    /// Starts a session, which answers the request that opens it; `ticket` is dropped when it has ended.
    ///
    /// # Errors
    /// When the system has no threads left.
    pub(crate) fn start(
        means: SessionDeps,
        opening: OpenRequest,
        outbox: Arc<Outbox>,
        ticket: impl Send + 'static,
    ) -> std::io::Result<Self> {
        let (orders, taken) = sync_channel(MAX_QUEUED_REQUESTS);
        let interrupt = Interrupt::default();
        let shown = SharedSource::default();
        let (heeded, told) = (interrupt.clone(), shown.clone());
        let thread =
            Builder::new().name(format!("session-{}", opening.session)).spawn(move || {
                let _ticket = ticket;
                let desk = SessionWorker { outbox, interrupt: heeded, orders: taken };
                desk.run(means, opening, told);
            })?;
        Ok(Self { orders, interrupt, thread, shown })
    }

    /// Passes a request on; it is answered by the session.
    ///
    /// # Errors
    /// When too many wait, or the session has ended.
    pub(crate) fn send_request(&self, id: u32, call: Method) -> Result<(), Problem> {
        self.orders.try_send((id, call)).map_err(|error| match error {
            TrySendError::Full(_) => {
                Problem::new("session", "too many requests wait for it", "ask less often")
            }
            TrySendError::Disconnected(_) => no_such_session(),
        })
    }

    /// Returns its scenario, once it is open: in the file in which it was saved last.
    pub(crate) fn source(&self) -> Option<Source> {
        self.shown.source()
    }

    /// Returns whether it has ended.
    pub(crate) fn is_finished(&self) -> bool {
        self.thread.is_finished()
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        // There is no need to wait for the end of its cycle: the result will not be seen.
        self.interrupt.raise();
    }
}

/// Returns the problem of a request for a session that is gone.
pub(crate) fn no_such_session() -> Problem {
    Problem::new("session", "there is no such session, or it has ended", "open it again")
}

/// The place of a session's thread.
struct SessionWorker {
    outbox: Arc<Outbox>,
    interrupt: Interrupt,
    orders: Receiver<(u32, Method)>,
}

/// The reason why work was not done to its end.
enum SessionExit {
    /// It was interrupted, because it is no longer wanted.
    Interrupted,
    /// A bug, in words.
    Bug(String),
}

impl SessionWorker {
    /// Opens the requested thing and plays it, until the socket drops it or a bug ends it.
    fn run(self, means: SessionDeps, opening: OpenRequest, shown: SharedSource) {
        let OpenRequest { session, id, what, seed } = opening;
        if let OpenTarget::Fleet { path } = &what {
            match means.fleet_feed(path) {
                Ok(screen) => {
                    FleetSession::new(session, self.outbox.clone(), screen).run(&self, id)
                }
                Err(problem) => return self.refuse(id, problem),
            }
            return self.refuse_queued();
        }
        let opened = self.catch_panic(|| {
            let stage = OpenRun::open(means, &what, seed)?.with_shared_source(shown);
            let (outbox, interrupt) = (self.outbox.clone(), self.interrupt.clone());
            Player::new(session, outbox, interrupt, stage)
        });
        let mut player = match opened {
            Ok(Ok(player)) => player,
            Ok(Err(problem)) => return self.refuse(id, problem),
            Err(SessionExit::Bug(words)) => return self.refuse(id, internal_error(&words)),
            Err(SessionExit::Interrupted) => return self.refuse(id, no_such_session()),
        };
        let result = ReplyResult::Answer(player.opened_reply());
        self.outbox.send_reply(&Reply { id, result });
        match self.catch_panic(|| self.play(&mut player)) {
            Ok(()) | Err(SessionExit::Interrupted) => player.cancel_seek("the session was closed"),
            Err(SessionExit::Bug(words)) => player.fail(internal_error(&words)),
        }
        self.refuse_queued();
    }

    /// Refuses requests that came after the end.
    fn refuse_queued(&self) {
        while let Ok((id, _)) = self.orders.try_recv() {
            self.refuse(id, no_such_session());
        }
    }

    fn play(&self, player: &mut Player) {
        loop {
            let wait = player.poll().unwrap_or(MAX_WAIT);
            match self.orders.recv_timeout(wait) {
                Ok((id, call)) => player.on_request(id, call),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            while let Ok((id, call)) = self.orders.try_recv() {
                player.on_request(id, call);
            }
        }
    }

    fn refuse(&self, id: u32, problem: Problem) {
        self.outbox.send_reply(&Reply { id, result: ReplyResult::Problem(problem) });
    }

    fn catch_panic<T>(&self, work: impl FnOnce() -> T) -> Result<T, SessionExit> {
        catch_unwind(AssertUnwindSafe(work)).map_err(|payload| {
            match self.interrupt.caused(payload.as_ref()) {
                true => SessionExit::Interrupted,
                false => SessionExit::Bug(panic_message(payload.as_ref())),
            }
        })
    }
}

/// Returns the message of a panic.
fn panic_message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default()
}

fn internal_error(words: &str) -> Problem {
    let remedy = "please report it with the scenario; the other sessions go on";
    Problem::new("session", format!("this is a bug in sidestep: {words}"), remedy)
}

#[cfg(test)]
mod tests;
