//! What an inspection records of a chain while it acts.

use crate::motion::recovery::RecoveryOutcome;
use sidestep_kernel::EntitySlot;
use sidestep_rods::Veto;
use sidestep_rods::geometry::Point;

/// The record of an inspection; runs make none.
#[derive(Debug, Clone, Default)]
pub(crate) struct InspectionTrace<const D: usize> {
    /// The chain that is inspected; all others record nothing.
    pub(crate) slot: EntitySlot,
    /// The move that its driver wanted.
    pub(crate) intended: Option<IntendedMove<D>>,
    /// The outcome of its initiator's recovery ladder.
    pub(crate) climbed: Option<RecoveryOutcome<D>>,
    /// Vetoes, in the order in which they arose.
    pub(crate) vetoes: Vec<Veto<D>>,
    /// Motions by which parts got out of the way.
    pub(crate) escapes: usize,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct IntendedMove<const D: usize> {
    pub(crate) connector: usize,
    pub(crate) words: &'static str,
    /// The position that the connector is to reach.
    pub(crate) to: Option<Point<D>>,
}
