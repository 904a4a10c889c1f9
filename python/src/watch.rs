//! Ctrl-C: between two slices of a run, or while other threads work, Python is checked for signals.

use pyo3::prelude::*;
use sidestep::kernel::Interrupt;
use sidestep_session::{Error, Progress, Watcher};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// Time after which a run is handed back, so that Python can be checked for signals: too short for users to notice.
const TIME_SLICE: Duration = Duration::from_millis(50);

/// A watcher that stops a run between two cycles after [`TIME_SLICE`]. It does not call Python: the thread that advances the
/// run holds the run's lock, which a signal handler in Python may need.
#[derive(Debug, Default)]
pub(crate) struct TimeSlice(OnceLock<Instant>);

impl Watcher for TimeSlice {
    fn should_continue(&self) -> bool {
        // It is also asked before the first cycle, which is therefore done in any case.
        self.0.get_or_init(Instant::now).elapsed() < TIME_SLICE
    }
}

/// A `sidestep._progress.Reporter`, which is called with the units that are done and with all.
#[derive(Debug)]
pub(crate) struct ProgressReporter(Py<PyAny>);

impl ProgressReporter {
    /// Returns what an argument `progress` asks for; none for nothing.
    ///
    /// # Errors
    /// When it is neither a function nor a truth value, or bars cannot be shown.
    pub(crate) fn from_argument(
        progress: Option<&Bound<'_, PyAny>>,
        unit: &str,
    ) -> PyResult<Option<Self>> {
        let Some(progress) = progress else { return Ok(None) };
        let module = progress.py().import("sidestep._progress")?;
        let reporter = module.getattr("reporter")?.call1((progress, unit))?;
        Ok((!reporter.is_none()).then(|| Self(reporter.unbind())))
    }

    pub(crate) fn report(&self, py: Python<'_>, done: u64, of: u64) -> PyResult<()> {
        self.0.call1(py, (done, of)).map(drop)
    }

    /// Ends a bar.
    pub(crate) fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.0.call_method0(py, "close").map(drop)
    }
}

/// A watcher that stops work when Python has a signal to handle. Its user must hold no lock that a handler may need.
#[derive(Debug, Default)]
pub(crate) struct SignalWatcher<'a> {
    raised: Mutex<Option<PyErr>>,
    reporter: Option<&'a ProgressReporter>,
}

impl<'a> SignalWatcher<'a> {
    /// Creates one that also reports how many runs are done.
    pub(crate) fn new(reporter: Option<&'a ProgressReporter>) -> Self {
        Self { reporter, ..Self::default() }
    }

    /// Returns the exception of the signal, if there was one.
    pub(crate) fn into_result(self) -> PyResult<()> {
        let raised = self.raised.into_inner().unwrap_or_else(PoisonError::into_inner);
        raised.map_or(Ok(()), Err)
    }

    fn report(&self, done: u64, of: u64) {
        let Some(reporter) = self.reporter else { return };
        // An exception of the function ends the work, like that of a signal.
        let mut raised = self.raised.lock().unwrap_or_else(PoisonError::into_inner);
        if raised.is_none() {
            *raised = Python::attach(|py| reporter.report(py, done, of)).err();
        }
    }
}

impl Watcher for SignalWatcher<'_> {
    fn on_progress(&self, progress: Progress<'_>) {
        if let Progress::Runs { done, of, .. } = progress {
            self.report(done, of);
        }
    }

    fn should_continue(&self) -> bool {
        // Python reports a signal once, so the exception is kept.
        let mut raised = self.raised.lock().unwrap_or_else(PoisonError::into_inner);
        if raised.is_none() {
            *raised = Python::attach(|py| py.check_signals()).err();
        }
        raised.is_none()
    }

    fn warn(&self, error: &Error) {
        Python::attach(|py| {
            let text = std::ffi::CString::new(error.to_string()).unwrap_or_default();
            let category = py.get_type::<pyo3::exceptions::PyRuntimeWarning>();
            // A warning turned into an exception stops nothing here.
            let _ = PyErr::warn(py, &category, &text, 1);
        });
    }
}

/// A watcher of work in other threads: Python handles signals on the main thread only, so the calling thread checks for
/// them.
#[derive(Debug, Default)]
struct PolledWatcher<'a> {
    signals: SignalWatcher<'a>,
    /// Units of the work that are done and all, such as runs, which the calling thread has not reported yet.
    units: Mutex<Option<(u64, u64)>>,
    is_over: AtomicBool,
    interrupt: Interrupt,
}

impl PolledWatcher<'_> {
    /// Notes how many units of the work are done.
    fn note(&self, done: u64, of: u64) {
        *self.units.lock().unwrap_or_else(PoisonError::into_inner) = Some((done, of));
    }

    /// Reports the progress since the last report.
    fn report(&self) {
        let units = self.units.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some((done, of)) = units {
            self.signals.report(done, of);
        }
    }

    /// Checks Python for signals; the first stops the work at once, even within a cycle: a half-done cycle is not
    /// kept.
    fn check_signals(&self) {
        if !self.signals.should_continue() {
            self.is_over.store(true, Ordering::Relaxed);
            self.interrupt.raise();
        }
    }
}

impl Watcher for PolledWatcher<'_> {
    fn on_progress(&self, progress: Progress<'_>) {
        if let Progress::Runs { done, of, .. } = progress {
            self.note(done, of);
        }
    }

    fn should_continue(&self) -> bool {
        !self.is_over.load(Ordering::Relaxed)
    }

    fn warn(&self, error: &Error) {
        self.signals.warn(error);
    }

    fn interrupt(&self) -> Interrupt {
        self.interrupt.clone()
    }
}

/// Does work that an interrupt can stop; returns `None` if it did.
pub(crate) fn catch_interrupt<T>(interrupt: &Interrupt, work: impl FnOnce() -> T) -> Option<T> {
    let result = catch_unwind(AssertUnwindSafe(|| {
        let _attached = interrupt.attach();
        work()
    }));
    match result {
        Ok(done) => Some(done),
        Err(payload) if interrupt.has_caused_unwind(payload.as_ref()) => None,
        Err(payload) => resume_unwind(payload),
    }
}

/// Does work on another thread that an interrupt can stop, while this one waits without Python's lock and checks for
/// signals.
///
/// # Errors
/// The exception of a signal.
pub(crate) fn run_interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    let done = run_polling(py, |watcher| catch_interrupt(&watcher.interrupt(), work))?;
    Ok(done.expect("only a signal interrupts it, and that has raised its exception"))
}

/// Does work in other threads, while this one waits without Python's lock and checks for signals.
///
/// # Errors
/// The exception of a signal.
pub(crate) fn run_polling<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&dyn Watcher) -> T + Send,
) -> PyResult<T> {
    run_reporting(py, None, work)
}

/// Does work in other threads, as [`run_polling`], and reports how many runs are done.
///
/// # Errors
/// The exception of a signal, or of the function that is told.
pub(crate) fn run_reporting<T: Send>(
    py: Python<'_>,
    reporter: Option<&ProgressReporter>,
    work: impl FnOnce(&dyn Watcher) -> T + Send,
) -> PyResult<T> {
    run_watched(py, reporter, |watcher| work(watcher))
}

/// Does work in another thread that tells how many of its units are done, such as rows, and ends when it is answered false.
///
/// # Errors
/// The exception of a signal, or of the function that is told.
pub(crate) fn run_counting<T: Send>(
    py: Python<'_>,
    reporter: Option<&ProgressReporter>,
    work: impl FnOnce(&(dyn Fn(u64, u64) -> bool + Sync)) -> T + Send,
) -> PyResult<T> {
    run_watched(py, reporter, |watcher| {
        work(&|done, of| {
            watcher.note(done, of);
            watcher.should_continue()
        })
    })
}

fn run_watched<T: Send>(
    py: Python<'_>,
    reporter: Option<&ProgressReporter>,
    work: impl FnOnce(&PolledWatcher<'_>) -> T + Send,
) -> PyResult<T> {
    let signals = SignalWatcher::new(reporter);
    let watcher = PolledWatcher { signals, ..PolledWatcher::default() };
    let poll = || {
        watcher.report();
        watcher.check_signals();
    };
    let done = py.detach(|| sidestep_session::run_polling(|| work(&watcher), poll));
    watcher.report();
    watcher.signals.into_result().map(|()| done)
}
