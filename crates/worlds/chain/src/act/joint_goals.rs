//! Targets of an arm that are more than the place of a connector: poses of its tool, straight lines, and joint values.
//! Local rules know places alone, so these are always planned.

use super::desired_move::DesiredMove;
use super::joint_motion::has_come_to_rest;
use super::plan::is_plan_due;
use super::tasks::{complete_target, give_up_if_stuck, is_last_target};
use super::{ChainCycleState, Initiator};
use crate::driver::{TargetPath, Targets};
use crate::events::EventKind;
use crate::scratch::PositionBuffer;
use crate::state::{ChainBodyState, MotionPlan};
use crate::world::purpose;
use sidestep_arms::Arm;
use sidestep_arms::plan::{JointGoal, JointPosture, JointSpace, plan_line, plan_to_goal};
use sidestep_rods::geometry::{Point, distance};

/// Returns the move toward a goal of an arm's joints: along the path that is planned to it, from the first cycle on.
pub(super) fn step_to_joint_goal<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    targets: &Targets<D>,
    goal: &JointGoal,
) -> DesiredMove<D> {
    let Some(arm) = initiator.context.spec.arm.as_deref() else { return DesiredMove::Rest };
    let body = &mut *acting.body;
    let place = targets.places[body.driving.next as usize];
    let left_m = distance(initiator.position(body), place);
    body.driving.nearest_m = body.driving.nearest_m.min(left_m);
    let is_there = body.joints.as_ref().is_some_and(|joints| goal.is_reached(arm, joints));
    if is_there {
        body.plan = None;
        // A line starts where the joints rest: on the way from elsewhere they would cut its corner.
        let stops = targets.path == TargetPath::Line || is_last_target(initiator, body, targets);
        let is_near =
            !stops && passes(acting.actual, place, (arm, targets, goal), initiator.task.agent);
        if is_near || has_come_to_rest(body) {
            complete_target(initiator, acting);
        }
        return DesiredMove::Rest;
    }
    if body.plan.is_some() {
        // As long as there is a path no time is lost, though it may lead away from the target first. The time that was
        // lost before still counts: of a path that is dropped again and again the initiator gives up.
        return DesiredMove::Follow;
    }
    let late = body.driving.late;
    body.driving.late = late.saturating_add(1);
    if late > 0 && !is_plan_due(initiator, late) {
        give_up_if_stuck(initiator, acting.body, &mut acting.sink);
        return DesiredMove::Rest;
    }
    body.plan = find_joint_path(initiator, body, targets.path, goal);
    let (kind, value) = match &body.plan {
        Some(plan) => {
            body.tally.rungs.planned += 1;
            (EventKind::Planned, plan.len() as f64)
        }
        None => {
            body.tally.rungs.not_planned += 1;
            (EventKind::NotPlanned, f64::from(body.driving.next))
        }
    };
    acting.sink.record(&body.chain, kind, initiator.task.agent, value);
    if body.plan.is_some() { DesiredMove::Follow } else { DesiredMove::Rest }
}

/// Returns whether joints are as near to a goal that is not the last one as they have to come: at it, or the tool near
/// its place, where that is enough.
fn passes<const D: usize>(
    actual: &PositionBuffer<D>,
    place: Point<D>,
    (arm, targets, goal): (&Arm, &Targets<D>, &JointGoal),
    agent: usize,
) -> bool {
    let left_m = actual.points.get(agent).map(|tool| distance(*tool, place));
    let blends = targets.blend_m.zip(left_m).is_some_and(|(blend_m, left_m)| left_m <= blend_m);
    blends || goal.is_reached(arm, &actual.joints)
}

/// Plans a path of the joints from their reference to a goal.
fn find_joint_path<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &ChainBodyState<D>,
    path: TargetPath,
    goal: &JointGoal,
) -> Option<MotionPlan<D>> {
    let context = initiator.context;
    let arm = context.spec.arm.as_deref()?;
    let present = JointPosture { arm, joints: body.joints.as_ref()? };
    let is_solid = context.world.rules.self_collision;
    let agent = initiator.task.agent;
    let space = JointSpace::new(present, &body.chain, context.obstacles, is_solid, agent);
    let found = match (path, goal) {
        (TargetPath::Line, JointGoal::Pose(pose)) => plan_line(&space, pose),
        _ => plan_to_goal(&space, goal, &mut context.random_draws(purpose::PLAN)),
    };
    // Goals were checked when the scenario was compiled, so an error is a posture out of range: no path.
    let postures = found.ok().flatten()?;
    (!postures.is_empty()).then(|| MotionPlan::Joints(postures.into()))
}
