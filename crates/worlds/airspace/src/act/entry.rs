//! Airplanes that come under the method during a run: they appear, or the method takes over from
//! their recorded way. Beside it, the pairs for which the shield promises nothing.
//!
//! Such a pair is *named* when the later of the two comes in and there are no orbits for it that
//! are apart. The name is that of a pair, not of two airplanes: each of them stays apart from all
//! others. It ends for good as soon as their stored orbits are apart, their levels do not meet, or
//! one of them is gone; from then on the invariant holds for this pair as for any other.

use super::protect::flyer;
use crate::Turn;
use crate::shield::{Flyer, entry_fallbacks};
use sidestep_kernel::Slot;

/// Ends the names of pairs that are safe by now. `flown` are the group's airplanes that the method
/// flies, by id.
///
/// Two airplanes that are not in one group are too far from each other to meet on their orbits, or
/// on levels that do not meet.
pub(super) fn release(turn: &Turn<'_>, flown: &[Slot]) {
    let Turn { world, state, now, .. } = *turn;
    for &slot in flown {
        let named = state.named_with(slot);
        if named.is_empty() {
            continue;
        }
        let own = flyer(turn, slot);
        state.keep_named(slot, |other| {
            // Pairs with intruders are checked anew in each `dt`, in `protect.rs`.
            world.is_intruder(other, now)
                || flown.binary_search(&other).is_ok()
                    && state.named_with(other).contains(&slot)
                    && !own.is_safe_with(&flyer(turn, other))
        });
    }
}

/// Lets airplanes of a group that come in now choose fallbacks apart from the stored ones, which
/// stay as they are. Pairs without such fallbacks are named. `flown` are the group's airplanes that
/// the method flies, by id.
///
/// Airplanes that could be too near one that comes in are in its group, so none is missed.
pub(super) fn admit(turn: &mut Turn<'_>, flown: &[Slot]) {
    let Turn { world, state, now, .. } = *turn;
    // At the start, the first fallbacks are those of the compiled scenario.
    let enters = |slot: &Slot| now > 0 && world.joins_in(*slot as usize) == now;
    if !flown.iter().any(enters) {
        return;
    }
    let flyers: Vec<Flyer> = flown.iter().map(|&slot| flyer(turn, slot)).collect();
    let (sides, too_close) = entry_fallbacks(&flyers, |i| enters(&flown[i]));
    for (&slot, side) in flown.iter().zip(sides) {
        state.airplanes[slot as usize].fallback.set(side);
    }
    for (i, j) in too_close {
        let (a, b) = (flown[i], flown[j]);
        state.name(a, b);
        turn.scratch.too_close.push((now, a, b));
    }
}
