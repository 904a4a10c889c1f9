//! Ways that are planned once local rules come no nearer to a target.

use super::{ActState, ChainContext, Initiator};
use crate::driver::Targets;
use crate::events::EventKind;
use crate::scratch::PositionBuffer;
use crate::state::{Body, MotionPlan};
use crate::world::purpose;
use sidestep_arms::plan::{
    ChainPosture, ConfigurationSpace, JointSpace, PlanningQuery, RodSpace, plan, plan_joints,
};
use sidestep_kernel::InputError;
use sidestep_rods::find_tunneling;
use sidestep_rods::geometry::{Point, distance};
use std::collections::VecDeque;

/// Least part of a piece of the way that a cycle is worth.
const MIN_FRACTION: f64 = 1e-6;
/// Part of the limit that a step along a plan aims at.
const STEP_LIMIT_FRACTION: f64 = 0.99;

/// Plans a way to the next target if local rules have come no nearer for long enough; if there
/// was none, again after twice that time, because the search takes long where there is no way.
pub(super) fn plan_if_stuck<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut ActState<'_, D>,
    targets: &Targets<D>,
) {
    let Initiator { setting, task, .. } = who;
    let body = &mut *acting.body;
    let Some(after_s) = task.plans_after_s.filter(|_| body.plan.is_none()) else { return };
    let after = ((after_s / setting.world.dt_s).ceil() as u32).max(1);
    let late = body.driving.late;
    if !late.is_multiple_of(after) || !(late / after).is_power_of_two() {
        return;
    }
    let next = body.driving.next;
    let (k, target) = (task.agent, targets.places[next as usize]);
    let errand = PlanningQuery { k, target, tolerance_m: 0.5 * targets.tolerance_m };
    // A chain without a base, or a target out of range, has no plan.
    let found = find_path(setting, body, &errand).ok().flatten();
    let rungs = &mut body.tally.rungs;
    let (kind, value) = match &found {
        Some(plan) => {
            rungs.planned += 1;
            (EventKind::Planned, plan.len() as f64)
        }
        None => {
            rungs.not_planned += 1;
            (EventKind::NotPlanned, f64::from(next))
        }
    };
    acting.told.record(&body.chain, kind, k, value);
    body.plan = found;
}

/// Searches a way: of an arm's joints, else of rods.
fn find_path<const D: usize>(
    setting: ChainContext<'_, D>,
    body: &Body<D>,
    errand: &PlanningQuery<D>,
) -> Result<Option<MotionPlan<D>>, InputError> {
    let draws = &mut setting.draws(purpose::PLAN);
    let ChainContext { world, spec, obstacles, .. } = setting;
    let (chain, rules) = (&body.chain, world.rules);
    if let (Some(arm), Some(joints)) = (spec.arm.as_deref(), &body.joints) {
        let solid = rules.self_collision;
        let space = JointSpace::new(arm, joints, chain, obstacles, solid, errand.k);
        let way = plan_joints(&space, errand, draws)?;
        return Ok(way.map(|way| MotionPlan::Joints(way.into())));
    }
    let way = plan(chain, obstacles, rules, errand, draws)?;
    Ok(way.map(|way| MotionPlan::Rods(way.into())))
}

/// Returns the next place of the initiator on its planned way.
pub(super) fn next_waypoint<const D: usize>(
    who: Initiator<'_, D>,
    body: &Body<D>,
) -> Option<Point<D>> {
    match body.plan.as_ref()? {
        MotionPlan::Rods(way) => Some(way.front()?[who.task.agent]),
        MotionPlan::Joints(way) => {
            let places = who.setting.spec.arm.as_ref()?.connector_positions(way.front()?);
            places.get(who.task.agent).copied()
        }
    }
}

/// Goes on along the planned way: the initiator at its speed at most, no joint faster than it
/// may be. A plan in whose way something has come is dropped.
pub(super) fn follow_plan<const D: usize>(
    who: Initiator<'_, D>,
    body: &mut Body<D>,
    before: &PositionBuffer<D>,
) {
    body.plan = match body.plan.take() {
        Some(MotionPlan::Rods(way)) => follow_rods(who, body, way).map(MotionPlan::Rods),
        Some(MotionPlan::Joints(way)) => {
            follow_joints(who, body, &before.joints, way).map(MotionPlan::Joints)
        }
        None => None,
    };
}

/// Goes on along a way of rods; returns what is left of it.
fn follow_rods<const D: usize>(
    who: Initiator<'_, D>,
    body: &mut Body<D>,
    mut way: VecDeque<ChainPosture<D>>,
) -> Option<VecDeque<ChainPosture<D>>> {
    let ChainContext { world, obstacles, .. } = who.setting;
    let solid = world.rules.self_collision;
    let space = RodSpace::new(&body.chain, obstacles, solid, who.task.agent).ok()?;
    let (from, to) = (space.present(), way.front()?);
    let at = |posture: &ChainPosture<D>| posture.clone();
    let (next, is_there) = StepLimits::from_initiator(who).step(&space, &from, to, 1.0, at);
    if !space.is_path_free(&from, &next) || !move_along(who, body, &from, &next) {
        return None;
    }
    if is_there {
        way.pop_front();
    }
    (!way.is_empty()).then_some(way)
}

/// Goes on along a way of an arm's joints; returns what is left of it. In a cycle in which the arm got out of the
/// way, its joints have no speed left for it.
fn follow_joints<const D: usize>(
    who: Initiator<'_, D>,
    body: &mut Body<D>,
    joints_before: &[f64],
    mut way: VecDeque<Vec<f64>>,
) -> Option<VecDeque<Vec<f64>>> {
    let ChainContext { world, spec, obstacles, .. } = who.setting;
    let (arm, joints) = (spec.arm.as_deref()?, body.joints.clone()?);
    if joints != joints_before {
        return Some(way);
    }
    let (chain, solid) = (&body.chain, world.rules.self_collision);
    let space = JointSpace::new(arm, &joints, chain, obstacles, solid, who.task.agent);
    let (dt_s, to, mut most_m) = (world.dt_s, way.front()?, StepLimits::from_initiator(who));
    if let Some(escape) = &world.escape {
        most_m.joint = most_m.joint.min(escape.speed_max_m_s * dt_s);
    }
    let part = arm.follower.reachable_fraction(&joints, to, dt_s);
    let at = |values: &Vec<f64>| -> ChainPosture<D> { arm.connector_positions(values) };
    let (mut next, is_there) = most_m.step(&space, &joints, to, part, at);
    // Ways of exactly the greatest speed are not longer by rounding.
    for (x, [lower, upper]) in next.iter_mut().zip(arm.follower.reachable_ranges(&joints, dt_s)) {
        *x = x.clamp(lower, upper);
    }
    let from = chain.points().to_vec();
    if !space.is_path_free(&joints, &next)
        || !move_along(who, body, &from, &arm.connector_positions(&next))
    {
        return None;
    }
    body.joints = Some(next);
    if is_there {
        way.pop_front();
    }
    (!way.is_empty()).then_some(way)
}

/// Moves the chain to the next places on a planned way, unless it would pass through something.
fn move_along<const D: usize>(
    who: Initiator<'_, D>,
    body: &mut Body<D>,
    from: &[Point<D>],
    next: &[Point<D>],
) -> bool {
    let (chain, agent) = (&mut body.chain, who.task.agent);
    chain.points_mut().copy_from_slice(next);
    if find_tunneling(chain, from, who.setting.obstacles, 0.0).is_some() {
        chain.points_mut().copy_from_slice(from);
        return false;
    }
    body.tally.way_m += distance(from[agent], next[agent]);
    body.tally.moved += from.iter().zip(next).filter(|(a, b)| a != b).count() as u64;
    true
}

/// Longest ways in a cycle, meters.
struct StepLimits {
    agent: usize,
    /// Longest way of the initiator.
    led: f64,
    /// Longest way of any connector.
    joint: f64,
}

impl StepLimits {
    fn from_initiator<const D: usize>(who: Initiator<'_, D>) -> Self {
        let joint = who.setting.world.rules.joint_step_max_m;
        Self { agent: who.task.agent, led: who.step_m(), joint }
    }

    /// Returns the posture on the way from one to another that a cycle is enough for, at most a `part` of it, and
    /// whether it is that one. `at` tells where the connectors of a posture are.
    fn step<const D: usize, S: ConfigurationSpace>(
        &self,
        space: &S,
        from: &S::Posture,
        to: &S::Posture,
        mut part: f64,
        at: impl Fn(&S::Posture) -> ChainPosture<D>,
    ) -> (S::Posture, bool) {
        let start = at(from);
        let mut next = space.interpolate(from, to, part);
        while part >= MIN_FRACTION {
            let points = at(&next);
            let ways_m = start.iter().zip(&points).map(|(a, b)| distance(*a, *b));
            let led = distance(start[self.agent], points[self.agent]) / self.led;
            let excess = led.max(ways_m.fold(0.0, f64::max) / self.joint);
            if excess <= 1.0 {
                break;
            }
            part *= STEP_LIMIT_FRACTION / excess;
            next = space.interpolate(from, to, part);
        }
        (next, part >= 1.0)
    }
}
