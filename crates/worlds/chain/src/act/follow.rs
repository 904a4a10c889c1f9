//! Robots on wheels that keep to the connectors of their chain: the link between the swarm's
//! followers and this world (slides E2, K5 to K7).

use super::Acting;
use super::wheels::SAME_RAD;
use crate::events::EventKind;
use crate::formation::{Robot, Robots};
use crate::rods::geometry::{Point, distance, dot, in_dimensions, scaled, sub};
use crate::swarm::drive::Pose;
use crate::swarm::follower::{Follower, Goal};
use crate::swarm::laser::Body as Seen;
use sidestep_kernel::math::{atan2, wrap_angle};

impl<const D: usize> Acting<'_, D> {
    /// Moves the robots of a swarm toward their connectors. All perceive each other as they were
    /// before.
    pub(super) fn follow(&mut self) {
        let Some(Robots { follower, .. }) = &self.spec.robots else { return };
        let leader = self.leader_on_wheels();
        let mut others = std::mem::take(&mut self.scratch.seen);
        others.clear();
        others.extend(self.body.solids().map(|(_, solid)| solid.as_seen()));
        for k in 0..self.body.robots.len() {
            if Some(k) == leader {
                self.carry(k);
            } else {
                self.follow_one(follower, k, &others);
            }
        }
        self.lead_from_its_robot();
        self.scratch.seen = others;
    }

    /// Returns the connector of a navigator that its own wheels have taken to where it is, or that stands.
    /// Whatever else moves a connector, its robot follows.
    fn leader_on_wheels(&self) -> Option<usize> {
        let agent = self.task()?.agent;
        let leader = self.body.driving.leader.as_ref()?;
        (in_dimensions(self.body.chain.points()[agent]) == leader.pose.at).then_some(agent)
    }

    /// Lets a navigator whose robot follows its connector go on from where the robot is.
    fn lead_from_its_robot(&mut self) {
        let Some(agent) = self.task().map(|task| task.agent) else { return };
        let (at, robot) = (self.body.chain.points()[agent], &self.body.robots[agent]);
        if let Some(leader) = &mut self.body.driving.leader
            && in_dimensions(at) != leader.pose.at
        {
            leader.pose = robot.pose;
        }
    }

    /// Puts the robot of a navigator where its wheels have taken it.
    fn carry(&mut self, k: usize) {
        let Some(leader) = self.body.driving.leader else { return };
        let [x, y, _] = self.body.driving.ahead;
        let at = in_dimensions(self.body.chain.points()[k]);
        let ahead_rad = atan2(y, x);
        let turns = wrap_angle(ahead_rad - leader.pose.heading_rad).abs() > SAME_RAD;
        let heading_rad = if turns { leader.pose.heading_rad } else { ahead_rad };
        self.body.robots[k].pose = Pose { at, heading_rad };
    }

    fn follow_one(&mut self, follower: &Follower, k: usize, others: &[Seen]) {
        let Some(solid) = self.scratch.solid().in_plane() else { return };
        let was: Point<2> = in_dimensions(self.scratch.before[k]);
        let at: Point<2> = in_dimensions(self.body.chain.points()[k]);
        let mut velocity_m_s = scaled(sub(at, was), 1.0 / self.world.dt_s);
        let leads = self.task().is_some_and(|task| task.agent == k);
        if leads && dot(velocity_m_s, sub(at, self.body.robots[k].pose.at)) < 0.0 {
            // A connector that comes back to its robot finds it waiting.
            velocity_m_s = [0.0; 2];
        }
        let rest = || others.iter().enumerate().filter(move |(i, _)| *i != k).map(|(_, o)| *o);
        let goal = Goal { at, velocity_m_s };
        let pose = &self.body.robots[k].pose;
        let followed = follower.follow(pose, &goal, solid, rest(), self.world.dt_s);
        let lag_m = distance(followed.pose.at, at);
        self.body.tally.robots.count(&followed, lag_m);
        self.scratch.robots_gap_m = self.scratch.robots_gap_m.min(followed.gap_m);
        if followed.is_bumped && !self.body.robots[k].is_bumped {
            self.body.tally.robots.bumper_events += 1;
            self.tell(EventKind::Bumper, k, lag_m);
        }
        self.body.robots[k] = Robot { pose: followed.pose, is_bumped: followed.is_bumped };
    }
}
