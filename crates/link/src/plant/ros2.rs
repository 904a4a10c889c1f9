//! A robot that is a node of ROS 2: it is measured and moved by topics.

use super::inbox::{Inbox, PlantFrames};
use super::{Plant, PlantState};
use crate::ros2::node::RosNode;
use crate::ros2::rmw::QualityOfService;
use crate::wire::endpoint::WireSetupError;
use sidestep::import::bag::messages::{Bool, Header, LaserScan, Message, Odometry, Time};
use sidestep::import::bag::messages::{TfMessage, Twist, TwistStamped};
use sidestep::worlds::robots::drive::DriveVelocity;
use sidestep_session::fleet::DriveTopics;
use sidestep_session::ros::{RosMessage, STATIC_TF_TOPIC, TF_TOPIC};
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The frame of commands with a time, unless the pose has another one.
const BASE_FRAME: &str = "base_link";

/// What the threads of the network put in, and the program takes out.
#[derive(Debug)]
struct SharedInbox {
    inbox: Mutex<Inbox>,
    arrived: Condvar,
}

impl SharedInbox {
    fn lock(&self) -> MutexGuard<'_, Inbox> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn receive(&self, put: impl FnOnce(&mut Inbox, Instant)) {
        put(&mut self.lock(), Instant::now());
        self.arrived.notify_all();
    }
}

/// A robot by its topics.
pub struct Ros2Plant {
    node: RosNode,
    shared: Arc<SharedInbox>,
    /// Number of poses that the program has seen.
    seen: u64,
    topics: DriveTopics,
    /// The full name of the topic of commands.
    cmd_vel: String,
    /// The time of the last pose in seconds.
    time_s: f64,
}

impl fmt::Debug for Ros2Plant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Ros2Plant").field("cmd_vel", &self.cmd_vel).finish_non_exhaustive()
    }
}

impl Ros2Plant {
    /// Listens to the topics of a robot.
    ///
    /// # Errors
    /// When the session is closed.
    pub fn start(mut node: RosNode, topics: &DriveTopics) -> Result<Self, WireSetupError> {
        let frames = PlantFrames { map: topics.map_frame.clone(), base: topics.base_frame.clone() };
        let shared = SharedInbox { inbox: Mutex::new(Inbox::new(frames)), arrived: Condvar::new() };
        let shared = Arc::new(shared);
        let volatile = QualityOfService::DEFAULT;
        let latched = QualityOfService::LATCHED;
        let to = shared.clone();
        node.subscribe(STATIC_TF_TOPIC, TfMessage::NAME, latched, move |bytes| {
            to.receive(|inbox, arrived| inbox.receive_frames(bytes, true, arrived));
        })?;
        let to = shared.clone();
        node.subscribe(TF_TOPIC, TfMessage::NAME, volatile, move |bytes| {
            to.receive(|inbox, arrived| inbox.receive_frames(bytes, false, arrived));
        })?;
        let to = shared.clone();
        node.subscribe(&node.resolve(&topics.odom), Odometry::NAME, volatile, move |bytes| {
            to.receive(|inbox, arrived| inbox.receive_odometry(bytes, arrived));
        })?;
        let to = shared.clone();
        node.subscribe(&node.resolve(&topics.scan), LaserScan::NAME, volatile, move |bytes| {
            to.receive(|inbox, arrived| inbox.receive_scan(bytes, arrived));
        })?;
        let to = shared.clone();
        node.subscribe(&node.resolve(&topics.bumper), Bool::NAME, volatile, move |bytes| {
            to.receive(|inbox, _| inbox.receive_bumper(bytes));
        })?;
        let cmd_vel = node.resolve(&topics.cmd_vel);
        Ok(Self { node, shared, seen: 0, topics: topics.clone(), cmd_vel, time_s: 0.0 })
    }

    /// Returns the node.
    pub fn node(&self) -> &RosNode {
        &self.node
    }

    /// Leaves the network.
    pub fn leave(self) {
        self.node.leave();
    }

    fn message(&self, velocity: DriveVelocity) -> RosMessage {
        let twist = Twist {
            linear_mps: [velocity.forward_mps, 0.0, 0.0],
            angular_radps: [0.0, 0.0, velocity.turn_radps],
        };
        if !self.topics.is_stamped {
            return RosMessage::new(self.cmd_vel.clone(), self.time_s, &twist);
        }
        let frame_id = self.topics.base_frame.clone().unwrap_or_else(|| BASE_FRAME.into());
        let header = Header { stamp: Time::from_secs(self.time_s), frame_id };
        RosMessage::new(self.cmd_vel.clone(), self.time_s, &TwistStamped { header, twist })
    }
}

impl Plant for Ros2Plant {
    fn wait(&mut self, within: Duration) -> PlantState {
        let seen = self.seen;
        let inbox = self.shared.lock();
        let waited =
            self.shared.arrived.wait_timeout_while(inbox, within, |inbox| inbox.poses() == seen);
        let mut inbox = waited.unwrap_or_else(PoisonError::into_inner).0;
        self.seen = inbox.poses();
        let state = inbox.take_state();
        drop(inbox);
        if let Some(pose) = &state.pose {
            self.time_s = pose.time_s;
        }
        state
    }

    fn command(&mut self, velocity: DriveVelocity) -> Result<(), String> {
        let message = self.message(velocity);
        let sent = self.node.publish_as(&self.cmd_vel, &message);
        sent.map_err(|error| error.to_string())
    }
}
