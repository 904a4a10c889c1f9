//! Candidates by a method that gives each airplane a heading.
//!
//! Such a method considers the airplanes around it all the time: once per step of `dtau`, as its
//! authors fly it, and not once per `dt`. So the preferred profile of a `dt` is found by flying the group ahead,
//! step by step, each airplane as the method says.

use super::preferences::{rank_by_turn_rate, turn_profiles};
use crate::baseline::{AircraftState, mvp, orca};
use crate::flight::{FlightSegment, KnownAircraft, Pose2};
use crate::non_cooperative::NonCooperative;
use crate::settings::Method;
use crate::shield::TurnProfile;
use crate::world::AirspaceWorld;
use sidestep_kernel::math;

/// Distance in meters of the point ahead that stands for a heading: any, because only its direction counts.
const LOOK_AHEAD_M: f64 = 1e3;

/// Returns the turn profiles that each airplane of a group may fly in the next `dt`: the one that the method
/// prefers, and then the others by how little they differ from it.
pub(super) fn profiles_by_velocity(
    world: &AirspaceWorld,
    group: &[KnownAircraft],
    non_cooperative: &[NonCooperative],
    memory: &mut [mvp::ActiveResolutions],
) -> Vec<Vec<TurnProfile>> {
    let mut ahead = group.to_vec();
    let mut preferred = vec![TurnProfile::default(); group.len()];
    for k in 0..world.timing.points_per_dt() {
        let seconds = k as f64 * world.timing.dtau_s;
        let others: Vec<AircraftState> =
            non_cooperative.iter().map(|one| non_cooperative_state(world, one, seconds)).collect();
        let headings = headings(world, &ahead, &others, memory);
        for ((known, profile), heading_rad) in ahead.iter_mut().zip(&mut preferred).zip(headings) {
            profile.omegas_rad_s.push(step(world, known, heading_rad));
        }
    }
    group
        .iter()
        .zip(preferred)
        .map(|(known, profile)| rank_by_similarity(world, *known, profile))
        .collect()
}

/// Returns a turn profile, and then those of the airplane's actions by how little they differ from it.
pub(super) fn rank_by_similarity(
    world: &AirspaceWorld,
    known: KnownAircraft,
    profile: TurnProfile,
) -> Vec<TurnProfile> {
    let turn_rad_s = profile.omegas_rad_s.first().copied().unwrap_or_default();
    let others = turn_profiles(world, known, &rank_by_turn_rate(world, known, turn_rad_s));
    let others: Vec<TurnProfile> = others.into_iter().filter(|other| *other != profile).collect();
    [vec![profile], others].concat()
}

/// Returns the heading that the method gives each airplane; `None` for one that is to fly to its
/// way-point, and for those that have arrived.
fn headings(
    world: &AirspaceWorld,
    ahead: &[KnownAircraft],
    others: &[AircraftState],
    memory: &mut [mvp::ActiveResolutions],
) -> Vec<Option<f64>> {
    let mut flying = Vec::new();
    for (k, known) in ahead.iter().enumerate() {
        if known.next < world.segment(known.slot, known.orders).mission.len() {
            flying.push(k);
        }
    }
    let own = flying.iter().map(|&k| aircraft_state(world, ahead[k]));
    let all: Vec<AircraftState> = own.chain(others.iter().copied()).collect();
    let is_on_level =
        |a: &AircraftState, b: &AircraftState| a.levels.overlaps(&b.levels, world.vertical_m);
    let mut headings = vec![None; ahead.len()];
    if world.method == Method::Orca {
        for (&k, own) in flying.iter().zip(&all) {
            let others =
                all.iter().filter(|other| other.slot != own.slot && is_on_level(own, other));
            headings[k] = orca::heading_rad(own, others, world.orca, world.timing.dtau_s);
        }
    } else {
        let mut resolutions: Vec<mvp::ActiveResolutions> =
            flying.iter().map(|&k| std::mem::take(&mut memory[k])).collect();
        let found = mvp::headings(&all, &mut resolutions, world.mvp, is_on_level);
        for ((&k, heading_rad), resolution) in flying.iter().zip(found).zip(resolutions) {
            headings[k] = heading_rad;
            memory[k] = resolution;
        }
    }
    headings
}

/// Flies one step toward a heading, or to the way-point, and returns its turn rate.
pub(super) fn step(
    world: &AirspaceWorld,
    known: &mut KnownAircraft,
    heading_rad: Option<f64>,
) -> f64 {
    let FlightSegment { model, mission, .. } = world.segment(known.slot, known.orders);
    let air = world.air();
    let pose = known.pose;
    let autopilot = air.autopilot(model, mission);
    let omega_rad_s = match heading_rad {
        Some(heading_rad) => {
            let [x, y] = pose.at;
            let aim = [
                x + LOOK_AHEAD_M * math::cos(heading_rad),
                y + LOOK_AHEAD_M * math::sin(heading_rad),
            ];
            pose.steer(aim, model.omega_max_rad_s, autopilot.dtau_s)
        }
        None => air.steer(&autopilot, pose, known.next),
    };
    known.pose = air.after_wind_step(pose.step(model.v_m_s, omega_rad_s, autopilot.dtau_s));
    known.next = autopilot.next_way_point((pose, known.pose), known.next);
    omega_rad_s
}

/// Returns a non-cooperative airplane after some seconds, with as much more separation as it flies in one `dt`.
fn non_cooperative_state(
    world: &AirspaceWorld,
    one: &NonCooperative,
    seconds: f64,
) -> AircraftState {
    let [x, y] = one.position_after(seconds);
    let [vx, vy] = one.velocity_m_s;
    let [wx, wy] = world.wind_m_s;
    let heading_rad = math::atan2(vy, vx);
    AircraftState {
        slot: one.slot,
        at: [x + wx * seconds, y + wy * seconds],
        heading_rad,
        velocity: one.velocity_m_s,
        preferred_rad: heading_rad,
        separation_m: one.clearance_m(0.0),
        levels: one.levels,
        yields: false,
    }
}

fn aircraft_state(world: &AirspaceWorld, known: KnownAircraft) -> AircraftState {
    let FlightSegment { model, mission, .. } = world.segment(known.slot, known.orders);
    let Pose2 { at, heading_rad } = known.pose;
    let v = model.v_m_s;
    let preferred_rad = mission.get(known.next).map_or(heading_rad, |&goal| {
        let aim = world.air().aim_point(at, goal, v);
        math::atan2(aim[1] - at[1], aim[0] - at[0])
    });
    AircraftState {
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
