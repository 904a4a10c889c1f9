//! *Perceive*: airplanes list themselves in the neighborhood, and are perceived there.

use super::Turn;
use super::flight::{Known, Pose};
use super::purpose;
use super::state::AirspaceState;
use super::world::AirspaceWorld;
use sidestep_kernel::distr::normal;
use sidestep_kernel::{Cycle, Slot};
use std::ops::Range;

/// Lists those of `bodies` that are in the air.
pub(super) fn claim(turn: &mut Turn<'_>, bodies: Range<usize>) {
    let Turn { world, state, now, .. } = *turn;
    for slot in bodies {
        if state.is_there(world, slot as Slot, now) {
            let at = state.airplanes[slot].pose().at;
            state.neighborhood.enter(slot as Slot, at, now);
        }
    }
}

/// Returns a pose of an airplane as all see it in a cycle: with the error of that cycle.
pub(super) fn seen(world: &AirspaceWorld, slot: Slot, now: Cycle, mut pose: Pose) -> Pose {
    if world.disturbance.position_m > 0.0 {
        let mut draws = world.streams.draws(slot, now, purpose::POSITION);
        pose.at.iter_mut().for_each(|v| *v += world.disturbance.position_m * normal(&mut draws));
    }
    pose
}

/// Returns the group's knowledge of an airplane: its position with an error.
pub(super) fn known(world: &AirspaceWorld, state: &AirspaceState, now: Cycle, slot: Slot) -> Known {
    let cell = &state.airplanes[slot as usize];
    let pose = seen(world, slot, now, cell.pose());
    let (orders, altitude_m) = (u32::from(cell.orders.get()), cell.altitude_m.get());
    Known { slot, pose, next: cell.next.get() as usize, orders, altitude_m }
}
