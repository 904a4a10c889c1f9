//! Elapsed time for progress and phase times; never an input of a simulation.

use cpu_time::ThreadTime;
use std::sync::atomic::{AtomicU64, Ordering};

/// A monotonic clock.
pub trait Clock: Sync {
    /// Returns the nanoseconds since some fixed moment; never decreases.
    fn now_ns(&self) -> u64;

    /// Returns the processor time of the calling thread in nanoseconds; never decreases.
    fn thread_cpu_ns(&self) -> u64;
}

/// The machine's monotonic clock.
#[derive(Debug)]
pub struct SystemClock(std::time::Instant);

impl Default for SystemClock {
    #[expect(clippy::disallowed_methods, reason = "the one place that reads the clock")]
    fn default() -> Self {
        Self(std::time::Instant::now())
    }
}

impl Clock for SystemClock {
    fn now_ns(&self) -> u64 {
        u64::try_from(self.0.elapsed().as_nanos()).unwrap_or(u64::MAX)
    }

    fn thread_cpu_ns(&self) -> u64 {
        u64::try_from(ThreadTime::now().as_duration().as_nanos()).unwrap_or(u64::MAX)
    }
}

/// A clock that a test sets by hand.
#[derive(Debug, Default)]
pub struct ManualClock(AtomicU64);

impl ManualClock {
    /// Moves the clock forward by `by_ns` nanoseconds.
    pub fn advance_ns(&self, by_ns: u64) {
        self.0.fetch_add(by_ns, Ordering::Relaxed);
    }
}

impl Clock for ManualClock {
    fn now_ns(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    fn thread_cpu_ns(&self) -> u64 {
        self.now_ns()
    }
}

/// Checks the guarantees of a [`Clock`]; call it from the tests of a new clock.
///
/// # Panics
/// When the clock runs backwards.
pub fn check_conformance(clock: &impl Clock) {
    let mut last_ns = clock.now_ns();
    for _ in 0..1000 {
        let now_ns = clock.now_ns();
        assert!(now_ns >= last_ns, "the clock ran backwards");
        last_ns = now_ns;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_clocks_conform() {
        check_conformance(&SystemClock::default());
        let manual = ManualClock::default();
        check_conformance(&manual);
        manual.advance_ns(5);
        assert_eq!(manual.now_ns(), 5);
    }
}
