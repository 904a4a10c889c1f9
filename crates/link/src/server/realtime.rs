//! Real time: every cycle is a deadline. A control that is not there by then is not flown, and its agent does the
//! safe thing.
//!
//! All times are the server's own, by its monotonic clock; each node measures the remaining time from the moment that
//! it has heard of the cycle. Clocks are never compared, so one that is wrong, or jumps, changes nothing.

use super::{FleetError, Server};
use std::time::{Duration, Instant};

/// Part of a cycle by which it may begin later than due without being counted as late.
const LATE_FRACTION: f64 = 0.1;

/// The shortest cycle: below it only lateness would be seen.
const MIN_CYCLE: Duration = Duration::from_millis(1);

impl Server<'_> {
    /// Flies the world to its end, `speed` times as fast as in the scenario.
    ///
    /// # Errors
    /// When the world cannot go on, or the fleet is asked to end.
    pub(super) fn fly_in_real_time(&mut self, speed: f64) -> Result<(), FleetError> {
        let cycle = Duration::from_secs_f64(self.stage.world().cycle_s() / speed).max(MIN_CYCLE);
        let mut due = Instant::now();
        while !self.stage.is_over() {
            self.record_lateness(due.elapsed(), cycle);
            let began = Instant::now();
            // A server that was stopped for a while does not rush to catch up.
            due = (due + cycle).max(began + cycle / 2);
            self.run_rounds_until(due)?;
            let left = || due.saturating_duration_since(Instant::now());
            while !left().is_zero() {
                self.receive(left())?;
            }
            self.advance()?;
        }
        Ok(())
    }

    /// Lets the agents of a cycle talk, round after round. Each round has an equal part of the remaining time, so
    /// that a late agent costs later rounds nothing more.
    fn run_rounds_until(&mut self, due: Instant) -> Result<(), FleetError> {
        let began = Instant::now();
        loop {
            let groups = self.send_percepts();
            let further = self.stage.max_further_rounds(groups.len());
            let left = due.saturating_duration_since(Instant::now());
            let ends = Instant::now() + left / (further as u32 + 1);
            let is_there =
                |server: &Self, agent| server.is_gone(agent) || server.has_control(agent);
            let mut is_in_time = true;
            while !groups.iter().flatten().all(|&agent| is_there(self, agent)) {
                let left = ends.saturating_duration_since(Instant::now());
                is_in_time = !left.is_zero();
                if !is_in_time {
                    break;
                }
                self.receive(left)?;
            }
            self.accept_controls(&groups);
            if groups.is_empty() || further == 0 {
                let talked = if is_in_time { began.elapsed() } else { due - began };
                self.tally.talked.record(talked);
                return Ok(());
            }
        }
    }

    fn record_lateness(&mut self, late: Duration, cycle: Duration) {
        self.tally.late.record(late);
        if late > cycle.mul_f64(LATE_FRACTION) {
            self.tally.late_cycles += 1;
            tracing::warn!(
                cycle = self.stage.cycle(),
                late_ms = late.as_millis() as u64,
                "the server is late"
            );
        }
    }
}
