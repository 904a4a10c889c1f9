//! The topics of robots with odometry: what they would have recorded, and the truth.

use super::{
    MAP_FRAME, RosMessage, STATIC_TF_TOPIC, TF_TOPIC, base_frame, header, namespace, ros_pose,
    true_pose,
};
use crate::trajectory::ros_name;
use sidestep_import::bag::messages::{
    LaserScan, Odometry, PoseWithCovariance, TfMessage, TransformStamped, TwistWithCovariance,
};
use sidestep_kernel::math::wrap_angle;
use sidestep_kernel::view::{Body, BodyId, Frame, Pose, Scan};

/// The robots of a run, frame by frame.
#[derive(Debug, Default)]
pub(crate) struct RobotTopics {
    /// Odometry of the frame before, with its time.
    before: Option<(f64, Vec<(BodyId, Pose)>)>,
}

impl RobotTopics {
    /// Returns the messages of a frame: the frames that move, odometry, true poses and scans. The order of frames is that
    /// of time.
    pub(crate) fn messages(&mut self, frame: &Frame) -> Vec<RosMessage> {
        let mut messages = self.odometry_messages(frame);
        for (who, body) in robots(frame) {
            let topic = format!("/{}/ground_truth", namespace(who));
            let truth = true_pose(frame.time_s, &floor_pose(body));
            messages.push(RosMessage::new(topic, frame.time_s, &truth));
        }
        for scan in &frame.scans {
            let topic = format!("/{}", scan_frame(frame, scan));
            messages.push(RosMessage::new(topic, frame.time_s, &laser_scan(frame, scan)));
        }
        self.before = Some((frame.time_s, frame.odometry.clone()));
        messages
    }

    fn odometry_messages(&self, frame: &Frame) -> Vec<RosMessage> {
        let mut messages = Vec::new();
        let mut transforms = Vec::new();
        for (who, claimed) in &frame.odometry {
            let message = Odometry {
                header: header(frame.time_s, odometry_frame(*who)),
                child_frame_id: base_frame(*who),
                pose: PoseWithCovariance { pose: ros_pose(claimed), covariance: [0.0; 36] },
                twist: self.twist(frame, *who, claimed),
            };
            let topic = format!("/{}/odom", namespace(*who));
            messages.push(RosMessage::new(topic, frame.time_s, &message));
            transforms.push(TransformStamped {
                header: message.header,
                child_frame_id: message.child_frame_id,
                transform: message.pose.pose,
            });
        }
        messages.push(RosMessage::new(TF_TOPIC, frame.time_s, &TfMessage { transforms }));
        messages
    }

    /// Returns the mean velocity since the frame before, in the frame of the robot at that time.
    fn twist(&self, frame: &Frame, who: BodyId, claimed: &Pose) -> TwistWithCovariance {
        let mut twist = TwistWithCovariance {
            linear_mps: [0.0; 3],
            angular_radps: [0.0; 3],
            covariance: [0.0; 36],
        };
        let Some((time_s, odometry)) = &self.before else { return twist };
        let Some((_, before)) = odometry.iter().find(|(other, _)| *other == who) else {
            return twist;
        };
        let step_s = frame.time_s - time_s;
        if step_s > 0.0 {
            let moved: [f64; 3] = std::array::from_fn(|i| claimed.at_m[i] - before.at_m[i]);
            let [x, y, z, w] = before.turn;
            let inverse = Pose { at_m: [0.0; 3], turn: [-x, -y, -z, w] };
            twist.linear_mps = inverse.rotate(moved).map(|along| along / step_s);
            twist.angular_radps[2] = wrap_angle(yaw_rad(claimed) - yaw_rad(before)) / step_s;
        }
        twist
    }
}

/// Returns the robots that have odometry, by their order there.
pub(super) fn robots(frame: &Frame) -> impl Iterator<Item = (BodyId, &Body)> {
    frame.odometry.iter().filter_map(|(who, _)| {
        let body = frame.bodies.iter().find(|body| body.id() == *who)?;
        Some((*who, body))
    })
}

/// Returns the pose of a robot on the floor: a floor has no height, even if pictures show one.
pub(super) fn floor_pose(body: &Body) -> Pose {
    let [x_m, y_m, _] = body.pose.at_m;
    Pose { at_m: [x_m, y_m, 0.0], ..body.pose }
}

/// Places the scanners in the middle of their robots, from which ranges are reported.
pub(crate) fn mounts(frame: &Frame) -> Vec<TransformStamped> {
    let mut transforms = Vec::new();
    for scan in &frame.scans {
        transforms.push(TransformStamped {
            header: header(frame.time_s, base_frame(carrier(frame, scan))),
            child_frame_id: scan_frame(frame, scan),
            transform: ros_pose(&Pose::from_position([0.0; 3])),
        });
    }
    transforms
}

/// Places the origins of odometry where the robots are in this frame, for which their wheels must not have counted yet.
pub(super) fn starts(frame: &Frame) -> Vec<TransformStamped> {
    let mut transforms = Vec::new();
    for (who, body) in robots(frame) {
        transforms.push(TransformStamped {
            header: header(frame.time_s, MAP_FRAME.into()),
            child_frame_id: odometry_frame(who),
            transform: ros_pose(&floor_pose(body)),
        });
    }
    transforms
}

/// Returns frames that stay in their parents as a message.
pub(crate) fn static_frames(time_s: f64, transforms: Vec<TransformStamped>) -> RosMessage {
    RosMessage::new(STATIC_TF_TOPIC, time_s, &TfMessage { transforms }).latched()
}

/// Returns the robot that carries a scanner: in a chain of robots, scans are those of the connector that a robot keeps
/// to.
fn carrier(frame: &Frame, scan: &Scan) -> BodyId {
    let is_carrier = |who: &BodyId| who.number == scan.of.number && who.part == scan.of.part;
    let mut robots = frame.odometry.iter().map(|(who, _)| *who);
    robots.find(is_carrier).unwrap_or(scan.of)
}

fn odometry_frame(who: BodyId) -> String {
    format!("{}/odom", namespace(who))
}

fn scan_frame(frame: &Frame, scan: &Scan) -> String {
    format!("{}/{}", namespace(carrier(frame, scan)), ros_name(&scan.sensor))
}

fn yaw_rad(pose: &Pose) -> f64 {
    let ahead = pose.rotate([1.0, 0.0, 0.0]);
    sidestep_kernel::math::atan2(ahead[1], ahead[0])
}

/// Returns a scan; directions without a beam have no number.
fn laser_scan(frame: &Frame, scan: &Scan) -> LaserScan {
    let (first_rad, last_rad, ranges_m) = scan.resample_evenly(f64::NAN);
    let steps = ranges_m.len().max(2) - 1;
    LaserScan {
        header: header(frame.time_s, scan_frame(frame, scan)),
        angle_min_rad: first_rad as f32,
        angle_max_rad: last_rad as f32,
        angle_increment_rad: ((last_rad - first_rad) / steps as f64) as f32,
        time_increment_s: 0.0,
        scan_time_s: 0.0,
        range_min_m: 0.0,
        range_max_m: scan.range_m as f32,
        ranges_m: ranges_m.into_iter().map(|range_m| range_m as f32).collect(),
        intensities: Vec::new(),
    }
}
