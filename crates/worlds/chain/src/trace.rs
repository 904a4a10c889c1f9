//! Notes on one chain while it acts.

use crate::motion::recovery::RecoveryOutcome;
use sidestep_kernel::Slot;
use sidestep_rods::Veto;
use sidestep_rods::geometry::Point;

/// Notes for an inspection; no run makes any.
#[derive(Debug, Clone, Default)]
pub(crate) struct InspectionTrace<const D: usize> {
    /// The chain.
    pub(crate) slot: Slot,
    /// Its driver's wish.
    pub(crate) wish: Option<IntendedMove<D>>,
    /// Its initiator's steps on the ladder.
    pub(crate) climbed: Option<RecoveryOutcome<D>>,
    /// Objections, in their order.
    pub(crate) vetoes: Vec<Veto<D>>,
    /// Motions by which parts got out of the way.
    pub(crate) escapes: usize,
}

/// A driver's wish.
#[derive(Debug, Clone, Copy)]
pub(crate) struct IntendedMove<const D: usize> {
    /// The connector that wants it.
    pub(crate) of: usize,
    /// The note in words.
    pub(crate) words: &'static str,
    /// The place that the initiator wants to reach.
    pub(crate) to: Option<Point<D>>,
}
