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

/// Largest record in bytes: an image of sixty megapixels and more.
const MAX_RECORD_BYTES: usize = 1 << 28;
/// Largest `metadata.yaml` in bytes; it lists topics and files.
const MAX_METADATA_BYTES: u64 = 1 << 20;
/// The encoding of messages of ROS 2.
const CDR: &str = "cdr";

/// A message as it is stored.
pub(super) struct RawMessage<'a> {
    pub(super) topic: &'a str,
    /// The name of its type.
    pub(super) schema: &'a str,
    /// Its number on its topic, from 1.
    pub(super) number: u64,
    pub(super) bytes: &'a [u8],
}

/// Messages recorded under a topic.
#[derive(Debug, Default)]
pub(super) struct Topic {
    /// The name of the type of its messages.
    pub(super) schema: String,
    encoding: String,
    /// Number of messages.
    pub(super) messages: u64,
}

/// Passes on every message on a topic that `is_wanted`, and returns all topics of the bag.
///
/// # Errors
/// When the bag is missing, damaged or of another kind; those of `each`.
pub(super) fn read(
    path: &Path,
    is_wanted: impl Fn(&str) -> bool,
    mut each: impl FnMut(RawMessage<'_>) -> Result<(), InputError>,
) -> Result<BTreeMap<String, Topic>, InputError> {
    let mut topics = BTreeMap::new();
    for file in bag_files(path)? {
        read_file(&file, &mut topics, &is_wanted, &mut each)?;
    }
    Ok(topics)
}

/// The schemas and channels of a file by their numbers.
#[derive(Default)]
struct ChannelTable {
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
}

fn read_file(
    path: &Path,
    topics: &mut BTreeMap<String, Topic>,
    is_wanted: &impl Fn(&str) -> bool,
    each: &mut impl FnMut(RawMessage<'_>) -> Result<(), InputError>,
) -> Result<(), InputError> {
    let mut file = File::open(path).map_err(|e| unreadable(path, &e))?;
    check_magic(path, &mut file)?;
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_validate_chunk_crcs(true)
        .with_record_length_limit(MAX_RECORD_BYTES);
    let mut reader = LinearReader::new_with_options(options);
    let mut declared = ChannelTable::default();
    while let Some(event) = reader.next_event() {
        match event.map_err(|e| damaged(path, &e))? {
            LinearReadEvent::ReadRequest(n) => {
                let read = file.read(reader.insert(n)).map_err(|e| unreadable(path, &e))?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { data, opcode } => {
                let record = parse_record(opcode, data).map_err(|e| damaged(path, &e))?;
                process_record(path, record, &mut declared, topics, is_wanted, each)?;
            }
        }
    }
    Ok(())
}

fn process_record(
    path: &Path,
    record: Record<'_>,
    declared: &mut ChannelTable,
    topics: &mut BTreeMap<String, Topic>,
    is_wanted: &impl Fn(&str) -> bool,
    each: &mut impl FnMut(RawMessage<'_>) -> Result<(), InputError>,
) -> Result<(), InputError> {
    match record {
        Record::Schema { header, .. } => {
            declared.schemas.insert(header.id, header.name);
        }
        Record::Channel(channel) => {
            let schema = declared.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
            let topic = topics.entry(channel.topic.clone()).or_default();
            (topic.schema, topic.encoding) = (schema, channel.message_encoding.clone());
            declared.channels.insert(channel.id, channel);
        }
        Record::Message { header, data } => {
            let id = header.channel_id;
            let unknown = || damaged(path, &McapError::UnknownChannel(header.sequence, id));
            let channel = declared.channels.get(&id).ok_or_else(unknown)?;
            let Some(topic) = topics.get_mut(&channel.topic) else { return Ok(()) };
            topic.messages += 1;
            if is_wanted(&channel.topic) {
                check_encoding(path, &channel.topic, topic)?;
                let (schema, number) = (&topic.schema, topic.messages);
                each(RawMessage { topic: &channel.topic, schema, number, bytes: &data })?;
            }
        }
        _ => {}
    }
    Ok(())
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
    let names = match metadata.is_file() {
        true => read_file_list(&metadata)?,
        false => find_mcap_files(path)?,
    };
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
    // `hall_10.mcap` comes after `hall_9.mcap`.
    names.sort_by(|a, b| (a.len(), a).cmp(&(b.len(), b)));
    Ok(names)
}

/// Returns the names of the files that `metadata.yaml` lists, a line each below their key.
///
/// The key is found without a parser of YAML: both known writers put it so, and no depth of a tree can do harm.
fn read_file_list(path: &Path) -> Result<Vec<String>, InputError> {
    let text = read_text(path, MAX_METADATA_BYTES)?;
    let mut below = text.lines().map(str::trim).skip_while(|line| *line != "relative_file_paths:");
    if below.next().is_none() {
        let remedy = "restore it: `ros2 bag reindex -s mcap FOLDER`, or give an .mcap file";
        return Err(InputError::new(path.display(), "it lists no `relative_file_paths`", remedy));
    }
    let names = below.map_while(|line| line.strip_prefix("- "));
    Ok(names.map(|name| name.trim_matches(['"', '\'']).to_owned()).collect())
}

/// Kinds of files that are taken for bags, by their first bytes, and the remedy.
const FOREIGN_FORMATS: [(&[u8], &str, &str); 3] = [
    (b"#ROSBAG", "is a bag of ROS 1", "convert it: `rosbags-convert --src FILE --dst FOLDER`"),
    (b"SQLite f", "is a bag in SQLite", "convert it to MCAP: `ros2 bag convert`"),
    (
        &[0x28, 0xb5, 0x2f, 0xfd],
        "is packed as a whole with zstd",
        "unpack it: `zstd -d FILE`; chunks packed within the file are read as they are",
    ),
];

fn check_magic(path: &Path, file: &mut File) -> Result<(), InputError> {
    let mut begin = [0; ::mcap::MAGIC.len()];
    let is_whole = file.read_exact(&mut begin).is_ok();
    if is_whole && begin == ::mcap::MAGIC {
        return Ok(());
    }
    let other = FOREIGN_FORMATS.iter().find(|(magic, ..)| begin.starts_with(magic));
    let (cause, remedy) = other.map_or(
        ("is no MCAP file", "give a bag recorded with `ros2 bag record -s mcap`"),
        |(_, cause, remedy)| (cause, remedy),
    );
    Err(InputError::new(path.display(), cause, remedy))
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
            format!("its chunks are packed with `{name}`"),
            "pack them with zstd or lz4: `mcap compress FILE -o NEW`",
        ),
        other => (format!("the bag is damaged: {other}"), "copy it again"),
    };
    InputError::new(path.display(), cause, remedy)
}
