//! *Act*: the airplanes of a group decide together and fly for `dt`.
//!
//! ```text
//! begin            airplanes come in, orders are carried out
//! Sight            the perceptions of each                        pilot/sight.rs
//!   -> Control     the decision for each: by one process for all (direct.rs), their pilots (deploy/),
//!                  or pilots outside of the run (pilot/fleet.rs)
//! obey             the controls are booked                        obey.rs, protect.rs
//! step_all         all fly                                        step.rs
//! ```

mod approaches;
mod direct;
mod entry;
mod errors;
mod flight;
mod obey;
mod orders;
mod protect;
mod step;

use super::Turn;
use super::decide::{Considered, straight_way};
use super::deploy::{self, Deployment};
use super::intruder::Intruder;
use super::join::Flown;
use super::perceive::intruders;
use super::pilot::{Control, Own};
use super::shield::Way;
use flight::{Course, Flight};
use obey::obey;
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

/// Prepares the decisions: airplanes come in, names of pairs begin and end, and orders that are due are carried out.
/// Returns the airplanes of a group that the method flies; `group` are those in the air, by id.
pub(super) fn begin(turn: &mut Turn<'_>, group: &[Slot]) -> Flown {
    // Nearness is that at the time when the group was formed, because orders change levels.
    let flown = Flown::of(turn, group);
    if turn.world.shield {
        entry::release(turn, &flown.ids);
        entry::admit(turn, &flown.ids);
        errors::name(turn, &flown.ids);
    }
    orders::carry_out(turn, group, &flown.ids);
    flown
}

/// Returns the ways of the airplanes that the method flies: as those aboard decide, or as given by pilots outside of
/// the run.
fn ways(turn: &mut Turn<'_>, flown: &Flown, intruders: &[Intruder]) -> Vec<Way> {
    let Turn { world, state, now, .. } = *turn;
    let own: Vec<Own> = flown.ids.iter().map(|&slot| Own::of(turn, slot)).collect();
    let contacts = turn.scratch.notes.as_ref().map(|notes| state.contacts(notes.slot));
    let (controls, considered): (Vec<Option<Control>>, Vec<Considered>) = if state.is_handed(now) {
        (state.take_handed(&flown.ids), vec![Considered::default(); own.len()])
    } else {
        let all = match world.deployment {
            Deployment::Direct => direct::decided(turn, &own, intruders),
            _ => deploy::flown(turn, flown, intruders),
        };
        all.into_iter().map(|(control, considered)| (Some(control), considered)).unzip()
    };
    if let Some(notes) = &mut turn.scratch.notes {
        notes.contacts = contacts.unwrap_or_default();
        notes.decided(world, &own, intruders, &controls, &considered);
    }
    let ways = obey(turn, &own, intruders, controls);
    if let Some(notes) = &mut turn.scratch.notes {
        notes.flown = notes.own(&ways).cloned();
    }
    ways
}
