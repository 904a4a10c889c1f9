//! Ways that are planned once local rules come no nearer to a target.

use super::Acting;
use crate::arms::plan::{Errand, JointSpace, Posture, Postures, RodSpace, plan, plan_joints};
use crate::driver::{Targets, Task};
use crate::events::EventKind;
use crate::rods::geometry::{Point, distance};
use crate::rods::passage::passed;
use crate::state::Plan;
use crate::world::purpose;
use sidestep_kernel::InputError;
use std::collections::VecDeque;

/// Least part of a piece of the way that a cycle is worth.
const LEAST_PART: f64 = 1e-6;
/// Part of the limit that a step along a plan aims at.
const SLOWER: f64 = 0.99;

impl<const D: usize> Acting<'_, D> {
    /// Plans a way to the next target if local rules have come no nearer for long enough; if there
    /// was none, again after twice that time, because the search takes long where there is no way.
    pub(super) fn plan_if_late(&mut self, task: &Task<D>, targets: &Targets<D>) {
        let Some(after_s) = task.plans_after_s.filter(|_| self.body.plan.is_none()) else { return };
        let after = ((after_s / self.world.dt_s).ceil() as u32).max(1);
        let late = self.body.driving.late;
        if !late.is_multiple_of(after) || !(late / after).is_power_of_two() {
            return;
        }
        let next = self.body.driving.next;
        let (k, target) = (task.agent, targets.places[next as usize]);
        let errand = Errand { k, target, tolerance_m: 0.5 * targets.tolerance_m };
        // A chain without a base, or a target out of range, has no plan.
        let found = self.planned(&errand).ok().flatten();
        let rungs = &mut self.body.tally.rungs;
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
        self.tell(kind, k, value);
        self.body.plan = found;
    }

    /// Searches a way: of an arm's joints, else of rods.
    fn planned(&mut self, errand: &Errand<D>) -> Result<Option<Plan<D>>, InputError> {
        let draws = &mut self.world.streams.draws(self.slot, self.now, purpose::PLAN);
        let (chain, obstacles) = (&self.body.chain, &self.scratch.obstacles);
        let rules = self.world.rules;
        if let (Some(arm), Some(joints)) = (self.spec.arm.as_deref(), &self.body.joints) {
            let arm = (arm, &joints[..]);
            let space = JointSpace::new(arm, chain, obstacles, rules.self_collision, errand.k);
            let way = plan_joints(&space, errand, draws)?;
            return Ok(way.map(|way| Plan::Joints(way.into())));
        }
        let way = plan(chain, obstacles, rules, errand, draws)?;
        Ok(way.map(|way| Plan::Rods(way.into())))
    }

    /// Goes on along the planned way: the initiator at its speed at most, no joint faster than it
    /// may be. A plan in whose way something has come is dropped.
    pub(super) fn follow_plan(&mut self, task: &Task<D>) {
        self.body.plan = match self.body.plan.take() {
            Some(Plan::Rods(way)) => self.follow_rods(task, way).map(Plan::Rods),
            Some(Plan::Joints(way)) => self.follow_joints(task, way).map(Plan::Joints),
            None => None,
        };
    }

    /// Goes on along a way of rods; returns what is left of it.
    fn follow_rods(
        &mut self,
        task: &Task<D>,
        mut way: VecDeque<Posture<D>>,
    ) -> Option<VecDeque<Posture<D>>> {
        let (rules, obstacles) = (&self.world.rules, &self.scratch.obstacles);
        let chain = &self.body.chain;
        let space = RodSpace::new(chain, obstacles, rules.self_collision, task.agent).ok()?;
        let most_m = self.most(task);
        let (from, to) = (space.present(), way.front()?);
        let at = |posture: &Posture<D>| posture.clone();
        let (next, is_there) = step(&space, task.agent, (&from, to), 1.0, &most_m, at);
        if !space.is_way_free(&from, &next) || !self.goes(task, &from, &next) {
            return None;
        }
        if is_there {
            way.pop_front();
        }
        (!way.is_empty()).then_some(way)
    }

    /// Goes on along a way of an arm's joints; returns what is left of it. In a cycle in which the arm got out of the
    /// way, its joints have no speed left for it.
    fn follow_joints(
        &mut self,
        task: &Task<D>,
        mut way: VecDeque<Vec<f64>>,
    ) -> Option<VecDeque<Vec<f64>>> {
        let (arm, joints) = (self.spec.arm.as_deref()?, self.body.joints.clone()?);
        if joints != self.scratch.joints_before {
            return Some(way);
        }
        let (rules, obstacles) = (&self.world.rules, &self.scratch.obstacles);
        let (chain, solid) = (&self.body.chain, rules.self_collision);
        let space = JointSpace::new((arm, &joints), chain, obstacles, solid, task.agent);
        let (dt_s, to, mut most_m) = (self.world.dt_s, way.front()?, self.most(task));
        if let Some(escape) = &self.world.escape {
            most_m.joint = most_m.joint.min(escape.speed_max_m_s * dt_s);
        }
        let part = arm.follower.part_in(&joints, to, dt_s);
        let at = |values: &Vec<f64>| -> Posture<D> { arm.places(values) };
        let (mut next, is_there) = step(&space, task.agent, (&joints, to), part, &most_m, at);
        // Ways of exactly the greatest speed are not longer by rounding.
        for (x, [lower, upper]) in next.iter_mut().zip(arm.follower.room(&joints, dt_s)) {
            *x = x.clamp(lower, upper);
        }
        let from = chain.points().to_vec();
        if !space.is_way_free(&joints, &next) || !self.goes(task, &from, &arm.places(&next)) {
            return None;
        }
        self.body.joints = Some(next);
        if is_there {
            way.pop_front();
        }
        (!way.is_empty()).then_some(way)
    }

    /// Moves the chain to the next places on a planned way, unless it would pass through something.
    fn goes(&mut self, task: &Task<D>, from: &[Point<D>], next: &[Point<D>]) -> bool {
        let chain = &mut self.body.chain;
        chain.points_mut().copy_from_slice(next);
        if passed(chain, from, &self.scratch.obstacles, 0.0).is_some() {
            chain.points_mut().copy_from_slice(from);
            return false;
        }
        self.body.tally.way_m += distance(from[task.agent], next[task.agent]);
        self.body.tally.moved += from.iter().zip(next).filter(|(a, b)| a != b).count() as u64;
        true
    }

    fn most(&self, task: &Task<D>) -> Most {
        let joint = self.world.rules.joint_step_max_m;
        Most { led: task.speed_m_s * self.world.dt_s, joint }
    }
}

/// Longest ways in a cycle, meters.
struct Most {
    /// Longest way of the initiator.
    led: f64,
    /// Longest way of any connector.
    joint: f64,
}

/// Returns the posture on the way from one to another that a cycle is enough for, at most a `part` of it, and whether
/// it is that one. `at` tells where the connectors of a posture are.
fn step<const D: usize, S: Postures>(
    space: &S,
    agent: usize,
    (from, to): (&S::Posture, &S::Posture),
    mut part: f64,
    most_m: &Most,
    at: impl Fn(&S::Posture) -> Posture<D>,
) -> (S::Posture, bool) {
    let start = at(from);
    let mut next = space.at(from, to, part);
    while part >= LEAST_PART {
        let points = at(&next);
        let ways_m = start.iter().zip(&points).map(|(a, b)| distance(*a, *b));
        let led = distance(start[agent], points[agent]) / most_m.led;
        let excess = led.max(ways_m.fold(0.0, f64::max) / most_m.joint);
        if excess <= 1.0 {
            break;
        }
        part *= SLOWER / excess;
        next = space.at(from, to, part);
    }
    (next, part >= 1.0)
}
