//! The time at which the next cycle of a run is due.

use sidestep_kernel::Cycle;
use std::time::{Duration, Instant};

/// The delay beyond which a run does not rush to catch up: a viewer would see a jump.
const MAX_LAG: Duration = Duration::from_millis(250);

/// The clock of a run that is played at a speed: it converts cycles to times from the start of the run or the last
/// restart, so errors do not add up.
#[derive(Debug, Clone, Copy)]
pub struct Pacer {
    start: Instant,
    from: Cycle,
    cycles_per_s: f64,
}

impl Pacer {
    /// Returns the clock of a run that is at a cycle.
    pub fn new(cycles_per_s: f64, now: Instant, from: Cycle) -> Self {
        Self { start: now, from, cycles_per_s }
    }

    /// Returns the cycle at which a run that is now at `cycle` should be; the clock starts again at one that is too
    /// late.
    pub fn target(&mut self, now: Instant, cycle: Cycle) -> Cycle {
        let due = self.due_cycle(now);
        let lag_s = due.saturating_sub(cycle) as f64 / self.cycles_per_s;
        if lag_s > MAX_LAG.as_secs_f64() {
            self.start = now;
            self.from = cycle;
            return cycle + 1;
        }
        due
    }

    fn due_cycle(&self, now: Instant) -> Cycle {
        let passed_s = now.saturating_duration_since(self.start).as_secs_f64();
        // A little more, so that a wait for a cycle ends with the cycle due.
        self.from + (passed_s * self.cycles_per_s + 1e-6) as u64
    }

    /// Returns the time at which the cycle after this one is due.
    pub fn next_due(&self, cycle: Cycle) -> Instant {
        let cycles = (cycle + 1).saturating_sub(self.from) as f64;
        // No wait is longer than an hour, because a tiny speed would give more seconds than a duration holds; the
        // caller asks again then.
        self.start + Duration::from_secs_f64((cycles / self.cycles_per_s).min(3600.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_beat_tells_the_cycle_that_is_due_and_when_the_next_one_is() {
        let start = Instant::now();
        let mut beat = Pacer::new(4.0, start, 10);
        assert_eq!(beat.target(start + 200 * MS, 10), 10);
        assert_eq!(beat.next_due(10), start + 250 * MS);
        assert_eq!(beat.target(beat.next_due(10), 10), 11);
    }

    #[test]
    fn a_run_that_cannot_keep_up_does_not_hurry_afterwards() {
        let start = Instant::now();
        let mut beat = Pacer::new(100.0, start, 0);
        assert_eq!(beat.target(start + 1000 * MS, 3), 4);
        assert_eq!(beat.target(start + 1020 * MS, 4), 5, "as from now on");
    }
}
