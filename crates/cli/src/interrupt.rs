//! Ctrl-C: the first one asks the run to stop in good order, the second one ends the process.

use crate::exit::{ExitCode, Failure};
use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);
static LISTENING: AtomicBool = AtomicBool::new(false);

/// Makes Ctrl-C (and a termination signal) a request to stop, instead of the end of the process.
///
/// # Errors
/// When the system does not allow signals to be caught.
pub(crate) fn listen() -> Result<(), Failure> {
    if LISTENING.swap(true, Ordering::Relaxed) {
        return Ok(());
    }
    catch(|| {
        if REQUESTED.swap(true, Ordering::Relaxed) {
            std::process::exit(ExitCode::Interrupted as i32);
        }
    })
}

/// Makes Ctrl-C (and a termination signal) end the process after `cleanup`.
///
/// # Errors
/// When the system does not allow signals to be caught.
pub(crate) fn end_with(cleanup: impl Fn() + Send + 'static) -> Result<(), Failure> {
    catch(move || {
        cleanup();
        std::process::exit(ExitCode::Interrupted as i32);
    })
}

fn catch(handler: impl FnMut() + Send + 'static) -> Result<(), Failure> {
    ctrlc::set_handler(handler).map_err(|e| {
        Failure::stopped(format!("cannot listen for Ctrl-C: {e}"), "run it in another terminal")
    })
}

/// Whether the run was asked to stop.
pub(crate) fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
