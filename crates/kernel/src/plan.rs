//! The plan of a run, and the effort that it took.

use crate::units::Cycle;

/// The settings of a run that every scenario has, whatever its world.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    /// The scenario's name; may be empty.
    pub name: String,
    /// The seed.
    pub seed: u64,
    /// The maximum number of cycles.
    pub cycles: Cycle,
    /// Number of cycles between two checkpoints; 0 for none.
    pub checkpoint_every: Cycle,
}

impl Plan {
    /// Returns the number of cycles between two checkpoints; the largest number where there are
    /// none.
    pub fn checkpoint_interval(&self) -> Cycle {
        if self.checkpoint_every == 0 { Cycle::MAX } else { self.checkpoint_every }
    }
}

/// Conflict groups and processor time of a run in this process, beside its results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Effort {
    /// Conflict groups by size: index k counts groups of `2^k .. 2^(k+1)` bodies.
    pub group_sizes: [u64; 32],
    /// The largest conflict group.
    pub largest_group: u64,
    /// Processor time of all workers, in nanoseconds.
    pub cpu_ns: u64,
}
