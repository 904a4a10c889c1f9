//! Motions to which nothing can object: the rest of the chain follows later, several at once.

use super::Acting;
use crate::driver::{Driver, Task};
use crate::motion::replan::Climbed;
use crate::rods::chain::MAX_COORDINATE_M;
use crate::rods::geometry::{Point, distance};
use crate::rods::veto::Moved;

impl<const D: usize> Acting<'_, D> {
    /// Returns whether the chain may follow the initiator's motion of this cycle later. The first cycle
    /// measures all rods, so that later only those count that move.
    pub(super) fn may_put_off(&self) -> bool {
        let (world, body) = (self.world, &*self.body);
        world.is_open()
            && !self.is_team()
            && world.rules.step_m.is_none()
            && self.spec.robots.is_none()
            && body.scattered.is_none()
            && body.chain.is_plain()
            && body.tally.steps > 0
            && !body.driving.ladder.is_pulling_back()
            && self.task().is_some_and(|task| self.leads_in_range(task))
    }

    /// Returns whether a task moves connector 0, and cannot leave the range of coordinates in this cycle.
    fn leads_in_range(&self, task: &Task<D>) -> bool {
        let most_m = MAX_COORDINATE_M - 2.0 * task.speed_m_s * self.world.dt_s;
        task.agent == 0
            && !matches!(task.driver, Driver::Navigate(_) | Driver::External)
            && self.body.chain.points()[0].iter().all(|x| x.abs() < most_m)
    }

    /// Moves the initiator alone.
    pub(super) fn lead(&mut self, task: &Task<D>, to: Point<D>) -> Climbed<D> {
        let goal_m = self.goal_distance_m(task);
        let body = &mut *self.body;
        body.driving.ladder.was_free(task.source(), goal_m, &self.world.rungs);
        let way_m = distance(body.chain.points()[0], to);
        if way_m > body.chain.least_move_m() {
            let dt_s = self.world.dt_s;
            body.tally.max_speed_m_s = body.tally.max_speed_m_s.max(way_m / dt_s);
            if body.put_off.lead(&mut body.chain, to, dt_s) {
                body.catch_up();
            }
        }
        let nothing =
            Moved { touched: 0..0, changed: 0, rotated: 0, max_slave_step_m: 0.0, cut_short: None };
        Climbed::Straight(nothing)
    }
}
