//! Lockstep: the server waits for every control, so that a fleet gives the same results as one process, bit for bit.

use super::rounds::DecisionGroup;
use super::{FleetError, FleetServer, POLL_INTERVAL};
use std::time::Instant;

impl FleetServer<'_> {
    /// Runs a cycle.
    ///
    /// # Errors
    /// When a node that the fleet needs is lost, the world cannot advance, or the fleet is asked to end.
    pub(super) fn run_lockstep_cycle(&mut self) -> Result<(), FleetError> {
        // No cycle starts while a node is missing: only the one under way at its loss is computed without it.
        self.wait_until_all_ready()?;
        let started = Instant::now();
        loop {
            let groups = self.send_percepts();
            let is_last = groups.is_empty() || self.run.max_further_rounds(groups.len()) == 0;
            if self.config.has_faults {
                self.run_group_conversations(&groups)?;
            }
            while !groups.iter().all(|group| self.has_decided(group)) {
                self.receive(POLL_INTERVAL)?;
            }
            self.accept_controls(&groups);
            if is_last {
                break;
            }
        }
        self.metrics.decision_time.record(started.elapsed());
        self.advance()
    }

    /// Returns whether all of a group have sent their controls, or one has no node: then the others may wait for its
    /// messages forever.
    pub(super) fn has_decided(&self, group: &DecisionGroup) -> bool {
        let has_lost = group.iter().any(|&agent| self.has_no_node(agent));
        has_lost || group.iter().all(|&agent| self.has_control(agent))
    }
}
