//! The pilots of a group, on a network in memory.

use super::drive::drive;
use super::faulty::Faulty;
use crate::Turn;
use crate::agents::network::Network;
use crate::decide::Considered;
use crate::intruder::Intruder;
use crate::join::Flown;
use crate::pilot::{Control, Memory, Pilot, Schedule, Sight};
use crate::purpose;
use crate::state::AirspaceState;
use crate::world::AirspaceWorld;
use sidestep_kernel::ports::MemoryTransport;
use sidestep_kernel::{Cycle, Slot};
use std::sync::Arc;

/// Lets the pilots of a group decide. Returns what each does and what it has considered.
pub(crate) fn flown(
    turn: &mut Turn<'_>,
    flown: &Flown,
    intruders: &[Intruder],
) -> Vec<(Control, Considered)> {
    let Turn { world, state, now, clock, .. } = *turn;
    let began_ns = clock.thread_cpu_ns();
    let schedule = Schedule::of_cycle(now, world.network.as_ref());
    let sights = Sight::all(turn, flown, intruders);
    let mut transport = network(world, state, (now, schedule));
    let mut pilots = pilots(world, &flown.ids, state.take_memories(&flown.ids));
    for (pilot, sight) in pilots.iter_mut().zip(sights) {
        pilot.begin_by(sight, schedule);
    }
    drive(&mut transport, &mut pilots, schedule.begins, Pilot::has_decided);
    turn.scratch.decide_ns += clock.thread_cpu_ns() - began_ns;
    drive(&mut transport, &mut pilots, schedule.begins, Pilot::is_done);
    let over = |pilot: Pilot| pilot.into_outcome().expect("in memory all come to an end");
    pilots.into_iter().map(over).collect()
}

/// Lets pilots that have begun a cycle talk until all have come to an end.
#[cfg(test)]
pub(crate) fn fly_all(
    world: &AirspaceWorld,
    state: &AirspaceState,
    (now, schedule): (Cycle, Schedule),
    pilots: &mut [Pilot],
) {
    let mut transport = network(world, state, (now, schedule));
    drive(&mut transport, pilots, schedule.begins, Pilot::is_done);
}

/// Returns the network of the talks of a cycle.
fn network<'a>(
    world: &'a AirspaceWorld,
    state: &'a AirspaceState,
    (now, schedule): (Cycle, Schedule),
) -> Faulty<'a, MemoryTransport> {
    let faults = world.network.as_ref().map(Network::faults).unwrap_or_default();
    let memory = MemoryTransport::new(world.streams, purpose::NETWORK, faults);
    Faulty::new(memory, world, Some(state), (now, schedule))
}

fn pilots(world: &AirspaceWorld, flown: &[Slot], memories: Vec<Memory>) -> Vec<Pilot> {
    // Nearly all of a world is shared by its copies.
    let world = Arc::new(world.clone());
    let pilot = |(&slot, memory)| Pilot::remembering(world.clone(), slot, memory);
    flown.iter().zip(memories).map(pilot).collect()
}
