//! ROS 2 bags in MCAP: the poses and scans of a robot as it records them.
//!
//! A bag is one `.mcap` file or the folder of `ros2 bag record`; chunks may be packed with zstd or lz4. Read are
//! `nav_msgs/msg/Odometry`, `geometry_msgs/msg/PoseStamped`, `PoseWithCovarianceStamped` and `TransformStamped`,
//! `tf2_msgs/msg/TFMessage` and `sensor_msgs/msg/LaserScan`, encoded as CDR.
//!
//! Times are the stamps of the headers, not those of the recording, which come late by the way of the message.
//! Messages that have overtaken each other by up to half a second are sorted; stamps further back, or an hour
//! ahead, are a clock that jumps, and an error.

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

/// Most topics that an error lists.
const MAX_LISTED: usize = 20;
/// Most beams of a scan: as many as a message of a megabyte holds.
const MAX_BEAMS: usize = 1 << 18;

/// A topic with poses, and which frame in which other is meant where it places several.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PoseTopic {
    /// The name of the topic.
    pub topic: String,
    /// The outer frame and the frame that is placed in it.
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
                Err(InputError::new(text, "this is no topic", remedy))
            }
        }
    }
}

/// The topics of a bag to read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicSelection {
    /// The robot's belief of its place.
    pub odometry: Option<PoseTopic>,
    /// Its true place.
    pub truth: PoseTopic,
    /// The measurements of its scanner.
    pub scans: Option<String>,
}

/// The content that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct BagLog {
    /// The poses that the robot believes, by time; empty where none are wanted.
    pub odometry: Vec<StampedPose2>,
    /// The true poses, by time.
    pub truth: Vec<StampedPose2>,
    /// The scans, by time.
    pub scans: Vec<LaserScan>,
    /// The pose of the scanner on the robot; `None` where the bag does not say.
    pub mount: Option<Pose>,
}

/// Reads a bag.
///
/// # Errors
/// When the bag is missing, damaged or of another kind; a topic is missing or of another type; a message is
/// damaged; a clock jumps, or odometry and truth have no time in common.
pub fn read(path: &Path, wanted: &TopicSelection) -> Result<BagLog, InputError> {
    let bag = path.display().to_string();
    let mut content = BagContent::default();
    let is_wanted = |topic: &str| wanted.contains(topic) || topic.ends_with(STATIC_TF_SUFFIX);
    let topics =
        storage::read(path, is_wanted, |message| content.add_message(&bag, wanted, &message))?;
    wanted.check(&bag, &topics)?;
    let track =
        |source: &PoseTopic| frames::trajectory(&bag, source, content.poses_on(&source.topic));
    let truth = track(&wanted.truth)?;
    let odometry = wanted.odometry.as_ref().map(track).transpose()?;
    if let (Some(source), Some(odometry)) = (&wanted.odometry, &odometry) {
        let tracks = [(&*source.topic, &*odometry.poses), (&*wanted.truth.topic, &*truth.poses)];
        clock::check_overlap(&bag, tracks)?;
    }
    let scans = content.take_scans(&bag, wanted)?;
    let ends = [Some(&truth), odometry.as_ref()].into_iter().flatten().map(|track| &*track.child);
    let ends: Vec<&str> = ends.filter(|child| !child.is_empty()).collect();
    let mount = scans.first().and_then(|scan| content.mount(&scan.header.frame_id, &ends));
    let odometry = odometry.map_or_else(Vec::new, |track: Trajectory| track.poses);
    Ok(BagLog { odometry, truth: truth.poses, scans, mount })
}

/// The end of the name of topics with transforms that stay.
const STATIC_TF_SUFFIX: &str = "tf_static";

impl TopicSelection {
    fn pose_topics(&self) -> impl Iterator<Item = &PoseTopic> {
        self.odometry.iter().chain([&self.truth])
    }

    fn contains(&self, topic: &str) -> bool {
        self.scans.as_deref() == Some(topic)
            || self.pose_topics().any(|source| source.topic == topic)
    }

    /// Checks that every wanted topic is there and has messages.
    fn check(&self, bag: &str, topics: &BTreeMap<String, Topic>) -> Result<(), InputError> {
        let wanted = self.pose_topics().map(|source| &source.topic).chain(&self.scans);
        for name in wanted {
            match topics.get(name) {
                Some(topic) if topic.messages > 0 => {}
                found => {
                    let empty = "has no messages";
                    let cause =
                        format!("the topic {name} {}", found.map_or("is not there", |_| empty));
                    return Err(InputError::new(bag, cause, describe_topics(topics)));
                }
            }
        }
        Ok(())
    }
}

/// Returns which topics a bag has.
fn describe_topics(topics: &BTreeMap<String, Topic>) -> String {
    let shown = |(name, topic): (&String, &Topic)| {
        format!("{name} ({}, {} messages)", topic.schema, topic.messages)
    };
    let some: Vec<String> = topics.iter().take(MAX_LISTED).map(shown).collect();
    match topics.len() {
        0 => "the bag has no topics: record it again".into(),
        n if n > MAX_LISTED => {
            format!("the bag has {} and {} more", some.join(", "), n - MAX_LISTED)
        }
        _ => format!("the bag has {}", some.join(", ")),
    }
}

/// The messages of the wanted topics, in the order of the recording.
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
        wanted: &TopicSelection,
        raw: &RawMessage<'_>,
    ) -> Result<(), InputError> {
        let damaged = |cause: String| {
            let place = format!("{bag}: {}, message {}", raw.topic, raw.number);
            InputError::new(place, cause, "record the bag again, or give another topic")
        };
        if wanted.scans.as_deref() == Some(raw.topic) {
            check_type(bag, raw, &[LaserScan::NAME])?;
            let scan: LaserScan = cdr::decode(raw.bytes).map_err(|e| damaged(e.to_string()))?;
            self.scans.push((raw.number, checked_scan(scan).map_err(damaged)?));
        } else if wanted.contains(raw.topic) {
            check_type(bag, raw, &poses::SCHEMAS)?;
            let found = poses::decode_poses(raw.schema, raw.number, raw.bytes).map_err(damaged)?;
            self.poses.entry(raw.topic.into()).or_default().extend(found);
        } else if raw.schema == TfMessage::NAME {
            let found = poses::decode_poses(raw.schema, raw.number, raw.bytes).map_err(damaged)?;
            self.statics.extend(found);
        }
        Ok(())
    }

    fn poses_on(&self, topic: &str) -> &[StampedPose] {
        self.poses.get(topic).map_or(&[], Vec::as_slice)
    }

    /// Takes the scans out, by time.
    fn take_scans(
        &mut self,
        bag: &str,
        wanted: &TopicSelection,
    ) -> Result<Vec<LaserScan>, InputError> {
        let place = format!("{bag}: {}", wanted.scans.as_deref().unwrap_or_default());
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

/// Checks that a scan's bearings and limits mean something.
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
