//! What a run is to be, and what it took.

use crate::units::Cycle;

/// What a scenario asks for, whatever its world.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    /// The scenario's name; may be empty.
    pub name: String,
    /// The seed.
    pub seed: u64,
    /// Cycles to run at most.
    pub cycles: Cycle,
    /// Cycles between two checkpoints; 0 for none.
    pub checkpoint_every: Cycle,
}

impl Plan {
    /// Cycles from one checkpoint to the next; the largest number where there is none.
    pub fn checkpoint_interval(&self) -> Cycle {
        if self.checkpoint_every == 0 { Cycle::MAX } else { self.checkpoint_every }
    }
}

/// What a run has seen and spent in this process, beside its results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Effort {
    /// Conflict groups by size: index k counts groups of `2^k .. 2^(k+1)` bodies.
    pub group_sizes: [u64; 32],
    /// The largest conflict group.
    pub largest_group: u64,
    /// Processor time of all workers.
    pub cpu_ns: u64,
}
