//! The types that a run sends and receives, with the hashes of their definitions.
//!
//! The hashes of messages are those that the Python package `rosbags` 0.11.9 computes of their definitions in Jazzy
//! (`get_typestore(Stores.ROS2_JAZZY).hash_rihs01(NAME)`, the algorithm of REP 2011); definitions of these types are the same in
//! Kilted. That of the service is what `zenoh-ros2-sdk` 0.1.8 computes (`compute_service_type_hash`). A test compares
//! all of them with what these packages compute.

use super::rmw::RosType;
use crate::drive::beacon::BEACON_TYPE;

/// The types of the messages of runs and of robots that are driven, by name.
pub const MESSAGE_TYPES: [RosType; 12] = [
    RosType {
        name: "geometry_msgs/msg/PoseStamped",
        hash: "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    },
    RosType {
        name: "geometry_msgs/msg/Twist",
        hash: "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    },
    RosType {
        name: "geometry_msgs/msg/TwistStamped",
        hash: "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    },
    RosType {
        name: "nav_msgs/msg/OccupancyGrid",
        hash: "RIHS01_8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7",
    },
    RosType {
        name: "nav_msgs/msg/Odometry",
        hash: "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    },
    RosType {
        name: "rosgraph_msgs/msg/Clock",
        hash: "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    },
    RosType {
        name: "sensor_msgs/msg/JointState",
        hash: "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
    },
    RosType {
        name: "sensor_msgs/msg/LaserScan",
        hash: "RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828",
    },
    RosType {
        name: "std_msgs/msg/Bool",
        hash: "RIHS01_feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9",
    },
    RosType {
        name: "tf2_msgs/msg/TFMessage",
        hash: "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    },
    RosType {
        name: "trajectory_msgs/msg/JointTrajectory",
        hash: "RIHS01_179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e",
    },
    RosType {
        name: "visualization_msgs/msg/MarkerArray",
        hash: "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
    },
];

/// An order without parameters, and how it went: the type of all services of a run.
pub const TRIGGER: RosType = RosType {
    name: "std_srvs/srv/Trigger",
    hash: "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f",
};

/// The type of a velocity that a robot is to have.
pub const TWIST_NAME: &str = "geometry_msgs/msg/Twist";

/// Returns the type of messages with a name.
pub fn message_type(name: &str) -> Option<RosType> {
    let mut types = MESSAGE_TYPES.into_iter().chain([BEACON_TYPE]);
    types.find(|known| known.name == name)
}
