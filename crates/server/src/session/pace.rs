//! The number of cycles that a run advances at a time, and the number per second.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Duration of a slice of computing, and so the longest wait of a request, unless a cycle takes longer: less than the time
/// between two frames of a screen (16 ms).
const SLICE_DURATION: Duration = Duration::from_millis(12);
/// Time over which cycles are counted: shorter ones make the number on the page flicker.
const RATE_WINDOW: Duration = Duration::from_secs(1);

/// The number of cycles that take about [`SLICE_DURATION`], by the times of the slices before.
#[derive(Debug)]
pub(super) struct CyclesPerSlice(u64);

impl Default for CyclesPerSlice {
    fn default() -> Self {
        Self(1)
    }
}

impl CyclesPerSlice {
    pub(super) fn cycles(&self) -> u64 {
        self.0
    }

    /// Adapts the number of cycles to [`SLICE_DURATION`], after some cycles have taken some time. It grows at most fourfold at
    /// a time, because a few cheap cycles say little about the next ones.
    pub(super) fn adapt_cycles_per_slice(&mut self, cycles: u64, time: Duration) {
        let per_cycle_s = time.as_secs_f64() / cycles.max(1) as f64;
        let fitting = (SLICE_DURATION.as_secs_f64() / per_cycle_s.max(1e-12)) as u64;
        self.0 = fitting.clamp(1, self.0.saturating_mul(4));
    }
}

/// Cycles per second, over the last second.
#[derive(Debug, Default)]
pub(super) struct CycleRate(VecDeque<(Instant, u64)>);

impl CycleRate {
    pub(super) fn record(&mut self, now: Instant, cycles: u64) {
        self.drop_old_samples(now);
        match self.0.back_mut() {
            // A hundred entries a second are enough for a number on a page.
            Some((at, sum)) if now.duration_since(*at) < RATE_WINDOW / 100 => *sum += cycles,
            _ => self.0.push_back((now, cycles)),
        }
    }

    pub(super) fn per_s(&mut self, now: Instant) -> f64 {
        self.drop_old_samples(now);
        let sum: u64 = self.0.iter().map(|(_, cycles)| cycles).sum();
        sum as f64 / RATE_WINDOW.as_secs_f64()
    }

    fn drop_old_samples(&mut self, now: Instant) {
        while self.0.front().is_some_and(|(at, _)| now.duration_since(*at) > RATE_WINDOW) {
            self.0.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_rate_is_that_of_the_last_second() {
        let (mut rate, start) = (CycleRate::default(), Instant::now());
        (0..300).for_each(|k| rate.record(start + k * 5 * MS, 10));
        let per_s = rate.per_s(start + 1500 * MS);
        assert!((1950.0..=2050.0).contains(&per_s), "{per_s}");
        assert_eq!(rate.per_s(start + 4000 * MS), 0.0);
    }
}
