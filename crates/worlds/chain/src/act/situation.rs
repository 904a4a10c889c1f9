//! An initiator's knowledge of where it is.

use super::Initiator;
use crate::driver::{Task, TaskKind};
use crate::motion::recovery::InitiatorSituation;
use crate::state::ChainBodyState;
use sidestep_rods::geometry::distance;
use sidestep_rods::{Chain, Mobility, Veto, VetoReason};

/// Distance beyond that up to which clearance is measured at which a moving obstacle still counts as near, meters: at
/// 1 m/s it comes within the second that an initiator waits.
const MOVER_NEAR_M: f64 = 1.0;

/// Returns an initiator's knowledge beside its neighborhood.
pub(super) fn situation<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &ChainBodyState<D>,
) -> InitiatorSituation {
    let at = initiator.position(body);
    let near_m = initiator.context.world.look_m + MOVER_NEAR_M;
    let goal_distance_m = goal_distance_m(initiator.task, body);
    let (can_turn, keeps_heading) = match &initiator.task.driver {
        TaskKind::Navigate(navigator) => (navigator.can_turn_on_the_spot(), true),
        _ => (false, false),
    };
    let mut movers = initiator.context.obstacles.moving().iter();
    let movers_near = movers.any(|o| o.core.nearest_to_point(at).distance_m - o.radius_m < near_m);
    InitiatorSituation { goal_distance_m, movers_near, can_turn, keeps_heading }
}

/// Returns the distance of an initiator from its target, if it has one.
pub(super) fn goal_distance_m<const D: usize>(
    task: &Task<D>,
    body: &ChainBodyState<D>,
) -> Option<f64> {
    let TaskKind::Targets(targets) = &task.driver else { return None };
    let place = targets.places.get(body.driving.next as usize);
    place.map(|place| distance(body.chain.points()[task.agent], *place))
}

/// Returns the objection of an initiator that would leave the range of coordinates.
pub(super) fn out_of_range_veto<const D: usize>(chain: &Chain<D>, by: usize) -> Veto<D> {
    let reached = chain.points()[by];
    Veto { by, from: by, reason: VetoReason::Limit, obstacle: None, reached }
}

/// Returns whether some connector is not free, so that reaching a place takes return passes.
pub(super) fn has_held_connector<const D: usize>(chain: &Chain<D>) -> bool {
    chain.connectors().iter().any(|c| c.is_still() || c.mobility != Mobility::Free)
}
