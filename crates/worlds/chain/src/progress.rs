//! Progress of a chain through its tasks.

use super::driver::{Task, TaskKind};
use super::state::{ChainBodyState, ChainWorldState};
use super::world::ChainWorld;
use sidestep_rods::geometry::convert_dimensions;

impl<const D: usize> ChainWorld<D> {
    /// Returns the part of its tasks that a chain has done, from 0 to 1. Several tasks have equal
    /// weight; parts that were given up do not count as done.
    pub fn progress(&self, slot: usize, body: &ChainBodyState<D>) -> f64 {
        let tasks = &self.chains[slot].tasks;
        let part = tasks.get(body.driving.task as usize).map(|task| self.fraction_done(body, task));
        let undone: f64 = body.tally.given_up.iter().map(|what| what.undone).sum();
        let done = f64::from(body.driving.task) + part.unwrap_or(0.0) - undone;
        (done / tasks.len() as f64).clamp(0.0, 1.0)
    }

    /// Returns the part of its present task that an initiator has finished: for scripts by motions,
    /// for targets by targets, for timed tasks by time; for wandering the part of the distance that
    /// its speed allows in the whole run; for resting, for orders from outside and for drivers of the
    /// program's own the part of the run.
    pub(crate) fn fraction_done(&self, body: &ChainBodyState<D>, task: &Task<D>) -> f64 {
        let part = match &task.driver {
            _ if task.lasts_s.is_finite() => {
                self.cycle_start_time_s(body.driving.cycles) / task.lasts_s
            }
            TaskKind::Rest | TaskKind::External | TaskKind::Own(_) => {
                body.driving.cycles as f64 / self.cycles.max(1) as f64
            }
            TaskKind::Wander(_) => self.path_fraction(body, task),
            TaskKind::Script(_) => f64::from(body.driving.next) / body.motions.len().max(1) as f64,
            TaskKind::Targets(targets) => {
                f64::from(body.driving.next) / targets.places.len().max(1) as f64
            }
            TaskKind::Navigate(navigator) => match &navigator.goal {
                Some(goal) => {
                    let start = convert_dimensions(body.driving.start.position_m);
                    goal.progress(body.driving.next as usize, start, body.driving.nearest_m)
                }
                None => self.path_fraction(body, task),
            },
        };
        part.clamp(0.0, 1.0)
    }

    fn path_fraction(&self, body: &ChainBodyState<D>, task: &Task<D>) -> f64 {
        body.driving.way_m.gone / (task.speed_m_s * self.cycle_start_time_s(self.cycles.max(1)))
    }

    /// Returns whether all tasks of all chains are done and everything is whole.
    pub(crate) fn is_all_done(&self, state: &ChainWorldState<D>) -> bool {
        self.chains.iter().enumerate().all(|(slot, spec)| {
            let body = state.body_before_deferred_motions(slot);
            let is_done = body.driving.task as usize >= spec.tasks.len();
            is_done && body.scattered.is_none()
        })
    }
}
