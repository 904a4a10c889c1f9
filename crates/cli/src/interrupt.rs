//! Ctrl-C: the first one asks the run to stop in good order, the second one ends the process.
//!
//! Good order is between two cycles. A run that has not finished its cycle after
//! [`CYCLE_TIMEOUT`] leaves it half done; its recording continues from the last checkpoint.

use crate::exit::{ExitCode, Failure};
use sidestep::kernel::Interrupt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

/// Time that a cycle has to end after Ctrl-C: most take milliseconds, and a user accepts to wait a second.
const CYCLE_TIMEOUT: Duration = Duration::from_secs(1);

static REQUESTED: AtomicBool = AtomicBool::new(false);
static LISTENING: AtomicBool = AtomicBool::new(false);
static CYCLE_INTERRUPT: OnceLock<Interrupt> = OnceLock::new();

/// Makes Ctrl-C (and a termination signal) a request to stop, instead of the end of the process.
///
/// # Errors
/// When the system does not allow signals to be caught.
pub(crate) fn listen() -> Result<(), Failure> {
    if LISTENING.swap(true, Ordering::Relaxed) {
        return Ok(());
    }
    set_handler(|| {
        if REQUESTED.swap(true, Ordering::Relaxed) {
            std::process::exit(ExitCode::Interrupted as i32);
        }
        // Another thread waits, so that the second signal is handled meanwhile.
        std::thread::spawn(|| {
            std::thread::sleep(CYCLE_TIMEOUT);
            cycle_interrupt().raise();
        });
    })
}

/// Returns the interrupt that runs check within their cycles.
pub(crate) fn cycle_interrupt() -> Interrupt {
    CYCLE_INTERRUPT.get_or_init(Interrupt::default).clone()
}

/// Makes Ctrl-C (and a termination signal) end the process after `cleanup`.
///
/// # Errors
/// When the system does not allow signals to be caught.
pub(crate) fn on_interrupt(cleanup: impl Fn() + Send + 'static) -> Result<(), Failure> {
    set_handler(move || {
        cleanup();
        std::process::exit(ExitCode::Interrupted as i32);
    })
}

/// What Ctrl-C does now. A process may have one handler, and a command may first clean up by it and later listen.
static HANDLER: Mutex<Option<Box<dyn FnMut() + Send>>> = Mutex::new(None);
static HAS_HANDLER: AtomicBool = AtomicBool::new(false);

fn set_handler(handler: impl FnMut() + Send + 'static) -> Result<(), Failure> {
    *HANDLER.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(handler));
    if HAS_HANDLER.load(Ordering::Relaxed) {
        return Ok(());
    }
    let handle = || {
        if let Some(handler) = &mut *HANDLER.lock().unwrap_or_else(PoisonError::into_inner) {
            handler();
        }
    };
    ctrlc::set_handler(handle).map_err(|e| {
        Failure::other(format!("cannot listen for Ctrl-C: {e}"), "run it in another terminal")
    })?;
    HAS_HANDLER.store(true, Ordering::Relaxed);
    Ok(())
}

pub(crate) fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
