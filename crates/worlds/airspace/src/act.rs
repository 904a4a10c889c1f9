//! Pool two: the airplanes of a group decide together and fly for `dt`.

mod approaches;
mod entry;
mod flight;
mod orders;
mod protect;
mod step;

use super::Turn;
use super::decide::wanted;
use super::flight::Known;
use super::perceive::known;
use super::shield::Way;
use flight::{Course, Flight};
use sidestep_kernel::Slot;

/// Lets a group decide, the shield filter, and all fly, those on recorded ways beside them.
pub(super) fn act(turn: &mut Turn<'_>, group: &[Slot]) {
    let Turn { world, state, now, .. } = *turn;
    let mut flying = std::mem::take(&mut turn.scratch.flying);
    flying.clear();
    flying.extend(group.iter().filter(|&&slot| state.is_there(world, slot, now)));
    flying.sort_unstable();
    if !flying.is_empty() {
        fly(turn, &flying);
    }
    turn.scratch.flying = flying;
}

/// `group` are the airplanes in the air, by id.
fn fly(turn: &mut Turn<'_>, group: &[Slot]) {
    let Turn { world, state, now, .. } = *turn;
    let flown: Vec<Slot> =
        group.iter().copied().filter(|&slot| !world.is_replayed(slot, now)).collect();
    if world.shield {
        entry::admit(turn, &flown);
    }
    orders::carry_out(turn, &flown);
    let mut ways = ways(turn, &flown).into_iter();
    let flights = group.iter().map(|&slot| {
        let course = match &world.airplanes[slot as usize].track {
            Some(track) if world.is_replayed(slot, now) => Course::Track(track),
            _ => Course::Way(ways.next().unwrap_or_default(), state.stage(world, slot)),
        };
        Flight::new(turn, slot, course)
    });
    let flights = flights.collect();
    step::step_all(turn, flights);
}

/// The ways that those fly whom the method flies.
fn ways(turn: &mut Turn<'_>, flown: &[Slot]) -> Vec<Way> {
    let Turn { world, state, now, clock, .. } = *turn;
    let group: Vec<Known> = flown.iter().map(|&slot| known(world, state, now, slot)).collect();
    let began_ns = clock.thread_cpu_ns();
    let mut contacts = state.take_contacts(flown);
    let candidates = wanted(turn, &group, &mut contacts);
    turn.scratch.decide_ns += clock.thread_cpu_ns() - began_ns;
    let ways = if world.shield {
        protect::shielded(turn, flown, candidates, &mut contacts)
    } else {
        candidates.into_iter().map(|ways| ways.into_iter().next().unwrap_or_default()).collect()
    };
    state.put_contacts(flown, contacts);
    ways
}
