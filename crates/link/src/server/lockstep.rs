//! Lockstep: the server waits for every control, so that a fleet gives the same results as one process, bit for bit.

use super::rounds::Group;
use super::{FleetError, POLL_INTERVAL, Server};
use std::time::Instant;

impl Server<'_> {
    /// Makes a cycle.
    ///
    /// # Errors
    /// When a node that the fleet needs is gone, the world cannot go on, or the fleet is asked to
    /// end.
    pub(super) fn run_lockstep_cycle(&mut self) -> Result<(), FleetError> {
        // Time stands still while a node is missing: only the cycle under way at its loss was made without it.
        self.wait_for_all()?;
        let began = Instant::now();
        loop {
            let groups = self.send_percepts();
            let is_last = groups.is_empty() || self.stage.max_further_rounds(groups.len()) == 0;
            if self.terms.has_faults {
                self.run_ticks(&groups)?;
            }
            while !groups.iter().all(|group| self.has_decided(group)) {
                self.receive(POLL_INTERVAL)?;
            }
            self.accept_controls(&groups);
            if is_last {
                break;
            }
        }
        self.tally.talked.record(began.elapsed());
        self.advance()
    }

    /// Returns whether all of a group have sent their controls, or one is gone: then others may wait for it forever.
    pub(super) fn has_decided(&self, group: &Group) -> bool {
        let has_lost = group.iter().any(|&agent| self.is_gone(agent));
        has_lost || group.iter().all(|&agent| self.has_control(agent))
    }
}
