//! ROS 2 bags in MCAP: the poses and scans of a robot as it records them.
//!
//! A bag is one `.mcap` file or the folder of `ros2 bag record`; chunks may be compressed with zstd or lz4. Supported
//! are `nav_msgs/msg/Odometry`, `geometry_msgs/msg/PoseStamped`, `PoseWithCovarianceStamped` and `TransformStamped`,
//! `tf2_msgs/msg/TFMessage` and `sensor_msgs/msg/LaserScan`, encoded as CDR.
//!
//! Times are the stamps of the headers, not those of the recording, which are late by the latency of the network.
//! Messages that have overtaken each other by up to half a second are sorted; stamps further back, or an hour
//! ahead, are from a clock that jumps, and an error.

pub mod cdr;
pub mod messages;

mod clock;
mod frames;
mod poses;
mod storage;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::Path;

use sidestep_kernel::InputError;
use sidestep_kernel::view::Pose;

use self::frames::Trajectory;
use self::messages::{LaserScan, Message, TfMessage};
use self::poses::StampedPose;
use self::storage::{RawMessage, Topic};
use crate::mrclam::StampedPose2;

/// Maximum number of topics that an error lists.
const MAX_LISTED: usize = 20;
/// Maximum number of beams of a scan: as many as a message of a megabyte holds.
const MAX_BEAMS: usize = 1 << 18;

/// A topic with poses, and a pair of frames for a topic that has several.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PoseTopic {
    /// The name of the topic.
    pub topic: String,
    /// The parent frame and the child frame.
    pub frames: Option<(String, String)>,
}

impl PoseTopic {
    /// Parses `TOPIC` or `TOPIC:PARENT:CHILD`; names of topics have no colons.
    ///
    /// # Errors
    /// When it is neither.
    pub fn parse(text: &str) -> Result<Self, InputError> {
        match text.split(':').collect::<Vec<_>>()[..] {
            [topic] if !topic.is_empty() => Ok(Self { topic: topic.into(), frames: None }),
            [topic, parent, child] if ![topic, parent, child].contains(&"") => {
                Ok(Self { topic: topic.into(), frames: Some((parent.into(), child.into())) })
            }
            _ => {
                let remedy =
                    "give a topic such as /odom, or a topic and two frames: /tf:map:base_link";
                Err(InputError::new(text, "this is not a topic", remedy))
            }
        }
    }
}

/// The topics of a bag to read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicSelection {
    /// The robot's pose by odometry.
    pub odometry: Option<PoseTopic>,
    /// Its true pose.
    pub truth: PoseTopic,
    /// The measurements of its scanner.
    pub scans: Option<String>,
}

/// The content that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct BagLog {
    /// The poses by odometry, by time; empty where none are selected.
    pub odometry: Vec<StampedPose2>,
    /// The true poses, by time.
    pub truth: Vec<StampedPose2>,
    /// The scans, by time.
    pub scans: Vec<LaserScan>,
    /// The pose of the scanner on the robot; `None` where the bag does not have it.
    pub mount: Option<Pose>,
}

/// Reads a bag.
///
/// # Errors
/// When the bag is missing, damaged or of another kind; a topic is missing or of another type; a message is
/// damaged; a clock jumps, or odometry and truth have no time in common.
pub fn read(path: &Path, selection: &TopicSelection) -> Result<BagLog, InputError> {
    let bag = path.display().to_string();
    let mut content = BagContent::default();
    // Static transforms too: they give the pose of the scanner on the robot.
    let is_read = |topic: &str| selection.contains(topic) || topic.ends_with(STATIC_TF_SUFFIX);
    let topics =
        storage::read(path, is_read, |message| content.add_message(&bag, selection, &message))?;
    selection.check(&bag, &topics)?;
    let truth = content.trajectory(&bag, &selection.truth)?;
    let odometry = match &selection.odometry {
        Some(topic) => Some(content.trajectory(&bag, topic)?),
        None => None,
    };
    if let (Some(topic), Some(odometry)) = (&selection.odometry, &odometry) {
        let truth_topic = &*selection.truth.topic;
        clock::check_overlap(
            &bag,
            [(&*topic.topic, &*odometry.poses), (truth_topic, &*truth.poses)],
        )?;
    }
    let scans = content.take_scans(&bag, selection)?;
    let bodies = [Some(&truth), odometry.as_ref()].into_iter().flatten();
    let body_frames: Vec<&str> =
        bodies.map(|body| &*body.child).filter(|frame| !frame.is_empty()).collect();
    let mount = scans.first().and_then(|scan| content.mount(&scan.header.frame_id, &body_frames));
    Ok(BagLog {
        odometry: odometry.map_or_else(Vec::new, |odometry| odometry.poses),
        truth: truth.poses,
        scans,
        mount,
    })
}

/// The suffix of topics with static transforms.
const STATIC_TF_SUFFIX: &str = "tf_static";

impl TopicSelection {
    fn pose_topics(&self) -> impl Iterator<Item = &PoseTopic> {
        self.odometry.iter().chain([&self.truth])
    }

    fn contains(&self, topic: &str) -> bool {
        self.scans.as_deref() == Some(topic)
            || self.pose_topics().any(|source| source.topic == topic)
    }

    /// Checks that every selected topic exists and has messages.
    fn check(&self, bag: &str, topics: &BTreeMap<String, Topic>) -> Result<(), InputError> {
        for name in self.pose_topics().map(|source| &source.topic).chain(&self.scans) {
            let problem = match topics.get(name) {
                Some(topic) if topic.messages > 0 => continue,
                Some(_) => "has no messages",
                None => "is not there",
            };
            let cause = format!("the topic {name} {problem}");
            return Err(InputError::new(bag, cause, describe_topics(topics)));
        }
        Ok(())
    }
}

fn describe_topics(topics: &BTreeMap<String, Topic>) -> String {
    let listed: Vec<String> = topics
        .iter()
        .take(MAX_LISTED)
        .map(|(name, topic)| format!("{name} ({}, {} messages)", topic.schema, topic.messages))
        .collect();
    match topics.len() {
        0 => "the bag has no topics: record it again".into(),
        n if n > MAX_LISTED => {
            format!("the bag has {} and {} more", listed.join(", "), n - MAX_LISTED)
        }
        _ => format!("the bag has {}", listed.join(", ")),
    }
}

/// The messages of the selected topics, in the order of the recording.
#[derive(Default)]
struct BagContent {
    poses: BTreeMap<String, Vec<StampedPose>>,
    statics: Vec<StampedPose>,
    scans: Vec<(u64, LaserScan)>,
}

impl BagContent {
    fn add_message(
        &mut self,
        bag: &str,
        selection: &TopicSelection,
        raw: &RawMessage<'_>,
    ) -> Result<(), InputError> {
        let damaged = |cause: String| {
            let place = format!("{bag}: {}, message {}", raw.topic, raw.number);
            InputError::new(place, cause, "record the bag again, or give another topic")
        };
        if selection.scans.as_deref() == Some(raw.topic) {
            check_type(bag, raw, &[LaserScan::NAME])?;
            let scan: LaserScan = cdr::decode(raw.bytes).map_err(|e| damaged(e.to_string()))?;
            self.scans.push((raw.number, checked_scan(scan).map_err(damaged)?));
        } else if selection.contains(raw.topic) {
            check_type(bag, raw, &poses::SCHEMAS)?;
            let poses = poses::decode_poses(raw.schema, raw.number, raw.bytes).map_err(damaged)?;
            self.poses.entry(raw.topic.into()).or_default().extend(poses);
        } else if raw.schema == TfMessage::NAME {
            let poses = poses::decode_poses(raw.schema, raw.number, raw.bytes).map_err(damaged)?;
            self.statics.extend(poses);
        }
        Ok(())
    }

    fn trajectory(&self, bag: &str, source: &PoseTopic) -> Result<Trajectory, InputError> {
        let poses = self.poses.get(&source.topic).map_or(&[][..], Vec::as_slice);
        frames::trajectory(bag, source, poses)
    }

    /// Moves the scans out, by time.
    fn take_scans(
        &mut self,
        bag: &str,
        selection: &TopicSelection,
    ) -> Result<Vec<LaserScan>, InputError> {
        let place = format!("{bag}: {}", selection.scans.as_deref().unwrap_or_default());
        let sorted = clock::sort_by_stamp(&place, std::mem::take(&mut self.scans))?;
        Ok(sorted.into_iter().map(|(_, scan)| scan).collect())
    }

    fn mount(&self, scanner: &str, ends: &[&str]) -> Option<Pose> {
        frames::mount(&self.statics, scanner, ends)
    }
}

fn check_type(bag: &str, raw: &RawMessage<'_>, known: &[&str]) -> Result<(), InputError> {
    if known.contains(&raw.schema) {
        return Ok(());
    }
    let cause = format!("its messages are of type `{}`", raw.schema);
    let remedy = format!("give a topic of type {}", known.join(", "));
    Err(InputError::new(format!("{bag}: {}", raw.topic), cause, remedy))
}

/// Checks that a scan's bearings and limits are valid.
fn checked_scan(scan: LaserScan) -> Result<LaserScan, String> {
    let n = scan.ranges_m.len();
    let bearings = [scan.angle_min_rad, scan.angle_increment_rad];
    let limits = [scan.range_min_m, scan.range_max_m];
    if n == 0 || n > MAX_BEAMS {
        return Err(format!("its scan has {n} beams"));
    }
    if !bearings.iter().all(|angle| angle.is_finite()) {
        return Err("its bearings are not finite".into());
    }
    if limits.iter().any(|limit| limit.is_nan()) || limits[0] < 0.0 || limits[1] <= limits[0] {
        return Err(format!("it measures ranges from {} to {} m", limits[0], limits[1]));
    }
    Ok(scan)
}
