//! What the files of a bag deliver: its topics, and the messages on those that are read.

use std::collections::BTreeMap;

use sidestep_kernel::InputError;

use super::packed;
use crate::bag::cdr::Encoding;
use crate::report::{Finding, ImportReport, Treatment};

/// Maximum size of a record, of a chunk or of a message in bytes, before and after it is unpacked: an image of sixty
/// megapixels and more. No more of a bag than one record is in memory at a time.
pub(super) const MAX_RECORD_BYTES: usize = 1 << 28;
/// The encoding of messages of ROS 2.
const CDR: &str = "cdr";
/// The encoding of messages of ROS 1.
const ROS1: &str = "ros1";

/// A message as it is stored.
pub(in crate::bag) struct RawMessage<'a> {
    pub(in crate::bag) topic: &'a str,
    pub(in crate::bag) info: &'a Topic,
    /// Its number on its topic, from 1.
    pub(in crate::bag) number: u64,
    /// The time of its recording in nanoseconds.
    pub(in crate::bag) log_time_ns: u64,
    /// Its bytes, unpacked, or the reason why they cannot be read.
    pub(in crate::bag) payload: Result<&'a [u8], String>,
}

/// Messages recorded under a topic.
#[derive(Debug, Clone, Default)]
pub(in crate::bag) struct Topic {
    /// The type of its messages as ROS 2 writes it: `nav_msgs/msg/Odometry`.
    pub(in crate::bag) schema: String,
    /// `cdr` or `ros1`.
    pub(in crate::bag) encoding: String,
    /// The definition of its type, and the language of it; empty where the bag has none.
    pub(in crate::bag) definition: Vec<u8>,
    pub(in crate::bag) definition_encoding: String,
    /// Properties that ROS 2 keeps with a topic, such as its quality of service.
    pub(in crate::bag) metadata: BTreeMap<String, String>,
    /// Number of messages in all files of the bag.
    pub(in crate::bag) messages: u64,
    /// Number of messages in damaged parts of the files, as far as these say.
    pub(in crate::bag) lost: u64,
}

impl Topic {
    /// Returns the encoding of its messages; `None` for one that is not read here.
    pub(in crate::bag) fn encoding(&self) -> Option<Encoding> {
        match self.encoding.as_str() {
            CDR => Some(Encoding::Cdr),
            ROS1 => Some(Encoding::Ros1),
            _ => None,
        }
    }

    pub(super) fn ros1(schema: &str, definition: Vec<u8>) -> Self {
        Self {
            schema: ros2_name(schema),
            encoding: ROS1.into(),
            definition,
            definition_encoding: "ros1msg".into(),
            ..Self::default()
        }
    }
}

/// Returns the name of a type in ROS 2: `nav_msgs/Odometry` of ROS 1 is `nav_msgs/msg/Odometry`.
pub(super) fn ros2_name(schema: &str) -> String {
    if schema == "tf/tfMessage" {
        return "tf2_msgs/msg/TFMessage".into();
    }
    match schema.split_once('/') {
        Some((package, name)) if !name.contains('/') => format!("{package}/msg/{name}"),
        _ => schema.into(),
    }
}

/// The remedy for what is missing.
const COPY: &str = "copy the bag again if its original is whole";

/// Receives what the files of a bag hold, one after the other.
pub(super) struct Sink<'a> {
    pub(super) topics: BTreeMap<String, Topic>,
    pub(super) report: ImportReport,
    is_read: &'a dyn Fn(&str) -> bool,
    on_message: &'a mut dyn FnMut(RawMessage<'_>) -> Result<(), InputError>,
    /// Number of messages that were packed one by one.
    pub(super) packed_messages: u64,
    /// Number of rows that cannot be read, of topics that nothing tells.
    pub(super) lost_rows: u64,
}

impl<'a> Sink<'a> {
    pub(super) fn new(
        is_read: &'a dyn Fn(&str) -> bool,
        on_message: &'a mut dyn FnMut(RawMessage<'_>) -> Result<(), InputError>,
    ) -> Self {
        Self {
            topics: BTreeMap::new(),
            report: ImportReport::default(),
            is_read,
            on_message,
            packed_messages: 0,
            lost_rows: 0,
        }
    }

    /// Adds a topic; the counts of one that is known already go on.
    pub(super) fn declare(&mut self, name: &str, topic: Topic) {
        let known = self.topics.entry(name.into()).or_default();
        *known = Topic { messages: known.messages, lost: known.lost, ..topic };
    }

    pub(super) fn is_read(&self, topic: &str) -> bool {
        (self.is_read)(topic)
    }

    /// Counts a message on a topic that is not read.
    pub(super) fn count(&mut self, topic: &str) {
        if let Some(topic) = self.topics.get_mut(topic) {
            topic.messages += 1;
        }
    }

    /// Hands on a message, unpacked, where its topic is read.
    pub(super) fn deliver(
        &mut self,
        topic: &str,
        log_time_ns: u64,
        bytes: Result<&[u8], String>,
    ) -> Result<(), InputError> {
        self.count(topic);
        let Some(info) = self.topics.get(topic) else { return Ok(()) };
        if !(self.is_read)(topic) {
            return Ok(());
        }
        // Messages in CDR begin with 0: that of a packed one is no encoding.
        let is_packed = bytes.as_ref().is_ok_and(|bytes| bytes.starts_with(&packed::ZSTD));
        let unpacked;
        let mut payload = bytes;
        if is_packed {
            self.packed_messages += 1;
            unpacked = payload.and_then(|bytes| packed::unzstd(bytes, MAX_RECORD_BYTES));
            payload = unpacked.as_deref().map_err(Clone::clone);
        }
        let number = info.messages;
        (self.on_message)(RawMessage { topic, info, number, log_time_ns, payload })
    }

    /// Records messages of a topic in a damaged part of a file.
    pub(super) fn lose(&mut self, topic: &str, n: u64) {
        if let Some(topic) = self.topics.get_mut(topic) {
            topic.lost += n;
        }
    }

    /// Records a part of a file that is damaged.
    pub(super) fn damaged_part(&mut self, rule: &str, place: String) {
        self.report.record(Treatment::Dropped, rule, place, COPY);
    }

    /// Records rows of a file that cannot be read.
    pub(super) fn lose_rows(&mut self, rule: &str, n: u64, place: String) {
        self.lost_rows = self.lost_rows.saturating_add(n);
        self.damaged_part(rule, place);
        let is_known =
            |found: &&mut Finding| found.treatment == Treatment::Dropped && found.rule == rule;
        if let Some(found) = self.report.findings.iter_mut().find(is_known) {
            found.count = found.count.saturating_add(n.saturating_sub(1));
        }
    }

    /// Records the rest of a file, of about `n` rows.
    pub(super) fn lose_rest(&mut self, n: u64, place: String) {
        self.lost_rows = self.lost_rows.saturating_add(n);
        self.damaged_part("the rest of a file that is damaged", place);
    }

    /// Records that a file ends before its end.
    pub(super) fn cut_off(&mut self, file: &str) {
        let rule = "the end of a file that is cut off";
        self.report.record(Treatment::Dropped, rule, file, COPY);
    }
}
