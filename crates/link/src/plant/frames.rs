//! Frames in other frames, as `/tf` and `/tf_static` tell them, in the plane of the floor.

use sidestep::import::bag::messages::{Pose, TransformStamped};
use sidestep::kernel::math::atan2;
use sidestep::worlds::robots::drive::grid::Pose2;
use std::collections::BTreeMap;

/// Largest number of frames that are kept: whoever reaches the network can make more.
const MAX_FRAMES: usize = 4096;

/// Largest number of frames from one to another; more are a circle.
const MAX_HOPS: usize = 64;

/// Largest difference from 1 of the square of a quaternion's length.
const MAX_LENGTH_ERROR: f64 = 0.1;

/// A frame in its parent.
#[derive(Debug, Clone)]
struct FrameLink {
    parent: String,
    pose: Pose2,
    /// In seconds; none for one that stays.
    time_s: Option<f64>,
}

/// All frames by their names.
#[derive(Debug, Clone, Default)]
pub struct FrameTree {
    links: BTreeMap<String, FrameLink>,
}

/// A frame in another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameLookup {
    /// Its pose.
    pub pose: Pose2,
    /// The time of the newest of the frames between them, in seconds; none where all of them stay.
    pub time_s: Option<f64>,
}

/// Returns a pose of ROS in the plane of the floor; none where it is no pose. Height, roll and pitch are left out.
pub fn floor_pose(pose: &Pose) -> Option<Pose2> {
    let [x, y, z, w] = pose.orientation;
    let length2 = x * x + y * y + z * z + w * w;
    let yaw_rad = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
    let floor = Pose2 { at_m: [pose.position[0], pose.position[1]], yaw_rad };
    let is_turn = (length2 - 1.0).abs() <= MAX_LENGTH_ERROR;
    (is_turn && floor.is_finite()).then_some(floor)
}

/// Returns the name of a frame without the slash that old programs put before it.
pub fn frame_name(name: &str) -> &str {
    name.trim_start_matches('/')
}

/// What became of a transform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameUpdate {
    /// It is kept.
    Kept,
    /// It is older than the one that is kept.
    Outdated,
    /// It is none, or there are too many.
    Refused,
}

impl FrameTree {
    /// Keeps the pose of a frame in its parent; a frame that stays has no time.
    pub fn update(&mut self, transform: &TransformStamped, is_static: bool) -> FrameUpdate {
        let child = frame_name(&transform.child_frame_id);
        let parent = frame_name(&transform.header.frame_id);
        let Some(pose) = floor_pose(&transform.transform) else { return FrameUpdate::Refused };
        let is_known = self.links.contains_key(child);
        if child == parent || (!is_known && self.links.len() >= MAX_FRAMES) {
            return FrameUpdate::Refused;
        }
        let time_s = (!is_static).then(|| transform.header.stamp.secs());
        let before_s = self.links.get(child).and_then(|link| link.time_s);
        if before_s.zip(time_s).is_some_and(|(before_s, time_s)| time_s <= before_s) {
            return FrameUpdate::Outdated;
        }
        let link = FrameLink { parent: parent.into(), pose, time_s };
        self.links.insert(child.into(), link);
        FrameUpdate::Kept
    }

    /// Returns a frame in one of those in which it stands, directly or by others.
    pub fn lookup(&self, outer: &str, inner: &str) -> Option<FrameLookup> {
        let outer = frame_name(outer);
        let mut name = frame_name(inner);
        let mut found = FrameLookup { pose: Pose2::default(), time_s: None };
        for _ in 0..MAX_HOPS {
            if name == outer {
                return Some(found);
            }
            let link = self.links.get(name)?;
            found.pose = link.pose.compose(&found.pose);
            found.time_s = match (found.time_s, link.time_s) {
                (Some(a), Some(b)) => Some(a.max(b)),
                (a, b) => a.or(b),
            };
            name = &link.parent;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::import::bag::messages::{Header, Time};
    use std::f64::consts::FRAC_PI_2;

    fn transform(parent: &str, child: &str, x_m: f64, time_s: f64) -> TransformStamped {
        let half = 0.5_f64.sqrt();
        TransformStamped {
            header: Header { stamp: Time::from_secs(time_s), frame_id: parent.into() },
            child_frame_id: child.into(),
            transform: Pose { position: [x_m, 0.0, 7.0], orientation: [0.0, 0.0, half, half] },
        }
    }

    #[test]
    fn frames_are_joined_and_have_the_newest_time() {
        let mut frames = FrameTree::default();
        let links = [("map", "odom", 1.0, 3.0), ("/odom", "/base", 2.0, 5.0)];
        for (parent, child, x_m, time_s) in links {
            let update = frames.update(&transform(parent, child, x_m, time_s), false);
            assert_eq!(update, FrameUpdate::Kept);
        }
        frames.update(&transform("base", "laser", 0.5, 0.0), true);
        let base = frames.lookup("map", "base").expect("joined");
        assert!((base.pose.at_m[0] - 1.0).abs() < 1e-12 && (base.pose.at_m[1] - 2.0).abs() < 1e-12);
        assert!((base.pose.yaw_rad.abs() - 2.0 * FRAC_PI_2).abs() < 1e-12);
        assert_eq!(base.time_s, Some(5.0));
        let laser = frames.lookup("base", "laser").expect("joined");
        assert_eq!((laser.pose.at_m[0], laser.time_s), (0.5, None));
        assert_eq!(frames.lookup("laser", "map"), None, "only outward");
    }

    #[test]
    fn what_is_no_frame_or_older_or_a_circle_is_not_believed() {
        let mut frames = FrameTree::default();
        assert_eq!(frames.update(&transform("a", "a", 0.0, 0.0), false), FrameUpdate::Refused);
        let mut no_turn = transform("a", "b", 0.0, 0.0);
        no_turn.transform.orientation = [0.0; 4];
        assert_eq!(frames.update(&no_turn, false), FrameUpdate::Refused);
        let mut no_number = transform("a", "b", f64::NAN, 0.0);
        assert_eq!(frames.update(&no_number, false), FrameUpdate::Refused);
        no_number.transform.position[0] = 1.0;
        assert_eq!(frames.update(&no_number, false), FrameUpdate::Kept);
        assert_eq!(frames.update(&no_number, false), FrameUpdate::Outdated);
        frames.update(&transform("b", "a", 0.0, 0.0), false);
        assert_eq!(frames.lookup("map", "a"), None);
    }
}
