//! *Perceive*: airplanes enter the spatial index, and what each of them and its group perceives.

use super::flight::{FlightLevelRange, KnownAircraft, Pose2};
use super::non_cooperative::NonCooperativeAircraft;
use super::pilot::{OwnshipState, SurveillanceReport, TrackedState};
use super::purpose;
use super::scratch::PhaseContext;
use super::state::AirspaceState;
use super::world::AirspaceWorld;
use sidestep_kernel::distr::normal;
use sidestep_kernel::geometry::{add, norm};
use sidestep_kernel::{Cycle, EntitySlot, math};
use std::ops::Range;

/// Enters those of `bodies` that are in the air into the spatial index.
pub(super) fn claim(context: &mut PhaseContext<'_>, bodies: Range<usize>) {
    let PhaseContext { world, state, now, .. } = *context;
    for slot in bodies {
        if state.is_active(world, slot as EntitySlot, now) {
            let at = state.airplanes[slot].pose().at;
            state.neighborhood.insert(slot as EntitySlot, at, now);
        }
    }
}

/// Returns a pose of an airplane as all see it in a cycle: with the error of that cycle.
pub(super) fn observed_pose(
    world: &AirspaceWorld,
    slot: EntitySlot,
    now: Cycle,
    mut pose: Pose2,
) -> Pose2 {
    let noise_m = world.position_noise_m(slot as usize);
    if noise_m > 0.0 {
        let mut draws = world.streams.draws(slot, now, purpose::POSITION);
        let frame = world.surface.frame_at(pose.at);
        pose = frame.pose_to_local(pose);
        for coordinate in &mut pose.at {
            *coordinate += noise_m * normal(&mut draws);
        }
        pose = frame.pose_to_world(pose);
    }
    pose
}

/// Returns the group's knowledge of an airplane: its position with an error.
pub(super) fn known_aircraft(
    world: &AirspaceWorld,
    state: &AirspaceState,
    now: Cycle,
    slot: EntitySlot,
) -> KnownAircraft {
    let current = &state.airplanes[slot as usize];
    KnownAircraft {
        slot,
        pose: observed_pose(world, slot, now, current.pose()),
        next: current.next.get() as usize,
        orders: current.orders.get().into(),
        altitude_m: current.altitude_m.get(),
        command: state.command_in_force(slot),
    }
}

/// Returns an airplane as those aboard know it.
pub(super) fn ownship_state(context: &PhaseContext<'_>, slot: EntitySlot) -> OwnshipState {
    let PhaseContext { world, state, now, .. } = *context;
    let current = &state.airplanes[slot as usize];
    let pose = current.pose();
    let orbit_pose = state.orbit_pose(slot);
    OwnshipState {
        id: slot,
        pose,
        orbit_pose,
        seen: observed_pose(world, slot, now, pose),
        seen_orbit_pose: observed_pose(world, slot, now, orbit_pose),
        altitude_m: current.altitude_m.get(),
        levels: state
            .cleared_segment(world, slot)
            .levels_within(current.altitude_m.get(), world.timing.dt_s),
        next: current.next.get(),
        orders: current.orders.get().into(),
        command: state.command_in_force(slot),
        is_overridden: state.has_commands() && state.is_overridden(slot),
        fallback: current.fallback.get(),
        refusals: current.overrides.get(),
        exempt: state.exempt_ids(slot).to_vec(),
        external_action: state.external_action(slot),
    }
}

/// Returns an airplane as others see it.
pub(super) fn surveillance_report(
    context: &PhaseContext<'_>,
    slot: EntitySlot,
) -> SurveillanceReport {
    let PhaseContext { world, state, now, .. } = *context;
    let current = &state.airplanes[slot as usize];
    SurveillanceReport {
        id: slot,
        pose: observed_pose(world, slot, now, current.pose()),
        altitude_m: current.altitude_m.get(),
        orbit: (current.orbiting.get() > 0).then(|| current.fallback.get().orbit_side),
        tracked: (world.has_common_plan(slot) && current.tracked.get() > 0)
            .then(|| TrackedState { next: current.next.get(), fallback: current.fallback.get() }),
        command: state.command_in_force(slot),
    }
}

/// Returns a non-cooperative airplane as all see it where they see it in every cycle, at once.
/// Returns a non-cooperative airplane as all see it.
pub(super) fn non_cooperative_at(
    context: &PhaseContext<'_>,
    slot: EntitySlot,
) -> NonCooperativeAircraft {
    let PhaseContext { world, state, now, .. } = *context;
    let pose = observed_pose(world, slot, now, state.airplanes[slot as usize].pose());
    non_cooperative_from_pose(context, slot, pose)
}

/// Returns a non-cooperative airplane where it is, as the run alone knows it.
pub(super) fn true_non_cooperative_at(
    context: &PhaseContext<'_>,
    slot: EntitySlot,
) -> NonCooperativeAircraft {
    let pose = context.state.airplanes[slot as usize].pose();
    non_cooperative_from_pose(context, slot, pose)
}

fn non_cooperative_from_pose(
    context: &PhaseContext<'_>,
    slot: EntitySlot,
    Pose2 { at, heading_rad }: Pose2,
) -> NonCooperativeAircraft {
    let PhaseContext { world, state, now, .. } = *context;
    let airplane = &world.airplanes[slot as usize];
    let current = &state.airplanes[slot as usize];
    let [wx, wy] = world.wind_m_s;
    let segment = state.segment(world, slot);
    let along = |speed: f64| [speed * math::cos(heading_rad), speed * math::sin(heading_rad)];
    let dt_s = world.timing.dt_s;
    let altitude_m = current.altitude_m.get();
    let (velocity_m_s, top_m_s, climb_m_s, levels) = match &airplane.track {
        // Recorded speeds are over the ground.
        Some(track) if world.is_replayed(slot, now) => {
            let [vx, vy] = along(track.speed_m_s(world.cycle_start_s(now)));
            let top_m_s = world.top_m_s[slot as usize] + math::hypot(wx, wy);
            let climb_m = track.max_climb_m_s() * dt_s;
            let levels = FlightLevelRange::between(altitude_m - climb_m, altitude_m + climb_m);
            // Until its next decision, as its heading and its speed.
            let now_s = world.cycle_start_s(now);
            let climb_m_s = (track.altitude_at_m(now_s + dt_s) - track.altitude_at_m(now_s)) / dt_s;
            ([vx - wx, vy - wy], top_m_s, climb_m_s, levels)
        }
        // Its motion is that in the common air, which its own air may drift through.
        _ => {
            // Farther than within `dt`, because methods consider it as far as they look ahead.
            let look_ahead_s = world.reactive_settings().look_ahead_s.max(dt_s);
            let levels = segment.levels_within(altitude_m, look_ahead_s);
            let air_m_s = along(segment.model.v_m_s);
            let top_m_s = world.top_m_s[slot as usize];
            let climb_m_s = segment.signed_climb_m_s(altitude_m);
            let drift_m_s = world.air_at(current.pose().at, altitude_m).drift_m_s();
            if drift_m_s == [0.0; 2] {
                (air_m_s, top_m_s, climb_m_s, levels)
            } else {
                (add(air_m_s, drift_m_s), top_m_s + norm(drift_m_s), climb_m_s, levels)
            }
        }
    };
    NonCooperativeAircraft {
        slot,
        at,
        velocity_m_s,
        top_m_s,
        separation_m: segment.model.separation_m,
        error_m: world.position_bound_m(slot as usize),
        altitude_m,
        climb_m_s,
        levels,
        dt_s,
    }
}
