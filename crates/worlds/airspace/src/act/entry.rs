//! Airplanes that come under the method during a run: they appear, or the method takes over from
//! their recorded way. Beside it, the pairs for which the shield promises nothing.
//!
//! Such a pair is *named* when the later of the two comes in and there are no orbits for it that
//! are apart. The name is that of a pair, not of two airplanes: each of them stays apart from all
//! others. It ends for good as soon as their stored orbits are apart, their levels do not meet, or
//! one of them is gone; from then on the invariant holds for this pair as for any other.

use super::protect::shielded_aircraft;
use crate::scratch::PhaseContext;
use crate::shield::{ShieldedAircraft, entry_fallbacks};
use sidestep_kernel::Slot;

/// Ends the names of pairs that are safe by now. `flown` are the group's airplanes that the method
/// flies, by id.
///
/// Two airplanes that are not in one group are too far from each other to meet on their orbits, or
/// on levels that do not meet.
pub(super) fn release_exempt(turn: &PhaseContext<'_>, flown: &[Slot]) {
    let PhaseContext { world, state, now, .. } = *turn;
    for &slot in flown {
        let named = state.exempt_with(slot);
        if named.is_empty() {
            continue;
        }
        let own = shielded_aircraft(turn, slot);
        state.retain_exempt(slot, |other| {
            // Pairs with intruders are checked anew in each `dt`, in `protect.rs`.
            world.is_non_cooperative(other, now)
                || flown.binary_search(&other).is_ok()
                    && state.exempt_with(other).contains(&slot)
                    && !own.is_safe_with(&shielded_aircraft(turn, other))
        });
    }
}

/// Lets airplanes of a group that come in now choose fallbacks apart from the stored ones, which
/// stay as they are. Pairs without such fallbacks are named. `flown` are the group's airplanes that
/// the method flies, by id.
///
/// Airplanes that could be too near one that comes in are in its group, so none is missed.
pub(super) fn assign_fallbacks(turn: &mut PhaseContext<'_>, flown: &[Slot]) {
    let PhaseContext { world, state, now, .. } = *turn;
    // At the start, the first fallbacks are those of the compiled scenario.
    let enters = |slot: &Slot| now > 0 && world.first_controlled_cycle(*slot as usize) == now;
    if !flown.iter().any(enters) {
        return;
    }
    let flyers: Vec<ShieldedAircraft> =
        flown.iter().map(|&slot| shielded_aircraft(turn, slot)).collect();
    let (sides, too_close) = entry_fallbacks(&flyers, |i| enters(&flown[i]));
    for (&slot, side) in flown.iter().zip(sides) {
        state.airplanes[slot as usize].fallback.set(side);
    }
    for (i, j) in too_close {
        let (a, b) = (flown[i], flown[j]);
        state.exempt_pair(a, b);
        turn.scratch.too_close.push((now, a, b));
    }
}
