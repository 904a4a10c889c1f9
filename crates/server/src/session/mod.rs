//! Sessions: each is a thread of its own that owns a run, and takes requests by a channel.
//!
//! Nothing that comes from a socket waits for another socket, and no result depends on one: the thread alone controls
//! the computation, and its views go to an [`Outbox`], which never makes it wait.

mod edit;
mod inspect;
mod memory;
mod pace;
mod player;
mod save;
mod scout;
mod showing;
mod stage;
mod viewer;
mod watching;

pub(crate) use edit::{edited, model};
pub(crate) use showing::Showcase;
pub(crate) use stage::{Means, checked, stopped};

use crate::outbox::Outbox;
use crate::protocol::{Call, Outcome, Problem, Reply, SessionId, Subject};
use player::Player;
use save::Shown;
use sidestep::kernel::Interrupt;
use sidestep::scenario::Source;
use stage::Stage;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;
use watching::Watching;

/// The largest number of requests that wait for a session.
const MOST_WAITING: usize = 256;
/// The longest wait for a request, after which the thread looks around again.
const LONGEST_WAIT: Duration = Duration::from_secs(5);

/// The first request of a session.
pub(crate) struct Opening {
    /// The session's number.
    pub(crate) session: SessionId,
    /// The request.
    pub(crate) id: u32,
    /// The thing to open.
    pub(crate) what: Subject,
    /// Another seed than the scenario's.
    pub(crate) seed: Option<u64>,
}

/// A session, from the side of a socket. It ends when this is dropped.
pub(crate) struct Session {
    orders: SyncSender<(u32, Call)>,
    interrupt: Interrupt,
    thread: JoinHandle<()>,
    shown: Shown,
}

impl Session {
    /// Starts a session, which answers the request that opens it; `ticket` is dropped when it has ended.
    ///
    /// # Errors
    /// When the system has no threads left.
    pub(crate) fn start(
        means: Means,
        opening: Opening,
        outbox: Arc<Outbox>,
        ticket: impl Send + 'static,
    ) -> std::io::Result<Self> {
        let (orders, taken) = sync_channel(MOST_WAITING);
        let interrupt = Interrupt::default();
        let shown = Shown::default();
        let (heeded, told) = (interrupt.clone(), shown.clone());
        let thread =
            Builder::new().name(format!("session-{}", opening.session)).spawn(move || {
                let _ticket = ticket;
                let desk = Desk { outbox, interrupt: heeded, orders: taken };
                desk.work(means, opening, told);
            })?;
        Ok(Self { orders, interrupt, thread, shown })
    }

    /// Passes a request on; it is answered by the session.
    ///
    /// # Errors
    /// When too many wait, or the session has ended.
    pub(crate) fn order(&self, id: u32, call: Call) -> Result<(), Problem> {
        self.orders.try_send((id, call)).map_err(|error| match error {
            TrySendError::Full(_) => {
                Problem::new("session", "too many requests wait for it", "ask less often")
            }
            TrySendError::Disconnected(_) => ended(),
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
pub(crate) fn ended() -> Problem {
    Problem::new("session", "there is no such session, or it has ended", "open it again")
}

/// The place of a session's thread.
struct Desk {
    outbox: Arc<Outbox>,
    interrupt: Interrupt,
    orders: Receiver<(u32, Call)>,
}

/// The reason why work was not done to its end.
enum Broken {
    /// It was interrupted, because it is no longer wanted.
    Unwanted,
    /// A bug, in words.
    Bug(String),
}

impl Desk {
    /// Opens the requested thing and plays it, until the socket drops it or a bug ends it.
    fn work(self, means: Means, opening: Opening, shown: Shown) {
        let Opening { session, id, what, seed } = opening;
        if let Subject::Fleet { path } = &what {
            match means.screen(path) {
                Ok(screen) => Watching::new(session, self.outbox.clone(), screen).work(&self, id),
                Err(problem) => return self.refuse(id, problem),
            }
            return self.close();
        }
        let opened = self.guarded(|| {
            let stage = Stage::open(means, &what, seed)?.shown_by(shown);
            let (outbox, interrupt) = (self.outbox.clone(), self.interrupt.clone());
            Player::new(session, outbox, interrupt, stage)
        });
        let mut player = match opened {
            Ok(Ok(player)) => player,
            Ok(Err(problem)) => return self.refuse(id, problem),
            Err(Broken::Bug(words)) => return self.refuse(id, bug(&words)),
            Err(Broken::Unwanted) => return self.refuse(id, ended()),
        };
        let result = Outcome::Answer(player.opened());
        self.outbox.reply(&Reply { id, result });
        match self.guarded(|| self.play(&mut player)) {
            Ok(()) | Err(Broken::Unwanted) => player.give_up("the session was closed"),
            Err(Broken::Bug(words)) => player.fail(bug(&words)),
        }
        self.close();
    }

    /// Refuses requests that came after the end.
    fn close(&self) {
        while let Ok((id, _)) = self.orders.try_recv() {
            self.refuse(id, ended());
        }
    }

    fn play(&self, player: &mut Player) {
        loop {
            let wait = player.turn().unwrap_or(LONGEST_WAIT);
            match self.orders.recv_timeout(wait) {
                Ok((id, call)) => player.take(id, call),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            while let Ok((id, call)) = self.orders.try_recv() {
                player.take(id, call);
            }
        }
    }

    fn refuse(&self, id: u32, problem: Problem) {
        self.outbox.reply(&Reply { id, result: Outcome::Problem(problem) });
    }

    fn guarded<T>(&self, work: impl FnOnce() -> T) -> Result<T, Broken> {
        catch_unwind(AssertUnwindSafe(work)).map_err(|payload| {
            match self.interrupt.explains(payload.as_ref()) {
                true => Broken::Unwanted,
                false => Broken::Bug(words(payload.as_ref())),
            }
        })
    }
}

/// Returns the message of a panic.
fn words(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default()
}

fn bug(words: &str) -> Problem {
    let remedy = "please report it with the scenario; the other sessions go on";
    Problem::new("session", format!("this is a bug in sidestep: {words}"), remedy)
}

#[cfg(test)]
mod tests;
