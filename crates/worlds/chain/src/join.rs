//! Phase *join*: chains whose claims meet act together.

use super::world::ChainWorld;
use sidestep_kernel::conflict::ConflictGroups;
use sidestep_kernel::{PhaseContext, Slot};
use std::ops::Range;

/// Number of chains up to which comparing each with each is faster than sorting.
const MAX_PAIRWISE_CHAINS: usize = 32;

/// Joins chains with those whose claims meet theirs.
pub(crate) fn join<const D: usize>(
    phase: &mut PhaseContext<'_, ChainWorld<D>>,
    bodies: Range<usize>,
    groups: &ConflictGroups,
) {
    let state = phase.state;
    if state.len() <= MAX_PAIRWISE_CHAINS {
        return bodies.for_each(|slot| join_each(phase, slot, groups));
    }
    let neighbors = state.neighbors();
    for slot in bodies {
        neighbors.visit(slot, |other| groups.join_groups(slot as Slot, other));
    }
}

/// Joins one chain with those before it whose claims meet its own.
fn join_each<const D: usize>(
    phase: &mut PhaseContext<'_, ChainWorld<D>>,
    slot: usize,
    groups: &ConflictGroups,
) {
    let state = phase.state;
    let claim = state.claim(slot);
    for other in (0..slot).filter(|&other| state.claim(other).meets(&claim)) {
        groups.join_groups(slot as Slot, other as Slot);
    }
}
