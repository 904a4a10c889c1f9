//! Ways that are planned once local rules come no nearer to a target.

use super::Acting;
use crate::arms::plan::{Errand, Posture, Space, plan};
use crate::driver::{Targets, Task};
use crate::events::EventKind;
use crate::rods::geometry::{Point, distance};
use crate::rods::passage::passed;
use crate::state::Plan;
use crate::world::purpose;

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
        let Some(mut plan) = self.body.plan.take() else { return };
        let (rules, obstacles) = (&self.world.rules, &self.scratch.obstacles);
        let chain = &self.body.chain;
        let Ok(space) = Space::new(chain, obstacles, rules.self_collision, task.agent) else {
            return;
        };
        let Some(to) = plan.way.front() else { return };
        let most_m = Most { led: task.speed_m_s * self.world.dt_s, joint: rules.joint_step_max_m };
        let (from, (next, is_there)) = (space.present(), step(&space, task.agent, to, &most_m));
        if !space.is_way_free(&from, &next) {
            return;
        }
        let chain = &mut self.body.chain;
        chain.points_mut().copy_from_slice(&next);
        if passed(chain, &from, obstacles, 0.0).is_some() {
            chain.points_mut().copy_from_slice(&from);
            return;
        }
        self.body.tally.way_m += distance(from[task.agent], next[task.agent]);
        self.body.tally.moved += from.iter().zip(&next).filter(|(a, b)| a != b).count() as u64;
        if is_there {
            plan.way.pop_front();
        }
        self.body.plan = Some(plan).filter(|plan| !plan.way.is_empty());
    }
}

/// Longest ways in a cycle, meters.
struct Most {
    /// Longest way of the initiator.
    led: f64,
    /// Longest way of any connector.
    joint: f64,
}

/// Returns the posture on the way to another that a cycle is enough for, and whether it is that one.
fn step<const D: usize>(
    space: &Space<'_, D>,
    agent: usize,
    to: &[Point<D>],
    most_m: &Most,
) -> (Posture<D>, bool) {
    let from = space.present();
    let (mut part, mut next) = (1.0, to.to_vec());
    while part >= LEAST_PART {
        let led = distance(from[agent], next[agent]) / most_m.led;
        let excess = led.max(space.apart_m(&from, &next) / most_m.joint);
        if excess <= 1.0 {
            break;
        }
        part *= SLOWER / excess;
        next = space.at(&from, to, part);
    }
    (next, part == 1.0)
}
