//! The pilots of a group, on a network in memory.

use super::drive::drive;
use crate::Turn;
use crate::decide::Considered;
use crate::intruder::Intruder;
use crate::join::Flown;
use crate::pilot::{Control, Memory, Pilot, Schedule, Sight};
use crate::purpose;
use crate::state::AirspaceState;
use crate::world::AirspaceWorld;
use sidestep_kernel::network::{Apart, Carrier, Ether, FaultStreams};
use sidestep_kernel::ports::MemoryTransport;
use sidestep_kernel::{Cycle, EntityId, Slot};
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
    let talks = world.talks(now, schedule);
    let mut transport = network(world, state, &talks);
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
    let talks = world.talks(now, schedule);
    let mut transport = network(world, state, &talks);
    drive(&mut transport, pilots, schedule.begins, Pilot::is_done);
}

/// Returns the network of the talks of a cycle.
fn network<'a>(
    world: &'a AirspaceWorld,
    state: &'a AirspaceState,
    talks: &'a [(u64, f64)],
) -> Carrier<'a, MemoryTransport> {
    Carrier::in_memory((world.network.as_ref(), world.draws()), Some(state), talks)
}

impl Apart for AirspaceState {
    fn apart_m(&self, link: [EntityId; 2]) -> f64 {
        AirspaceState::apart_m(self, link)
    }
}

impl AirspaceWorld {
    /// Returns the first tick of each talk of a cycle, and its time in seconds after the start of the run: the
    /// first talk starts with the cycle, and the shield's exchange when that has to be over.
    fn talks(&self, now: Cycle, schedule: Schedule) -> [(u64, f64); 2] {
        let starts_s = self.starts_s(now);
        let deadline_s = self.network.as_ref().map_or(0.0, |network| network.deadline_s);
        [(schedule.begins, starts_s), (schedule.shield_from, starts_s + deadline_s)]
    }

    /// Returns the faults of what one airplane sends where each is flown by a process of its own; none where
    /// the network is reliable.
    pub fn ether(&self) -> Option<Ether> {
        Some(Ether::new(self.network.clone()?, self.draws()))
    }

    /// Returns the first tick of each talk of a cycle, and its time in seconds after the start of the run.
    pub fn talks_of(&self, now: Cycle) -> [(u64, f64); 2] {
        self.talks(now, Schedule::of_cycle(now, self.network.as_ref()))
    }

    /// Returns the streams and purposes from which faults are drawn.
    fn draws(&self) -> FaultStreams {
        purpose::of_network(self.streams)
    }
}

fn pilots(world: &AirspaceWorld, flown: &[Slot], memories: Vec<Memory>) -> Vec<Pilot> {
    // Nearly all of a world is shared by its copies.
    let world = Arc::new(world.clone());
    let pilot = |(&slot, memory)| Pilot::remembering(world.clone(), slot, memory);
    flown.iter().zip(memories).map(pilot).collect()
}
