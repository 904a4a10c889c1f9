//! Work on a thread of its own, while its caller checks for signals at intervals.

use std::panic::resume_unwind;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// Time between two polls.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Does `work` on a thread of its own and calls `poll` on this one every 20 ms until it is done: for callers on the
/// only thread that receives signals, as Python's main thread.
pub fn run_polling<T: Send>(work: impl FnOnce() -> T + Send, mut poll: impl FnMut()) -> T {
    thread::scope(|scope| {
        let (done, wait) = channel();
        let worker = scope.spawn(move || {
            let result = work();
            // A waiting caller sees the end of the work at once; without one, nothing is lost.
            let _ = done.send(());
            result
        });
        while let Err(RecvTimeoutError::Timeout) = wait.recv_timeout(POLL_INTERVAL) {
            poll();
        }
        worker.join().unwrap_or_else(|payload| resume_unwind(payload))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::catch_unwind;
    use std::sync::atomic::{AtomicBool, Ordering};

    #[test]
    fn work_is_looked_after_until_it_is_done() {
        let asked = AtomicBool::new(false);
        let until_asked = || {
            while !asked.load(Ordering::Relaxed) {
                thread::yield_now();
            }
            7
        };
        assert_eq!(run_polling(until_asked, || asked.store(true, Ordering::Relaxed)), 7);
    }

    #[test]
    fn a_panic_of_the_work_reaches_the_caller() {
        let panics = || run_polling(|| resume_unwind(Box::new("words")), || ());
        let payload = catch_unwind(panics).expect_err("it panics");
        assert_eq!(payload.downcast_ref(), Some(&"words"));
    }
}
