//! The lifeline: standard input, which ends when the parent of the program wants it to end, or is gone.
//!
//! It holds however the parent ends, and needs no calls of a particular system: a pipe is closed when no process is
//! left to write to it.

use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Time that the program has to end in good order; then it is ended anyway.
const PATIENCE: Duration = Duration::from_secs(20);

/// Exit code of a program that was told to end.
const INTERRUPTED: i32 = 130;

/// Whether standard input has ended.
#[derive(Debug, Clone)]
pub(super) struct Lifeline(Arc<AtomicBool>);

impl Lifeline {
    /// Watches standard input from now on.
    pub(super) fn watch() -> Self {
        let has_ended = Arc::new(AtomicBool::new(false));
        let ended = has_ended.clone();
        std::thread::spawn(move || {
            wait_for_end();
            ended.store(true, Ordering::Relaxed);
            std::thread::sleep(PATIENCE);
            std::process::exit(INTERRUPTED);
        });
        Self(has_ended)
    }

    /// Ends the process when standard input ends: for a process with nothing to lose.
    pub(super) fn end_with() {
        std::thread::spawn(|| {
            wait_for_end();
            std::process::exit(INTERRUPTED);
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
