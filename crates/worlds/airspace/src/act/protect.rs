//! The course of an airplane, as the state keeps it: its stored fallback, and those that it is named with.

use crate::avoid::NonCooperativeAvoidance;
use crate::events::{Event, EventKind};
use crate::flight::{Pose2, distance_m};
use crate::non_cooperative::NonCooperative;
use crate::perceive::ownship_state;
use crate::pilot::{Maneuver, OwnshipState};
use crate::scratch::PhaseContext;
use crate::shield::{ShieldedAircraft, TurnProfile};
use sidestep_kernel::Slot;
use sidestep_kernel::math::wrap_angle;

/// Returns an airplane as the shield knows it: where all see it.
pub(super) fn shielded_aircraft(turn: &PhaseContext<'_>, slot: Slot) -> ShieldedAircraft {
    ownship_state(turn, slot).shielded_aircraft(turn.world)
}

/// Names an airplane with the intruders that could come too near on its way within `dt`, and ends
/// the names of others.
pub(super) fn exempt_non_cooperative(
    turn: &mut PhaseContext<'_>,
    own: &OwnshipState,
    all: &[NonCooperative],
    way: &TurnProfile,
) {
    let (slot, named) = (own.id, turn.state.exempt_with(own.id));
    if all.is_empty() && named.is_empty() {
        return;
    }
    let &mut PhaseContext { world, state, now, ref mut scratch, .. } = turn;
    let flyer = own.shielded_aircraft(world);
    let beset = NonCooperativeAvoidance::new(&flyer, all, world.timing.dtau_s);
    let reached: Vec<&NonCooperative> = beset.threats(way).collect();
    let is_reached = |other: Slot| reached.iter().any(|one| one.slot == other);
    state.retain_exempt(slot, |other| !world.is_non_cooperative(other, now) || is_reached(other));
    for one in all.iter().filter(|one| !is_reached(one.slot)) {
        state.retain_exempt(one.slot, |other| other != slot);
    }
    for one in reached.iter().filter(|one| !named.contains(&one.slot)) {
        state.exempt_pair(slot, one.slot);
        scratch.too_close.push((now, slot, one.slot));
        let apart_m = distance_m(state.airplanes[slot as usize].pose().at, one.at);
        let event = Event::new_pair(now, EventKind::Intruder, slot, one.slot);
        scratch.events.push(event.with_value(apart_m));
    }
}

/// Stores the course of an airplane, and records it as an event where it is not its first wish.
pub(super) fn store_maneuver(turn: &mut PhaseContext<'_>, slot: Slot, course: &Maneuver) {
    if *course == Maneuver::Orbit {
        advance_orbit_pose(turn, slot);
    }
    let &mut PhaseContext { state, now, ref mut scratch, .. } = turn;
    let cell = &state.airplanes[slot as usize];
    match *course {
        Maneuver::Way { wish, side, .. } => {
            cell.fallback.set(side);
            cell.orbiting.set(0);
            if wish > 0 {
                cell.overrides.set(cell.overrides.get() + 1);
                let event = Event::new(now, EventKind::Override, slot);
                scratch.events.push(event.with_value(f64::from(wish)));
            }
        }
        Maneuver::Orbit => {
            cell.overrides.set(cell.overrides.get() + 1);
            cell.orbits.set(cell.orbits.get() + 1);
            cell.orbiting.set(cell.orbiting.get() + 1);
            scratch.events.push(Event::new(now, EventKind::Orbit, slot));
        }
    }
}

/// Moves the stored pose of an airplane along its orbit for one `dt`.
fn advance_orbit_pose(turn: &PhaseContext<'_>, slot: Slot) {
    let PhaseContext { world, state, .. } = turn;
    let (side, v_m_s) =
        (state.airplanes[slot as usize].fallback.get(), state.segment(world, slot).model.v_m_s);
    let omega = side.sign() * world.orbit_rad_s[slot as usize];
    let mut held = state.orbit_pose(slot);
    for _ in 0..world.timing.points_per_dt() {
        held = world.air().after_wind_step(held.step(v_m_s, omega, world.timing.dtau_s));
    }
    state.set_orbit_pose(slot, Pose2 { heading_rad: wrap_angle(held.heading_rad), ..held });
}
