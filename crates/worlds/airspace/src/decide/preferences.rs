//! The actions of an airplane by preference, and their turn profiles.

use super::local_flight::LocalFlight;
use crate::agents::ActionChoice;
use crate::flight::{Action, FlightChange, KnownAircraft, TimeDiscretization, TurnAction};
use crate::shield::TurnProfile;
use crate::world::AirspaceWorld;

/// Returns the action straight to the way-point, and then the others by how little they differ from
/// it.
pub(super) fn rank_straight_first(world: &AirspaceWorld, known: KnownAircraft) -> Vec<Action> {
    let flight = LocalFlight::new(world, known, world.timing.dtau_s);
    let straight_rad_s = flight.air.steer(&flight.autopilot(), flight.pose, known.next);
    rank_by_turn_difference(world, known, straight_rad_s)
}

/// Returns proceeding, and then the other actions by how little they differ from a turn rate.
pub(super) fn rank_by_turn_difference(
    world: &AirspaceWorld,
    known: KnownAircraft,
    desired_rad_s: f64,
) -> Vec<Action> {
    let mut others: Vec<Action> = world.present_actions(known).into_owned();
    others.sort_by(|a, b| {
        rate_difference_rad_s(*a, desired_rad_s)
            .total_cmp(&rate_difference_rad_s(*b, desired_rad_s))
    });
    others
}

/// Returns how much the turn rate of an action differs from the desired one; less than any other for proceeding,
/// which comes first.
fn rate_difference_rad_s(action: Action, desired_rad_s: f64) -> f64 {
    match action.turn {
        TurnAction::Hold { omega_rad_s }
        | TurnAction::Then { omega_rad_s, .. }
        | TurnAction::Leg { omega_rad_s, .. } => (omega_rad_s - desired_rad_s).abs(),
        TurnAction::Proceed if action.change == FlightChange::NONE => -1.0,
        // After the optimal action, because its turn profile is the same.
        TurnAction::Proceed => -0.5,
    }
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
    let actions = world.present_actions(known);
    order.iter().map(|&k| actions[k]).collect()
}

/// Returns all actions by rising cost for the airplane alone; of equal ones that which proceeds first.
pub(super) fn rank_by_own_cost(
    world: &AirspaceWorld,
    known: KnownAircraft,
    costs: &[f64],
) -> Vec<Action> {
    let mut order: Vec<usize> = (0..costs.len()).rev().collect();
    order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
    order.iter().map(|&k| world.actions(known.slot)[k]).collect()
}

/// Returns the different motions of the next `dt` among some actions, in their order.
pub(super) fn turn_profiles_from_actions(
    world: &AirspaceWorld,
    known: KnownAircraft,
    actions: &[Action],
) -> Vec<TurnProfile> {
    let flight = LocalFlight::new(world, known, world.timing.dt_s);
    let mut profiles: Vec<TurnProfile> = Vec::new();
    for &action in actions {
        let profile = turn_profile(&flight, action.turn);
        if !profiles.contains(&profile) {
            profiles.push(profile);
        }
    }
    profiles
}

fn turn_profile(flight: &LocalFlight<'_>, turn: TurnAction) -> TurnProfile {
    let air = flight.air;
    let TimeDiscretization { dtau_s, .. } = air.timing;
    let autopilot = flight.autopilot();
    let mut pose = flight.pose;
    let mut next = flight.next;
    let mut omegas_rad_s = Vec::new();
    for k in 0..air.timing.points_per_dt() {
        let fixed_rad_s = turn.turn_rate_rad_s(k as f64 * dtau_s);
        let omega = fixed_rad_s.unwrap_or_else(|| air.steer(&autopilot, pose, next));
        omegas_rad_s.push(omega);
        let before = pose;
        pose = air.after_wind_step(before.step(flight.model.v_m_s, omega, dtau_s));
        next = autopilot.next_way_point((before, pose), next);
    }
    TurnProfile { omegas_rad_s }
}
