//! An initiator on wheels: the link between the swarm's leader and this world (slides N1 to N6).

use super::Acting;
use super::go::Went;
use crate::driver::{Driver, Task};
use crate::formation::Robot;
use crate::navigate::{Goal, Navigator};
use crate::rods::geometry::{Point, distance, in_dimensions, toward};
use crate::swarm::drive::{Pose, Wheels};
use crate::swarm::follower::pace;
use sidestep_kernel::math::{atan2, cos, sin, wrap_angle};

/// Time for which a leader stands and waits for a robot that is late, s.
const WAITS_S: f64 = 3.0;
/// Part of its speed at which it goes on after that, because a robot that is blocked by another one may get
/// free only once their connectors are elsewhere.
const GOES_ON: f64 = 0.25;
/// Part of the gap to another robot that a leader leaves in a cycle: the other one may take a fifth of it.
const LEFT_TO_OTHERS: f64 = 0.25;

/// Angle between two headings that differ by rounding at most.
pub(super) const SAME_RAD: f64 = 1e-9;

impl<const D: usize> Acting<'_, D> {
    /// Returns whether a navigator has reached its goal.
    pub(super) fn has_arrived(&self, task: &Task<D>, navigator: &Navigator) -> bool {
        let at = in_dimensions(self.body.chain.points()[task.agent]);
        let index = self.body.driving.next as usize;
        navigator.goal.as_ref().is_some_and(|goal| goal.is_reached(at, index))
    }

    /// Returns the pose that a navigator's wheels would take it to.
    pub(super) fn steered(&mut self, task: &Task<D>, navigator: &Navigator) -> Option<Pose> {
        let decision = self.decision?;
        self.find_itself(task, navigator);
        let pace = self.pace();
        let driving = &mut self.body.driving;
        driving.rested = if pace == 0.0 { driving.rested.saturating_add(1) } else { 0 };
        self.body.stood = match decision.wheels == Wheels::default() {
            true => self.body.stood.saturating_add(1),
            // Whose patience has ended does not lose it again at once.
            false if decision.is_mover_ahead => self.body.stood,
            false => 0,
        };
        let mut leader = self.body.leader(task);
        leader.followed = decision.followed;
        self.body.driving.leader = Some(leader);
        self.body.tally.layers[decision.layer as usize - 1] += 1;
        let waited_s = self.world.starts_s(u64::from(self.body.driving.rested));
        let pace = if waited_s > WAITS_S { GOES_ON } else { pace };
        let wheels = decision.wheels.slowed(pace);
        Some(navigator.drive.step(leader.pose, wheels, self.world.dt_s))
    }

    /// Finds the place of a navigator whose task begins on the line to its goal.
    fn find_itself(&mut self, task: &Task<D>, navigator: &Navigator) {
        if let (None, Some(goal)) = (&self.body.driving.leader, &navigator.goal) {
            let at = in_dimensions(self.body.chain.points()[task.agent]);
            self.body.driving.next = goal.begins(at) as u32;
        }
    }

    /// Returns where the connector of a navigator has to go to be at its robot again, from which escapes or
    /// a pull by the other end have taken it; none while it is there. Where an escape has just moved it, it
    /// stays.
    pub(super) fn back_at_its_robot(&self, task: &Task<D>, step_m: f64) -> Option<Point<D>> {
        let leader = self.body.driving.leader.filter(|_| self.spec.robots.is_some())?;
        let k = task.agent;
        let (at, robot) = (self.body.chain.points()[k], in_dimensions(leader.pose.at));
        let has_fled = self.scratch.escaped.get(k) != self.scratch.before.get(k);
        (at != robot).then(|| if has_fled { at } else { toward(at, robot, step_m) })
    }

    /// Returns the heading to turn to in this cycle where a navigator's robot faces elsewhere than it did when
    /// its own wheels led, because it followed its connector since.
    pub(super) fn faces_elsewhere(&self, navigator: &Navigator) -> Option<f64> {
        let leader = self.body.driving.leader.filter(|_| self.spec.robots.is_some())?;
        let [x, y, _] = self.body.driving.ahead;
        let off_rad = wrap_angle(atan2(y, x) - leader.pose.heading_rad);
        let most = navigator.drive.max_wheel_m_s();
        let most_rad = navigator.drive.turn_rad_s(Wheels::new(-most, most)) * self.world.dt_s;
        let turn_rad = off_rad.clamp(-most_rad, most_rad);
        (off_rad.abs() > SAME_RAD).then(|| wrap_angle(leader.pose.heading_rad + turn_rad))
    }

    /// Turns a navigator's robot on the spot.
    pub(super) fn face(&mut self, heading_rad: f64) {
        if let Some(leader) = &mut self.body.driving.leader {
            leader.pose.heading_rad = heading_rad;
        }
    }

    /// Moves an initiator on wheels; one whose way is blocked may turn on the spot.
    pub(super) fn go_on_wheels(&mut self, task: &Task<D>, pose: Pose) {
        let Driver::Navigate(navigator) = &task.driver else { return };
        if self.comes_too_near(task.agent, pose.at) {
            self.give_way(task);
            return self.turn_where_blocked(task, navigator);
        }
        let was = self.body.chain.points()[task.agent];
        match self.go(task, in_dimensions(pose.at)) {
            Went::Ahead => self.has_steered(task, navigator, pose.heading_rad),
            // A robot whose connector was pulled away follows it on its wheels.
            Went::Nowhere
                if self.spec.robots.is_some() && self.body.chain.points()[task.agent] != was => {}
            Went::Nowhere => self.turn_where_blocked(task, navigator),
        }
    }

    /// Returns whether a leader's robot would come nearer to another one of its chain than that one, which keeps a
    /// part of the gap for itself, allows for.
    fn comes_too_near(&self, agent: usize, to: Point<2>) -> bool {
        let robots = &self.body.robots;
        let Some(robot) = robots.get(agent) else { return false };
        let apart_m = 2.0 * self.body.robot_radius_m;
        let others = robots.iter().enumerate().filter(|(k, _)| *k != agent);
        let mut others = others.map(|(_, other)| other.pose.at);
        others.any(|other| {
            let was_m = distance(robot.pose.at, other) - apart_m;
            let gap_m = distance(to, other) - apart_m;
            gap_m < was_m && gap_m < LEFT_TO_OTHERS * was_m.max(0.0)
        })
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
