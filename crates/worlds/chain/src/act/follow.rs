//! Robots on wheels that keep to the connectors of their chain: where the swarm's followers meet
//! this world (slides E2, K5 to K7).

use super::Acting;
use crate::events::EventKind;
use crate::formation::{Robot, Robots};
use crate::rods::geometry::{Point, distance, in_dimensions, scaled, sub};
use crate::swarm::drive::Pose;
use crate::swarm::follower::{Follower, Goal};
use crate::swarm::laser::Body as Seen;
use sidestep_kernel::math::atan2;

impl<const D: usize> Acting<'_, D> {
    /// Moves the robots of a swarm after their connectors. All perceive each other as they were
    /// before.
    pub(super) fn follow(&mut self) {
        let Some(Robots { follower, .. }) = &self.spec.robots else { return };
        let agent = self.task().map(|task| task.agent);
        let mut others = std::mem::take(&mut self.scratch.seen);
        others.clear();
        others.extend(self.body.solids().map(|(_, solid)| solid.as_seen()));
        for k in 0..self.body.robots.len() {
            if Some(k) == agent {
                self.carry(k);
            } else {
                self.follow_one(follower, k, &others);
            }
        }
        self.scratch.seen = others;
    }

    /// The initiator is where its connector is.
    fn carry(&mut self, k: usize) {
        let [x, y, _] = self.body.driving.ahead;
        let at = in_dimensions(self.body.chain.points()[k]);
        self.body.robots[k].pose = Pose { at, heading_rad: atan2(y, x) };
    }

    fn follow_one(&mut self, follower: &Follower, k: usize, others: &[Seen]) {
        let Some(solid) = self.scratch.solid().in_plane() else { return };
        let was: Point<2> = in_dimensions(self.scratch.before[k]);
        let at: Point<2> = in_dimensions(self.body.chain.points()[k]);
        let velocity_m_s = scaled(sub(at, was), 1.0 / self.world.dt_s);
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
