//! Airplanes that come under the method during a run: they appear, or their recorded way is
//! handed over.

use super::protect::flyer;
use crate::Turn;
use crate::shield::{Flyer, entry_fallbacks};
use sidestep_kernel::Slot;

/// Lets airplanes of a group that come in now choose fallbacks apart from the stored ones, which
/// nobody changes for them. Pairs for which there are none are noted: the shield promises nothing
/// for them. `flown` are the group's airplanes that the method flies, by id.
///
/// Whoever could be too near an airplane that comes in is in its group, so this is complete.
pub(super) fn admit(turn: &mut Turn<'_>, flown: &[Slot]) {
    let &mut Turn { world, state, now, ref mut scratch, .. } = turn;
    // First fallbacks at the start are the compiled scenario's.
    let enters = |slot: &Slot| now > 0 && world.joins_in(*slot as usize) == now;
    if !flown.iter().any(enters) {
        return;
    }
    let flyers: Vec<Flyer> = flown.iter().map(|&slot| flyer(world, state, slot)).collect();
    let (sides, too_close) = entry_fallbacks(&flyers, |i| enters(&flown[i]));
    for (&slot, side) in flown.iter().zip(sides) {
        state.airplanes[slot as usize].set_side(side);
    }
    for (i, j) in too_close {
        let pair = [flown[i], flown[j]];
        pair.iter().for_each(|&slot| state.airplanes[slot as usize].set_too_close());
        scratch.too_close.push((now, pair[0], pair[1]));
    }
}
