//! Phase *join*: chains whose claims meet act together.

use super::world::ChainWorld;
use sidestep_kernel::conflict::Groups;
use sidestep_kernel::{Slot, Turn};

/// Joins one chain with those before it whose claims meet its own.
pub(crate) fn join<const D: usize>(
    turn: &mut Turn<'_, ChainWorld<D>>,
    slot: usize,
    groups: &Groups,
) {
    let state = turn.state;
    let claim = state.claim(slot);
    for other in (0..slot).filter(|&other| state.claim(other).meets(&claim)) {
        groups.join(slot as Slot, other as Slot);
    }
}
