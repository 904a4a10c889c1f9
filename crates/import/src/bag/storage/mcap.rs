//! MCAP files, chunk by chunk.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;

use ::mcap::records::{Channel, ChunkHeader, Record, op};
use ::mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use ::mcap::{McapError, parse_record};
use flate2::Crc;
use sidestep_kernel::InputError;

use super::packed;
use super::sink::{MAX_RECORD_BYTES, Sink, Topic, ros2_name};

/// The number of bytes before a record: its kind and its length.
const RECORD_HEAD_BYTES: usize = 9;
/// The name of the rule for parts of a file that are damaged.
const DAMAGED_CHUNKS: &str = "chunks that are damaged";

/// Hands the topics and messages of a file to `sink`. Where the file ends early or is damaged, the rest is read.
///
/// # Errors
/// Those of the sink, and of reading from the disk.
pub(super) fn read(
    file: &str,
    stream: &mut dyn Read,
    sink: &mut Sink<'_>,
) -> Result<(), InputError> {
    let options = LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_emit_chunks(true)
        .with_record_length_limit(MAX_RECORD_BYTES);
    let mut reader = LinearReader::new_with_options(options);
    let mut content = FileContent::new(file);
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(n)) => {
                let read = stream.read(reader.insert(n));
                let Ok(read) = read else {
                    sink.cut_off(file);
                    return Ok(());
                };
                reader.notify_read(read);
            }
            Ok(LinearReadEvent::Record { data, opcode }) => {
                content.add_record(opcode, data, sink)?;
                if content.is_whole {
                    return Ok(());
                }
            }
            Err(McapError::UnexpectedEof | McapError::UnexpectedEoc) => break,
            Err(error) => {
                sink.damaged_part(
                    "the rest of a file that is damaged",
                    format!("{file} ({error})"),
                );
                return Ok(());
            }
        }
    }
    sink.cut_off(file);
    Ok(())
}

/// The schemas and channels of a file by their numbers.
struct FileContent<'f> {
    file: &'f str,
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    chunks: u64,
    /// Whether the last chunk is damaged; the indexes after it tell which messages were in it.
    is_chunk_lost: bool,
    /// Whether the data have an end.
    is_whole: bool,
}

struct Schema {
    name: String,
    encoding: String,
    definition: Vec<u8>,
}

impl<'f> FileContent<'f> {
    fn new(file: &'f str) -> Self {
        Self {
            file,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            chunks: 0,
            is_chunk_lost: false,
            is_whole: false,
        }
    }

    fn add_record(
        &mut self,
        opcode: u8,
        data: &[u8],
        sink: &mut Sink<'_>,
    ) -> Result<(), InputError> {
        match parse_record(opcode, data) {
            Ok(record) => self.process_record(record, sink),
            Err(error) => {
                sink.damaged_part("records that are damaged", format!("{} ({error})", self.file));
                Ok(())
            }
        }
    }

    fn process_record(
        &mut self,
        record: Record<'_>,
        sink: &mut Sink<'_>,
    ) -> Result<(), InputError> {
        match record {
            Record::Schema { header, data } => {
                let definition = data.into_owned();
                let schema = Schema { name: header.name, encoding: header.encoding, definition };
                self.schemas.insert(header.id, schema);
            }
            Record::Channel(channel) => self.add_channel(channel, sink),
            Record::Message { header, data } => {
                let Some(channel) = self.channels.get(&header.channel_id) else {
                    let place = format!("{}, channel {}", self.file, header.channel_id);
                    sink.damaged_part("messages on a topic that was not declared", place);
                    return Ok(());
                };
                sink.deliver(&channel.topic, header.log_time, Ok(&data))?;
            }
            Record::Chunk { header, data } => self.add_chunk(&header, &data, sink)?,
            Record::MessageIndex(index) if self.is_chunk_lost => {
                if let Some(channel) = self.channels.get(&index.channel_id) {
                    sink.lose(&channel.topic, index.records.len() as u64);
                }
            }
            Record::DataEnd(_) | Record::Footer(_) => self.is_whole = true,
            _ => {}
        }
        Ok(())
    }

    fn add_channel(&mut self, channel: Channel, sink: &mut Sink<'_>) {
        let schema = self.schemas.get(&channel.schema_id);
        let topic = Topic {
            schema: schema.map_or_else(String::new, |schema| ros2_name(&schema.name)),
            encoding: channel.message_encoding.clone(),
            definition: schema.map_or_else(Vec::new, |schema| schema.definition.clone()),
            definition_encoding: schema.map_or_else(String::new, |schema| schema.encoding.clone()),
            metadata: channel.metadata.clone(),
            ..Topic::default()
        };
        sink.declare(&channel.topic, topic);
        self.channels.insert(channel.id, channel);
    }

    fn add_chunk(
        &mut self,
        header: &ChunkHeader,
        data: &[u8],
        sink: &mut Sink<'_>,
    ) -> Result<(), InputError> {
        self.chunks += 1;
        let unpacked = match unpack_chunk(header, data) {
            Ok(unpacked) => unpacked,
            Err(cause) => {
                let place = format!("{}, chunk {} ({cause})", self.file, self.chunks);
                sink.damaged_part(DAMAGED_CHUNKS, place);
                self.is_chunk_lost = true;
                return Ok(());
            }
        };
        self.is_chunk_lost = !is_checksum_right(header, &unpacked);
        if self.is_chunk_lost {
            let place = format!("{}, chunk {} (its checksum is wrong)", self.file, self.chunks);
            sink.damaged_part(DAMAGED_CHUNKS, place);
        }
        let mut records = &unpacked[..];
        while let Some((opcode, record, rest)) = next_record(records) {
            // Later chunks refer to the topics of a damaged one. Chunks hold no chunks: a file could nest them without
            // end.
            let is_declaration = [op::SCHEMA, op::CHANNEL].contains(&opcode);
            if is_declaration || (opcode == op::MESSAGE && !self.is_chunk_lost) {
                self.add_record(opcode, record, sink)?;
            }
            records = rest;
        }
        if !records.is_empty() && !self.is_chunk_lost {
            let place = format!("{}, chunk {} (its last record is cut)", self.file, self.chunks);
            sink.damaged_part(DAMAGED_CHUNKS, place);
        }
        Ok(())
    }
}

/// Returns the first record, its kind before it, and the bytes after it; `None` where it is cut.
fn next_record(bytes: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    let (head, rest) = bytes.split_first_chunk::<RECORD_HEAD_BYTES>()?;
    let [opcode, length @ ..] = *head;
    let length = usize::try_from(u64::from_le_bytes(length)).ok()?;
    let (record, rest) = rest.split_at_checked(length)?;
    Some((opcode, record, rest))
}

/// Returns the records of a chunk, or the reason why they cannot be read.
fn unpack_chunk<'d>(header: &ChunkHeader, data: &'d [u8]) -> Result<Cow<'d, [u8]>, String> {
    let size = usize::try_from(header.uncompressed_size).unwrap_or(usize::MAX);
    if size > MAX_RECORD_BYTES {
        return Err(format!("it unpacks to {size} bytes, more than {MAX_RECORD_BYTES}"));
    }
    let unpacked = match header.compression.as_str() {
        "" => Cow::Borrowed(data),
        "zstd" => Cow::Owned(packed::unzstd(data, size)?),
        "lz4" => Cow::Owned(packed::unlz4(data, size)?),
        other => return Err(format!("it is compressed with `{other}`, not with zstd or lz4")),
    };
    if unpacked.len() != size {
        return Err(format!("it has {} bytes in place of {size}", unpacked.len()));
    }
    Ok(unpacked)
}

/// Returns whether the checksum of a chunk is right; 0 stands for none.
fn is_checksum_right(header: &ChunkHeader, unpacked: &[u8]) -> bool {
    let mut crc = Crc::new();
    crc.update(unpacked);
    [0, crc.sum()].contains(&header.uncompressed_crc)
}
