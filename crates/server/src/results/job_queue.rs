//! Jobs for browsers that wait for the results: one at a time, and cancelled when the browser disconnects.

use super::HttpError;
use crate::protocol::Problem;
use crate::usage_registry::StoreBytes;
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

/// Maximum size of a report that is kept.
const MAX_REPORT_BYTES: u64 = 64 << 20;

/// The queue of jobs. A report or an export uses all processors, so several at a time would only finish later.
pub(crate) struct JobQueue {
    turn: Semaphore,
    /// The report that was rendered last: the page requests its figures next.
    last_report: Mutex<Option<(PathBuf, Arc<RenderedReport>)>>,
}

impl Default for JobQueue {
    fn default() -> Self {
        Self { turn: Semaphore::new(1), last_report: Mutex::default() }
    }
}

/// A token by which a job learns that its browser has disconnected.
#[derive(Clone, Default)]
pub(super) struct CancelToken {
    is_cancelled: Arc<AtomicBool>,
    interrupt: Interrupt,
}

impl CancelToken {
    pub(super) fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Relaxed)
    }

    /// Asks the job to stop: between its steps, and within a cycle that it computes.
    pub(super) fn cancel(&self) {
        self.is_cancelled.store(true, Relaxed);
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

/// A guard that cancels a job when it is dropped: axum drops the future of a request whose browser has disconnected.
struct CancelOnDrop(CancelToken);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

impl JobQueue {
    /// Runs a job in its turn; it is cancelled when the future is dropped.
    ///
    /// # Errors
    /// Those of the job; a bug in it.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        job: impl FnOnce(&CancelToken) -> Result<T, HttpError> + Send + 'static,
    ) -> Result<T, HttpError> {
        // The semaphore is never closed.
        let _turn = self.turn.acquire().await.map_err(|_| internal_error())?;
        let guard = CancelOnDrop(CancelToken::default());
        let cancel = guard.0.clone();
        let done = spawn_blocking(move || catch_unwind(AssertUnwindSafe(|| job(&cancel)))).await;
        // The outer error is that of a canceled task, the inner one a panic.
        done.map_err(|_| internal_error())?.map_err(|_| internal_error())?
    }

    /// Keeps a report as the last one, unless it is a very large one, which is rendered again for each of its parts.
    pub(super) fn cache_report(&self, path: PathBuf, rendered: Arc<RenderedReport>) {
        if bytes_of(&rendered) > MAX_REPORT_BYTES {
            return;
        }
        *self.last_report.lock().unwrap_or_else(PoisonError::into_inner) = Some((path, rendered));
    }

    /// Returns the bytes of the report that is kept: there is one at most, as large as a page that a browser still shows.
    pub(crate) fn report_bytes(&self) -> StoreBytes {
        let last = self.last_report.lock().unwrap_or_else(PoisonError::into_inner);
        let used = last.as_ref().map_or(0, |(_, report)| bytes_of(report));
        StoreBytes { used, max: MAX_REPORT_BYTES }
    }

    /// Returns the report of a folder, if it is the last one.
    pub(super) fn cached_report(&self, path: &PathBuf) -> Option<Arc<RenderedReport>> {
        let last = self.last_report.lock().unwrap_or_else(PoisonError::into_inner);
        last.as_ref()
            .filter(|(last_path, _)| last_path == path)
            .map(|(_, rendered)| rendered.clone())
    }
}

/// Returns the bytes of the texts of a report.
fn bytes_of(report: &RenderedReport) -> u64 {
    let pictures: usize = report.pictures.iter().map(|picture| picture.svg.len()).sum();
    (report.html.len() + report.markdown.len() + pictures) as u64
}

fn internal_error() -> HttpError {
    let problem = Problem::new("result", "internal error (a bug in Sidestep)", "please report it");
    HttpError::new(StatusCode::INTERNAL_SERVER_ERROR, problem)
}

pub(super) fn to_http_error(error: &Error) -> HttpError {
    crate::session::problem_of(error).into()
}
