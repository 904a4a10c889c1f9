//! Wishes: the actions of an airplane in order of preference, and the ways that they lead.

use crate::agents::Decided;
use crate::flight::{Action, Known, Stage};
use crate::shield::Way;
use crate::world::AirspaceWorld;

/// Returns the action straight to the way-point, and then the others by how little they differ from
/// it.
pub(super) fn straight(world: &AirspaceWorld, known: Known) -> Vec<Action> {
    let Stage { model, mission, .. } = world.stage(known.slot, known.orders);
    let air = world.air();
    by_turn(world, known, air.steer(&air.pilot(model, mission), known.pose, known.next))
}

/// Returns proceeding, and then the other actions by how little they differ from a turn rate.
pub(super) fn by_turn(world: &AirspaceWorld, known: Known, wanted_rad_s: f64) -> Vec<Action> {
    let mut others: Vec<Action> = world.actions_of(known.slot).to_vec();
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
pub(super) fn by_cost(world: &AirspaceWorld, known: Known, decided: &Decided) -> Vec<Action> {
    let Decided { chosen, expected, .. } = decided;
    let mut order: Vec<usize> = (0..expected.len()).collect();
    order.sort_by(|a, b| {
        (a != chosen).cmp(&(b != chosen)).then(expected[*a].total_cmp(&expected[*b]))
    });
    order.iter().map(|&k| world.actions_of(known.slot)[k]).collect()
}

/// Returns the different motions of the next `dt` among some actions, in their order.
pub(super) fn ways(world: &AirspaceWorld, known: Known, wishes: &[Action]) -> Vec<Way> {
    let mut ways: Vec<Way> = Vec::new();
    for &action in wishes {
        let way = way(world, known, action);
        if !ways.contains(&way) {
            ways.push(way);
        }
    }
    ways
}

fn way(world: &AirspaceWorld, known: Known, action: Action) -> Way {
    let Stage { model, mission, .. } = world.stage(known.slot, known.orders);
    let (air, dtau_s) = (world.air(), world.timing.dtau_s);
    let pilot = air.pilot(model, mission);
    let (mut pose, mut next) = (known.pose, known.next);
    let mut omegas_rad_s = Vec::new();
    for k in 0..world.timing.points_per_dt() {
        let held = action.held_rad_s(k as f64 * dtau_s);
        let omega = held.unwrap_or_else(|| air.steer(&pilot, pose, next));
        omegas_rad_s.push(omega);
        let before = pose;
        pose = air.blown(before.step(model.v_m_s, omega, dtau_s));
        next = pilot.next((before, pose), next);
    }
    Way { omegas_rad_s }
}
