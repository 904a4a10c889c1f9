//! An initiator on wheels: the link between the swarm's leader and this world (slides N1 to N6).

use super::Acting;
use super::go::Went;
use crate::driver::{Driver, Task};
use crate::formation::Robot;
use crate::navigate::{Goal, Navigator};
use crate::rods::geometry::{Point, distance, in_dimensions};
use crate::swarm::drive::Pose;
use crate::swarm::follower::pace;
use sidestep_kernel::math::{cos, sin};

impl<const D: usize> Acting<'_, D> {
    /// Whether a navigator has reached its goal.
    pub(super) fn has_arrived(&self, task: &Task<D>, navigator: &Navigator) -> bool {
        let at = in_dimensions(self.body.chain.points()[task.agent]);
        let index = self.body.driving.next as usize;
        navigator.goal.as_ref().is_some_and(|goal| goal.is_reached(at, index))
    }

    /// Returns the pose that a navigator's wheels would take it to.
    pub(super) fn steered(&mut self, task: &Task<D>, navigator: &Navigator) -> Option<Pose> {
        let decision = self.decision?;
        let mut leader = self.body.leader(task);
        leader.followed = decision.followed;
        self.body.driving.leader = Some(leader);
        self.body.tally.layers[decision.layer as usize - 1] += 1;
        let wheels = decision.wheels.slowed(self.pace());
        Some(navigator.drive.step(leader.pose, wheels, self.world.dt_s))
    }

    /// Moves an initiator on wheels; one whose way is blocked may turn on the spot.
    pub(super) fn go_on_wheels(&mut self, task: &Task<D>, pose: Pose) {
        let Driver::Navigate(navigator) = &task.driver else { return };
        match self.go(task, in_dimensions(pose.at)) {
            Went::Ahead => self.has_steered(task, navigator, pose.heading_rad),
            Went::Nowhere => self.turn_where_blocked(task, navigator),
        }
    }

    /// Updates a navigator that has moved, by a heading that the chain did not object to.
    fn has_steered(&mut self, task: &Task<D>, navigator: &Navigator, heading_rad: f64) {
        let at: Point<2> = in_dimensions(self.body.chain.points()[task.agent]);
        let driving = &mut self.body.driving;
        let Some(leader) = &mut driving.leader else { return };
        leader.pose = Pose { at, heading_rad };
        driving.ahead = [cos(heading_rad), sin(heading_rad), 0.0];
        if let Some(goal) = &navigator.goal {
            driving.next = goal.passed(at, driving.next as usize) as u32;
            if let Goal::Target { at: target, .. } = goal {
                driving.nearest_m = driving.nearest_m.min(distance(at, *target));
            }
        }
    }

    /// Turns a navigator whose way is blocked on the spot, if it can.
    fn turn_where_blocked(&mut self, task: &Task<D>, navigator: &Navigator) {
        let (Some(leader), Some(decision)) = (self.body.driving.leader, self.decision) else {
            return;
        };
        let wheels = navigator.leader.when_blocked(decision.wheels);
        let turned = navigator.drive.step(leader.pose, wheels, self.world.dt_s);
        self.has_steered(task, navigator, turned.heading_rad);
    }

    /// Returns the part of its speed at which a leader may go, so that the latest robot keeps up.
    fn pace(&self) -> f64 {
        let Some(robots) = &self.spec.robots else { return 1.0 };
        let lag_m = |(robot, at): (&Robot, &Point<D>)| distance(robot.pose.at, in_dimensions(*at));
        let lags_m = self.body.robots.iter().zip(self.body.chain.points()).map(lag_m);
        pace(lags_m.fold(0.0, f64::max), robots.lag_limit_m)
    }
}
