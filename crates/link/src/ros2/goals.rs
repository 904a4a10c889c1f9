//! Goal poses from outside, for robots whose behavior is `external`: each goes there as a robot whose behavior is `goto` does,
//! by actions that are ordered cycle by cycle. So the orders are part of the run, and it replays without the goals.

use crate::plant::frames::{floor_pose, frame_name};
use sidestep::import::bag::cdr::decode;
use sidestep::import::bag::messages::PoseStamped;
use sidestep::kernel::{EntityId, Simulation};
use sidestep::worlds::robots::RobotsRun;
use sidestep::worlds::robots::decide::TripEvent;
use sidestep::worlds::robots::drive::grid::Pose2;
use sidestep::worlds::robots::goal_agent::GoalAgent;
use sidestep_session::ros::MAP_FRAME;
use std::any::Any;
use std::collections::BTreeMap;

/// The order that marks a trip.
pub const TRIP_ORDER: &str = "trip";

/// A pose to which a robot is sent.
#[derive(Debug, Clone, PartialEq)]
pub struct GoalPose {
    /// The frame of the pose, without a slash before it.
    pub frame: String,
    /// The pose on the floor of that frame.
    pub pose: Pose2,
}

impl GoalPose {
    /// Reads a message `geometry_msgs/msg/PoseStamped`; `None` where the bytes are no such message, a number is not finite,
    /// or its orientation is none.
    pub fn from_pose_stamped(bytes: &[u8]) -> Option<Self> {
        let message: PoseStamped = decode(bytes).ok()?;
        let pose = floor_pose(&message.pose)?;
        Some(Self { frame: frame_name(&message.header.frame_id).into(), pose })
    }

    /// Returns the pose in the frame of the map.
    ///
    /// # Errors
    /// With the reason, when it is one of another frame.
    pub fn in_map(&self, map_frame: &str) -> Result<Pose2, String> {
        if self.frame == frame_name(map_frame) {
            return Ok(self.pose);
        }
        Err(format!("it is in the frame `{}`; give it in `{map_frame}`", self.frame.escape_debug()))
    }
}

/// Orders to robots that have a goal: an action for each, and a mark for those whose trip begins or is complete.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GoalActions {
    /// The robots, in ascending order.
    pub robots: Vec<EntityId>,
    /// The numbers of their actions.
    pub actions: Vec<f64>,
    /// The robots with a mark, in ascending order.
    pub marked: Vec<EntityId>,
    /// The numbers of the marks.
    pub marks: Vec<f64>,
}

/// The robots of a run that can be sent to places.
#[derive(Debug, Default)]
pub struct GoalOrders {
    /// Each with its program, once it has had a goal: it knows the ways of its map.
    robots: BTreeMap<EntityId, Option<GoalAgent>>,
    accepted: u64,
    refused: u64,
    /// The last reason that was told.
    told: String,
}

impl GoalOrders {
    /// Returns those of a run: none in other worlds than that of robots.
    pub fn new(run: &dyn Simulation) -> Self {
        let mut robots = BTreeMap::new();
        if let Some(run) = robots_run(run) {
            let world = run.world();
            let ids =
                (0..world.robot_count() as EntityId).filter(|&id| world.is_external_robot(id));
            robots.extend(ids.map(|id| (id, None)));
        }
        Self { robots, ..Self::default() }
    }

    /// Returns the robots, in ascending order.
    pub fn robots(&self) -> impl Iterator<Item = EntityId> {
        self.robots.keys().copied()
    }

    /// Returns the number of goals that were taken.
    pub fn accepted(&self) -> u64 {
        self.accepted
    }

    /// Returns the number of goals that were refused.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Takes a goal for a robot in place of its last one, and returns whether it does. One that cannot be is refused, counted
    /// and told; the goal before stays then.
    pub fn receive(&mut self, run: &dyn Simulation, robot: EntityId, goal: &GoalPose) -> bool {
        let reason = match self.set_goal(run, robot, goal) {
            Ok(()) => {
                self.accepted += 1;
                return true;
            }
            Err(reason) => format!("a goal of robot {robot} is refused: {reason}"),
        };
        self.refused += 1;
        // A sender that repeats itself is told once.
        if reason != self.told {
            tracing::warn!("{reason} ({} refused so far)", self.refused);
            self.told = reason;
        }
        false
    }

    fn set_goal(
        &mut self,
        run: &dyn Simulation,
        robot: EntityId,
        goal: &GoalPose,
    ) -> Result<(), String> {
        let no_robot = || format!("robot {robot} takes no goals");
        let run = robots_run(run).ok_or_else(no_robot)?;
        let agent = self.robots.get_mut(&robot).ok_or_else(no_robot)?;
        let pose = goal.in_map(MAP_FRAME)?;
        let from = run.world().place(run.state(), robot).ok_or_else(no_robot)?;
        if agent.is_none() {
            *agent = GoalAgent::new(run.world().clone(), robot);
        }
        let agent = agent.as_mut().ok_or_else(no_robot)?;
        agent.set_goal(from, &pose).map_err(|refusal| refusal.to_string())?;
        Ok(())
    }

    /// Forgets the goal of a robot.
    pub fn forget(&mut self, robot: EntityId) {
        if let Some(Some(agent)) = self.robots.get_mut(&robot) {
            agent.clear_goal();
        }
    }

    /// Forgets all goals.
    pub fn clear(&mut self) {
        self.robots.values_mut().flatten().for_each(GoalAgent::clear_goal);
    }

    /// Returns the orders for the next cycle, to robots with a goal that act in it.
    pub fn orders(&mut self, run: &dyn Simulation) -> GoalActions {
        let mut orders = GoalActions::default();
        let with_goal = self
            .robots
            .iter()
            .filter(|(_, agent)| agent.as_ref().is_some_and(|agent| agent.goal().is_some()));
        let with_goal: Vec<EntityId> = with_goal.map(|(&id, _)| id).collect();
        let Some(run) = robots_run(run).filter(|_| !with_goal.is_empty()) else { return orders };
        let percepts = run.world().external_percepts(run.state(), run.cycle(), &with_goal);
        for percept in percepts {
            let Some(Some(agent)) = self.robots.get_mut(&percept.id) else { continue };
            let control = match agent.decide(&percept) {
                Ok(control) => control,
                Err(reason) => {
                    tracing::warn!("robot {} forgets its goal: {reason}", percept.id);
                    agent.clear_goal();
                    continue;
                }
            };
            orders.robots.push(percept.id);
            orders.actions.push(f64::from(control.action));
            let Some(trip) = control.trip else { continue };
            orders.marked.push(percept.id);
            // The numbers of the order `trip`: 0 is none.
            orders.marks.push(match trip {
                TripEvent::Started => 1.0,
                TripEvent::Completed => 2.0,
            });
        }
        orders
    }
}

fn robots_run(run: &dyn Simulation) -> Option<&RobotsRun> {
    let run: &dyn Any = run;
    run.downcast_ref()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::import::bag::cdr::encode;
    use sidestep::import::bag::messages::{Header, Pose, Time};

    fn message(frame: &str, orientation: [f64; 4]) -> Vec<u8> {
        let header = Header { stamp: Time::from_secs(1.0), frame_id: frame.into() };
        encode(&PoseStamped { header, pose: Pose { position: [1.0, 2.0, 9.0], orientation } })
    }

    #[test]
    fn only_a_pose_with_an_orientation_is_a_goal_and_only_one_in_the_map() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let goal = GoalPose::from_pose_stamped(&message("/map", [0.0, 0.0, half, half]));
        let pose = goal.expect("a goal").in_map("map").expect("of the map");
        assert_eq!(pose.at_m, [1.0, 2.0]);
        assert!((pose.yaw_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        let odom = GoalPose::from_pose_stamped(&message("robot_0/odom", [0.0, 0.0, 0.0, 1.0]));
        let refused = odom.expect("a goal").in_map("map").expect_err("another frame");
        assert!(refused.contains("robot_0/odom") && refused.contains("give it in"), "{refused}");
        assert_eq!(GoalPose::from_pose_stamped(&message("map", [0.0; 4])), None);
        assert_eq!(GoalPose::from_pose_stamped(&message("map", [f64::NAN; 4])), None);
        assert_eq!(GoalPose::from_pose_stamped(&message("map", [0.0, 0.0, 0.0, 1.0])[..30]), None);
    }
}
