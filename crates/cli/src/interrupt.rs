//! Ctrl-C: the first asks the run to stop in good order, the second ends the process.

use crate::exit::{ExitCode, Failure};
use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C (and a termination signal) is noted instead of killing the process.
///
/// # Errors
/// When the system does not let signals be caught.
pub(crate) fn listen() -> Result<(), Failure> {
    let stop = || {
        if REQUESTED.swap(true, Ordering::Relaxed) {
            std::process::exit(ExitCode::Interrupted as i32);
        }
    };
    ctrlc::set_handler(stop).map_err(|e| {
        Failure::stopped(format!("cannot listen for Ctrl-C: {e}"), "run it in another terminal")
    })
}

/// Whether the run was asked to stop.
pub(crate) fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
