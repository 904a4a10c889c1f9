//! The settings of a run, its conflict groups, and its processor time.

use crate::series::SeriesInterval;
use crate::units::Cycle;
use serde::{Deserialize, Serialize};

/// The settings of a run that every scenario has, in any world.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunConfig {
    /// The scenario's name; may be empty.
    pub name: String,
    /// The seed from which all randomness of the run grows.
    pub seed: u64,
    /// The maximum number of cycles; a run in which nothing can happen anymore ends before.
    pub cycles: Cycle,
    /// Number of cycles between two checkpoints; 0 for none.
    pub checkpoint_every: Cycle,
    /// Number of cycles between two rows of the metrics over time, 0 for none; `None` for one that follows from the
    /// number of cycles.
    pub series_every: Option<Cycle>,
}

impl RunConfig {
    /// Returns the number of cycles between two checkpoints; the largest number where there are
    /// none.
    pub fn checkpoint_interval(&self) -> Cycle {
        if self.checkpoint_every == 0 { Cycle::MAX } else { self.checkpoint_every }
    }

    /// Returns the cycles after which a recorded run keeps its metrics.
    pub fn series_interval(&self) -> SeriesInterval {
        match self.series_every {
            Some(every) => SeriesInterval::every_cycles(every),
            None => SeriesInterval::from_planned_cycles(self.cycles),
        }
    }
}

/// The conflict groups of a run since its start, and its processor time in this process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RunStats {
    /// The conflict groups, those before a resumed checkpoint included.
    pub groups: GroupSizeHistogram,
    /// Processor time of all workers, in nanoseconds.
    pub cpu_ns: u64,
    /// Processor time of the phase *plan*, in nanoseconds.
    pub plan_ns: u64,
}

/// Conflict groups by size: a sum over cycles, which checkpoints keep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct GroupSizeHistogram {
    /// Number of groups by size: index k counts groups of `2^k .. 2^(k+1)` bodies, up to the 2^32 that slots can
    /// number.
    pub counts: [u64; 32],
    /// Number of bodies of the largest group with a conflict; 0 if there was none.
    pub largest: u64,
}

impl GroupSizeHistogram {
    /// Counts a group of several bodies.
    pub(crate) fn add(&mut self, size: usize) {
        self.counts[size.ilog2() as usize] += 1;
        self.largest = self.largest.max(size as u64);
    }

    /// Adds the groups of other cycles, or of another worker.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.counts.iter_mut().zip(other.counts).for_each(|(sum, n)| *sum += n);
        self.largest = self.largest.max(other.largest);
    }
}
