//! Real time: every cycle is a deadline. A late control is not carried out, and its agent does what is safe
//! without one.
//!
//! All times are the server's own, by its monotonic clock; each node measures the remaining time from the moment at which
//! the cycle's start arrives. Clocks are never compared, so one that is wrong, or jumps, changes nothing.

use super::rounds::DecisionGroup;
use super::{FleetError, FleetServer};
use std::time::{Duration, Instant};

/// Fraction of a cycle by which it may start later than due without being counted as late. Without it each cycle would
/// count, because no timer of an operating system is exact.
const LATE_FRACTION: f64 = 0.1;

/// The shortest cycle: timers are no more exact than that, so below it only lateness would be measured.
const MIN_CYCLE: Duration = Duration::from_millis(1);

impl FleetServer<'_> {
    /// Runs the world to its end, `speed` times as fast as in the scenario.
    ///
    /// # Errors
    /// When the world cannot advance, or the fleet is asked to end.
    pub(super) fn run_in_real_time(&mut self, speed: f64) -> Result<(), FleetError> {
        let cycle = Duration::from_secs_f64(self.run.world().cycle_s() / speed).max(MIN_CYCLE);
        let mut due = Instant::now();
        while !self.run.is_over() {
            self.record_lateness(due.elapsed(), cycle);
            // A server that was stopped for some time does not catch up in a hurry: agents get half a cycle at least.
            due = (due + cycle).max(Instant::now() + cycle / 2);
            self.run_rounds_until(due)?;
            loop {
                let remaining = due.saturating_duration_since(Instant::now());
                if remaining.is_zero() {
                    break;
                }
                self.receive(remaining)?;
            }
            self.advance()?;
        }
        Ok(())
    }

    /// Runs the rounds of a cycle. Each round gets an equal share of the remaining time, so that a late agent costs later
    /// rounds nothing more.
    fn run_rounds_until(&mut self, due: Instant) -> Result<(), FleetError> {
        let started = Instant::now();
        loop {
            let groups = self.send_percepts();
            let further = self.run.max_further_rounds(groups.len());
            let remaining = due.saturating_duration_since(Instant::now());
            let round_ends = Instant::now() + remaining / (further as u32 + 1);
            let is_in_time = self.receive_controls_until(&groups, round_ends)?;
            self.accept_controls(&groups);
            if groups.is_empty() || further == 0 {
                // A late control may arrive long after the deadline, or never.
                let decision_time = if is_in_time { started.elapsed() } else { due - started };
                self.metrics.decision_time.record(decision_time);
                return Ok(());
            }
        }
    }

    /// Waits for the controls of all agents that have nodes. Returns whether they have arrived by a time.
    fn receive_controls_until(
        &mut self,
        groups: &[DecisionGroup],
        until: Instant,
    ) -> Result<bool, FleetError> {
        while self.is_any_control_missing(groups) {
            let remaining = until.saturating_duration_since(Instant::now());
            if remaining.is_zero() {
                return Ok(false);
            }
            self.receive(remaining)?;
        }
        Ok(true)
    }

    /// Returns whether the control of an agent that has a node is missing.
    fn is_any_control_missing(&self, groups: &[DecisionGroup]) -> bool {
        let mut agents = groups.iter().flatten();
        agents.any(|&agent| !self.has_no_node(agent) && !self.has_control(agent))
    }

    fn record_lateness(&mut self, lateness: Duration, cycle: Duration) {
        self.metrics.lateness.record(lateness);
        if lateness > cycle.mul_f64(LATE_FRACTION) {
            self.metrics.late_cycles += 1;
            tracing::warn!(
                cycle = self.run.cycle(),
                late_ms = lateness.as_millis() as u64,
                "the server is late"
            );
        }
    }
}
