//! *Act*: the airplanes of a group decide together and fly for `dt`.

mod approaches;
mod avoid;
mod entry;
mod errors;
mod flight;
mod orders;
mod protect;
mod step;

use super::Turn;
use super::decide::{straight_way, wanted};
use super::flight::Known;
use super::intruder::Intruder;
use super::perceive::{intruders, known};
use super::shield::Way;
use flight::{Course, Flight};
use sidestep_kernel::Slot;

/// Lets a group decide, the shield filter, and all fly, together with those on recorded ways.
pub(super) fn act(turn: &mut Turn<'_>, group: &[Slot]) {
    let Turn { world, state, now, .. } = *turn;
    let mut flying = std::mem::take(&mut turn.scratch.flying);
    flying.clear();
    flying.extend(group.iter().filter(|&&slot| state.is_there(world, slot, now)));
    flying.sort_unstable();
    if !flying.is_empty() {
        let before = turn.scratch.events.len();
        fly(turn, &flying);
        for event in &mut turn.scratch.events[before..] {
            let cell = &state.airplanes[event.airplane as usize];
            let [x_m, y_m] = cell.pose().at;
            event.at_m = Some([x_m, y_m, cell.altitude_m.get()]);
        }
    }
    turn.scratch.flying = flying;
}

/// Flies a group for one `dt`; `group` are the airplanes in the air, by id.
fn fly(turn: &mut Turn<'_>, group: &[Slot]) {
    let Turn { world, state, now, .. } = *turn;
    let flown = begin(turn, group);
    let intruders = intruders(turn, group);
    let mut ways = ways(turn, &flown, &intruders).into_iter();
    let flights = group.iter().map(|&slot| {
        let course = match &world.airplanes[slot as usize].track {
            Some(track) if world.is_replayed(slot, now) => Course::Track(track),
            _ if world.is_intruder(slot, now) => {
                Course::Way(straight_way(turn, slot), state.stage(world, slot))
            }
            _ => Course::Way(ways.next().unwrap_or_default(), state.stage(world, slot)),
        };
        Flight::new(turn, slot, course)
    });
    let flights = flights.collect();
    step::step_all(turn, flights);
}

/// Does what comes before decisions: airplanes come in, names of pairs begin and end, and orders that
/// are due are carried out. Returns the airplanes of a group that the method flies, by id; `group` are
/// those in the air.
pub(super) fn begin(turn: &mut Turn<'_>, group: &[Slot]) -> Vec<Slot> {
    let (world, now) = (turn.world, turn.now);
    let flown: Vec<Slot> =
        group.iter().copied().filter(|&slot| !world.is_intruder(slot, now)).collect();
    if world.shield {
        entry::release(turn, &flown);
        entry::admit(turn, &flown);
        errors::name(turn, &flown);
    }
    orders::carry_out(turn, group, &flown);
    flown
}

/// Returns the ways of the airplanes that the method flies.
fn ways(turn: &mut Turn<'_>, flown: &[Slot], intruders: &[Intruder]) -> Vec<Way> {
    let Turn { world, state, now, clock, .. } = *turn;
    let group: Vec<Known> = flown.iter().map(|&slot| known(world, state, now, slot)).collect();
    let began_ns = clock.thread_cpu_ns();
    let mut contacts = state.take_contacts(flown);
    if let Some(notes) = &mut turn.scratch.notes {
        notes.begin(&group, intruders, &contacts);
    }
    let candidates = wanted(turn, &group, intruders, &mut contacts);
    turn.scratch.decide_ns += clock.thread_cpu_ns() - began_ns;
    if let Some(notes) = &mut turn.scratch.notes {
        notes.ways = notes.own(&candidates).cloned().unwrap_or_default();
    }
    let ways: Vec<Way> = if world.shield {
        protect::shielded(turn, flown, candidates, intruders, &mut contacts)
    } else {
        candidates.into_iter().map(|ways| ways.into_iter().next().unwrap_or_default()).collect()
    };
    state.put_contacts(flown, contacts);
    if let Some(notes) = &mut turn.scratch.notes {
        notes.flown = notes.own(&ways).cloned();
    }
    ways
}
