//! Motions to which nothing can object: the rest of the chain follows later, several at once.

use super::measure::is_own_gap_due;
use super::situation::goal_distance_m;
use super::{ChainContext, Initiator};
use crate::deferred::InitiatorMotion;
use crate::driver::{Task, TaskKind};
use crate::metrics::PENETRATION_THRESHOLD_M;
use crate::motion::recovery::RecoveryOutcome;
use crate::state::ChainBodyState;
use sidestep_rods::geometry::{Point, distance};
use sidestep_rods::{Chain, CompletedMotion, MAX_COORDINATE_M};

/// Returns whether the chain may follow the initiator's motion of this cycle later. The first cycle
/// measures all rods, so that later only those count that move.
pub(super) fn may_defer<const D: usize>(
    context: ChainContext<'_, D>,
    body: &ChainBodyState<D>,
) -> bool {
    let world = context.world;
    let Some(task) = context.task(body) else { return false };
    // Nothing can veto but the chain itself, a motion is a single sub-step of connector 0, and nothing else needs the
    // others' places.
    world.has_lone_chain()
        && (!world.rules.self_collision || may_defer_solid_body(context, body))
        && world.reaction.is_none()
        && world.rules.step_m.is_none()
        && context.spec.robots.is_none()
        && body.scattered.is_none()
        && body.chain.is_plain()
        && body.tally.steps > 0
        && !body.driving.ladder.is_pulling_back()
        && is_task_deferrable(task, &body.chain, world.dt_s)
}

/// Returns whether nothing reads the places of a chain with a solid body in this cycle.
fn may_defer_solid_body<const D: usize>(
    context: ChainContext<'_, D>,
    body: &ChainBodyState<D>,
) -> bool {
    let is_overlap_counted = body.tally.own_depth_m > PENETRATION_THRESHOLD_M;
    body.plan.is_none()
        && !is_overlap_counted
        && !is_own_gap_due(context.now, body.chain.rods().len())
}

/// Returns whether a task moves connector 0, and cannot leave the range of coordinates in a cycle.
fn is_task_deferrable<const D: usize>(task: &Task<D>, chain: &Chain<D>, dt_s: f64) -> bool {
    // Twice the step of a cycle, which leaves room for rounding.
    let most_m = MAX_COORDINATE_M - 2.0 * task.speed_m_s * dt_s;
    task.agent == 0
        // These read other connectors in each cycle, or move them.
        && !matches!(task.driver, TaskKind::Navigate(_) | TaskKind::External | TaskKind::Own(_))
        && chain.points()[0].iter().all(|x| x.abs() < most_m)
}

/// Moves connector 0; the others follow when [`ChainBodyState::apply_deferred_motions`] is called. None if something may
/// object: then nothing has moved.
pub(super) fn move_initiator_only<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &mut ChainBodyState<D>,
    to: Point<D>,
) -> Option<RecoveryOutcome<D>> {
    let world = initiator.context.world;
    let goal_m = goal_distance_m(initiator.task, body);
    let step_m = distance(body.chain.points()[0], to);
    if step_m > body.chain.min_move_m() {
        let dt_s = world.dt_s;
        let motion = InitiatorMotion { to, rules: &world.rules, dt_s };
        if !body.deferred.move_initiator(&mut body.chain, motion, &mut body.tally) {
            return None;
        }
        body.tally.max_speed_m_s = body.tally.max_speed_m_s.max(step_m / dt_s);
    }
    body.driving.ladder.record_free_motion(initiator.task.request_source(), goal_m, &world.rungs);
    // What the chain moves is counted when it follows.
    let nothing = CompletedMotion {
        touched: 0..0,
        changed: 0,
        rotated: 0,
        max_slave_step_m: 0.0,
        cut_short: None,
    };
    Some(RecoveryOutcome::Straight(nothing))
}
