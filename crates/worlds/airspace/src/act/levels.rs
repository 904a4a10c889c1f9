//! Changes of level, cleared in stages.
//!
//! An airplane that changes its level occupies in each `dt` only the levels that it passes in it. Its fallback in the
//! vertical is to level off, which it can at any time: between two `dt` it occupies no other level than its own. With the
//! shield, it passes only levels on which it has an orbit apart from the stored ones of all that it then has to avoid, so
//! that the invariant holds for them, too. Where there is none it levels off just short of them, and goes on once there
//! is. So those far above delay nobody on the ground.

use super::protect::changing_aircraft;
use crate::avoid::NonCooperativeAvoidance;
use crate::events::{Event, EventKind};
use crate::flight::FlightLevelRange;
use crate::non_cooperative::NonCooperativeAircraft;
use crate::perceive::ownship_state;
use crate::pilot::OwnshipState;
use crate::scratch::PhaseContext;
use crate::shield::{Fallback, ShieldedAircraft, altitude_short_of, next_altitude};
use crate::surveillance::PerceivedTraffic;
use sidestep_kernel::EntitySlot;

/// Lets the airplanes of a group keep their levels, until they are cleared for others.
pub(super) fn keep_levels(context: &PhaseContext<'_>, group: &[EntitySlot]) {
    for &slot in group {
        context.state.clear_to(slot, context.state.airplanes[slot as usize].altitude_m.get());
    }
}

/// Clears the changes of level of a group for the next `dt`: with the shield, as far as is safe. `flown` are the group's
/// airplanes that the method flies, by id.
pub(super) fn clear_levels(
    context: &mut PhaseContext<'_>,
    group: &[EntitySlot],
    flown: &[EntitySlot],
) {
    let PhaseContext { world, state, now, .. } = *context;
    let is_changing = |slot: EntitySlot| {
        let segment = state.segment(world, slot);
        let altitude_m = state.airplanes[slot as usize].altitude_m.get();
        segment.vertical_m_s(altitude_m) > 0.0 && altitude_m != segment.altitude_m
    };
    for &slot in group.iter().filter(|&&slot| is_changing(slot)) {
        if !world.shield || world.is_non_cooperative(slot, now) {
            state.clear_to(slot, state.segment(world, slot).altitude_m);
        }
    }
    let mut changing: Vec<usize> = (0..flown.len()).filter(|&k| is_changing(flown[k])).collect();
    if !world.shield || changing.is_empty() {
        return;
    }
    let non_cooperative = PerceivedTraffic::non_cooperative_aircraft(context, group);
    let mut all: Vec<ShieldedAircraft> =
        flown.iter().map(|&slot| changing_aircraft(context, slot)).collect();
    // One after the other, each with regard to the levels that those before it pass: by falling rank, as everywhere.
    changing.sort_unstable_by_key(|&k| std::cmp::Reverse(all[k].rank));
    for k in changing {
        let slot = flown[k];
        let current = &state.airplanes[slot as usize];
        let segment = state.segment(world, slot);
        let reach_m = segment.altitude_after_m(current.altitude_m.get(), world.timing.dt_s);
        let beside_m = |fallback| {
            altitude_beside_non_cooperative(context, slot, fallback, reach_m, &non_cooperative)
        };
        let seen_at = all[k].pose.at;
        let drift = |to_m| world.air_drift(seen_at, current.altitude_m.get(), to_m);
        let (altitude_m, fallback) = next_altitude(&all[k], reach_m, &all, drift, beside_m);
        if altitude_m == reach_m {
            // Where it is not held, its altitudes do not depend on the lengths of the stages.
            state.clear_to(slot, segment.altitude_m);
        } else {
            state.clear_to(slot, altitude_m);
            record_wait(context, slot, altitude_m);
        }
        current.fallback.set(fallback);
        all[k].fallback = fallback;
        all[k].levels = FlightLevelRange::between(current.altitude_m.get(), altitude_m);
        all[k].drift = drift(altitude_m);
    }
}

/// Records that an airplane has to level off at an altitude in meters short of where it may get in this `dt`: as a delay of
/// its order, or of the command of its method, which is told if it can do nothing of it.
fn record_wait(context: &mut PhaseContext<'_>, slot: EntitySlot, altitude_m: f64) {
    let &mut PhaseContext { state, now, ref mut scratch, .. } = context;
    let current = &state.airplanes[slot as usize];
    let command = state.command(slot);
    // Metrics take level-offs off these waits again.
    current.waits.set(current.waits.get().saturating_add(1));
    if command.in_force.level.is_none() {
        return;
    }
    scratch.events.push(Event::new(now, EventKind::CommandHeld, slot));
    if command.wish.level.is_some() && altitude_m == current.altitude_m.get() {
        state.record_command_override(slot);
    }
}

/// Returns the altitude in meters to which an airplane may go on the way to `reach_m` beside non-cooperative ones: on its
/// orbit to a side it has to keep clear of those on the levels that it comes to.
fn altitude_beside_non_cooperative(
    context: &PhaseContext<'_>,
    slot: EntitySlot,
    fallback: Fallback,
    reach_m: f64,
    non_cooperative: &[NonCooperativeAircraft],
) -> f64 {
    if non_cooperative.is_empty() {
        return reach_m;
    }
    let world = context.world;
    let own = OwnshipState { fallback, ..ownship_state(context, slot) };
    let levels = FlightLevelRange::between(own.altitude_m, reach_m);
    let passing = ShieldedAircraft { levels, ..own.shielded_aircraft(world, context.now) };
    let avoidance = NonCooperativeAvoidance::new(&passing, non_cooperative, world.timing.dtau_s);
    let falling_back = own.fallback_profile(world);
    // It can do nothing here about those whose levels it is on already.
    let ahead = avoidance
        .threats(&falling_back)
        .filter(|one| !one.levels.overlaps(&own.levels, world.vertical_m));
    ahead.fold(reach_m, |free_m, one| {
        altitude_short_of(one.levels, world.vertical_m, own.altitude_m, free_m)
    })
}
