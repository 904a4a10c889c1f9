//! Paths that are planned once local rules come no nearer to a target.

use super::joint_motion::StopCheck;
use super::{ChainContext, ChainCycleState, Initiator};
use crate::driver::{TargetPath, Targets, TaskKind};
use crate::events::EventKind;
use crate::scratch::PositionBuffer;
use crate::state::{ChainBodyState, MotionPlan};
use crate::world::purpose;
use sidestep_arms::Arm;
use sidestep_arms::plan::{
    ChainConfigurationSpace, ChainPosture, ConfigurationSpace, JointPosture, JointSpace,
    PlanningQuery, plan, plan_joints,
};
use sidestep_kernel::InputError;
use sidestep_rods::geometry::{Point, between_segments, distance};
use sidestep_rods::{Chain, ChainPart, RodBvh, TOLERANCE_M, find_own_passage, find_tunneling};
use std::collections::VecDeque;

/// Rods up to which a path is planned before a chain is stuck: a search takes a time that grows with the cube of their number.
const MAX_FIRST_PLAN_RODS: usize = 64;
/// Least fraction of a segment of the path that a cycle is worth.
const MIN_FRACTION: f64 = 1e-6;
/// Bisections of a straight piece of an arm's path: to a millionth of it, less than rounding of what a cycle allows.
const BISECTIONS: usize = 20;
/// Fraction of its tolerance within which a tool keeps to a line: the rest is for the line itself, which is measured by
/// the references on it.
const LINE_FRACTION: f64 = 0.9;
/// Shares of a cycle's step that are tried, each half of the one before.
const MAX_STEP_TRIES: usize = 5;
/// Fraction of the speed limit that a shortened step aims at: by exactly the limit, rounding could exceed it again.
const STEP_LIMIT_FRACTION: f64 = 0.99;

/// Plans a path to the next target if local rules have come no nearer for long enough; if there was none, again
/// after twice that time, because the search takes long where no path exists. In the first cycle of a target a path is
/// planned if the straight way leads through the chain itself: local rules would push the chain into its own body.
pub(super) fn plan_if_stuck<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    targets: &Targets<D>,
    is_first_cycle: bool,
) {
    let Initiator { context, task, .. } = initiator;
    let body = &mut *acting.body;
    let next = body.driving.next;
    let k = task.agent;
    let target = targets.places[next as usize];
    let is_in_own_way = is_first_cycle
        && task.plans_after_s.is_some()
        && context.spec.arm.is_none()
        && context.world.rules.self_collision
        && body.chain.rods().len() <= MAX_FIRST_PLAN_RODS
        && crosses_own_body(&body.chain, k, target);
    if body.plan.is_some() || !is_in_own_way && !is_plan_due(initiator, body.driving.late) {
        return;
    }
    // The search needs the places of all connectors.
    acting.follow_at_once();
    let body = &mut *acting.body;
    // Half of the tolerance, so that the end of the path counts as the target though it is followed with rounding.
    let query = PlanningQuery { k, target, tolerance_m: 0.5 * targets.tolerance_m };
    // A chain that is held on both sides otherwise than by fixed ends, or a target out of range, has no plan.
    let plan_found = find_path(context, body, &query).ok().flatten();
    let rungs = &mut body.tally.rungs;
    let (kind, value) = match &plan_found {
        Some(plan) => {
            rungs.planned += 1;
            (EventKind::Planned, plan.len() as f64)
        }
        None => {
            rungs.not_planned += 1;
            (EventKind::NotPlanned, f64::from(next))
        }
    };
    acting.sink.record(&body.chain, kind, k, value);
    body.plan = plan_found;
}

/// Returns whether a rod of the chain is in the straight way of connector `k` to a target: nearer than the two may be. Those
/// that meet at it, or near it in a chain of short rods, are no obstacles to it.
fn crosses_own_body<const D: usize>(chain: &Chain<D>, k: usize, target: Point<D>) -> bool {
    let way = [chain.points()[k], target];
    chain.points().windows(2).enumerate().any(|(rod, ends)| {
        let keep_m = chain.min_separation_m(ChainPart::Connector(k), ChainPart::Rod(rod));
        let apart_m = between_segments(way, [ends[0], ends[1]]).distance_m;
        keep_m.is_some_and(|keep_m| apart_m < keep_m - TOLERANCE_M)
    })
}

/// Returns whether a path is planned after so many cycles without coming nearer: after one, two, four, eight times the
/// time of the task.
pub(super) fn is_plan_due<const D: usize>(initiator: Initiator<'_, D>, late: u32) -> bool {
    let Some(after_s) = initiator.task.plans_after_s else { return false };
    let after = ((after_s / initiator.context.world.dt_s).ceil() as u32).max(1);
    late.is_multiple_of(after) && (late / after).is_power_of_two()
}

/// Searches for a path: of an arm's joints, otherwise of rods.
fn find_path<const D: usize>(
    context: ChainContext<'_, D>,
    body: &ChainBodyState<D>,
    query: &PlanningQuery<D>,
) -> Result<Option<MotionPlan<D>>, InputError> {
    let draws = &mut context.random_draws(purpose::PLAN);
    let ChainContext { world, spec, obstacles, .. } = context;
    let chain = &body.chain;
    let rules = world.rules;
    if let Some(arm) = spec.arm.as_deref()
        && let Some(joints) = &body.joints
    {
        let self_collision = rules.self_collision;
        let present = JointPosture { arm, joints };
        let space = JointSpace::new(present, chain, obstacles, self_collision, query.k);
        let path = plan_joints(&space, query, draws)?;
        return Ok(path.map(|path| MotionPlan::Joints(path.into())));
    }
    let path = plan(chain, obstacles, rules, query, draws)?;
    Ok(path.map(|path| MotionPlan::Rods(path.into())))
}

/// Returns the next position of the initiator on its planned path.
pub(super) fn next_waypoint<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &ChainBodyState<D>,
) -> Option<Point<D>> {
    match body.plan.as_ref()? {
        MotionPlan::Rods(path) => Some(path.front()?[initiator.task.agent]),
        MotionPlan::Joints(path) => {
            let places = initiator.context.spec.arm.as_ref()?.connector_positions(path.front()?);
            places.get(initiator.task.agent).copied()
        }
    }
}

/// Follows the planned path: the initiator at its speed at most, no joint faster than it may be. A plan that has
/// become blocked is dropped.
pub(super) fn follow_plan<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &mut ChainBodyState<D>,
    before: &PositionBuffer<D>,
) {
    body.plan = match body.plan.take() {
        Some(MotionPlan::Rods(path)) => {
            follow_chain_path(initiator, body, path).map(MotionPlan::Rods)
        }
        Some(MotionPlan::Joints(path)) => {
            follow_joint_path(initiator, body, &before.joints, path).map(MotionPlan::Joints)
        }
        None => None,
    };
}

/// Follows a path of rods; returns the rest of it.
fn follow_chain_path<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &mut ChainBodyState<D>,
    mut path: VecDeque<ChainPosture<D>>,
) -> Option<VecDeque<ChainPosture<D>>> {
    let ChainContext { world, obstacles, .. } = initiator.context;
    let self_collision = world.rules.self_collision;
    let space =
        ChainConfigurationSpace::new(&body.chain, obstacles, self_collision, initiator.task.agent)
            .ok()?;
    let from = space.present_posture();
    let to = path.front()?;
    let limits = StepLimits::from_initiator(initiator);
    let (next, is_there) = limits.next_posture(&space, &from, to)?;
    if !space.is_path_free(&from, &next) || !move_along(initiator, body, &from, &next) {
        return None;
    }
    if is_there {
        path.pop_front();
    }
    (!path.is_empty()).then_some(path)
}

/// Follows a path of an arm's joints; returns the rest of it. In a cycle in which the arm escaped from something its
/// joints have no speed left for the plan.
fn follow_joint_path<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &mut ChainBodyState<D>,
    joints_before: &[f64],
    mut path: VecDeque<Vec<f64>>,
) -> Option<VecDeque<Vec<f64>>> {
    let ChainContext { world, spec, obstacles, .. } = initiator.context;
    let arm = spec.arm.as_deref()?;
    let joints = body.joints.clone()?;
    if joints != joints_before {
        return Some(path);
    }
    let chain = &body.chain;
    let self_collision = world.rules.self_collision;
    let present = JointPosture { arm, joints: &joints };
    let space = JointSpace::new(present, chain, obstacles, self_collision, initiator.task.agent);
    let step = JointStep {
        arm,
        space: &space,
        start: chain.points(),
        ranges: arm.motion.reference_ranges(&body.motion, &joints, arm.follower.limits()),
        limits: StepLimits::for_joints(initiator),
    };
    let stop = StopCheck {
        context: initiator.context,
        arm,
        chain,
        k: initiator.task.agent,
        line_tolerance_m: line_tolerance_m(initiator),
    };
    // The joints cut the corners of a path at which the reference does not stop. Where they would touch something, or
    // leave a line, it goes less far, or waits for them.
    let mut share = 1.0;
    let mut last_try = None;
    for _ in 0..MAX_STEP_TRIES {
        let walked = step.walk(&joints, &path, share)?;
        if stop.find_veto(&body.motion, &joints, &walked.joints).is_none() {
            last_try = Some(walked);
            break;
        }
        share *= 0.5;
    }
    let Some(WalkedPath { joints: next, passed }) = last_try else {
        // Where the joints rest on the path, they will not come any nearer by waiting.
        return (!body.motion.is_at_rest()).then_some(path);
    };
    let from = chain.points().to_vec();
    if !move_along(initiator, body, &from, &arm.connector_positions(&next)) {
        return None;
    }
    body.joints = Some(next);
    path.drain(..passed);
    (!path.is_empty()).then_some(path)
}

/// Returns how far the tool may leave the line on which the present task leads it, if it does.
fn line_tolerance_m<const D: usize>(initiator: Initiator<'_, D>) -> Option<f64> {
    match &initiator.task.driver {
        TaskKind::Targets(targets) if targets.path == TargetPath::Line => {
            Some(LINE_FRACTION * targets.tolerance_m)
        }
        _ => None,
    }
}

/// The limits of an arm's reference in a cycle.
struct JointStep<'a, const D: usize> {
    arm: &'a Arm,
    space: &'a JointSpace<'a, D>,
    /// The places of the connectors at the start of the cycle.
    start: &'a [Point<D>],
    /// Where each joint may be at its end.
    ranges: Vec<[f64; 2]>,
    limits: StepLimits,
}

/// The end of a cycle on a path.
struct WalkedPath {
    joints: Vec<f64>,
    /// Number of postures of the path that it has passed or reached.
    passed: usize,
}

impl<const D: usize> JointStep<'_, D> {
    /// Returns where a path leads within a share of what a cycle allows; none if the path is blocked.
    fn walk(&self, from: &[f64], path: &VecDeque<Vec<f64>>, share: f64) -> Option<WalkedPath> {
        let mut at = from.to_vec();
        for (passed, to) in path.iter().enumerate() {
            if self.allows(from, to, share) {
                if !self.space.is_path_free(&at, to) {
                    return None;
                }
                at.clone_from(to);
                continue;
            }
            let mut fraction = 0.0;
            let mut half = 0.5;
            for _ in 0..BISECTIONS {
                if self.allows(from, &self.space.interpolate(&at, to, fraction + half), share) {
                    fraction += half;
                }
                half *= 0.5;
            }
            let joints = self.space.interpolate(&at, to, fraction);
            return self.space.is_path_free(&at, &joints).then_some(WalkedPath { joints, passed });
        }
        Some(WalkedPath { joints: at, passed: path.len() })
    }

    /// Returns whether a share of what a cycle allows leads from a posture to another.
    fn allows(&self, from: &[f64], to: &[f64], share: f64) -> bool {
        let is_in_range = |((from, to), [lower, upper]): ((&f64, &f64), &[f64; 2])| {
            (share * (lower - from)..=share * (upper - from)).contains(&(to - from))
        };
        let points: Vec<Point<D>> = self.arm.connector_positions(to);
        let k = self.limits.agent;
        let mut moves_m = self.start.iter().zip(&points).map(|(a, b)| distance(*a, *b));
        from.iter().zip(to).zip(&self.ranges).all(is_in_range)
            && distance(self.start[k], points[k]) <= share * self.limits.led
            && moves_m.all(|move_m| move_m <= share * self.limits.joint)
    }
}

/// Moves the chain to the next posture of a planned path, unless it would tunnel through something or pass through
/// itself.
fn move_along<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &mut ChainBodyState<D>,
    from: &[Point<D>],
    next: &[Point<D>],
) -> bool {
    let chain = &mut body.chain;
    let agent = initiator.task.agent;
    chain.points_mut().copy_from_slice(next);
    let ChainContext { world, obstacles, .. } = initiator.context;
    // The rods of an arm with shapes are guides, which may pass each other: its shapes were checked.
    let arm = initiator.context.spec.arm.as_deref();
    let has_solid_rods = arm.is_none_or(|arm| arm.body.is_none());
    let meets_itself = world.rules.self_collision
        && has_solid_rods
        && find_own_passage(chain, from, &mut RodBvh::default()).is_some();
    if meets_itself || find_tunneling(chain, from, obstacles, 0.0).is_some() {
        chain.points_mut().copy_from_slice(from);
        return false;
    }
    body.tally.way_m += distance(from[agent], next[agent]);
    body.tally.moved += from.iter().zip(next).filter(|(a, b)| a != b).count() as u64;
    true
}

/// Longest motions in a cycle, meters.
struct StepLimits {
    agent: usize,
    /// Longest motion of the initiator.
    led: f64,
    /// Longest motion of any connector.
    joint: f64,
}

impl StepLimits {
    fn from_initiator<const D: usize>(initiator: Initiator<'_, D>) -> Self {
        let joint = initiator.context.world.rules.joint_step_max_m;
        Self { agent: initiator.task.agent, led: initiator.step_m(), joint }
    }

    /// Returns the limits of an arm, which moves no faster than it escapes.
    fn for_joints<const D: usize>(initiator: Initiator<'_, D>) -> Self {
        let world = initiator.context.world;
        let limits = Self::from_initiator(initiator);
        let escape_m = world.escape.as_ref().map(|escape| escape.speed_max_m_s * world.dt_s);
        Self { joint: escape_m.map_or(limits.joint, |most_m| limits.joint.min(most_m)), ..limits }
    }

    /// Returns the posture between two that is reached in one cycle, and whether it is the second one; none if every motion
    /// that way is too fast.
    fn next_posture<const D: usize>(
        &self,
        space: &ChainConfigurationSpace<'_, D>,
        from: &ChainPosture<D>,
        to: &ChainPosture<D>,
    ) -> Option<(ChainPosture<D>, bool)> {
        let mut fraction = 1.0;
        let mut next = to.clone();
        while fraction >= MIN_FRACTION {
            let moves_m = from.iter().zip(&next).map(|(a, b)| distance(*a, *b));
            let led = distance(from[self.agent], next[self.agent]) / self.led;
            let excess = led.max(moves_m.fold(0.0, f64::max) / self.joint);
            if excess <= 1.0 {
                return Some((next, fraction >= 1.0));
            }
            // Connectors of a chain turn about others, and do not move in proportion: it may take several rounds.
            fraction *= STEP_LIMIT_FRACTION / excess;
            next = space.interpolate(from, to, fraction);
        }
        None
    }
}
