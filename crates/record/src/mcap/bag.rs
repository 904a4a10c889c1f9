//! ROS 2 bags: messages that are already encoded, in a folder as `ros2 bag record` leaves it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use ::mcap::records::MessageHeader;
use ::mcap::{McapError, Writer};
use sidestep_kernel::ports::RecordError;

use super::check::error_text;
use super::writer::write_options;

/// The version of the layout of `metadata.yaml`: that of ROS 2 Humble, which later ones read.
const METADATA_VERSION: u32 = 5;
/// The name of the file with the messages.
const FILE: &str = "bag_0.mcap";
/// The encoding of messages.
const CDR: &str = "cdr";

/// The type of a topic's messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BagSchema {
    /// Its name in ROS 2, e.g. `nav_msgs/msg/Odometry`.
    pub name: &'static str,
    /// Its definition in the format `ros2msg`.
    pub definition: &'static str,
}

/// Writes a bag. The folder is whole once [`BagWriter::finish`] has returned.
pub struct BagWriter {
    folder: PathBuf,
    writer: Writer<BufWriter<File>>,
    topics: BTreeMap<String, BagTopic>,
    /// First and last time, once there is a message.
    span_ns: Option<(u64, u64)>,
}

#[derive(Debug)]
struct BagTopic {
    channel: u16,
    schema: BagSchema,
    messages: u32,
}

impl BagWriter {
    /// Starts a bag in a folder that is there; `version` is that of the program.
    ///
    /// # Errors
    /// An I/O error.
    pub fn create(folder: &Path, version: &str) -> Result<Self, RecordError> {
        let path = folder.join(FILE);
        let file = File::create(&path).map_err(|e| RecordError::new(path.display(), e))?;
        let writer = write_options(version).profile("ros2").create(BufWriter::new(file));
        let writer = writer.map_err(|e| RecordError::new(path.display(), error_text(e)))?;
        let folder = folder.to_path_buf();
        Ok(Self { folder, writer, topics: BTreeMap::new(), span_ns: None })
    }

    /// Appends a message, encoded as CDR.
    ///
    /// # Errors
    /// An I/O error.
    pub fn write(
        &mut self,
        topic: &str,
        schema: BagSchema,
        time_ns: u64,
        message: &[u8],
    ) -> Result<(), RecordError> {
        let path = self.folder.join(FILE);
        self.append(topic, schema, time_ns, message)
            .map_err(|e| RecordError::new(path.display(), error_text(e)))
    }

    fn append(
        &mut self,
        topic: &str,
        schema: BagSchema,
        time_ns: u64,
        message: &[u8],
    ) -> Result<(), McapError> {
        if !self.topics.contains_key(topic) {
            let definition = schema.definition.as_bytes();
            let id = self.writer.add_schema(schema.name, "ros2msg", definition)?;
            let about = BTreeMap::from([("offered_qos_profiles".to_string(), String::new())]);
            let channel = self.writer.add_channel(id, topic, CDR, &about)?;
            self.topics.insert(topic.into(), BagTopic { channel, schema, messages: 0 });
        }
        let Some(topic) = self.topics.get_mut(topic) else { return Ok(()) };
        let header = MessageHeader {
            channel_id: topic.channel,
            sequence: topic.messages,
            log_time: time_ns,
            publish_time: time_ns,
        };
        self.writer.write_to_known_channel(&header, message)?;
        topic.messages += 1;
        let (first, last) = self.span_ns.unwrap_or((time_ns, time_ns));
        self.span_ns = Some((first.min(time_ns), last.max(time_ns)));
        Ok(())
    }

    /// Finishes the bag.
    ///
    /// # Errors
    /// An I/O error.
    pub fn finish(mut self) -> Result<(), RecordError> {
        let path = self.folder.join(FILE);
        let metadata = self.metadata();
        self.writer.finish().map_err(|e| RecordError::new(path.display(), error_text(e)))?;
        let file = self.writer.into_inner().into_inner().map_err(|e| e.into_error());
        file.and_then(|file| file.sync_all()).map_err(|e| RecordError::new(path.display(), e))?;
        let path = self.folder.join("metadata.yaml");
        fs::write(&path, metadata).map_err(|e| RecordError::new(path.display(), e))
    }

    /// Returns the text of `metadata.yaml`.
    fn metadata(&self) -> String {
        let (first, last) = self.span_ns.unwrap_or_default();
        let messages: u32 = self.topics.values().map(|topic| topic.messages).sum();
        // Once for the bag and once for its only file.
        let [of_bag, of_file] = ["  ", "      "].map(|indent| {
            format!(
                "{indent}duration:\n{indent}  nanoseconds: {}\n{indent}starting_time:\n\
                 {indent}  nanoseconds_since_epoch: {first}\n{indent}message_count: {messages}\n",
                last - first
            )
        });
        let mut yaml = format!(
            "rosbag2_bagfile_information:\n  version: {METADATA_VERSION}\n  storage_identifier: mcap\n{of_bag}  \
             topics_with_message_count:\n"
        );
        for (name, topic) in &self.topics {
            // Writing to a string cannot fail.
            let _ = write!(
                yaml,
                "    - topic_metadata:\n        name: {name}\n        type: {}\n        \
                 serialization_format: {CDR}\n        offered_qos_profiles: \"\"\n      message_count: {}\n",
                topic.schema.name, topic.messages
            );
        }
        yaml += &format!(
            "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {FILE}\n  \
             files:\n    - path: {FILE}\n{of_file}"
        );
        yaml
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WORD: BagSchema = BagSchema { name: "std_msgs/msg/String", definition: "string data\n" };

    #[test]
    fn the_metadata_count_messages_and_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let mut bag = BagWriter::create(folder.path(), "0").unwrap();
        for (topic, time_ns) in
            [("/b", 5_000_000_000), ("/a", 7_000_000_000), ("/b", 6_000_000_000)]
        {
            bag.write(topic, WORD, time_ns, &[0, 1, 0, 0, 1, 0, 0, 0, 0]).unwrap();
        }
        bag.finish().unwrap();
        let yaml = fs::read_to_string(folder.path().join("metadata.yaml")).unwrap();
        for part in [
            "  message_count: 3\n",
            "      message_count: 2\n",
            "nanoseconds: 2000000000\n",
            "nanoseconds_since_epoch: 5000000000\n",
            "relative_file_paths:\n    - bag_0.mcap\n",
        ] {
            assert!(yaml.contains(part), "{part}{yaml}");
        }
        let bytes = fs::read(folder.path().join(FILE)).unwrap();
        let stored: Vec<_> =
            ::mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
        assert_eq!(stored.len(), 3);
        let schema = stored[0].channel.schema.as_ref().unwrap();
        assert_eq!((&*schema.name, &*schema.encoding), (WORD.name, "ros2msg"));
    }
}
