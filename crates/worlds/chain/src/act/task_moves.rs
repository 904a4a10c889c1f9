//! What a chain's task wants in a cycle, as a [`DesiredMove`].

use super::bounds::EscapeContext;
use super::desired_move::DesiredMove;
use super::joint_goals::step_to_joint_goal;
use super::joint_motion::has_followed;
use super::joints::arrival_tolerance_m;
use super::orders::motion_from_orders;
use super::own_driver::ask_own_driver;
use super::plan::plan_if_stuck;
use super::tasks::{complete_target, is_last_target};
use super::wheels::NavigatedChain;
use super::{ChainCycleState, Initiator};
use crate::driver::external::{Orders, Target};
use crate::driver::own_driver::DriverAction;
use crate::driver::{Targets, TaskKind, Wander, wander_direction};
use crate::script::ScriptMotion;
use crate::state::ChainBodyState;
use crate::swarm::leader::LeaderDecision;
use crate::world::purpose;
use sidestep_rods::geometry::{add_scaled, convert_dimensions, distance, move_toward};

/// Fraction of a cycle's step by which an initiator has to come nearer to its target for that to count: a chain that
/// slides along itself by a hair in each cycle does not get there.
const MIN_GAIN_FRACTION: f64 = 0.001;
/// The same of an arm's tool, whose joints must be able to stop: one that grazes an obstacle creeps on, and a plan leads it
/// there sooner.
const MIN_ARM_GAIN_FRACTION: f64 = 0.1;

/// The decisions on a chain that were made before it acts.
#[derive(Clone, Copy)]
pub(super) struct CycleInputs {
    /// Decision of its navigator.
    pub(super) decision: Option<LeaderDecision>,
    /// Orders of an external caller.
    pub(super) orders: Orders,
}

/// The circumstances of an initiator, beside its task.
#[derive(Clone, Copy)]
pub(super) struct InitiatorContext<'a, const D: usize> {
    pub(super) inputs: CycleInputs,
    pub(super) escaping: &'a EscapeContext<'a, D>,
    /// Whether it waits, because parts of the chain escape from an obstacle.
    pub(super) is_pressed: bool,
}

/// Returns where the initiator wants to be at the end of the cycle.
pub(super) fn desired_move<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    lead_context: &InitiatorContext<'_, D>,
) -> DesiredMove<D> {
    let CycleInputs { decision, orders } = lead_context.inputs;
    match &initiator.task.driver {
        TaskKind::Rest => DesiredMove::Rest,
        TaskKind::External if orders.target == Some(Target::Joints) => DesiredMove::Follow,
        TaskKind::External => motion_from_orders(initiator, &acting.body.chain, orders)
            .map_or(DesiredMove::Rest, DesiredMove::Obey),
        TaskKind::Navigate(navigator) => {
            let has_fled = lead_context.escaping.has_escaped(initiator.task.agent, acting.before);
            let wheeled = NavigatedChain { initiator, navigator, body: acting.body };
            navigator_move(wheeled, decision, has_fled)
        }
        TaskKind::Wander(rule) => wander_move(initiator, acting.body, rule),
        TaskKind::Own(driver) => match ask_own_driver(initiator, acting.body, driver) {
            DriverAction::Rest => DesiredMove::Rest,
            DriverAction::Done => DesiredMove::Done,
            DriverAction::GoTo(to) => {
                let at = initiator.position(acting.body);
                DesiredMove::Go(move_toward(at, convert_dimensions(to), initiator.step_m()))
            }
        },
        TaskKind::Script(_) => script_move(initiator, acting),
        TaskKind::Targets(targets) => step_to_target(initiator, acting, targets),
    }
}

/// After arrival comes what others have done to the connector or its robot; its own decision is
/// last.
fn navigator_move<const D: usize>(
    mut wheeled: NavigatedChain<'_, D>,
    decision: Option<LeaderDecision>,
    has_fled: bool,
) -> DesiredMove<D> {
    if wheeled.has_arrived() {
        return DesiredMove::Done;
    }
    if let Some(to) = wheeled.robot_return_target(has_fled) {
        return DesiredMove::Return(to);
    }
    if let Some(heading_rad) = wheeled.turn_target_rad() {
        return DesiredMove::Face(heading_rad);
    }
    decision.map_or(DesiredMove::Rest, |decision| DesiredMove::Steer(wheeled.steer(decision)))
}

fn wander_move<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &mut ChainBodyState<D>,
    rule: &Wander<D>,
) -> DesiredMove<D> {
    let at = initiator.position(body);
    let step_m = initiator.step_m();
    let draws = &mut initiator.context.random_draws(purpose::WANDER);
    let was = convert_dimensions(body.driving.ahead);
    let ahead = wander_direction(rule, at, was, step_m, draws);
    body.driving.ahead = convert_dimensions(ahead);
    DesiredMove::Go(add_scaled(at, ahead, step_m))
}

/// Returns a step to the next target. In the cycle in which a target is reached, the initiator
/// rests.
fn step_to_target<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    targets: &Targets<D>,
) -> DesiredMove<D> {
    let at = initiator.position(acting.body);
    let is_planned = acting.body.plan.is_some();
    let driving = &mut acting.body.driving;
    let Some(&target) = targets.places.get(driving.next as usize) else {
        return DesiredMove::Done;
    };
    if let Some(goal) = targets.goals.get(driving.next as usize) {
        return step_to_joint_goal(initiator, acting, targets, goal);
    }
    let left_m = distance(at, target);
    let is_planning_arm =
        initiator.context.spec.arm.is_some() && initiator.task.plans_after_s.is_some();
    let min_gain_fraction = if is_planning_arm { MIN_ARM_GAIN_FRACTION } else { MIN_GAIN_FRACTION };
    let min_gain_m = (min_gain_fraction * initiator.step_m()).min(left_m);
    let is_first_cycle = driving.nearest_m == f64::INFINITY;
    let comes_nearer = driving.nearest_m - left_m > min_gain_m;
    // On a planned path a chain goes away from its target at first, and that is no time lost.
    if !is_planned {
        driving.late = if comes_nearer { 0 } else { driving.late.saturating_add(1) };
    }
    driving.nearest_m = driving.nearest_m.min(left_m);
    if left_m > targets.tolerance_m {
        plan_if_stuck(initiator, acting, targets, is_first_cycle);
        return match acting.body.plan {
            Some(_) => DesiredMove::Follow,
            None => DesiredMove::Go(move_toward(at, target, initiator.step_m())),
        };
    }
    let body = &mut *acting.body;
    body.plan = None;
    let is_last = is_last_target(initiator, body, targets);
    let arrives = |at| !is_last && distance(at, target) <= targets.passing_distance_m();
    if has_followed(body, acting.actual, arrives, initiator.task.agent) {
        complete_target(initiator, acting);
    }
    DesiredMove::Rest
}

/// Returns the next move of a script. Turning takes no time.
fn script_move<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
) -> DesiredMove<D> {
    let ChainCycleState { body, actual, .. } = acting;
    let at = initiator.position(body);
    let there_m = arrival_tolerance_m(initiator.context, &body.chain);
    loop {
        let driving = &mut body.driving;
        match body.motions.get(driving.next as usize) {
            None => return DesiredMove::Done,
            Some(ScriptMotion::Face { ahead }) => driving.ahead = *ahead,
            Some(ScriptMotion::Wait { duration_s }) => {
                if initiator.context.world.cycle_start_time_s(u64::from(driving.rested))
                    < *duration_s
                {
                    driving.rested += 1;
                    return DesiredMove::Rest;
                }
            }
            Some(ScriptMotion::MoveTo { position_m }) => {
                let to = convert_dimensions(*position_m);
                let left_m = distance(at, to);
                driving.nearest_m = driving.nearest_m.min(left_m);
                if left_m > there_m {
                    return DesiredMove::Go(move_toward(at, to, initiator.step_m()));
                }
                let arrives = |at| distance(at, to) <= there_m;
                if !has_followed(body, actual, arrives, initiator.task.agent) {
                    return DesiredMove::Rest;
                }
            }
        }
        body.driving.start_next_subtask();
    }
}
