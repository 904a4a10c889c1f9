//! Robots on wheels that keep to the connectors of their chain: the link between the swarm's
//! followers and this world (slides E2, K5 to K7).

use super::wheels::HEADING_TOLERANCE_RAD;
use super::{ChainContext, ChainCycleState};
use crate::events::EventKind;
use crate::formation::{Robot, RobotSwarmConfig};
use crate::state::ChainBodyState;
use crate::swarm::drive::Pose2;
use crate::swarm::follower::{Follower, FollowerTarget};
use crate::swarm::laser::{NearbyBodies, RobotBody};
use sidestep_kernel::math::{atan2, wrap_angle};
use sidestep_rods::Obstacles;
use sidestep_rods::geometry::{Point, convert_dimensions, distance, dot, scaled, sub};

/// The circumstances in which the robots of a chain follow.
#[derive(Clone, Copy)]
struct FollowContext<'a, const D: usize> {
    context: ChainContext<'a, D>,
    follower: &'a Follower,
    /// Obstacles, with the robots of other chains but not their rods, which are virtual.
    solid: &'a Obstacles<D>,
    /// The robots of the chain as they were before the cycle.
    robots: &'a [RobotBody],
}

/// Moves the robots of a swarm toward their connectors. All perceive each other as they were before the cycle, so
/// that their order does not matter. Returns the least gap around a robot, meters; `robot_bodies` is a buffer.
pub(super) fn move_swarm_robots<const D: usize>(
    context: ChainContext<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    solid: &Obstacles<D>,
    robot_bodies: &mut Vec<RobotBody>,
) -> f64 {
    let mut gap_m = f64::INFINITY;
    let Some(RobotSwarmConfig { follower, .. }) = &context.spec.robots else { return gap_m };
    let leader = find_wheeled_leader(context, acting.body);
    robot_bodies.clear();
    robot_bodies.extend(acting.body.solids().map(|(_, solid)| solid.robot_body()));
    let following = FollowContext { context, follower, solid, robots: robot_bodies };
    for k in 0..acting.body.robots.len() {
        if Some(k) == leader {
            update_navigator_robot(acting.body, k);
        } else {
            gap_m = gap_m.min(following.follow(acting, k));
        }
    }
    sync_leader_pose(context, acting.body);
    gap_m
}

/// Returns the connector of a navigator that its own wheels have moved, or that stands. Where anything else moves
/// the connector, its robot follows like the others.
fn find_wheeled_leader<const D: usize>(
    context: ChainContext<'_, D>,
    body: &ChainBodyState<D>,
) -> Option<usize> {
    let agent = context.task(body)?.agent;
    let leader = body.driving.leader.as_ref()?;
    (convert_dimensions(body.chain.points()[agent]) == leader.pose.at).then_some(agent)
}

/// Lets a navigator whose robot follows its connector go on from where the robot is.
fn sync_leader_pose<const D: usize>(context: ChainContext<'_, D>, body: &mut ChainBodyState<D>) {
    let Some(agent) = context.task(body).map(|task| task.agent) else { return };
    let at = body.chain.points()[agent];
    let robot = &body.robots[agent];
    if let Some(leader) = &mut body.driving.leader
        && convert_dimensions(at) != leader.pose.at
    {
        leader.pose = robot.pose;
    }
}

/// Moves the robot of a navigator to where its wheels have taken it.
fn update_navigator_robot<const D: usize>(body: &mut ChainBodyState<D>, k: usize) {
    let Some(leader) = body.driving.leader else { return };
    let [x, y, _] = body.driving.ahead;
    let at = convert_dimensions(body.chain.points()[k]);
    let ahead_rad = atan2(y, x);
    // They differ while the robot turns on the spot, and otherwise by rounding only.
    let turns = wrap_angle(ahead_rad - leader.pose.heading_rad).abs() > HEADING_TOLERANCE_RAD;
    let heading_rad = if turns { leader.pose.heading_rad } else { ahead_rad };
    body.robots[k].pose = Pose2 { at, heading_rad };
}

impl<const D: usize> FollowContext<'_, D> {
    /// Moves one robot; returns the gap around it, meters.
    fn follow(self, acting: &mut ChainCycleState<'_, D>, k: usize) -> f64 {
        let Some(solid) = self.solid.as_planar() else { return f64::INFINITY };
        let ChainCycleState { body, before, sink, .. } = acting;
        let dt_s = self.context.world.dt_s;
        let was: Point<2> = convert_dimensions(before.points[k]);
        let at: Point<2> = convert_dimensions(body.chain.points()[k]);
        let mut velocity_m_s = scaled(sub(at, was), 1.0 / dt_s);
        let is_leader = self.context.task(body).is_some_and(|task| task.agent == k);
        if is_leader && dot(velocity_m_s, sub(at, body.robots[k].pose.at)) < 0.0 {
            // A connector that comes back is waited for: by its velocity the robot would drive away from it.
            velocity_m_s = [0.0; 2];
        }
        let others = self.robots.iter().enumerate().filter(move |(i, _)| *i != k).map(|(_, o)| *o);
        let around = NearbyBodies { obstacles: solid, robots: others };
        let goal = FollowerTarget { at, velocity_m_s };
        let followed = self.follower.follow(&body.robots[k].pose, &goal, around, dt_s);
        let lag_m = distance(followed.pose.at, at);
        body.tally.robots.record(&followed, lag_m);
        if followed.is_bumped && !body.robots[k].is_bumped {
            body.tally.robots.bumper_events += 1;
            sink.record(&body.chain, EventKind::Bumper, k, lag_m);
        }
        body.robots[k] = Robot { pose: followed.pose, is_bumped: followed.is_bumped };
        followed.gap_m
    }
}
