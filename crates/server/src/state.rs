//! The state that all sockets of a server share.

use crate::access::AccessPolicy;
use crate::protocol::{Problem, ServerNotification, SessionId, TargetRef, VERSION};
use crate::results::JobQueue;
use crate::serve::wait_for_shutdown;
use crate::session::SessionDeps;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

/// Maximum number of sessions at a time, of all sockets: each has worker threads, and a run in memory.
const MAX_SESSIONS: u32 = 12;
/// Maximum number of sockets at a time; each is a page.
const MAX_SOCKETS: usize = 16;
/// Number of threads for blocking work: one for each socket, and some for results.
pub(crate) const MAX_BLOCKING_THREADS: usize = MAX_SOCKETS + 4;
/// The time that sessions have to end with the server.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(2);

/// The state that all sockets share.
pub(crate) struct AppState {
    /// What sessions depend on, which all share.
    pub(crate) deps: SessionDeps,
    pub(crate) access: AccessPolicy,
    pub(crate) jobs: JobQueue,
    program: String,
    open: Vec<TargetRef>,
    next_session: AtomicU32,
    sessions: Arc<Semaphore>,
    sockets: Arc<Semaphore>,
    shutdown: watch::Receiver<bool>,
}

impl AppState {
    pub(crate) fn new(
        deps: SessionDeps,
        access: AccessPolicy,
        program: String,
        open: Vec<TargetRef>,
        shutdown: watch::Receiver<bool>,
    ) -> Self {
        Self {
            deps,
            access,
            jobs: JobQueue::default(),
            program,
            open,
            next_session: AtomicU32::new(1),
            sessions: Arc::new(Semaphore::new(MAX_SESSIONS as usize)),
            sockets: Arc::new(Semaphore::new(MAX_SOCKETS)),
            shutdown,
        }
    }

    /// Returns the first notice for a page: version, worlds, and what the command line asked to open.
    pub(crate) fn hello_notification(&self) -> ServerNotification {
        ServerNotification::Hello {
            version: VERSION,
            program: self.program.clone(),
            worlds: self.deps.worlds.names().into_iter().map(String::from).collect(),
            read_only: self.deps.read_only,
            open: self.open.clone(),
        }
    }

    /// Returns the number of a new session, and its permit.
    ///
    /// # Errors
    /// When there are too many.
    pub(crate) fn acquire_session(&self) -> Result<(SessionId, OwnedSemaphorePermit), Problem> {
        let permit = self.sessions.clone().try_acquire_owned().map_err(|_| {
            let cause = format!("there are {MAX_SESSIONS} sessions already");
            Problem::new("open", cause, "close one first, here or in another window")
        })?;
        Ok((self.next_session.fetch_add(1, Ordering::Relaxed), permit))
    }

    /// Returns the number of open sessions, and its bound.
    pub(crate) fn session_count(&self) -> (u32, u32) {
        let free = self.sessions.available_permits() as u32;
        (MAX_SESSIONS - free.min(MAX_SESSIONS), MAX_SESSIONS)
    }

    /// Returns the permit of a new socket; `None` if there are too many.
    pub(crate) fn acquire_socket(&self) -> Option<OwnedSemaphorePermit> {
        self.sockets.clone().try_acquire_owned().ok()
    }

    /// Returns whether no further socket is accepted now.
    pub(crate) fn is_socket_limit_reached(&self) -> bool {
        self.sockets.available_permits() == 0
    }

    /// Returns the receiver that signals the end of the server.
    pub(crate) fn shutdown_receiver(&self) -> watch::Receiver<bool> {
        self.shutdown.clone()
    }

    /// Waits until the server ends.
    pub(crate) async fn wait_for_shutdown(&self) {
        wait_for_shutdown(self.shutdown_receiver()).await;
    }

    /// Waits until all sessions have ended, but not forever.
    pub(crate) async fn wait_for_sessions(&self) {
        let all = self.sessions.acquire_many(MAX_SESSIONS);
        let _ = tokio::time::timeout(SHUTDOWN_TIMEOUT, all).await;
    }
}
