//! Bags of ROS 2 and ROS 1: the poses and scans of a robot as it records them.
//!
//! A bag is a file in MCAP, in SQLite (`.db3`) or of ROS 1 (`.bag`, version 2.0), or a folder of `ros2 bag record` or its
//! `metadata.yaml`. Chunks may be compressed with zstd, lz4 or bz2, files and messages with zstd, files with gzip.
//! Supported are `nav_msgs/msg/Odometry`, `geometry_msgs/msg/PoseStamped`, `PoseWithCovarianceStamped` and
//! `TransformStamped`, `tf2_msgs/msg/TFMessage` and `sensor_msgs/msg/LaserScan`, encoded as CDR or by ROS 1.
//!
//! A message that cannot be read is skipped and counted; a topic of which more than half is bad is an error. A bag is
//! read message by message, so that beside one record (at most 256 MB) only poses, some 110 bytes each, and at most
//! four million ranges of scans are in memory, whatever its size.
//!
//! Times are the stamps of the headers, not those of the recording, which are late by the latency of the network.
//! Messages that have overtaken each other by up to half a second are sorted. Where several stamps go further back the
//! clock was set: the time after is a part of its own. Stamps of topics are compared by the times of the recording, and
//! odometry and truth by their motion, so that clocks, units and frames that differ are found. Tracks are cut where the
//! robot cannot have moved from one pose to the next, see [`SpeedRule`]. Scans follow REP 117, whatever their driver writes, see [`NoEcho`].

pub mod cdr;
pub mod messages;

mod clean;
mod clock;
mod content;
mod frames;
mod inspect;
mod offsets;
mod poses;
mod scans;
mod storage;
mod streams;
#[cfg(test)]
mod tests;
mod topic_clock;
mod topic_motion;
mod topics;

use std::collections::BTreeMap;
use std::path::Path;

use sidestep_kernel::InputError;
use sidestep_kernel::view::Pose;

pub use self::clean::write_clean;
use self::content::BagContent;
pub use self::inspect::inspect;
use self::messages::LaserScan;
pub use self::scans::NoEcho;
pub use self::topics::{PoseTopic, TopicSelection};
use crate::report::ImportReport;
use crate::track::{
    SpeedRule, Track, absurd_speed_mps, cut_and_report, record_absurd_speed, report_frozen,
};
use crate::track_pair;

/// The content that was read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BagLog {
    /// The poses by odometry; empty where none are selected.
    pub odometry: Track,
    /// The true poses.
    pub truth: Track,
    /// The scans, by time, as REP 117 has them.
    pub scans: Vec<LaserScan>,
    /// The pose on the robot of each frame of scans that the bag places.
    pub mounts: BTreeMap<String, Pose>,
    /// What was found in the bag.
    pub report: ImportReport,
}

/// Reads a bag.
///
/// # Errors
/// When the bag is missing, damaged altogether or of another kind; a topic is missing or of another type, or more than
/// half of its messages are bad; or odometry and truth have no time in common.
pub fn read(path: &Path, selection: &TopicSelection) -> Result<BagLog, InputError> {
    let bag = path.display().to_string();
    let mut content = BagContent::new(&bag, selection);
    let storage = storage::read(path, &|topic| selection.is_read(topic), &mut |message| {
        content.add(&message)
    })?;
    selection.check(&bag, &storage.topics, storage.report.findings.first())?;
    content.check(&storage.topics)?;
    let mut report = storage.report;
    topics::add_facts(&storage.topics, &mut report);
    content.report(&mut report);
    content.align_clocks(&mut report)?;
    let truth = content.trajectory(&selection.truth)?;
    let odometry = match &selection.odometry {
        Some(topic) => Some(content.trajectory(topic)?),
        None => None,
    };
    if let (Some(topic), Some(odometry)) = (&selection.odometry, &odometry) {
        let truth_topic = &*selection.truth.topic;
        clock::check_overlap(
            &bag,
            [(&*topic.topic, &*odometry.poses), (truth_topic, &*truth.poses)],
        )?;
    }
    let bodies = [Some(&truth), odometry.as_ref()].into_iter().flatten();
    let body_frames: Vec<&str> =
        bodies.map(|body| &*body.child).filter(|frame| !frame.is_empty()).collect();
    let scans = content.take_scans(&mut report);
    let mounts = content.mounts(&scans, &body_frames);
    let odometry = odometry.map_or_else(Vec::new, |odometry| odometry.poses);
    let odometry_topic = selection.odometry.as_ref().map_or("odometry", |source| &*source.topic);
    let truth_topic = &*selection.truth.topic;
    track_pair::check_units(&bag, [(odometry_topic, &odometry), (truth_topic, &truth.poses)])?;
    record_absurd_speed(truth_topic, absurd_speed_mps(&truth.poses), &mut report);
    record_absurd_speed(odometry_topic, absurd_speed_mps(&odometry), &mut report);
    let rule = SpeedRule::for_tracks(selection.max_speed_mps, &[&truth.poses, &odometry]);
    let truth = cut_and_report(truth_topic, truth.poses, &rule, &mut report);
    let odometry = cut_and_report(odometry_topic, odometry, &rule, &mut report);
    report_frozen(truth_topic, &truth, &odometry, &mut report);
    track_pair::report_pair([(odometry_topic, &odometry), (truth_topic, &truth)], &mut report);
    report.add_kept("true poses", truth.len());
    report.add_kept("poses of odometry", odometry.len());
    report.add_kept("scans", scans.len());
    Ok(BagLog { odometry, truth, scans, mounts, report })
}
