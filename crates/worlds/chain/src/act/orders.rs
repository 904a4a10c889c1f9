//! Orders of an external caller for one cycle, and their result.

use super::joints::ArmJointSolver;
use super::plan::next_waypoint;
use super::situation::out_of_range_veto;
use super::{ChainContext, ChainCycleState, Initiator};
use crate::driver::TaskKind;
use crate::driver::external::{OrderOutcome, Orders, Target};
use crate::driver::step_motion::StepMotion;
use crate::motion::recovery::RecoveryOutcome;
use crate::motion::request::{execute_request, find_speed_veto, max_cycle_step_m};
use crate::state::{ChainBodyState, MotionPlan};
use sidestep_rods::geometry::{Point, convert_dimensions, norm, normalized, sub};
use sidestep_rods::{
    Chain, MotionOutcome, MotionRequest, RequestSource, RequestedMotion, Veto, VetoEffect,
};

/// Number of bisections to find how far a motion can go: to 1/256 of it, 0.04 mm of the usual cycle's.
const BISECTIONS: usize = 8;

/// Takes the orders for this cycle. They end with it, whether the task follows them or not.
pub(super) fn take_orders<const D: usize>(body: &mut ChainBodyState<D>) -> Orders {
    let orders = std::mem::take(&mut body.external).orders;
    if orders.target.is_some() {
        body.external.answer.outcome = OrderOutcome::Unheard;
    }
    orders
}

/// Returns the motion that orders ask for in this cycle, if they have a target.
pub(super) fn motion_from_orders<const D: usize>(
    initiator: Initiator<'_, D>,
    chain: &Chain<D>,
    orders: Orders,
) -> Option<StepMotion<D>> {
    let Orders { connector, rod, target, goes_far } = orders;
    let agent = initiator.task.agent;
    let motion = match target? {
        Target::Connector(to) => {
            let k = connector.map_or(agent, |k| k as usize);
            let to = convert_dimensions(to);
            let at = chain.points()[k];
            let connector = &chain.connectors()[k];
            let mobility = &connector.mobility;
            // A place that the mobility forbids is vetoed, unless the caller takes the nearest one
            // allowed.
            let is_there = !goes_far || connector.is_still() || mobility.allows(to, at);
            RequestedMotion::Connector {
                k,
                to: if is_there { to } else { mobility.project(to, at) },
            }
        }
        Target::Rod(to) => {
            let last = chain.rods().len().checked_sub(1)?;
            let i = rod.map_or(agent.min(last), |i| i as usize);
            RequestedMotion::Rod { i, to: to.map(convert_dimensions) }
        }
        // Joints follow a plan.
        Target::Joints => return None,
    };
    Some(StepMotion::new(chain, &motion, initiator.step_m()))
}

/// An order to the joints of an arm.
pub(super) struct JointOrder<const D: usize> {
    /// Where the leading connector is when they are there.
    to: Point<D>,
    /// Their values before the cycle.
    before: Vec<f64>,
    ordered: Vec<f64>,
}

/// Returns the order to joints of this cycle, if there is one.
pub(super) fn find_joint_order<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &ChainBodyState<D>,
    orders: Orders,
) -> Option<JointOrder<D>> {
    let is_ordered = matches!(initiator.task.driver, TaskKind::External)
        && orders.target == Some(Target::Joints);
    let Some(MotionPlan::Joints(path)) = body.plan.as_ref().filter(|_| is_ordered) else {
        return None;
    };
    let to = next_waypoint(initiator, body)?;
    Some(JointOrder { to, before: body.joints.clone()?, ordered: path.front()?.clone() })
}

/// Completes the result of an order to joints. An order is for one cycle: what is left of its way is no plan.
pub(super) fn complete_joint_result<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &mut ChainBodyState<D>,
    order: &JointOrder<D>,
) {
    let has_plan = body.plan.take().is_some();
    let has_moved = body.joints.as_ref().is_some_and(|joints| *joints != order.before);
    let answer = &mut body.external.answer;
    answer.target_m = [convert_dimensions(order.to); 2];
    answer.reached_m = convert_dimensions(body.chain.points()[initiator.task.agent]);
    answer.outcome = match () {
        () if has_moved || order.before == order.ordered => OrderOutcome::Moved,
        // A plan that is left is one that is not blocked: the joints escape from something, or have to stop first.
        () if has_plan => OrderOutcome::Waited,
        () => OrderOutcome::Vetoed,
    };
    answer.done_share = if answer.outcome == OrderOutcome::Moved { 1.0 } else { 0.0 };
}

#[derive(Clone, Copy)]
pub(super) struct StepOptions {
    /// Whether the chain waits, because parts of it have to escape.
    pub(super) gives_way: bool,
    /// Whether it moves as far as it can where it cannot reach the target.
    pub(super) goes_far: bool,
}

/// Carries out an ordered motion, unless parts have to escape.
pub(super) fn execute_ordered_motion<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    step: &StepMotion<D>,
    options: StepOptions,
) {
    let at = acting.body.chain.points()[step.first];
    acting.body.driving.way_m.wanted += norm(sub(step.to[0], at));
    let climbed = if options.gives_way {
        RecoveryOutcome::Waiting { n: acting.body.driving.idle.saturating_add(1) }
    } else {
        request_or_bisect(initiator.context, acting, step, options.goes_far)
    };
    let body = &mut *acting.body;
    body.tally.rungs.record(&climbed);
    acting.sink.record_in_trace(|trace| trace.climbed = Some(climbed));
    let displacement = sub(body.chain.points()[step.first], at);
    let driving = &mut body.driving;
    driving.way_m.gone += norm(displacement);
    driving.idle = if displacement == [0.0; D] { driving.idle.saturating_add(1) } else { 0 };
    if let Some(ahead) = normalized(displacement).filter(|_| step.first == initiator.task.agent) {
        driving.ahead = convert_dimensions(ahead);
    }
    body.tally.way_m += norm(displacement);
}

/// Requests the whole motion and, where that is vetoed and as much as possible is wanted, bisects; records the veto
/// of the rest.
fn request_or_bisect<const D: usize>(
    context: ChainContext<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    step: &StepMotion<D>,
    goes_far: bool,
) -> RecoveryOutcome<D> {
    let mut veto = match request_partial_motion(context, acting, step, 1.0) {
        MotionOutcome::Moved(moved) => {
            match &moved.cut_short {
                Some(veto) => record_veto(acting, veto),
                None => acting.body.driving.last_event = None,
            }
            return RecoveryOutcome::Straight(moved);
        }
        MotionOutcome::Vetoed(veto) => veto,
    };
    let mut done = 0.0;
    let mut half = 0.5;
    let mut last = None;
    let bisections = if goes_far { BISECTIONS } else { 0 };
    for _ in 0..bisections {
        match request_partial_motion(context, acting, step, done + half) {
            MotionOutcome::Moved(moved) => {
                done += half;
                last = Some(moved);
            }
            MotionOutcome::Vetoed(nearer) => veto = nearer,
        }
        half *= 0.5;
    }
    record_veto(acting, &veto);
    match last {
        Some(moved) => RecoveryOutcome::Shorter { part: done, moved },
        None => RecoveryOutcome::Vetoed(veto),
    }
}

/// Requests a fraction of a motion, counted from its start: all of that fraction, or nothing.
fn request_partial_motion<const D: usize>(
    context: ChainContext<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    step: &StepMotion<D>,
    part: f64,
) -> MotionOutcome<D> {
    let motion = step.partial_motion(part);
    // The caller gets a report of a veto, as a planner does.
    let request = MotionRequest { motion, source: RequestSource::Planner, mode: VetoEffect::Exact };
    let ChainCycleState { body, before, propagator, .. } = acting;
    let at = body.chain.points().to_vec();
    let most_m = max_cycle_step_m(&body.chain, &propagator.rules);
    let outcome = execute_request(propagator, &mut body.chain, context.obstacles, &request);
    let mut outcome = outcome
        .unwrap_or_else(|_| MotionOutcome::Vetoed(out_of_range_veto(&body.chain, step.first)));
    // A cycle may take several requests, and the speed is that of all of them together.
    let too_fast = find_speed_veto(&before.points, body.chain.points(), step.first, most_m);
    if let Some(veto) = too_fast {
        body.chain.points_mut().copy_from_slice(&at);
        outcome = MotionOutcome::Vetoed(veto);
    }
    let outcome = match ArmJointSolver::from_body(context, before, body) {
        Some(mut arm) => arm.execute_order(step, part, outcome),
        None => outcome,
    };
    if let MotionOutcome::Moved(moved) = &outcome {
        body.tally.add_motion(moved);
    }
    outcome
}

/// Counts a veto of an ordered motion, and records it in the result.
fn record_veto<const D: usize>(acting: &mut ChainCycleState<'_, D>, veto: &Veto<D>) {
    acting.record_veto(veto);
    record_order_veto(acting.body, veto);
}

/// Puts a veto into the result, after [`ChainCycleState::record_veto`] has made it the present objection.
pub(super) fn record_order_veto<const D: usize>(body: &mut ChainBodyState<D>, veto: &Veto<D>) {
    let answer = &mut body.external.answer;
    answer.veto = body.driving.objection;
    answer.obstacle = veto.obstacle;
    answer.reached_m = convert_dimensions(veto.reached);
}

/// Completes the result at the end of the chain's motions.
pub(super) fn complete_result<const D: usize>(
    body: &mut ChainBodyState<D>,
    step: &StepMotion<D>,
    gives_way: bool,
) {
    let chain = &body.chain;
    let done_share = step.done_fraction(chain);
    let reached = chain.points()[step.first];
    let answer = &mut body.external.answer;
    answer.target_m = step.to.map(convert_dimensions);
    answer.outcome = match answer.veto {
        None if gives_way => OrderOutcome::Waited,
        None => OrderOutcome::Moved,
        Some(_) if done_share > 0.0 => OrderOutcome::CutShort,
        Some(_) => OrderOutcome::Vetoed,
    };
    // Without a veto it is all of the motion, whatever rounding has left.
    answer.done_share = if answer.outcome == OrderOutcome::Moved { 1.0 } else { done_share };
    // A veto has set how far the connector could have gone.
    if answer.outcome != OrderOutcome::Vetoed {
        answer.reached_m = convert_dimensions(reached);
    }
}
