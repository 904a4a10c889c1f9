//! The maneuver of an airplane, as the state keeps it: its stored fallback, and its exempt pairs.

use crate::avoid::NonCooperativeAvoidance;
use crate::events::{Event, EventKind};
use crate::flight::Pose2;
use crate::non_cooperative::NonCooperativeAircraft;
use crate::perceive::ownship_state;
use crate::pilot::{Maneuver, OwnshipState};
use crate::scratch::PhaseContext;
use crate::shield::{ShieldedAircraft, TurnProfile};
use sidestep_kernel::EntitySlot;
use sidestep_kernel::math::wrap_angle;

/// Returns an airplane as the shield knows it: where all see it.
pub(super) fn shielded_aircraft(context: &PhaseContext<'_>, slot: EntitySlot) -> ShieldedAircraft {
    ownship_state(context, slot).shielded_aircraft(context.world, context.now)
}

/// Returns an airplane that is about to change its level or its speed, with the fallbacks that it may have then. Where
/// messages get lost only the stored one: others reckon with that, and may not hear of another one.
pub(super) fn changing_aircraft(context: &PhaseContext<'_>, slot: EntitySlot) -> ShieldedAircraft {
    let aircraft = shielded_aircraft(context, slot);
    if context.world.network.is_none() {
        return aircraft;
    }
    ShieldedAircraft { choices: [aircraft.fallback].into(), ..aircraft }
}

/// Exempts an airplane and the non-cooperative ones that could come too near on its path within `dt`, and ends the
/// exemption of pairs with others.
pub(super) fn exempt_non_cooperative(
    context: &mut PhaseContext<'_>,
    own: &OwnshipState,
    all: &[&NonCooperativeAircraft],
    profile: &TurnProfile,
) {
    let slot = own.id;
    let exempt = context.state.exempt_ids(slot);
    if all.is_empty() && exempt.is_empty() {
        return;
    }
    let &mut PhaseContext { world, state, now, ref mut scratch, .. } = context;
    let aircraft = own.shielded_aircraft(world, now);
    let avoidance =
        NonCooperativeAvoidance::new(&aircraft, all.iter().copied(), world.timing.dtau_s);
    let threats: Vec<&NonCooperativeAircraft> = avoidance.threats(profile).collect();
    let is_threat = |other: EntitySlot| threats.iter().any(|one| one.slot == other);
    state.retain_exempt(slot, |other| !world.is_non_cooperative(other, now) || is_threat(other));
    for one in all.iter().filter(|one| !is_threat(one.slot)) {
        state.retain_exempt(one.slot, |other| other != slot);
    }
    for one in threats.iter().filter(|one| !exempt.contains(&one.slot)) {
        state.exempt_pair(slot, one.slot);
        scratch.too_close.push((now, slot, one.slot));
        let apart_m = world.surface.distance_m(state.airplanes[slot as usize].pose().at, one.at);
        let event = Event::new_for_pair(now, EventKind::Intruder, slot, one.slot);
        scratch.events.push(event.with_value(apart_m));
    }
}

/// Stores the maneuver of an airplane, and records an event where it is not the preferred one.
pub(super) fn store_maneuver(
    context: &mut PhaseContext<'_>,
    slot: EntitySlot,
    maneuver: &Maneuver,
) {
    if *maneuver == Maneuver::Orbit {
        advance_orbit_pose(context, slot);
    }
    let &mut PhaseContext { world, state, now, ref mut scratch, .. } = context;
    let current = &state.airplanes[slot as usize];
    match *maneuver {
        Maneuver::Profile { candidate, fallback, is_common, .. } => {
            current.fallback.set(fallback);
            current.tracked.set(is_common.into());
            current.orbiting.set(0);
            if candidate > 0 {
                current.overrides.set(current.overrides.get() + 1);
                let event = Event::new(now, EventKind::Override, slot);
                scratch.events.push(event.with_value(f64::from(candidate)));
            }
        }
        Maneuver::Orbit => {
            current.overrides.set(current.overrides.get() + 1);
            current.orbits.set(current.orbits.get() + 1);
            current.orbiting.set(current.orbiting.get() + 1);
            current.fallback.set(current.fallback.get().after_cycle());
            // All see it fly its fallback.
            current.tracked.set(u16::from(world.has_common_plans()));
            scratch.events.push(Event::new(now, EventKind::Orbit, slot));
        }
    }
}

/// Moves the stored pose of an airplane along its orbit for one `dt`.
fn advance_orbit_pose(context: &PhaseContext<'_>, slot: EntitySlot) {
    let PhaseContext { world, state, now, .. } = *context;
    // Its orbit drifts with the air, as it does itself: with that where it is, even if errors have taken it off its orbit.
    let current = &state.airplanes[slot as usize];
    let air = world.flown_air(slot, now, (current.pose().at, current.altitude_m.get()));
    let fallback = state.airplanes[slot as usize].fallback.get();
    let v_m_s = state.segment(world, slot).model.v_m_s;
    let omega = fallback.omega_rad_s(world.orbit_rad_s[slot as usize]);
    let stored = state.orbit_pose(slot);
    let frame = world.surface.fallback_frame(stored, v_m_s, omega);
    let mut orbit_pose = frame.pose_to_local(stored);
    for _ in 0..world.timing.points_per_dt() {
        orbit_pose = air.after_wind_step(orbit_pose.step(v_m_s, omega, world.timing.dtau_s));
    }
    let orbit_pose = frame.pose_to_world(orbit_pose);
    state.set_orbit_pose(
        slot,
        Pose2 { heading_rad: wrap_angle(orbit_pose.heading_rad), ..orbit_pose },
    );
}
