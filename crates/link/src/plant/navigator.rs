//! A navigator of ROS 2, such as Nav2: goals by a topic, and the service by which its action gives them up.
//!
//! Nav2's `bt_navigator` takes poses of the topic `goal_pose` as goals of its action `navigate_to_pose`. What becomes of them is
//! seen by the robot's poses. To let the robot stand, all goals of the action are canceled, until it answers.

use crate::ros2::node::RosNode;
use crate::ros2::types::CANCEL_GOAL;
use crate::wire::endpoint::WireSetupError;
use sidestep::import::bag::cdr::encode;
use sidestep::import::bag::messages::{Header, Pose, PoseStamped, Time};
use sidestep::import::cdr_message;
use sidestep::kernel::math::{cos, sin};
use sidestep::worlds::robots::drive::navigator::{NavigatorGoal, NavigatorOrder};
use sidestep_session::fleet::NavigatorSettings;
use sidestep_session::ros::RosMessage;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time after which a request to cancel is sent again that was not answered.
const CANCEL_INTERVAL: Duration = Duration::from_millis(500);

/// Time after which the log tells that the navigator does not answer.
const CANCEL_TIMEOUT: Duration = Duration::from_secs(2);

cdr_message!(
    /// The request of `action_msgs/srv/CancelGoal`. With zeros it means all goals.
    #[derive(Default)]
    CancelGoalRequest {
        /// The goal.
        goal_id: [u8; 16],
        /// Seconds of the time until which goals are meant that were accepted.
        stamp_s: u32,
        /// And nanoseconds.
        stamp_ns: u32,
    }
);

/// What the navigator was told last.
#[derive(Debug)]
enum Told {
    /// Nothing: it may have goals of others.
    Nothing,
    /// To bring the robot there.
    Goal(NavigatorGoal),
    /// To give up its goals.
    Cancel(Cancellation),
}

#[derive(Debug)]
struct Cancellation {
    /// Whether the navigator has answered.
    is_confirmed: Arc<AtomicBool>,
    began_at: Instant,
    asked_at: Instant,
    is_warned: bool,
}

/// The navigator of a robot.
#[derive(Debug)]
pub(super) struct Navigator {
    /// The full name of the topic of goals.
    goal: String,
    /// The full name of the service that cancels them.
    cancel_goal: String,
    /// The frame of goals.
    frame: String,
    told: Told,
}

impl Navigator {
    pub(super) fn new(node: &RosNode, settings: &NavigatorSettings, frame: &str) -> Self {
        let cancel_goal = format!("{}/_action/cancel_goal", settings.action);
        Self {
            goal: node.resolve(&settings.goal),
            cancel_goal: node.resolve(&cancel_goal),
            frame: frame.into(),
            told: Told::Nothing,
        }
    }

    /// Passes an order on, unless the navigator has it. Returns the message of a goal that was sent.
    ///
    /// # Errors
    /// When the session is closed.
    pub(super) fn order(
        &mut self,
        node: &mut RosNode,
        order: NavigatorOrder,
        time_s: f64,
    ) -> Result<Option<RosMessage>, WireSetupError> {
        match (order, &self.told) {
            (NavigatorOrder::Goal(goal), Told::Goal(before)) if goal == *before => Ok(None),
            (NavigatorOrder::Goal(goal), _) => {
                let message = self.message(&goal, time_s);
                node.publish_as(&self.goal, &message)?;
                self.told = Told::Goal(goal);
                Ok(Some(message))
            }
            (NavigatorOrder::Stop, Told::Nothing | Told::Goal(_)) => {
                let now = Instant::now();
                self.told = Told::Cancel(Cancellation {
                    is_confirmed: Arc::default(),
                    began_at: now,
                    asked_at: now,
                    is_warned: false,
                });
                self.cancel(node)?;
                Ok(None)
            }
            (NavigatorOrder::Stop | NavigatorOrder::Keep, _) => {
                self.cancel_again(node)?;
                Ok(None)
            }
        }
    }

    /// Returns whether the robot may still go to a goal that was to be canceled.
    pub(super) fn is_canceling(&self) -> bool {
        matches!(&self.told, Told::Cancel(cancel) if !cancel.is_confirmed.load(Ordering::Acquire))
    }

    /// Asks again if the navigator has not answered for some time.
    fn cancel_again(&mut self, node: &mut RosNode) -> Result<(), WireSetupError> {
        if !self.is_canceling() {
            return Ok(());
        }
        let Told::Cancel(cancel) = &mut self.told else { return Ok(()) };
        if !cancel.is_warned && cancel.began_at.elapsed() >= CANCEL_TIMEOUT {
            cancel.is_warned = true;
            let service = &self.cancel_goal;
            tracing::warn!(
                service,
                "the navigator does not answer: the robot may go on to its goal"
            );
        }
        if cancel.asked_at.elapsed() < CANCEL_INTERVAL {
            return Ok(());
        }
        cancel.asked_at = Instant::now();
        self.cancel(node)
    }

    fn cancel(&self, node: &mut RosNode) -> Result<(), WireSetupError> {
        let Told::Cancel(cancel) = &self.told else { return Ok(()) };
        let is_confirmed = cancel.is_confirmed.clone();
        let request = encode(&CancelGoalRequest::default());
        // Whatever it answers, it has no goal any more: without any it refuses.
        node.request(&self.cancel_goal, CANCEL_GOAL, request, move |_| {
            is_confirmed.store(true, Ordering::Release);
        })
    }

    fn message(&self, goal: &NavigatorGoal, time_s: f64) -> RosMessage {
        let [x_m, y_m] = goal.pose.at_m;
        let half_rad = goal.pose.yaw_rad / 2.0;
        let pose = PoseStamped {
            header: Header { stamp: Time::from_secs(time_s), frame_id: self.frame.clone() },
            pose: Pose {
                position: [x_m, y_m, 0.0],
                orientation: [0.0, 0.0, sin(half_rad), cos(half_rad)],
            },
        };
        RosMessage::new(self.goal.clone(), time_s, &pose)
    }
}
