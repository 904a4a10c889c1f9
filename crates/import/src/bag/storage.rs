//! The files of a bag, and the messages in them in the order of the recording.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use ::mcap::records::{Channel, Record};
use ::mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use ::mcap::{McapError, parse_record};
use sidestep_kernel::InputError;
use sidestep_scenario::file::read_text;

/// Maximum size of a record in bytes: an image of sixty megapixels and more.
const MAX_RECORD_BYTES: usize = 1 << 28;
/// Maximum size of `metadata.yaml` in bytes; it lists topics and files.
const MAX_METADATA_BYTES: u64 = 1 << 20;
/// The encoding of messages of ROS 2.
const CDR: &str = "cdr";

/// A message as it is stored.
pub(super) struct RawMessage<'a> {
    pub(super) topic: &'a str,
    /// Name of its type, e.g. `nav_msgs/msg/Odometry`.
    pub(super) schema: &'a str,
    /// Its number on its topic, from 1.
    pub(super) number: u64,
    pub(super) bytes: &'a [u8],
}

/// Messages recorded under a topic.
#[derive(Debug, Default)]
pub(super) struct Topic {
    /// The type of its messages.
    pub(super) schema: String,
    encoding: String,
    /// Number of messages in all files of the bag.
    pub(super) messages: u64,
}

/// Calls `on_message` with every message on a topic that `is_read`, and returns all topics of the bag.
///
/// # Errors
/// When the bag is missing, damaged or of another kind; those of `on_message`.
pub(super) fn read(
    path: &Path,
    is_read: impl Fn(&str) -> bool,
    on_message: impl FnMut(RawMessage<'_>) -> Result<(), InputError>,
) -> Result<BTreeMap<String, Topic>, InputError> {
    let mut reader = BagReader { topics: BTreeMap::new(), is_read, on_message };
    for file in bag_files(path)? {
        reader.read_file(&file)?;
    }
    Ok(reader.topics)
}

/// The schemas and channels of a file by their numbers.
#[derive(Default)]
struct ChannelTable {
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
}

/// Reads the files of a bag, one after the other.
struct BagReader<R, M> {
    topics: BTreeMap<String, Topic>,
    is_read: R,
    on_message: M,
}

impl<R, M> BagReader<R, M>
where
    R: Fn(&str) -> bool,
    M: FnMut(RawMessage<'_>) -> Result<(), InputError>,
{
    fn read_file(&mut self, path: &Path) -> Result<(), InputError> {
        let mut file = File::open(path).map_err(|e| unreadable(path, &e))?;
        check_magic(path, &mut file)?;
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(MAX_RECORD_BYTES);
        let mut reader = LinearReader::new_with_options(options);
        let mut channels = ChannelTable::default();
        while let Some(event) = reader.next_event() {
            match event.map_err(|e| damaged(path, &e))? {
                LinearReadEvent::ReadRequest(n) => {
                    let read = file.read(reader.insert(n)).map_err(|e| unreadable(path, &e))?;
                    reader.notify_read(read);
                }
                LinearReadEvent::Record { data, opcode } => {
                    let record = parse_record(opcode, data).map_err(|e| damaged(path, &e))?;
                    self.process_record(path, record, &mut channels)?;
                }
            }
        }
        Ok(())
    }

    fn process_record(
        &mut self,
        path: &Path,
        record: Record<'_>,
        table: &mut ChannelTable,
    ) -> Result<(), InputError> {
        match record {
            Record::Schema { header, .. } => {
                table.schemas.insert(header.id, header.name);
            }
            Record::Channel(channel) => {
                let schema = table.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                let topic = self.topics.entry(channel.topic.clone()).or_default();
                topic.schema = schema;
                topic.encoding = channel.message_encoding.clone();
                table.channels.insert(channel.id, channel);
            }
            Record::Message { header, data } => {
                let id = header.channel_id;
                let channel = table.channels.get(&id).ok_or_else(|| {
                    damaged(path, &McapError::UnknownChannel(header.sequence, id))
                })?;
                let Some(topic) = self.topics.get_mut(&channel.topic) else { return Ok(()) };
                topic.messages += 1;
                if (self.is_read)(&channel.topic) {
                    check_encoding(path, &channel.topic, topic)?;
                    (self.on_message)(RawMessage {
                        topic: &channel.topic,
                        schema: &topic.schema,
                        number: topic.messages,
                        bytes: &data,
                    })?;
                }
            }
            _ => {}
        }
        Ok(())
    }
}

fn check_encoding(path: &Path, name: &str, topic: &Topic) -> Result<(), InputError> {
    if topic.encoding == CDR {
        return Ok(());
    }
    let cause = format!("messages on {name} are encoded as `{}`, not `{CDR}`", topic.encoding);
    let remedy = "record the bag with ROS 2, or convert it: `rosbags-convert`";
    Err(InputError::new(path.display(), cause, remedy))
}

/// Returns the files of a bag: the file itself, or those that the folder's `metadata.yaml` lists.
fn bag_files(path: &Path) -> Result<Vec<PathBuf>, InputError> {
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let metadata = path.join("metadata.yaml");
    let names =
        if metadata.is_file() { read_file_list(&metadata)? } else { find_mcap_files(path)? };
    if names.is_empty() {
        let remedy = "give a folder that `ros2 bag record -s mcap` wrote, or an .mcap file";
        return Err(InputError::new(path.display(), "the folder holds no .mcap file", remedy));
    }
    Ok(names.into_iter().map(|name| path.join(name)).collect())
}

/// Returns the names of the files in a folder without `metadata.yaml`, in the order of their numbers.
fn find_mcap_files(folder: &Path) -> Result<Vec<String>, InputError> {
    let entries = std::fs::read_dir(folder).map_err(|e| unreadable(folder, &e))?;
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let mut names: Vec<String> = names.filter(|name| name.ends_with(".mcap")).collect();
    // By length first: `hall_10.mcap` follows `hall_9.mcap`.
    names.sort_by(|a, b| (a.len(), a).cmp(&(b.len(), b)));
    Ok(names)
}

/// Returns the files that `metadata.yaml` lists, each on a line below their key.
///
/// The key is found without a parser of YAML: both known writers format it so, and no nesting can exhaust the stack.
fn read_file_list(path: &Path) -> Result<Vec<String>, InputError> {
    let text = read_text(path, MAX_METADATA_BYTES)?;
    let mut lines = text.lines().map(str::trim).skip_while(|line| *line != "relative_file_paths:");
    if lines.next().is_none() {
        let remedy = "restore it: `ros2 bag reindex -s mcap FOLDER`, or give an .mcap file";
        return Err(InputError::new(path.display(), "it lists no `relative_file_paths`", remedy));
    }
    let names = lines.map_while(|line| line.strip_prefix("- "));
    Ok(names.map(|name| name.trim_matches(['"', '\'']).to_owned()).collect())
}

/// Kinds of files that users mistake for such bags, by their first bytes, and the remedy.
const FOREIGN_FORMATS: [(&[u8], &str, &str); 3] = [
    (b"#ROSBAG", "is a bag of ROS 1", "convert it: `rosbags-convert --src FILE --dst FOLDER`"),
    (b"SQLite f", "is a bag in SQLite", "convert it to MCAP: `ros2 bag convert`"),
    (
        &[0x28, 0xb5, 0x2f, 0xfd],
        "is compressed as a whole with zstd",
        "decompress it: `zstd -d FILE`; chunks compressed within the file are fine",
    ),
];

fn check_magic(path: &Path, file: &mut File) -> Result<(), InputError> {
    let mut magic = [0; ::mcap::MAGIC.len()];
    let is_read = file.read_exact(&mut magic).is_ok();
    if is_read && magic == ::mcap::MAGIC {
        return Ok(());
    }
    for (foreign_magic, cause, remedy) in FOREIGN_FORMATS {
        if magic.starts_with(foreign_magic) {
            return Err(InputError::new(path.display(), cause, remedy));
        }
    }
    let remedy = "give a bag recorded with `ros2 bag record -s mcap`";
    Err(InputError::new(path.display(), "is no MCAP file", remedy))
}

fn unreadable(path: &Path, error: &std::io::Error) -> InputError {
    let remedy = "check the path; relative ones start at the working directory";
    InputError::new(path.display(), format!("cannot be read: {error}"), remedy)
}

fn damaged(path: &Path, error: &McapError) -> InputError {
    let (cause, remedy) = match error {
        McapError::UnexpectedEof | McapError::UnexpectedEoc | McapError::BadFooter => (
            "the bag is cut off: it ends in the middle".into(),
            "copy it again; if the recording was killed, `mcap recover FILE -o NEW` keeps what is whole",
        ),
        McapError::UnsupportedCompression(name) => (
            format!("its chunks are compressed with `{name}`"),
            "compress them with zstd or lz4: `mcap compress FILE -o NEW`",
        ),
        other => (format!("the bag is damaged: {other}"), "copy it again"),
    };
    InputError::new(path.display(), cause, remedy)
}
