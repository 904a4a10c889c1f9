//! The number of cycles that a run goes at a time, and when the next cycle is due.

use crate::protocol::Speed;
use sidestep::kernel::Cycle;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Duration of a slice, and so the longest wait of orders, but for cycles that take longer.
const SLICE: Duration = Duration::from_millis(12);
/// A run that is so late does not hurry to catch up.
const LATE: Duration = Duration::from_millis(250);
/// The time over which cycles are counted.
const COUNTED: Duration = Duration::from_secs(1);

/// The number of cycles of a slice.
#[derive(Debug)]
pub(super) struct Pace(u64);

impl Default for Pace {
    fn default() -> Self {
        Self(1)
    }
}

impl Pace {
    pub(super) fn cycles(&self) -> u64 {
        self.0
    }

    /// Adapts the number of cycles to [`SLICE`]; it grows at most fourfold at a time.
    pub(super) fn note(&mut self, cycles: u64, took: Duration) {
        let per_cycle_s = took.as_secs_f64() / cycles.max(1) as f64;
        let fitting = (SLICE.as_secs_f64() / per_cycle_s.max(1e-12)) as u64;
        self.0 = fitting.clamp(1, self.0.saturating_mul(4));
    }
}

/// The clock of a run that is played at a speed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beat {
    start: Instant,
    from: Cycle,
    cycles_per_s: f64,
}

impl Beat {
    /// Returns the clock of a run that stands at a cycle; `None` as fast as it goes.
    pub(super) fn new(speed: Speed, cycle_s: f64, now: Instant, from: Cycle) -> Option<Self> {
        match speed {
            Speed::Fastest => None,
            Speed::Times(times) => Some(Self { start: now, from, cycles_per_s: times / cycle_s }),
        }
    }

    /// Returns the cycle at which a run should be that is now at `cycle`; one that is too late is waited for.
    pub(super) fn target(&mut self, now: Instant, cycle: Cycle) -> Cycle {
        let due = self.due(now);
        let late = due.saturating_sub(cycle) as f64 / self.cycles_per_s;
        if late > LATE.as_secs_f64() {
            (self.start, self.from) = (now, cycle);
            return cycle + 1;
        }
        due
    }

    fn due(&self, now: Instant) -> Cycle {
        let passed_s = now.saturating_duration_since(self.start).as_secs_f64();
        // A little more, so that a wait until a cycle is due ends when it is.
        self.from + (passed_s * self.cycles_per_s + 1e-6) as u64
    }

    /// Returns when the cycle after this one is due.
    pub(super) fn next(&self, cycle: Cycle) -> Instant {
        let cycles = (cycle + 1).saturating_sub(self.from) as f64;
        // No wait is longer than an hour; it is asked again then.
        self.start + Duration::from_secs_f64((cycles / self.cycles_per_s).min(3600.0))
    }
}

/// Cycles per second, over the last second.
#[derive(Debug, Default)]
pub(super) struct Rate(VecDeque<(Instant, u64)>);

impl Rate {
    pub(super) fn note(&mut self, now: Instant, cycles: u64) {
        self.forget(now);
        match self.0.back_mut() {
            // A hundred stretches are enough.
            Some((at, sum)) if now.duration_since(*at) < COUNTED / 100 => *sum += cycles,
            _ => self.0.push_back((now, cycles)),
        }
    }

    pub(super) fn per_s(&mut self, now: Instant) -> f64 {
        self.forget(now);
        let sum: u64 = self.0.iter().map(|(_, cycles)| cycles).sum();
        sum as f64 / COUNTED.as_secs_f64()
    }

    fn forget(&mut self, now: Instant) {
        while self.0.front().is_some_and(|(at, _)| now.duration_since(*at) > COUNTED) {
            self.0.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_beat_tells_the_cycle_that_is_due_and_when_the_next_one_is() {
        let start = Instant::now();
        let mut beat = Beat::new(Speed::Times(2.0), 0.5, start, 10).expect("a speed");
        assert_eq!(beat.target(start + 200 * MS, 10), 10);
        assert_eq!(beat.next(10), start + 250 * MS);
        assert_eq!(beat.target(beat.next(10), 10), 11);
        assert!(Beat::new(Speed::Fastest, 0.5, start, 0).is_none());
    }

    #[test]
    fn a_run_that_cannot_keep_up_does_not_hurry_afterwards() {
        let start = Instant::now();
        let mut beat = Beat::new(Speed::Times(1.0), 0.01, start, 0).expect("a speed");
        assert_eq!(beat.target(start + 1000 * MS, 3), 4);
        assert_eq!(beat.target(start + 1020 * MS, 4), 5, "as from now on");
    }

    #[test]
    fn a_rate_is_that_of_the_last_second() {
        let (mut rate, start) = (Rate::default(), Instant::now());
        (0..300).for_each(|k| rate.note(start + k * 5 * MS, 10));
        let per_s = rate.per_s(start + 1500 * MS);
        assert!((1950.0..=2050.0).contains(&per_s), "{per_s}");
        assert_eq!(rate.per_s(start + 4000 * MS), 0.0);
    }
}
