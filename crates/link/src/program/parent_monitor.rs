//! The lifeline: standard input, which ends when the parent of the program wants it to end, or is gone.
//!
//! It holds however the parent ends, and needs no calls of a particular system: a pipe is closed when no process is
//! left to write to it.

use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Time that the program has to end in good order; then it is ended anyway.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(20);

/// Exit code of a program that was told to end.
const INTERRUPTED_EXIT_CODE: i32 = 130;

/// Whether standard input has ended.
#[derive(Debug, Clone)]
pub(super) struct ParentMonitor(Arc<AtomicBool>);

impl ParentMonitor {
    /// Watches standard input from now on.
    pub(super) fn watch() -> Self {
        let has_ended = Arc::new(AtomicBool::new(false));
        let ended = has_ended.clone();
        std::thread::spawn(move || {
            wait_for_end();
            ended.store(true, Ordering::Relaxed);
            std::thread::sleep(SHUTDOWN_TIMEOUT);
            std::process::exit(INTERRUPTED_EXIT_CODE);
        });
        Self(has_ended)
    }

    /// Ends the process when standard input ends: for a process with nothing to lose.
    pub(super) fn exit_with_parent() {
        std::thread::spawn(|| {
            wait_for_end();
            std::process::exit(INTERRUPTED_EXIT_CODE);
        });
    }

    /// Returns whether it has ended.
    pub(super) fn has_ended(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

fn wait_for_end() {
    let mut bytes = [0; 64];
    // Anything else on standard input is ignored.
    while std::io::stdin().lock().read(&mut bytes).is_ok_and(|read| read > 0) {}
}
