//! Robots on wheels that keep to the connectors of their chain: where the swarm's followers meet
//! this world (slides E2, K5 to K7).

use super::act::Step;
use super::events::EventKind;
use super::navigate::{Solid, in_plane, plane_point};
use super::rods::geometry::{Point, distance, scaled, sub};
use super::state::Body;
use super::swarm::convoy;
use super::swarm::drive::Pose;
use super::swarm::follower::{Follower, Goal};
use super::swarm::laser::Body as Seen;
use super::world::{ChainWorld, Scratch};
use serde::{Deserialize, Serialize};

/// The robots of a swarm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robots {
    /// How each behaves.
    pub follower: Follower,
    /// A leader on wheels waits for a robot that is so far from its connector, and is slower from
    /// half of that on; infinite for never.
    pub lag_limit_m: f64,
}

/// A robot of a swarm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Robot {
    /// Where it is.
    pub pose: Pose,
    /// Whether its bumper is pressed.
    pub is_bumped: bool,
}

impl<const D: usize> Body<D> {
    /// What others see of the chain: its robots, or its connectors where it has none.
    pub(super) fn solids(&self) -> impl Iterator<Item = (usize, Solid)> + '_ {
        let solid = |k: usize| match self.robots.get(k) {
            Some(robot) => Solid { at: robot.pose.at, radius_m: self.robot_radius_m },
            None => {
                let radius_m = self.chain.connectors()[k].radius_m;
                Solid { at: plane_point(self.chain.points()[k]), radius_m }
            }
        };
        (0..self.chain.points().len()).map(move |k| (k, solid(k)))
    }
}

impl<const D: usize> ChainWorld<D> {
    /// Moves the robots of a swarm after their connectors. All perceive each other as they were
    /// before.
    pub(super) fn follow(&self, body: &mut Body<D>, turn: Step<'_, D>, scratch: &mut Scratch<D>) {
        let Some(Robots { follower, .. }) = &turn.spec.robots else { return };
        let agent = turn.spec.tasks.get(body.driving.task as usize).map(|task| task.agent);
        let mut others = std::mem::take(&mut scratch.seen);
        others.clear();
        others.extend(body.solids().map(|(_, solid)| solid.as_seen()));
        for k in 0..body.robots.len() {
            if Some(k) == agent {
                self.carry(body, k);
            } else {
                self.follow_one(body, (follower, k), (turn, &others), scratch);
            }
        }
        scratch.seen = others;
    }

    /// What part of its speed a leader may go for the sake of the latest robot.
    pub(super) fn pace(&self, body: &Body<D>, turn: Step<'_, D>) -> f64 {
        let Some(robots) = &turn.spec.robots else { return 1.0 };
        let lag_m = |(robot, at): (&Robot, &Point<D>)| distance(robot.pose.at, plane_point(*at));
        let lags_m = body.robots.iter().zip(body.chain.points()).map(lag_m);
        convoy::pace(lags_m.fold(0.0, f64::max), robots.lag_limit_m)
    }

    /// The initiator is where its connector is.
    fn carry(&self, body: &mut Body<D>, k: usize) {
        let [x, y, _] = body.driving.ahead;
        let heading_rad = sidestep_kernel::math::atan2(y, x);
        body.robots[k].pose = Pose { at: plane_point(body.chain.points()[k]), heading_rad };
    }

    fn follow_one(
        &self,
        body: &mut Body<D>,
        (follower, k): (&Follower, usize),
        (turn, others): (Step<'_, D>, &[Seen]),
        scratch: &mut Scratch<D>,
    ) {
        let Some(solid) = in_plane(scratch.solid()) else { return };
        let (was, at) = (plane_point(scratch.before[k]), plane_point(body.chain.points()[k]));
        let velocity_m_s: Point<2> = scaled(sub(at, was), 1.0 / self.dt_s);
        let rest = || others.iter().enumerate().filter(move |(i, _)| *i != k).map(|(_, o)| *o);
        let pose = &body.robots[k].pose;
        let goal = Goal { at, velocity_m_s };
        let followed = follower.follow(pose, &goal, (solid, rest()), self.dt_s);
        let lag_m = distance(followed.pose.at, at);
        let tally = &mut body.tally.robots;
        tally.steps += 1;
        tally.lag_sum_m += lag_m;
        tally.max_lag_m = tally.max_lag_m.max(lag_m);
        tally.held_steps += u64::from(followed.is_held);
        tally.bumper_steps += u64::from(followed.is_bumped);
        tally.min_gap_m = tally.min_gap_m.min(followed.gap_m);
        scratch.robots_gap_m = scratch.robots_gap_m.min(followed.gap_m);
        if followed.is_bumped && !body.robots[k].is_bumped {
            tally.bumper_events += 1;
            scratch.events.push(turn.event(EventKind::Bumper, k, lag_m));
        }
        body.robots[k] = Robot { pose: followed.pose, is_bumped: followed.is_bumped };
    }
}
