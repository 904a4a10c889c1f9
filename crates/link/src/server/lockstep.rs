//! Lockstep: the server waits for every control, so that a fleet comes out as one process does, bit for bit.

use super::{Broken, LOOK, Server};
use std::time::Instant;

impl Server<'_> {
    /// Makes a cycle.
    ///
    /// # Errors
    /// When a node is gone, the world cannot go on, or somebody asks the fleet to end.
    pub(super) fn cycle_in_lockstep(&mut self) -> Result<(), Broken> {
        let began = Instant::now();
        let groups = self.hand_out_sights();
        if self.terms.has_faults {
            self.count_ticks(&groups)?;
        }
        while !self.has_controls(&groups) {
            self.hear(LOOK)?;
        }
        self.tally.talked.add(began.elapsed());
        self.advance(&groups)
    }
}
