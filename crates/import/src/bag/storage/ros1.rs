//! Bags of ROS 1, version 2.0, chunk by chunk.

use std::collections::BTreeMap;
use std::io::{self, Read};

use sidestep_kernel::InputError;

use super::packed;
use super::sink::{MAX_RECORD_BYTES, Sink, Topic};

/// The first line of a file of version 2.0.
pub(super) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// Kinds of records.
const MESSAGE: u8 = 2;
const BAG_HEADER: u8 = 3;
const INDEX: u8 = 4;
const CHUNK: u8 = 5;
const CONNECTION: u8 = 7;

/// Hands the topics and messages of a file to `sink`. Where the file ends early or is damaged, the rest is read.
///
/// # Errors
/// When the file is encrypted; those of the sink.
pub(super) fn read(
    file: &str,
    stream: &mut dyn Read,
    sink: &mut Sink<'_>,
) -> Result<(), InputError> {
    let mut content =
        FileContent { file, connections: BTreeMap::new(), chunks: 0, is_chunk_lost: false };
    if skip_magic(stream).is_err() {
        sink.cut_off(file);
        return Ok(());
    }
    loop {
        match StoredRecord::read(stream) {
            Ok(Some(record)) => content.add_record(&record.view(), sink)?,
            Ok(None) => return Ok(()),
            Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                sink.damaged_part(
                    "the rest of a file that is damaged",
                    format!("{file} ({error})"),
                );
                return Ok(());
            }
            Err(_) => {
                sink.cut_off(file);
                return Ok(());
            }
        }
    }
}

fn skip_magic(stream: &mut dyn Read) -> io::Result<()> {
    stream.read_exact(&mut [0; MAGIC.len()])
}

/// A record in a buffer of its own.
struct StoredRecord {
    header: Vec<u8>,
    data: Vec<u8>,
}

impl StoredRecord {
    /// Reads the next record; `None` at the end of the stream.
    fn read(stream: &mut dyn Read) -> io::Result<Option<Self>> {
        let mut length = [0; 4];
        let n = stream.read(&mut length)?;
        if n == 0 {
            return Ok(None);
        }
        stream.read_exact(&mut length[n..])?;
        let header = read_block(stream, length)?;
        let mut length = [0; 4];
        stream.read_exact(&mut length)?;
        Ok(Some(Self { header, data: read_block(stream, length)? }))
    }

    fn view(&self) -> RecordView<'_> {
        RecordView { fields: HeaderFields(&self.header), data: &self.data }
    }
}

/// Reads as many bytes as there are: a length without them takes no memory.
fn read_block(stream: &mut dyn Read, length: [u8; 4]) -> io::Result<Vec<u8>> {
    let length = u32::from_le_bytes(length) as usize;
    if length > MAX_RECORD_BYTES {
        let cause = format!("a record of {length} bytes");
        return Err(io::Error::new(io::ErrorKind::InvalidData, cause));
    }
    let mut block = Vec::new();
    Read::take(stream, length as u64).read_to_end(&mut block)?;
    if block.len() < length {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    Ok(block)
}

/// A record, within a buffer.
struct RecordView<'a> {
    fields: HeaderFields<'a>,
    data: &'a [u8],
}

/// Returns the first record of a chunk, and the bytes after it; `None` where it is cut.
fn next_record(bytes: &[u8]) -> Option<(RecordView<'_>, &[u8])> {
    let (header, rest) = next_block(bytes)?;
    let (data, rest) = next_block(rest)?;
    Some((RecordView { fields: HeaderFields(header), data }, rest))
}

fn next_block(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

/// The fields before the data of a record, `name=value`.
#[derive(Clone, Copy)]
struct HeaderFields<'a>(&'a [u8]);

impl<'a> HeaderFields<'a> {
    fn get(&self, name: &str) -> Option<&'a [u8]> {
        let mut rest = self.0;
        while let Some((field, after)) = next_block(rest) {
            let value =
                field.strip_prefix(name.as_bytes()).and_then(|rest| rest.strip_prefix(b"="));
            if value.is_some() {
                return value;
            }
            rest = after;
        }
        None
    }

    fn text(&self, name: &str) -> String {
        self.get(name).map_or_else(String::new, |value| String::from_utf8_lossy(value).into_owned())
    }

    fn number(&self, name: &str) -> Option<u32> {
        Some(u32::from_le_bytes(self.get(name)?.try_into().ok()?))
    }

    fn kind(&self) -> Option<u8> {
        self.get("op")?.first().copied()
    }

    /// Returns the time of a message in nanoseconds.
    fn time_ns(&self) -> u64 {
        let Some((secs, rest)) = self.get("time").and_then(|time| time.split_first_chunk::<4>())
        else {
            return 0;
        };
        let nanosecs = rest.first_chunk::<4>().map_or(0, |nanosecs| u32::from_le_bytes(*nanosecs));
        u64::from(u32::from_le_bytes(*secs)) * 1_000_000_000 + u64::from(nanosecs)
    }
}

/// The topics of a file by the numbers of their connections.
struct FileContent<'f> {
    file: &'f str,
    connections: BTreeMap<u32, String>,
    chunks: u64,
    /// Whether the last chunk is damaged; the indexes after it tell which messages were in it.
    is_chunk_lost: bool,
}

impl FileContent<'_> {
    fn add_record(
        &mut self,
        record: &RecordView<'_>,
        sink: &mut Sink<'_>,
    ) -> Result<(), InputError> {
        match record.fields.kind() {
            Some(BAG_HEADER) => self.check_encryption(&record.fields)?,
            Some(CONNECTION) => self.add_connection(record, sink),
            Some(MESSAGE) => self.add_message(record, sink)?,
            Some(CHUNK) => self.add_chunk(record, sink)?,
            Some(INDEX) if self.is_chunk_lost => {
                let topic = record.fields.number("conn").and_then(|id| self.connections.get(&id));
                if let (Some(topic), Some(n)) = (topic, record.fields.number("count")) {
                    sink.lose(topic, u64::from(n));
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn check_encryption(&self, fields: &HeaderFields<'_>) -> Result<(), InputError> {
        let encryptor = fields.text("encryptor");
        if encryptor.is_empty() {
            return Ok(());
        }
        let cause = format!("the bag is encrypted by {encryptor}");
        Err(InputError::new(self.file, cause, "give the bag without encryption"))
    }

    fn add_connection(&mut self, record: &RecordView<'_>, sink: &mut Sink<'_>) {
        let Some(id) = record.fields.number("conn") else { return };
        let of_publisher = HeaderFields(record.data);
        let topic = record.fields.text("topic");
        let definition = of_publisher.text("message_definition").into_bytes();
        sink.declare(&topic, Topic::ros1(&of_publisher.text("type"), definition));
        self.connections.insert(id, topic);
    }

    fn add_message(&self, record: &RecordView<'_>, sink: &mut Sink<'_>) -> Result<(), InputError> {
        let topic = record.fields.number("conn").and_then(|id| self.connections.get(&id));
        let Some(topic) = topic else {
            let rule = "messages on a topic that was not declared";
            sink.damaged_part(rule, self.file.to_owned());
            return Ok(());
        };
        sink.deliver(topic, record.fields.time_ns(), Ok(record.data))
    }

    fn add_chunk(
        &mut self,
        record: &RecordView<'_>,
        sink: &mut Sink<'_>,
    ) -> Result<(), InputError> {
        self.chunks += 1;
        let unpacked = unpack_chunk(record);
        self.is_chunk_lost = unpacked.is_err();
        let place = |cause: &str| format!("{}, chunk {} ({cause})", self.file, self.chunks);
        let bytes = match unpacked {
            Ok(bytes) => bytes,
            Err(cause) => {
                sink.damaged_part("chunks that are damaged", place(&cause));
                return Ok(());
            }
        };
        let mut records = &bytes[..];
        while let Some((record, rest)) = next_record(records) {
            // Chunks hold no chunks: a file could nest them without end.
            match record.fields.kind() {
                Some(CONNECTION) => self.add_connection(&record, sink),
                Some(MESSAGE) => self.add_message(&record, sink)?,
                _ => {}
            }
            records = rest;
        }
        if !records.is_empty() {
            let place = format!("{}, chunk {} (its last record is cut)", self.file, self.chunks);
            sink.damaged_part("chunks that are damaged", place);
        }
        Ok(())
    }
}

/// Returns the records of a chunk, or the reason why they cannot be read.
fn unpack_chunk(record: &RecordView<'_>) -> Result<Vec<u8>, String> {
    let size = record.fields.number("size").ok_or("it has no size")? as usize;
    if size > MAX_RECORD_BYTES {
        return Err(format!("it unpacks to {size} bytes, more than {MAX_RECORD_BYTES}"));
    }
    let unpacked = match record.fields.text("compression").as_str() {
        "none" => record.data.to_vec(),
        "bz2" => packed::unbzip2(record.data, size)?,
        "lz4" => packed::unlz4(record.data, size)?,
        other => return Err(format!("it is compressed with `{other}`, not with bz2 or lz4")),
    };
    if unpacked.len() != size {
        return Err(format!("it has {} bytes in place of {size}", unpacked.len()));
    }
    Ok(unpacked)
}
