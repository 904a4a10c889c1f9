//! Wishes: the actions of an airplane in order of preference, and the ways that they lead.

use crate::agents::ActionChoice;
use crate::flight::{Action, FlightSegment, KnownAircraft};
use crate::shield::TurnProfile;
use crate::world::AirspaceWorld;

/// Returns the action straight to the way-point, and then the others by how little they differ from
/// it.
pub(super) fn rank_straight_first(world: &AirspaceWorld, known: KnownAircraft) -> Vec<Action> {
    let FlightSegment { model, mission, .. } = world.segment(known.slot, known.orders);
    let air = world.air();
    rank_by_turn_rate(
        world,
        known,
        air.steer(&air.autopilot(model, mission), known.pose, known.next),
    )
}

/// Returns proceeding, and then the other actions by how little they differ from a turn rate.
pub(super) fn rank_by_turn_rate(
    world: &AirspaceWorld,
    known: KnownAircraft,
    wanted_rad_s: f64,
) -> Vec<Action> {
    let mut others: Vec<Action> = world.actions(known.slot).to_vec();
    let turn = |action: &Action| match *action {
        Action::Hold { omega_rad_s }
        | Action::Then { omega_rad_s, .. }
        | Action::Leg { omega_rad_s, .. } => (omega_rad_s - wanted_rad_s).abs(),
        Action::Proceed => -1.0,
    };
    others.sort_by(|a, b| turn(a).total_cmp(&turn(b)));
    others
}

/// Returns the chosen action, and then the others by rising expected cost.
pub(super) fn rank_by_cost(
    world: &AirspaceWorld,
    known: KnownAircraft,
    decided: &ActionChoice,
) -> Vec<Action> {
    let ActionChoice { chosen, expected, .. } = decided;
    let mut order: Vec<usize> = (0..expected.len()).collect();
    order.sort_by(|a, b| {
        (a != chosen).cmp(&(b != chosen)).then(expected[*a].total_cmp(&expected[*b]))
    });
    order.iter().map(|&k| world.actions(known.slot)[k]).collect()
}

/// Returns the different motions of the next `dt` among some actions, in their order.
pub(super) fn turn_profiles(
    world: &AirspaceWorld,
    known: KnownAircraft,
    wishes: &[Action],
) -> Vec<TurnProfile> {
    let mut ways: Vec<TurnProfile> = Vec::new();
    for &action in wishes {
        let way = turn_profile(world, known, action);
        if !ways.contains(&way) {
            ways.push(way);
        }
    }
    ways
}

fn turn_profile(world: &AirspaceWorld, known: KnownAircraft, action: Action) -> TurnProfile {
    let FlightSegment { model, mission, .. } = world.segment(known.slot, known.orders);
    let (air, dtau_s) = (world.air(), world.timing.dtau_s);
    let pilot = air.autopilot(model, mission);
    let (mut pose, mut next) = (known.pose, known.next);
    let mut omegas_rad_s = Vec::new();
    for k in 0..world.timing.points_per_dt() {
        let held = action.turn_rate_rad_s(k as f64 * dtau_s);
        let omega = held.unwrap_or_else(|| air.steer(&pilot, pose, next));
        omegas_rad_s.push(omega);
        let before = pose;
        pose = air.after_wind_step(before.step(model.v_m_s, omega, dtau_s));
        next = pilot.next_way_point((before, pose), next);
    }
    TurnProfile { omegas_rad_s }
}
