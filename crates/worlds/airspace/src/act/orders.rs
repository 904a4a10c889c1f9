//! Orders that are due, and the conditions on which they are executed.
//!
//! With the shield, a new speed is accepted only when the airplane then has a fallback apart from all stored
//! ones, because otherwise the invariant would be lost; until then the order waits, and so do those after it. A new level
//! is accepted at once, and the way to it cleared in stages (`levels.rs`).

use super::protect::{changing_aircraft, shielded_aircraft};
use crate::flight::{AircraftModel, DoneOrders, FlightOrder};
use crate::scratch::PhaseContext;
use crate::shield::{Fallback, ShieldedAircraft, safe_fallback};
use sidestep_kernel::EntitySlot;

/// Executes the orders of a group that are due and, with the shield, safe; the others wait. `flown` are the group's
/// airplanes that the method flies, by id.
pub(super) fn execute_due_orders(
    context: &PhaseContext<'_>,
    group: &[EntitySlot],
    flown: &[EntitySlot],
) {
    let PhaseContext { world, state, now, .. } = context;
    for &slot in group.iter().filter(|&&slot| !world.is_replayed(slot, *now)) {
        let airplane = &world.airplanes[slot as usize];
        let current = &state.airplanes[slot as usize];
        let mut done = DoneOrders::at_cycle_start(current.orders.get().into());
        while let Some(order) = airplane.due_order(done, world.cycle_start_s(*now)) {
            let Some(fallback) = fallback_after_order(context, flown, slot, order) else {
                current.waits.set(current.waits.get().saturating_add(1));
                break;
            };
            let later = &world.later[slot as usize][done.count];
            done = done.and(order);
            current.orders.set(done.count as u16);
            current.next.set(later.next.unwrap_or(current.next.get()));
            current.fallback.set(fallback);
        }
    }
}

/// Returns the fallback that an airplane has when it executes its next order, if it may.
fn fallback_after_order(
    context: &PhaseContext<'_>,
    flown: &[EntitySlot],
    slot: EntitySlot,
    order: &FlightOrder,
) -> Option<Fallback> {
    let PhaseContext { world, state, now, .. } = context;
    let current = &state.airplanes[slot as usize];
    let is_speed_commanded = state.command_in_force(slot).v_m_s.is_some();
    let keeps_speed = order.task.speed_m_s().is_none() || is_speed_commanded;
    if !world.shield || keeps_speed || world.is_non_cooperative(slot, *now) {
        return Some(current.fallback.get());
    }
    let segment = world.segment(slot, u32::from(current.orders.get()) + 1);
    fallback_at_speed(context, flown, slot, &segment.model)
}

/// Returns the fallback with which an airplane is apart from the stored ones of all others of its group once it flies
/// with the speed of `model`, if there is one.
pub(super) fn fallback_at_speed(
    context: &PhaseContext<'_>,
    flown: &[EntitySlot],
    slot: EntitySlot,
    model: &AircraftModel,
) -> Option<Fallback> {
    let before = changing_aircraft(context, slot);
    let changed = ShieldedAircraft {
        v_m_s: model.v_m_s,
        omega_max_rad_s: model.omega_max_rad_s,
        ..before.clone()
    };
    let others = flown
        .iter()
        .filter(|&&other| other != slot)
        .map(|&other| shielded_aircraft(context, other));
    safe_fallback(&changed, &before, others)
}
