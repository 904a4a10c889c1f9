//! Frames of a run as messages of ROS 2: for bags, and for nodes that listen while the run advances.
//!
//! ```text
//! robots.rs  what the robots of a run would have recorded: odometry, scans, and the truth
//! scene.rs   the other topics of a run that is watched: clock, joints, poses, shapes
//! map.rs     the floor as a map
//! ```

mod map;
mod robots;
mod scene;

pub(crate) use map::map_files_with_border;
pub(crate) use robots::{RobotTopics, mounts, static_frames};
pub use scene::RunTopics;

use crate::trajectory::ros_name;
use sidestep_import::bag::cdr::encode;
use sidestep_import::bag::messages::{
    Header, Message, Pose as RosPose, PoseStamped, Time, TransformStamped,
};
use sidestep_kernel::view::{BodyId, BodyRole, Pose};

/// The fixed frame that the map, the starts and the true poses share.
pub const MAP_FRAME: &str = "map";

/// The topic of the time of a simulation.
pub const CLOCK_TOPIC: &str = "/clock";

/// The topic of the frames that move.
pub const TF_TOPIC: &str = "/tf";

/// The topic of the frames that stay in their parents.
pub const STATIC_TF_TOPIC: &str = "/tf_static";

/// A message of a topic, ready to be stored or sent.
#[derive(Debug, Clone, PartialEq)]
pub struct RosMessage {
    /// The topic, with a slash at its beginning.
    pub topic: String,
    /// The type of the message, e.g. `nav_msgs/msg/Odometry`.
    pub type_name: &'static str,
    /// The definition of that type in the format `ros2msg`.
    pub definition: &'static str,
    /// The time of the message, nanoseconds since the start of the run.
    pub time_ns: u64,
    /// Whether those who join late get it, too (durability `transient_local`).
    pub is_latched: bool,
    /// The message in CDR.
    pub bytes: Vec<u8>,
}

impl RosMessage {
    /// Returns a message of a topic at a time in seconds.
    pub fn new<T: Message>(topic: impl Into<String>, time_s: f64, message: &T) -> Self {
        Self {
            topic: topic.into(),
            type_name: T::NAME,
            definition: T::DEFINITION,
            time_ns: to_ns(time_s),
            is_latched: false,
            bytes: encode(message),
        }
    }

    fn latched(self) -> Self {
        Self { is_latched: true, ..self }
    }
}

fn to_ns(time_s: f64) -> u64 {
    (time_s.max(0.0) * 1e9).round() as u64
}

fn header(time_s: f64, frame_id: String) -> Header {
    Header { stamp: Time::from_ns(to_ns(time_s)), frame_id }
}

/// Returns e.g. `robot_3`, or `robot_0_3` for a part of a body: names in ROS begin with a letter and have no spaces.
fn namespace(who: BodyId) -> String {
    let part = who.part.map_or(String::new(), |part| format!("_{part}"));
    format!("{}_{}{part}", ros_name(who.kind.name()), who.number)
}

/// Returns the name of the frame that is fixed to a body; the parts of a body share their body's namespace.
fn base_frame(who: BodyId) -> String {
    match (who.kind.spec().role, who.part) {
        (BodyRole::PartOfBody, Some(part)) => {
            format!("{}/{}_{part}", whole_body_namespace(who), ros_name(who.kind.name()))
        }
        _ => format!("{}/base_link", namespace(who)),
    }
}

/// Returns the namespace of the body that a part belongs to, e.g. `chain_0` of its connectors.
fn whole_body_namespace(part: BodyId) -> String {
    format!("{}_{}", ros_name(part.kind.spec().noun), part.number)
}

fn ros_pose(pose: &Pose) -> RosPose {
    RosPose { position: pose.at_m, orientation: pose.turn }
}

fn true_pose(time_s: f64, pose: &Pose) -> PoseStamped {
    PoseStamped { header: header(time_s, MAP_FRAME.into()), pose: ros_pose(pose) }
}

fn transform_from_map(time_s: f64, child_frame_id: String, pose: &Pose) -> TransformStamped {
    let header = header(time_s, MAP_FRAME.into());
    TransformStamped { header, child_frame_id, transform: ros_pose(pose) }
}
