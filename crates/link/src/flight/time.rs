//! Time in a flight without a server: each party goes by its own clock.

use sidestep::kernel::Cycle;
use std::collections::VecDeque;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Number of messages by which the clock of another one is judged: one of them has come without much delay.
const MAX_DIFFERENCES: usize = 32;

/// Number of messages from which on it is judged.
const MIN_DIFFERENCES: usize = 4;

/// The clock of a party: UTC as it was when the party began, and a clock from there on that nobody sets.
#[derive(Debug, Clone, Copy)]
pub struct WallClock {
    began_s: f64,
    began: Instant,
}

impl WallClock {
    /// Returns the clock of this machine.
    pub fn system() -> Self {
        Self::with_offset(0.0)
    }

    /// Returns a clock that is some seconds ahead of that of this machine.
    pub fn with_offset(offset_s: f64) -> Self {
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { began_s: since_1970.as_secs_f64() + offset_s, began: Instant::now() }
    }

    /// Returns the time in seconds since 1970, UTC.
    pub fn now_s(&self) -> f64 {
        self.began_s + self.began.elapsed().as_secs_f64()
    }
}

/// When the cycles of a flight begin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlightTime {
    /// When cycle 0 begins, in seconds since 1970, UTC.
    pub start_s: f64,
    /// Seconds of the scenario in a second.
    pub speed: f64,
    /// Length of a cycle, in seconds of the scenario.
    pub dt_s: f64,
}

impl FlightTime {
    /// Returns the time of the scenario at a time in seconds since 1970: negative before the start.
    pub fn scenario_s(&self, now_s: f64) -> f64 {
        (now_s - self.start_s) * self.speed
    }

    /// Returns when a share of a cycle has passed, in seconds since 1970. Cycle -1 is that before the start.
    pub fn cycle_at_s(&self, cycle: i64, share: f64) -> f64 {
        self.start_s + (cycle as f64 + share) * self.dt_s / self.speed
    }

    /// Returns the cycle that is flown at a time; none before the start.
    pub fn cycle_at(&self, now_s: f64) -> Option<Cycle> {
        let cycles = self.scenario_s(now_s) / self.dt_s;
        (cycles >= 0.0).then_some(cycles as Cycle)
    }
}

/// Returns the time from now until a time of a clock; zero if it has passed.
pub fn wait_until(clock: &WallClock, at_s: f64) -> Duration {
    Duration::try_from_secs_f64(at_s - clock.now_s()).unwrap_or_default()
}

/// By how much the clock of another party seems to differ: the time from sending to receiving, by the two clocks. It is the
/// difference of the clocks and the delay together, so the smallest of some is nearest to the difference.
#[derive(Debug, Clone, Default)]
pub struct ClockDifference {
    differences_s: VecDeque<f64>,
}

impl ClockDifference {
    /// Adds a message that was sent and received at these times, each by its own party's clock.
    pub fn add(&mut self, sent_s: f64, received_s: f64) {
        if self.differences_s.len() == MAX_DIFFERENCES {
            self.differences_s.pop_front();
        }
        self.differences_s.push_back(received_s - sent_s);
    }

    /// Returns by how many seconds the other clock seems to be behind this one; negative if it is ahead. None before some
    /// messages have come.
    pub fn behind_s(&self) -> Option<f64> {
        let has_enough = self.differences_s.len() >= MIN_DIFFERENCES;
        has_enough.then(|| self.differences_s.iter().copied().fold(f64::INFINITY, f64::min))
    }

    /// Returns whether the clocks differ by more than a tolerance.
    pub fn is_beyond(&self, tolerance_s: f64) -> bool {
        // A number that is none is beyond any tolerance.
        let is_within = |behind_s: f64| behind_s.abs() <= tolerance_s;
        self.behind_s().is_some_and(|behind_s| !is_within(behind_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_is_judged_by_the_message_with_the_least_delay() {
        let mut difference = ClockDifference::default();
        for delay_s in [0.3, 0.01, 2.0] {
            difference.add(100.0, 100.0 + delay_s);
        }
        assert_eq!(difference.behind_s(), None);
        difference.add(100.0, 100.4);
        assert!(!difference.is_beyond(0.05));
        for _ in 0..MAX_DIFFERENCES {
            difference.add(100.0, 100.2);
        }
        assert!(difference.is_beyond(0.05), "{difference:?}");
        let mut ahead = ClockDifference::default();
        (0..4).for_each(|_| ahead.add(100.0, 99.5));
        assert!(ahead.is_beyond(0.1) && !ahead.is_beyond(0.6));
        let mut broken = ClockDifference::default();
        (0..4).for_each(|_| broken.add(f64::NAN, 99.5));
        assert!(
            broken.behind_s().is_none_or(|behind_s| !behind_s.is_finite()) || broken.is_beyond(1.0)
        );
    }

    #[test]
    fn cycles_follow_each_other_from_the_start_on() {
        let time = FlightTime { start_s: 1000.0, speed: 10.0, dt_s: 5.0 };
        assert_eq!(time.cycle_at(999.9), None);
        assert_eq!(time.cycle_at(1000.0), Some(0));
        assert_eq!(time.cycle_at(1000.6), Some(1));
        assert_eq!(time.cycle_at_s(-1, 0.0), 999.5);
        assert_eq!(time.cycle_at_s(2, 0.5), 1001.25);
        assert_eq!(time.scenario_s(1001.0), 10.0);
    }
}
