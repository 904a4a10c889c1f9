//! *Perceive*: airplanes list themselves in the neighborhood, and are perceived there.

use super::Turn;
use super::flight::{Known, Levels, Pose};
use super::intruder::Intruder;
use super::purpose;
use super::state::AirspaceState;
use super::world::AirspaceWorld;
use sidestep_kernel::distr::normal;
use sidestep_kernel::{Cycle, Slot, math};
use std::ops::Range;

/// Lists those of `bodies` that are in the air.
pub(super) fn claim(turn: &mut Turn<'_>, bodies: Range<usize>) {
    let Turn { world, state, now, .. } = *turn;
    for slot in bodies {
        if state.is_there(world, slot as Slot, now) {
            let at = state.airplanes[slot].pose().at;
            state.neighborhood.enter(slot as Slot, at, now);
        }
    }
}

/// Returns a pose of an airplane as all see it in a cycle: with the error of that cycle.
pub(super) fn seen(world: &AirspaceWorld, slot: Slot, now: Cycle, mut pose: Pose) -> Pose {
    if world.disturbance.position_m > 0.0 {
        let mut draws = world.streams.draws(slot, now, purpose::POSITION);
        pose.at.iter_mut().for_each(|v| *v += world.disturbance.position_m * normal(&mut draws));
    }
    pose
}

/// Returns the group's knowledge of an airplane: its position with an error.
pub(super) fn known(world: &AirspaceWorld, state: &AirspaceState, now: Cycle, slot: Slot) -> Known {
    let cell = &state.airplanes[slot as usize];
    let pose = seen(world, slot, now, cell.pose());
    let (orders, altitude_m) = (u32::from(cell.orders.get()), cell.altitude_m.get());
    Known { slot, pose, next: cell.next.get() as usize, orders, altitude_m }
}

/// Returns the intruders of a group, by id.
pub(super) fn intruders(turn: &Turn<'_>, group: &[Slot]) -> Vec<Intruder> {
    let is_intruder = |slot: &&Slot| turn.world.is_intruder(**slot, turn.now);
    group.iter().filter(is_intruder).map(|&slot| intruder(turn, slot)).collect()
}

fn intruder(turn: &Turn<'_>, slot: Slot) -> Intruder {
    let Turn { world, state, now, .. } = *turn;
    let (airplane, cell) = (&world.airplanes[slot as usize], &state.airplanes[slot as usize]);
    let Pose { at, heading_rad } = seen(world, slot, now, cell.pose());
    let [wx, wy] = world.wind_m_s;
    let stage = state.stage(world, slot);
    let along = |speed: f64| [speed * math::cos(heading_rad), speed * math::sin(heading_rad)];
    let dt_s = world.timing.dt_s;
    let altitude_m = cell.altitude_m.get();
    let (velocity_m_s, top_m_s, levels) = match &airplane.track {
        // Recorded speeds are over the ground.
        Some(track) if world.is_replayed(slot, now) => {
            let [vx, vy] = along(track.speed_m_s(world.starts_s(now)));
            let top_m_s = world.top_m_s[slot as usize] + math::hypot(wx, wy);
            let climb_m = track.top_climb_m_s() * dt_s;
            let levels = Levels::between(altitude_m - climb_m, altitude_m + climb_m);
            ([vx - wx, vy - wy], top_m_s, levels)
        }
        _ => {
            let levels = Levels::between(altitude_m, stage.altitude_m);
            (along(stage.model.v_m_s), world.top_m_s[slot as usize], levels)
        }
    };
    let (separation_m, error_m) = (stage.model.separation_m, world.bounds.position_m);
    Intruder { slot, at, velocity_m_s, top_m_s, separation_m, error_m, levels, dt_s }
}
