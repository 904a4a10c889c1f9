//! A real vehicle as its program sees it: measurements of its own in, commands out.
//!
//! ```text
//! aircraft.rs  an aircraft
//! frames.rs    frames in other frames, as /tf tells them
//! model.rs     a model of an aircraft
//! inbox.rs     the last messages of a robot, and what is wrong with others
//! ros2.rs      a robot that is a node of ROS 2
//! ```

pub mod aircraft;
pub mod frames;
pub mod inbox;
pub mod model;
pub mod ros2;

use crate::drive::beacon::RobotBeacon;
use sidestep::worlds::robots::drive::DriveVelocity;
use sidestep::worlds::robots::drive::grid::Pose2;
use sidestep::worlds::robots::drive::scan::RangeScan;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A value that a robot has measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured<T> {
    /// The value.
    pub value: T,
    /// The time of the measurement in seconds, by the robot's own clock.
    pub time_s: f64,
    /// When it arrived, by the clock of this machine: its age counts from there, because the two clocks may differ.
    pub arrived: Instant,
}

/// What is known of a robot.
#[derive(Debug, Clone, Default)]
pub struct PlantState {
    /// Its pose in the frame of the map.
    pub pose: Option<Measured<Pose2>>,
    /// Its last scan.
    pub scan: Option<Measured<Arc<RangeScan>>>,
    /// Whether its bumper is pressed, or was since the state before.
    pub is_touching: bool,
    /// A goal that has come since the state before, in the frame of the map, or the reason why it is none.
    pub goal: Option<Result<Pose2, String>>,
    /// What it lacks for a pose or a scan, in words.
    pub missing: Option<String>,
    /// Number of messages that could not be read.
    pub unreadable: u64,
    /// Number of messages that were not newer than the one before.
    pub outdated: u64,
}

impl PlantState {
    /// Returns the age in seconds of the older one of pose and scan; infinite without one of them.
    pub fn age_s(&self, now: Instant) -> f64 {
        let age_s = |arrived: Instant| now.saturating_duration_since(arrived).as_secs_f64();
        let pose_s = self.pose.as_ref().map_or(f64::INFINITY, |pose| age_s(pose.arrived));
        let scan_s = self.scan.as_ref().map_or(f64::INFINITY, |scan| age_s(scan.arrived));
        pose_s.max(scan_s)
    }
}

/// A robot that is measured and moved.
pub trait Plant {
    /// Waits for a new pose, at most for the given time, and returns what is known.
    fn wait(&mut self, within: Duration) -> PlantState;

    /// Commands a velocity.
    ///
    /// # Errors
    /// When the robot cannot be reached anymore, with the reason.
    fn command(&mut self, velocity: DriveVelocity) -> Result<(), String>;

    /// Returns the beacons of other robots that have come since the last call, as bytes. A robot that has none hears nobody.
    fn take_beacons(&mut self) -> ArrivedBeacons {
        ArrivedBeacons::default()
    }

    /// Tells the other robots of this one. A robot that has none tells nobody.
    ///
    /// # Errors
    /// When the network cannot be reached anymore, with the reason.
    fn tell(&mut self, _beacon: &RobotBeacon) -> Result<(), String> {
        Ok(())
    }
}

/// Beacons that have come.
#[derive(Debug, Default)]
pub struct ArrivedBeacons {
    /// Their bytes, in the order in which they came.
    pub messages: Vec<Vec<u8>>,
    /// Number of those that were dropped because too many came at once.
    pub dropped: u64,
}
