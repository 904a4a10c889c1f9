//! One Parquet file: `part-CYCLE.parquet.partial` while it is incomplete, then without `.partial`.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::FileReader;
use parquet::file::serialized_reader::SerializedFileReader;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::TypePtr;
use sidestep_kernel::ports::RecordError;

use crate::disk;
use crate::encode::ColumnEncoder;
use crate::file_list::HashedFile;
use crate::schema;
use crate::sealed_json::FileDigest;

/// Returns the name of the part with `cycle` as its first cycle; names sort in the order of cycles.
pub(crate) fn part_name(cycle: u64) -> String {
    format!("part-{cycle:015}.parquet")
}

/// Returns the first cycle of the part with this name; `None` for any other file.
pub(crate) fn first_cycle(name: &str) -> Option<u64> {
    name.strip_prefix("part-")?.strip_suffix(".parquet")?.parse().ok()
}

/// Returns the complete parts in `folder`, in the order of their rows.
pub(crate) fn parts(folder: &Path) -> Result<Vec<PathBuf>, RecordError> {
    let mut parts = Vec::new();
    for path in disk::list(folder)? {
        if let Some(cycle) = path.file_name().and_then(|n| n.to_str()).and_then(first_cycle) {
            parts.push((cycle, path));
        }
    }
    parts.sort();
    Ok(parts.into_iter().map(|(_, path)| path).collect())
}

/// A part that is being written; it has no valid footer before it is closed.
pub(crate) struct PartWriter {
    path: PathBuf,
    file: SerializedFileWriter<HashedFile>,
    /// CRC-32 of the bytes of each row group.
    checksums: Vec<u32>,
}

impl PartWriter {
    /// Starts the file that is called `path` once it is complete.
    pub(crate) fn create(
        path: PathBuf,
        schema: TypePtr,
        key_values: Vec<KeyValue>,
    ) -> std::result::Result<Self, RecordError> {
        // The pages are encoded already; these properties only declare the contents of the footer.
        let properties = WriterProperties::builder()
            .set_created_by(concat!("sidestep-record ", env!("CARGO_PKG_VERSION")).into())
            .set_statistics_enabled(EnabledStatistics::Chunk)
            .set_offset_index_disabled(true)
            .set_key_value_metadata(Some(key_values))
            .build();
        let partial = disk::partial_path(&path);
        let file = File::create(&partial).map_err(|e| RecordError::new(path.display(), e))?;
        let file = HashedFile::new(file);
        let file = SerializedFileWriter::new(file, schema, Arc::new(properties))
            .map_err(|e| RecordError::new(path.display(), error_cause(e)))?;
        Ok(Self { path, file, checksums: Vec::new() })
    }

    /// Writes the contents of the encoders as one row group.
    pub(crate) fn write_row_group(
        &mut self,
        columns: &mut [ColumnEncoder],
    ) -> std::result::Result<(), RecordError> {
        let checksum = append_chunks(&mut self.file, columns)
            .map_err(|e| RecordError::new(self.path.display(), error_cause(e)))?;
        self.checksums.push(checksum);
        Ok(())
    }

    /// Writes the footer, waits for the disk, gives the file its final name, and returns the digest of its bytes.
    /// `next_cycle` is the first cycle of the next part; `None` at the end of a run.
    pub(crate) fn close(
        self,
        next_cycle: Option<u64>,
    ) -> std::result::Result<FileDigest, RecordError> {
        let Self { path, mut file, checksums } = self;
        let checksums = schema::checksums_to_text(&checksums);
        let next_cycle = next_cycle.map_or("end".to_string(), |cycle| cycle.to_string());
        for (key, value) in [(schema::CHECKSUMS, checksums), (schema::NEXT_CYCLE, next_cycle)] {
            file.append_key_value_metadata(KeyValue::new(key.to_string(), value));
        }
        let partial = disk::partial_path(&path);
        let file =
            file.into_inner().map_err(|e| RecordError::new(path.display(), error_cause(e)))?;
        let digest = file.close().map_err(|e| RecordError::new(path.display(), e))?;
        disk::rename(&partial, &path)?;
        Ok(digest)
    }
}

/// Returns the first cycle after the complete part at `path`; `None` at the end of a run.
pub(crate) fn next_cycle(path: &Path) -> std::result::Result<Option<u64>, RecordError> {
    let file = File::open(path).map_err(|e| RecordError::new(path.display(), e))?;
    let file = SerializedFileReader::new(file)
        .map_err(|e| RecordError::new(path.display(), error_cause(e)))?;
    let text = schema::key_value(file.metadata(), schema::NEXT_CYCLE);
    Ok(text.and_then(|cycle| cycle.parse().ok()))
}

/// Writes a row group and returns the checksum of its bytes.
fn append_chunks(
    file: &mut SerializedFileWriter<HashedFile>,
    columns: &mut [ColumnEncoder],
) -> Result<u32> {
    let mut checksum = crc32fast::Hasher::new();
    let mut group = file.next_row_group()?;
    for column in columns {
        let chunk = column.take_chunk()?;
        checksum.combine(&chunk.checksum);
        group.append_column(&chunk.bytes, chunk.closed)?;
    }
    group.close()?;
    // Detects a full disk now, not only at the next row group.
    file.flush().map_err(|e| ParquetError::External(Box::new(e)))?;
    Ok(checksum.finalize())
}

/// Returns the system's message, without the library's wrapping.
pub(crate) fn error_cause(error: ParquetError) -> String {
    match error {
        ParquetError::External(inner) => inner.to_string(),
        other => other.to_string(),
    }
}
