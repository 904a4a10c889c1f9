//! *Perceive*: airplanes list themselves in the neighborhood, and are perceived there.

use super::flight::{KnownAircraft, Levels, Pose2};
use super::non_cooperative::NonCooperative;
use super::pilot::{OwnshipState, SurveillanceReport};
use super::purpose;
use super::scratch::PhaseContext;
use super::state::AirspaceState;
use super::world::AirspaceWorld;
use sidestep_kernel::distr::normal;
use sidestep_kernel::{Cycle, Slot, math};
use std::ops::Range;

/// Lists those of `bodies` that are in the air.
pub(super) fn claim(turn: &mut PhaseContext<'_>, bodies: Range<usize>) {
    let PhaseContext { world, state, now, .. } = *turn;
    for slot in bodies {
        if state.is_active(world, slot as Slot, now) {
            let at = state.airplanes[slot].pose().at;
            state.neighborhood.insert(slot as Slot, at, now);
        }
    }
}

/// Returns a pose of an airplane as all see it in a cycle: with the error of that cycle.
pub(super) fn observed_pose(
    world: &AirspaceWorld,
    slot: Slot,
    now: Cycle,
    mut pose: Pose2,
) -> Pose2 {
    if world.disturbance.position_m > 0.0 {
        let mut draws = world.streams.draws(slot, now, purpose::POSITION);
        pose.at.iter_mut().for_each(|v| *v += world.disturbance.position_m * normal(&mut draws));
    }
    pose
}

/// Returns the group's knowledge of an airplane: its position with an error.
pub(super) fn known_aircraft(
    world: &AirspaceWorld,
    state: &AirspaceState,
    now: Cycle,
    slot: Slot,
) -> KnownAircraft {
    let cell = &state.airplanes[slot as usize];
    let pose = observed_pose(world, slot, now, cell.pose());
    let (orders, altitude_m) = (u32::from(cell.orders.get()), cell.altitude_m.get());
    KnownAircraft { slot, pose, next: cell.next.get() as usize, orders, altitude_m }
}

/// Returns an airplane as those aboard know it.
pub(super) fn ownship_state(turn: &PhaseContext<'_>, slot: Slot) -> OwnshipState {
    let PhaseContext { world, state, now, .. } = *turn;
    let cell = &state.airplanes[slot as usize];
    let pose = cell.pose();
    let held = state.orbit_pose(slot);
    OwnshipState {
        id: slot,
        pose,
        held,
        seen: observed_pose(world, slot, now, pose),
        seen_held: observed_pose(world, slot, now, held),
        altitude_m: cell.altitude_m.get(),
        next: cell.next.get(),
        orders: cell.orders.get().into(),
        fallback: cell.fallback.get(),
        refusals: cell.overrides.get(),
        named: state.exempt_with(slot).to_vec(),
        wish: state.external_action(slot),
    }
}

/// Returns an airplane as others see it.
pub(super) fn surveillance_report(turn: &PhaseContext<'_>, slot: Slot) -> SurveillanceReport {
    let PhaseContext { world, state, now, .. } = *turn;
    let cell = &state.airplanes[slot as usize];
    SurveillanceReport {
        id: slot,
        pose: observed_pose(world, slot, now, cell.pose()),
        altitude_m: cell.altitude_m.get(),
        orbit: (cell.orbiting.get() > 0).then(|| cell.fallback.get()),
    }
}

/// Returns the intruders of a group, by id.
pub(super) fn non_cooperative_aircraft(
    turn: &PhaseContext<'_>,
    group: &[Slot],
) -> Vec<NonCooperative> {
    let is_intruder = |slot: &&Slot| turn.world.is_non_cooperative(**slot, turn.now);
    group.iter().filter(is_intruder).map(|&slot| non_cooperative_at(turn, slot)).collect()
}

fn non_cooperative_at(turn: &PhaseContext<'_>, slot: Slot) -> NonCooperative {
    let PhaseContext { world, state, now, .. } = *turn;
    let (airplane, cell) = (&world.airplanes[slot as usize], &state.airplanes[slot as usize]);
    let Pose2 { at, heading_rad } = observed_pose(world, slot, now, cell.pose());
    let [wx, wy] = world.wind_m_s;
    let stage = state.segment(world, slot);
    let along = |speed: f64| [speed * math::cos(heading_rad), speed * math::sin(heading_rad)];
    let dt_s = world.timing.dt_s;
    let altitude_m = cell.altitude_m.get();
    let (velocity_m_s, top_m_s, levels) = match &airplane.track {
        // Recorded speeds are over the ground.
        Some(track) if world.is_replayed(slot, now) => {
            let [vx, vy] = along(track.speed_m_s(world.cycle_start_s(now)));
            let top_m_s = world.top_m_s[slot as usize] + math::hypot(wx, wy);
            let climb_m = track.max_climb_m_s() * dt_s;
            let levels = Levels::between(altitude_m - climb_m, altitude_m + climb_m);
            ([vx - wx, vy - wy], top_m_s, levels)
        }
        _ => {
            let levels = Levels::between(altitude_m, stage.altitude_m);
            (along(stage.model.v_m_s), world.top_m_s[slot as usize], levels)
        }
    };
    let (separation_m, error_m) = (stage.model.separation_m, world.bounds.position_m);
    NonCooperative { slot, at, velocity_m_s, top_m_s, separation_m, error_m, levels, dt_s }
}
