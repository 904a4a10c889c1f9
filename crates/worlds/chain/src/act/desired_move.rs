//! The wish of a chain's driver in a cycle.

use super::bounds::EscapeContext;
use super::joints::arrival_tolerance_m;
use super::orders::step_from_orders;
use super::plan::plan_if_stuck;
use super::wheels::{NavigatorContext, WheelStep};
use super::{ActState, FollowMode, Initiator};
use crate::driver::external::Orders;
use crate::driver::step_motion::StepMotion;
use crate::driver::{Targets, TaskKind, Wander, wander_direction};
use crate::events::EventKind;
use crate::script::ScriptMotion;
use crate::state::Body;
use crate::swarm::leader::Decision;
use crate::world::purpose;
use sidestep_rods::geometry::{Point, add_scaled, distance, move_toward, with_dimensions};

/// A driver's wish in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum DesiredMove<const D: usize> {
    /// Nothing.
    Rest,
    /// The initiator at another place.
    Go(Point<D>),
    /// The whole chain farther along its plan.
    Follow,
    /// A robot on wheels at another pose.
    Steer(WheelStep),
    /// The connector of a robot on wheels back toward its robot.
    Return(Point<D>),
    /// A robot on wheels with another heading, where it is.
    Face(f64),
    /// The order of a caller.
    Obey(StepMotion<D>),
    /// Its task is done.
    Done,
}

/// The decisions on a chain that are made before it acts.
#[derive(Clone, Copy)]
pub(super) struct CycleInputs {
    /// Decision of its navigator.
    pub(super) decision: Option<Decision>,
    /// Orders from outside.
    pub(super) orders: Orders,
}

/// The circumstances of an initiator, beside its task.
#[derive(Clone, Copy)]
pub(super) struct InitiatorContext<'a, const D: usize> {
    pub(super) heard: CycleInputs,
    pub(super) follows: FollowMode,
    pub(super) escaping: &'a EscapeContext<'a, D>,
    /// Whether it gives way to parts that get out of something's way.
    pub(super) is_pressed: bool,
}

/// Returns where the initiator wants to be at the end of the cycle.
pub(super) fn desired_move<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut ActState<'_, D>,
    guide: &InitiatorContext<'_, D>,
) -> DesiredMove<D> {
    let CycleInputs { decision, orders } = guide.heard;
    match &who.task.driver {
        TaskKind::Rest => DesiredMove::Rest,
        TaskKind::External => step_from_orders(who, &acting.body.chain, orders)
            .map_or(DesiredMove::Rest, DesiredMove::Obey),
        TaskKind::Navigate(navigator) => {
            let has_fled = guide.escaping.has_escaped(who.task.agent, acting.before);
            let wheeled = NavigatorContext { who, navigator, body: acting.body };
            navigator_move(wheeled, decision, has_fled)
        }
        TaskKind::Wander(rule) => wander_move(who, acting.body, rule),
        TaskKind::Script(_) => script_move(who, acting.body),
        TaskKind::Targets(targets) => step_to_target(who, acting, targets),
    }
}

/// Returns the wish of a navigator that has made its decision.
fn navigator_move<const D: usize>(
    mut wheeled: NavigatorContext<'_, D>,
    decision: Option<Decision>,
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
    who: Initiator<'_, D>,
    body: &mut Body<D>,
    rule: &Wander<D>,
) -> DesiredMove<D> {
    let (at, step_m) = (who.position(body), who.step_m());
    let draws = &mut who.setting.draws(purpose::WANDER);
    let was = with_dimensions(body.driving.ahead);
    let ahead = wander_direction(rule, at, was, step_m, draws);
    body.driving.ahead = with_dimensions(ahead);
    DesiredMove::Go(add_scaled(at, ahead, step_m))
}

/// Returns a step to the next target. In the cycle in which a target is reached, the initiator
/// rests.
fn step_to_target<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut ActState<'_, D>,
    targets: &Targets<D>,
) -> DesiredMove<D> {
    let at = who.position(acting.body);
    let driving = &mut acting.body.driving;
    let Some(&target) = targets.places.get(driving.next as usize) else {
        return DesiredMove::Done;
    };
    let left_m = distance(at, target);
    driving.late = match left_m < driving.nearest_m {
        true => 0,
        false => driving.late.saturating_add(1),
    };
    driving.nearest_m = driving.nearest_m.min(left_m);
    if left_m > targets.tolerance_m {
        plan_if_stuck(who, acting, targets);
        return match acting.body.plan {
            Some(_) => DesiredMove::Follow,
            None => DesiredMove::Go(move_toward(at, target, who.step_m())),
        };
    }
    let body = &mut *acting.body;
    body.plan = None;
    let number = f64::from(body.driving.next);
    acting.told.record(&body.chain, EventKind::Target, who.task.agent, number);
    body.tally.done += 1;
    body.driving.advance_part();
    DesiredMove::Rest
}

/// Returns the wish of a script. Turning takes no time.
fn script_move<const D: usize>(who: Initiator<'_, D>, body: &mut Body<D>) -> DesiredMove<D> {
    let at = who.position(body);
    let there_m = arrival_tolerance_m(who.setting, &body.chain);
    let driving = &mut body.driving;
    loop {
        match body.motions.get(driving.next as usize) {
            None => return DesiredMove::Done,
            Some(ScriptMotion::Face { ahead }) => driving.ahead = *ahead,
            Some(ScriptMotion::Wait { duration_s }) => {
                if who.setting.world.start_time_s(u64::from(driving.rested)) < *duration_s {
                    driving.rested += 1;
                    return DesiredMove::Rest;
                }
            }
            Some(ScriptMotion::MoveTo { position_m }) => {
                let to = with_dimensions(*position_m);
                let left_m = distance(at, to);
                driving.nearest_m = driving.nearest_m.min(left_m);
                if left_m > there_m {
                    return DesiredMove::Go(move_toward(at, to, who.step_m()));
                }
            }
        }
        driving.advance_part();
    }
}
