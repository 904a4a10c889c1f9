//! Wishes by a method that gives each airplane a velocity, of which only the direction is used.

use super::wishes::{by_turn, straight};
use crate::baseline::{Moving, mvp, orca};
use crate::flight::{Action, Known, Pose, Stage};
use crate::intruder::Intruder;
use crate::world::{AirspaceWorld, Method};
use sidestep_kernel::math;

/// Returns the wishes of a group.
pub(super) fn by_velocity(
    world: &AirspaceWorld,
    group: &[Known],
    intruders: &[Intruder],
) -> Vec<Vec<Action>> {
    let mut all: Vec<Moving> = group.iter().map(|known| moving(world, *known)).collect();
    all.extend(intruders.iter().map(intruding));
    let horizon_s = world.timing.horizon_s();
    let margin = world.objective.inflation;
    let toward = |(k, own): (usize, &Moving)| {
        let near = |other: &Moving| other.levels.meets(&own.levels, world.vertical_m);
        let others = all.iter().enumerate().filter(|(j, m)| *j != k && near(m)).map(|(_, m)| m);
        let velocity = match world.method {
            Method::Orca => orca::velocity(own, others, horizon_s, world.timing.dt_s, margin),
            _ => mvp::velocity(own, others, horizon_s, margin),
        };
        match velocity == own.preferred {
            true => straight(world, group[k]),
            false => turning(world, group[k], velocity),
        }
    };
    all[..group.len()].iter().enumerate().map(toward).collect()
}

/// Returns the turn toward a velocity, and then the other actions by how little they differ from
/// it.
fn turning(world: &AirspaceWorld, known: Known, [vx, vy]: [f64; 2]) -> Vec<Action> {
    let (pose, dt_s) = (known.pose, world.timing.dt_s);
    let omega_max = world.airplanes[known.slot as usize].model.omega_max_rad_s;
    let omega_rad_s = pose.steer([pose.at[0] + vx, pose.at[1] + vy], omega_max, dt_s);
    let mut wishes = vec![Action::Then { omega_rad_s, hold_s: dt_s }];
    wishes.extend(by_turn(world, known, omega_rad_s));
    wishes
}

/// Returns an intruder, which may come nearer than it seems.
fn intruding(one: &Intruder) -> Moving {
    Moving {
        at: one.at,
        velocity: one.velocity_m_s,
        preferred: one.velocity_m_s,
        separation_m: one.wide_m(0.0),
        levels: one.levels,
        yields: false,
    }
}

fn moving(world: &AirspaceWorld, known: Known) -> Moving {
    let Stage { model, mission, .. } = world.stage(known.slot, known.orders);
    let Pose { at, heading_rad } = known.pose;
    let v = model.v_m_s;
    let toward = mission.get(known.next).map_or(heading_rad, |&goal| {
        let aim = world.air().aim(at, goal, v);
        math::atan2(aim[1] - at[1], aim[0] - at[0])
    });
    Moving {
        at,
        velocity: [v * math::cos(heading_rad), v * math::sin(heading_rad)],
        preferred: [v * math::cos(toward), v * math::sin(toward)],
        separation_m: model.separation_m,
        levels: world.levels(known),
        yields: true,
    }
}
