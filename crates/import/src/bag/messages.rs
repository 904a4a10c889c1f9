//! The messages of ROS 2 that are read and written, field by field as ROS defines them.

use super::cdr::{Cdr, CdrError, Reader, Writer, message};

/// A message that is recorded under a name.
pub trait Message: Cdr {
    /// The type of the message in ROS 2.
    const NAME: &'static str;
    /// Its definition in the format `ros2msg`, with those of the messages in it.
    const DEFINITION: &'static str;
}

macro_rules! named {
    ($($type:ident $name:literal $file:literal)*) => {$(
        impl Message for $type {
            const NAME: &'static str = $name;
            const DEFINITION: &'static str = include_str!($file);
        }
    )*};
}

named! {
    Odometry "nav_msgs/msg/Odometry" "definitions/Odometry.msg"
    PoseStamped "geometry_msgs/msg/PoseStamped" "definitions/PoseStamped.msg"
    LaserScan "sensor_msgs/msg/LaserScan" "definitions/LaserScan.msg"
    TfMessage "tf2_msgs/msg/TFMessage" "definitions/TFMessage.msg"
    JointState "sensor_msgs/msg/JointState" "definitions/JointState.msg"
    JointTrajectory "trajectory_msgs/msg/JointTrajectory" "definitions/JointTrajectory.msg"
    Clock "rosgraph_msgs/msg/Clock" "definitions/Clock.msg"
    Bool "std_msgs/msg/Bool" "definitions/Bool.msg"
    OccupancyGrid "nav_msgs/msg/OccupancyGrid" "definitions/OccupancyGrid.msg"
    Twist "geometry_msgs/msg/Twist" "definitions/Twist.msg"
    TwistStamped "geometry_msgs/msg/TwistStamped" "definitions/TwistStamped.msg"
    MarkerArray "visualization_msgs/msg/MarkerArray" "definitions/MarkerArray.msg"
}

message!(
    /// A moment, since 1970 or since the start of a simulation.
    Time {
        /// Whole seconds.
        sec: i32,
        /// The rest in nanoseconds.
        nanosec: u32,
    }
);

/// The time and the frame of reference of a message.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// The time of the measurement.
    pub stamp: Time,
    /// The frame of reference.
    pub frame_id: String,
}

impl Cdr for Header {
    const MIN_BYTES: usize = Time::MIN_BYTES + String::MIN_BYTES;

    fn read(reader: &mut Reader<'_>) -> Result<Self, CdrError> {
        // Headers of ROS 1 begin with a counter of messages, which means nothing here.
        if reader.is_ros1() {
            u32::read(reader)?;
        }
        Ok(Self { stamp: Cdr::read(reader)?, frame_id: Cdr::read(reader)? })
    }

    fn write(&self, writer: &mut Writer) {
        if writer.is_ros1() {
            0_u32.write(writer);
        }
        self.stamp.write(writer);
        self.frame_id.write(writer);
    }
}

message!(
    /// Position and orientation.
    Pose {
        /// The position in meters.
        position: [f64; 3],
        /// The orientation, a unit quaternion x, y, z, w.
        orientation: [f64; 4],
    }
);

message!(
    /// A pose with its uncertainty.
    PoseWithCovariance {
        /// The mean, without its uncertainty.
        pose: Pose,
        /// Covariance of x, y, z and the turns about them, row by row.
        covariance: [f64; 36],
    }
);

message!(
    /// `geometry_msgs/msg/Twist`: a velocity that a robot is to have.
    Twist {
        /// The velocity along x, y, z in m/s.
        linear_mps: [f64; 3],
        /// The rates of turning about x, y, z in rad/s.
        angular_radps: [f64; 3],
    }
);

message!(
    /// `geometry_msgs/msg/TwistStamped`: a velocity at a time.
    TwistStamped {
        /// The time, and the frame of the velocity.
        header: Header,
        /// The velocity.
        twist: Twist,
    }
);

message!(
    /// A velocity with its uncertainty.
    TwistWithCovariance {
        /// The velocity along x, y, z in m/s.
        linear_mps: [f64; 3],
        /// The rates of turning about x, y, z in rad/s.
        angular_radps: [f64; 3],
        /// Covariance of the six, row by row.
        covariance: [f64; 36],
    }
);

message!(
    /// `nav_msgs/msg/Odometry`: the pose of a robot by its odometry.
    Odometry {
        /// The time, and the frame of the pose.
        header: Header,
        /// The frame of the velocity, fixed to the robot.
        child_frame_id: String,
        /// The estimated pose.
        pose: PoseWithCovariance,
        /// The estimated velocity.
        twist: TwistWithCovariance,
    }
);

message!(
    /// `geometry_msgs/msg/PoseStamped`: a pose at a time.
    PoseStamped {
        /// The time, and the frame of the pose.
        header: Header,
        /// The pose of the thing that the topic is about.
        pose: Pose,
    }
);

message!(
    /// `geometry_msgs/msg/PoseWithCovarianceStamped`, as of a localization program.
    PoseWithCovarianceStamped {
        /// The time, and the frame of the pose.
        header: Header,
        /// The estimate, in the frame of the header.
        pose: PoseWithCovariance,
    }
);

message!(
    /// `geometry_msgs/msg/TransformStamped`, as of motion capture.
    TransformStamped {
        /// The time, and the frame of the transform.
        header: Header,
        /// The frame whose pose this is; its parent is that of the header.
        child_frame_id: String,
        /// The pose of the child in its parent.
        transform: Pose,
    }
);

message!(
    /// `tf2_msgs/msg/TFMessage`: frames in other frames.
    TfMessage {
        /// Poses of frames that were measured or changed together.
        transforms: Vec<TransformStamped>,
    }
);

message!(
    /// `sensor_msgs/msg/LaserScan`: ranges at equal steps of bearing, counterclockwise.
    LaserScan {
        /// The time of the first beam, and the frame of the scanner.
        header: Header,
        /// The bearing of the first beam.
        angle_min_rad: f32,
        /// The bearing of the last beam.
        angle_max_rad: f32,
        /// The step between beams.
        angle_increment_rad: f32,
        /// The time between beams in s; 0 where all are measured at once.
        time_increment_s: f32,
        /// The time between scans in s; 0 where it is not known.
        scan_time_s: f32,
        /// The minimum range of the scanner.
        range_min_m: f32,
        /// The maximum range of the scanner.
        range_max_m: f32,
        /// The ranges; infinite where there is nothing.
        ranges_m: Vec<f32>,
        /// The strengths of the echoes, or nothing.
        intensities: Vec<f32>,
    }
);

message!(
    /// `sensor_msgs/msg/JointState`: where the joints of a robot are.
    JointState {
        /// The time; joints have no frame.
        header: Header,
        /// The names of the joints.
        name: Vec<String>,
        /// Their values in rad or m.
        position: Vec<f64>,
        /// Their speeds in rad/s or m/s.
        velocity: Vec<f64>,
        /// Their torques or forces, or nothing.
        effort: Vec<f64>,
    }
);

message!(
    /// `trajectory_msgs/msg/JointTrajectoryPoint`: where joints are to be at a time.
    JointTrajectoryPoint {
        /// Values in rad or m.
        positions: Vec<f64>,
        /// Speeds in rad/s or m/s.
        velocities: Vec<f64>,
        /// Accelerations in rad/s2 or m/s2.
        accelerations: Vec<f64>,
        /// Torques or forces, or nothing.
        effort: Vec<f64>,
        /// The time since the start of the trajectory.
        time_from_start: Time,
    }
);

message!(
    /// `trajectory_msgs/msg/JointTrajectory`: what a controller of an arm carries out.
    JointTrajectory {
        /// The time at which it starts.
        header: Header,
        /// The names of the joints.
        joint_names: Vec<String>,
        /// The points, by rising time.
        points: Vec<JointTrajectoryPoint>,
    }
);

message!(
    /// `rosgraph_msgs/msg/Clock`: the time of a simulation.
    Clock {
        /// The time since its start.
        clock: Time,
    }
);

message!(
    /// `std_msgs/msg/Bool`: a truth value.
    Bool {
        /// The value.
        data: bool,
    }
);

message!(
    /// `nav_msgs/msg/MapMetaData`: the size and the place of a map.
    MapMetaData {
        /// The time at which the map was loaded.
        map_load_time: Time,
        /// The side of a cell.
        resolution_m: f32,
        /// Cells along the first axis.
        width: u32,
        /// Cells along the second axis.
        height: u32,
        /// The pose of the corner of the first cell.
        origin: Pose,
    }
);

message!(
    /// `nav_msgs/msg/OccupancyGrid`: a map of cells.
    OccupancyGrid {
        /// The time, and the frame of the map.
        header: Header,
        /// Its size and place.
        info: MapMetaData,
        /// The probability in percent that a cell is occupied, -1 where it is unknown; row by row from the first.
        data: Vec<i8>,
    }
);

message!(
    /// `std_msgs/msg/ColorRGBA`: a color with its opacity, each from 0 to 1.
    ColorRgba {
        /// Red.
        red: f32,
        /// Green.
        green: f32,
        /// Blue.
        blue: f32,
        /// Opacity.
        opacity: f32,
    }
);

message!(
    /// `sensor_msgs/msg/CompressedImage`: an image in the bytes of a file.
    CompressedImage {
        /// The time and the frame of the camera.
        header: Header,
        /// The format of the file.
        format: String,
        /// The bytes of the file.
        data: Vec<u8>,
    }
);

message!(
    /// `visualization_msgs/msg/MeshFile`: a file with a mesh.
    MeshFile {
        /// Its name, by which its format is known.
        filename: String,
        /// Its bytes.
        data: Vec<u8>,
    }
);

message!(
    /// `visualization_msgs/msg/Marker`: a shape that a viewer shows.
    Marker {
        /// The time, and the frame of the pose.
        header: Header,
        /// The namespace in which the number is unique.
        namespace: String,
        /// The number of the marker.
        id: i32,
        /// The kind of shape, e.g. 1 for a cuboid.
        shape: i32,
        /// 0 to show the marker, 2 to remove it.
        action: i32,
        /// The pose of the shape's center.
        pose: Pose,
        /// The extent of the shape along its axes in m; the first of a line is its width.
        scale: [f64; 3],
        /// The color.
        color: ColorRgba,
        /// The time for which the marker is shown; 0 for always.
        lifetime: Time,
        /// Whether the marker follows its frame between two messages.
        is_frame_locked: bool,
        /// The points of a line in m, relative to the pose.
        points: Vec<[f64; 3]>,
        /// The color of each point, or nothing.
        colors: Vec<ColorRgba>,
        /// The place of a texture, or nothing.
        texture_resource: String,
        /// The texture itself.
        texture: CompressedImage,
        /// The coordinates of the points on the texture.
        uv_coordinates: Vec<[f32; 2]>,
        /// The text of a marker that is one.
        text: String,
        /// The place of a mesh, or nothing.
        mesh_resource: String,
        /// The mesh itself.
        mesh_file: MeshFile,
        /// Whether the mesh has its own materials.
        mesh_use_embedded_materials: bool,
    }
);

message!(
    /// `visualization_msgs/msg/MarkerArray`: shapes that a viewer shows.
    MarkerArray {
        /// The shapes.
        markers: Vec<Marker>,
    }
);

message!(
    /// `std_srvs/srv/Trigger_Response`: how an order without parameters went.
    TriggerResponse {
        /// Whether it was carried out.
        success: bool,
        /// The outcome in words.
        message: String,
    }
);

impl Time {
    /// Returns the time of a moment given in nanoseconds.
    pub fn from_ns(ns: u64) -> Self {
        let sec = i32::try_from(ns / 1_000_000_000).unwrap_or(i32::MAX);
        Self { sec, nanosec: (ns % 1_000_000_000) as u32 }
    }

    /// Returns the time of a moment given in seconds, to the nanosecond.
    pub fn from_secs(secs: f64) -> Self {
        let whole = secs.floor();
        let nanosec = ((secs - whole) * 1e9).round().min(999_999_999.0) as u32;
        Self { sec: whole as i32, nanosec }
    }

    /// Returns the moment in seconds.
    pub fn secs(&self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) / 1e9
    }
}
