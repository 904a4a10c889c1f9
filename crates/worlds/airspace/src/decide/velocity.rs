//! Wishes by a method that gives each airplane a heading.
//!
//! Such a method looks at the airplanes around it all the time: once per step of `dtau`, as its
//! authors fly it, and not once per `dt`. So the wish for a `dt` is found by flying the group ahead,
//! step by step, each airplane as the method tells it to.

use super::wishes::{by_turn, ways};
use crate::baseline::{Moving, mvp, orca};
use crate::flight::{Known, Pose, Stage};
use crate::intruder::Intruder;
use crate::shield::Way;
use crate::world::{AirspaceWorld, Method};
use sidestep_kernel::math;

/// Length in meters of the way ahead that stands for a heading.
const AHEAD_M: f64 = 1e3;

/// Returns the ways that each airplane of a group may fly in the next `dt`: the one that the method
/// wants, and then the others by how little they differ from it.
pub(super) fn by_velocity(
    world: &AirspaceWorld,
    group: &[Known],
    intruders: &[Intruder],
    memory: &mut [mvp::Resolving],
) -> Vec<Vec<Way>> {
    let mut ahead = group.to_vec();
    let mut wanted = vec![Way::default(); group.len()];
    for k in 0..world.timing.points_per_dt() {
        let seconds = k as f64 * world.timing.dtau_s;
        let intruding: Vec<Moving> =
            intruders.iter().map(|one| intruding(world, one, seconds)).collect();
        let headings = headings(world, &ahead, &intruding, memory);
        for ((known, way), heading_rad) in ahead.iter_mut().zip(&mut wanted).zip(headings) {
            way.omegas_rad_s.push(step(world, known, heading_rad));
        }
    }
    group.iter().zip(wanted).map(|(known, way)| beside(world, *known, way)).collect()
}

/// Returns a way, and then those of the airplane's actions by how little they differ from it.
pub(super) fn beside(world: &AirspaceWorld, known: Known, way: Way) -> Vec<Way> {
    let turn_rad_s = way.omegas_rad_s.first().copied().unwrap_or_default();
    let others = ways(world, known, &by_turn(world, known, turn_rad_s));
    let others: Vec<Way> = others.into_iter().filter(|other| *other != way).collect();
    [vec![way], others].concat()
}

/// Returns the heading that the method gives each airplane; `None` for one that is to fly to its
/// way-point, and for those that have arrived.
fn headings(
    world: &AirspaceWorld,
    ahead: &[Known],
    intruding: &[Moving],
    memory: &mut [mvp::Resolving],
) -> Vec<Option<f64>> {
    let is_flying = |k: &usize| {
        let known = ahead[*k];
        known.next < world.stage(known.slot, known.orders).mission.len()
    };
    let flying: Vec<usize> = (0..ahead.len()).filter(is_flying).collect();
    let own = flying.iter().map(|&k| moving(world, ahead[k]));
    let all: Vec<Moving> = own.chain(intruding.iter().copied()).collect();
    let meets = |a: &Moving, b: &Moving| a.levels.meets(&b.levels, world.vertical_m);
    let found = if world.method == Method::Orca {
        let one = |own: &Moving| {
            let others = all.iter().filter(|other| other.slot != own.slot && meets(own, other));
            orca::heading_rad(own, others, world.orca, world.timing.dtau_s)
        };
        all[..flying.len()].iter().map(one).collect()
    } else {
        let mut kept: Vec<mvp::Resolving> =
            flying.iter().map(|&k| std::mem::take(&mut memory[k])).collect();
        let found = mvp::headings(&all, &mut kept, world.mvp, meets);
        flying.iter().zip(kept).for_each(|(&k, kept)| memory[k] = kept);
        found
    };
    let mut headings = vec![None; ahead.len()];
    flying.iter().zip(found).for_each(|(&k, heading_rad)| headings[k] = heading_rad);
    headings
}

/// Flies one step toward a heading, or to the way-point, and returns its turn rate.
pub(super) fn step(world: &AirspaceWorld, known: &mut Known, heading_rad: Option<f64>) -> f64 {
    let Stage { model, mission, .. } = world.stage(known.slot, known.orders);
    let (air, pose) = (world.air(), known.pose);
    let pilot = air.pilot(model, mission);
    let omega_rad_s = match heading_rad {
        Some(heading_rad) => {
            let [x, y] = pose.at;
            let aim = [x + AHEAD_M * math::cos(heading_rad), y + AHEAD_M * math::sin(heading_rad)];
            pose.steer(aim, model.omega_max_rad_s, pilot.dtau_s)
        }
        None => air.steer(&pilot, pose, known.next),
    };
    known.pose = air.blown(pose.step(model.v_m_s, omega_rad_s, pilot.dtau_s));
    known.next = pilot.next((pose, known.pose), known.next);
    omega_rad_s
}

/// Returns an intruder after some seconds, which may come nearer than it seems.
fn intruding(world: &AirspaceWorld, one: &Intruder, seconds: f64) -> Moving {
    let ([x, y], [vx, vy], [wx, wy]) = (one.ahead(seconds), one.velocity_m_s, world.wind_m_s);
    let heading_rad = math::atan2(vy, vx);
    Moving {
        slot: one.slot,
        at: [x + wx * seconds, y + wy * seconds],
        heading_rad,
        velocity: one.velocity_m_s,
        preferred_rad: heading_rad,
        separation_m: one.wide_m(0.0),
        levels: one.levels,
        yields: false,
    }
}

fn moving(world: &AirspaceWorld, known: Known) -> Moving {
    let Stage { model, mission, .. } = world.stage(known.slot, known.orders);
    let Pose { at, heading_rad } = known.pose;
    let v = model.v_m_s;
    let preferred_rad = mission.get(known.next).map_or(heading_rad, |&goal| {
        let aim = world.air().aim(at, goal, v);
        math::atan2(aim[1] - at[1], aim[0] - at[0])
    });
    Moving {
        slot: known.slot,
        at,
        heading_rad,
        velocity: [v * math::cos(heading_rad), v * math::sin(heading_rad)],
        preferred_rad,
        separation_m: model.separation_m,
        levels: world.levels(known),
        yields: true,
    }
}
