//! Ways that are planned once local rules come no nearer to a target.

use super::Acting;
use crate::arms::plan::{Errand, Space, plan};
use crate::driver::{Targets, Task};
use crate::events::EventKind;
use crate::rods::geometry::distance;
use crate::rods::passage::passed;
use crate::state::Plan;
use crate::world::purpose;

/// Least part of a piece of the way that a cycle is worth.
const LEAST_PART: f64 = 1e-6;

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
        let draws = &mut self.world.streams.draws(self.slot, self.now, purpose::PLAN);
        let obstacles = &self.scratch.obstacles;
        let found = plan(&self.body.chain, obstacles, self.world.rules, &errand, draws);
        let rungs = &mut self.body.tally.rungs;
        // A chain without a base, or a target out of range, has no plan.
        match found.ok().flatten() {
            Some(way) => {
                rungs.planned += 1;
                self.tell(EventKind::Planned, k, way.len() as f64);
                self.body.plan = Some(Plan { way: way.into() });
            }
            None => {
                rungs.not_planned += 1;
                self.tell(EventKind::NotPlanned, k, f64::from(next));
            }
        }
    }

    /// Goes on along the planned way: the initiator at its speed at most, no joint faster than it
    /// may be. A plan in whose way something has come is dropped.
    pub(super) fn follow_plan(&mut self, task: &Task<D>) {
        let Some(plan) = &mut self.body.plan else { return };
        let (chain, rules) = (&mut self.body.chain, &self.world.rules);
        let Ok(space) =
            Space::new(chain, &self.scratch.obstacles, rules.self_collision, task.agent)
        else {
            return self.body.plan = None;
        };
        let (from, to) = (space.present(), &plan.way[0]);
        let step_m = task.speed_m_s * self.world.dt_s;
        let mut part = 1.0_f64;
        let mut next = to.clone();
        loop {
            let led_m = distance(from[task.agent], next[task.agent]) / step_m;
            let most = led_m.max(space.apart_m(&from, &next) / rules.joint_step_max_m);
            if most <= 1.0 || part < LEAST_PART {
                break;
            }
            part *= SLOWER / most;
            next = space.at(&from, to, part);
        }
        let is_free = space.is_way_free(&from, &next);
        if is_free {
            chain.points_mut().copy_from_slice(&next);
        }
        if !is_free || passed(chain, &from, &self.scratch.obstacles, 0.0).is_some() {
            chain.points_mut().copy_from_slice(&from);
            return self.body.plan = None;
        }
        if part == 1.0 {
            plan.way.pop_front();
        }
        let way_m = distance(from[task.agent], next[task.agent]);
        let moved = from.iter().zip(&next).filter(|(a, b)| a != b).count();
        if plan.way.is_empty() {
            self.body.plan = None;
        }
        self.body.tally.way_m += way_m;
        self.body.tally.moved += moved as u64;
    }
}

/// Part of the limit that a step along a plan aims at.
const SLOWER: f64 = 0.99;
