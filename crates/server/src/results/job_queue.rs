//! Work for a browser that waits for it: one piece at a time, and none for a browser that is gone.

use super::ResultError;
use crate::protocol::Problem;
use axum::http::StatusCode;
use sidestep_kernel::Interrupt;
use sidestep_report::RenderedReport;
use sidestep_session::{Error, Watcher};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;

/// The place where results are made.
pub(crate) struct JobQueue {
    turn: Semaphore,
    /// The report that was made last, because its figures are asked for next.
    last: Mutex<Option<(PathBuf, Arc<RenderedReport>)>>,
}

impl Default for JobQueue {
    fn default() -> Self {
        Self { turn: Semaphore::new(1), last: Mutex::default() }
    }
}

/// A browser that waits, as the work sees it.
#[derive(Clone, Default)]
pub(super) struct CancelToken {
    is_gone: Arc<AtomicBool>,
    interrupt: Interrupt,
}

impl CancelToken {
    /// Returns whether it is gone.
    pub(super) fn is_cancelled(&self) -> bool {
        self.is_gone.load(Relaxed)
    }

    /// Notes that it no longer wants the work.
    pub(super) fn cancel(&self) {
        self.is_gone.store(true, Relaxed);
        self.interrupt.raise();
    }
}

impl Watcher for CancelToken {
    fn should_continue(&self) -> bool {
        !self.is_cancelled()
    }

    fn interrupt(&self) -> Interrupt {
        self.interrupt.clone()
    }
}

/// A guard that tells the work that its browser no longer waits.
struct CancelOnDrop(CancelToken);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

impl JobQueue {
    /// Does a piece of work in its turn, for as long as the future is awaited.
    ///
    /// # Errors
    /// Those of the work; a bug in it.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce(&CancelToken) -> Result<T, ResultError> + Send + 'static,
    ) -> Result<T, ResultError> {
        let bug = || {
            let problem = Problem::new("result", "this is a bug in sidestep", "please report it");
            ResultError::new(StatusCode::INTERNAL_SERVER_ERROR, problem)
        };
        // The semaphore is never closed.
        let _turn = self.turn.acquire().await.map_err(|_| bug())?;
        let leaves = CancelOnDrop(CancelToken::default());
        let client = leaves.0.clone();
        let done = spawn_blocking(move || catch_unwind(AssertUnwindSafe(|| work(&client)))).await;
        done.map_err(|_| bug())?.map_err(|_| bug())?
    }

    /// Keeps a report.
    pub(super) fn cache_report(&self, path: PathBuf, rendered: Arc<RenderedReport>) {
        *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Some((path, rendered));
    }

    /// Returns the report of a folder, if it is the one that was made last.
    pub(super) fn cached_report(&self, path: &PathBuf) -> Option<Arc<RenderedReport>> {
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        last.as_ref().filter(|(of, _)| of == path).map(|(_, rendered)| rendered.clone())
    }
}

/// Returns an error of the work as an answer.
pub(super) fn result_error(error: &Error) -> ResultError {
    crate::session::problem_of(error).into()
}
