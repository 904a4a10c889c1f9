//! The monitor of the parent process: standard input ends when the parent wants this process to end, or is gone.
//!
//! That works however the parent ends, and needs no calls of a particular operating system: a pipe is closed when no
//! process is left that can write to it.

use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Time that the program has to end in good order: to finish a recording, for instance. Then it exits in any case.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(20);

/// Exit code of a program that was interrupted, as shells use it for SIGINT: 128 + 2.
const INTERRUPTED_EXIT_CODE: i32 = 130;

/// A flag that says whether standard input has ended.
#[derive(Debug, Clone)]
pub(super) struct ParentMonitor(Arc<AtomicBool>);

impl ParentMonitor {
    /// Watches standard input from now on.
    pub(super) fn watch_stdin() -> Self {
        let has_ended = Arc::new(AtomicBool::new(false));
        let ended = has_ended.clone();
        std::thread::spawn(move || {
            wait_for_stdin_end();
            ended.store(true, Ordering::Relaxed);
            std::thread::sleep(SHUTDOWN_TIMEOUT);
            std::process::exit(INTERRUPTED_EXIT_CODE);
        });
        Self(has_ended)
    }

    /// Exits when standard input ends: for a process that has nothing to store.
    pub(super) fn exit_with_parent() {
        std::thread::spawn(|| {
            wait_for_stdin_end();
            std::process::exit(INTERRUPTED_EXIT_CODE);
        });
    }

    /// Returns whether standard input has ended, so that this process has to end in good order.
    pub(super) fn has_ended(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

fn wait_for_stdin_end() {
    let mut bytes = [0; 64];
    // Anything else on standard input is ignored.
    while std::io::stdin().lock().read(&mut bytes).is_ok_and(|read| read > 0) {}
}
