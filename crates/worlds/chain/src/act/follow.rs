//! Robots on wheels that keep to the connectors of their chain: the link between the swarm's
//! followers and this world (slides E2, K5 to K7).

use super::wheels::SAME_RAD;
use super::{Acting, Setting};
use crate::events::EventKind;
use crate::formation::{Robot, Robots};
use crate::rods::geometry::{Point, distance, dot, in_dimensions, scaled, sub};
use crate::rods::obstacle::Obstacles;
use crate::state::Body;
use crate::swarm::drive::Pose;
use crate::swarm::follower::{Follower, Goal};
use crate::swarm::laser::Body as Seen;
use sidestep_kernel::math::{atan2, wrap_angle};

/// The circumstances in which the robots of a chain follow.
#[derive(Clone, Copy)]
struct Following<'a, const D: usize> {
    setting: Setting<'a, D>,
    follower: &'a Follower,
    /// Obstacles that are solid to robots.
    solid: &'a Obstacles<D>,
    /// The robots of the chain as they were before the cycle.
    robots: &'a [Seen],
}

/// Moves the robots of a swarm toward their connectors. All perceive each other as they were
/// before. Returns the least gap around a robot, meters. `seen` is a buffer.
pub(super) fn follow<const D: usize>(
    setting: Setting<'_, D>,
    acting: &mut Acting<'_, D>,
    solid: &Obstacles<D>,
    seen: &mut Vec<Seen>,
) -> f64 {
    let mut gap_m = f64::INFINITY;
    let Some(Robots { follower, .. }) = &setting.spec.robots else { return gap_m };
    let leader = leader_on_wheels(setting, acting.body);
    seen.clear();
    seen.extend(acting.body.solids().map(|(_, solid)| solid.as_seen()));
    let following = Following { setting, follower, solid, robots: seen };
    for k in 0..acting.body.robots.len() {
        if Some(k) == leader {
            carry(acting.body, k);
        } else {
            gap_m = gap_m.min(following.follow(acting, k));
        }
    }
    lead_from_its_robot(setting, acting.body);
    gap_m
}

/// Returns the connector of a navigator that its own wheels have taken to where it is, or that stands.
/// Whatever else moves a connector, its robot follows.
fn leader_on_wheels<const D: usize>(setting: Setting<'_, D>, body: &Body<D>) -> Option<usize> {
    let agent = setting.task(body)?.agent;
    let leader = body.driving.leader.as_ref()?;
    (in_dimensions(body.chain.points()[agent]) == leader.pose.at).then_some(agent)
}

/// Lets a navigator whose robot follows its connector go on from where the robot is.
fn lead_from_its_robot<const D: usize>(setting: Setting<'_, D>, body: &mut Body<D>) {
    let Some(agent) = setting.task(body).map(|task| task.agent) else { return };
    let (at, robot) = (body.chain.points()[agent], &body.robots[agent]);
    if let Some(leader) = &mut body.driving.leader
        && in_dimensions(at) != leader.pose.at
    {
        leader.pose = robot.pose;
    }
}

/// Puts the robot of a navigator where its wheels have taken it.
fn carry<const D: usize>(body: &mut Body<D>, k: usize) {
    let Some(leader) = body.driving.leader else { return };
    let [x, y, _] = body.driving.ahead;
    let at = in_dimensions(body.chain.points()[k]);
    let ahead_rad = atan2(y, x);
    let turns = wrap_angle(ahead_rad - leader.pose.heading_rad).abs() > SAME_RAD;
    let heading_rad = if turns { leader.pose.heading_rad } else { ahead_rad };
    body.robots[k].pose = Pose { at, heading_rad };
}

impl<const D: usize> Following<'_, D> {
    /// Moves one robot; returns the gap around it, meters.
    fn follow(self, acting: &mut Acting<'_, D>, k: usize) -> f64 {
        let Some(solid) = self.solid.in_plane() else { return f64::INFINITY };
        let Acting { body, before, told, .. } = acting;
        let dt_s = self.setting.world.dt_s;
        let was: Point<2> = in_dimensions(before.points[k]);
        let at: Point<2> = in_dimensions(body.chain.points()[k]);
        let mut velocity_m_s = scaled(sub(at, was), 1.0 / dt_s);
        let leads = self.setting.task(body).is_some_and(|task| task.agent == k);
        if leads && dot(velocity_m_s, sub(at, body.robots[k].pose.at)) < 0.0 {
            // A connector that comes back to its robot finds it waiting.
            velocity_m_s = [0.0; 2];
        }
        let others = self.robots.iter().enumerate().filter(move |(i, _)| *i != k).map(|(_, o)| *o);
        let goal = Goal { at, velocity_m_s };
        let followed = self.follower.follow(&body.robots[k].pose, &goal, solid, others, dt_s);
        let lag_m = distance(followed.pose.at, at);
        body.tally.robots.count(&followed, lag_m);
        if followed.is_bumped && !body.robots[k].is_bumped {
            body.tally.robots.bumper_events += 1;
            told.tell(&body.chain, EventKind::Bumper, k, lag_m);
        }
        body.robots[k] = Robot { pose: followed.pose, is_bumped: followed.is_bumped };
        followed.gap_m
    }
}
