//! The metadata of our recordings.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Component, Path, PathBuf};

use ::mcap::read::{attachment, metadata};
use ::mcap::records::{AttachmentIndex, MetadataIndex, op};
use ::mcap::sans_io::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use ::mcap::{McapError, Summary};
use sidestep_kernel::InputError;

use super::{METADATA, SCENARIO};
use crate::format::FormatVersion;
use crate::manifest::Status;

/// The number of bytes before the content of a record: its kind and its length.
const RECORD_HEAD_BYTES: usize = 9;

/// The number of bytes of the last record and of the magic number after it: the place of the summary, that of its index, and a
/// checksum.
const FOOTER_BYTES: u64 = RECORD_HEAD_BYTES as u64 + 20 + MAGIC.len() as u64;

/// The first bytes of every MCAP file.
const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];

/// Returns whether a file starts like an MCAP file.
pub fn is_mcap(path: &Path) -> bool {
    let mut begin = [0; MAGIC.len()];
    File::open(path).and_then(|mut file| file.read_exact(&mut begin)).is_ok() && begin == MAGIC
}

/// A recording made by this program: the description of its run, without its messages.
#[derive(Debug, Clone, PartialEq)]
pub struct McapRunInfo {
    /// Path of the file.
    pub path: PathBuf,
    /// Version of the folder format that the build had; refused if its major number differs.
    pub format: FormatVersion,
    /// Version of the program that made the recording.
    pub program_version: String,
    /// Build of the program; early recordings do not have it.
    pub build: Option<String>,
    /// The world that was simulated, e.g. `robots`.
    pub world: String,
    /// The seed of the run, in case an option has replaced that of the scenario.
    pub seed: u64,
    /// Whether the run reached its end.
    pub status: Status,
    /// Cycles done when the recording ended; the last frame may be of an earlier one.
    pub cycles_done: u64,
    /// Cycles that the scenario asks for.
    pub cycles_planned: u64,
    /// Number of cycles between frames; there is one of the end as well.
    pub every: u64,
    /// Digest of the state after `cycles_done` cycles.
    pub digest: String,
    /// The scenario's text, with every default and include resolved.
    pub scenario: String,
    /// Files that the scenario names, by their path relative to it.
    pub files: Vec<(String, Vec<u8>)>,
    /// Number of messages by topic.
    pub messages: BTreeMap<String, u64>,
}

impl McapRunInfo {
    /// Reads the metadata of a recording.
    ///
    /// # Errors
    /// A missing file; one of another program; one that is cut off or damaged; another major
    /// format.
    pub fn open(path: &Path) -> Result<Self, InputError> {
        let mut source = McapFile::open(path)?;
        let summary = source.summary()?;
        let metadata = RunMetadata { path, values: describe_run(&mut source, &summary)? };
        let format: FormatVersion =
            metadata.text("format")?.parse().map_err(|e| damaged(path, e))?;
        format.check_readable(path.display())?;
        let mut files = source.attachments(&summary)?;
        let at = files.iter().position(|(name, _)| name == SCENARIO);
        let (_, scenario) = files.remove(at.ok_or_else(|| not_a_recording(path))?);
        let scenario = String::from_utf8(scenario).map_err(|e| damaged(path, e))?;
        let is_complete = metadata.text("status")? == "complete";
        Ok(Self {
            path: path.to_path_buf(),
            format,
            program_version: metadata.text("program_version")?.clone(),
            build: metadata.values.get("build").cloned(),
            world: metadata.text("world")?.clone(),
            seed: metadata.number("seed")?,
            status: if is_complete { Status::Complete } else { Status::Incomplete },
            cycles_done: metadata.number("cycles_done")?,
            cycles_planned: metadata.number("cycles_planned")?,
            every: metadata.number("every")?,
            digest: metadata.text("digest")?.clone(),
            scenario,
            files,
            messages: message_counts(&summary),
        })
    }
}

/// The metadata of the recording that describes its run, as texts.
struct RunMetadata<'a> {
    path: &'a Path,
    values: BTreeMap<String, String>,
}

impl RunMetadata<'_> {
    fn text(&self, key: &str) -> Result<&String, InputError> {
        let value = self.values.get(key);
        value.ok_or_else(|| damaged(self.path, format!("its metadata has no `{key}`")))
    }

    fn number(&self, key: &str) -> Result<u64, InputError> {
        let value = self.text(key)?;
        value.parse().map_err(|_| damaged(self.path, format!("`{key}` is `{value}`")))
    }
}

pub(super) fn describe_run(
    source: &mut McapFile,
    summary: &Summary,
) -> Result<BTreeMap<String, String>, InputError> {
    let index = summary.metadata_indexes.iter().find(|index| index.name == METADATA);
    let index = index.ok_or_else(|| not_a_recording(&source.path))?;
    source.metadata(index)
}

fn message_counts(summary: &Summary) -> BTreeMap<String, u64> {
    let Some(stats) = &summary.stats else { return BTreeMap::new() };
    let counts = stats.channel_message_counts.iter();
    counts.filter_map(|(id, n)| Some((summary.channels.get(id)?.topic.clone(), *n))).collect()
}

/// An open file.
pub(super) struct McapFile {
    pub(super) path: PathBuf,
    file: File,
    pub(super) length: u64,
}

impl McapFile {
    pub(super) fn open(path: &Path) -> Result<Self, InputError> {
        let opened = File::open(path).and_then(|file| Ok((file.metadata()?.len(), file)));
        let (length, file) = opened.map_err(|e| {
            InputError::new(path.display(), e.to_string(), "give a recording that can be read")
        })?;
        Ok(Self { path: path.to_path_buf(), file, length })
    }

    /// Reads the end of the file, which lists the position of everything.
    pub(super) fn summary(&mut self) -> Result<Summary, InputError> {
        if self.has_chunk_in_summary().map_err(|e| damaged(&self.path, e))? {
            return Err(damaged(
                &self.path,
                "its end says that its summary begins among its messages",
            ));
        }
        let summary = self.read_summary().map_err(|e| damaged(&self.path, e))?;
        summary.ok_or_else(|| damaged(&self.path, "it has no summary"))
    }

    /// Returns whether there is a chunk of messages between the place at which the summary shall begin and the end of the
    /// file. The reader of summaries would unpack it, and its arithmetic on the size of a damaged one overflows.
    fn has_chunk_in_summary(&mut self) -> std::io::Result<bool> {
        let Some(footer) = self.length.checked_sub(FOOTER_BYTES) else { return Ok(false) };
        self.file.seek(SeekFrom::Start(footer))?;
        let mut file = BufReader::new(&mut self.file);
        let mut start = [0; 8];
        file.seek_relative(RECORD_HEAD_BYTES as i64)?;
        file.read_exact(&mut start)?;
        let mut at = u64::from_le_bytes(start);
        if at == 0 {
            return Ok(false);
        }
        file.seek(SeekFrom::Start(at))?;
        while at < footer {
            let mut head = [0; RECORD_HEAD_BYTES];
            file.read_exact(&mut head)?;
            let [opcode, length @ ..] = head;
            if opcode == op::CHUNK {
                return Ok(true);
            }
            let length = u64::from_le_bytes(length);
            let end = at.checked_add(RECORD_HEAD_BYTES as u64 + length.min(self.length));
            let Some(end) = end.filter(|end| *end <= footer) else { break };
            file.seek_relative((end - at) as i64 - RECORD_HEAD_BYTES as i64)?;
            at = end;
        }
        Ok(false)
    }

    fn read_summary(&mut self) -> Result<Option<Summary>, McapError> {
        let options = SummaryReaderOptions::default()
            .with_file_size(self.length)
            .with_record_length_limit(usize::try_from(self.length).unwrap_or(usize::MAX));
        let mut reader = SummaryReader::new_with_options(options);
        while let Some(event) = reader.next_event() {
            match event? {
                SummaryReadEvent::ReadRequest(n) => {
                    let read = self.file.read(reader.insert(n))?;
                    reader.notify_read(read);
                }
                SummaryReadEvent::SeekRequest(to) => {
                    let at = self.file.seek(to)?;
                    reader.notify_seeked(at);
                }
            }
        }
        Ok(reader.finish())
    }

    /// Reads the bytes of a record; never allocates more than the size of the file.
    pub(super) fn record(&mut self, offset: u64, length: u64) -> Result<Vec<u8>, InputError> {
        if offset.checked_add(length).is_none_or(|end| end > self.length) {
            return Err(damaged(&self.path, "an index points beyond its end"));
        }
        let mut bytes = vec![0; length as usize];
        let read = self.file.seek(SeekFrom::Start(offset));
        read.and_then(|_| self.file.read_exact(&mut bytes)).map_err(|e| damaged(&self.path, e))?;
        Ok(bytes)
    }

    fn metadata(&mut self, index: &MetadataIndex) -> Result<BTreeMap<String, String>, InputError> {
        let bytes = self.record(index.offset, index.length)?;
        let own = MetadataIndex { offset: 0, ..index.clone() };
        let record = metadata(&bytes, &own).map_err(|e| damaged(&self.path, e))?;
        Ok(record.metadata)
    }

    fn attachments(&mut self, summary: &Summary) -> Result<Vec<(String, Vec<u8>)>, InputError> {
        let mut files = Vec::new();
        for index in &summary.attachment_indexes {
            let bytes = self.record(index.offset, index.length)?;
            let own = AttachmentIndex { offset: 0, ..index.clone() };
            let found = attachment(&bytes, &own).map_err(|e| damaged(&self.path, e))?;
            // Files are written beside a scenario with these names, so none may point outside of
            // its folder.
            let parts = Path::new(&found.name).components();
            let is_inside = parts.clone().count() > 0
                && parts.into_iter().all(|part| matches!(part, Component::Normal(_)));
            if !is_inside {
                let cause = format!("it has a file named `{}`", found.name);
                return Err(damaged(&self.path, cause));
            }
            files.push((found.name, found.data.into_owned()));
        }
        Ok(files)
    }
}

fn not_a_recording(path: &Path) -> InputError {
    let remedy = "give a recording that `sidestep run SCENARIO --mcap FILE` or \
                  `sidestep export DIR --to mcap` made";
    InputError::new(path.display(), "the file says nothing of a run of sidestep", remedy)
}

pub(super) fn damaged(path: &Path, cause: impl std::fmt::Display) -> InputError {
    let remedy = "the recording is cut off or damaged: copy it again, or run the scenario again";
    InputError::new(path.display(), cause.to_string(), remedy)
}
