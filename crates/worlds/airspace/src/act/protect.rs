//! The course of an airplane, as the state keeps it: its stored fallback, and those that it is named with.

use crate::Turn;
use crate::avoid::Beset;
use crate::events::{Event, EventKind};
use crate::flight::{Pose, distance_m};
use crate::intruder::Intruder;
use crate::pilot::{Course, Own};
use crate::shield::{Flyer, Way};
use sidestep_kernel::Slot;
use sidestep_kernel::math::wrap_angle;

/// Returns an airplane as the shield knows it: where all see it.
pub(super) fn flyer(turn: &Turn<'_>, slot: Slot) -> Flyer {
    Own::of(turn, slot).flyer(turn.world)
}

/// Names an airplane with the intruders that could come too near on its way within `dt`, and ends
/// the names of others.
pub(super) fn name_intruders(turn: &mut Turn<'_>, own: &Own, all: &[Intruder], way: &Way) {
    let (slot, named) = (own.id, turn.state.named_with(own.id));
    if all.is_empty() && named.is_empty() {
        return;
    }
    let &mut Turn { world, state, now, ref mut scratch, .. } = turn;
    let flyer = own.flyer(world);
    let beset = Beset::new(&flyer, all, world.timing.dtau_s);
    let reached: Vec<&Intruder> = beset.reached_by(way).collect();
    let is_reached = |other: Slot| reached.iter().any(|one| one.slot == other);
    state.keep_named(slot, |other| !world.is_intruder(other, now) || is_reached(other));
    for one in all.iter().filter(|one| !is_reached(one.slot)) {
        state.keep_named(one.slot, |other| other != slot);
    }
    for one in reached.iter().filter(|one| !named.contains(&one.slot)) {
        state.name(slot, one.slot);
        scratch.too_close.push((now, slot, one.slot));
        let apart_m = distance_m(state.airplanes[slot as usize].pose().at, one.at);
        let event = Event::of_pair(now, EventKind::Intruder, slot, one.slot);
        scratch.events.push(event.with(apart_m));
    }
}

/// Stores the course of an airplane, and records it as an event where it is not its first wish.
pub(super) fn note(turn: &mut Turn<'_>, slot: Slot, course: &Course) {
    if *course == Course::Orbit {
        move_held(turn, slot);
    }
    let &mut Turn { state, now, ref mut scratch, .. } = turn;
    let cell = &state.airplanes[slot as usize];
    match *course {
        Course::Way { wish, side, .. } => {
            cell.fallback.set(side);
            cell.orbiting.set(0);
            if wish > 0 {
                cell.overrides.set(cell.overrides.get() + 1);
                let event = Event::of(now, EventKind::Override, slot);
                scratch.events.push(event.with(f64::from(wish)));
            }
        }
        Course::Orbit => {
            cell.overrides.set(cell.overrides.get() + 1);
            cell.orbits.set(cell.orbits.get() + 1);
            cell.orbiting.set(cell.orbiting.get() + 1);
            scratch.events.push(Event::of(now, EventKind::Orbit, slot));
        }
    }
}

/// Moves the stored pose of an airplane along its orbit for one `dt`.
fn move_held(turn: &Turn<'_>, slot: Slot) {
    let Turn { world, state, .. } = turn;
    let (side, v_m_s) =
        (state.airplanes[slot as usize].fallback.get(), state.stage(world, slot).model.v_m_s);
    let omega = side.sign() * world.orbit_rad_s[slot as usize];
    let mut held = state.held(slot);
    for _ in 0..world.timing.points_per_dt() {
        held = world.air().blown(held.step(v_m_s, omega, world.timing.dtau_s));
    }
    state.set_held(slot, Pose { heading_rad: wrap_angle(held.heading_rad), ..held });
}
