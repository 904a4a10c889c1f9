//! The last messages of a robot. Whoever reaches the network can send such messages: what cannot be read, is out of order
//! or is no measurement is dropped and counted.

use super::frames::{FrameTree, FrameUpdate, floor_pose, frame_name};
use super::{Measured, PlantState};
use crate::ros2::goals::GoalPose;
use sidestep::import::bag::cdr::{Cdr, decode};
use sidestep::import::bag::messages::{Bool, Header, LaserScan, Odometry, TfMessage};
use sidestep::worlds::robots::drive::grid::Pose2;
use sidestep::worlds::robots::drive::scan::RangeScan;
use std::sync::Arc;
use std::time::Instant;

/// Largest number of ranges of a scan.
const MAX_RANGES: usize = 100_000;

/// The frames of a robot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlantFrames {
    /// The frame of the map.
    pub map: String,
    /// The frame of the robot, if its pose is that frame's; else the pose is that of odometry.
    pub base: Option<String>,
}

/// A message that is kept, with the frame that its header names.
#[derive(Debug, Clone)]
struct Framed<T> {
    frame: String,
    measured: Measured<T>,
}

/// What has arrived of a robot.
#[derive(Debug)]
pub struct Inbox {
    frames: PlantFrames,
    tree: FrameTree,
    odometry: Option<Framed<Pose2>>,
    /// The frame of the robot by its odometry.
    odometry_base: Option<String>,
    /// When the last frame that moves has arrived.
    frames_arrived: Option<Instant>,
    scan: Option<Framed<Arc<RangeScan>>>,
    /// The last goal since the last state, in the frame of the map, or why it is none.
    goal: Option<Result<Pose2, String>>,
    is_pressed: bool,
    /// Whether the bumper was pressed since the last state.
    was_pressed: bool,
    /// Number of messages that may have changed the pose.
    poses: u64,
    unreadable: u64,
    outdated: u64,
}

impl Inbox {
    /// Returns an inbox in which nothing is yet.
    pub fn new(frames: PlantFrames) -> Self {
        Self {
            frames,
            tree: FrameTree::default(),
            odometry: None,
            odometry_base: None,
            frames_arrived: None,
            scan: None,
            goal: None,
            is_pressed: false,
            was_pressed: false,
            poses: 0,
            unreadable: 0,
            outdated: 0,
        }
    }

    /// Returns the number of messages that may have changed the pose.
    pub fn poses(&self) -> u64 {
        self.poses
    }

    /// Takes a message of odometry, and returns whether it keeps it.
    pub fn receive_odometry(&mut self, bytes: &[u8], arrived: Instant) -> bool {
        let Some(message) = self.read::<Odometry>(bytes) else { return false };
        let Some(value) = floor_pose(&message.pose.pose) else {
            self.unreadable += 1;
            return false;
        };
        let before_s = self.odometry.as_ref().map(|odometry| odometry.measured.time_s);
        let Some(time_s) = self.later_time(&message.header, before_s) else { return false };
        let frame = frame_name(&message.header.frame_id).to_string();
        self.odometry_base = Some(frame_name(&message.child_frame_id).into());
        self.odometry = Some(Framed { frame, measured: Measured { value, time_s, arrived } });
        self.poses += u64::from(self.frames.base.is_none());
        true
    }

    /// Takes a message with frames, those that stay or those that move, and returns whether it keeps any.
    pub fn receive_frames(&mut self, bytes: &[u8], is_static: bool, arrived: Instant) -> bool {
        let Some(message) = self.read::<TfMessage>(bytes) else { return false };
        let mut is_kept = false;
        for transform in &message.transforms {
            let update = self.tree.update(transform, is_static);
            is_kept |= update == FrameUpdate::Kept;
            match update {
                FrameUpdate::Kept if is_static => {}
                FrameUpdate::Kept if self.is_on_way(&transform.child_frame_id) => {
                    self.frames_arrived = Some(arrived);
                    self.poses += u64::from(self.frames.base.is_some());
                }
                FrameUpdate::Kept => {}
                FrameUpdate::Outdated => self.outdated += 1,
                FrameUpdate::Refused => self.unreadable += 1,
            }
        }
        is_kept
    }

    /// Returns whether the pose of the robot depends on a frame: those of other robots come by the same topic.
    fn is_on_way(&self, frame: &str) -> bool {
        let base = self.frames.base.as_deref();
        base.is_some_and(|base| self.tree.lookup(frame, base).is_some())
    }

    /// Takes a scan, and returns whether it keeps it.
    pub fn receive_scan(&mut self, bytes: &[u8], arrived: Instant) -> bool {
        let Some(message) = self.read::<LaserScan>(bytes) else { return false };
        let scan = RangeScan {
            mount: Pose2::default(),
            first_rad: f64::from(message.angle_min_rad),
            step_rad: f64::from(message.angle_increment_rad),
            min_m: f64::from(message.range_min_m),
            max_m: f64::from(message.range_max_m),
            ranges_m: message.ranges_m,
        };
        if !scan.is_valid() || scan.ranges_m.is_empty() || scan.ranges_m.len() > MAX_RANGES {
            self.unreadable += 1;
            return false;
        }
        let before_s = self.scan.as_ref().map(|scan| scan.measured.time_s);
        let Some(time_s) = self.later_time(&message.header, before_s) else { return false };
        let frame = frame_name(&message.header.frame_id).to_string();
        self.scan =
            Some(Framed { frame, measured: Measured { value: Arc::new(scan), time_s, arrived } });
        true
    }

    /// Takes a message of the bumper, and returns whether it keeps it.
    pub fn receive_bumper(&mut self, bytes: &[u8]) -> bool {
        let Some(message) = self.read::<Bool>(bytes) else { return false };
        self.is_pressed = message.data;
        self.was_pressed |= message.data;
        true
    }

    /// Takes a goal in place of the last one, and returns whether it keeps it.
    pub fn receive_goal(&mut self, bytes: &[u8]) -> bool {
        let Some(goal) = GoalPose::from_pose_stamped(bytes) else {
            self.unreadable += 1;
            return false;
        };
        self.goal = Some(goal.in_map(&self.frames.map));
        true
    }

    fn read<T: Cdr>(&mut self, bytes: &[u8]) -> Option<T> {
        let message = decode(bytes).ok();
        self.unreadable += u64::from(message.is_none());
        message
    }

    /// Returns the time of a message, if it is after the one before.
    fn later_time(&mut self, header: &Header, before_s: Option<f64>) -> Option<f64> {
        let time_s = header.stamp.secs();
        if before_s.is_some_and(|before_s| time_s <= before_s) {
            self.outdated += 1;
            return None;
        }
        Some(time_s)
    }

    /// Returns what is known, and forgets the goal and that the bumper was pressed before.
    pub fn take_state(&mut self) -> PlantState {
        let pose = self.pose();
        let scan = self.scan_on_robot();
        let missing = match (&pose, &scan) {
            (Err(missing), _) | (Ok(_), Err(missing)) => Some(missing.clone()),
            (Ok(_), Ok(_)) => None,
        };
        let is_touching = self.is_pressed || std::mem::take(&mut self.was_pressed);
        PlantState {
            pose: pose.ok(),
            scan: scan.ok(),
            is_touching,
            goal: self.goal.take(),
            missing,
            unreadable: self.unreadable,
            outdated: self.outdated,
        }
    }

    fn pose(&self) -> Result<Measured<Pose2>, String> {
        let map = &self.frames.map;
        if let Some(base) = &self.frames.base {
            let no_frame = || format!("no frame {base} in {map} by /tf");
            let found = self.tree.lookup(map, base).ok_or_else(no_frame)?;
            let arrived = self.frames_arrived.ok_or_else(no_frame)?;
            let time_s = found.time_s.ok_or_else(no_frame)?;
            return Ok(Measured { value: found.pose, time_s, arrived });
        }
        let odometry = self.odometry.as_ref().ok_or("no odometry")?;
        let no_frame =
            || format!("odometry is in the frame {}, and /tf has it not in {map}", odometry.frame);
        let origin = self.tree.lookup(map, &odometry.frame).ok_or_else(no_frame)?;
        let value = origin.pose.compose(&odometry.measured.value);
        Ok(Measured { value, ..odometry.measured })
    }

    fn scan_on_robot(&self) -> Result<Measured<Arc<RangeScan>>, String> {
        let scan = self.scan.as_ref().ok_or("no scan")?;
        let base =
            self.frames.base.as_ref().or(self.odometry_base.as_ref()).ok_or("no odometry")?;
        let no_frame =
            || format!("the scanner is in the frame {}, and /tf has it not in {base}", scan.frame);
        let mount = self.tree.lookup(base, &scan.frame).ok_or_else(no_frame)?.pose;
        if mount == scan.measured.value.mount {
            return Ok(scan.measured.clone());
        }
        let value = Arc::new(RangeScan { mount, ..(*scan.measured.value).clone() });
        Ok(Measured { value, ..scan.measured })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::import::bag::cdr::encode;
    use sidestep::import::bag::messages::{
        Pose, PoseStamped, PoseWithCovariance, Time, TransformStamped, TwistWithCovariance,
    };

    const HALF_TURN: [f64; 4] = [0.0, 0.0, 1.0, 0.0];

    fn header(frame: &str, time_s: f64) -> Header {
        Header { stamp: Time::from_secs(time_s), frame_id: frame.into() }
    }

    fn odometry(x_m: f64, time_s: f64) -> Vec<u8> {
        let pose = Pose { position: [x_m, 0.0, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] };
        let twist = TwistWithCovariance {
            linear_mps: [0.0; 3],
            angular_radps: [0.0; 3],
            covariance: [0.0; 36],
        };
        encode(&Odometry {
            header: header("odom", time_s),
            child_frame_id: "base".into(),
            pose: PoseWithCovariance { pose, covariance: [0.0; 36] },
            twist,
        })
    }

    fn frame(parent: &str, child: &str, time_s: f64) -> Vec<u8> {
        let transform = Pose { position: [1.0, 2.0, 0.0], orientation: HALF_TURN };
        let header = header(parent, time_s);
        let transform = TransformStamped { header, child_frame_id: child.into(), transform };
        encode(&TfMessage { transforms: vec![transform] })
    }

    fn scan(time_s: f64, step_rad: f32) -> Vec<u8> {
        encode(&LaserScan {
            header: header("laser", time_s),
            angle_min_rad: 0.0,
            angle_max_rad: 1.0,
            angle_increment_rad: step_rad,
            time_increment_s: 0.0,
            scan_time_s: 0.0,
            range_min_m: 0.1,
            range_max_m: 5.0,
            ranges_m: vec![1.0, f32::INFINITY],
            intensities: Vec::new(),
        })
    }

    fn inbox(base: Option<&str>) -> Inbox {
        Inbox::new(PlantFrames { map: "map".into(), base: base.map(String::from) })
    }

    #[test]
    fn odometry_is_brought_into_the_frame_of_the_map_and_the_scanner_onto_the_robot() {
        let mut inbox = inbox(None);
        let now = Instant::now();
        assert_eq!(inbox.take_state().missing.as_deref(), Some("no odometry"));
        inbox.receive_odometry(&odometry(0.5, 1.0), now);
        let missing = inbox.take_state().missing.expect("a frame");
        assert!(missing.contains("frame odom"), "{missing}");
        inbox.receive_frames(&frame("map", "odom", 0.0), true, now);
        assert_eq!(inbox.take_state().missing.as_deref(), Some("no scan"));
        inbox.receive_scan(&scan(1.0, 0.1), now);
        let missing = inbox.take_state().missing.expect("a frame");
        assert!(missing.contains("frame laser"), "{missing}");
        inbox.receive_frames(&frame("base", "laser", 0.0), true, now);
        let state = inbox.take_state();
        let at_m = state.pose.expect("a pose").value.at_m;
        assert!((at_m[0] - 0.5).abs() < 1e-12 && (at_m[1] - 2.0).abs() < 1e-12, "{at_m:?}");
        assert_eq!(state.scan.expect("a scan").value.mount.at_m, [1.0, 2.0]);
        assert_eq!((state.missing, state.unreadable, state.outdated), (None, 0, 0));
    }

    #[test]
    fn a_pose_may_be_a_frame_that_moves_and_others_frames_do_not_refresh_it() {
        let mut inbox = inbox(Some("base"));
        let start = Instant::now();
        inbox.receive_frames(&frame("map", "base", 1.0), false, start);
        let later = start + std::time::Duration::from_secs(9);
        inbox.receive_frames(&frame("map", "other", 2.0), false, later);
        let pose = inbox.take_state().pose.expect("a pose");
        assert_eq!((pose.value.at_m, pose.time_s, pose.arrived), ([1.0, 2.0], 1.0, start));
        assert_eq!(inbox.poses(), 1);
    }

    #[test]
    fn what_is_no_measurement_or_old_is_dropped_and_counted() {
        let mut inbox = inbox(None);
        let now = Instant::now();
        inbox.receive_odometry(&[1, 2, 3], now);
        inbox.receive_odometry(&odometry(f64::NAN, 1.0), now);
        inbox.receive_scan(&scan(1.0, 0.0), now);
        inbox.receive_bumper(&[0, 1]);
        assert_eq!(inbox.take_state().unreadable, 4);
        inbox.receive_odometry(&odometry(0.5, 2.0), now);
        inbox.receive_odometry(&odometry(0.7, 2.0), now);
        inbox.receive_odometry(&odometry(0.7, 1.0), now);
        assert_eq!(inbox.take_state().outdated, 2);
    }

    #[test]
    fn the_last_goal_is_told_once_and_one_of_another_frame_with_the_reason() {
        let goal = |frame: &str, x_m: f64| {
            let pose = Pose { position: [x_m, 0.0, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] };
            encode(&PoseStamped { header: header(frame, 1.0), pose })
        };
        let mut inbox = inbox(None);
        assert_eq!(inbox.take_state().goal, None);
        inbox.receive_goal(&goal("map", 1.0));
        inbox.receive_goal(&goal("map", 2.0));
        assert!(!inbox.receive_goal(&[1, 2, 3]), "it is no message");
        let state = inbox.take_state();
        assert_eq!(state.goal.expect("a goal").expect("of the map").at_m, [2.0, 0.0]);
        assert_eq!(state.unreadable, 1);
        assert_eq!(inbox.take_state().goal, None);
        inbox.receive_goal(&goal("odom", 1.0));
        assert!(inbox.take_state().goal.expect("a goal").is_err_and(|why| why.contains("odom")));
    }

    #[test]
    fn a_bumper_that_was_pressed_between_two_looks_is_seen() {
        let mut inbox = inbox(None);
        inbox.receive_bumper(&encode(&Bool { data: true }));
        inbox.receive_bumper(&encode(&Bool { data: false }));
        assert!(inbox.take_state().is_touching);
        assert!(!inbox.take_state().is_touching);
    }
}
