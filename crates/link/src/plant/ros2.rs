//! A robot that is a node of ROS 2: it is measured and moved by topics.

use super::inbox::{Inbox, PlantFrames};
use super::{ArrivedBeacons, Plant, PlantState};
use crate::drive::bag::DriveBag;
use crate::drive::beacon::RobotBeacon;
use crate::ros2::node::RosNode;
use crate::ros2::rmw::QualityOfService;
use crate::wire::endpoint::WireSetupError;
use sidestep::import::bag::messages::{
    Bool, Header, LaserScan, Message, Odometry, Pose, PoseStamped, TfMessage, Time, Twist,
    TwistStamped,
};
use sidestep::kernel::math::{cos, sin};
use sidestep::kernel::ports::RecordError;
use sidestep::worlds::robots::drive::DriveVelocity;
use sidestep::worlds::robots::drive::grid::Pose2;
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
    /// What is kept for later, and the reason why it is not anymore.
    bag: Mutex<Option<DriveBag>>,
    /// Beacons of other robots.
    beacons: Mutex<ArrivedBeacons>,
}

/// Most beacons that wait for the program; it takes them many times in a second.
const MAX_BEACONS: usize = 4096;

/// Most bytes of a beacon: those of a scenario with 10,000 robots.
const MAX_BEACON_BYTES: usize = 100_000;

impl SharedInbox {
    fn beacons(&self) -> MutexGuard<'_, ArrivedBeacons> {
        self.beacons.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn receive_beacon(&self, bytes: &[u8]) {
        let mut beacons = self.beacons();
        if beacons.messages.len() >= MAX_BEACONS || bytes.len() > MAX_BEACON_BYTES {
            beacons.dropped += 1;
            return;
        }
        beacons.messages.push(bytes.to_vec());
    }

    fn lock(&self) -> MutexGuard<'_, Inbox> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn bag(&self) -> MutexGuard<'_, Option<DriveBag>> {
        self.bag.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a message of a topic; what is none is not recorded.
    fn receive<M: Message>(
        &self,
        topic: &str,
        bytes: &[u8],
        put: impl FnOnce(&mut Inbox, Instant) -> bool,
    ) {
        let is_kept = put(&mut self.lock(), Instant::now());
        self.arrived.notify_all();
        if let Some(bag) = self.bag().as_mut().filter(|_| is_kept) {
            bag.record::<M>(topic, bytes);
        }
    }
}

/// What a robot is beside its topics.
#[derive(Debug, Default)]
pub struct PlantOptions {
    /// Whether it goes where it is told.
    pub takes_goals: bool,
    /// Where its messages and commands are recorded.
    pub bag: Option<DriveBag>,
    /// The full names of the topics on which it hears other robots.
    pub peers: Vec<String>,
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
    /// The full name of the topic of its beacons.
    beacon: String,
    /// The name under which the poses in the map are recorded.
    pose: String,
    /// The time of the last pose in seconds.
    time_s: f64,
}

impl fmt::Debug for Ros2Plant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Ros2Plant").field("cmd_vel", &self.cmd_vel).finish_non_exhaustive()
    }
}

/// A topic to which a robot's program listens.
struct Listening<'a> {
    node: &'a mut RosNode,
    shared: &'a Arc<SharedInbox>,
}

impl Listening<'_> {
    fn listen<M: Message>(
        &mut self,
        topic: &str,
        quality: QualityOfService,
        put: fn(&mut Inbox, &[u8], Instant) -> bool,
    ) -> Result<(), WireSetupError> {
        let to = self.shared.clone();
        let topic = self.node.resolve(topic);
        let name = topic.clone();
        self.node.subscribe(&topic, M::NAME, quality, move |bytes| {
            to.receive::<M>(&name, bytes, |inbox, arrived| put(inbox, bytes, arrived));
        })
    }
}

impl Ros2Plant {
    /// Listens to the topics of a robot.
    ///
    /// # Errors
    /// When the session is closed.
    pub fn start(
        mut node: RosNode,
        topics: &DriveTopics,
        options: PlantOptions,
    ) -> Result<Self, WireSetupError> {
        let frames = PlantFrames { map: topics.map_frame.clone(), base: topics.base_frame.clone() };
        let shared = Arc::new(SharedInbox {
            inbox: Mutex::new(Inbox::new(frames)),
            arrived: Condvar::new(),
            bag: Mutex::new(options.bag),
            beacons: Mutex::default(),
        });
        let volatile = QualityOfService::DEFAULT;
        let latched = QualityOfService::LATCHED;
        let mut listening = Listening { node: &mut node, shared: &shared };
        listening.listen::<TfMessage>(STATIC_TF_TOPIC, latched, |inbox, bytes, arrived| {
            inbox.receive_frames(bytes, true, arrived)
        })?;
        listening.listen::<TfMessage>(TF_TOPIC, volatile, |inbox, bytes, arrived| {
            inbox.receive_frames(bytes, false, arrived)
        })?;
        listening.listen::<Odometry>(&topics.odom, volatile, Inbox::receive_odometry)?;
        listening.listen::<LaserScan>(&topics.scan, volatile, Inbox::receive_scan)?;
        listening.listen::<Bool>(&topics.bumper, volatile, |inbox, bytes, _| {
            inbox.receive_bumper(bytes)
        })?;
        if options.takes_goals {
            listening.listen::<PoseStamped>(&topics.goal, volatile, |inbox, bytes, _| {
                inbox.receive_goal(bytes)
            })?;
        }
        for topic in &options.peers {
            let to = shared.clone();
            node.subscribe(topic, RobotBeacon::NAME, volatile, move |bytes| {
                to.receive_beacon(bytes);
            })?;
        }
        let beacon = node.resolve(&topics.beacon);
        let cmd_vel = node.resolve(&topics.cmd_vel);
        let pose = format!("{}/pose", node.full_name());
        Ok(Self {
            node,
            shared,
            seen: 0,
            topics: topics.clone(),
            cmd_vel,
            beacon,
            pose,
            time_s: 0.0,
        })
    }

    /// Leaves the network, and completes the bag.
    ///
    /// # Errors
    /// When the bag cannot be written, or could not at some time before.
    pub fn end(self) -> Result<(), RecordError> {
        self.node.leave();
        let bag = self.shared.bag().take();
        bag.map_or(Ok(()), DriveBag::finish)
    }

    /// Records the pose that the program goes by.
    fn record_pose(&self, time_s: f64, pose: &Pose2) {
        let Some(bag) = &mut *self.shared.bag() else { return };
        let frame_id = self.topics.map_frame.clone();
        let header = Header { stamp: Time::from_secs(time_s), frame_id };
        let half_rad = pose.yaw_rad / 2.0;
        let turn = [0.0, 0.0, sin(half_rad), cos(half_rad)];
        let pose = Pose { position: [pose.at_m[0], pose.at_m[1], 0.0], orientation: turn };
        bag.record_message(&RosMessage::new(
            self.pose.clone(),
            time_s,
            &PoseStamped { header, pose },
        ));
    }

    /// Returns the node.
    pub fn node(&self) -> &RosNode {
        &self.node
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
            if pose.time_s != self.time_s {
                self.record_pose(pose.time_s, &pose.value);
            }
            self.time_s = pose.time_s;
        }
        state
    }

    fn command(&mut self, velocity: DriveVelocity) -> Result<(), String> {
        let message = self.message(velocity);
        if let Some(bag) = &mut *self.shared.bag() {
            bag.record_message(&message);
        }
        let sent = self.node.publish_as(&self.cmd_vel, &message);
        sent.map_err(|error| error.to_string())
    }

    fn take_beacons(&mut self) -> ArrivedBeacons {
        std::mem::take(&mut *self.shared.beacons())
    }

    fn tell(&mut self, beacon: &RobotBeacon) -> Result<(), String> {
        let message = RosMessage::new(self.beacon.clone(), self.time_s, beacon);
        let sent = self.node.publish_as(&self.beacon, &message);
        sent.map_err(|error| error.to_string())
    }
}
