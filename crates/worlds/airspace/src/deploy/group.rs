//! The pilots of a group, on a network in memory.

use super::Deployment;
use super::drive::drive;
use super::faulty::Faulty;
use crate::Turn;
use crate::agents::coordinator::{self, Journey, Migration, parts};
use crate::agents::network::{Network, Traffic};
use crate::agents::{Conclusion, Ended, OwnShip};
use crate::decide::{Considered, Manner};
use crate::flight::Known;
use crate::intruder::Intruder;
use crate::pilot::{Control, Memory, Pilot, Schedule, Sight, Topic, own_ship, patience};
use crate::purpose;
use crate::state::AirspaceState;
use crate::world::AirspaceWorld;
use sidestep_kernel::ports::MemoryTransport;
use sidestep_kernel::{Cycle, Slot};
use std::sync::Arc;

/// Lets the pilots of a group decide. Returns what each does and what it has considered; `flown` are the group's
/// airplanes that the method flies, by id.
pub(crate) fn flown(
    turn: &mut Turn<'_>,
    flown: &[Slot],
    intruders: &[Intruder],
) -> Vec<(Control, Considered)> {
    let Turn { world, state, now, clock, .. } = *turn;
    let began_ns = clock.thread_cpu_ns();
    let schedule = Schedule::of_cycle(now, world.network.as_ref());
    let sights = Sight::all(turn, flown, intruders);
    let mut transport = network(world, state, (now, schedule));
    let mut pilots = pilots(world, flown, state.take_memories(flown));
    let migrates = matches!(world.deployment, Deployment::Pim | Deployment::HierarchicalPim);
    let group: Vec<Known> = sights.iter().map(|sight| sight.own.known()).collect();
    if migrates && Manner::of(world, &group, intruders) == Manner::Optimizing {
        let own = |(sight, pilot): (&Sight, &Pilot)| own_ship(world, sight, pilot.contacts());
        let own: Vec<OwnShip> = sights.iter().zip(&pilots).map(own).collect();
        let (ended, mut traffic) = migrated(world, &mut transport, &own, schedule);
        for ((pilot, sight), ended) in pilots.iter_mut().zip(sights).zip(ended) {
            pilot.begin_told(sight, schedule, ended, std::mem::take(&mut traffic));
        }
    } else {
        for (pilot, sight) in pilots.iter_mut().zip(sights) {
            pilot.begin_by(sight, schedule);
        }
    }
    drive(&mut transport, &mut pilots, schedule.begins, Pilot::has_decided);
    turn.scratch.decide_ns += clock.thread_cpu_ns() - began_ns;
    drive(&mut transport, &mut pilots, schedule.begins, Pilot::is_done);
    let over = |pilot: Pilot| {
        let control = pilot.control().expect("on a network in memory all come to an end");
        (control, pilot.considered())
    };
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
    let (network, streams) = (world.network.as_ref(), world.streams);
    let faults = network.map(Network::faults).unwrap_or_default();
    let memory = MemoryTransport::new(streams, purpose::NETWORK, faults);
    Faulty::new(memory, (network, streams), Some(state), (world.starts_s(now), schedule))
}

fn pilots(world: &AirspaceWorld, flown: &[Slot], memories: Vec<Memory>) -> Vec<Pilot> {
    // Nearly all of a world is shared by its copies.
    let world = Arc::new(world.clone());
    let pilot = |(&slot, memory)| Pilot::remembering(world.clone(), slot, memory);
    flown.iter().zip(memories).map(pilot).collect()
}

/// Lets a coordinator for each part of a group migrate.
fn migrated(
    world: &AirspaceWorld,
    transport: &mut Faulty<'_, MemoryTransport>,
    own: &[OwnShip],
    schedule: Schedule,
) -> (Vec<Ended<Conclusion>>, Traffic) {
    let parts = match world.deployment {
        Deployment::HierarchicalPim => parts(own),
        _ => vec![(0..own.len()).collect()],
    };
    let is_silent = |own: &OwnShip| world.is_silent(own.known.slot, own.briefing.now);
    let silent: Vec<bool> = own.iter().map(is_silent).collect();
    let (begin, end) = schedule.of(Topic::Decision, schedule.begins);
    let network = world.network.as_ref();
    let patience = network.map(|_| patience(network, Topic::Decision));
    let journey = Journey { begin, end, patience };
    coordinator::run(Migration::new(transport, own, &silent, journey), &parts)
}
