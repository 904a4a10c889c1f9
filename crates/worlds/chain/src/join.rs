//! Phase *join*: chains whose claims meet act together.

use super::world::ChainWorld;
use sidestep_kernel::conflict::ConflictGroups;
use sidestep_kernel::{EntitySlot, PhaseContext};
use std::ops::Range;

/// Number of chains up to which comparing each with each is faster than sorting.
const MAX_PAIRWISE_CHAINS: usize = 32;

/// Joins chains with those whose claims meet theirs.
pub(crate) fn join_conflict_groups<const D: usize>(
    phase: &mut PhaseContext<'_, ChainWorld<D>>,
    bodies: Range<usize>,
    groups: &ConflictGroups,
) {
    let state = phase.state;
    if state.len() <= MAX_PAIRWISE_CHAINS {
        return bodies.for_each(|slot| join_conflicting_chains(phase, slot, groups));
    }
    let neighbors = state.sorted_claims();
    for slot in bodies {
        neighbors.visit(slot, |other| groups.join_groups(slot as EntitySlot, other));
    }
}

/// Joins one chain with those before it whose claims meet its own.
fn join_conflicting_chains<const D: usize>(
    phase: &mut PhaseContext<'_, ChainWorld<D>>,
    slot: usize,
    groups: &ConflictGroups,
) {
    let state = phase.state;
    let claim = state.claim(slot);
    for other in (0..slot).filter(|&other| state.claim(other).intersects(&claim)) {
        groups.join_groups(slot as EntitySlot, other as EntitySlot);
    }
}
