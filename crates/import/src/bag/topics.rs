//! The topics of a bag: those that are read, and what is said about all of them.

use std::collections::BTreeMap;

use sidestep_kernel::InputError;

use super::scans::NoEcho;
use super::storage::Topic;
use crate::report::{Finding, ImportReport};

/// Maximum number of topics that an error or a report lists.
const MAX_LISTED: usize = 20;
/// The suffix of topics with static transforms.
const STATIC_TF_SUFFIX: &str = "tf_static";
/// The suffix of topics with transforms; programs of ROS 1 repeat static ones on it.
const TF_SUFFIX: &str = "/tf";

/// A topic with poses, and a pair of frames for a topic that has several.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PoseTopic {
    /// The name of the topic.
    pub topic: String,
    /// The parent frame and the child frame, which is empty where messages do not give it.
    pub frames: Option<(String, String)>,
}

impl PoseTopic {
    /// Parses `TOPIC`, `TOPIC:PARENT:CHILD` or, for messages that give the outer frame alone, `TOPIC:PARENT`; names of topics
    /// have no colons.
    ///
    /// # Errors
    /// When it is neither.
    pub fn parse(text: &str) -> Result<Self, InputError> {
        match text.split(':').collect::<Vec<_>>()[..] {
            [topic] if !topic.is_empty() => Ok(Self { topic: topic.into(), frames: None }),
            [topic, parent] if ![topic, parent].contains(&"") => {
                Ok(Self { topic: topic.into(), frames: Some((parent.into(), String::new())) })
            }
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
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TopicSelection {
    /// The robot's pose by odometry.
    pub odometry: Option<PoseTopic>,
    /// Its true pose.
    pub truth: PoseTopic,
    /// The measurements of its scanner.
    pub scans: Option<String>,
    /// The greatest speed of the robot in m/s, see [`SpeedRule`](crate::track::SpeedRule); `None` to guess it.
    pub max_speed_mps: Option<f64>,
    /// What the driver of the scanner writes where nothing answers; `None` to guess it.
    pub no_echo: Option<NoEcho>,
}

impl TopicSelection {
    /// Returns whether messages of a topic are read: static transforms too, which give the pose of the scanner, and lead on
    /// where transforms that change do not.
    pub(super) fn is_read(&self, topic: &str) -> bool {
        let is_static = topic.ends_with(STATIC_TF_SUFFIX);
        let has_frames = self.pose_topics().any(|source| source.frames.is_some());
        self.contains(topic)
            || self.scans.is_some() && (is_static || topic.ends_with(TF_SUFFIX))
            || has_frames && is_static
    }

    fn pose_topics(&self) -> impl Iterator<Item = &PoseTopic> {
        self.odometry.iter().chain([&self.truth])
    }

    pub(super) fn contains(&self, topic: &str) -> bool {
        self.scans.as_deref() == Some(topic)
            || self.pose_topics().any(|source| source.topic == topic)
    }

    /// Checks that every selected topic exists and has messages; `damage` is what was lost of the bag.
    pub(super) fn check(
        &self,
        bag: &str,
        topics: &BTreeMap<String, Topic>,
        damage: Option<&Finding>,
    ) -> Result<(), InputError> {
        for name in self.pose_topics().map(|source| &source.topic).chain(&self.scans) {
            let problem = match topics.get(name) {
                Some(topic) if topic.messages > 0 => continue,
                Some(topic) if topic.lost > 0 => "has messages only in damaged parts of the bag",
                Some(_) => "has no messages",
                None => "is not there",
            };
            let damage = damage.map_or_else(String::new, |found| format!(", and {found}"));
            let cause = format!("the topic {name} {problem}{damage}");
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
        0 => "the bag has no topics; `ros2 bag record -a` records all that are published".into(),
        n if n > MAX_LISTED => {
            format!("the bag has {} and {} more", listed.join(", "), n - MAX_LISTED)
        }
        _ => format!("the bag has {}", listed.join(", ")),
    }
}

/// Returns whether a topic holds transforms that do not change by its name.
pub(super) fn is_static(topic: &str) -> bool {
    topic.ends_with(STATIC_TF_SUFFIX)
}

/// Adds a fact for each topic to a report.
pub(super) fn add_facts(topics: &BTreeMap<String, Topic>, report: &mut ImportReport) {
    for (name, topic) in topics.iter().take(MAX_LISTED) {
        let mut value = format!("{name}: {}, {} messages", topic.schema, topic.messages);
        if topic.lost > 0 {
            value.push_str(&format!(", {} lost", topic.lost));
        }
        report.add_fact("topic", value);
    }
    if topics.len() > MAX_LISTED {
        report.add_fact("topic", format!("{} more", topics.len() - MAX_LISTED));
    }
}
