//! One motion of an initiator.

use super::outcome::{MoveResult, record_result};
use super::situation::{out_of_range_veto, situation};
use super::{ActState, FollowMode, Initiator, defer, joints, negotiation};
use crate::motion::recovery::{RecoveryLadder, RecoveryOutcome};
use sidestep_rods::geometry::{Point, distance, norm, sub};
use sidestep_rods::{Motion, Request, VetoEffect};

/// Moves the initiator, as it wants or as the ladder allows.
pub(super) fn move_initiator<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut ActState<'_, D>,
    to: Point<D>,
) -> MoveResult {
    let at = who.position(acting.body);
    let climbed = match who.follows {
        FollowMode::Deferred => Some(defer::move_initiator_only(who, acting.body, to)),
        FollowMode::AsTeam => negotiation::negotiate_move(who, acting, to),
        FollowMode::AtOnce => Some(request_motion(who, acting, to)),
    };
    let climbed = climbed.map(|climbed| joints::follow_initiator(who, acting, to, climbed));
    acting.told.trace(|notes| notes.climbed.clone_from(&climbed));
    let way = sub(who.position(acting.body), at);
    acting.body.driving.way_m.wanted += distance(at, to);
    acting.body.driving.way_m.gone += norm(way);
    acting.body.tally.way_m += norm(way);
    // A chain that stands because somebody is lost does not lose its patience.
    let Some(climbed) = climbed else { return MoveResult::Nowhere };
    record_result(who, acting, &climbed, way)
}

/// Requests a motion of the whole chain.
fn request_motion<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut ActState<'_, D>,
    to: Point<D>,
) -> RecoveryOutcome<D> {
    let (setting, k) = (who.setting, who.task.agent);
    let request = Request {
        motion: Motion::Connector { k, to },
        source: who.task.source(),
        mode: VetoEffect::Exact,
    };
    let situation = situation(who, acting.body);
    let memory = std::mem::take(&mut acting.body.driving.ladder);
    let mut ladder = RecoveryLadder { rungs: setting.world.rungs, memory };
    let climbed = ladder.climb_with_veto(
        &mut acting.body.chain,
        setting.obstacles,
        acting.propagator,
        &request,
        &situation,
    );
    acting.body.driving.ladder = ladder.memory;
    let beyond = out_of_range_veto(&acting.body.chain, k);
    let (climbed, objection) = climbed.unwrap_or((RecoveryOutcome::Vetoed(beyond), Some(beyond)));
    if let Some(veto) = &objection {
        acting.record_veto(veto);
    }
    climbed
}

/// Lets the initiator wait while the chain needs all its speed to get out of the way.
pub(super) fn wait_for_escape<const D: usize>(who: Initiator<'_, D>, acting: &mut ActState<'_, D>) {
    acting.body.driving.way_m.wanted += who.step_m();
    let n = acting.body.driving.idle.saturating_add(1);
    record_result(who, acting, &RecoveryOutcome::Waiting { n }, [0.0; D]);
}
