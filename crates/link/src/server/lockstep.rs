//! Lockstep: the server waits for every control, so that a fleet gives the same results as one process, bit for bit.

use super::rounds::Group;
use super::{Broken, LOOK, Server};
use std::time::Instant;

impl Server<'_> {
    /// Makes a cycle.
    ///
    /// # Errors
    /// When a node that the fleet needs is gone, the world cannot go on, or the fleet is asked to
    /// end.
    pub(super) fn cycle_in_lockstep(&mut self) -> Result<(), Broken> {
        // Time stands still while a node is missing: only the cycle under way at its loss was made without it.
        self.wait_for_all()?;
        let began = Instant::now();
        loop {
            let groups = self.hand_out_sights();
            let is_last = groups.is_empty() || self.stage.further_rounds(groups.len()) == 0;
            if self.terms.has_faults {
                self.count_ticks(&groups)?;
            }
            while !groups.iter().all(|group| self.has_decided(group)) {
                self.hear(LOOK)?;
            }
            self.take_controls(&groups);
            if is_last {
                break;
            }
        }
        self.tally.talked.add(began.elapsed());
        self.advance()
    }

    /// Returns whether all of a group have sent their controls, or one is gone: then others may wait for it forever.
    pub(super) fn has_decided(&self, group: &Group) -> bool {
        let has_lost = group.iter().any(|&agent| self.is_gone(agent));
        has_lost || group.iter().all(|&agent| self.has_control(agent))
    }
}
