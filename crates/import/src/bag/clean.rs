//! The messages of a bag that can be read, written to an MCAP file.

use std::collections::BTreeMap;
use std::io::BufWriter;
use std::path::Path;

use ::mcap::records::MessageHeader;
use ::mcap::{Compression, McapError, WriteOptions, Writer};
use sidestep_kernel::InputError;

use super::inspect::{check, inspect};
use super::messages::{LaserScan, Message, Odometry, PoseStamped, TfMessage};
use super::storage::{self, ROS1_TITLE, RawMessage, Topic};
use crate::report::ImportReport;

/// Writes the messages of a bag that can be read to an MCAP file, as they are: in CDR or in the encoding of ROS 1, with the
/// times of their recording. Returns the report of the bag, which counts what is left out.
///
/// # Errors
/// Those of [`inspect`]; when the file cannot be written.
pub fn write_clean(path: &Path, out: &Path) -> Result<ImportReport, InputError> {
    let report = inspect(path)?;
    if let (Ok(from), Ok(to)) = (path.canonicalize(), out.canonicalize())
        && from == to
    {
        let remedy = "give another file for the clean bag";
        return Err(InputError::new(out.display(), "is the bag itself", remedy));
    }
    let profile = if report.format == ROS1_TITLE { "ros1" } else { "ros2" };
    let mut writer = CleanWriter::create(out, profile)?;
    storage::read(path, &|_| true, &mut |message| writer.add(&message))?;
    writer.finish()?;
    Ok(report)
}

struct CleanWriter<'o> {
    out: &'o Path,
    writer: Writer<BufWriter<std::fs::File>>,
    channels: BTreeMap<String, u16>,
}

impl<'o> CleanWriter<'o> {
    fn create(out: &'o Path, profile: &str) -> Result<Self, InputError> {
        let file = std::fs::File::create(out).map_err(|e| unwritable(out, &McapError::Io(e)))?;
        let options = WriteOptions::new().profile(profile).compression(Some(Compression::Zstd));
        let writer = options.create(BufWriter::new(file)).map_err(|e| unwritable(out, &e))?;
        Ok(Self { out, writer, channels: BTreeMap::new() })
    }

    fn add(&mut self, raw: &RawMessage<'_>) -> Result<(), InputError> {
        let (Ok(_), Ok(bytes)) = (check(raw), &raw.payload) else { return Ok(()) };
        self.write(raw, bytes).map_err(|e| unwritable(self.out, &e))
    }

    fn write(&mut self, raw: &RawMessage<'_>, bytes: &[u8]) -> Result<(), McapError> {
        let channel_id = match self.channels.get(raw.topic) {
            Some(id) => *id,
            None => self.add_channel(raw.topic, raw.info)?,
        };
        let header = MessageHeader {
            channel_id,
            sequence: u32::try_from(raw.number).unwrap_or(u32::MAX),
            log_time: raw.log_time_ns,
            publish_time: raw.log_time_ns,
        };
        self.writer.write_to_known_channel(&header, bytes)
    }

    fn add_channel(&mut self, name: &str, topic: &Topic) -> Result<u16, McapError> {
        let definition = definition_of(topic);
        let language = match topic.definition_encoding.as_str() {
            "" => "ros2msg",
            known => known,
        };
        let schema = self.writer.add_schema(&topic.schema, language, definition)?;
        let id = self.writer.add_channel(schema, name, &topic.encoding, &topic.metadata)?;
        self.channels.insert(name.into(), id);
        Ok(id)
    }

    fn finish(mut self) -> Result<(), InputError> {
        let finished = self.writer.finish();
        finished.map(drop).map_err(|e| unwritable(self.out, &e))
    }
}

/// Returns the definition of a topic's type; older bags have none, and those that are read here are known.
fn definition_of(topic: &Topic) -> &[u8] {
    if !topic.definition.is_empty() {
        return &topic.definition;
    }
    let known: [(&str, &'static str); 4] = [
        (Odometry::NAME, Odometry::DEFINITION),
        (PoseStamped::NAME, PoseStamped::DEFINITION),
        (LaserScan::NAME, LaserScan::DEFINITION),
        (TfMessage::NAME, TfMessage::DEFINITION),
    ];
    known.iter().find(|(name, _)| *name == topic.schema).map_or(b"", |(_, text)| text.as_bytes())
}

fn unwritable(out: &Path, error: &McapError) -> InputError {
    let remedy = "give a file in a folder that exists and may be written to";
    InputError::new(out.display(), format!("cannot be written: {error}"), remedy)
}
