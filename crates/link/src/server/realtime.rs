//! Real time: every cycle is a deadline. A control that is not there by then is not flown, and its agent does what
//! is safe.
//!
//! All times are the server's own, by its monotonic clock; each node measures how much time is left since it has
//! heard of the cycle. Nobody compares clocks, so one that is wrong, or jumps, changes nothing.

use super::{Broken, Server};
use std::time::{Duration, Instant};

/// Part of a cycle by which it may begin later than due without being counted as late.
const LATE_PART: f64 = 0.1;

/// The shortest cycle: below it nothing but lateness would be seen.
const SHORTEST: Duration = Duration::from_millis(1);

impl Server<'_> {
    /// Flies the world to its end, so many times as fast as in the scenario.
    ///
    /// # Errors
    /// When the world cannot go on, or somebody asks the fleet to end.
    pub(super) fn fly_in_real_time(&mut self, speed: f64) -> Result<(), Broken> {
        let cycle = Duration::from_secs_f64(self.stage.cycle_s() / speed).max(SHORTEST);
        let mut due = Instant::now();
        while !self.stage.is_over() {
            self.note_lateness(due.elapsed(), cycle);
            let began = Instant::now();
            let groups = self.hand_out_sights();
            // A server that was stopped for a while does not hurry to catch up.
            due = (due + cycle).max(began + cycle / 2);
            let mut talked = None;
            loop {
                if talked.is_none() && self.has_controls(&groups) {
                    talked = Some(began.elapsed());
                }
                let left = due.saturating_duration_since(Instant::now());
                if left.is_zero() {
                    break;
                }
                self.hear(left)?;
            }
            self.tally.talked.add(talked.unwrap_or(cycle));
            self.advance(&groups)?;
        }
        Ok(())
    }

    fn note_lateness(&mut self, late: Duration, cycle: Duration) {
        self.tally.late.add(late);
        if late > cycle.mul_f64(LATE_PART) {
            self.tally.late_cycles += 1;
            tracing::warn!(
                cycle = self.stage.cycle(),
                late_ms = late.as_millis() as u64,
                "the server is late"
            );
        }
    }
}
