//! Orders that are due, and the conditions for carrying them out.
//!
//! With the shield, a new speed or level is accepted only when the airplane then has a fallback
//! apart from all stored ones, because otherwise the invariant would be lost; until then the order
//! waits, and those after it wait with it. While it changes its level, an airplane occupies the old
//! one, the new one and all between.

use super::protect::shielded_aircraft;
use crate::flight::{FlightOrder, FlightTask, Levels};
use crate::scratch::PhaseContext;
use crate::shield::{ShieldedAircraft, Side, safe_side};
use sidestep_kernel::Slot;

/// Carries out the orders of a group that are due and, with the shield, may be; the others
/// wait. `flown` are the group's airplanes that the method flies, by id.
pub(super) fn carry_out(turn: &PhaseContext<'_>, group: &[Slot], flown: &[Slot]) {
    let PhaseContext { world, state, now, .. } = turn;
    for &slot in group.iter().filter(|&&slot| !world.is_replayed(slot, *now)) {
        let (airplane, cell) = (&world.airplanes[slot as usize], &state.airplanes[slot as usize]);
        while let Some(order) =
            airplane.due_order(cell.orders.get().into(), world.cycle_start_s(*now))
        {
            let Some(side) = fallback_after(turn, flown, slot, order) else {
                cell.waits.set(cell.waits.get().saturating_add(1));
                break;
            };
            let later = &world.later[slot as usize][usize::from(cell.orders.get())];
            cell.orders.set(cell.orders.get() + 1);
            cell.next.set(later.next.unwrap_or(cell.next.get()));
            cell.fallback.set(side);
        }
    }
}

/// Returns the fallback that an airplane has when it carries out its next order, if it may.
fn fallback_after(
    turn: &PhaseContext<'_>,
    flown: &[Slot],
    slot: Slot,
    order: &FlightOrder,
) -> Option<Side> {
    let PhaseContext { world, state, now, .. } = turn;
    let cell = &state.airplanes[slot as usize];
    let changes_safety = matches!(order.task, FlightTask::Speed(_) | FlightTask::Altitude { .. });
    if !world.shield || !changes_safety || world.is_non_cooperative(slot, *now) {
        return Some(cell.fallback.get());
    }
    let stage = world.segment(slot, u32::from(cell.orders.get()) + 1);
    let changed = ShieldedAircraft {
        v_m_s: stage.model.v_m_s,
        levels: Levels::between(cell.altitude_m.get(), stage.altitude_m),
        ..shielded_aircraft(turn, slot)
    };
    let others = flown.iter().filter(|&&other| other != slot);
    safe_side(&changed, others.map(|&other| shielded_aircraft(turn, other)))
}
