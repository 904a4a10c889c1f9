//! What an airplane reports of itself.

use super::state_vector::StateVector;
use crate::perceive::observed_pose;
use crate::purpose;
use crate::scratch::PhaseContext;
use crate::state::AirspaceState;
use crate::world::AirspaceWorld;
use sidestep_kernel::distr::normal_pair;
use sidestep_kernel::geometry::{add, scaled};
use sidestep_kernel::math;
use sidestep_kernel::{Cycle, EntitySlot};

/// Returns the state of an airplane at the start of the present cycle, in which its change of level is cleared.
pub(crate) fn present_state(
    world: &AirspaceWorld,
    state: &AirspaceState,
    now: Cycle,
    slot: EntitySlot,
) -> StateVector {
    let current = &state.airplanes[slot as usize];
    let pose = current.pose();
    let altitude_m = current.altitude_m.get();
    let step = now * world.timing.points_per_dt() as u64;
    let direction = [math::cos(pose.heading_rad), math::sin(pose.heading_rad)];
    match &world.airplanes[slot as usize].track {
        Some(track) if world.is_replayed(slot, now) => {
            let now_s = world.cycle_start_s(now);
            let dtau_s = world.timing.dtau_s;
            let climb_m = track.altitude_at_m(now_s + dtau_s) - track.altitude_at_m(now_s);
            // Recorded speeds are over the ground.
            let velocity_m_s = scaled(direction, track.speed_m_s(now_s));
            StateVector { step, pose, velocity_m_s, altitude_m, climb_m_s: climb_m / dtau_s }
        }
        _ => {
            let segment = state.cleared_segment(world, slot);
            let air = world.flown_air(slot, now, (pose.at, altitude_m));
            let velocity_m_s = add(scaled(direction, segment.model.v_m_s), air.wind_m_s);
            let climb_m_s = segment.signed_climb_m_s(altitude_m);
            StateVector { step, pose, velocity_m_s, altitude_m, climb_m_s }
        }
    }
}

/// Returns a state of an airplane with the errors of its own navigation, as it reports it.
pub(super) fn with_navigation_errors(
    context: &PhaseContext<'_>,
    slot: EntitySlot,
    state: StateVector,
) -> StateVector {
    let world = context.world;
    let cycle = state.step / world.timing.points_per_dt() as u64;
    let pose = observed_pose(world, slot, cycle, state.pose);
    let noise_m_s = world.velocity_noise_m_s(slot as usize);
    let mut velocity_m_s = state.velocity_m_s;
    if noise_m_s > 0.0 {
        let words = world.streams.block(slot, cycle, purpose::VELOCITY, 0);
        let error = normal_pair(words);
        velocity_m_s = add(velocity_m_s, scaled(error, noise_m_s));
    }
    StateVector { pose, velocity_m_s, ..state }
}
