//! One motion of an initiator.

use super::outcome::{MoveOutcome, record_result};
use super::situation::{out_of_range_veto, situation};
use super::{ChainCycleState, ChainFollowMode, Initiator, defer, joints, negotiation};
use crate::motion::recovery::{DirectMover, RecoveryLadder, RecoveryOutcome};
use sidestep_rods::geometry::{Point, distance, norm, sub};
use sidestep_rods::{MotionRequest, RequestedMotion, VetoEffect};

/// Moves the initiator where it wants to go, or as the recovery ladder allows.
pub(super) fn move_initiator<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    to: Point<D>,
) -> MoveOutcome {
    let at = initiator.position(acting.body);
    let climbed = match acting.follows {
        ChainFollowMode::Deferred => {
            let deferred = defer::move_initiator_only(initiator, acting.body, to);
            Some(deferred.unwrap_or_else(|| {
                acting.follow_at_once();
                request_motion(initiator, acting, to)
            }))
        }
        ChainFollowMode::AsTeam => negotiation::negotiate_move(initiator, acting, to),
        ChainFollowMode::AtOnce => Some(request_motion(initiator, acting, to)),
    };
    let climbed =
        climbed.map(|climbed| joints::move_joints_with_initiator(initiator, acting, to, climbed));
    acting.sink.record_in_trace(|trace| trace.climbed.clone_from(&climbed));
    let displacement = sub(initiator.position(acting.body), at);
    acting.body.driving.way_m.wanted += distance(at, to);
    acting.body.driving.way_m.gone += norm(displacement);
    acting.body.tally.way_m += norm(displacement);
    // A chain that stands because an agent is lost does not count that as time without progress.
    let Some(climbed) = climbed else { return MoveOutcome::Nowhere };
    record_result(initiator, acting, &climbed, displacement)
}

/// Requests a motion of the whole chain.
fn request_motion<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    to: Point<D>,
) -> RecoveryOutcome<D> {
    let context = initiator.context;
    let k = initiator.task.agent;
    let request = MotionRequest {
        motion: RequestedMotion::Connector { k, to },
        source: initiator.task.request_source(),
        mode: VetoEffect::Exact,
    };
    let situation = situation(initiator, acting.body);
    let memory = std::mem::take(&mut acting.body.driving.ladder);
    let mut ladder = RecoveryLadder { rungs: context.world.rungs, memory };
    let mut mover = DirectMover {
        chain: &mut acting.body.chain,
        obstacles: context.obstacles,
        propagator: acting.propagator,
    };
    let climbed = ladder.move_or_recover_with(&mut mover, &request, &situation);
    acting.body.driving.ladder = ladder.memory;
    let beyond = out_of_range_veto(&acting.body.chain, k);
    let (climbed, objection) = climbed.unwrap_or((RecoveryOutcome::Vetoed(beyond), Some(beyond)));
    // The chain of an arm with shapes is only a guide: what counts is whether its links can follow.
    let is_guide = context.spec.arm.as_ref().is_some_and(|arm| arm.body.is_some());
    if let Some(veto) = objection.as_ref().filter(|_| !is_guide) {
        acting.record_veto(veto);
    }
    climbed
}

/// Lets the initiator wait while the chain needs all its speed to escape.
pub(super) fn wait_for_escape<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
) {
    acting.body.driving.way_m.wanted += initiator.step_m();
    let n = acting.body.driving.idle.saturating_add(1);
    record_result(initiator, acting, &RecoveryOutcome::Waiting { n }, [0.0; D]);
}
