//! Legs that airplanes have flown, for tables and measures.

use super::flight::{ConstantRateLeg, Pose2};
use sidestep_kernel::{Cycle, EntityId};

/// A leg that an airplane has flown in a cycle; at the end of its flight one that takes no time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FlownLeg {
    pub(super) cycle: Cycle,
    pub(super) airplane: EntityId,
    /// The leg, in the frame in which it was flown.
    pub(super) leg: ConstantRateLeg,
    /// The pose at its start, in coordinates of the scenario.
    pub(super) start: Pose2,
}

impl FlownLeg {
    /// Returns the sort key of the table's rows. The legs of one airplane in a cycle are gathered
    /// together, in their order.
    pub(super) fn key(&self) -> (Cycle, EntityId) {
        (self.cycle, self.airplane)
    }
}
