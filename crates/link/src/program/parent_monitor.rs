//! The monitor of the parent process: standard input ends when the parent wants this process to end, or is gone. A signal
//! that asks this process to end does the same.
//!
//! That works however the parent ends, and needs no calls of a particular operating system: a pipe is closed when no
//! process is left that can write to it.

use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};

/// Time that the program has to end in good order: to finish a recording, for instance. Then it exits in any case.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(20);

/// Time that a node which has joined has to tell the server that it leaves.
const SEAT_TIMEOUT: Duration = Duration::from_secs(5);

/// Time between two checks whether that time is over.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Exit code of a program that was interrupted, as shells use it for SIGINT: 128 + 2.
const INTERRUPTED_EXIT_CODE: i32 = 130;

/// A flag that says whether this process has to end.
#[derive(Debug, Clone)]
pub(super) struct ParentMonitor {
    has_ended: Arc<AtomicBool>,
    /// Time from then on after which the process exits in any case.
    shutdown_ms: Arc<AtomicU64>,
}

impl ParentMonitor {
    /// Watches standard input and signals from now on, for a process that has something to finish.
    pub(super) fn watch() -> Self {
        Self::watch_with(SHUTDOWN_TIMEOUT)
    }

    /// Does the same for a node: before it has joined it has nothing to finish.
    pub(super) fn watch_node() -> Self {
        Self::watch_with(Duration::ZERO)
    }

    fn watch_with(timeout: Duration) -> Self {
        let monitor = Self { has_ended: Arc::default(), shutdown_ms: Arc::default() };
        monitor.set_shutdown_timeout(timeout);
        let on_end = monitor.clone();
        spawn(move || {
            wait_for_stdin_end();
            on_end.end();
        });
        let on_signal = monitor.clone();
        // An error means that signals end the process as they would without this.
        let _ = ctrlc::set_handler(move || {
            let on_signal = on_signal.clone();
            spawn(move || on_signal.end());
        });
        monitor
    }

    /// Records that the node has joined: it ends by leaving.
    pub(super) fn record_seat(&self) {
        self.set_shutdown_timeout(SEAT_TIMEOUT);
    }

    fn set_shutdown_timeout(&self, timeout: Duration) {
        self.shutdown_ms.store(timeout.as_millis() as u64, Ordering::Relaxed);
    }

    /// Asks the process to end, and exits if it does not.
    fn end(&self) {
        self.has_ended.store(true, Ordering::Relaxed);
        let asked = Instant::now();
        while asked.elapsed() < Duration::from_millis(self.shutdown_ms.load(Ordering::Relaxed)) {
            sleep(POLL_INTERVAL);
        }
        std::process::exit(INTERRUPTED_EXIT_CODE);
    }

    /// Returns whether this process has to end in good order.
    pub(super) fn has_ended(&self) -> bool {
        self.has_ended.load(Ordering::Relaxed)
    }
}

fn wait_for_stdin_end() {
    let mut bytes = [0; 64];
    // Anything else on standard input is ignored.
    while std::io::stdin().lock().read(&mut bytes).is_ok_and(|read| read > 0) {}
}
