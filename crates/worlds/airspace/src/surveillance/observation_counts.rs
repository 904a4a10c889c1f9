//! What a run counts of observations.

use serde::{Deserialize, Serialize};

/// Sums over observations: one is of another airplane by an observer in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ObservationCounts {
    /// Number of observations.
    pub observations: u64,
    /// Number of those in which the observer had a track.
    pub tracked: u64,
    /// Sum of the ages of these tracks, in steps of `dtau`.
    pub age_steps: u64,
}

impl ObservationCounts {
    /// Adds the sums of another part of the run.
    pub(crate) fn add(&mut self, other: Self) {
        self.observations += other.observations;
        self.tracked += other.tracked;
        self.age_steps += other.age_steps;
    }
}
