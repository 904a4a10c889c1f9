//! Frames written to a file.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use ::mcap::records::{MessageHeader, Metadata};
use ::mcap::{Attachment, Compression, McapError, WriteOptions, Writer};
use foxglove::Encode;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::RecordError;
use sidestep_kernel::view::{Frame, Scenery};

use super::check::{LIBRARY, check_mcap, error_text, is_begun_by_us};
use super::frame_encoder::{FrameEncoder, MessageSink};
use super::{METADATA, SCENARIO};
use crate::disk;
use crate::file_set::in_the_way;
use crate::format;
use crate::if_exists::IfExists;
use crate::manifest::Status;
use crate::schema::Provenance;

/// Uncompressed bytes of a chunk: the amount a viewer reads to show one moment.
const CHUNK_BYTES: u64 = 1 << 20;

/// The origin of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct McapProvenance {
    /// The world, e.g. `robots`.
    pub world: String,
    /// The build that makes the recording.
    pub build: String,
    /// Scenario, seed and version that the frames result from.
    pub origin: Provenance,
    /// Files that the scenario names, by their path relative to it.
    pub files: Vec<(String, Vec<u8>)>,
    /// Cycles that the scenario asks for.
    pub cycles_planned: u64,
    /// Number of cycles between frames.
    pub every: u64,
}

/// The end of a recorded run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct McapFooter {
    /// Whether the run reached its end.
    pub status: Status,
    /// Cycles done when the recording ended.
    pub cycles_done: u64,
    /// Digest of the state after `cycles_done` cycles, in hexadecimal.
    pub digest: String,
}

/// Writes frames to an MCAP file. If it is dropped before it is finished, it deletes the file.
pub struct McapRecorder {
    origin: McapProvenance,
    topics: FrameEncoder,
    output: FileOutput,
}

/// The messages of the file.
struct FileOutput {
    path: PathBuf,
    /// `None` once the file is finished.
    writer: Option<Writer<BufWriter<File>>>,
    /// Channels by topic.
    channels: BTreeMap<String, u16>,
    frames: u32,
    buffer: Vec<u8>,
}

impl McapRecorder {
    /// Refuses a path at which a recording must not be created. Only a recording of this program that is as it was written
    /// is replaced, and the remains of one that was stopped or killed.
    ///
    /// # Errors
    /// Something is there that may not be replaced, or that is not a file.
    pub fn check_vacant(path: &Path, existing: IfExists) -> Result<(), InputError> {
        if path.file_name().is_none() {
            let remedy = "give a new file";
            return Err(InputError::new(path.display(), "this is no file name", remedy));
        }
        let is_back = path.components().any(|part| part == std::path::Component::ParentDir);
        if is_back && !disk::parent(path).exists() {
            // Once the folder is made, the path may lead to a file that cannot be seen now.
            let cause = "a folder of this path is not there";
            let remedy = "give the path without `..`";
            return Err(InputError::new(path.display(), cause, remedy));
        }
        let remains = disk::partial_path(path);
        for (place, is_whole) in [(path, true), (&*remains, false)] {
            let Ok(found) = fs::symlink_metadata(place) else { continue };
            if !found.is_file() {
                return Err(in_the_way(place, &found));
            }
            match existing {
                IfExists::Refuse => return Err(exists_already(place, is_whole)),
                IfExists::Replace if is_whole => check_mcap(place).map_err(|e| {
                    InputError::new(e.place(), e.cause(), "move it away, or give another file")
                })?,
                IfExists::Replace if is_begun_by_us(place) => {}
                IfExists::Replace => {
                    let cause = "another program wrote this file";
                    let remedy = "move it away, or give another file";
                    return Err(InputError::new(place.display(), cause, remedy));
                }
            }
        }
        Ok(())
    }

    /// Starts the file that is called `path` once it is complete, with the scenario and everything
    /// that never moves.
    ///
    /// # Errors
    /// An I/O error.
    pub fn create(
        path: &Path,
        origin: McapProvenance,
        scenery: &Scenery,
    ) -> Result<Self, RecordError> {
        let made = disk::missing_folders(disk::parent(path));
        Self::create_in_folder(path, origin, scenery).inspect_err(|_| disk::remove_folders(&made))
    }

    fn create_in_folder(
        path: &Path,
        origin: McapProvenance,
        scenery: &Scenery,
    ) -> Result<Self, RecordError> {
        let partial = disk::partial_path(path);
        let file = fs::create_dir_all(disk::parent(path)).and_then(|()| File::create(&partial));
        let file = file.map_err(|e| RecordError::new(path.display(), e))?;
        let options = write_options(&origin.origin.program_version);
        let writer = options.create(BufWriter::new(file));
        let writer = writer.map_err(|e| RecordError::new(path.display(), error_text(e)));
        let writer = writer.inspect_err(|_| drop(fs::remove_file(&partial)))?;
        let output = FileOutput {
            path: path.to_path_buf(),
            writer: Some(writer),
            channels: BTreeMap::new(),
            frames: 0,
            buffer: Vec::new(),
        };
        let mut recorder = Self { origin, topics: FrameEncoder::with_utc(scenery), output };
        recorder.start(scenery)?;
        Ok(recorder)
    }

    /// Returns the file's name once it is complete.
    pub fn path(&self) -> &Path {
        &self.output.path
    }

    fn start(&mut self, scenery: &Scenery) -> Result<(), RecordError> {
        let scenario = self.origin.origin.scenario.clone().into_bytes();
        self.attach(SCENARIO, "application/toml", &scenario)?;
        let files = std::mem::take(&mut self.origin.files);
        files
            .iter()
            .try_for_each(|(name, bytes)| self.attach(name, "application/octet-stream", bytes))?;
        self.topics.write_scenery(scenery, &mut self.output)
    }

    fn attach(&mut self, name: &str, media_type: &str, data: &[u8]) -> Result<(), RecordError> {
        let attachment = Attachment {
            log_time: self.topics.start_ns,
            create_time: 0,
            name: name.into(),
            media_type: media_type.into(),
            data: data.into(),
        };
        self.output.with_writer(|writer| writer.attach(&attachment))
    }

    /// Appends a frame; frames must be in order of time.
    ///
    /// # Errors
    /// An I/O error; the recording is over then.
    pub fn write_frame(&mut self, frame: &Frame) -> Result<(), RecordError> {
        self.topics.write_frame(frame, &mut self.output)?;
        self.output.frames += 1;
        Ok(())
    }

    /// Finishes the file: waits for the disk, and gives it its name.
    ///
    /// # Errors
    /// An I/O error.
    pub fn finish(self, end: &McapFooter) -> Result<PathBuf, RecordError> {
        let path = self.path().to_path_buf();
        disk::rename(&self.stop(end)?, &path)?;
        Ok(path)
    }

    /// Finishes the file of a run that was stopped: it can be opened, but its name keeps the ending
    /// `.partial`. Returns this name.
    ///
    /// # Errors
    /// An I/O error.
    pub fn stop(mut self, end: &McapFooter) -> Result<PathBuf, RecordError> {
        let metadata = Metadata { name: METADATA.into(), metadata: self.metadata(end) };
        self.output.with_writer(|writer| writer.write_metadata(&metadata))?;
        self.output.with_writer(|writer| writer.finish().map(drop))?;
        let partial = disk::partial_path(self.path());
        let Some(writer) = self.output.writer.take() else { return Ok(partial) };
        let ended = writer.into_inner().into_inner().map_err(|e| e.into_error());
        ended.and_then(|file| file.sync_all()).map_err(|e| {
            let _ = fs::remove_file(&partial);
            RecordError::new(self.path().display(), e)
        })?;
        Ok(partial)
    }

    fn metadata(&self, end: &McapFooter) -> BTreeMap<String, String> {
        let McapProvenance { world, build, origin, cycles_planned, every, .. } = &self.origin;
        let status = match end.status {
            Status::Complete => "complete",
            Status::Running | Status::Incomplete => "incomplete",
        };
        let pairs = [
            ("format", format::CURRENT.to_string()),
            ("program_version", origin.program_version.clone()),
            ("build", build.clone()),
            ("world", world.clone()),
            ("seed", origin.seed.to_string()),
            ("cycles_planned", cycles_planned.to_string()),
            ("cycles_done", end.cycles_done.to_string()),
            ("cycle_s", self.topics.cycle_s.to_string()),
            ("every", every.to_string()),
            ("frames", self.output.frames.to_string()),
            ("status", status.into()),
            ("digest", end.digest.clone()),
        ];
        // Only where times are not those since the start of the run.
        let start_ns = self.topics.start_ns;
        let start = (start_ns > 0).then(|| ("start_utc_ns", start_ns.to_string()));
        let pairs = pairs.into_iter().chain(start);
        pairs.map(|(key, value)| (key.to_string(), value)).collect()
    }
}

impl MessageSink for FileOutput {
    /// Appends a message, and creates a channel for a new topic.
    fn write<T: Encode>(
        &mut self,
        topic: &str,
        log_time: u64,
        message: &T,
    ) -> Result<(), RecordError> {
        let channel_id = match self.channels.get(topic) {
            Some(&id) => id,
            None => self.open_channel::<T>(topic)?,
        };
        let mut bytes = std::mem::take(&mut self.buffer);
        bytes.clear();
        message.encode(&mut bytes).map_err(|e| RecordError::new(self.path.display(), e))?;
        let header =
            MessageHeader { channel_id, sequence: self.frames, log_time, publish_time: log_time };
        let written = self.with_writer(|writer| writer.write_to_known_channel(&header, &bytes));
        self.buffer = bytes;
        written
    }
}

impl FileOutput {
    fn open_channel<T: Encode>(&mut self, topic: &str) -> Result<u16, RecordError> {
        let schema = T::get_schema();
        let id = self.with_writer(|writer| {
            let schema_id = match &schema {
                Some(schema) => writer.add_schema(&schema.name, &schema.encoding, &schema.data)?,
                None => 0,
            };
            writer.add_channel(schema_id, topic, &T::get_message_encoding(), &BTreeMap::new())
        })?;
        self.channels.insert(topic.into(), id);
        Ok(id)
    }

    fn with_writer<T>(
        &mut self,
        work: impl FnOnce(&mut Writer<BufWriter<File>>) -> Result<T, McapError>,
    ) -> Result<T, RecordError> {
        let Some(writer) = &mut self.writer else {
            return Err(RecordError::new(self.path.display(), "the recording is over"));
        };
        work(writer).map_err(|e| RecordError::new(self.path.display(), error_text(e)))
    }
}

impl Drop for McapRecorder {
    fn drop(&mut self) {
        if let Some(writer) = self.output.writer.take() {
            drop(writer.into_inner());
            // An incomplete file, or one that a full disk refused, must not keep its space.
            let _ = fs::remove_file(disk::partial_path(&self.output.path));
        }
    }
}

fn exists_already(path: &Path, is_whole: bool) -> InputError {
    let cause = if is_whole {
        "the file exists already"
    } else {
        "a recording that was stopped or killed is there"
    };
    InputError::new(path.display(), cause, "give another file, or replace it (--replace)")
}

/// Returns the compression, chunk size and origin of files that this version of the program writes.
pub(super) fn write_options(version: &str) -> WriteOptions {
    // Several threads would compress to bytes that differ from those of one.
    WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .compression_threads(0)
        .chunk_size(Some(CHUNK_BYTES))
        .library(format!("{LIBRARY}{version}"))
}
