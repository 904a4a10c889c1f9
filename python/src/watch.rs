//! Ctrl-C: between two slices of a run, or while work goes on in other threads, Python is asked for signals.

use pyo3::prelude::*;
use sidestep::kernel::Interrupt;
use sidestep_session::{Error, Watcher};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// Time after which a run is handed back, so that Python can be asked for signals: a fraction of what anybody notices.
const A_WHILE: Duration = Duration::from_millis(50);

/// A watcher that stops a run between two cycles after a while. It asks Python nothing: whoever drives the run holds
/// its lock, and a handler of a signal may want that.
#[derive(Debug, Default)]
pub(crate) struct ForAWhile(OnceLock<Instant>);

impl Watcher for ForAWhile {
    fn go_on(&self) -> bool {
        // It is asked before the first cycle, too, which so is done in any case.
        self.0.get_or_init(Instant::now).elapsed() < A_WHILE
    }
}

/// A watcher that stops work when Python has a signal to handle. Whoever uses it holds no lock that a handler may want.
#[derive(Debug, Default)]
pub(crate) struct Signals(Mutex<Option<PyErr>>);

impl Signals {
    /// Returns the exception of the signal, if there was one.
    pub(crate) fn into_result(self) -> PyResult<()> {
        let raised = self.0.into_inner().unwrap_or_else(PoisonError::into_inner);
        raised.map_or(Ok(()), Err)
    }
}

impl Watcher for Signals {
    fn go_on(&self) -> bool {
        // Python tells of a signal once.
        let mut raised = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if raised.is_none() {
            *raised = Python::attach(|py| py.check_signals()).err();
        }
        raised.is_none()
    }

    fn warn(&self, error: &Error) {
        Python::attach(|py| {
            let text = std::ffi::CString::new(error.to_string()).unwrap_or_default();
            let category = py.get_type::<pyo3::exceptions::PyRuntimeWarning>();
            // A warning that is turned into an exception stops nothing here.
            let _ = PyErr::warn(py, &category, &text, 1);
        });
    }
}

/// A watcher of work in other threads, which hear of no signals: the calling one looks for them.
#[derive(Debug, Default)]
struct Attended {
    signals: Signals,
    is_over: AtomicBool,
    interrupt: Interrupt,
}

impl Attended {
    /// Asks Python for signals; the first stops the work at once, also within a cycle: what is half done is not kept.
    fn look(&self) {
        if !self.signals.go_on() {
            self.is_over.store(true, Ordering::Relaxed);
            self.interrupt.raise();
        }
    }
}

impl Watcher for Attended {
    fn go_on(&self) -> bool {
        !self.is_over.load(Ordering::Relaxed)
    }

    fn warn(&self, error: &Error) {
        self.signals.warn(error);
    }

    fn interrupt(&self) -> Interrupt {
        self.interrupt.clone()
    }
}

/// Does work that heeds an interrupt; `None` if that was raised.
pub(crate) fn heeding<T>(interrupt: &Interrupt, work: impl FnOnce() -> T) -> Option<T> {
    let heeded = || {
        let _heeded = interrupt.heeded_here();
        work()
    };
    match catch_unwind(AssertUnwindSafe(heeded)) {
        Ok(done) => Some(done),
        Err(payload) if interrupt.explains(payload.as_ref()) => None,
        Err(payload) => resume_unwind(payload),
    }
}

/// Does work on another thread that heeds an interrupt, while this one waits without Python's lock and looks for
/// signals.
///
/// # Errors
/// The exception of a signal.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    let done = attended(py, |watcher| heeding(&watcher.interrupt(), work))?;
    Ok(done.expect("only a signal interrupts it, and that has raised its exception"))
}

/// Does work in other threads, while this one waits without Python's lock and looks for signals.
///
/// # Errors
/// The exception of a signal.
pub(crate) fn attended<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&dyn Watcher) -> T + Send,
) -> PyResult<T> {
    let watcher = Attended::default();
    let done = py.detach(|| sidestep_session::attended(|| work(&watcher), || watcher.look()));
    watcher.signals.into_result().map(|()| done)
}
