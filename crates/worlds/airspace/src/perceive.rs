//! Pool one: airplanes list themselves in the neighborhood, and are perceived there.

use super::Turn;
use super::flight::Known;
use super::purpose;
use super::state::AirspaceState;
use super::world::AirspaceWorld;
use sidestep_kernel::distr::normal;
use sidestep_kernel::{Cycle, Slot};
use std::ops::Range;

/// Lists those of `bodies` that are there.
pub(super) fn claim(turn: &mut Turn<'_>, bodies: Range<usize>) {
    let Turn { world, state, now, .. } = *turn;
    for slot in bodies {
        if state.is_there(world, slot as Slot, now) {
            let at = state.airplanes[slot].pose().at;
            state.neighborhood.enter(slot as Slot, at, now);
        }
    }
}

/// Returns what the group knows of an airplane: its position with an error.
pub(super) fn known(world: &AirspaceWorld, state: &AirspaceState, now: Cycle, slot: Slot) -> Known {
    let cell = &state.airplanes[slot as usize];
    let mut pose = cell.pose();
    if world.disturbance.position_m > 0.0 {
        let mut draws = world.streams.draws(slot, now, purpose::POSITION);
        pose.at.iter_mut().for_each(|v| *v += world.disturbance.position_m * normal(&mut draws));
    }
    let (orders, altitude_m) = (u32::from(cell.orders.get()), cell.altitude_m.get());
    Known { slot, pose, next: cell.next.get() as usize, orders, altitude_m }
}
