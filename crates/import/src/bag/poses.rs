//! Poses in messages: odometry, motion capture, localization, transforms.

use std::sync::Arc;

use sidestep_kernel::math::atan2;
use sidestep_kernel::view::Pose as Pose3;

use super::cdr::{CdrError, Encoding, decode_as};
use super::messages::{
    Header, Message, Odometry, Pose, PoseStamped, PoseWithCovarianceStamped, TfMessage,
    TransformStamped,
};
use crate::track::StampedPose2;

/// The types of messages that hold poses.
pub(super) const SCHEMAS: [&str; 5] = [
    Odometry::NAME,
    PoseStamped::NAME,
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
    TfMessage::NAME,
];
/// Minimum norm of a quaternion: programs without an orientation write zeros, and a norm near 0 has lost its digits.
const MIN_NORM: f64 = 1e-3;
/// A norm further from 1 is none that rounding leaves.
const NORM_TOLERANCE: f64 = 0.01;

/// A pose at a time, of one frame in another.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StampedPose {
    /// The number of its message on its topic, from 1.
    pub(super) message: u64,
    /// When it was recorded.
    pub(super) log_secs: f64,
    pub(super) t_secs: f64,
    pub(super) parent: Arc<str>,
    /// Empty where the message does not give it.
    pub(super) child: Arc<str>,
    pub(super) pose: Pose3,
    /// Whether its orientation had another norm than 1.
    pub(super) was_scaled: bool,
}

impl StampedPose {
    fn new(header: Header, child: String, pose: Pose) -> Self {
        let t_secs = header.stamp.secs();
        let pose = Pose3 { at_m: pose.position, turn: pose.orientation };
        let [parent, child] = [&header.frame_id, &child].map(|name| frame_name(name));
        Self { message: 0, log_secs: 0.0, t_secs, parent, child, pose, was_scaled: false }
    }

    fn from_transform(transform: TransformStamped) -> Self {
        Self::new(transform.header, transform.child_frame_id, transform.transform)
    }

    /// Returns the pose with an orientation of norm 1; or the reason why it is invalid.
    fn checked(mut self) -> Result<Self, &'static str> {
        let numbers = self.pose.at_m.iter().chain(&self.pose.turn);
        if !numbers.copied().all(f64::is_finite) {
            return Err("its pose has a number that is not finite");
        }
        let norm = self.pose.turn.iter().map(|q| q * q).sum::<f64>().sqrt();
        if norm < MIN_NORM {
            return Err("its orientation is 0, 0, 0, 0, which is none");
        }
        self.pose.turn = self.pose.turn.map(|q| q / norm);
        self.was_scaled = (norm - 1.0).abs() > NORM_TOLERANCE;
        Ok(self)
    }

    /// Returns position and heading in the plane.
    pub(super) fn to_planar(&self) -> StampedPose2 {
        let [x_m, y_m, _] = self.pose.at_m;
        let forward = self.pose.rotate([1.0, 0.0, 0.0]);
        let heading_rad = atan2(forward[1], forward[0]);
        StampedPose2 { t_secs: self.t_secs, position_m: [x_m, y_m], heading_rad }
    }
}

/// Returns the name of a frame: in ROS 1 it may begin with a slash, which means nothing.
pub(super) fn frame_name(name: &str) -> Arc<str> {
    name.strip_prefix('/').unwrap_or(name).into()
}

/// Returns the poses in a message, which is of one of [`SCHEMAS`], each valid or with the reason why it is not.
///
/// # Errors
/// When the message cannot be decoded.
pub(super) fn decode_poses(
    schema: &str,
    encoding: Encoding,
    bytes: &[u8],
) -> Result<Vec<Result<StampedPose, &'static str>>, String> {
    let poses = decode_message(schema, encoding, bytes).map_err(|e| e.to_string())?;
    Ok(poses.into_iter().map(StampedPose::checked).collect())
}

fn decode_message(
    schema: &str,
    encoding: Encoding,
    bytes: &[u8],
) -> Result<Vec<StampedPose>, CdrError> {
    Ok(match SCHEMAS.iter().position(|known| *known == schema) {
        Some(0) => {
            let message: Odometry = decode_as(encoding, bytes)?;
            vec![StampedPose::new(message.header, message.child_frame_id, message.pose.pose)]
        }
        Some(1) => {
            let message: PoseStamped = decode_as(encoding, bytes)?;
            vec![StampedPose::new(message.header, String::new(), message.pose)]
        }
        Some(2) => {
            let message: PoseWithCovarianceStamped = decode_as(encoding, bytes)?;
            vec![StampedPose::new(message.header, String::new(), message.pose.pose)]
        }
        Some(3) => vec![StampedPose::from_transform(decode_as(encoding, bytes)?)],
        _ => {
            let message: TfMessage = decode_as(encoding, bytes)?;
            message.transforms.into_iter().map(StampedPose::from_transform).collect()
        }
    })
}

/// Returns the pose in the outer frame of a body with the pose `inner` in a frame with the pose `outer`: the product of
/// the quaternions, and the rotated position.
pub(super) fn compose(outer: &Pose3, inner: &Pose3) -> Pose3 {
    let [ax, ay, az, aw] = outer.turn;
    let [bx, by, bz, bw] = inner.turn;
    Pose3 {
        at_m: outer.transform_point(inner.at_m),
        turn: [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn poses_one_in_the_other_are_placed_and_turned_by_both() {
        let outer = Pose3::from_heading([1.0, 2.0, 0.0], FRAC_PI_2);
        let whole = compose(&outer, &Pose3::from_heading([3.0, 0.0, 0.5], FRAC_PI_2));
        assert!((whole.at_m[0] - 1.0).abs() < 1e-12 && (whole.at_m[1] - 5.0).abs() < 1e-12);
        let back = whole.rotate([1.0, 0.0, 0.0]);
        assert!((back[0] + 1.0).abs() < 1e-12, "{back:?}");
    }
}
